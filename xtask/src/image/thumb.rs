//! Decoding of Thumb instructions, as far as calls and the stack ask for it.
//!
//! Covers all of ARMv6-M. Of the 32-bit instructions that ARMv7-M and ARMv8-M add, those that branch, change the stack
//! pointer or make an address are told apart; the rest only says which registers it writes, rather one too many than
//! one too few.

/// Number of the stack pointer among the registers.
pub(crate) const SP: u8 = 13;
/// Number of the link register.
pub(crate) const LR: u8 = 14;
/// Number of the program counter.
pub(crate) const PC: u8 = 15;

/// What an instruction does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Op {
    /// Writes one register.
    Set {
        register: u8,
        value: Expression,
    },
    /// Writes these registers (a bit each), with nothing that could be known before.
    Clobber(u16),
    Push(u16),
    Pop(u16),
    Branch(u32),
    BranchIf(u32),
    /// BL: a call, or a far jump inside a function.
    Call(u32),
    CallRegister(u8),
    BranchRegister(u8),
    /// Goes on at a place that a table beside it names.
    Jump(Table),
    /// UDF or BKPT: there is no way on.
    Trap,
    /// `If-then`: the next instructions, that many, are done or not.
    IfThen(u8),
}

/// What a register becomes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Expression {
    Constant(u32),
    Copy(u8),
    Plus(u8, i32),
    Sum(u8, u8),
    Minus(u8),
    ShiftedLeft(u8, u8),
    /// The upper half replaced.
    WithUpperHalf(u8, u16),
    /// The word at this address.
    Literal(u32),
    /// The word at the register plus an offset.
    Word(u8, u32),
}

/// How the entries of a jump table lie in the code and what they say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Table {
    /// `add pc, r`: distances in halfwords, in bytes or halfwords as the load before it says.
    Distances,
    /// `tbb`: distances in halfwords, a byte each.
    Bytes,
    /// `tbh`: distances in halfwords, a halfword each.
    Halfwords,
    /// `mov pc, r`: addresses.
    Words,
}

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Instruction {
    /// Bytes: 2 or 4.
    pub(crate) length: u32,
    pub(crate) op: Op,
}

/// Decodes the instruction at `address`; `second` is the halfword after `first`, where there is one.
///
/// `None`: a 32-bit instruction that is cut off.
pub(crate) fn decode(address: u32, first: u16, second: Option<u16>) -> Option<Instruction> {
    if first >> 11 < 0b11101 {
        return Some(Instruction { length: 2, op: narrow(address, first) });
    }
    Some(Instruction { length: 4, op: wide(address, first, second?) })
}

/// A field of an instruction.
fn bits(word: u16, low: u32, count: u32) -> u16 {
    (word >> low) & ((1 << count) - 1)
}

/// A field that names one of the low registers.
fn low_register(word: u16, low: u32) -> u8 {
    bits(word, low, 3) as u8
}

/// What `pc` reads as in an instruction at this address.
fn pc(address: u32) -> u32 {
    address.wrapping_add(4)
}

fn target(address: u32, distance: i32) -> u32 {
    pc(address).wrapping_add_signed(distance)
}

/// The lowest `width` bits of a value as a signed number.
fn signed(value: u32, width: u32) -> i32 {
    let unused = 32 - width;
    (value << unused).cast_signed() >> unused
}

fn set(register: u8, value: Expression) -> Op {
    Op::Set { register, value }
}

const NOTHING: Op = Op::Clobber(0);

