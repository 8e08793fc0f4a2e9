//! The controller on a Raspberry Pi Pico.
//!
//! | where | what | room |
//! |---|---|---|
//! | PIO | decoders, index latches, step emitters, serial receiver | `front.rs`, `pio.rs`, `pio/` |
//! | core 1 | the tick, 10 kHz, by an interrupt of the timer; owns the controller | `tick.rs` |
//! | core 0 | serial port, planning, and a watch over core 1 in an interrupt | `serial.rs`, `planner.rs`, `watch.rs` |
//! | between | queues one way and the other, a snapshot behind a seqlock | `shared.rs` |
//! | for a debugger | the last tick in words | `telemetry.rs` |
//!
//! The stage, every pin and every number of time stand in `design.rs`. A resistor holds the drives off until `main`'s first line
//! does (`safety.rs`), and they go off by themselves when the tick stalls: no pulses without fresh words, no torque after
//! 3.2 milliseconds, a new start after 200.
#![no_std]
#![no_main]

mod design;
mod front;
mod pins;
mod pio;
mod planner;
mod safety;
mod serial;
mod shared;
mod telemetry;
mod tick;
mod watch;

use abbe_core::Controller;
use embassy_executor::{Executor, task};
use embassy_rp::multicore::{Stack, spawn_core1};
use embassy_rp::watchdog::Watchdog;

/// Stack of core 1, bytes; `cargo xtask firmware` shows how much of it the tick can use.
const CORE1_STACK: usize = 8192;

static mut STACK: Stack<CORE1_STACK> = Stack::new();
static mut EXECUTOR: Option<Executor> = None;

#[cortex_m_rt::entry]
fn main() -> ! {
    safety::drives_off_before_all_else();
    let chip = embassy_rp::init(embassy_rp::config::Config::default());
    safety::drives_off();
    let mut watchdog = Watchdog::new(chip.WATCHDOG);
    watch::begin(&mut watchdog);
    pins::set_up();
    serial::set_up();
    let front = front::Front::set_up();

    // A stage that does not build stays off.
    let Ok(config) = design::STAGE.build() else { safety::last_resort() };
    let (commands_in, commands) = shared::commands();
    let (answers, answers_out) = shared::answers();
    let (wanted, wanted_out) = shared::wanted();
    let (plans_in, plans) = shared::plans();
    let (received_in, received) = shared::received();
    let queues = tick::Queues { commands, answers, wanted, plans };
    tick::Tick::new(Controller::new(config), front, queues).place();
    // SAFETY: this line is reached once, and the stack is named nowhere else.
    let stack = unsafe { (&raw mut STACK).as_mut() };
    let Some(stack) = stack else { safety::last_resort() };
    spawn_core1(chip.CORE1, stack, || tick::run());

    serial::receive_into(received_in);
    let lines = serial::Queues { received, commands: commands_in, answers: answers_out };
    // SAFETY: this line is reached once, and the executor is named nowhere else.
    let executor = unsafe { (&raw mut EXECUTOR).as_mut() };
    let Some(place) = executor else { safety::last_resort() };
    let executor = place.insert(Executor::new());
    executor.run(|spawner| {
        let (Ok(feed), Ok(lines), Ok(plans)) =
            (feed(watchdog), answer_lines(lines), plan_moves(wanted_out, plans_in))
        else {
            safety::last_resort()
        };
        spawner.spawn(feed);
        spawner.spawn(lines);
        spawner.spawn(plans);
    })
}

#[task]
async fn feed(watchdog: Watchdog) {
    watch::feed(watchdog).await;
}

#[task]
async fn answer_lines(queues: serial::Queues) {
    serial::answer_lines(queues).await;
}

#[task]
async fn plan_moves(
    wanted: heapless::spsc::Consumer<'static, abbe_core::background::MoveRequest<2>, { shared::PLACES }>,
    plans: heapless::spsc::Producer<'static, shared::Planned, { shared::PLACES }>,
) {
    planner::plan_moves(wanted, plans).await;
}
