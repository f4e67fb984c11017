//! Body rate to torque by increments: incremental nonlinear dynamic inversion (INDI) as the innermost loop of the cascade.
//!
//! What turns a vehicle is the torque of its rotors and everything else: gusts, a weak motor, a battery that lies askew, the
//! gyroscopic torque. A model of everything else is not needed, because the gyro shows the sum. So the loop asks for the torque that
//! the rotors delivered a moment ago, plus what the angular acceleration is short of the demanded one:
//!
//! ```text
//! torque = τ_f + J · (α_demanded − α_f)         α_demanded = ω_c · (rate_target − rate) − λ · α
//! ```
//!
//! τ_f and α_f have passed the same low-pass, or the two would differ by their delays and the loop would take its own torque
//! for a disturbance: S. Sieberling, Q. P. Chu and J. A. Mulder, *Robust flight control using incremental nonlinear dynamic inversion
//! and angular acceleration prediction*, Journal of Guidance, Control, and Dynamics 33 (2010), and E. J. J. Smeur, Q. P. Chu and
//! G. C. H. E. de Croon, *Adaptive incremental nonlinear dynamic inversion for attitude control of micro air vehicles*, the same
//! 39 (2016). The delivered torque is the commanded one, less what the mixer gave up, after the motors' lag. The last term
//! makes the motors 1 + λ times as quick, as in R. Steffensen, A. Steinert and E. J. J. Smeur, *Nonlinear dynamic inversion with
//! actuator dynamics: an incremental control perspective*, the same 46 (2023).
//!
//! τ_f − J·α_f is an estimate of what else turns the vehicle, negated, and is kept as such: one filter for both sides, which cannot
//! differ, and one number per axis to bound. There is no integral: what is remembered of a vehicle that something holds is that estimate,
//! at most [`IndiConfig::disturbance_max`], and it is gone a few [`IndiConfig::smoothing`] after it is let go.
//!
//! Choose it where disturbances are strong and quick: it finds a constant torque seven times as fast as the integral of
//! [`RateController`](crate::rate::RateController). The price is margin: with the same bandwidth it has 54° of phase where that has 71°,
//! so it is less forgiving of motors that are much slower than the airframe says, or of a long delay.

use stampfly_types::Vec3;

use crate::airframe::Airframe;
use crate::bound::symmetric;
use crate::cascade::{CascadeConfig, CascadeController};
use crate::rate::{RateConfig, RateLaw, TILT_BANDWIDTH, TILT_LEAD, YAW_BANDWIDTH};

/// Corner of the increment's filter over the bandwidth. The estimate of the disturbance has to be slower than the loop it corrects: at
/// 0.45 the roll and pitch loops keep 54° of phase and 11 dB of gain with 4.5 ms of delay, and 36° with motors twice as slow.
pub const INCREMENT_SHARE: f32 = 0.45;
/// Time constant of the filter on the acceleration that damps, over the lead: that of the derivative in [`RateConfig`].
const DAMPING_SHARE: f32 = 0.2;

/// Gains and limits of the incremental loops: roll, pitch, yaw.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IndiConfig {
    /// Principal moments of inertia, kg·m². A third too large or too small is a third more or less gain, no more.
    pub inertia: Vec3,
    /// Time constant with which the rotors' torque follows its command, s.
    pub motor_lag: f32,
    /// Angular acceleration per rate error, ω_c, 1/s.
    pub bandwidth: Vec3,
    /// Share of the measured angular acceleration that is taken off the demanded one, λ: makes the motors 1 + λ times as quick.
    pub damping: Vec3,
    /// Time constant of the filter on that acceleration, s.
    pub damping_time: f32,
    /// Time constant of the filter on both sides of the increment, s.
    pub smoothing: Vec3,
    /// Largest torque per axis, N·m.
    pub torque_max: Vec3,
    /// Largest torque that something else may be taken to have, N·m: what a propeller that is a third too weak leaves, and no more.
    pub disturbance_max: Vec3,
}

impl IndiConfig {
    /// The rule for an airframe. Bandwidth and lead are those of [`RateConfig::for_airframe`], so that the two loops answer a set-point
    /// alike: λ is bandwidth times lead. The increment's corner is [`INCREMENT_SHARE`] of the bandwidth. Yaw has no damping: a
    /// rotor's own inertia acts as a lead there, of three motor lags on a vehicle of a palm's size.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        let (tilt, yaw) = (airframe.quickness() * TILT_BANDWIDTH, airframe.quickness() * YAW_BANDWIDTH);
        let bandwidth = Vec3::new(tilt, tilt, yaw);
        let lead = TILT_LEAD * airframe.motor_lag;
        let rate = RateConfig::for_airframe(airframe);
        Self {
            inertia: airframe.inertia,
            motor_lag: airframe.motor_lag,
            bandwidth,
            damping: Vec3::new(tilt * lead, tilt * lead, 0.0),
            damping_time: DAMPING_SHARE * lead,
            smoothing: bandwidth.map(|bandwidth| 1.0 / (INCREMENT_SHARE * bandwidth)),
            torque_max: rate.torque_max,
            disturbance_max: rate.integral_max,
        }
    }
}

