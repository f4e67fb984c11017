//! An estimator over recorded data: what it says, and how good that is.
//!
//! | recording | what is fused | what it is compared with |
//! |---|---|---|
//! | StampFly log | inertial, range, flow, barometer | dead reckoning from the flow |
//! | StampFly flight capture | inertial, range | – |
//! | NanoBench | inertial, velocity from motion capture | motion capture, above 0.3 m after three seconds |
//! | BROAD | inertial, magnetic field: the attitude filter | motion capture, while moving |
//! | PX4 replay | inertial, satellite receiver, magnetic field, barometer | the receiver, the magnetometer, EKF2's own states |
//!
//! The same filter with the same code as in flight; where nothing measures a position, the attitude filter. Its tuning differs between sensor suites (see [`suite`]), never
//! between files of one. It is never told that the vehicle stands: that would be half the answer.
//!
//! Not for replaying a flight of this stack bit by bit: that is `stampfly_flight::replay`.

mod accuracy;
mod dead_reckoning;
mod drive;
mod figures;
mod receiver;
mod start;

pub use accuracy::Accuracy;
pub use dead_reckoning::{Reach, path, reach};
pub use drive::{Drive, Instance, Tally, drive};
pub use figures::Figures;
pub use receiver::AgainstReceiver;
pub use start::Start;

use crate::dataset::{Kind, Recording};
use stampfly_board::VehicleConfig;
use stampfly_eskf::attitude::AttitudeConfig;
use stampfly_eskf::{EskfConfig, StartHeading};
use stampfly_host::Flight;
use stampfly_types::{Duration, Vec3};

/// Which estimator runs over a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The one that flies, [`VehicleConfig::estimator`].
    #[default]
    Vehicle,
    /// The attitude filter. No vehicle can be told to use it: it holds no position.
    Attitude,
}

/// An estimator and its tuning.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Suite {
    /// Which estimator.
    pub method: Method,
    /// Tuning of the estimators that fly.
    pub vehicle: VehicleConfig,
    /// That of the attitude filter.
    pub attitude: AttitudeConfig,
    /// How good the recording's satellite receiver is, where it has one.
    pub receiver: Receiver,
}

/// What is known of a receiver. The default is what EKF2 takes for one that says nothing about itself: 110 ms late
/// (`EKF2_GPS_DELAY`), and the accuracies of the fixes of PX4's sensor simulator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// How long before it arrived a fix was valid.
    pub delay: Duration,
    /// Standard deviation of a position along each axis, NED, m.
    pub position_sigma: Vec3,
    /// Standard deviation of a velocity along each axis, NED, m/s.
    pub velocity_sigma: Vec3,
}

impl Default for Receiver {
    fn default() -> Self {
        Self {
            delay: Duration::from_millis(110),
            position_sigma: Vec3::new(0.5, 0.5, 0.8),
            velocity_sigma: Vec3::new(0.2, 0.2, 0.2),
        }
    }
}

/// An estimate over one recording, with its figures.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// Where it started.
    pub start: Start,
    /// What the estimator said, and what became of the samples.
    pub drive: Drive,
    /// How good it is.
    pub figures: Figures,
}

