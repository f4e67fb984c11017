//! What cannot have finished before it is due again does not compile.

use stampfly_bus::{Activation, Runnable, schedule, topics};
use stampfly_types::messages::ImuData;

topics! {
    /// Two topics.
    pub mod wiring;
    /// At a rate.
    sample: ImuData = latest @ 400 Hz from imu => [];
    /// At none.
    event: ImuData = latest @ on event from somebody => [];
}

struct Anything<'b>(core::marker::PhantomData<&'b ()>);
impl Runnable for Anything<'_> {
    fn read(&mut self, _: &mut Activation) {}
    fn run(&mut self, _: &mut Activation) {}
}

mod too_much {
    use super::{Anything, schedule, wiring};
    schedule! {
        /// 2500 us less a tenth are too little for this.
        pub mod plan on wiring;
        /// A quick one.
        estimation = Anything: on sample, flight, 300 us;
        /// A slow one.
        control = Anything: after estimation, flight, 1960 us;
    }
}

mod without_a_rate {
    use super::{Anything, schedule, wiring};
    schedule! {
        /// Nobody knows how often this runs.
        pub mod plan on wiring;
        /// Whenever it likes.
        watcher = Anything: on event, background, 10 us;
    }
}

fn main() {}
