//! The tick, on core 1: read the front end, let the controller tick, hand the pulses to the front end.
//!
//! The timer's second alarm interrupts core 1 every [`TICK_US`]. What a tick decides takes effect at the beginning of
//! the next one, but for switching off, which does not wait.

use crate::design::TICK_US;
use crate::front::Front;
use crate::shared::{LAST_HEARD, PLACES, Planned, STATUS, TICKS, Taken};
use abbe_core::background::MoveRequest;
use abbe_core::{Command, Controller, Inputs};
use core::cell::UnsafeCell;
use core::sync::atomic::Ordering;
use embassy_rp::interrupt;
use embassy_rp::pac;
use heapless::spsc::{Consumer, Producer};

/// The alarm of the timer that core 1 has for itself; embassy takes the first.
const ALARM: usize = 1;

/// Core 1's ends of the queues.
pub struct Queues {
    /// Requests for the controller.
    pub commands: Consumer<'static, Command<2>, PLACES>,
    /// Their answers.
    pub answers: Producer<'static, Taken, PLACES>,
    /// Moves that want a plan.
    pub wanted: Producer<'static, MoveRequest<2>, PLACES>,
    /// Plans.
    pub plans: Consumer<'static, Planned, PLACES>,
}

/// Everything that core 1 owns.
pub struct Tick {
    controller: Controller<2>,
    front: Front,
    queues: Queues,
    /// Number of this tick, and the time at which it was due, µs.
    number: u32,
    due_us: u32,
    /// Last move for which a plan was asked.
    asked: Option<u32>,
}

/// A place for what only core 1 touches, once it is there.
struct Core1(UnsafeCell<Option<Tick>>);

// SAFETY: written by `run` before the interrupt is enabled, and from then on touched by that interrupt alone.
unsafe impl Sync for Core1 {}

static TICK: Core1 = Core1(UnsafeCell::new(None));

impl Tick {
    /// Drives off, no ticks yet.
    pub fn new(controller: Controller<2>, front: Front, queues: Queues) -> Self {
        Self { controller, front, queues, number: 0, due_us: 0, asked: None }
    }

    /// Takes core 1: ticks from now on.
    pub fn run(mut self) -> ! {
        self.due_us = now_us().wrapping_add(TICK_US);
        let first = self.due_us;
        // SAFETY: the interrupt that uses this place is not enabled yet, and this is the only core that enables it.
        unsafe { *TICK.0.get() = Some(self) };
        pac::TIMER.inte().modify(|w| w.set_alarm(ALARM, true));
        pac::TIMER.alarm(ALARM).write_value(first);
        // SAFETY: everything that the handler uses is in its place.
        unsafe { cortex_m::peripheral::NVIC::unmask(pac::Interrupt::TIMER_IRQ_1) };
        // Awake: it would wake up with a delay that varies.
        loop {
            cortex_m::asm::nop();
        }
    }

    /// One tick.
    #[inline(never)]
    fn tick(&mut self) {
        self.front.release();
        let inputs = self.inputs();
        self.take_command();
        self.take_plan();
        let outputs = self.controller.tick(&inputs);
        self.front.prepare(&outputs);
        self.ask_for_plan();
        STATUS.write(Some(self.controller.status()));
        TICKS.store(self.number, Ordering::Relaxed);
    }

    fn inputs(&mut self) -> Inputs<2> {
        let mut inputs = Inputs::at_rest(self.number);
        self.front.read(&mut inputs);
        inputs.heartbeat_age = self.number.wrapping_sub(LAST_HEARD.load(Ordering::Relaxed));
        inputs
    }

    /// One request a tick: each is answered within two.
    fn take_command(&mut self) {
        if self.queues.answers.ready()
            && let Some(command) = self.queues.commands.dequeue()
        {
            // There is room: it was looked for before, and nobody else writes.
            _ = self.queues.answers.enqueue(self.controller.command(command));
        }
    }

    fn take_plan(&mut self) {
        if let Some(Planned { number, plan, start }) = self.queues.plans.dequeue() {
            self.controller.take_plan(number, plan, start);
        }
    }

    fn ask_for_plan(&mut self) {
        if let Some(request) = self.controller.wanted_plan()
            && self.asked != Some(request.number)
            && self.queues.wanted.enqueue(request).is_ok()
        {
            self.asked = Some(request.number);
        }
    }

    /// Sets the next alarm; ticks whose time has passed meanwhile are missed, and the controller sees that by the
    /// number.
    fn schedule(&mut self) {
        self.number = self.number.wrapping_add(1);
        self.due_us = self.due_us.wrapping_add(TICK_US);
        pac::TIMER.alarm(ALARM).write_value(self.due_us);
        // An alarm in the past would not ring for 71 minutes.
        while now_us().wrapping_sub(self.due_us) < u32::MAX / 2 {
            self.number = self.number.wrapping_add(1);
            self.due_us = self.due_us.wrapping_add(TICK_US);
            pac::TIMER.alarm(ALARM).write_value(self.due_us);
            self.front.abandon();
        }
    }
}

/// Time since power-on, µs; wraps.
fn now_us() -> u32 {
    pac::TIMER.timerawl().read()
}

#[interrupt]
fn TIMER_IRQ_1() {
    pac::TIMER.intr().write(|w| w.set_alarm(ALARM, true));
    // SAFETY: enabled on core 1 alone, after the place was filled; it does not interrupt itself.
    if let Some(tick) = unsafe { &mut *TICK.0.get() } {
        tick.tick();
        tick.schedule();
    }
}
