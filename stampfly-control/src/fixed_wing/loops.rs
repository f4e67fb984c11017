//! Bank and pitch to the demand of the surfaces: attitude to rate, rate to deflection, scaled by the airspeed.
//!
//! A surface's moment grows with the square of the airspeed and so does the damping with its first power, so what holds a rate takes V₀/V of the deflection, and what changes one (V₀/V)² (Beard and McLain, chapter 6, where the gains follow from the
//! aircraft's derivatives). In a turn the nose must come round and be raised at the rates of a coordinated turn, which are fed forward; the rudder damps what is left of the yaw rate and takes away the side force.
//! On the ground and before a touchdown the rudder holds a heading instead.

use crate::bound::{symmetric, within};
use crate::surfaces::SurfaceDemand;
use stampfly_types::math::{self, wrap_angle};
use stampfly_types::{GRAVITY, Vec3};

/// Gains and limits of [`WingLoops`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WingConfig {
    /// Airspeed for which the gains are, m/s.
    pub airspeed: f32,
    /// Roll rate for an error of the bank, 1/s.
    pub roll_gain: f32,
    /// Pitch rate for an error of the pitch, 1/s.
    pub pitch_gain: f32,
    /// Largest roll and pitch rates, rad/s.
    pub rate_max: [f32; 2],
    /// Deflection that holds a rate of roll, of pitch and of yaw, s/rad.
    pub feed: [f32; 3],
    /// Deflection for an error of the rate, s/rad.
    pub gain: [f32; 3],
    /// The same for one that lasts a second, 1/rad.
    pub integral: [f32; 3],
    /// Rudder for a side force that lasts a second, per m/s².
    pub side_force: f32,
    /// Yaw rate for an error of a heading that is to be held, 1/s.
    pub heading_gain: f32,
}

/// How it flies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wing {
    /// Bank, pitch and heading, rad.
    pub attitude: [f32; 3],
    /// Body FRD, rad/s.
    pub rate: Vec3,
    /// Specific force to the right, m/s².
    pub side_force: f32,
    /// Indicated airspeed, m/s.
    pub airspeed: f32,
}

/// How it should.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WingDemand {
    /// rad.
    pub bank: f32,
    /// rad.
    pub pitch: f32,
    /// A heading for the rudder to hold, rad; `None` to fly coordinated turns.
    pub heading: Option<f32>,
    /// Do wheels carry it? Then no integral learns what they hold.
    pub on_ground: bool,
}

/// The loops.
///
/// ```
/// use stampfly_control::fixed_wing::{Wing, WingConfig, WingDemand, WingLoops};
/// use stampfly_types::Vec3;
/// let (config, mut loops) = (WingConfig::default(), WingLoops::default());
/// let level = Wing { attitude: [0.0; 3], rate: Vec3::zeros(), side_force: 0.0, airspeed: 15.0 };
/// let right = loops.step(0.0025, &level, &WingDemand { bank: 0.3, ..Default::default() }, &config);
/// assert!(right.roll > 0.1 && right.pitch.abs() < 0.01);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WingLoops {
    integral: [f32; 3],
}

impl Default for WingConfig {
    /// Of a model aircraft of one or two kilograms at 15 m/s.
    fn default() -> Self {
        Self {
            airspeed: 15.0,
            roll_gain: 4.0,
            pitch_gain: 3.0,
            rate_max: [1.5, 0.8],
            feed: [0.12, 0.0, 0.0],
            gain: [0.12, 0.3, 0.15],
            integral: [0.15, 0.5, 0.0],
            side_force: 0.05,
            heading_gain: 1.5,
        }
    }
}

/// Airspeeds over the gains' own between which deflections are scaled.
const SCALE: [f32; 2] = [0.55, 2.0];
/// Integrals hold no more than this share of a deflection.
const INTEGRAL: f32 = 0.4;

