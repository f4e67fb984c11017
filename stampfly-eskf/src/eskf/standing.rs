//! Does a vehicle that stands turn, or has its gyro's zero shifted?
//!
//! On the ground a shifted zero turns the estimated attitude, and gravity does not bring it back: an accelerometer's bias
//! looks the same. But a body that turns takes gravity with it, through its axes. So over quarters of a second the turn
//! that the gyro tells is compared with the one that gravity shows. A gyro that turns while gravity stays has shifted.
//!
//! Gravity does not show a turn about the vertical, so the z axis is left out. A vehicle that is carried turns both, and is not
//! judged. Not for flight, where the accelerometer does not feel gravity.

use stampfly_types::{GRAVITY, Vec3};

/// Each comparison is of the means over so long, s.
const WINDOW: f32 = 0.25;
/// Smallest shift, rad/s: turning by more than 3°/s the estimate is wrong by 5° when a take-off follows in 2 s.
const SHIFT: f32 = 0.05;
/// Share of the shift that gravity may turn by: a vehicle that is moved by hand is not judged. The same share may the shift differ
/// by from one comparison to the next.
const STILL: f32 = 0.3;

/// A shift that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StandingShift {
    /// About body x and y, rad/s.
    pub rate: [f32; 2],
    /// What the accelerometer measures, body, m/s².
    pub accel: Vec3,
}

/// Means over a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Means {
    elapsed: f32,
    samples: f32,
    accel: Vec3,
    rate: Vec3,
}

/// The window before, and the one that is being filled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Standing {
    before: Option<Means>,
    now: Means,
    /// What the last comparison found, rad/s.
    found: Option<[f32; 2]>,
}

impl Standing {
    /// Takes the specific force, m/s², and the rate without its bias, rad/s, both body, of a standing vehicle, `dt` seconds after the
    /// last.
    pub(super) fn step(&mut self, dt: f32, accel: &Vec3, rate: &Vec3) -> Option<StandingShift> {
        self.now.elapsed += dt;
        self.now.samples += 1.0;
        self.now.accel += accel;
        self.now.rate += rate;
        if self.now.elapsed < WINDOW {
            return None;
        }
        let window = core::mem::take(&mut self.now);
        let share = 1.0 / window.samples;
        let now = Means { accel: window.accel * share, rate: window.rate * share, ..window };
        let before = self.before.replace(now)?;
        let found = excess(&before, &now);
        let last = core::mem::replace(&mut self.found, found);
        let (rate, last) = found.zip(last)?;
        let differs = squared([rate[0] - last[0], rate[1] - last[1]]);
        if differs > STILL * STILL * squared(rate) {
            return None;
        }
        *self = Self::default();
        Some(StandingShift { rate, accel: now.accel })
    }
}

/// By how much the gyro turns more than gravity, if it alone does.
fn excess(before: &Means, now: &Means) -> Option<[f32; 2]> {
    // A rate w about x and y moves gravity, which points along -z, by g times (w.y, -w.x) each second.
    let per_second = (now.accel - before.accel) / (GRAVITY * 0.5 * (before.elapsed + now.elapsed));
    let gravity = [-per_second.y, per_second.x];
    let rate = 0.5 * (before.rate + now.rate);
    let shift = [rate.x - gravity[0], rate.y - gravity[1]];
    let alone = squared(shift) > SHIFT * SHIFT && squared(gravity) < STILL * STILL * squared(shift);
    alone.then_some(shift)
}

fn squared([x, y]: [f32; 2]) -> f32 {
    x * x + y * y
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::math;

    /// Two seconds of a gyro that tells this rate on a body that turns by this one, both about x, rad/s.
    fn found(gyro: f32, turns: f32) -> Option<StandingShift> {
        let mut standing = Standing::default();
        (0..200u8).find_map(|n| {
            let angle = turns * 0.01 * f32::from(n);
            let accel = Vec3::new(0.0, -GRAVITY * math::sin(angle), -GRAVITY * math::cos(angle));
            standing.step(0.01, &accel, &Vec3::new(gyro, 0.0, 0.0))
        })
    }

    #[test]
    fn a_gyro_that_turns_alone_has_shifted() {
        let shift = found(0.2, 0.0).expect("found");
        assert!((shift.rate[0] - 0.2).abs() < 0.01 && shift.rate[1].abs() < 0.01, "{shift:?}");
        assert_eq!(found(0.03, 0.0), None, "that is within its noise and the filter's");
    }

    #[test]
    fn a_body_that_is_turned_takes_gravity_with_it() {
        assert_eq!(found(0.3, 0.3), None);
        assert_eq!(found(0.0, 0.3), None, "an accelerometer that shifts alone says nothing about the gyro");
    }
}
