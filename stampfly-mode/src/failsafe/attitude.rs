//! Tumbling, and a tilt that gravity contradicts.

use super::config::FailsafeConfig;
use super::input::FailsafeInput;
use crate::lasting::lasts;
use stampfly_types::messages::{FlightMode, FlightPhase, ImuData, Validity};
use stampfly_types::{Instant, Vec3, frame, math};

/// What is remembered of the attitude.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct AttitudeMonitor {
    /// Specific force for the tilt on the ground.
    gravity: Option<Vec3>,
    tumbled: Option<Instant>,
    mismatch: Option<Instant>,
}

impl AttitudeMonitor {
    /// Takes a finite inertial sample.
    pub(super) fn add(&mut self, config: &FailsafeConfig, imu: &ImuData) {
        let gravity = self.gravity.get_or_insert(imu.accel);
        *gravity += (imu.accel - *gravity) * config.gravity_weight;
    }

    /// Does it tumble, and does gravity contradict its tilt on the ground?
    pub(super) fn step(&mut self, config: &FailsafeConfig, now: Instant, input: &FailsafeInput<'_>) -> [bool; 2] {
        let known = input.estimate.valid.contains(Validity::TILT);
        let status = input.flight_status;
        let limit = match (status.phase, status.mode) {
            (FlightPhase::Armed, _) => Some((config.armed_tilt, config.tumble_time)),
            (FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing, FlightMode::Acro) => {
                Some((config.acro_tilt, config.acro_time))
            }
            (FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing, _) => {
                Some((config.tumble_tilt, config.tumble_time))
            }
            (FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld, _) => None,
        };
        let over = limit.filter(|(tilt, _)| known && frame::tilt(&input.estimate.attitude) > *tilt);
        let time = over.map_or(config.tumble_time, |(_, time)| time);
        let tumbled = lasts(&mut self.tumbled, now, over.is_some(), time);
        let standing = status.phase == FlightPhase::IdleGround && known;
        let apart = standing
            && self.gravity.is_some_and(|force| {
                let up = input.estimate.attitude.inverse_transform_vector(&-Vec3::z());
                math::acos(force.dot(&up) / force.norm().max(1e-3)) > config.tilt_mismatch
            });
        [tumbled, lasts(&mut self.mismatch, now, apart, config.tilt_mismatch_time)]
    }
}
