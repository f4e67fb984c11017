//! The difference between camera velocity and dead reckoning over time (the "course"), and fits
//! that explain it.
//!
//! If the gyro's zero is too high by b since the time t₀, at the distance d, a healthy camera's
//! velocity minus the reckoned one is, rotated by a quarter turn about the vertical,
//!
//! ```text
//! b·(g·(t − t₀)²/2 − d)
//! ```
//!
//! because the reckoned tilt grows, and because the rotation compensation of the camera is wrong. A
//! faulty camera gives another course: reversed, swapped or dead axes a multiple of the expected
//! image velocity, an offset of the motion a multiple of the distance. To each of them a line is
//! added, for a tilt error at the start of the reckoner, limited by the reckoner's uncertainty. A
//! burst of the gyro rotates the reckoned tilt once: it gives a line from then on, and one outlier
//! whose image was compensated with the burst.
//!
//! Each explanation is fitted by least squares for each t₀. The residual measures its quality.

use stampfly_types::{GRAVITY, math};

/// Duration of a point, s, and number of points: together the lifetime of a reckoner.
const STRETCH: f32 = 0.125;
const POINTS: usize = 24;
/// Largest slope of the line, in standard deviations of the reckoner's acceleration.
const TILT_SIGMAS: f32 = 2.0;
/// Smallest numbers of points: since t₀ for a shift (up to three parameters per axis) and for a
/// burst (two), in all for either of them, and since t₀ for a camera fault (no parameter).
const SHORTEST: usize = 6;
const SHORTEST_BURST: usize = 4;
const ENOUGH: usize = 9;
const SHORTEST_FAULT: usize = 3;
/// Share of the course's scatter that a fit may leave in addition to noise: that of eight points
/// whose own noise is a third of the gate.
const LEFT: f32 = 0.07;
/// Factor of the noise that may remain: three standard deviations above the mean for a dozen points
/// in two axes.
const NOISES: f32 = 2.0;
/// Factor of the noise below which a course is too small for a fit: a single wrong point among a
/// dozen produces as much.
const LARGE: f32 = 6.0;
/// Factor by which the residual of the second-best explanation must exceed that of the best.
const BETTER: f32 = 3.0;
/// Share of the scatter that a camera fault may leave: it acts on a velocity that is itself
/// reckoned with errors.
const TOLD: f32 = 0.35;
/// Share of the squared motion by which a healthy camera may differ: a scale error of 40 %.
const AGREES: f32 = 0.2;
/// Camera faults along the body axes: dead, reversed, and swapped with either sign.
const FAULTS: [[[f32; 2]; 2]; 4] =
    [[[0.0; 2]; 2], [[-1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]], [[0.0, -1.0], [-1.0, 0.0]]];

/// Means over one point, world, north and east.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Point {
    /// Age of the reckoner, s.
    time: f32,
    /// Camera velocity minus reckoned velocity, m/s.
    apart: [f32; 2],
    /// Expected image velocity: the reckoned velocity plus the contribution of the rotation, m/s.
    shown: [f32; 2],
    /// Distance to the floor, m.
    distance: f32,
}

/// The course since the start of a reckoner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Course {
    points: [Point; POINTS],
    count: usize,
    /// Sums for the point being filled, over `readings` readings.
    filling: Point,
    readings: f32,
    until: f32,
}

/// Limits of the fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FitLimits {
    /// Largest shift, rad/s.
    pub largest: f32,
    /// Standard deviation of the reckoner's acceleration error, m/s².
    pub accel_sigma: f32,
    /// Largest acceleration from a tilt error at the start, m/s².
    pub tilt: f32,
    /// Noise variance of a point, (m/s)².
    pub noise: f32,
    /// Heading of the body, rad.
    pub heading: f32,
}

/// Explanation of a course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Explanation {
    /// None yet.
    Unclear,
    /// A camera fault.
    Camera,
    /// A tilt error at the start of the reckoner.
    Tilt,
    /// A shift of the gyro's zero; or a past burst, which has rotated the reckoned attitude, with a
    /// rate of zero.
    Gyro(Shift),
    /// A shift of the gyro's zero, or another cause that cannot be distinguished yet.
    PerhapsGyro,
}

/// A shift of the gyro's zero, world, about north and east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shift {
    /// Addition to the gyro bias, rad/s.
    pub rate: [f32; 2],
    /// Rotation of the reckoned attitude, rad, valid at the time `at` of the last point, s.
    pub turn: [f32; 2],
    pub at: f32,
}

