//! The plain serial port: bytes in by a PIO program, lines out by the UART.

use crate::design::{ANSWER_US, BAUD, CLOCK_HZ, POLL_US, RECEIVE_US, SAMPLES_PER_BIT};
use crate::front::SERIAL_MACHINE;
use crate::pio;
use crate::shared::{BYTES, LAST_HEARD, Note, PLACES, Received, STATUS, TICKS, Taken};
use abbe_core::Command;
use abbe_proto::plain::{Answer, LONGEST_ANSWER, Lines, Request, StatusLine, parse};
use core::cell::UnsafeCell;
use core::fmt::Write;
use core::sync::atomic::Ordering;
use embassy_rp::{interrupt, pac};
use embassy_time::Timer;
use heapless::spsc::{Consumer, Producer};

/// Core 0's ends of the queues.
pub struct Queues {
    /// What came over the line.
    pub received: Consumer<'static, Received, BYTES>,
    /// Requests for the controller.
    pub commands: Producer<'static, Command<2>, PLACES>,
    /// Their answers.
    pub answers: Consumer<'static, Taken, PLACES>,
}

/// Sets up the hardware's UART for sending: 8 data bits, no parity, one stop bit.
pub fn set_up() {
    // The divider has six fractional bits and counts sixteenths of a bit.
    let divider = (embassy_rp::clocks::clk_peri_freq() * 4 + BAUD / 2) / BAUD;
    pac::UART0.uartibrd().write_value(pac::uart::regs::Uartibrd(divider >> 6));
    pac::UART0.uartfbrd().write_value(pac::uart::regs::Uartfbrd(divider & 63));
    pac::UART0.uartlcr_h().write(|w| {
        w.set_wlen(3);
        w.set_fen(true);
    });
    pac::UART0.uartcr().write(|w| {
        w.set_txe(true);
        w.set_uarten(true);
    });
}

/// Clocks of the block in a clock of the receiver, whole and 1/256.
pub fn divider() -> (u16, u8) {
    const CLOCKS: u32 = CLOCK_HZ / SAMPLES_PER_BIT * 256 / BAUD;
    ((CLOCKS >> 8) as u16, CLOCKS as u8)
}

/// A place for what only the receiver's interrupt touches, once it is there.
struct Receiver(UnsafeCell<Option<Producer<'static, Received, BYTES>>>);

// SAFETY: written before the interrupt is enabled, and from then on touched by that interrupt alone.
unsafe impl Sync for Receiver {}

static RECEIVER: Receiver = Receiver(UnsafeCell::new(None));

/// From now on every byte goes into this queue.
pub fn receive_into(queue: Producer<'static, Received, BYTES>) {
    // SAFETY: the interrupt that uses this place is not enabled yet, and this is the only core that enables it.
    unsafe { *RECEIVER.0.get() = Some(queue) };
    pac::TIMER.inte().modify(|w| w.set_alarm(ALARM, true));
    ring_again();
    // SAFETY: everything that the handler uses is in its place.
    unsafe { cortex_m::peripheral::NVIC::unmask(pac::Interrupt::TIMER_IRQ_2) };
}

/// The alarm of the timer for the receiver. The block has an interrupt of its own, but the emulator has its bits in
/// another order than the chip; an alarm works in both, and interrupts the planner just as well.
const ALARM: usize = 2;

fn ring_again() {
    pac::TIMER.alarm(ALARM).write_value(pac::TIMER.timerawl().read().wrapping_add(RECEIVE_US));
}

#[interrupt]
fn TIMER_IRQ_2() {
    pac::TIMER.intr().write(|w| w.set_alarm(ALARM, true));
    ring_again();
    crate::watch::look();
    // SAFETY: enabled on core 0 alone, after the place was filled; it does not interrupt itself.
    let Some(queue) = (unsafe { &mut *RECEIVER.0.get() }) else { return };
    while let Some(word) = pio::take(pac::PIO1, SERIAL_MACHINE) {
        // Any bit below the byte says that its stop bit was missing.
        let whole = word.trailing_zeros() >= 24;
        let received = if whole { Received::Byte((word >> 24) as u8) } else { Received::Spoilt };
        // What nobody reads in time is lost; the line it belongs to will be found wrong.
        _ = queue.enqueue(received);
    }
}

/// Answers one line after another, for ever.
pub async fn answer_lines(mut queues: Queues) -> ! {
    let mut lines = Lines::default();
    let mut line: heapless::Vec<u8, { abbe_proto::plain::LONGEST }> = heapless::Vec::new();
    loop {
        let byte = match queues.received.dequeue() {
            Some(Received::Byte(byte)) => byte,
            Some(Received::Spoilt) => {
                lines.spoil();
                continue;
            }
            None => {
                Timer::after_micros(POLL_US).await;
                continue;
            }
        };
        let mut whole = None;
        lines.push(byte, |taken| {
            whole = Some(taken.map(|bytes| {
                line.clear();
                // A line is never longer than this buffer.
                _ = line.extend_from_slice(bytes);
            }));
        });
        match whole {
            None => {}
            Some(Err(mistake)) => send(&Answer::Mistake(mistake)).await,
            Some(Ok(())) => answer(&line, &mut queues).await,
        }
    }
}

async fn answer(line: &[u8], queues: &mut Queues) {
    LAST_HEARD.store(TICKS.load(Ordering::Relaxed), Ordering::Relaxed);
    match parse(line) {
        Ok(None) => {}
        Ok(Some(Request::Help)) => send(&Answer::Help).await,
        Ok(Some(Request::Status)) => send_status().await,
        Ok(Some(Request::Command(command))) => {
            let taken = ask(command, queues).await;
            if command == Command::Reset && matches!(taken, Some(Ok(_))) {
                Note::Nothing.say();
            }
            match taken {
                Some(taken) => send(&Answer::Command(taken, &command)).await,
                None => send(&Answer::NoTick).await,
            }
        }
        Err(mistake) => send(&Answer::Mistake(mistake)).await,
    }
}

/// Hands a request to the tick and waits for its answer; none if no tick gives one.
async fn ask(command: Command<2>, queues: &mut Queues) -> Option<Taken> {
    // What a stalled tick answered late belongs to nobody.
    while queues.answers.dequeue().is_some() {}
    queues.commands.enqueue(command).ok()?;
    for _ in 0..ANSWER_US / POLL_US {
        if let Some(taken) = queues.answers.dequeue() {
            return Some(taken);
        }
        Timer::after_micros(POLL_US).await;
    }
    None
}

async fn send_status() {
    let status = loop {
        match STATUS.read().flatten() {
            Some(status) => break status,
            None if !crate::watch::ticks_come() => return send(&Answer::NoTick).await,
            // The first tick is not over yet, or it is being written.
            None => Timer::after_micros(POLL_US).await,
        }
    };
    let board = Note::being_said();
    send(&Answer::Status(StatusLine { status: &status, board })).await;
}

async fn send(answer: &Answer<'_>) {
    let mut text: heapless::String<LONGEST_ANSWER> = heapless::String::new();
    // Every answer fits (`no_answer_is_longer_than_said`).
    _ = write!(text, "{answer}");
    for &byte in text.as_bytes().iter().chain(b"\r\n") {
        while pac::UART0.uartfr().read().txff() {
            Timer::after_micros(POLL_US).await;
        }
        pac::UART0.uartdr().write(|w| w.set_data(byte));
    }
}
