// A rover that stops in front of a wall: three topics, two runnables. The tests and examples of this crate run it.
// (No `//!`: the examples include this file in the middle of another one.)

use stampfly_bus::{Activation, Runnable};
use stampfly_types::Duration;
use stampfly_types::messages::{FlightPhase, FlightStatus, MotorOutput};

/// Its topics.
pub mod topics {
    use stampfly_types::messages::{FlightStatus, MotorOutput, TofData};

    stampfly_bus::topics! {
        outside range_finder, motors;

        /// Distance to the wall.
        sensor_range: TofData = ring(4) @ 50 Hz from range_finder => [drive];
        /// Duty of the two wheels.
        actuator_motor: MotorOutput = latest @ 50 Hz from drive => [motors, monitor];
        /// Moving or not.
        flight_status: FlightStatus = latest @ 10 Hz from monitor => [];
    }
}

stampfly_bus::schedule! {
    /// Its runnables.
    #[derive(Clone, Debug)]
    pub struct Rover on topics from f32;

    /// Slows down in front of the wall, and stops without a range.
    drive = Drive: on sensor_range or at latest 50 ms, flight, 100 us;
    /// Tells whether the rover moves.
    monitor = Monitor: every 100 ms, background, 80 us;
}

/// Duty per metre to the wall.
#[derive(Clone, Debug)]
pub struct Drive {
    gain: f32,
}

impl Drive {
    fn new(gain: &f32) -> Self {
        Self { gain: *gain }
    }
}

impl Runnable for Drive {
    type Ends<'b> = topics::DriveEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        let range = ends.sensor_range.last().map(|sample| sample.data);
        let duty = range.filter(|range| range.valid).map_or(0.0, |range| (self.gain * range.distance).min(1.0));
        let mut output = MotorOutput { count: 2, armed: duty > 0.0, ..Default::default() };
        (output.duty[0], output.duty[1]) = (duty, duty);
        ends.actuator_motor.publish(activation.now(), &output);
    }
}

/// Watches the motors.
#[derive(Clone, Debug)]
pub struct Monitor;

impl Monitor {
    fn new(_: &f32) -> Self {
        Self
    }
}

impl Runnable for Monitor {
    type Ends<'b> = topics::MonitorEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        let moving = ends.actuator_motor.fresh(activation.now(), Duration::from_millis(100)).is_some_and(|m| m.armed);
        let phase = if moving { FlightPhase::Armed } else { FlightPhase::IdleGround };
        ends.flight_status.publish(activation.now(), &FlightStatus { phase, armed: moving, ..Default::default() });
    }
}
