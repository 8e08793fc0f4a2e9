use std::collections::BTreeSet;

use super::flow::{Call, Riddle, Summary, follow};
use super::*;

/// An image of functions written as halfwords, each at its address; `data` says where data begin in them.
fn image(functions: &[(&str, u32, &[u16])], data: &[u32]) -> Image {
    let mut image = Image::default();
    for (name, address, words) in functions {
        let content: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        image.kinds.insert(*address, true);
        image.add_function(*address, content.len() as u32, (*name).to_owned());
        image.sections.push(Section { address: *address, content, writable: false });
    }
    image.kinds.extend(data.iter().map(|address| (*address, false)));
    image
}

fn summary(image: &Image, name: &str) -> Summary {
    follow(image, image.function_named(name).unwrap())
}

fn calls(list: &[(u32, u32)]) -> BTreeSet<Call> {
    list.iter().map(|&(to, depth)| Call { to, depth }).collect()
}

const RETURNS: &[u16] = &[0x4770];

#[test]
fn a_call_through_the_literal_pool_is_a_call() {
    // push {r4, lr}; ldr r3, [pc, #4]; blx r3; pop {r4, pc}; .word g + 1
    let f: &[u16] = &[0xB510, 0x4B01, 0x4798, 0xBD10, 0x2001, 0x0000];
    let image = image(&[("f", 0x1000, f), ("g", 0x2000, RETURNS)], &[0x1008]);
    let expected = Summary { frame: 8, calls: calls(&[(0x2000, 8)]), ..Summary::default() };
    assert_eq!(summary(&image, "f"), expected);
}

#[test]
fn a_register_that_nothing_is_known_of_is_an_indirect_call() {
    // push {lr}; blx r0; pop {pc}
    let image1 = image(&[("f", 0x1000, &[0xB500, 0x4780, 0xBD00])], &[]);
    assert_eq!(summary(&image1, "f").riddles, BTreeSet::from([(0x1002, Riddle::IndirectCall)]));
    // Two ways meet that have different functions in r3:
    // push {lr}; ldr r3, [pc, #8]; cmp r0, #0; beq +0; ldr r3, [pc, #8]; blx r3; pop {pc}; nop; .word g, h
    let f: &[u16] =
        &[0xB500, 0x4B03, 0x2800, 0xD000, 0x4B02, 0x4798, 0xBD00, 0x46C0, 0x2001, 0x0000, 0x3001, 0x0000];
    let image2 = image(&[("f", 0x1000, f), ("g", 0x2000, RETURNS), ("h", 0x3000, RETURNS)], &[0x1010]);
    assert_eq!(summary(&image2, "f").riddles, BTreeSet::from([(0x100A, Riddle::IndirectCall)]));
}

#[test]
fn a_table_of_functions_is_known_in_flash_and_unknown_in_ram() {
    // push {lr}; ldr r0, [pc, #4]; ldr r1, [r0, #4]; blx r1; pop {pc}; nop; .word table
    let f: &[u16] = &[0xB500, 0x4802, 0x6841, 0x4788, 0xBD00, 0x46C0, 0x4000, 0x0000];
    let mut image = image(&[("f", 0x1000, f), ("g", 0x2000, RETURNS)], &[0x100C]);
    let content = vec![0, 0, 0, 0, 0x01, 0x20, 0, 0];
    image.sections.push(Section { address: 0x4000, content, writable: false });
    assert_eq!(summary(&image, "f").calls, calls(&[(0x2000, 4)]));
    image.sections.last_mut().unwrap().writable = true;
    assert_eq!(summary(&image, "f").riddles, BTreeSet::from([(0x1006, Riddle::IndirectCall)]));
}

#[test]
fn a_jump_to_another_function_is_a_call_and_a_far_jump_inside_is_none() {
    // f: push {r4, lr}; bl f+8; nop; pop {r4, pc}  (at f+8)
    let f: &[u16] = &[0xB510, 0xF000, 0xF801, 0x46C0, 0xBD10];
    // g: b h
    let g: &[u16] = &[0xE07E];
    let image = image(&[("f", 0x1000, f), ("g", 0x1F00, g), ("h", 0x2000, RETURNS)], &[]);
    assert_eq!(summary(&image, "f"), Summary { frame: 8, ..Summary::default() });
    assert_eq!(summary(&image, "g"), Summary { calls: calls(&[(0x2000, 0)]), ..Summary::default() });
}