/// The incremental body-rate loops.
///
/// ```
/// use stampfly_control::Airframe;
/// use stampfly_control::indi::{IndiConfig, IndiRate};
/// use stampfly_control::rate::RateLaw;
/// use stampfly_types::Vec3;
/// let config = IndiConfig::for_airframe(&Airframe::EXAMPLE);
/// let mut indi = IndiRate::new(&config);
/// // It is to stand still, and something turns it to the right with half a newton metre per kg·m².
/// let mut rate = Vec3::zeros();
/// let mut torque = Vec3::zeros();
/// for _ in 0..200 {
///     torque = indi.step(&Vec3::zeros(), &rate, 0.0025, [0.0; 4], [false; 3]);
///     rate.x += (torque.x / config.inertia.x + 0.5) * 0.0025;
/// }
/// assert!((torque.x / config.inertia.x + 0.5).abs() < 0.02, "it holds against it");
/// assert!(rate.x.abs() < 1e-3, "and stands still, without an integral");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IndiRate {
    config: IndiConfig,
    /// Rate one step ago.
    rate: Option<Vec3>,
    /// Angular acceleration, filtered for the damping.
    acceleration: Vec3,
    /// Torque of the rotors when the newest rate was measured.
    delivered: Vec3,
    /// Commands one and two steps ago, less what the mixer gave up of them. The last one reaches the motors after the newest rate
    /// was measured, so it has turned nothing yet.
    commanded: [Vec3; 2],
    /// τ_f − J·α_f.
    against: Vec3,
}

impl IndiRate {
    /// Loops at rest.
    #[must_use]
    pub fn new(config: &IndiConfig) -> Self {
        let zero = Vec3::zeros();
        Self { config: *config, rate: None, acceleration: zero, delivered: zero, commanded: [zero; 2], against: zero }
    }

    /// Changes bandwidth and smoothing in flight. What was estimated of everything else, and what was measured, stays.
    pub fn set_gains(&mut self, config: &IndiConfig) {
        (self.config.bandwidth, self.config.smoothing) = (config.bandwidth, config.smoothing);
    }

    /// The torque that is held against what else turns the vehicle, N·m.
    #[must_use]
    pub fn against(&self) -> Vec3 {
        self.against
    }
}

impl RateLaw for IndiRate {
    #[inline]
    fn step(&mut self, target: &Vec3, measured: &Vec3, dt: f32, unmet: [f32; 4], held: [bool; 3]) -> Vec3 {
        let config = &self.config;
        let [roll, pitch, yaw, _] = unmet;
        let [last, before] = self.commanded;
        let last = last.zip_map(&Vec3::new(roll, pitch, yaw), |torque, unmet| torque * (1.0 - share(unmet)));
        self.delivered += (before - self.delivered) * weight(dt, config.motor_lag);

        let acceleration = (measured - self.rate.unwrap_or(*measured)) / dt;
        self.rate = Some(*measured);
        let filtered = self.acceleration + (acceleration - self.acceleration) * weight(dt, config.damping_time);
        self.acceleration = filtered.map(|value| if value.is_finite() { value } else { 0.0 });

        // What holds it, as the ground does, will be gone in the air.
        let free = Vec3::from(held.map(|held| if held { 0.0 } else { 1.0 }));
        let against = self.delivered - config.inertia.component_mul(&acceleration);
        let change = (against - self.against).zip_map(&config.smoothing, |off, time| off * weight(dt, time));
        self.against = (self.against + change.component_mul(&free)).zip_map(&config.disturbance_max, finite_within);
        let demanded = (target - measured).component_mul(&config.bandwidth);
        let damped = demanded - self.acceleration.component_mul(&config.damping);
        let torque = self.against + config.inertia.component_mul(&damped);
        let torque = torque.zip_map(&config.torque_max, finite_within);
        self.commanded = [torque, last];
        torque
    }

    fn reset(&mut self) {
        *self = Self::new(&self.config);
    }
}

/// Weight of the newest sample in a low-pass with this time constant.
fn weight(dt: f32, time: f32) -> f32 {
    dt / (time + dt)
}

/// A share that was given up, from zero to one. No number is none.
fn share(unmet: f32) -> f32 {
    if unmet > 0.0 { unmet.min(1.0) } else { 0.0 }
}

/// The value within ±`limit`; no number is zero.
fn finite_within(value: f32, limit: f32) -> f32 {
    if value.is_finite() { symmetric(value, limit) } else { 0.0 }
}

/// The cascade around [`IndiRate`].
///
/// ```
/// use stampfly_control::indi::IndiRate;
/// use stampfly_control::{Airframe, CascadeConfig, Controller, IndiConfig, IndiController};
/// let airframe = &Airframe::EXAMPLE;
/// let rate = IndiRate::new(&IndiConfig::for_airframe(airframe));
/// let mut controller = IndiController::with_rate_law(&CascadeConfig::for_airframe(airframe), rate);
/// controller.reset();
/// ```
pub type IndiController = CascadeController<IndiRate>;

