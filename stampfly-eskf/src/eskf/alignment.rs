//! Which way is north? Found from how the receiver's velocity changes, when nothing else tells the heading.
//!
//! A filter that starts without a heading carries attitude and velocity in a world that is turned about the vertical by an
//! unknown angle ψ. What the inertial sensor feels as a change p of the velocity in that world, the receiver measures as a
//! change w in the true one: w = R(ψ)·p. From many windows of time ψ is the angle that fits best (Kabsch, "A solution for the
//! best rotation to relate two sets of vectors", Acta Cryst. A32, 1976, in two dimensions):
//!
//! ψ = atan2(Σ p×w, Σ p·w), with the means of p and w taken out.
//!
//! The means go because a wrong tilt adds the same change to every window: on a circle, or a start and a stop, the motion does
//! not. The residual of the fit is the noise that the angle's standard deviation follows from, so that a vehicle that only
//! stands never finds a heading.
//!
//! | | condition |
//! |---|---|
//! | start | [`StartHeading::Unknown`](crate::StartHeading::Unknown), or `Magnetic` without a field |
//! | a window | the first velocity at least [`WINDOW`] after the last window's |
//! | found | [`LEAST`] windows, a standard deviation below [`KNOWN`] |
//! | stop | found, or an attitude from outside |
//!
//! Not for a heading that a compass knows. A start on a moving vehicle is not found wrong, but later: its tilt is wrong first.

use stampfly_types::{Instant, math};

/// Shortest window, s: at 1 m/s² it changes the velocity by what a receiver is wrong by several times.
const WINDOW: f32 = 0.5;
/// Longest window, s: after a gap it begins anew.
const GAP: f32 = 3.0;
/// Windows that are needed: two for the means, and the rest for a residual.
const LEAST: f32 = 6.0;
/// Standard deviation at which the heading is found, rad. The filter is linear about it and finds the rest.
const KNOWN: f32 = 0.1;
/// After so many windows the old ones count half: gyro and tilt drift.
const MEMORY: f32 = 120.0;

/// What a velocity showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// Nothing yet.
    Waits,
    /// A window has ended: the next one begins at this velocity.
    Window,
    /// The estimated world must turn by `turn` about the vertical to be the true one; rad, with its standard deviation.
    Found { turn: f32, sigma: f32 },
}

/// The search for north.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Alignment {
    sought: bool,
    /// When the window began, and the receiver's velocity then.
    began: Option<(Instant, [f32; 2])>,
    windows: f32,
    /// Sums of p, of w, of p·w and p×w, of p² and w².
    felt: [f32; 2],
    measured: [f32; 2],
    products: [f32; 2],
    squares: [f32; 2],
}

impl Alignment {
    /// North is known.
    pub(super) const KNOWN: Self = Self {
        sought: false,
        began: None,
        windows: 0.0,
        felt: [0.0; 2],
        measured: [0.0; 2],
        products: [0.0; 2],
        squares: [0.0; 2],
    };

    /// North is to be found.
    pub(super) const SOUGHT: Self = Self { sought: true, ..Self::KNOWN };

    pub(super) const fn is_sought(&self) -> bool {
        self.sought
    }

    pub(super) fn found(&mut self) {
        *self = Self::KNOWN;
    }

    /// Takes the receiver's velocity and the estimated one of the same instant, each along two axes of its world, m/s, and the
    /// variance of the receiver's along one. After [`Step::Window`] the estimated velocity must be set to the receiver's.
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
        let [p, w] = [[felt[0] - first[0], felt[1] - first[1]], [measured[0] - first[0], measured[1] - first[1]]];
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
        // Per axis and window; two means and an angle are taken out of it. No less than two velocities are wrong by.
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

    /// A vehicle on a circle with this acceleration, whose estimated world is turned by `turn` and tilted so that it feels
    /// `tilt` m/s² too much: what is found, and after how many seconds.
    fn search(acceleration: f32, turn: f32, tilt: f32) -> Option<(f32, f32, u16)> {
        let mut alignment = Alignment::SOUGHT;
        let mut felt = [0.0; 2];
        let mut last = [0.0; 2];
        for n in 0..600u16 {
            let time = 0.2 * f32::from(n);
            // 0.3 rad/s round the circle; noise that is no sine of it.
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
