//! The first line names struct, topic table and configuration.
use stampfly_bus::{Activation, Runnable};

mod topics {
    use stampfly_types::messages::TofData;

    stampfly_bus::topics! {
        outside tof;
        /// Range to the ground.
        range: TofData = latest @ 30 Hz from tof => [landing];
    }
}

pub struct Step;

impl Step {
    fn new(_: &()) -> Self {
        Self
    }
}

impl Runnable for Step {
    type Ends<'b> = topics::LandingEnds<'b>;
    fn run(&mut self, _: &mut Activation, _: &mut Self::Ends<'_>) {}
}

stampfly_bus::schedule! {
    /// The runnables.
    pub struct Runnables on crate::topics;
    /// Waits.
    landing = Step: on range, flight, 10 us;
}

fn main() {}
