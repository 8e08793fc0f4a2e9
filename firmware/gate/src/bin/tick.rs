//! What a board calls in every tick, and nothing else: the image in which the machine code of the tick is judged.
//!
//! Nothing here is ever run. Each entry is a function of its own that is not inlined, so that the call graph can be
//! followed from its name.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use abbe_core::background::MoveRequest;
use abbe_core::command::{Accepted, Refusal};
use abbe_core::plan::LinePlan;
use abbe_core::{Command, Controller, Inputs, Outputs, Status};

/// Does the whole work of a servo period.
#[inline(never)]
fn tick(controller: &mut Controller<2>, inputs: &Inputs<2>) -> Outputs<2> {
    controller.tick(inputs)
}

/// Between two ticks: a request from the queue.
#[inline(never)]
fn command(controller: &mut Controller<2>, command: Command<2>) -> Result<Accepted, Refusal> {
    controller.command_without_floats(command)
}

/// Between two ticks: the snapshot for the other core.
#[inline(never)]
fn status(controller: &Controller<2>) -> Status<2> {
    controller.status()
}

/// Between two ticks: what the other core has to plan.
#[inline(never)]
fn wanted_plan(controller: &Controller<2>) -> Option<MoveRequest<2>> {
    controller.wanted_plan()
}

/// Between two ticks: the plan that the other core has made.
#[inline(never)]
fn take_plan(controller: &mut Controller<2>, number: u32, plan: LinePlan<2>, start: u32) {
    controller.take_plan(number, plan, start);
}

/// Something the compiler cannot know: the content of the memory at an address it cannot know.
fn unknown<T>() -> T {
    // SAFETY: nothing here is ever run.
    unsafe { core::ptr::read(black_box(core::ptr::dangling::<T>())) }
}

/// Where the image would start.
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> ! {
    let mut controller: Controller<2> = unknown();
    let controller = black_box(&mut controller);
    loop {
        black_box(tick(controller, &unknown()));
        black_box(&command(controller, unknown()));
        black_box(&status(controller));
        black_box(&wanted_plan(controller));
        take_plan(controller, unknown(), unknown(), unknown());
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {}
}