#[test]
fn what_leads_nowhere_is_reported() {
    // f: push {lr}; bl 0x2002 (inside g); pop {pc}   g: nop; nop, and no way on
    let f: &[u16] = &[0xB500, 0xF000, 0xFFFE, 0xBD00];
    let image = image(&[("f", 0x1000, f), ("g", 0x2000, &[0x46C0, 0x46C0]), ("h", 0x3000, &[0xDE00])], &[]);
    assert_eq!(summary(&image, "f").riddles, BTreeSet::from([(0x1002, Riddle::NoFunction(0x2002))]));
    assert_eq!(summary(&image, "g").riddles, BTreeSet::from([(0x2002, Riddle::RunsOff)]));
    assert_eq!(summary(&image, "h").traps, BTreeSet::from([0x3000]));
}

#[test]
fn frames_are_added_up_however_they_are_made() {
    let frame = |words: &[u16], data: &[u32]| {
        let found = summary(&image(&[("f", 0x1000, words)], data), "f");
        assert_eq!(found.riddles, BTreeSet::new(), "{words:04x?}");
        found.frame
    };
    // push {r4-r7, lr}; sub sp, #508; sub sp, #64; add sp, #508; add sp, #64; pop {r4-r7, pc}
    assert_eq!(frame(&[0xB5F0, 0xB0FF, 0xB090, 0xB07F, 0xB010, 0xBDF0], &[]), 592);
    // push {r4-r7, lr}; add r7, sp, #12; sub sp, #64; subs r6, r7, #7; subs r6, #5; mov sp, r6; pop {r4-r7, pc}
    assert_eq!(frame(&[0xB5F0, 0xAF03, 0xB090, 0x1FFE, 0x3E05, 0x46B5, 0xBDF0], &[]), 84);
    // push {r4, lr}; ldr r4, [pc, #8]; add sp, r4; movs r4, #128; lsls r4, #5; add sp, r4; pop {r4, pc}; .word -4096
    let f: &[u16] = &[0xB510, 0x4C02, 0x44A5, 0x2480, 0x0164, 0x44A5, 0xBD10, 0xF000, 0xFFFF];
    let mut f = f.to_vec();
    f.insert(7, 0x46C0);
    f[1] = 0x4C03;
    assert_eq!(frame(&f, &[0x1010]), 4104);
    // push {lr}; pop {r3}; bx r3
    assert_eq!(frame(&[0xB500, 0xBC08, 0x4718], &[]), 4);
}

#[test]
fn a_frame_of_unknown_size_is_reported() {
    // push {r4, lr}; add sp, r0; pop {r4, pc}
    let found = summary(&image(&[("f", 0x1000, &[0xB510, 0x4485, 0xBD10])], &[]), "f");
    assert!(found.riddles.contains(&(0x1002, Riddle::Stack)), "{found:?}");
}

#[test]
fn every_arm_of_a_jump_table_is_followed() {
    // push {lr}; cmp r0, #1; add r0, pc; ldrb r0, [r0, #4]; lsls r0, #1; add pc, r0; .byte 0, 3; bl g; pop {pc};
    // bl h; pop {pc}
    let f: &[u16] = &[
        0xB500, 0x2801, 0x4478, 0x7900, 0x0040, 0x4487, 0x0300, 0xF000, 0xFFF7, 0xBD00, 0xF001, 0xFFF4,
        0xBD00,
    ];
    let mut image = image(&[("f", 0x1000, f), ("g", 0x2000, RETURNS), ("h", 0x3000, RETURNS)], &[0x100C]);
    image.kinds.insert(0x100E, true);
    let found = summary(&image, "f");
    assert_eq!(found.riddles, BTreeSet::new());
    let reached: Vec<u32> = found.calls.iter().map(|call| call.to).collect();
    assert_eq!(reached, [0x2000, 0x3000]);
}

