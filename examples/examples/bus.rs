//! A vehicle of two topics: a range finder publishes, a height filter runs on every range, a display twice a second.

use stampfly_bus::{Activation, Band, Runnable, Runnables, Scheduler, Stamped, schedule, topics};
use stampfly_types::messages::{StateEstimate, TofData};
use stampfly_types::{Instant, math};

topics! {
    /// Who publishes what for whom.
    pub mod wiring;
    /// Range to the ground.
    range: TofData = ring(8) @ 30 Hz from tof => [filter];
    /// Smoothed height.
    estimate: StateEstimate = latest @ 30 Hz from filter => [display];
}

schedule! {
    /// Who runs when.
    pub mod plan on wiring;
    /// Smooths ranges.
    filter = Filter: on range, flight, 20 us;
    /// Shows the height.
    display = Display: every 500 ms, background, 20 us;
}

/// Low-pass of everything that was published since the last time.
pub struct Filter<'b> {
    ranges: wiring::range::Rx<'b>,
    out: wiring::estimate::Tx<'b>,
    new: heapless::Vec<Stamped<TofData>, 8>,
    height: f32,
}

impl Runnable for Filter<'_> {
    fn read(&mut self, activation: &mut Activation) {
        activation.drain(&mut self.ranges, &mut self.new);
    }
    fn run(&mut self, activation: &mut Activation) {
        for range in &self.new {
            self.height += 0.3 * (range.data.distance - self.height);
        }
        self.out.publish(activation.now(), &StateEstimate { height: self.height, ..Default::default() });
    }
}

/// Prints the newest height.
pub struct Display<'b> {
    estimate: wiring::estimate::Rx<'b>,
    newest: Option<Stamped<StateEstimate>>,
}

impl Runnable for Display<'_> {
    fn read(&mut self, activation: &mut Activation) {
        self.newest = activation.latest(&mut self.estimate);
    }
    fn run(&mut self, activation: &mut Activation) {
        if let Some(Stamped { generation, data, .. }) = self.newest {
            println!(
                "{:4.1} s  height {:.3} m, estimate number {generation}",
                activation.now().seconds_f64(),
                data.height
            );
        }
    }
}

fn main() {
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports: wiring::Ports { mut range, estimate }, heads, .. } = bus.split(None);
    let mut vehicle = plan::Vehicle {
        filter: Filter { ranges: range.filter, out: estimate.tx, new: heapless::Vec::new(), height: 0.0 },
        display: Display { estimate: estimate.display, newest: None },
    };
    let mut scheduler: Scheduler<{ plan::COUNT }, { wiring::COUNT }> =
        Scheduler::new(&plan::ACTIVATIONS, Instant::ZERO);

    // The executor: here a loop over a simulated clock, on a vehicle a task that the bus's hook wakes.
    for step in 1..=90 {
        let clock = Instant::from_micros(step * 33_333);
        let distance = 0.5 + 0.2 * math::sin(clock.since(Instant::ZERO).seconds());
        range.tx.publish(clock, &TofData { distance, valid: true, ..Default::default() });
        for band in [Band::Flight, Band::Background] {
            while let Some((index, now)) = scheduler.due(band, 0, clock, &heads) {
                let mut activation = Activation::live(now);
                scheduler.started(index, now, clock, &heads);
                vehicle.read(index, &mut activation);
                vehicle.run(index, &mut activation);
                scheduler.finished(index);
            }
        }
    }
}
