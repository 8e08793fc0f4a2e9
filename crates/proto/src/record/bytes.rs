//! Numbers as bytes: varints, seven bits a byte, the lowest first; signed ones zig-zag, so that small ones stay short.

use super::error::RecordFault;

/// Puts bytes into a block that has room for them.
pub(super) struct Writer<'a> {
    bytes: &'a mut [u8],
    used: &'a mut usize,
}

impl<'a> Writer<'a> {
    pub(super) fn new(bytes: &'a mut [u8], used: &'a mut usize) -> Self {
        Self { bytes, used }
    }

    /// The block was closed while there was room: see `ROOM` in the encoder.
    pub(super) fn byte(&mut self, byte: u8) {
        if let Some(free) = self.bytes.get_mut(*self.used) {
            *free = byte;
            *self.used = self.used.saturating_add(1);
        }
    }

    pub(super) fn number(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.byte(number as u8 | 0x80);
            number >>= 7;
        }
        self.byte(number as u8);
    }

    /// 32 bit, which a small core handles in one register.
    pub(super) fn number32(&mut self, mut number: u32) {
        while number >= 0x80 {
            self.byte(number as u8 | 0x80);
            number >>= 7;
        }
        self.byte(number as u8);
    }

    pub(super) fn signed(&mut self, number: i64) {
        self.number(((number << 1) ^ (number >> 63)).cast_unsigned());
    }

    pub(super) fn signed32(&mut self, number: i32) {
        self.number32(((number << 1) ^ (number >> 31)).cast_unsigned());
    }

    pub(super) fn signed16(&mut self, number: i16) {
        self.number32(u32::from(((number << 1) ^ (number >> 15)).cast_unsigned()));
    }

    pub(super) fn whole(&mut self, number: u64) {
        for byte in number.to_le_bytes() {
            self.byte(byte);
        }
    }
}

/// Takes bytes from a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reader<'a> {
    pub(super) left: &'a [u8],
}

impl Reader<'_> {
    pub(super) fn byte(&mut self) -> Result<u8, RecordFault> {
        let (&first, rest) = self.left.split_first().ok_or(RecordFault::Cut)?;
        self.left = rest;
        Ok(first)
    }

    pub(super) fn number(&mut self) -> Result<u64, RecordFault> {
        let mut number = 0u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            let part = u64::from(byte & 0x7f);
            if (part << shift) >> shift != part {
                return Err(RecordFault::Number);
            }
            number |= part << shift;
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err(RecordFault::Number)
    }

    pub(super) fn number32(&mut self) -> Result<u32, RecordFault> {
        // Most are one byte long.
        if let Some((&first, rest)) = self.left.split_first().filter(|(first, _)| **first < 0x80) {
            self.left = rest;
            return Ok(u32::from(first));
        }
        u32::try_from(self.number()?).map_err(|_| RecordFault::Number)
    }

    pub(super) fn number16(&mut self) -> Result<u16, RecordFault> {
        u16::try_from(self.number32()?).map_err(|_| RecordFault::Number)
    }

    pub(super) fn signed(&mut self) -> Result<i64, RecordFault> {
        let number = self.number()?;
        Ok((number >> 1).cast_signed() ^ (number & 1).cast_signed().wrapping_neg())
    }

    pub(super) fn signed32(&mut self) -> Result<i32, RecordFault> {
        let number = self.number32()?;
        Ok((number >> 1).cast_signed() ^ (number & 1).cast_signed().wrapping_neg())
    }

    pub(super) fn signed16(&mut self) -> Result<i16, RecordFault> {
        let number = self.number16()?;
        Ok((number >> 1).cast_signed() ^ (number & 1).cast_signed().wrapping_neg())
    }

    pub(super) fn whole(&mut self) -> Result<u64, RecordFault> {
        let (first, rest) = self.left.split_first_chunk::<8>().ok_or(RecordFault::Cut)?;
        self.left = rest;
        Ok(u64::from_le_bytes(*first))
    }
}