impl WingLoops {
    /// One step of `dt` seconds. Numbers that are none move no surface.
    pub fn step(&mut self, dt: f32, wing: &Wing, demand: &WingDemand, config: &WingConfig) -> SurfaceDemand {
        let c = config;
        let [bank, pitch, heading] = wing.attitude;
        let ratio = c.airspeed / within(wing.airspeed, SCALE[0] * c.airspeed, SCALE[1] * c.airspeed);
        let speed = wing.airspeed.max(SCALE[0] * c.airspeed);
        // Of a turn at this bank, about the vertical.
        let turn = if demand.on_ground { 0.0 } else { GRAVITY * math::tan(symmetric(bank, 1.2)) / speed };
        let (sin_bank, cos_bank) = math::sin_cos(bank);
        let cos_pitch = math::cos(pitch);
        let [roll_max, pitch_max] = c.rate_max;
        let wanted = [
            symmetric(c.roll_gain * (demand.bank - bank), roll_max),
            symmetric(c.pitch_gain * (demand.pitch - pitch), pitch_max) * cos_bank + turn * sin_bank * cos_pitch,
            match demand.heading {
                Some(held) => c.heading_gain * wrap_angle(held - heading),
                None => turn * cos_bank * cos_pitch,
            },
        ];
        let learns = if demand.on_ground { 0.0 } else { dt };
        let mut out = [0.0; 3];
        for (axis, out) in out.iter_mut().enumerate() {
            let error = wanted[axis] - wing.rate[axis];
            let mut grows = c.integral[axis] * error;
            if axis == 2 && demand.heading.is_none() {
                // Air from the right pushes it to the left, and the nose belongs where the air comes from.
                grows -= c.side_force * wing.side_force;
            }
            let direct = c.feed[axis] * ratio * wanted[axis] + ratio * ratio * c.gain[axis] * error;
            let total = direct + ratio * ratio * self.integral[axis];
            if !total.is_finite() {
                continue;
            }
            if !(total.abs() > 1.0 && total * grows > 0.0) {
                self.integral[axis] = symmetric(self.integral[axis] + grows * learns, INTEGRAL);
            }
            *out = symmetric(total, 1.0);
        }
        let [roll, pitch, yaw] = out;
        SurfaceDemand { roll, pitch, yaw, flap: 0.0 }
    }

    /// Forgets what it has learned.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LEVEL: Wing = Wing { attitude: [0.0; 3], rate: Vec3::new(0.0, 0.0, 0.0), side_force: 0.0, airspeed: 15.0 };

    #[test]
    fn a_coordinated_turn_asks_for_nothing_more() {
        let (bank, speed) = (0.5f32, 15.0f32);
        let turn = GRAVITY * math::tan(bank) / speed;
        let rate = Vec3::new(0.0, turn * math::sin(bank), turn * math::cos(bank));
        let config = WingConfig { feed: [0.0; 3], ..WingConfig::default() };
        let wing = Wing { attitude: [bank, 0.0, 1.0], rate, side_force: 0.0, airspeed: speed };
        let out = WingLoops::default().step(0.01, &wing, &WingDemand { bank, ..Default::default() }, &config);
        assert!(out.roll.abs() < 1e-5 && out.pitch.abs() < 1e-5 && out.yaw.abs() < 1e-5, "{out:?}");
    }

    #[test]
    fn slower_means_larger_deflections() {
        let demand = WingDemand { pitch: 0.1, ..Default::default() };
        let at = |airspeed| {
            WingLoops::default().step(0.01, &Wing { airspeed, ..LEVEL }, &demand, &WingConfig::default()).pitch
        };
        assert!((at(10.0) / at(20.0) - 4.0).abs() < 0.01);
        assert!(at(0.0) < 1.0, "standing it is not divided by nothing");
    }

    #[test]
    fn a_heading_is_held_by_the_rudder_alone_and_the_ground_teaches_nothing() {
        let mut loops = WingLoops::default();
        let demand = WingDemand { heading: Some(0.2), on_ground: true, ..Default::default() };
        for _ in 0..100 {
            let out = loops.step(0.01, &LEVEL, &demand, &WingConfig::default());
            assert!(out.yaw > 0.01 && out.roll == 0.0 && out.pitch == 0.0);
        }
        assert_eq!(loops, WingLoops::default());
    }

    proptest! {
        #[test]
        fn any_numbers_give_deflections(
            attitude: [f32; 3], rate: [f32; 3], side_force: f32, airspeed: f32, bank: f32, pitch: f32, dt: f32,
        ) {
            let mut loops = WingLoops::default();
            let wing = Wing { attitude, rate: Vec3::from(rate), side_force, airspeed };
            let demand = WingDemand { bank, pitch, heading: None, on_ground: false };
            let out = loops.step(dt, &wing, &demand, &WingConfig::default());
            prop_assert!([out.roll, out.pitch, out.yaw].iter().all(|part| part.abs() <= 1.0), "{out:?}");
            let after = loops.step(0.0025, &LEVEL, &WingDemand::default(), &WingConfig::default());
            prop_assert!(after.pitch.is_finite());
        }
    }
}
