//! A stranger's program: one runnable, flown by the loop.

mod topics {
    use stampfly_types::messages::{ControlOutput, TofData};

    stampfly_bus::topics! {
        outside tof, motors;

        /// Range to the ground.
        range: TofData = latest @ 30 Hz from tof => [control];
        /// Thrust.
        thrust: ControlOutput = latest @ 30 Hz from control => [motors];
    }
}

use stampfly_bus::{Activation, Band, Runnable, schedule};
use stampfly_flight::Assembled;
use stampfly_types::{Instant, messages::{ControlOutput, TofData}};

/// Holds a height.
pub struct Control {
    height: f32,
}

impl Control {
    fn new(height: &f32) -> Self {
        Self { height: *height }
    }
}

impl Runnable for Control {
    type Ends<'b> = topics::ControlEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        let thrust = self.height - ends.range.get().distance;
        ends.thrust.publish(activation.now(), &ControlOutput { thrust, ..Default::default() });
    }
}

schedule! {
    /// Every runnable.
    pub struct Robot on crate::topics from f32;

    /// Holds the height.
    control = Control: on range, flight, 50 us;
}

fn main() {
    let mut bus = topics::Bus::new();
    let Assembled { mut flight_loop, mut outside, .. } = Assembled::<Robot>::new(&mut bus, None, &1.0, Instant::ZERO);
    let now = Instant::from_millis(1);
    outside.tof.range.publish(now, &TofData { distance: 0.25, ..Default::default() });
    assert!(flight_loop.run_band(Band::Flight, now, &mut ()));
    assert_eq!(outside.motors.thrust.latest().map(|sample| sample.data.thrust), Some(0.75));
}