impl Course {
    /// Adds a reading at the age of the reckoner, s.
    pub(crate) fn add(&mut self, age: f32, apart: [f32; 2], shown: [f32; 2], distance: f32) {
        if self.readings == 0.0 {
            self.until = age + STRETCH;
        }
        let sum = |sum: [f32; 2], value: [f32; 2]| [sum[0] + value[0], sum[1] + value[1]];
        self.readings += 1.0;
        self.filling = Point {
            time: self.filling.time + age,
            apart: sum(self.filling.apart, apart),
            shown: sum(self.filling.shown, shown),
            distance: self.filling.distance + distance,
        };
        if age < self.until {
            return;
        }
        let share = 1.0 / core::mem::take(&mut self.readings);
        let Point { time, apart, shown, distance } = core::mem::take(&mut self.filling);
        if let Some(point) = self.points.get_mut(self.count) {
            *point = Point {
                time: time * share,
                apart: apart.map(|sum| sum * share),
                shown: shown.map(|sum| sum * share),
                distance: distance * share,
            };
            self.count += 1;
        }
    }

    /// Whether the camera follows the reckoned motion. `None` while the expected image velocity has
    /// scattered by less than `motion`, m/s. A constant error of the velocity has no effect here.
    pub(crate) fn agrees(&self, motion: f32) -> Option<bool> {
        let points = self.points.get(..self.count).filter(|points| points.len() >= SHORTEST)?;
        let moved = scatter(points, |point| point.shown);
        (moved > motion * motion).then(|| scatter(points, |point| point.apart) < AGREES * moved)
    }

    /// The explanation of the course.
    pub(crate) fn explanation(&self, limits: &FitLimits) -> Explanation {
        let points = self.points.get(..self.count).unwrap_or(&[]);
        let tilt = TILT_SIGMAS * limits.accel_sigma;
        let size = leaves(points, |point| point.apart, tilt);
        let Some(shift) = best_shift(points, tilt) else { return Explanation::Unclear };
        let offset = Some(offset(points, tilt)).filter(|left| *left < TOLD * size);
        // The camera fault closest to the data: one of `FAULTS`, or an offset if it explains
        // enough.
        let fault = best_fault(points, tilt, limits.heading).min(offset.unwrap_or(f32::MAX));
        let (camera, gyro) = (limits.noise + fault, limits.noise + shift.left);
        let straight = limits.noise + leaves(points, |point| point.apart, limits.tilt);
        // Simplest explanation first: the others must leave much less than a line does.
        let explains = |left: f32| left < (1.0 + NOISES) * limits.noise + LEFT * size;
        if explains(straight) && camera > BETTER * straight {
            return Explanation::Tilt;
        }
        // A burst before a shift, because it has fewer parameters.
        let large = size > LARGE * limits.noise;
        let last = points.last().map_or(0.0, |point| point.time);
        if let Some(burst) = best_burst(points, tilt) {
            let turned = limits.noise + burst.left;
            if large && explains(turned) && straight.min(camera).min(gyro) > BETTER * turned {
                return Explanation::Gyro(Shift { rate: [0.0; 2], turn: burst.turn(1.0), at: last });
            }
        }
        let [x, y] = shift.slope;
        let possible = x * x + y * y < limits.largest * limits.largest;
        if possible && large && explains(gyro) && straight.min(camera) > BETTER * gyro {
            return Explanation::Gyro(Shift { rate: [-y, x], turn: shift.turn(last - shift.since), at: last });
        }
        if fault < NOISES * limits.noise + TOLD * size && gyro > BETTER * camera {
            return Explanation::Camera;
        }
        if possible && explains(gyro) && gyro < camera { Explanation::PerhapsGyro } else { Explanation::Unclear }
    }
}

/// Result of a fit: slope, rotated by a quarter turn, rad/s (of a burst rad); start, s;
/// acceleration of the tilt error before it, m/s²; residual, (m/s)².
struct Fitted {
    slope: [f32; 2],
    before: [f32; 2],
    since: f32,
    left: f32,
}

impl Fitted {
    /// Rotation about north and east that corresponds to the acceleration, rad, after `seconds`.
    fn turn(&self, seconds: f32) -> [f32; 2] {
        let [north, east]: [f32; 2] =
            core::array::from_fn(|axis| self.before[axis] + GRAVITY * self.slope[axis] * seconds);
        // A quarter turn back: an eastward acceleration comes from a rotation about north.
        [east / GRAVITY, -north / GRAVITY]
    }
}