fn narrow(address: u32, word: u16) -> Op {
    let immediate = i32::from(bits(word, 0, 8));
    let (low, high) = (low_register(word, 0), low_register(word, 8));
    match word >> 11 {
        0b00000 => set(low, Expression::ShiftedLeft(low_register(word, 3), bits(word, 6, 5) as u8)),
        0b00011 => add_or_subtract(word),
        0b00100 => set(high, Expression::Constant(u32::from(bits(word, 0, 8)))),
        0b00110 => set(high, Expression::Plus(high, immediate)),
        0b00111 => set(high, Expression::Plus(high, -immediate)),
        0b01000 => data_processing(word),
        0b01001 => {
            set(high, Expression::Literal((pc(address) & !3).wrapping_add(u32::from(bits(word, 0, 8)) * 4)))
        }
        0b01010 | 0b01011 => register_offset(word),
        0b01101 => set(low, Expression::Word(low_register(word, 3), u32::from(bits(word, 6, 5)) * 4)),
        0b00101 | 0b01100 | 0b01110 | 0b10000 | 0b10010 => NOTHING,
        0b00001 | 0b00010 | 0b01111 | 0b10001 => Op::Clobber(1 << low),
        0b10011 | 0b11000 => Op::Clobber(1 << high),
        0b10100 => {
            let place = (pc(address) & !3).wrapping_add(u32::from(bits(word, 0, 8)) * 4);
            set(high, Expression::Constant(place))
        }
        0b10101 => set(high, Expression::Plus(SP, immediate * 4)),
        0b10110 | 0b10111 => miscellaneous(address, word),
        0b11001 => Op::Clobber(bits(word, 0, 8) | 1 << high),
        0b11100 => Op::Branch(target(address, signed(u32::from(bits(word, 0, 11)), 11) * 2)),
        _ => conditional(address, word),
    }
}

/// Three registers, or two and three bits.
fn add_or_subtract(word: u16) -> Op {
    let (to, from, third) = (low_register(word, 0), low_register(word, 3), low_register(word, 6));
    match bits(word, 9, 2) {
        0b00 => set(to, Expression::Sum(from, third)),
        0b01 => Op::Clobber(1 << to),
        0b10 => set(to, Expression::Plus(from, i32::from(third))),
        _ => set(to, Expression::Plus(from, -i32::from(third))),
    }
}

fn data_processing(word: u16) -> Op {
    let low = low_register(word, 0);
    if word >> 10 == 0b01_0001 {
        return high_registers(word);
    }
    match bits(word, 6, 4) {
        // TST, CMP and CMN only set flags.
        0b1000 | 0b1010 | 0b1011 => NOTHING,
        0b1001 => set(low, Expression::Minus(low_register(word, 3))),
        _ => Op::Clobber(1 << low),
    }
}

/// ADD, CMP, MOV, BX and BLX with any register.
fn high_registers(word: u16) -> Op {
    let from = bits(word, 3, 4) as u8;
    let to = low_register(word, 0) | (bits(word, 7, 1) as u8) << 3;
    match (bits(word, 8, 2), to) {
        (0b00, PC) => Op::Jump(Table::Distances),
        (0b00, _) if from == PC => Op::Clobber(1 << to),
        (0b00, _) => set(to, Expression::Sum(to, from)),
        (0b10, PC) => Op::Jump(Table::Words),
        (0b10, _) if from == PC => Op::Clobber(1 << to),
        (0b10, _) => set(to, Expression::Copy(from)),
        (0b11, _) if bits(word, 7, 1) == 0 => Op::BranchRegister(from),
        (0b11, _) => Op::CallRegister(from),
        _ => NOTHING,
    }
}

/// Loads and stores at a register plus a register.
fn register_offset(word: u16) -> Op {
    let loads = bits(word, 9, 3) >= 0b011;
    if loads { Op::Clobber(1 << low_register(word, 0)) } else { NOTHING }
}

fn miscellaneous(address: u32, word: u16) -> Op {
    let list = bits(word, 0, 8);
    match bits(word, 8, 4) {
        0b0000 if word & 0x80 == 0 => set(SP, Expression::Plus(SP, i32::from(bits(word, 0, 7)) * 4)),
        0b0000 => set(SP, Expression::Plus(SP, -i32::from(bits(word, 0, 7)) * 4)),
        0b0001 | 0b0011 | 0b1001 | 0b1011 => {
            let distance = bits(word, 9, 1) << 6 | bits(word, 3, 5) << 1;
            Op::BranchIf(target(address, i32::from(distance)))
        }
        0b0010 | 0b1010 => Op::Clobber(1 << low_register(word, 0)),
        0b0100 => Op::Push(list),
        0b0101 => Op::Push(list | 1 << LR),
        0b1100 => Op::Pop(list),
        0b1101 => Op::Pop(list | 1 << PC),
        0b1110 => Op::Trap,
        0b1111 if bits(word, 0, 4) != 0 => Op::IfThen(4 - bits(word, 0, 4).trailing_zeros() as u8),
        _ => NOTHING,
    }
}

