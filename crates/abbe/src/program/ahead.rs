//! Lines that are read ahead by a thread, so that a stage need not wait for an input that pauses.

use super::lines::{Line, Lines, LinesError};
use crate::interrupt;
use std::io::{self, BufReader, Read};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// Bytes that are read at once.
const BUFFER: usize = 1 << 16;
/// Lines that wait at most.
const LINES: usize = 256;
/// Between two looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// What comes next.
pub(super) enum Next {
    Line(Line<'static>),
    /// Nothing has come for as long as was waited.
    Pause,
    End,
}

/// A program on its way in; none at its end.
pub(crate) struct Ahead {
    lines: Receiver<Result<Option<Line<'static>>, LinesError>>,
    /// How long a line is waited for before the input counts as pausing; none: an input that never does.
    patience: Option<Duration>,
}

impl Ahead {
    /// Begins to read. `advanced` hears of the bytes read, now and then.
    pub(crate) fn new(
        input: impl Read + Send + 'static,
        patience: Option<Duration>,
        advanced: impl Fn(u64) + Send + 'static,
    ) -> Self {
        let (to, lines) = sync_channel(LINES);
        thread::spawn(move || {
            let mut lines = Lines::new(BufReader::with_capacity(BUFFER, input), &advanced);
            loop {
                let next = lines.next().map(|line| line.map(|line| line.owned()));
                let is_last = !matches!(next, Ok(Some(_)));
                // Whoever wanted it may have gone.
                if to.send(next).is_err() || is_last {
                    return;
                }
            }
        });
        Self { lines, patience }
    }

    /// The next line, or that none comes for now.
    pub(super) fn next(&self) -> Result<Next, LinesError> {
        self.within(self.patience)
    }

    /// The next line or the end, however long it takes.
    pub(super) fn wait(&self) -> Result<Next, LinesError> {
        self.within(None)
    }

    fn within(&self, patience: Option<Duration>) -> Result<Next, LinesError> {
        let began = Instant::now();
        loop {
            match self.lines.recv_timeout(patience.map_or(LOOK, |patience| patience.min(LOOK))) {
                Ok(line) => return Ok(line?.map_or(Next::End, Next::Line)),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(io::Error::other("its reader has failed").into());
                }
                Err(RecvTimeoutError::Timeout) => interrupt::check()?,
            }
            if patience.is_some_and(|patience| began.elapsed() >= patience) {
                return Ok(Next::Pause);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Sender, channel};

    /// Gives what it is sent, and waits for it.
    struct Pipe(Receiver<&'static [u8]>);

    impl Read for Pipe {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let Ok(bytes) = self.0.recv() else { return Ok(0) };
            buffer[..bytes.len()].copy_from_slice(bytes);
            Ok(bytes.len())
        }
    }

    fn pipe(patience: Option<Duration>) -> (Sender<&'static [u8]>, Ahead) {
        let (to, from) = channel();
        (to, Ahead::new(Pipe(from), patience, |_| ()))
    }

    fn number(next: Next) -> u64 {
        match next {
            Next::Line(line) => line.number,
            Next::Pause => panic!("a pause"),
            Next::End => panic!("the end"),
        }
    }

    #[test]
    fn an_input_that_pauses_is_told_and_goes_on() {
        let (to, ahead) = pipe(Some(Duration::from_millis(20)));
        to.send(b"G0 X1\nG0 ").unwrap();
        assert_eq!(number(ahead.next().unwrap()), 1);
        // Half a line is none.
        assert!(matches!(ahead.next().unwrap(), Next::Pause));
        assert!(matches!(ahead.next().unwrap(), Next::Pause));
        to.send(b"X2\nM2").unwrap();
        drop(to);
        assert_eq!(number(ahead.wait().unwrap()), 2);
        assert_eq!(number(ahead.next().unwrap()), 3);
        assert!(matches!(ahead.next().unwrap(), Next::End));
    }

    #[test]
    fn more_lines_than_there_is_room_for_come_in_their_order() {
        let (to, ahead) = pipe(None);
        for _ in 0..10 * LINES {
            to.send(b"G0 X1\n").unwrap();
        }
        assert_eq!(number(ahead.next().unwrap()), 1);
        drop(to);
        let mut last = 1;
        while let Next::Line(line) = ahead.next().unwrap() {
            assert_eq!(line.number, last + 1);
            last = line.number;
        }
        assert_eq!(last, 10 * LINES as u64);
    }
}
