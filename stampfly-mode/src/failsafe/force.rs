//! Does the mean specific force fit what holds the vehicle?
//!
//! On the ground that is the ground: gravity. In the air it is the thrust, and a vehicle that hovers feels gravity again. So
//! a force is implausible when it is far from both: a pilot's loop and a fall without thrust are far from gravity only, and a
//! vehicle that pushes against a ceiling from its thrust only.
//!
//! Finds an inertial sensor whose scale is wrong by a third, and thrust that is asked for and does not come. Not for less: a
//! propeller out of balance moves the accelerometer's zero, an empty battery and the floor change the thrust.

use super::config::FailsafeConfig;
use super::input::FailsafeInput;
use core::ops::Range;
use stampfly_types::math::{larger, smaller};
use stampfly_types::messages::{FlightPhase, ImuData};
use stampfly_types::{GRAVITY, Instant, Vec3};

/// What the force may be on the ground, of gravity.
const STANDING: Range<f32> = 0.75..1.25;
/// What it may be in the air, whatever the thrust.
const FLYING: Range<f32> = 0.85..1.2;
/// How far it may be from what the thrust makes, of the larger of that and gravity, and for the vibration's mean square, 1/(m/s²):
/// an accelerometer that is shaken has its zero elsewhere, and four times as far when it is shaken twice as much.
const CARRIED: f32 = 0.36;
const RECTIFIED: f32 = 0.04;
/// What it may be where that is all that is known: where it shakes by more than a mean square, (m/s²)², of three times the
/// recorded vibration, which moves an accelerometer's zero by a third of it, or where the hover thrust is unknown.
const SHAKEN: f32 = 120.0;
const WIDE: Range<f32> = 0.2..2.5;
/// Weight of a sample in the mean square.
const SHAKEN_WEIGHT: f32 = 0.01;

/// A step that is longer counts as this long, s.
const LONGEST_STEP: f32 = 0.01;
/// However large it is, it lasts this long, s: a hand that takes hold of the vehicle jerks it for 30 ms.
const LEAST_TIME: f32 = 0.1;
/// On the ground, so many times as much is a fault: it may be put down hard, or taken up.
const HANDLED: f32 = 4.0;

/// Means of the specific force, m/s², and of the thrust, N.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ForceMonitor {
    mean: Option<(Vec3, f32)>,
    /// Mean square of the force about its mean.
    shaken: f32,
    last: Option<Instant>,
    /// Speed that the unexplained part of the force has made, m/s: a cumulative sum, which no single sample resets.
    unexplained: f32,
}

impl ForceMonitor {
    /// Takes a sample. Has the unexplained part of the force made a speed of `force_speed`? With a weak motor the thrust is not
    /// what is asked for.
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        at: Instant,
        imu: &ImuData,
        input: &FailsafeInput<'_>,
        weak: bool,
    ) -> bool {
        let dt = self.last.replace(at).map_or(0.0, |last| smaller(at.since(last).seconds(), LONGEST_STEP));
        let (force, thrust) = self.mean.get_or_insert((imu.accel, input.output.thrust));
        let off = imu.accel - *force;
        self.shaken += (off.norm_squared() - self.shaken) * SHAKEN_WEIGHT;
        *force += off * config.force_weight;
        *thrust += (input.output.thrust - *thrust) * config.force_weight;
        let (size, thrust) = (force.norm(), *thrust);
        let beyond = |range: &Range<f32>| larger(range.start * GRAVITY - size, size - range.end * GRAVITY);
        let (excess, limit) = match input.flight_status.phase {
            FlightPhase::IdleGround => (beyond(&STANDING), HANDLED * config.force_speed),
            FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing | FlightPhase::Flip => {
                let known = config.hover_thrust.is_finite() && !weak;
                let range = if known && self.shaken < SHAKEN { &FLYING } else { &WIDE };
                let unlike_thrust = if known {
                    let carried = thrust * (GRAVITY / config.hover_thrust);
                    let range = CARRIED * larger(carried, GRAVITY) + RECTIFIED * self.shaken;
                    (size - carried).abs() - range
                } else if input.flight_status.mode.is_manual() && input.flight_status.phase != FlightPhase::Landing {
                    // It may be falling with its motors at rest. What lands by itself has none at rest.
                    -GRAVITY
                } else {
                    GRAVITY
                };
                (smaller(beyond(range), unlike_thrust), config.force_speed)
            }
            FlightPhase::Init | FlightPhase::IdleHeld | FlightPhase::Armed => (-GRAVITY, config.force_speed),
        };
        self.unexplained = larger(self.unexplained + smaller(excess, limit / LEAST_TIME) * dt, 0.0);
        self.unexplained > limit
    }
}