/// Conditional branches and what shares their place.
fn conditional(address: u32, word: u16) -> Op {
    match bits(word, 8, 4) {
        0b1110 => Op::Trap,
        0b1111 => NOTHING,
        _ => Op::BranchIf(target(address, signed(u32::from(bits(word, 0, 8)), 8) * 2)),
    }
}

fn wide(address: u32, first: u16, second: u16) -> Op {
    let branches = first >> 11 == 0b11110 && second & 0x8000 != 0;
    match first >> 9 {
        _ if branches => wide_branch(address, first, second),
        0b111_0100 if first & 0x40 == 0 => load_or_store_many(first, second),
        0b111_0100 => load_or_store_two(first, second),
        0b111_0101 => shifted_register(first, second),
        0b111_1000 | 0b111_1010 => modified_immediate(first, second),
        0b111_1001 | 0b111_1011 => plain_immediate(address, first, second),
        0b111_1100 => load_or_store_one(address, first, second),
        0b111_1101 => Op::Clobber(register_bits(second, &[8, 12])),
        _ => coprocessor(first, second),
    }
}

/// The registers that these fields name, a bit each, without the program counter and the stack pointer.
fn register_bits(word: u16, fields: &[u32]) -> u16 {
    let named = fields.iter().fold(0_u16, |set, &low| set | 1 << bits(word, low, 4));
    named & !(1 << PC | 1 << SP)
}

fn wide_branch(address: u32, first: u16, second: u16) -> Op {
    match (bits(second, 14, 1), bits(second, 12, 1)) {
        (1, 1) => Op::Call(target(address, far_distance(first, second))),
        (0, 1) => Op::Branch(target(address, far_distance(first, second))),
        (0, 0) if bits(first, 7, 3) != 0b111 => Op::BranchIf(target(address, near_distance(first, second))),
        _ => special(first, second),
    }
}

fn far_distance(first: u16, second: u16) -> i32 {
    let sign = bits(first, 10, 1);
    let one = |bit: u32| u32::from(bits(second, bit, 1) ^ sign ^ 1);
    let upper = u32::from(sign) << 24 | one(13) << 23 | one(11) << 22;
    signed(upper | u32::from(bits(first, 0, 10)) << 12 | u32::from(bits(second, 0, 11)) << 1, 25)
}

fn near_distance(first: u16, second: u16) -> i32 {
    let bit = |word: u16, low: u32| u32::from(bits(word, low, 1));
    let upper = bit(first, 10) << 20 | bit(second, 11) << 19 | bit(second, 13) << 18;
    signed(upper | u32::from(bits(first, 0, 6)) << 12 | u32::from(bits(second, 0, 11)) << 1, 21)
}

/// Special registers, barriers, hints and the trap.
fn special(first: u16, second: u16) -> Op {
    match first {
        0xF7F0..=0xF7FF if second >> 12 == 0b1010 => Op::Trap,
        // MSR to one of the two stack pointers.
        0xF380..=0xF39F if matches!(second & 0xFF, 8 | 9) => Op::Clobber(1 << SP),
        0xF3E0..=0xF3FF => Op::Clobber(register_bits(second, &[8])),
        _ => NOTHING,
    }
}

