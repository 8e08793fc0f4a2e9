//! An image for a board as an emulator wants it: the bytes of its flash, and where its functions and statics lie.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol};

/// Where the flash of an RP2040 begins.
pub const FLASH: u32 = 0x1000_0000;
/// How long it is on a Pico, bytes.
pub const FLASH_SIZE: usize = 2 << 20;

/// An image of an RP2040.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// What lies in the flash, from [`FLASH`] on.
    pub flash: Vec<u8>,
    symbols: HashMap<String, Vec<u32>>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// The file cannot be read, is no 32-bit ELF file, or wants bytes loaded outside of the flash.
    pub fn read(file: &Path) -> Result<Self> {
        let bytes = fs::read(file).with_context(|| format!("cannot read the image {}", file.display()))?;
        Self::parse(&bytes).with_context(|| format!("{} is no image for an RP2040", file.display()))
    }

    fn parse(bytes: &[u8]) -> Result<Self> {
        let elf = ElfFile32::<Endianness>::parse(bytes)?;
        let mut image = Self::default();
        for segment in elf.elf_program_headers() {
            if segment.p_type(elf.endian()) == PT_LOAD {
                let content = segment.data(elf.endian(), bytes).ok().context("a segment is cut off")?;
                image.load(segment.p_paddr(elf.endian()), content)?;
            }
        }
        for symbol in elf.symbols() {
            let name = format!("{:#}", rustc_demangle::demangle(symbol.name()?));
            image.symbols.entry(name).or_default().push(u32::try_from(symbol.address())?);
        }
        Ok(image)
    }

    /// Lays bytes into the flash at their physical address; what stands in the RAM at the start is copied from there.
    ///
    /// # Errors
    /// They lie outside of the flash.
    pub fn load(&mut self, address: u32, content: &[u8]) -> Result<()> {
        if content.is_empty() {
            return Ok(());
        }
        let from = address.wrapping_sub(FLASH) as usize;
        let end = from.saturating_add(content.len());
        ensure!(end <= FLASH_SIZE, "{} bytes at {address:#010x} lie outside of the flash", content.len());
        if self.flash.len() < end {
            self.flash.resize(end, 0xff);
        }
        self.flash[from..end].copy_from_slice(content);
        Ok(())
    }

    /// Address of a static.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn place_of(&self, name: &str) -> Result<u32> {
        let places = self.symbols.get(name).map_or(&[][..], Vec::as_slice);
        places.first().copied().with_context(|| format!("the image has no {name}"))
    }

    /// Address of the first instruction of the one function whose path begins and ends so.
    ///
    /// # Errors
    /// There is none, or more than one.
    pub fn entry_of(&self, beginning: &str, end: &str) -> Result<u32> {
        let named =
            self.symbols.iter().filter(|(name, _)| name.starts_with(beginning) && name.ends_with(end));
        let found: Vec<u32> = named.flat_map(|(_, places)| places).map(|place| place & !1).collect();
        ensure!(found.len() == 1, "the image has {} functions {beginning}…{end}, not one", found.len());
        Ok(found[0])
    }

    /// Addresses of the first instructions of all functions that lie in a module.
    ///
    /// # Errors
    /// There are none.
    pub fn entries_in(&self, module: &str) -> Result<Vec<u32>> {
        let beginning = format!("{module}::");
        let inside = self.symbols.iter().filter(|(name, _)| name.starts_with(&beginning));
        let found: Vec<u32> = inside.flat_map(|(_, places)| places).map(|place| place & !1).collect();
        ensure!(!found.is_empty(), "the image has no function in {module}");
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_go_where_they_belong_and_the_rest_is_erased_flash() {
        let mut image = Image::default();
        image.load(FLASH + 2, &[1, 2]).unwrap();
        image.load(FLASH, &[7]).unwrap();
        assert_eq!(image.flash, [7, 0xff, 1, 2]);
        image.load(0x2000_0000, &[]).unwrap();
    }

    #[test]
    fn bytes_outside_of_the_flash_are_refused() {
        for address in [0x2000_0000, FLASH - 1, FLASH + (2 << 20)] {
            let error = Image::default().load(address, &[0]).unwrap_err().to_string();
            assert!(error.contains("outside of the flash"), "{error}");
        }
        assert!(Image::parse(b"no ELF file").is_err());
    }

    #[test]
    fn a_function_must_be_the_only_one_of_its_name() {
        let mut image = Image::default();
        image.symbols.insert("a::Controller<_>::plan".into(), vec![0x1000_0101]);
        assert_eq!(image.entry_of("a::", "::plan").unwrap(), 0x1000_0100);
        image.symbols.insert("a::Other::plan".into(), vec![0x1000_0201]);
        assert!(image.entry_of("a::", "::plan").is_err());
        assert_eq!(image.entries_in("a::Other").unwrap(), [0x1000_0200]);
        assert!(image.entries_in("a::Oth").is_err());
        assert!(image.entry_of("a::", "::servo").is_err() && image.place_of("GOLDEN_END").is_err());
    }
}
