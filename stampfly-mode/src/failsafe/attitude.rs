//! Tumbling, and a tilt that gravity contradicts.

use super::config::FailsafeConfig;
use super::input::FailsafeInput;
use crate::lasting::lasts;
use stampfly_types::messages::{FlightMode, FlightPhase, FlightStatus, ImuData, SensorMask, Validity};
use stampfly_types::{Instant, Vec3, frame, math};

/// A manual mode may push back this many times as hard on the ground before it counts as tipping: a stick moves while a leg sticks.
const BY_HAND: f32 = 2.0;

/// What is remembered of the attitude.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct AttitudeMonitor {
    /// Cosines of the configuration's tilts, and a sine: with them no step takes an arc cosine, 250 instructions.
    cos_armed: f32,
    cos_acro: f32,
    cos_tumble: f32,
    cos_tip: f32,
    sin_lift: f32,
    cos_mismatch: f32,
    /// The body's down axis, world, of the vehicle before it took off: floors slope.
    rest: Vec3,
    /// Specific force for the tilt on the ground.
    gravity: Option<Vec3>,
    /// It turned over on purpose, and has not been level since.
    turned_over: bool,
    tumbled: Option<Instant>,
    mismatch: Option<Instant>,
}

impl AttitudeMonitor {
    /// Nothing seen yet.
    pub(super) fn new(config: &FailsafeConfig) -> Self {
        Self {
            cos_armed: math::cos(config.armed_tilt),
            cos_acro: math::cos(config.acro_tilt),
            cos_tumble: math::cos(config.tumble_tilt),
            cos_tip: math::cos(config.tip_tilt),
            sin_lift: math::sin(config.lift_tilt),
            rest: Vec3::z(),
            cos_mismatch: math::cos(config.tilt_mismatch),
            gravity: None,
            turned_over: false,
            tumbled: None,
            mismatch: None,
        }
    }

    /// Takes a finite inertial sample.
    pub(super) fn add(&mut self, config: &FailsafeConfig, imu: &ImuData) {
        let gravity = self.gravity.get_or_insert(imu.accel);
        *gravity += (imu.accel - *gravity) * config.gravity_weight;
    }

    /// Does it tumble, and does gravity contradict its tilt on the ground? `weak`: one of its motors is.
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        now: Instant,
        input: &FailsafeInput<'_>,
        weak: bool,
    ) -> [bool; 2] {
        let estimate = input.estimate;
        let known = estimate.valid.contains(Validity::TILT);
        let status = input.flight_status;
        let tips = known && self.tips(config, input, weak);
        let level = known && frame::cos_tilt(&estimate.attitude) >= self.cos_tumble;
        let by_acro =
            matches!(status.phase, FlightPhase::Flying | FlightPhase::Landing) && status.mode.commands_rates();
        let turns_over = by_acro || status.phase == FlightPhase::Flip;
        self.turned_over = !level && (self.turned_over || turns_over);
        let limit = match (status.phase, status.mode) {
            (FlightPhase::Armed, _) => Some((self.cos_armed, config.tumble_time)),
            (FlightPhase::TakeOff, _) => Some((self.cos_tip, config.tip_time)),
            (FlightPhase::Flying | FlightPhase::Landing, FlightMode::Acro) => Some((self.cos_acro, config.acro_time)),
            // It is upside down for a third of a second, and has to come back as a pilot's loop has.
            (FlightPhase::Flip, _) => Some((self.cos_acro, config.acro_time)),
            // So has one that a pilot has turned over and left to a mode that levels.
            (FlightPhase::Flying | FlightPhase::Landing, _) => {
                Some((self.cos_tumble, if self.turned_over { config.acro_time } else { config.tumble_time }))
            }
            (FlightPhase::Init | FlightPhase::IdleGround | FlightPhase::IdleHeld, _) => None,
        };
        let over = limit.filter(|(cos_tilt, _)| known && (frame::cos_tilt(&estimate.attitude) < *cos_tilt || tips));
        let time = over.filter(|_| !tips).map_or(config.tip_time, |(_, time)| time);
        let tumbled = lasts(&mut self.tumbled, now, over.is_some(), time);
        let standing = status.phase == FlightPhase::IdleGround && known;
        let apart = standing
            && self.gravity.is_some_and(|force| {
                let up = estimate.attitude.inverse_transform_vector(&-Vec3::z());
                force.dot(&up) < self.cos_mismatch * force.norm().max(1e-3)
            });
        [tumbled, lasts(&mut self.mismatch, now, apart, config.tilt_mismatch_time)]
    }

    /// Does it tip on a leg, because a propeller is weak or something holds it? If its motors stop in time, it falls back.
    fn tips(&mut self, config: &FailsafeConfig, input: &FailsafeInput<'_>, weak: bool) -> bool {
        let (estimate, torque) = (input.estimate, &input.output.torque);
        let FlightStatus { phase, mode, .. } = input.flight_status;
        match phase {
            FlightPhase::Armed => {
                self.rest = estimate.attitude.transform_vector(&Vec3::z());
                false
            }
            // A manual mode flies from the first push of its throttle on, with its legs still on the ground.
            FlightPhase::Flying if !mode.is_manual() => false,
            FlightPhase::TakeOff | FlightPhase::Flying | FlightPhase::Landing => {
                // Only a range knows the height to the length of a leg.
                let measured = estimate.valid.contains(Validity::HEIGHT) && estimate.sensors.contains(SensorMask::TOF);
                let low = measured && estimate.height < config.lift_height;
                // Motors take some time to stop, and what turns already turns on.
                let soon = |world: &Vec3| {
                    let body = estimate.attitude.inverse_transform_vector(world);
                    let lean = body - estimate.angular_rate.cross(&body) * config.lift_lead;
                    (lean, lean.x * lean.x + lean.y * lean.y > self.sin_lift * self.sin_lift)
                };
                // From a slope it turns to level, and stands as the slope does.
                let ((lean, leans), (_, tilts)) = (soon(&self.rest), soon(&Vec3::z()));
                // A pilot may want to tilt, and a program may land in a gust. Then the controller
                // does not push back. Against a weak motor it pushes all the time, and on the
                // ground that is what tips the vehicle. It is about what the controller wants, so
                // what is unmet counts.
                let share = if *phase == FlightPhase::Flying { BY_HAND } else { 1.0 };
                let [roll, pitch] = [config.weak_roll, config.weak_pitch].map(|limit| limit * share);
                let pushes_back = torque.x * lean.y.signum() < -roll || torque.y * lean.x.signum() > pitch;
                let takes_off_by_itself = *phase == FlightPhase::TakeOff && !mode.is_manual();
                low && leans && tilts && (weak || pushes_back || takes_off_by_itself)
            }
            _ => false,
        }
    }
}