fn load_or_store_many(first: u16, second: u16) -> Op {
    match first {
        0xE92D => return Op::Push(second),
        0xE8BD => return Op::Pop(second),
        _ => {}
    }
    let (loads, writes_base) = (first & 0x10 != 0, first & 0x20 != 0);
    if loads && second & 1 << PC != 0 {
        return Op::Jump(Table::Words);
    }
    let base = if writes_base { 1 << bits(first, 0, 4) } else { 0 };
    Op::Clobber(base | if loads { second } else { 0 })
}

fn load_or_store_two(first: u16, second: u16) -> Op {
    if first & 0xFFF0 == 0xE8D0 && second & 0xFFE0 == 0xF000 {
        let halfwords = second & 0x10 != 0;
        return match (bits(first, 0, 4) as u8, halfwords) {
            (PC, true) => Op::Jump(Table::Halfwords),
            (PC, false) => Op::Jump(Table::Bytes),
            _ => Op::Jump(Table::Words),
        };
    }
    let base = if first & 0x20 != 0 { 1 << bits(first, 0, 4) } else { 0 };
    Op::Clobber(base | register_bits(second, &[0, 8, 12]))
}

fn shifted_register(first: u16, second: u16) -> Op {
    let (to, from) = (bits(second, 8, 4) as u8, bits(second, 0, 4) as u8);
    let unshifted = second & 0x70F0 == 0;
    match first {
        _ if to == PC => NOTHING,
        0xEA4F if unshifted => set(to, Expression::Copy(from)),
        0xEB00..=0xEB1F if unshifted => set(to, Expression::Sum(bits(first, 0, 4) as u8, from)),
        _ => Op::Clobber(1 << to),
    }
}

fn modified_immediate(first: u16, second: u16) -> Op {
    let (to, from) = (bits(second, 8, 4) as u8, bits(first, 0, 4) as u8);
    let value = expanded(first, second);
    match bits(first, 5, 4) {
        _ if to == PC => NOTHING,
        0b0010 if from == PC => set(to, Expression::Constant(value)),
        0b1000 => set(to, Expression::Plus(from, value.cast_signed())),
        0b1101 => set(to, Expression::Plus(from, value.cast_signed().wrapping_neg())),
        _ => Op::Clobber(1 << to),
    }
}

/// The twelve bits `i:imm3:imm8` of an instruction.
fn twelve_bits(first: u16, second: u16) -> u32 {
    u32::from(bits(first, 10, 1) << 11 | bits(second, 12, 3) << 8 | bits(second, 0, 8))
}

/// The constant that those twelve bits stand for in a data-processing instruction.
fn expanded(first: u16, second: u16) -> u32 {
    let packed = twelve_bits(first, second);
    let byte = packed & 0xFF;
    match packed >> 8 {
        0b0000 => byte,
        0b0001 => byte << 16 | byte,
        0b0010 => byte << 24 | byte << 8,
        0b0011 => byte * 0x0101_0101,
        _ => (byte | 0x80).rotate_right(packed >> 7),
    }
}

fn plain_immediate(address: u32, first: u16, second: u16) -> Op {
    let (to, from) = (bits(second, 8, 4) as u8, bits(first, 0, 4) as u8);
    let offset = twelve_bits(first, second).cast_signed();
    let half = bits(first, 0, 4) << 12 | twelve_bits(first, second) as u16;
    let here = pc(address) & !3;
    match first & 0xFBF0 {
        0xF200 if from == PC => set(to, Expression::Constant(here.wrapping_add_signed(offset))),
        0xF2A0 if from == PC => set(to, Expression::Constant(here.wrapping_add_signed(-offset))),
        0xF200 => set(to, Expression::Plus(from, offset)),
        0xF2A0 => set(to, Expression::Plus(from, -offset)),
        0xF240 => set(to, Expression::Constant(u32::from(half))),
        0xF2C0 => set(to, Expression::WithUpperHalf(to, half)),
        _ => Op::Clobber(1 << to),
    }
}