#[test]
fn a_table_of_addresses_is_followed_and_one_that_is_not_there_is_reported() {
    // push {lr}; mov pc, r0; .word f+8+1; bl g; pop {pc}
    let f: &[u16] = &[0xB500, 0x4687, 0x1009, 0x0000, 0xF000, 0xFFFA, 0xBD00];
    let mut image = image(&[("f", 0x1000, f), ("g", 0x2000, RETURNS)], &[0x1004]);
    image.kinds.insert(0x1008, true);
    assert_eq!(summary(&image, "f").calls, calls(&[(0x2000, 4)]));
    image.kinds.insert(0x1004, true);
    assert_eq!(summary(&image, "f").riddles, BTreeSet::from([(0x1002, Riddle::IndirectCall)]));
}

/// f calls g and h, g calls h, h calls a division; each frame is 8 bytes.
fn small_graph() -> Image {
    // push {r4, lr}; bl …; bl …; pop {r4, pc}
    let f: &[u16] = &[0xB510, 0xF000, 0xF87D, 0xF000, 0xF8FB, 0xBD10];
    let g: &[u16] = &[0xB510, 0xF000, 0xF87D, 0xBD10];
    let h: &[u16] = &[0xB510, 0xF000, 0xF87D, 0xBD10];
    image(&[("f", 0x1000, f), ("g", 0x1100, g), ("h", 0x1200, h), ("__aeabi_ldivmod", 0x1300, RETURNS)], &[])
}

#[test]
fn an_offence_is_told_by_the_shortest_chain_of_calls() {
    let image = small_graph();
    let graph = Graph::from(&image, image.function_named("f").unwrap());
    let names: Vec<String> = graph.reachable().map(Function::name).collect();
    assert_eq!(names, ["f", "g", "h", "__aeabi_ldivmod"]);
    let what = Offence::WideArithmetic.what();
    assert_eq!(graph.offences(&[]), [format!("{what}: f → h → __aeabi_ldivmod")]);
}

#[test]
fn the_stack_is_that_of_the_deepest_chain() {
    let image = small_graph();
    let stack = |name| Graph::from(&image, image.function_named(name).unwrap()).stack();
    let chain = ["f (8)", "g (8)", "h (8)"].map(str::to_owned).to_vec();
    assert_eq!(stack("f"), Stack::Bounded { bytes: 24, chain });
    assert_eq!(
        stack("__aeabi_ldivmod"),
        Stack::Bounded { bytes: 0, chain: vec!["__aeabi_ldivmod (0)".into()] }
    );
}

#[test]
fn recursion_has_no_bound_and_says_its_circle() {
    // f: push {lr}; bl g; pop {pc}   g: push {lr}; bl f; pop {pc}
    let f: &[u16] = &[0xB500, 0xF000, 0xF87D, 0xBD00];
    let g: &[u16] = &[0xB500, 0xF7FF, 0xFF7D, 0xBD00];
    let image = image(&[("f", 0x1000, f), ("g", 0x1100, g)], &[]);
    let stack = Graph::from(&image, image.function_named("f").unwrap()).stack();
    assert_eq!(stack, Stack::Recursion(["f", "g", "f"].map(str::to_owned).to_vec()));
}

#[test]
fn an_indirect_call_is_an_offence_unless_it_is_allowed() {
    let image = image(&[("f", 0x1000, &[0xB500, 0x4780, 0xBD00])], &[]);
    let graph = Graph::from(&image, image.function_named("f").unwrap());
    assert_eq!(graph.offences(&[]), ["an indirect call at 0x1002: f"]);
    assert_eq!(graph.offences(&["f"]), [""; 0]);
    assert!(matches!(graph.stack(), Stack::Unknown(_)), "{:?}", graph.stack());
}

#[test]
fn a_function_that_is_not_there_is_told_with_what_is_like_it() {
    let image = image(&[("_ZN4tick4tick17h9b533650bf6aebf5E", 0x1000, RETURNS)], &[]);
    assert_eq!(image.function_named("tick::tick").unwrap().address, 0x1000);
    let error = image.function_named("other::tick").unwrap_err().to_string();
    assert_eq!(error, "the image has no function other::tick; like it: tick::tick");
}

