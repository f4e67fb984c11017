//! A vehicle of two topics: a range finder publishes, a height filter runs on every range, a display twice a second.

use stampfly_bus::{Activation, Band, Runnable, Schedule, Scheduler};
use stampfly_types::messages::{StateEstimate, TofData};
use stampfly_types::{Instant, math};

/// Who publishes what for whom.
mod topics {
    use stampfly_types::messages::{StateEstimate, TofData};

    stampfly_bus::topics! {
        outside tof;

        /// Range to the ground.
        range: TofData = ring(8) @ 30 Hz from tof => [filter];
        /// Smoothed height.
        estimate: StateEstimate = latest @ 30 Hz from filter => [display];
    }
}

stampfly_bus::schedule! {
    /// What runs when.
    struct Runnables on topics from ();

    /// Smooths ranges.
    filter = Filter: on range, flight, 20 us;
    /// Shows the height.
    display = Display: every 500 ms, background, 20 us;
}

/// Low-pass of everything that was published since the last time.
struct Filter {
    height: f32,
}

impl Filter {
    fn new(_: &()) -> Self {
        Self { height: 0.0 }
    }
}

impl Runnable for Filter {
    type Ends<'b> = topics::FilterEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        for range in ends.range.iter() {
            self.height += 0.3 * (range.data.distance - self.height);
        }
        ends.estimate.publish(activation.now(), &StateEstimate { height: self.height, ..Default::default() });
    }
}

/// Prints the newest height.
struct Display;

impl Display {
    fn new(_: &()) -> Self {
        Self
    }
}

impl Runnable for Display {
    type Ends<'b> = topics::DisplayEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        if let Some(estimate) = ends.estimate.sample() {
            let (seconds, height) = (activation.now().seconds_f64(), estimate.data.height);
            println!("{seconds:4.1} s  height {height:.3} m, estimate number {}", estimate.generation);
        }
    }
}

fn main() {
    let mut bus = topics::Bus::new();
    let stampfly_bus::Split { runnables: mut ends, mut outside, heads, .. } = bus.split(None);
    let mut vehicle = Runnables::new(&());
    let mut scheduler = Scheduler::<Runnables>::new(Instant::ZERO);

    // The executor: here a loop over a simulated clock, on a vehicle a task that the bus's hook wakes. It is
    // `stampfly_flight::FlightLoop` in short.
    for step in 1..=90 {
        let clock = Instant::from_micros(step * 33_333);
        let distance = 0.5 + 0.2 * math::sin(clock.since(Instant::ZERO).seconds());
        outside.tof.range.publish(clock, &TofData { distance, valid: true, ..Default::default() });
        for band in [Band::Flight, Band::Background] {
            while let Some((index, now)) = scheduler.start_first(band, clock, heads.as_ref()) {
                let mut activation = Activation::live(index as u8, now);
                Runnables::read(&mut ends, index, &mut activation);
                vehicle.run(&mut ends, index, &mut activation);
                scheduler.finished(index);
            }
        }
    }
}