impl IndiController {
    /// Changes all gains in flight, as [`CascadeController::set_gains`] does.
    pub fn set_gains(&mut self, config: &CascadeConfig, rate: &IndiConfig) {
        self.set_outer_gains(config);
        self.rate_law_mut().set_gains(rate);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f32 = 0.0025;
    const MET: [f32; 4] = [0.0; 4];

    fn config() -> IndiConfig {
        IndiConfig::for_airframe(&Airframe::EXAMPLE)
    }

    /// The plant that the loop believes in: lagging rotors and the last command a period late.
    fn settles(indi: &mut IndiRate, disturbance: f32, unmet: [f32; 4], kept: f32) -> (f32, f32) {
        let config = config();
        let (mut rate, mut torque, mut late) = (Vec3::zeros(), 0.0f32, 0.0f32);
        let mut asked = 0.0;
        for _ in 0..800 {
            torque += (late * kept - torque) * weight(DT, config.motor_lag);
            late = asked;
            rate.x += (torque + disturbance) / config.inertia.x * DT;
            asked = indi.step(&Vec3::zeros(), &rate, DT, unmet, [false; 3]).x;
        }
        (rate.x, asked)
    }

    #[test]
    fn it_finds_what_else_turns_the_vehicle() {
        let disturbance = 0.5 * config().disturbance_max.x;
        let mut indi = IndiRate::new(&config());
        let (rate, asked) = settles(&mut indi, disturbance, MET, 1.0);
        assert!(rate.abs() < 1e-3 && (asked / disturbance + 1.0).abs() < 1e-2, "{rate} {asked}");
        assert!((indi.against().x / disturbance + 1.0).abs() < 1e-2);
    }

    #[test]
    fn what_the_mixer_gave_up_is_not_taken_for_a_disturbance() {
        // Half of every command is given up, and said to be: then nothing else turns the vehicle.
        let half = [0.5; 4];
        let mut told = IndiRate::new(&config());
        let mut silent = told.clone();
        let (target, mut rate) = (Vec3::new(1.0, 0.0, 0.0), Vec3::zeros());
        let (mut torque, mut late, mut asked) = (0.0f32, 0.0f32, 0.0f32);
        for _ in 0..20 {
            torque += (0.5 * late - torque) * weight(DT, config().motor_lag);
            late = asked;
            rate.x += torque / config().inertia.x * DT;
            asked = told.step(&target, &rate, DT, half, [false; 3]).x;
            silent.step(&target, &rate, DT, MET, [false; 3]);
        }
        let (told, silent) = (told.against().x, silent.against().x);
        assert!(told.abs() < 0.1 * silent, "{told} against {silent} of one that was not told");
    }

    #[test]
    fn a_vehicle_that_is_held_winds_up_to_the_bound_and_forgets_at_once() {
        let config = config();
        let mut indi = IndiRate::new(&config);
        for _ in 0..24_000 {
            indi.step(&Vec3::new(1.0, -1.0, 1.0), &Vec3::zeros(), DT, MET, [false; 3]);
        }
        for (against, bound) in indi.against().iter().zip(&config.disturbance_max) {
            assert!(against.abs() <= *bound);
        }
        // Let go, it turns as its rotors turn it.
        let (rate, _) = settles(&mut indi, 0.0, MET, 1.0);
        assert!(rate.abs() < 1e-3 && indi.against().x.abs() < 1e-2 * config.disturbance_max.x, "{rate} {indi:?}");
    }

    #[test]
    fn the_ground_teaches_it_nothing() {
        let mut indi = IndiRate::new(&config());
        for _ in 0..4_000 {
            indi.step(&Vec3::new(0.3, -0.3, 0.1), &Vec3::zeros(), DT, MET, [true; 3]);
        }
        assert_eq!(indi.against(), Vec3::zeros());
    }

    #[test]
    fn broken_numbers_leave_no_trace() {
        let config = config();
        for broken in [f32::NAN, f32::INFINITY, f32::MAX] {
            let mut indi = IndiRate::new(&config);
            let none = Vec3::zeros();
            for (target, measured, unmet) in
                [(broken, 0.0, 0.0), (0.0, if broken.is_finite() { broken } else { 0.0 }, 0.0), (0.0, 0.0, broken)]
            {
                let torque = indi.step(&Vec3::repeat(target), &Vec3::repeat(measured), DT, [unmet; 4], [false; 3]);
                assert!(torque.iter().zip(&config.torque_max).all(|(torque, max)| torque.abs() <= *max), "{torque}");
            }
            for _ in 0..400 {
                indi.step(&none, &none, DT, MET, [false; 3]);
            }
            assert!(indi.step(&none, &none, DT, MET, [false; 3]).norm() < 1e-6, "{broken}: {indi:?}");
            indi.reset();
            assert_eq!(indi, IndiRate::new(&config));
        }
    }
}
