//! Heading from the velocity changes of a receiver, for a start without any heading.
//!
//! A filter that starts without a heading carries attitude and velocity in a world frame rotated
//! about the vertical by an unknown angle ψ. The inertial sensor measures a velocity change p in
//! that frame, the receiver the same change w in the true frame: w = R(ψ)·p. ψ is the least-squares
//! rotation over many time windows (Kabsch, "A solution for the best rotation to relate two sets of
//! vectors", Acta Cryst. A32, 1976, in two dimensions):
//!
//! ψ = atan2(Σ p×w, Σ p·w), with the means of p and w subtracted.
//!
//! The means are subtracted because a tilt error adds the same change to every window; motion on a
//! circle, or a start and a stop, does not. The residual of the fit gives the standard deviation of
//! the angle, so a vehicle that stands never finds a heading.
//!
//! | | condition |
//! |---|---|
//! | start | [`StartHeading::Unknown`](crate::StartHeading::Unknown), or `Magnetic` without a field |
//! | window | from one velocity to the first one at least [`WINDOW`] later |
//! | found | [`LEAST`] windows and a standard deviation below [`KNOWN`] |
//! | stop | found, or an external attitude |
//!
//! Not for a vehicle with a usable magnetometer. A start on a moving vehicle gives a wrong tilt,
//! which delays the result.

use stampfly_types::{Instant, math};

/// Shortest window, s. At 1 m/s² the velocity changes by several times the error of a receiver.
const WINDOW: f32 = 0.5;
/// Longest window, s. A longer gap starts a new window.
const GAP: f32 = 3.0;
/// Smallest number of windows: two for the means, the others for the residual.
const LEAST: f32 = 6.0;
/// Standard deviation at which the heading counts as found, rad. The filter is linear within it and
/// corrects the rest.
const KNOWN: f32 = 0.1;
/// Number of windows after which the sums are halved, because gyro and tilt drift.
const MEMORY: f32 = 120.0;

/// Result of one velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// The window has not ended.
    Waits,
    /// The window has ended. The next one starts at this velocity.
    Window,
    /// The estimated world frame must be rotated by `turn` about the vertical, rad, with standard
    /// deviation `sigma`.
    Found { turn: f32, sigma: f32 },
}

/// State of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Alignment {
    sought: bool,
    /// Start of the window and the receiver's velocity at that time.
    began: Option<(Instant, [f32; 2])>,
    windows: f32,
    /// Sums of p, of w, of (p·w, p×w) and of (p², w²).
    felt: [f32; 2],
    measured: [f32; 2],
    products: [f32; 2],
    squares: [f32; 2],
}

impl Alignment {
    /// Heading known, no search.
    pub(super) const KNOWN: Self = Self {
        sought: false,
        began: None,
        windows: 0.0,
        felt: [0.0; 2],
        measured: [0.0; 2],
        products: [0.0; 2],
        squares: [0.0; 2],
    };

    /// Heading unknown, search active.
    pub(super) const SOUGHT: Self = Self { sought: true, ..Self::KNOWN };

    pub(super) const fn is_sought(&self) -> bool {
        self.sought
    }

    pub(super) fn found(&mut self) {
        *self = Self::KNOWN;
    }

    /// Processes the estimated and the measured horizontal velocity of one instant, m/s, with the
    /// variance of one axis of the measured one. After [`Step::Window`] the caller must set the
    /// estimated velocity to the measured one.
    pub(super) fn step(&mut self, at: Instant, felt: [f32; 2], measured: [f32; 2], variance: f32) -> Step {
        let Some((began, first)) = self.began else {
            self.began = Some((at, measured));
            return Step::Window;
        };
        let time = at.since(began).seconds();
        if time < WINDOW {
            return Step::Waits;
        }
        self.began = Some((at, measured));
        if time > GAP {
            return Step::Window;
        }
        // Changes since the start of the window, at which the estimated velocity was set to the
        // measured one.
        let [p, w] = [[felt[0] - first[0], felt[1] - first[1]], [measured[0] - first[0], measured[1] - first[1]]];
        // Halve all sums: the means and the fit stay, their weight decreases.
        if self.windows >= MEMORY {
            let sums = [&mut self.felt, &mut self.measured, &mut self.products, &mut self.squares];
            sums.into_iter().flatten().for_each(|sum| *sum *= 0.5);
            self.windows *= 0.5;
        }
        self.windows += 1.0;
        for axis in 0..2 {
            self.felt[axis] += p[axis];
            self.measured[axis] += w[axis];
        }
        self.products[0] += dot(p, w);
        self.products[1] += cross(p, w);
        self.squares[0] += dot(p, p);
        self.squares[1] += dot(w, w);
        self.judge(variance)
    }

