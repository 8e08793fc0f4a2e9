//! What crosses between the cores: requests and plans one way, answers, wanted plans and snapshots the other.
//!
//! Core 1 owns the controller. Nothing here makes it wait: queues are single-producer, single-consumer, and the snapshot
//! is a seqlock, whose writer never looks whether anybody reads.

use abbe_core::background::MoveRequest;
use abbe_core::plan::LinePlan;
use abbe_core::{Accepted, Command, Refusal, Status};
use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering, fence};
use heapless::spsc::{Consumer, Producer, Queue};

/// The answer to a command.
pub type Taken = Result<Accepted, Refusal>;

/// A plan on its way to the tick.
#[derive(Clone, Copy)]
pub struct Planned {
    /// Of which move.
    pub number: u32,
    /// The plan.
    pub plan: LinePlan<2>,
    /// Tick at which it begins.
    pub start: u32,
}

/// What the serial receiver saw.
#[derive(Clone, Copy)]
pub enum Received {
    /// A byte.
    Byte(u8),
    /// Something that was none.
    Spoilt,
}

/// Places in the queues between the cores, one of them never used.
pub const PLACES: usize = 4;
/// Places in the queue of received bytes.
pub const BYTES: usize = 128;

/// A queue that is split once.
macro_rules! queue {
    ($name:ident, $item:ty, $length:expr, $doc:literal) => {
        #[doc = $doc]
        pub fn $name() -> (Producer<'static, $item, $length>, Consumer<'static, $item, $length>) {
            static mut QUEUE: Queue<$item, $length> = Queue::new();
            static SPLIT: AtomicBool = AtomicBool::new(false);
            assert!(!SPLIT.load(Ordering::Relaxed));
            SPLIT.store(true, Ordering::Relaxed);
            // SAFETY: the flag lets this line be reached once, at start-up, before the second core runs.
            unsafe { (*(&raw mut QUEUE)).split() }
        }
    };
}

queue!(commands, Command<2>, PLACES, "Requests, core 0 to core 1.");
queue!(answers, Taken, PLACES, "Their answers, in order, core 1 to core 0.");
queue!(wanted, MoveRequest<2>, PLACES, "Moves that want a plan, core 1 to core 0.");
queue!(plans, Planned, PLACES, "Their plans, core 0 to core 1.");
queue!(
    received,
    Received,
    BYTES,
    "What came over the serial line, from its interrupt to the task that reads lines."
);

/// The snapshot of the last tick.
pub static STATUS: SeqLock<Option<Status<2>>> = SeqLock::new(None);
/// Ticks so far; stands still when the tick does.
pub static TICKS: AtomicU32 = AtomicU32::new(0);
/// Tick at which the host last spoke.
pub static LAST_HEARD: AtomicU32 = AtomicU32::new(0);
/// What the board itself has to say, until a reset.
pub static NOTE: AtomicU8 = AtomicU8::new(Note::Nothing as u8);

/// What a board can have to say.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Note {
    /// All is well.
    Nothing,
    /// Core 0 found no ticks and switched the drives off.
    Stalled,
    /// The watchdog started the chip anew.
    StartedAnew,
}

impl Note {
    /// Says it from now on.
    pub fn say(self) {
        NOTE.store(self as u8, Ordering::Relaxed);
    }

    /// The sentence that is being said, or none.
    pub fn being_said() -> &'static str {
        match NOTE.load(Ordering::Relaxed) {
            note if note == Self::Stalled as u8 => "the tick stalled and the drives were switched off",
            note if note == Self::StartedAnew as u8 => "the watchdog has started the board anew",
            _ => "",
        }
    }
}

/// Copies that a reader tries; a writer disturbs two in a row only when it writes ever faster than once a tick.
const TRIES: usize = 8;

/// A value with one writer and any number of readers, none of which waits for the writer.
pub struct SeqLock<T> {
    /// Odd while the value is being written.
    sequence: AtomicU32,
    value: UnsafeCell<T>,
}

// SAFETY: readers copy the value and believe the copy only when no write began or ended meanwhile.
unsafe impl<T: Copy + Send> Sync for SeqLock<T> {}

impl<T: Copy> SeqLock<T> {
    /// Holding `value`.
    pub const fn new(value: T) -> Self {
        Self { sequence: AtomicU32::new(0), value: UnsafeCell::new(value) }
    }

    /// Replaces the value. To be called from one place only: the tick.
    pub fn write(&self, value: &T) {
        let sequence = self.sequence.load(Ordering::Relaxed);
        self.sequence.store(sequence.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::SeqCst);
        // SAFETY: the tick is the only writer, and readers that look meanwhile see the odd number and try again.
        unsafe { self.value.get().copy_from_nonoverlapping(value, 1) };
        fence(Ordering::SeqCst);
        self.sequence.store(sequence.wrapping_add(2), Ordering::Relaxed);
    }

    /// A whole value, the latest or the one before; none when the writer does not finish.
    pub fn read(&self) -> Option<T> {
        for _ in 0..TRIES {
            let before = self.sequence.load(Ordering::Acquire);
            fence(Ordering::SeqCst);
            // SAFETY: the copy may be torn; it is used only when the sequence says that it is not. `T: Copy` has no
            // destructor to run on a torn one, and it stays in its wrapper until then.
            let copy = unsafe { self.value.get().cast::<core::mem::MaybeUninit<T>>().read_volatile() };
            fence(Ordering::SeqCst);
            let after = self.sequence.load(Ordering::Relaxed);
            if before == after && before.is_multiple_of(2) {
                // SAFETY: nobody wrote between the two looks, so the copy is a value that was written whole.
                return Some(unsafe { copy.assume_init() });
            }
        }
        None
    }
}