/// The best fit of a shift over all start points. `tilt`: largest acceleration of a tilt error
/// before it, m/s².
fn best_shift(points: &[Point], tilt: f32) -> Option<Fitted> {
    best_since(points, SHORTEST, |onset| {
        let since = points.get(onset)?.time;
        let basis = |point: &Point| {
            let age = point.time - since;
            if age > 0.0 || onset == 0 { 0.5 * GRAVITY * age * age - point.distance } else { 0.0 }
        };
        // A shift that began before the first point may have caused any tilt.
        Some(fitted(points, since, if onset == 0 { f32::MAX } else { tilt }, basis))
    })
}

/// The best fit of a gyro burst, after which the tilt differs.
fn best_burst(points: &[Point], tilt: f32) -> Option<Fitted> {
    best_since(points, SHORTEST_BURST, |onset| {
        let since = points.get(onset)?.time;
        let basis = |point: &Point| {
            let age = point.time - since;
            if age == 0.0 { -point.distance * (1.0 / STRETCH) } else { GRAVITY * math::larger(age, 0.0) }
        };
        Some(fitted(points, since, tilt, basis))
    })
}

/// The fit with the smallest residual over all start points.
fn best_since(points: &[Point], shortest: usize, fit: impl Fn(usize) -> Option<Fitted>) -> Option<Fitted> {
    if points.len() < ENOUGH {
        return None;
    }
    let mut best: Option<Fitted> = None;
    for onset in 0..=points.len().checked_sub(shortest)? {
        let found = fit(onset)?;
        if best.as_ref().is_none_or(|best| found.left < best.left) {
            best = Some(found);
        }
    }
    best
}

/// A fit of a multiple of `basis` and a line.
fn fitted(points: &[Point], since: f32, tilt: f32, basis: impl Fn(&Point) -> f32) -> Fitted {
    // With the line and without it.
    let [along, _] = fit(points, |point| [basis(point), 0.0], |point| point.time).slope;
    let mut best: Option<Fitted> = None;
    for along in [along, 0.0] {
        let slope = fit(points, |point| point.apart, |point| basis(point) - along * point.time).slope;
        let rest = |point: &Point| core::array::from_fn(|axis| point.apart[axis] - slope[axis] * basis(point));
        let before = limited(fit(points, rest, |point| point.time).slope, tilt);
        let left = leaves(points, rest, tilt);
        if best.as_ref().is_none_or(|best| left < best.left) {
            best = Some(Fitted { slope, before, since, left });
        }
    }
    best.unwrap_or(Fitted { slope: [0.0; 2], before: [0.0; 2], since, left: f32::MAX })
}

/// Smallest residual of all [`FAULTS`] and start points.
fn best_fault(points: &[Point], tilt: f32, heading: f32) -> f32 {
    let mut best = f32::MAX;
    for onset in 0..=points.len().saturating_sub(SHORTEST_FAULT) {
        let Some((sound, faulty)) = points.split_at_checked(onset) else { continue };
        let Some(since) = faulty.first().map(|point| point.time) else { continue };
        let drift = Drift::before(sound, tilt);
        for fault in &FAULTS {
            let rest = |point: &Point| {
                if point.time < since {
                    return point.apart;
                }
                let drift = drift.at(point.time);
                // The true velocity is the reckoned one plus its drift.
                let seen = [point.shown[0] + drift[0], point.shown[1] + drift[1]];
                let [north, east] = made_of(seen, fault, heading);
                [point.apart[0] - (north - seen[0]), point.apart[1] - (east - seen[1])]
            };
            best = math::smaller(best, leaves(points, rest, tilt));
        }
    }
    best
}

/// Velocity that a faulty camera shows for a true one, north and east.
fn made_of([north, east]: [f32; 2], [ahead, aside]: &[[f32; 2]; 2], heading: f32) -> [f32; 2] {
    let (sin, cos) = math::sin_cos(heading);
    let [x, y] = [north * cos + east * sin, east * cos - north * sin];
    let [x, y] = [ahead[0] * x + ahead[1] * y, aside[0] * x + aside[1] * y];
    [x * cos - y * sin, x * sin + y * cos]
}

/// Linear drift of a reckoner while the camera was healthy.
struct Drift {
    middle: f32,
    value: [f32; 2],
    slope: [f32; 2],
}

impl Drift {
    /// From these points. `tilt`: largest slope, m/s².
    fn before(points: &[Point], tilt: f32) -> Self {
        // Fewer points do not determine a slope.
        let slope = if points.len() < SHORTEST_FAULT { 0.0 } else { tilt };
        Self {
            middle: mean(points, |point| [point.time, 0.0])[0],
            value: mean(points, |point| point.apart),
            slope: limited(fit(points, |point| point.apart, |point| point.time).slope, slope),
        }
    }

