//! Plans moves on core 0, in floats, while core 1 ticks.

use crate::shared::Planned;
use abbe_core::background::{MoveRequest, PLANNING_TICKS};
use abbe_core::plan::LinePlan;
use embassy_futures::yield_now;
use heapless::spsc::{Consumer, Producer};

/// Plans one move after another, for ever.
pub async fn plan_moves(mut wanted: Consumer<'static, MoveRequest<2>>, mut plans: Producer<'static, Planned>) -> ! {
    loop {
        if plans.ready()
            && let Some(request) = wanted.dequeue()
        {
            let plan = LinePlan::new(request.from, request.to, &request.limits);
            let start = request.asked_at.wrapping_add(PLANNING_TICKS);
            _ = plans.enqueue(Planned { number: request.number, plan, start });
        }
        yield_now().await;
    }
}
