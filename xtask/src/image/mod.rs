//! What is in an image for a board: its memory, its functions, and what the machine code of a function reaches.
//!
//! Reads the ELF file that the linker made, not the source: what the compiler did is what runs.

mod flow;
mod graph;
mod names;
mod thumb;

pub(crate) use graph::{Graph, Stack};
pub(crate) use names::{Offence, demangled, is_costly, offence_of};

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use object::elf::{PT_LOAD, SHF_ALLOC, SHF_EXECINSTR, SHF_WRITE, SHT_NOBITS};
use object::elf::{STT_FUNC, STT_NOTYPE};
use object::read::elf::{ElfFile32, ProgramHeader, SectionHeader, Sym};
use object::{Endianness, Object, SectionIndex};

/// An image, as far as the questions here go.
#[derive(Debug, Default)]
pub(crate) struct Image {
    sections: Vec<Section>,
    /// By address.
    functions: BTreeMap<u32, Function>,
    /// Where code and data inside code begin: true for code.
    kinds: BTreeMap<u32, bool>,
    /// Bytes that the image occupies in flash, what is copied to RAM at the start included.
    pub(crate) flash: u64,
    /// Bytes of RAM that have a name: data, zeroed and left alone, stacks among them.
    pub(crate) ram: u64,
}

/// A piece of memory with its content.
#[derive(Debug)]
struct Section {
    address: u32,
    content: Vec<u8>,
    writable: bool,
}

