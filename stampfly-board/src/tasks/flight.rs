//! The task that flies: sample, estimate, decision, duty, one after the other, without a hand-off.
//!
//! The inertial sensor's [`pump`](super::pump) is polled inside this task, so between the sample's arrival and the
//! motors there is no other task, no queue and no context switch. Background activations run here, too, one at a time
//! and only while the flight band has nothing to do: what is due waits at most for the longest of them, which is what
//! the response times of the activation table count with.

use crate::{FlightLoop, Observer, wiring};
use core::convert::Infallible;
use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;
use stampfly_bus::Band;
use stampfly_drivers::time::sleep_until;
use stampfly_drivers::{MotorOutputs, Timebase};
use stampfly_types::Duration;

/// With nothing scheduled, which no vehicle has, the task looks again after this long.
const IDLE: Duration = Duration::from_millis(10);

/// Flies for ever.
///
/// `sensing` publishes what activates the flight band; it is polled first. When it stays silent, the deadlines of the
/// activation table run what they name. `written` is told the outcome whenever duties have gone to the motors: feed an
/// independent timer there that stops the motors when this task stops.
///
/// The flight loop is borrowed, because it is large and a future holds what it is given more than once: firmware keeps it
/// in a `static`.
///
/// Other topics that activate a runnable (`on TOPIC`) have to be published from `sensing`, or from a task of the same
/// executor that wakes this one.
pub async fn fly<M: MotorOutputs>(
    sensing: impl Future<Output = Infallible>,
    flight_loop: &mut FlightLoop<'_>,
    mut duties: wiring::actuator_motor::Rx<'_>,
    mut motors: M,
    clock: impl Timebase,
    observer: &mut impl Observer,
    mut written: impl FnMut(Result<(), M::Error>),
) -> Infallible {
    let mut sensing = pin!(sensing);
    loop {
        let mut timer = clock.clone();
        let deadline = flight_loop.next_tick().unwrap_or_else(|| clock.now() + IDLE);
        let mut alarm = pin!(sleep_until(&mut timer, deadline));
        poll_fn(|context| {
            if let Poll::Ready(never) = sensing.as_mut().poll(context) {
                match never {}
            }
            let now = clock.now();
            if flight_loop.is_due(Band::Flight, now) || flight_loop.is_due(Band::Background, now) {
                return Poll::Ready(());
            }
            alarm.as_mut().poll(context)
        })
        .await;
        let now = clock.now();
        if flight_loop.run_band(Band::Flight, now, observer) {
            if duties.has_new()
                && let Some(output) = duties.latest()
            {
                written(motors.write(&output.data));
            }
        } else if let Some(pending) = flight_loop.start_next(Band::Background, now, observer) {
            flight_loop.finish(pending, observer);
            // Drivers of the same executor get their turn before the next one.
            let mut waited = false;
            poll_fn(|context| {
                context.waker().wake_by_ref();
                if core::mem::replace(&mut waited, true) { Poll::Ready(()) } else { Poll::Pending }
            })
            .await;
        }
    }
}
