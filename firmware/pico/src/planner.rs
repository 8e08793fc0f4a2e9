//! Plans moves on core 0, in floats, while core 1 ticks.

use crate::design::POLL_US;
use crate::shared::{PLACES, Planned};
use abbe_core::background::{MoveRequest, PLANNING_TICKS};
use abbe_core::plan::LinePlan;
use embassy_time::Timer;
use heapless::spsc::{Consumer, Producer};

/// Plans one move after another, for ever.
pub async fn plan_moves(
    mut wanted: Consumer<'static, MoveRequest<2>, PLACES>,
    mut plans: Producer<'static, Planned, PLACES>,
) -> ! {
    loop {
        if plans.ready()
            && let Some(request) = wanted.dequeue()
        {
            let plan = LinePlan::new(request.from, request.to, &request.limits);
            let start = request.asked_at.wrapping_add(PLANNING_TICKS);
            _ = plans.enqueue(Planned { number: request.number, plan, start });
        }
        Timer::after_micros(POLL_US).await;
    }
}
