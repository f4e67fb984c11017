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
use crate::lasting::lasts;
use core::ops::Range;
use stampfly_types::messages::{FlightPhase, ImuData};
use stampfly_types::{GRAVITY, Instant, Vec3, math};

/// What the force may be on the ground, of gravity.
const STANDING: Range<f32> = 0.75..1.25;
/// What it may be in the air, whatever the thrust.
const FLYING: Range<f32> = 0.85..1.2;
/// How far it may be from what the thrust makes, of the larger of that and gravity, and of the vibration's root mean square,
/// which moves an accelerometer's zero.
const CARRIED: f32 = 0.42;
const RECTIFIED: f32 = 0.25;
/// What it may be where that is all that is known: where it shakes by more than a mean square, (m/s²)², of three times the
/// recorded vibration, which moves an accelerometer's zero by a third of it, or where the hover thrust is unknown.
const SHAKEN: f32 = 120.0;
const WIDE: Range<f32> = 0.2..2.5;
/// Weight of a sample in the mean square.
const SHAKEN_WEIGHT: f32 = 0.01;

/// Means of the specific force, m/s², and of the thrust, N.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ForceMonitor {
    mean: Option<(Vec3, f32)>,
    /// Mean square of the force about its mean.
    shaken: f32,
    off: Option<Instant>,
}

impl ForceMonitor {
    /// Takes a sample. Has the force been implausible for `force_time`?
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        at: Instant,
        imu: &ImuData,
        input: &FailsafeInput<'_>,
    ) -> bool {
        let (force, thrust) = self.mean.get_or_insert((imu.accel, input.output.thrust));
        let off = imu.accel - *force;
        self.shaken += (off.norm_squared() - self.shaken) * SHAKEN_WEIGHT;
        *force += off * config.force_weight;
        *thrust += (input.output.thrust - *thrust) * config.force_weight;
        let square = force.norm_squared() * (1.0 / (GRAVITY * GRAVITY));
        let within = |range: &Range<f32>| square > range.start * range.start && square < range.end * range.end;
        let off = match input.flight_status.phase {
            FlightPhase::IdleGround => !within(&STANDING),
            FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing | FlightPhase::Flip => {
                let known = config.hover_thrust.is_finite();
                let range = if known && self.shaken < SHAKEN { &FLYING } else { &WIDE };
                let explained = || {
                    if !known {
                        // It may be falling with its motors at rest.
                        return input.flight_status.mode.is_manual();
                    }
                    let carried = *thrust * (GRAVITY / config.hover_thrust);
                    let range = CARRIED * carried.max(GRAVITY) + RECTIFIED * math::sqrt(self.shaken);
                    (force.norm() - carried).abs() < range
                };
                !within(range) && !explained()
            }
            FlightPhase::Init | FlightPhase::IdleHeld | FlightPhase::Armed => false,
        };
        lasts(&mut self.off, at, off, config.force_time)
    }
}
