//! The lines of a program: never more of it in memory than the longest line may have.

use crate::failure::Failure;
use crate::interrupt::{self, Interrupted};
use abbe_proto::gcode::{Block, Error, Fault, LONGEST, parse};
use std::borrow::Cow;
use std::io::{self, BufRead, ErrorKind, Read as _};

/// Editors like to put it in front of a file.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Bytes of the longest line with its end, CR LF.
const WITH_END: usize = LONGEST + 2;
/// Bytes between two looks at Ctrl-C and the progress bar.
const LOOK: u64 = 1 << 17;

/// Why there are no more lines.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LinesError {
    #[error("the program cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

impl LinesError {
    /// Of a program with this name.
    pub(crate) fn of(self, name: &str) -> Failure {
        match self {
            Self::Unreadable(_) => Failure::Work(anyhow::Error::new(self).context(name.to_owned())),
            Self::Interrupted(interrupted) => interrupted.into(),
        }
    }
}

/// A line of a program.
#[derive(Debug)]
pub(crate) struct Line<'l> {
    /// Which, from 1.
    pub(crate) number: u64,
    /// Its bytes without its end; of a line that is too long, the beginning.
    text: Cow<'l, [u8]>,
    /// How many bytes it has.
    length: usize,
}

impl Line<'_> {
    /// Its words.
    ///
    /// # Errors
    /// What is wrong with it and where.
    pub(crate) fn block(&self) -> Result<Block, Error> {
        if self.length > LONGEST {
            return Err(Error { column: LONGEST as u16 + 1, fault: Fault::TooLong(self.length) });
        }
        parse(&self.text)
    }

    /// The same, to be kept.
    pub(super) fn owned(&self) -> Line<'static> {
        Line { number: self.number, text: Cow::Owned(self.text.to_vec()), length: self.length }
    }
}

/// A program on its way in.
pub(crate) struct Lines<'a, R> {
    input: R,
    /// The line, as far as it is kept.
    kept: Vec<u8>,
    number: u64,
    /// Bytes that `advanced` has not heard of.
    untold: u64,
    advanced: &'a dyn Fn(u64),
}

impl<'a, R: BufRead> Lines<'a, R> {
    /// `advanced` hears of the bytes read, now and then.
    pub(crate) fn new(input: R, advanced: &'a dyn Fn(u64)) -> Self {
        let kept = Vec::with_capacity(BYTE_ORDER_MARK.len() + WITH_END);
        Self { input, kept, number: 0, untold: 0, advanced }
    }

    /// The next line, or nothing at the end.
    ///
    /// # Errors
    /// The input cannot be read, or Ctrl-C.
    pub(crate) fn next(&mut self) -> Result<Option<Line<'_>>, LinesError> {
        self.kept.clear();
        let mark = if self.number == 0 { BYTE_ORDER_MARK.len() } else { 0 };
        let most = mark + WITH_END;
        let read = self.input.by_ref().take(most as u64).read_until(b'\n', &mut self.kept)?;
        if read == 0 {
            (self.advanced)(std::mem::take(&mut self.untold));
            return Ok(None);
        }
        self.passed(read)?;
        let rest = if read == most && self.kept.last() != Some(&b'\n') { self.pass_rest()? } else { 0 };
        self.number += 1;
        let text =
            if mark > 0 { self.kept.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&self.kept) } else { &self.kept };
        let length = if rest > 0 { text.len() + rest } else { without_end(text).len() };
        Ok(Some(Line { number: self.number, text: Cow::Borrowed(without_end(text)), length }))
    }

    /// Leaves the rest of a line behind that nobody wants; how many bytes it has without its end.
    fn pass_rest(&mut self) -> Result<usize, LinesError> {
        let (mut passed, mut last) = (0, self.kept.last().copied());
        loop {
            let part = match self.input.fill_buf() {
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                part => part?,
            };
            let end = part.iter().position(|&byte| byte == b'\n');
            let text = end.map_or(part, |end| &part[..end]);
            last = text.last().copied().or(last);
            passed += text.len();
            let (taken, done) = (text.len() + usize::from(end.is_some()), end.is_some() || part.is_empty());
            self.input.consume(taken);
            self.passed(taken)?;
            if done {
                return Ok(passed - usize::from(passed > 0 && last == Some(b'\r')));
            }
        }
    }

    fn passed(&mut self, bytes: usize) -> Result<(), Interrupted> {
        self.untold += bytes as u64;
        if self.untold >= LOOK {
            interrupt::check()?;
            (self.advanced)(std::mem::take(&mut self.untold));
        }
        Ok(())
    }
}

