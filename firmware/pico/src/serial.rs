//! The plain serial port: bytes in by a PIO program, lines out by the UART.

use crate::design::BAUD;
use crate::shared::{LAST_HEARD, STALLED, STATUS, TICKS, Taken};
use abbe_core::Command;
use abbe_proto::plain::{Answer, Lines, Mistake, Request, StatusLine, parse};
use core::fmt::Write;
use core::sync::atomic::Ordering;
use embassy_futures::yield_now;
use embassy_rp::pac;
use heapless::spsc::{Consumer, Producer, Queue};

/// Core 0's ends of the queues.
pub struct Queues {
    /// Requests for the controller.
    pub commands: Producer<'static, Command<2>>,
    /// Their answers.
    pub answers: Consumer<'static, Taken>,
}

/// Longest answer, its line end included.
const LONGEST_ANSWER: usize = 320;

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

/// Answers one line after another, for ever.
pub async fn answer_lines(mut received: Consumer<'static, Received>, mut queues: Queues) -> ! {
    let mut lines = Lines::default();
    let mut line: heapless::Vec<u8, { abbe_proto::plain::LONGEST }> = heapless::Vec::new();
    loop {
        let byte = match received.dequeue() {
            Some(Received::Byte(byte)) => byte,
            Some(Received::Spoilt) => {
                lines.spoil();
                continue;
            }
            None => {
                yield_now().await;
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
            send(&Answer::Command(taken, &command)).await;
        }
        Err(mistake) => send(&Answer::Mistake(mistake)).await,
    }
}

/// Hands a request to the tick and waits for its answer: two ticks, unless the tick has stalled.
async fn ask(command: Command<2>, queues: &mut Queues) -> Taken {
    while queues.commands.enqueue(command).is_err() {
        yield_now().await;
    }
    loop {
        if let Some(taken) = queues.answers.dequeue() {
            return taken;
        }
        yield_now().await;
    }
}

async fn send_status() {
    let Some(status) = STATUS.read() else {
        return send(&Answer::Mistake(Mistake::NotText)).await;
    };
    let board = if STALLED.load(Ordering::Relaxed) { "the tick stalled; the drives were switched off" } else { "" };
    send(&Answer::Status(StatusLine { status: &status, board })).await;
}

async fn send(answer: &Answer<'_>) {
    let mut text: heapless::String<LONGEST_ANSWER> = heapless::String::new();
    // An answer that did not fit ends where the buffer does.
    _ = write!(text, "{answer}");
    for &byte in text.as_bytes().iter().chain(b"\r\n") {
        while pac::UART0.uartfr().read().txff() {
            yield_now().await;
        }
        pac::UART0.uartdr().write(|w| w.set_data(byte));
    }
}
