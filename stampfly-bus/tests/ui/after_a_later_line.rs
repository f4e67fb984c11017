//! The flight band runs in table order: nothing can run after what comes later.
use stampfly_bus::{Activation, Runnable, schedule, topics};
use stampfly_types::messages::TofData;

topics! {
    /// One topic.
    pub mod wiring;
    /// Range to the ground.
    range: TofData = latest @ 30 Hz from tof => [landing];
}

pub struct Step<'b>(wiring::range::Rx<'b>);

impl Runnable for Step<'_> {
    fn read(&mut self, _: &mut Activation) {}
    fn run(&mut self, _: &mut Activation) {}
}

schedule! {
    /// The activations.
    pub mod plan on wiring;
    /// Too early.
    early = Step: after late, flight, 10 us;
    /// Too late.
    late = Step: on range, flight, 10 us;
}

fn main() {}