#[test]
fn a_bridge_from_ram_to_flash_leads_where_it_says() {
    // push {r0, r1}; ldr r0, [pc, #4]; str r0, [sp, #4]; pop {r0, pc}; .word g + 1
    let bridge: &[u16] = &[0xB403, 0x4801, 0x9001, 0xBD01, 0x2001, 0x0000];
    let name = "__Thumbv6MABSLongThunk_g";
    let image = image(&[(name, 0x1000, bridge), ("g", 0x2000, RETURNS)], &[0x1008]);
    let expected = Summary { frame: 8, calls: calls(&[(0x2000, 0)]), ..Summary::default() };
    assert_eq!(summary(&image, name), expected);
}

/// An ELF file with `.text` (4 bytes of code, loaded where it runs), `.data` (8 bytes, loaded from flash, run in RAM)
/// and `.bss` (100 bytes), a function, a mapping symbol and a label of assembler.
fn small_elf() -> Vec<u8> {
    const NAMES: &[u8] = b"\0f\0$t\0label\0";
    let symbols = [
        [0, 0, 0, 0],
        [1, 0x1001, 2, STT_FUNC as u32 | 1 << 16],
        [3, 0x1000, 0, STT_NOTYPE as u32 | 1 << 16],
        [6, 0x1002, 0, STT_NOTYPE as u32 | 1 << 16],
    ];
    let mut file = Vec::new();
    let put32 = |file: &mut Vec<u8>, words: &[u32]| {
        file.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    };
    file.extend(*b"\x7FELF\x01\x01\x01\0\0\0\0\0\0\0\0\0");
    // Type EXEC, machine ARM; version, entry, program headers, section headers, flags.
    put32(&mut file, &[0x0028_0002, 1, 0x1001, 52, 116, 0]);
    // Sizes and counts: 52, 32 × 2, 40 × 6, names in section 5.
    put32(&mut file, &[0x0020_0034, 0x0028_0002, 0x0005_0006]);
    put32(&mut file, &[PT_LOAD, 356, 0x1000, 0x1000, 4, 4, 5, 4]);
    put32(&mut file, &[PT_LOAD, 360, 0x2000_0000, 0x1004, 8, 108, 6, 4]);
    let section = |kind, flags, address, offset, size, link, entry| {
        [0, kind, flags, address, offset, size, link, 0, 4, entry]
    };
    put32(&mut file, &[0; 10]);
    put32(&mut file, &section(1, SHF_ALLOC | SHF_EXECINSTR, 0x1000, 356, 4, 0, 0));
    put32(&mut file, &section(1, SHF_ALLOC | SHF_WRITE, 0x2000_0000, 360, 8, 0, 0));
    put32(&mut file, &section(SHT_NOBITS, SHF_ALLOC | SHF_WRITE, 0x2000_0008, 368, 100, 0, 0));
    put32(&mut file, &section(2, 0, 0, 368, 64, 5, 16));
    put32(&mut file, &section(3, 0, 0, 432, NAMES.len() as u32, 0, 0));
    assert_eq!(file.len(), 356);
    put32(&mut file, &[0x4770_4770, 7, 8]);
    for [name, value, size, kind] in symbols {
        // Kind and section share the last word.
        put32(&mut file, &[name, value, size, kind & 0xFF | (kind >> 16) << 16]);
    }
    file.extend(NAMES);
    file
}

#[test]
fn memory_and_symbols_are_read_from_the_file() {
    let image = Image::parse(&small_elf()).unwrap();
    assert_eq!((image.flash, image.ram), (12, 108));
    let functions: Vec<(u32, u32, String)> =
        image.functions.values().map(|f| (f.address, f.end, f.name())).collect();
    assert_eq!(functions, [(0x1000, 0x1002, "f".into()), (0x1002, 0x1004, "label".into())]);
    assert_eq!(image.constant_word(0x1000), Some(0x4770_4770));
    assert_eq!(image.constant_word(0x2000_0000), None);
}

#[test]
fn what_is_no_image_is_refused() {
    assert!(Image::parse(b"no image").is_err());
    let mut other = small_elf();
    other[18] = 62;
    assert!(Image::parse(&other).unwrap_err().to_string().contains("another processor"));
    let mut stripped = small_elf();
    // The symbol table is called something else.
    stripped[116 + 4 * 40 + 4] = 1;
    assert!(Image::parse(&stripped).unwrap_err().to_string().contains("no functions"));
}