    fn at(&self, time: f32) -> [f32; 2] {
        core::array::from_fn(|axis| self.value[axis] + self.slope[axis] * (time - self.middle))
    }
}

/// Residual of an offset of the image motion.
fn offset(points: &[Point], tilt: f32) -> f32 {
    // With the line and without it.
    let [along, _] = fit(points, |point| [point.distance, 0.0], |point| point.time).slope;
    let left = |along: f32| {
        let slope = fit(points, |point| point.apart, |point| point.distance - along * point.time).slope;
        leaves(points, |point| core::array::from_fn(|axis| point.apart[axis] - slope[axis] * point.distance), tilt)
    };
    math::smaller(left(along), left(0.0))
}

/// Mean square of values after removal of their mean and of a line with limited slope, m/s².
fn leaves(points: &[Point], value: impl Fn(&Point) -> [f32; 2], tilt: f32) -> f32 {
    let line = fit(points, &value, |point| point.time);
    let slope = limited(line.slope, tilt);
    scatter(points, |point| {
        let value = value(point);
        core::array::from_fn(|axis| value[axis] - slope[axis] * point.time)
    })
}

/// A vector shortened to at most this length.
fn limited([x, y]: [f32; 2], most: f32) -> [f32; 2] {
    let share = most / math::larger(math::sqrt(x * x + y * y), most);
    if share < 1.0 { [share * x, share * y] } else { [x, y] }
}

/// Regression of values on a basis.
struct Line {
    slope: [f32; 2],
}

fn fit(points: &[Point], value: impl Fn(&Point) -> [f32; 2], basis: impl Fn(&Point) -> f32) -> Line {
    let middle = mean(points, |point| [basis(point), 0.0])[0];
    let away = |point: &Point| basis(point) - middle;
    let [power, _] = mean(points, |point| [away(point) * away(point), 0.0]);
    let product = mean(points, |point| value(point).map(|value| value * away(point)));
    let slope = product.map(|product| if power > f32::EPSILON { product / power } else { 0.0 });
    Line { slope }
}

fn mean(points: &[Point], value: impl Fn(&Point) -> [f32; 2]) -> [f32; 2] {
    let mut sum = [0.0; 2];
    for point in points {
        let [x, y] = value(point);
        sum = [sum[0] + x, sum[1] + y];
    }
    sum.map(|sum| sum / points.len().max(1) as f32)
}