fn without_end(line: &[u8]) -> &[u8] {
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    line.strip_suffix(b"\r").unwrap_or(line)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::io::{BufReader, Read};

    /// Every line as its number and its bytes, or how many it has if they are too many.
    fn all(bytes: &[u8], buffer: usize) -> Vec<(u64, Result<Vec<u8>, usize>)> {
        let mut lines = Lines::new(BufReader::with_capacity(buffer, bytes), &|_| ());
        let mut found = Vec::new();
        while let Some(line) = lines.next().unwrap() {
            let whole = line.length == line.text.len() && line.length <= LONGEST;
            found.push((line.number, if whole { Ok(line.text.to_vec()) } else { Err(line.length) }));
        }
        found
    }

    #[test]
    fn lines_end_in_every_way() {
        for buffer in [1, 2, 3, 7, 8192] {
            let found = all(b"\xef\xbb\xbfG0\r\n\nG1 X1\r\n\xef\xbb\xbf\nM2", buffer);
            let expected: [&[u8]; 5] = [b"G0", b"", b"G1 X1", b"\xef\xbb\xbf", b"M2"];
            let expected: Vec<_> = (1..).zip(expected.map(|line| Ok(line.to_vec()))).collect();
            assert_eq!(found, expected);
            assert_eq!(all(b"", buffer), []);
            assert_eq!(all(b"\n", buffer), [(1, Ok(vec![]))]);
            assert_eq!(all(b"\xef\xbb\xbf", buffer), [(1, Ok(vec![]))]);
        }
    }

    #[test]
    fn a_line_that_is_too_long_is_counted_and_the_next_one_is_read() {
        let longest = vec![b'('; LONGEST];
        for (mark, end) in [("", "\n"), ("", "\r\n"), ("\u{feff}", "\n"), ("\u{feff}", "\r\n"), ("", "")] {
            for more in [0, 1, 2, 3, 4, 5, 100_000] {
                let line = [mark.as_bytes(), &longest, &vec![b'x'; more], end.as_bytes(), b"G0\r"].concat();
                let behind = if end.is_empty() { vec![] } else { vec![(2, Ok(b"G0".to_vec()))] };
                let glued = if end.is_empty() { 2 } else { 0 };
                let first = if more + glued == 0 { Ok(longest.clone()) } else { Err(LONGEST + more + glued) };
                for buffer in [1, 5, 256, 8192] {
                    let expected = [vec![(1, first.clone())], behind.clone()].concat();
                    assert_eq!(all(&line, buffer), expected, "{mark:?} {end:?} {more}");
                }
            }
        }
    }

    #[test]
    fn a_long_line_is_refused_with_its_length() {
        for more in [1, 2, 3, 50_000] {
            let line = vec![b' '; LONGEST + more];
            let mut lines = Lines::new(&line[..], &|_| ());
            let error = lines.next().unwrap().unwrap().block().unwrap_err();
            assert_eq!(error, Error { column: 257, fault: Fault::TooLong(LONGEST + more) });
        }
    }

    /// Bytes without end and without a line end.
    struct Endless(u64);

    impl Read for Endless {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            if self.0 == 0 {
                return Err(io::Error::other("the disk is gone"));
            }
            let taken = self.0.min(buffer.len() as u64) as usize;
            self.0 -= taken as u64;
            buffer[..taken].fill(b'X');
            Ok(taken)
        }
    }

    #[test]
    fn of_a_gigabyte_in_one_line_nothing_is_kept_and_a_broken_disk_is_told() {
        let told = Cell::new(0);
        let advanced = |bytes| told.set(told.get() + bytes);
        let mut lines = Lines::new(BufReader::with_capacity(1 << 20, Endless(1 << 30)), &advanced);
        let before = lines.kept.capacity();
        let error = lines.next().unwrap_err();
        assert_eq!(error.to_string(), "the program cannot be read: the disk is gone");
        assert_eq!((lines.kept.capacity(), told.get()), (before, 1 << 30));
    }
}