    fn judge(&self, variance: f32) -> Step {
        let n = self.windows;
        if n < LEAST {
            return Step::Window;
        }
        let along = self.products[0] - dot(self.felt, self.measured) / n;
        let across = self.products[1] - cross(self.felt, self.measured) / n;
        let felt = self.squares[0] - dot(self.felt, self.felt) / n;
        let measured = self.squares[1] - dot(self.measured, self.measured) / n;
        let fit = math::sqrt(along * along + across * across);
        // Per axis and window; two means and an angle have been fitted. At least the variance of
        // two velocities.
        let residual = (felt + measured - 2.0 * fit) / (2.0 * n - 5.0);
        let sigma = math::sqrt(residual.max(2.0 * variance) / felt.max(1e-6));
        if sigma < KNOWN && fit.is_finite() {
            Step::Found { turn: math::atan2(across, along), sigma }
        } else {
            Step::Window
        }
    }
}

fn dot([ax, ay]: [f32; 2], [bx, by]: [f32; 2]) -> f32 {
    ax * bx + ay * by
}

fn cross([ax, ay]: [f32; 2], [bx, by]: [f32; 2]) -> f32 {
    ax * by - ay * bx
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle on a circle with this acceleration, whose estimated world is rotated by `turn` and
    /// tilted such that it measures `tilt` m/s² too much. Returns angle, standard deviation and
    /// time in seconds.
    fn search(acceleration: f32, turn: f32, tilt: f32) -> Option<(f32, f32, u16)> {
        let mut alignment = Alignment::SOUGHT;
        let mut felt = [0.0; 2];
        let mut last = [0.0; 2];
        for n in 0..600u16 {
            let time = 0.2 * f32::from(n);
            // 0.3 rad/s on the circle; the noise has other frequencies.
            let speed = acceleration / 0.3;
            let noise = |k: f32| 0.14 * math::sin(k * f32::from(n) * 2.4 + k);
            let truth = [speed * math::cos(0.3 * time), speed * math::sin(0.3 * time)];
            let change = [truth[0] - last[0], truth[1] - last[1]];
            last = truth;
            let (sin, cos) = math::sin_cos(turn);
            if n > 0 {
                felt[0] += cos * change[0] + sin * change[1] + tilt * 0.2;
                felt[1] += cos * change[1] - sin * change[0];
            }
            let measured = [truth[0] + noise(1.0), truth[1] + noise(1.7)];
            match alignment.step(Instant::from_millis(u64::from(n) * 200), felt, measured, 0.01) {
                Step::Waits => {}
                Step::Window => felt = measured,
                Step::Found { turn, sigma } => return Some((turn, sigma, n / 5)),
            }
        }
        None
    }

    #[test]
    fn any_heading_is_found_and_its_deviation_is_honest() {
        for turn in [-3.0f32, -1.2, 0.0, 0.9, 2.2, 3.1] {
            for tilt in [0.0, 0.5] {
                let (found, sigma, seconds) = search(1.0, turn, tilt).expect("found");
                let error = math::wrap_angle(found - turn);
                assert!(error.abs() < 3.0 * sigma && sigma < 0.1 && seconds < 40, "{turn}, {tilt}: {found} ± {sigma}");
            }
        }
    }

    #[test]
    fn a_vehicle_that_does_not_accelerate_finds_none() {
        assert_eq!(search(0.0, 1.0, 0.0), None);
        assert_eq!(search(0.0, 1.0, 0.7), None, "a tilt is no acceleration");
    }
}
