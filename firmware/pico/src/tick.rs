//! The tick, on core 1: read the front end, let the controller tick, hand the pulses to the front end.
//!
//! The timer's second alarm interrupts core 1 every [`TICK_US`]. What a tick decides takes effect at the beginning of
//! the next one, but for switching off, which does not wait.

use crate::design::TICK_US;
use crate::front::Front;
use crate::shared::{LAST_HEARD, PLACES, Planned, STATUS, TICKS, Taken};
use crate::telemetry::{self, Counts, Over};
use abbe_core::background::MoveRequest;
use abbe_core::{Command, Controller, Inputs, Outputs};
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
    /// Last move for which a plan was asked, and when.
    asked: Option<Asked>,
    counts: Counts,
}

/// A plan was asked for.
#[derive(Clone, Copy)]
struct Asked {
    number: u32,
    tick: u32,
}

/// A place for what only core 1 touches, once it is there.
struct Core1(UnsafeCell<Option<Tick>>);

// SAFETY: written before core 1 starts, and from then on touched by core 1 alone.
unsafe impl Sync for Core1 {}

static TICK: Core1 = Core1(UnsafeCell::new(None));

impl Tick {
    /// Drives off, no ticks yet.
    pub fn new(controller: Controller<2>, front: Front, queues: Queues) -> Self {
        Self { controller, front, queues, number: 0, due_us: 0, asked: None, counts: Counts::default() }
    }

    /// Puts it where core 1 will find it, from core 0 and before core 1 runs: it is too large to be handed over on a stack.
    pub fn place(self) {
        // Here and not on core 1: the register is shared.
        pac::TIMER.inte().modify(|w| w.set_alarm(ALARM, true));
        // SAFETY: core 1, which alone uses this place afterwards, has not been started.
        unsafe { *TICK.0.get() = Some(self) };
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
        self.tell(&outputs);
        TICKS.store(self.number, Ordering::Relaxed);
    }

    /// The snapshot for core 0, and the words for whoever looks into the memory.
    ///
    /// A function of its own: taken apart among the registers of the tick, a status costs twice the copying.
    #[inline(never)]
    fn tell(&self, outputs: &Outputs<2>) {
        let status = Some(self.controller.status());
        STATUS.write(&status);
        if let Some(status) = &status {
            telemetry::write(&Over { status, outputs, counts: self.counts, due_us: self.due_us });
        }
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
            let answer = self.controller.command_without_floats(command);
            // There is room: it was looked for before, and nobody else writes.
            _ = self.queues.answers.enqueue(answer);
            self.counts.commands = self.counts.commands.wrapping_add(1);
        }
    }

    fn take_plan(&mut self) {
        if let Some(Planned { number, plan, start }) = self.queues.plans.dequeue() {
            self.controller.take_plan(number, plan, start);
            if let Some(asked) = self.asked {
                self.counts.planning = self.counts.planning.max(self.number.wrapping_sub(asked.tick));
            }
        }
    }

    fn ask_for_plan(&mut self) {
        if let Some(request) = self.controller.wanted_plan()
            && self.asked.is_none_or(|asked| asked.number != request.number)
            && self.queues.wanted.enqueue(request).is_ok()
        {
            self.asked = Some(Asked { number: request.number, tick: self.number });
        }
    }

    /// Before a tick that comes later than the next one was due, nothing it would release may take effect.
    fn skip_what_is_late(&mut self) {
        while has_come(self.due_us.wrapping_add(TICK_US)) {
            self.skip();
        }
    }

    /// Passes over a tick whose time has passed: the controller sees it by the number, the drives do not wait for it.
    fn skip(&mut self) {
        self.number = self.number.wrapping_add(1);
        self.due_us = self.due_us.wrapping_add(TICK_US);
        self.counts.missed = self.counts.missed.wrapping_add(1);
        self.front.abandon();
    }

    /// Sets the next alarm; ticks whose time has passed meanwhile are missed, and the controller sees that by the
    /// number.
    fn schedule(&mut self) {
        self.counts.longest_us = self.counts.longest_us.max(now_us().wrapping_sub(self.due_us));
        self.number = self.number.wrapping_add(1);
        self.due_us = self.due_us.wrapping_add(TICK_US);
        pac::TIMER.alarm(ALARM).write_value(self.due_us);
        // An alarm in the past would not ring for 71 minutes.
        while has_come(self.due_us) {
            self.skip();
            pac::TIMER.alarm(ALARM).write_value(self.due_us);
        }
    }
}

/// Takes core 1: ticks from now on.
pub fn run() -> ! {
    // SAFETY: the interrupt that uses this place is not enabled yet, and core 0 has done with it.
    if let Some(tick) = unsafe { &mut *TICK.0.get() } {
        tick.due_us = now_us().wrapping_add(TICK_US);
        pac::TIMER.alarm(ALARM).write_value(tick.due_us);
    }
    // SAFETY: everything that the handler uses is in its place, and nothing else uses it from here on.
    unsafe { cortex_m::peripheral::NVIC::unmask(pac::Interrupt::TIMER_IRQ_1) };
    // Awake: it would wake up with a delay that varies.
    loop {
        cortex_m::asm::nop();
    }
}

/// Time since power-on, µs; wraps.
fn now_us() -> u32 {
    pac::TIMER.timerawl().read()
}

/// Whether a time, at most half an hour away, is now or past.
fn has_come(due_us: u32) -> bool {
    now_us().wrapping_sub(due_us) <= u32::MAX / 2
}

#[interrupt]
fn TIMER_IRQ_1() {
    pac::TIMER.intr().write(|w| w.set_alarm(ALARM, true));
    // SAFETY: enabled on core 1 alone, after the place was filled; it does not interrupt itself.
    if let Some(tick) = unsafe { &mut *TICK.0.get() }
        && has_come(tick.due_us)
    {
        tick.skip_what_is_late();
        tick.tick();
        tick.schedule();
    }
}