fn load_or_store_one(address: u32, first: u16, second: u16) -> Op {
    let (register, base) = (bits(second, 12, 4) as u8, bits(first, 0, 4) as u8);
    let loads_word = first & 0xFF70 == 0xF850;
    match (first, second & 0xFFF) {
        (0xF84D, 0xD04) => return Op::Push(1 << register),
        (0xF85D, 0xB04) => return Op::Pop(1 << register),
        _ => {}
    }
    if loads_word && register == PC {
        return Op::Jump(Table::Words);
    }
    let offset = u32::from(bits(second, 0, 12));
    if loads_word && base == PC {
        let here = pc(address) & !3;
        let place = if first & 0x80 == 0 { here.wrapping_sub(offset) } else { here.wrapping_add(offset) };
        return set(register, Expression::Literal(place));
    }
    if first & 0xFFF0 == 0xF8D0 {
        return set(register, Expression::Word(base, offset));
    }
    let writes_base = first & 0x80 == 0 && second & 0x900 == 0x900;
    let (base, loads) = (if writes_base { 1 << base } else { 0 }, first & 0x10 != 0);
    Op::Clobber(base | if loads { register_bits(second, &[12]) } else { 0 })
}

/// There is no coprocessor on these boards; whatever such an instruction may write is forgotten.
fn coprocessor(first: u16, second: u16) -> Op {
    let base = if first & 0x20 != 0 { 1 << bits(first, 0, 4) } else { register_bits(first, &[0]) };
    Op::Clobber(base | register_bits(second, &[8, 12]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: u32 = 0x1000;

    fn op(first: u16) -> Op {
        let decoded = decode(AT, first, None).unwrap();
        assert_eq!(decoded.length, 2);
        decoded.op
    }

    fn op2(first: u16, second: u16) -> Op {
        let decoded = decode(AT, first, Some(second)).unwrap();
        assert_eq!(decoded.length, 4);
        decoded.op
    }

    #[test]
    fn calls_and_branches_know_where_they_go() {
        assert_eq!(op2(0xF000, 0xF800), Op::Call(0x1004));
        assert_eq!(op2(0xF7FF, 0xFFFE), Op::Call(0x1000));
        assert_eq!(op2(0xF003, 0xFAF5), Op::Call(0x1004 + 0x35EA));
        assert_eq!(op2(0xF000, 0xB800), Op::Branch(0x1004));
        assert_eq!(op2(0xF7FF, 0xBFFE), Op::Branch(0x1000));
        assert_eq!(op2(0xF43F, 0xAFFE), Op::BranchIf(0x1000));
        assert_eq!(op2(0xF000, 0x8001), Op::BranchIf(0x1006));
        assert_eq!(op(0xE000), Op::Branch(0x1004));
        assert_eq!(op(0xE7FE), Op::Branch(0x1000));
        assert_eq!(op(0xD0FE), Op::BranchIf(0x1000));
        assert_eq!(op(0xD101), Op::BranchIf(0x1006));
        assert_eq!(op(0xB100), Op::BranchIf(0x1004));
        assert_eq!(op(0xB908), Op::BranchIf(0x1006));
        assert_eq!((op(0x4770), op(0x4718)), (Op::BranchRegister(LR), Op::BranchRegister(3)));
        assert_eq!((op(0x4798), op(0x47A0)), (Op::CallRegister(3), Op::CallRegister(4)));
        assert_eq!((op(0xDEFE), op(0xBE00), op2(0xF7F0, 0xA000)), (Op::Trap, Op::Trap, Op::Trap));
    }

    #[test]
    fn whatever_moves_the_stack_pointer_is_told() {
        let moved = |bytes| set(SP, Expression::Plus(SP, bytes));
        assert_eq!((op(0xB500), op(0xB5F0)), (Op::Push(1 << LR), Op::Push(1 << LR | 0xF0)));
        assert_eq!((op(0xBD00), op(0xBC0F)), (Op::Pop(1 << PC), Op::Pop(0xF)));
        assert_eq!((op(0xB084), op(0xB004), op(0xB0FF)), (moved(-16), moved(16), moved(-508)));
        assert_eq!(op(0x44A5), set(SP, Expression::Sum(SP, 4)));
        assert_eq!(op(0x46B5), set(SP, Expression::Copy(6)));
        assert_eq!(op2(0xE92D, 0x4FF0), Op::Push(0x4FF0));
        assert_eq!(op2(0xE8BD, 0x8FF0), Op::Pop(0x8FF0));
        assert_eq!(op2(0xF5AD, 0x5D00), moved(-0x2000));
        assert_eq!(op2(0xF2AD, 0x4D04), moved(-0x404));
        assert_eq!((op2(0xF84D, 0x7D04), op2(0xF85D, 0x7B04)), (Op::Push(1 << 7), Op::Pop(1 << 7)));
        assert_eq!(op2(0xF381, 0x8808), Op::Clobber(1 << SP));
    }

    #[test]
    fn addresses_are_followed_through_registers() {
        assert_eq!(op(0x4A2C), set(2, Expression::Literal(0x1004 + 0xB0)));
        assert_eq!(decode(0x1002, 0x4A00, None).unwrap().op, set(2, Expression::Literal(0x1004)));
        assert_eq!(op(0xA302), set(3, Expression::Constant(0x100C)));
        assert_eq!(op(0xAF03), set(7, Expression::Plus(SP, 12)));
        assert_eq!(op(0x4623), set(3, Expression::Copy(4)));
        assert_eq!(
            (op(0x2001), op(0x3007)),
            (set(0, Expression::Constant(1)), set(0, Expression::Plus(0, 7)))
        );
        assert_eq!(
            (op(0x3F05), op(0x1FFE)),
            (set(7, Expression::Plus(7, -5)), set(6, Expression::Plus(7, -7)))
        );
        assert_eq!(op(0x4264), set(4, Expression::Minus(4)));
        assert_eq!(op(0x0224), set(4, Expression::ShiftedLeft(4, 8)));
        assert_eq!(op(0x68C1), set(1, Expression::Word(0, 12)));
        assert_eq!(op2(0xF241, 0x2334), set(3, Expression::Constant(0x1234)));
        assert_eq!(op2(0xF2C2, 0x0300), set(3, Expression::WithUpperHalf(3, 0x2000)));
        assert_eq!(op2(0xF8DF, 0x3010), set(3, Expression::Literal(0x1014)));
        assert_eq!(op2(0xF8D3, 0x200C), set(2, Expression::Word(3, 12)));
    }

    #[test]
    fn a_register_that_something_else_writes_is_forgotten() {
        for (word, register) in [(0x0840, 0), (0x1A40, 0), (0x4048, 0), (0x5C88, 0), (0x9B02, 3), (0xB2C1, 1)]
        {
            assert_eq!(op(word), Op::Clobber(1 << register), "{word:#06x}");
        }
        assert_eq!(op(0xC907), Op::Clobber(0b10_0000_0111 & 0xFF | 1 << 1));
        for word in [0x2801, 0x4288, 0x4211, 0x6001, 0x5088, 0x9002, 0xBF00, 0xDF01] {
            assert_eq!(op(word), NOTHING, "{word:#06x}");
        }
        assert_eq!(op2(0xFBA1, 0x0203), Op::Clobber(1 << 0 | 1 << 2));
        assert_eq!(op2(0xE8B4, 0x0003), Op::Clobber(1 << 4 | 0b11));
    }

    #[test]
    fn tables_and_conditions_are_told() {
        assert_eq!((op(0x4487), op(0x469F)), (Op::Jump(Table::Distances), Op::Jump(Table::Words)));
        assert_eq!(op2(0xE8DF, 0xF000), Op::Jump(Table::Bytes));
        assert_eq!(op2(0xE8DF, 0xF011), Op::Jump(Table::Halfwords));
        assert_eq!(op2(0xF850, 0xF021), Op::Jump(Table::Words));
        assert_eq!((op(0xBF08), op(0xBF01)), (Op::IfThen(1), Op::IfThen(4)));
    }

    #[test]
    fn half_an_instruction_is_none() {
        assert_eq!(decode(AT, 0xF000, None), None);
    }
}