/// A function, or an entry of one written in assembler.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Function {
    pub(crate) address: u32,
    /// Just behind its last byte.
    end: u32,
    /// Its symbols, as the linker wrote them; one that says more comes first.
    pub(crate) symbols: Vec<String>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// The file cannot be read, is no 32-bit ELF file for ARM, or has no symbols (a stripped image cannot be judged).
    pub(crate) fn read(file: &Path) -> Result<Self> {
        let bytes = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        Self::parse(&bytes).with_context(|| format!("{} is not an image for a board", file.display()))
    }

    fn parse(bytes: &[u8]) -> Result<Self> {
        let elf = ElfFile32::<Endianness>::parse(bytes)?;
        ensure!(elf.architecture() == object::Architecture::Arm, "it is for another processor");
        let mut image = Self::default();
        image.read_memory(&elf, bytes)?;
        image.read_symbols(&elf)?;
        ensure!(!image.functions.is_empty(), "it has no functions: build it without `strip`");
        ensure!(
            !image.kinds.is_empty(),
            "it does not tell code from data ($t, $d): build it without `strip`"
        );
        Ok(image)
    }

    fn read_memory(&mut self, elf: &ElfFile32<'_, Endianness>, bytes: &[u8]) -> Result<()> {
        let endian = elf.endian();
        for segment in elf.elf_program_headers() {
            if segment.p_type(endian) == PT_LOAD {
                self.flash += u64::from(segment.p_filesz(endian));
            }
        }
        for section in elf.elf_section_table().iter() {
            let flags = section.sh_flags(endian);
            if flags & SHF_ALLOC == 0 {
                continue;
            }
            let writable = flags & SHF_WRITE != 0;
            if writable {
                self.ram += u64::from(section.sh_size(endian));
            }
            if section.sh_type(endian) != SHT_NOBITS {
                let content = section.data(endian, bytes)?.to_vec();
                self.sections.push(Section { address: section.sh_addr(endian), content, writable });
            }
        }
        Ok(())
    }

    fn read_symbols(&mut self, elf: &ElfFile32<'_, Endianness>) -> Result<()> {
        let (endian, table) = (elf.endian(), elf.elf_symbol_table());
        let mut labels = Vec::new();
        for symbol in table.iter() {
            let name = String::from_utf8_lossy(symbol.name(endian, table.strings())?).into_owned();
            let (value, size) = (symbol.st_value(endian), symbol.st_size(endian));
            let section = elf.elf_section_table().section(SectionIndex(usize::from(symbol.st_shndx(endian))));
            let in_code = section.is_ok_and(|section| section.sh_flags(endian) & SHF_EXECINSTR != 0);
            match symbol.st_type() {
                STT_NOTYPE if name.starts_with("$t") => _ = self.kinds.insert(value, true),
                STT_NOTYPE if name.starts_with("$d") => _ = self.kinds.insert(value, false),
                STT_NOTYPE if in_code && !name.is_empty() => labels.push((value & !1, name)),
                STT_FUNC if in_code => self.add_function(value & !1, size, name),
                _ => {}
            }
        }
        self.add_labels(labels);
        self.end_functions();
        Ok(())
    }

    fn add_function(&mut self, address: u32, size: u32, symbol: String) {
        let end = address.wrapping_add(size);
        let function =
            self.functions.entry(address).or_insert(Function { address, end, symbols: Vec::new() });
        function.end = function.end.max(end);
        function.symbols.push(symbol);
        function.symbols.sort_by_key(|symbol| (std::cmp::Reverse(names::says_much(symbol)), symbol.clone()));
    }

    /// Labels of assembler that lie in no function are functions, too.
    fn add_labels(&mut self, labels: Vec<(u32, String)>) {
        for (address, name) in labels {
            let inside = self.function_around(address).is_some();
            if !inside && self.is_code(address) {
                self.add_function(address, 0, name);
            }
        }
    }

    /// A function without a size, as assembler makes them, ends where the next one begins.
    fn end_functions(&mut self) {
        let starts: Vec<u32> = self.functions.keys().copied().collect();
        for (index, start) in starts.iter().enumerate() {
            let section = self.section_at(*start).map_or(*start, Section::end);
            let next = starts.get(index + 1).map_or(section, |next| section.min(*next));
            if let Some(function) = self.functions.get_mut(start)
                && function.end == function.address
            {
                function.end = next;
            }
        }
    }

    /// The function that begins at an address.
    pub(crate) fn function_at(&self, address: u32) -> Option<&Function> {
        self.functions.get(&address)
    }

    /// The function whose code an address lies in.
    fn function_around(&self, address: u32) -> Option<&Function> {
        let (_, function) = self.functions.range(..=address).next_back()?;
        (address < function.end).then_some(function)
    }

    /// The only function with this name: a symbol, or a path as people read it.
    ///
    /// # Errors
    /// There is none, or there are several; both are said.
    pub(crate) fn function_named(&self, name: &str) -> Result<&Function> {
        let is_named = |function: &&Function| {
            function.symbols.iter().any(|symbol| symbol == name || demangled(symbol) == name)
        };
        let found: Vec<&Function> = self.functions.values().filter(is_named).collect();
        match found.as_slice() {
            [function] => Ok(function),
            [] => bail!("the image has no function {name}{}", self.names_like(name)),
            several => bail!("the image has {} functions {name}; name one by its symbol", several.len()),
        }
    }

    /// Functions that end in the same word.
    fn names_like(&self, name: &str) -> String {
        let word = name.rsplit("::").next().unwrap_or(name);
        let names = self.functions.values().map(Function::name);
        let alike: Vec<String> = names.filter(|other| other.contains(word)).take(8).collect();
        if alike.is_empty() { String::new() } else { format!("; like it: {}", alike.join(", ")) }
    }

    fn is_code(&self, address: u32) -> bool {
        self.kinds.range(..=address).next_back().is_some_and(|(_, code)| *code)
    }

    /// Where the run of data that begins or goes on at `address` ends.
    fn data_end(&self, address: u32) -> u32 {
        let code = self.kinds.range(address..).find(|(_, code)| **code).map(|(start, _)| *start);
        let section = self.section_at(address).map_or(address, Section::end);
        code.map_or(section, |code| code.min(section))
    }

    fn section_at(&self, address: u32) -> Option<&Section> {
        self.sections.iter().find(|section| section.address <= address && address < section.end())
    }

    fn bytes(&self, address: u32, count: usize) -> Option<&[u8]> {
        let section = self.section_at(address)?;
        let start = (address - section.address) as usize;
        section.content.get(start..start + count)
    }

    fn byte(&self, address: u32) -> Option<u8> {
        self.bytes(address, 1).map(|bytes| bytes[0])
    }

    fn halfword(&self, address: u32) -> Option<u16> {
        self.bytes(address, 2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]))
    }

    fn word(&self, address: u32) -> Option<u32> {
        self.bytes(address, 4).map(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    /// A word that nothing can change while the image runs.
    fn constant_word(&self, address: u32) -> Option<u32> {
        // The literals of a function that was copied to RAM are as constant as its code.
        let constant = !self.section_at(address)?.writable || self.function_around(address).is_some();
        if constant { self.word(address) } else { None }
    }
}

impl Section {
    fn end(&self) -> u32 {
        self.address.wrapping_add(self.content.len() as u32)
    }
}

impl Function {
    /// The name as people read it.
    pub(crate) fn name(&self) -> String {
        self.symbols.first().map(|symbol| demangled(symbol)).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests;