/// Mean square about the mean, sum of both axes.
fn scatter(points: &[Point], value: impl Fn(&Point) -> [f32; 2]) -> f32 {
    let [north, east] = mean(points, &value);
    let [x, y] = mean(points, |point| {
        let [x, y] = value(point);
        [(x - north) * (x - north), (y - east) * (y - east)]
    });
    math::larger(x + y, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    const DT: f32 = 0.01;
    const DISTANCE: f32 = 0.5;
    const LIMITS: FitLimits = FitLimits { largest: 1.2, accel_sigma: 0.1, tilt: 0.3, noise: 1e-3, heading: 0.0 };

    /// The explanation of a course of `seconds`; velocities of camera and reckoner are functions of
    /// time.
    fn course(
        seconds: f32,
        camera: impl Fn(f32) -> [f32; 2],
        reckoned: impl Fn(f32) -> [f32; 2],
        distance: impl Fn(f32) -> f32,
    ) -> Explanation {
        let mut course = Course::default();
        for n in 1..=(seconds / DT) as u16 {
            let time = f32::from(n) * DT;
            let ([x, y], [x0, y0]) = (camera(time), reckoned(time));
            course.add(time, [x - x0, y - y0], [x0, y0], distance(time));
        }
        course.explanation(&LIMITS)
    }

    const STILL: fn(f32) -> [f32; 2] = |_| [0.0; 2];
    const HIGH: fn(f32) -> f32 = |_| DISTANCE;
    /// Climb to half a metre within a second.
    const CLIMBS: fn(f32) -> f32 = |time| (0.5 * time).min(DISTANCE);

    /// The camera of a hovering vehicle whose roll rate is too high by `bias` since `since`,
    /// compensated with that rate.
    fn shifted(bias: f32, since: f32, distance: fn(f32) -> f32) -> impl Fn(f32) -> [f32; 2] {
        move |time| {
            let age = time - since;
            [0.0, if age > 0.0 { -bias * (0.5 * GRAVITY * age * age - distance(time)) } else { 0.0 }]
        }
    }

    #[test]
    fn a_shift_is_found_with_its_size_and_the_tilt_that_it_has_made() {
        for bias in [0.1, 0.15, 0.3, -0.45, 0.8] {
            for since in [-0.5, 0.0, 0.3, 0.8] {
                let found = course(2.0, shifted(bias, since, HIGH), STILL, HIGH);
                let Explanation::Gyro(shift) = found else { panic!("{bias} since {since}: {found:?}") };
                let off = [shift.rate[0] - bias, shift.rate[1]];
                assert!(off[0].abs() < 0.1 * bias.abs() + 0.01 && off[1].abs() < 0.01, "{bias}: {shift:?}");
                let turned = bias * (shift.at - since.max(0.0));
                assert!(since < 0.0 || (shift.turn[0] + turned).abs() < 0.15 * turned.abs(), "{bias}: {shift:?}");
            }
        }
    }

    #[test]
    fn faults_of_the_camera_are_told_from_a_shift() {
        let circles = |time: f32| {
            let size = 0.05 * math::exp(2.0 * time);
            [size * math::cos(4.0 * time), size * math::sin(4.0 * time)]
        };
        let reversed = |time: f32| circles(time).map(|part| -part);
        let swapped = |time: f32| [circles(time)[1], circles(time)[0]];
        assert_eq!(course(1.6, reversed, circles, HIGH), Explanation::Camera);
        assert_eq!(course(1.6, swapped, circles, HIGH), Explanation::Camera);
        assert_eq!(course(1.6, STILL, circles, HIGH), Explanation::Camera);
        for rate in [1.0, -2.0] {
            let offset = |time: f32| [rate * CLIMBS(time), 0.0];
            for seconds in [0.8, 1.2, 1.6, 2.0] {
                let found = course(seconds, offset, STILL, CLIMBS);
                assert!(!matches!(found, Explanation::Gyro(_)), "{rate} rad/s, {seconds} s: {found:?}");
            }
        }
    }

    #[test]
    fn axes_that_are_swapped_for_half_a_second_are_the_camera() {
        let moves = |time: f32| [0.3 * math::sin(2.5 * time), 0.4 * math::sin(3.2 * time + 1.0)];
        for since in [1.9, 2.03, 2.16] {
            let swapped = |time: f32| if time > since { [moves(time)[1], moves(time)[0]] } else { moves(time) };
            let found = course(since + 0.6, swapped, moves, HIGH);
            assert!(!matches!(found, Explanation::Gyro(_)), "since {since} s: {found:?}");
        }
    }

    #[test]
    fn a_shift_during_the_climb_is_not_the_camera() {
        for bias in [0.1, 0.3, -0.6] {
            for since in [0.0, 0.3, 0.8] {
                for seconds in [0.8, 1.2, 1.9] {
                    let found = course(seconds, shifted(bias, since, CLIMBS), STILL, CLIMBS);
                    assert_ne!(found, Explanation::Camera, "{bias} rad/s since {since} s, {seconds} s");
                }
            }
        }
    }

    #[test]
    fn what_is_sound_or_short_explains_nothing() {
        let moves = |time: f32| [time, 0.3 * time];
        assert_ne!(course(2.0, moves, moves, HIGH), Explanation::Camera);
        assert_eq!(course(0.5, shifted(0.5, 0.0, HIGH), STILL, HIGH), Explanation::Unclear);
        assert_ne!(course(2.0, |time| [0.3 * time, 0.0], STILL, HIGH), Explanation::Camera);
    }

    #[test]
    fn a_burst_of_the_gyro_is_not_the_camera_and_the_turn_that_it_leaves_is_found() {
        let moves = |time: f32| [0.3 * math::sin(2.0 * time), 0.2 * math::cos(3.0 * time)];
        for tilt in [0.06, -0.12, 0.2] {
            for since in [0.3, 0.9] {
                let line = |time: f32| GRAVITY * tilt * (time - since).max(0.0);
                let burst = |time: f32| [moves(time)[0] + line(time), moves(time)[1]];
                for lasts in [0.9, 1.1, 1.6] {
                    let found = course(since + lasts, burst, moves, HIGH);
                    let case = format!("{tilt} rad since {since} s, {lasts} s: {found:?}");
                    assert_ne!(found, Explanation::Camera, "{case}");
                    if let Explanation::Gyro(Shift { turn, .. }) = found {
                        assert!((turn[1] + tilt).abs() < 0.5 * tilt.abs(), "{case}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_tilt_that_was_wrong_from_the_beginning_is_a_line() {
        let moves = |time: f32| [math::sin(2.0 * time), 0.5 * math::cos(3.0 * time)];
        let wrong = |time: f32| [moves(time)[0] + 0.25 * time, moves(time)[1]];
        assert_eq!(course(2.5, wrong, moves, HIGH), Explanation::Tilt);
    }
}
