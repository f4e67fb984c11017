//! The rover's flight task on virtual time.

use crate::common::{Id, Rover, topics};
use embedded_hal_async::delay::DelayNs;
use stampfly_bus::Activation;
use stampfly_flight::task::fly;
use stampfly_flight::{Assembled, FlightLoop, Observer};
use stampfly_types::messages::TofData;
use stampfly_types::{Duration, Instant};
use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::future::{Future, pending, poll_fn};
use std::pin::{Pin, pin};
use std::task::{Context, Poll, Waker};

/// A clock that the test turns.
#[derive(Default)]
struct Clock(Cell<Instant>);

impl Clock {
    fn now(&self) -> Instant {
        self.0.get()
    }

    /// Polls a task every 0.1 ms until this instant. Nothing may finish it.
    fn run(&self, mut task: Pin<&mut impl Future<Output = Infallible>>, until: Instant) {
        while self.now() <= until {
            assert!(task.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending());
            self.0.set(self.now() + Duration::from_micros(100));
        }
    }
}

struct Delay<'c>(&'c Clock);

impl DelayNs for Delay<'_> {
    async fn delay_ns(&mut self, ns: u32) {
        let end = self.0.now() + Duration::from_micros(u64::from(ns.div_ceil(1_000)));
        poll_fn(|_| if self.0.now() >= end { Poll::Ready(()) } else { Poll::Pending }).await;
    }
}

/// What ran, and when it was computed for.
struct Ran<'r>(&'r RefCell<Vec<(usize, Instant)>>);

impl Observer for Ran<'_> {
    fn finished(&mut self, activation: &Activation) {
        self.0.borrow_mut().push((usize::from(activation.record().index), activation.now()));
    }
}

const DRIVE: usize = Id::drive as usize;
const MONITOR: usize = Id::monitor as usize;

#[test]
fn samples_and_deadlines_reach_the_motors_at_once() {
    let (clock, ran, duties) = (Clock::default(), RefCell::new(Vec::new()), RefCell::new(Vec::new()));
    let mut bus = topics::Bus::new();
    let Assembled { mut flight_loop, outside, .. } = Assembled::<Rover>::new(&mut bus, None, &0.5, Instant::ZERO);
    let topics::Outside { mut range_finder, mut motors } = outside;
    // Two ranges, stamped half a millisecond before they arrive, then silence.
    let sensing = async {
        for arrives in [20, 40].map(Instant::from_millis) {
            Delay(&clock).delay_us(arrives.since(clock.now()).as_micros() as u32).await;
            let range = TofData { distance: 1.5, valid: true, ..Default::default() };
            range_finder.sensor_range.publish(arrives - Duration::from_micros(500), &range);
        }
        pending().await
    };
    let write = |now, _: &mut FlightLoop<'_, Rover>| {
        let output = motors.actuator_motor.latest().expect("the flight band has just published");
        duties.borrow_mut().push((now, output.data.duty[0]));
    };
    let task = fly(sensing, &mut flight_loop, || clock.now(), Delay(&clock), Ran(&ran), write);
    clock.run(pin!(task), Instant::from_millis(150));

    let at = Instant::from_micros;
    let expected = [
        (DRIVE, at(19_500)),
        (DRIVE, at(39_500)),
        // 50 ms after it ran last, by the clock.
        (DRIVE, at(90_000)),
        (MONITOR, at(100_000)),
        (DRIVE, at(140_000)),
    ];
    assert_eq!(*ran.borrow(), expected);
    let expected = [(at(20_000), 0.75), (at(40_000), 0.75), (at(90_000), 0.0), (at(140_000), 0.0)];
    assert_eq!(*duties.borrow(), expected, "in the poll in which it became due");
}

#[test]
fn a_task_that_was_dropped_can_be_started_again() {
    let (clock, ran) = (Clock::default(), RefCell::new(Vec::new()));
    let mut bus = topics::Bus::new();
    let Assembled { mut flight_loop, .. } = Assembled::<Rover>::new(&mut bus, None, &0.5, Instant::ZERO);
    for until in [75, 120].map(Instant::from_millis) {
        let task = fly(
            pending(),
            &mut flight_loop,
            || clock.now(),
            Delay(&clock),
            Ran(&ran),
            |_, _: &mut FlightLoop<'_, Rover>| {},
        );
        clock.run(pin!(task), until);
    }
    let at = Instant::from_millis;
    let expected = [(DRIVE, at(50)), (DRIVE, at(100)), (MONITOR, at(100))];
    assert_eq!(*ran.borrow(), expected);
}
