//! Errors of a flow sensor that depend on the motion between two pictures: limited search window,
//! and proportional noise.
//!
//! A PMW3901 finds the displacement of a picture by comparison with the previous one within a
//! search window. The data sheet specifies up to 7.4 rad/s: 61 mrad per picture, 28 counts. A
//! larger displacement leaves the window. While it is just outside, the best match is at the
//! window's edge; beyond that the match is arbitrary, and a repeating texture appears to move the
//! other way. The data sheet does not give the transition; here it is a quarter of the window,
//! *unverified*.
//!
//! The proportional error comes from varying coarseness of the texture and varying light. The
//! recordings of carried StampFlys do not show its size in one picture, because successive reads of
//! the same motion already differ by a third when one contains two pictures and the next contains
//! one. It is assumed to be 3 to 20 %, *unverified*.

use crate::conditions::Conditions;
use crate::noise::{Noise, Stream};
use crate::normals::Normals;

/// Share of the window beyond its edge up to which the best match is at the edge.
const EDGE: f64 = 0.25;

/// Motion-dependent errors of one flow sensor.
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

    /// Measured angles for these angles swept about each axis, rad, in a picture of this length, s.
    pub fn of(&mut self, swept: [f64; 2], picture: f64) -> [f64; 2] {
        // The window is given as a rate; its size in angle depends on the picture's length.
        let window = self.largest_rate * picture;
        let followed = swept.map(|angle| followed(angle, window));
        if self.share == 0.0 {
            return followed;
        }
        let noise: [f64; 2] = self.noise.next();
        core::array::from_fn(|axis| followed[axis] * (1.0 + self.share * noise[axis]))
    }
}

/// Position of the best match for a displacement, within a window of this half width, rad.
fn followed(angle: f64, window: f64) -> f64 {
    let far = angle.abs();
    if far <= window {
        angle
    } else if far <= (1.0 + EDGE) * window {
        window.copysign(angle)
    } else {
        // Wrapped into −window to +window.
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