/// The tuning for recordings of this kind: the vehicle's, but for what its sensors do differently.
#[must_use]
pub fn suite(kind: Kind) -> Suite {
    let mut suite = Suite { attitude: attitude_suite(kind), ..Suite::default() };
    let config = &mut suite.vehicle;
    match kind {
        Kind::Broad => {
            suite.method = Method::Attitude;
            // For the Kalman filter, when it is asked for. Far from any motor, in a hand that throws it about: the field may be used, gravity only slowly, and what
            // looks like a bias of the accelerometer is motion.
            config.eskf.mag_enable = true;
            config.eskf.mag_sigma = 1.0;
            config.eskf.gravity_sigma = 10.0;
            config.eskf.gyro_noise = 0.01;
            config.eskf.initial_accel_bias = 0.02;
            config.eskf.accel_bias_walk = 0.0;
        }
        // The radio log took single samples of a vibrating gyro, stamped up to 30 ms off: they disagree with the rate
        // that the cameras saw by 0.2 to 0.4 rad/s, for some samples on end. The cameras' velocity shows the tilt better.
        Kind::NanoBench => {
            config.eskf.gyro_noise = 0.12;
            config.eskf.accel_noise = 0.15;
        }
        // Carried by hand with the motors off: the noise is the data sheet's and what their vibration adds. A hand
        // tilts the beam, so ranges are worth less; a count at 3 cm is rough, so is flow; the still-calibration is good.
        // The logger put a flow reading beside an inertial sample that was 14 ms younger: there rotation and flow fit.
        Kind::StampFlyLog => {
            config.eskf.accel_noise = 0.0016;
            config.eskf.gyro_noise = 0.003;
            config.eskf.accel_vibration = 1.0;
            config.eskf.gyro_vibration = 0.1;
            config.eskf.initial_gyro_bias = 0.0015;
            config.eskf.initial_accel_bias = 0.02;
            config.eskf.tof_sigma = 0.025;
            config.eskf.flow_sigma = 0.4;
            config.eskf.flow_scale_sigma = 0.4;
            config.eskf.flow_delay = 0.0137;
            config.eskf.unobserved_velocity = 0.06;
            config.eskf.gate = 6.7;
        }
        // Under the open sky, with a magnetometer that tells the heading at the start. Nothing else is known of these vehicles.
        Kind::Px4Replay => {
            config.eskf =
                EskfConfig { mag_enable: true, start_heading: StartHeading::Magnetic, ..EskfConfig::outdoors() };
        }
        Kind::StampFlyFlight => {}
    }
    suite
}

/// The attitude filter's tuning for recordings of this kind: its own defaults, but for how late the sensors are.
#[must_use]
fn attitude_suite(kind: Kind) -> AttitudeConfig {
    match kind {
        // Against the cameras' clock, the same within a millisecond in every trial: the gyro's rotation is complete 2.3 ms
        // after the cameras', and the field fits the earth's best when it is taken for 15 ms old.
        Kind::Broad => AttitudeConfig {
            inertial_delay: 0.0023,
            mag_delay: 0.015,
            mag_delay_sigma: 0.0,
            ..AttitudeConfig::default()
        },
        _ => AttitudeConfig::default(),
    }
}

/// Runs the estimator over a recording.
///
/// ```
/// use stampfly_lab::{dataset, estimate};
///
/// let mut text = "timestamp_ms,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n".to_owned();
/// for row in 0..200 {
///     text += &format!("{},0,0,0.00{},0,0,-9.81\n", row * 10, row % 2);
/// }
/// let recording = dataset::parse("still", text.as_bytes())?;
/// let estimated = estimate::run(&recording, &estimate::suite(recording.kind));
/// assert!(!estimated.figures.diverged && estimated.figures.tilt_rmse_deg.is_none());
/// # Ok::<(), dataset::DatasetErrorKind>(())
/// ```
#[must_use]
pub fn run(recording: &Recording, suite: &Suite) -> Estimated {
    let start = Start::of(recording);
    let drive = drive(recording, &start, suite);
    let figures = Figures::of(recording, &start, &drive, &suite.receiver);
    Estimated { start, drive, figures }
}

impl Estimated {
    /// The recording as a flight, with `estimate_state` and `estimate_status` beside its own topics.
    #[must_use]
    pub fn to_flight(&self, recording: &Recording) -> Flight {
        let mut flight = recording.to_flight();
        let origin = origin(recording, &self.start);
        for Instance { at, mut state, status } in self.drive.instances.iter().copied() {
            state.position += origin;
            flight.push("estimate_state", at, &state);
            flight.push("estimate_status", at, &status);
        }
        flight
    }
}

/// Where the estimator's origin lies in the recording's world.
fn origin(recording: &Recording, start: &Start) -> Vec3 {
    let seen = recording.truth.iter().filter(|point| point.at >= start.at).find_map(|point| point.position);
    seen.unwrap_or_default()
}
