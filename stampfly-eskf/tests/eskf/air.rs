//! `Air`: rejection of a faulty pitot tube by the velocity, and acceptance once it agrees again.

use stampfly_eskf::{Air, Estimator, Fusion, Refusal};
use stampfly_types::messages::{
    AirspeedData, BaroData, CalibrationResult, EstimatorCommand, EstimatorStatus, FlowData, ImuData, MagData,
    SensorMask, StateEstimate, TofData, Validity,
};
use stampfly_types::{Duration, Instant, Stamped, Vec3};

/// An estimator whose estimate the test sets.
struct Told(StateEstimate);

const NOT_USED: Fusion = Fusion::Refused(Refusal::NotUsed);

impl Estimator for Told {
    fn initialize(&mut self, _: Instant, _: &CalibrationResult) {}
    fn command(&mut self, _: Instant, _: &EstimatorCommand) {}
    fn predict(&mut self, _: Instant, _: &ImuData) {}
    fn fuse_tof(&mut self, _: Instant, _: &TofData) -> Fusion {
        NOT_USED
    }
    fn fuse_flow(&mut self, _: Instant, _: &FlowData) -> Fusion {
        NOT_USED
    }
    fn fuse_baro(&mut self, _: Instant, _: &BaroData) -> Fusion {
        NOT_USED
    }
    fn fuse_mag(&mut self, _: Instant, _: &MagData) -> Fusion {
        NOT_USED
    }
    fn fuse_velocity(&mut self, _: Instant, _: &Vec3, _: &Vec3) -> Fusion {
        NOT_USED
    }
    fn estimate(&self) -> StateEstimate {
        self.0
    }
    fn status(&self) -> EstimatorStatus {
        EstimatorStatus::default()
    }
}

/// An aircraft that flies north at 15 m/s in still air, and its tube.
struct Flight {
    air: Air,
    estimator: Told,
    now: Instant,
    on_ground: bool,
}

impl Flight {
    fn new() -> Self {
        let mut flight = Self {
            air: Air::new(17.0),
            estimator: Told(StateEstimate::default()),
            now: Instant::ZERO,
            on_ground: true,
        };
        flight.knows_its_velocity(true);
        flight.goes_on(1.0, Some(0.0));
        flight.on_ground = false;
        flight
    }

    fn knows_its_velocity(&mut self, known: bool) {
        self.estimator.0.velocity = Vec3::new(15.0, 0.0, 0.0);
        self.estimator.0.valid = self.estimator.0.valid.set(Validity::VELOCITY_XY, known);
        self.estimator.0.sensors = SensorMask::NONE.set(SensorMask::EXTERNAL, known);
    }

    /// Flies `seconds` with a tube that shows this speed, m/s, or is silent. Returns whether the
    /// tube is accepted at the end, and the airspeed.
    fn goes_on(&mut self, seconds: f32, tube: Option<f32>) -> (bool, f32) {
        for _ in 0..(seconds * 100.0) as u32 {
            self.now += Duration::from_millis(10);
            let sample = tube.map(|speed| Stamped {
                at: self.now,
                generation: 1,
                data: AirspeedData { pressure: 0.5 * 1.225 * speed * speed, temperature: 15.0 },
            });
            self.air.step(self.now, sample.as_slice(), 0.0, self.on_ground, &mut self.estimator);
        }
        let state = self.air.state(&self.estimator.0);
        (state.measured, state.airspeed)
    }
}

#[test]
fn a_tube_that_shows_nothing_is_doubted_after_a_second() {
    let mut flight = Flight::new();
    assert_eq!(flight.goes_on(0.5, Some(0.0)), (true, 0.0));
    assert_eq!(flight.goes_on(0.6, Some(0.0)), (false, 15.0), "velocity less wind");
}

/// Regression: a blocked tube was accepted ten seconds after the last fix, because no reference
/// contradicted it any more.
#[test]
fn a_doubted_tube_is_not_believed_because_nothing_contradicts_it() {
    let mut flight = Flight::new();
    flight.goes_on(5.0, Some(0.0));
    flight.knows_its_velocity(false);
    assert_eq!(flight.goes_on(60.0, Some(0.0)), (false, 17.0), "the airspeed when nothing shows it");
    flight.knows_its_velocity(true);
    assert_eq!(flight.goes_on(60.0, Some(0.0)), (false, 15.0));
}

/// Without fixes the velocity drifts away from a correct tube.
#[test]
fn a_velocity_that_nobody_corrects_does_not_judge() {
    let mut flight = Flight::new();
    flight.estimator.0.sensors = SensorMask::NONE;
    let (measured, speed) = flight.goes_on(30.0, Some(9.0));
    assert!(measured && (speed - 9.0).abs() < 0.1, "{speed}");
}

#[test]
fn a_doubted_tube_is_believed_again_when_it_has_agreed_for_ten_seconds() {
    let mut flight = Flight::new();
    flight.goes_on(5.0, Some(0.0));
    let (measured, _) = flight.goes_on(9.0, Some(15.0));
    assert!(!measured);
    let (measured, speed) = flight.goes_on(1.5, Some(15.0));
    assert!(measured && (speed - 15.0).abs() < 0.1, "{speed}");
}

#[test]
fn a_tube_that_is_silent_is_none_and_nothing_to_compare_it_with_is_no_doubt() {
    let mut flight = Flight::new();
    flight.knows_its_velocity(false);
    let (measured, _) = flight.goes_on(30.0, Some(15.0));
    assert!(measured, "nothing contradicts it");
    assert_eq!(flight.goes_on(0.6, None), (false, 17.0));
}
