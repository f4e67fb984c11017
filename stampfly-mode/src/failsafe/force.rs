//! Is the specific force what thrust and drag make?
//!
//! | where | what a force may be |
//! |---|---|
//! | on the ground | gravity |
//! | in the air | gravity, of a vehicle that does not accelerate; or what the motors push with, less the drag of its motion |
//!
//! What the motors push with is what duties and battery voltage make, not what was asked for: a
//! tired battery gives less. A force without such a reason is an error of the accelerometer, or of
//! what is known of the vehicle. In the air the vehicle lands with it.
//!
//! Finds a scale that is wrong by a third or more. Not for less: a propeller out of balance moves
//! the accelerometer's zero, and the thrust of a motor is known to some tenths.

use super::config::FailsafeConfig;
use super::input::FailsafeInput;
use crate::lasting::lasting;
use core::ops::Range;
use stampfly_types::math::{larger, smaller, sqrt};
use stampfly_types::messages::{FlightPhase, ImuData, Validity};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// What the force may be on the ground, of gravity, and in the air, whatever the thrust.
const STANDING: Range<f32> = 0.75..1.25;
const FLYING: Range<f32> = 0.85..1.2;
/// How far it may be from what thrust and drag make, of the larger of thrust and weight:
/// coefficient of thrust 12 %, voltage curve of the motors 10 %, mass and voltage 5 % each make
/// 0.18 together, of which this is twice.
const SHARE: f32 = 0.36;
/// And for the vibration's mean square, 1/(m/s²): an accelerometer that is shaken has its zero
/// elsewhere, and four times as far when it is shaken twice as much.
const RECTIFIED: f32 = 0.04;
/// Weight of a sample in the mean square.
const SHAKEN_WEIGHT: f32 = 0.01;
/// Time constant of the means, s. Thrust comes up to 0.11 s after the duty; a step of all of it,
/// 1.7 of the weight, is then off by no more than [`SHARE`].
const TIME: f32 = 0.4;
/// For so long it has no reason before it counts: a gust, a hand, a fall after a crash are over by
/// then.
const LASTS: Duration = Duration::from_secs(1);
/// At less than this speed there is no drag worth the name, m/s.
const SLOW: f32 = 0.1;
/// A step that is longer counts as this long, s.
const LONGEST_STEP: f32 = 0.01;

/// Means of the specific force and of that of the thrust, m/s².
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ForceMonitor {
    means: Option<(Vec3, f32)>,
    /// Mean square of the force about its mean.
    shaken: f32,
    last: Option<Instant>,
    since: Option<Instant>,
}

impl ForceMonitor {
    /// Takes a sample. Has the force had no reason for [`LASTS`]? `known`: the motors push with what
    /// duties and voltage make.
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        at: Instant,
        imu: &ImuData,
        input: &FailsafeInput<'_>,
        known: bool,
    ) -> bool {
        let dt = self.last.replace(at).map_or(0.0, |last| smaller(at.since(last).seconds(), LONGEST_STEP));
        let thrust = input.thrust.filter(|_| config.hover_thrust.is_finite() && known);
        let pushed = thrust.map(|thrust| thrust * (GRAVITY / config.hover_thrust));
        let (force, thrust) = self.means.get_or_insert((imu.accel, pushed.unwrap_or_default()));
        let (off, share) = (imu.accel - *force, dt / (TIME + dt));
        self.shaken += (off.norm_squared() - self.shaken) * SHAKEN_WEIGHT;
        *force += off * share;
        *thrust += (pushed.unwrap_or_default() - *thrust) * share;
        let (force, thrust) = (*force, *thrust);
        let outside = |range: &Range<f32>| {
            let square = force.norm_squared() / (GRAVITY * GRAVITY);
            square < range.start * range.start || square > range.end * range.end
        };
        let unexplained = match input.flight_status.phase {
            FlightPhase::IdleGround => outside(&STANDING),
            FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing | FlightPhase::Flip => {
                let known = pushed.is_some() && input.estimate.valid.contains(Validity::VELOCITY_Z);
                let limit = SHARE * larger(thrust, GRAVITY) + RECTIFIED * self.shaken;
                known && outside(&FLYING) && Self::unexplained(config, input, force, thrust) > limit * limit
            }
            FlightPhase::Init | FlightPhase::IdleHeld | FlightPhase::Armed => false,
        };
        lasting(&mut self.since, at, unexplained) >= LASTS
    }

    /// Square of what is left of the force without thrust and drag, (m/s²)². Any drag up to the
    /// largest is a reason, since nothing measures the wind.
    fn unexplained(config: &FailsafeConfig, input: &FailsafeInput<'_>, force: Vec3, thrust: f32) -> f32 {
        let left = force + Vec3::new(0.0, 0.0, thrust);
        let velocity = input.estimate.attitude.inverse_transform_vector(&input.estimate.velocity);
        let speed = sqrt(velocity.norm_squared());
        if speed < SLOW {
            return left.norm_squared();
        }
        let most = (config.drag + config.drag_square * speed) * speed;
        let against = velocity * (-1.0 / speed);
        let drag = smaller(larger(left.dot(&against), 0.0), most);
        (left - against * drag).norm_squared()
    }
}
