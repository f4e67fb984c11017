//! What a flow sensor makes of the angle that goes by from one picture to the next: how far it can follow, and how wrong it is in proportion.
//!
//! A PMW3901 finds where a picture has gone by comparing it with the one before, within a window. Its data sheet gives 7.4 rad/s as the fastest
//! motion: 61 mrad from one picture to the next, 28 counts. What goes by faster leaves the window. The best match that is left is at its edge
//! while the true one is just beyond it, and anywhere when that is farther: a texture that repeats looks as if it had gone the other way. How far
//! beyond the edge still counts as the edge the data sheet does not say; a quarter of the window here, *unverified*.
//!
//! The error in proportion comes from a floor whose texture is now coarse and now fine, and from light that changes. How large it is in one picture the recordings of
//! carried StampFlys do not say: neighbouring reads of one motion differ by a third of it already because one holds two pictures and the next one. It is taken to be
//! 3 to 20 %, *unverified*.

use crate::conditions::Conditions;
use crate::noise::{Noise, Stream};
use crate::normals::Normals;

/// Share of the window beyond its edge from where the best match is still at the edge.
const EDGE: f64 = 0.25;

/// The errors that a flow sensor makes because something moves.
#[derive(Debug)]
pub(super) struct MotionError {
    noise: Normals,
    share: f64,
    largest_rate: f64,
}

impl MotionError {
    pub fn new(conditions: &Conditions, seed: u64) -> Self {
        let noise = Noise::stream(seed, Stream::FlowMotion).into();
        Self { noise, share: conditions.flow_motion_noise, largest_rate: conditions.flow_largest_rate }
    }

    /// What is seen of an angle that goes by about each axis, rad, in a picture of this length, s.
    pub fn of(&mut self, swept: [f64; 2], picture: f64) -> [f64; 2] {
        let window = self.largest_rate * picture;
        let followed = swept.map(|angle| followed(angle, window));
        if self.share == 0.0 {
            return followed;
        }
        let noise: [f64; 2] = self.noise.next();
        core::array::from_fn(|axis| followed[axis] * (1.0 + self.share * noise[axis]))
    }
}

/// Where the best match of a picture is that has moved by this angle, within a window of this half width.
fn followed(angle: f64, window: f64) -> f64 {
    let far = angle.abs();
    if far <= window {
        angle
    } else if far <= (1.0 + EDGE) * window {
        window.copysign(angle)
    } else {
        // Into −window to +window.
        let turns = libm::floor(angle / (2.0 * window) + 0.5);
        angle - turns * 2.0 * window
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: f64 = 1.0 / 121.0;

    fn error(share: f64) -> MotionError {
        let largest = 7.4;
        let conditions = Conditions { flow_motion_noise: share, flow_largest_rate: largest, ..Conditions::GENTLE };
        MotionError::new(&conditions, 1)
    }

    #[test]
    fn up_to_its_largest_rate_it_follows_exactly() {
        let mut exact = error(0.0);
        for rate in [0.0, 0.5, -3.0, 7.39] {
            assert_eq!(exact.of([rate * PICTURE, -rate * PICTURE], PICTURE), [rate * PICTURE, -rate * PICTURE]);
        }
    }

    #[test]
    fn above_it_saturates_and_then_sees_another_motion() {
        let mut exact = error(0.0);
        let mut seen = |rate: f64| exact.of([rate * PICTURE, 0.0], PICTURE)[0] / PICTURE;
        assert!((seen(8.0) - 7.4).abs() < 1e-9 && (seen(-9.0) + 7.4).abs() < 1e-9, "at the edge");
        assert!((seen(12.0) - (12.0 - 14.8)).abs() < 1e-9, "the other way");
        assert!((seen(14.8)).abs() < 1e-9, "as if it stood still");
        assert!((-40..=40).all(|rate| seen(f64::from(rate)).abs() <= 7.4 + 1e-9));
    }

    #[test]
    fn the_error_grows_with_the_motion() {
        for (share, rate) in [(0.03, 1.0), (0.2, 1.0), (0.2, 3.0)] {
            let (mut error, count) = (error(share), 20_000);
            let squares = (0..count).map(|_| (error.of([rate * PICTURE, 0.0], PICTURE)[0] / PICTURE - rate).powi(2));
            let deviation = (squares.sum::<f64>() / f64::from(count)).sqrt();
            assert!((deviation / (share * rate) - 1.0).abs() < 0.03, "{deviation} of {rate}");
        }
    }
}
