//! Is it the gyro's zero that has shifted, when flow and the accelerometer disagree?
//!
//! A zero that shifts by 0.1 rad/s tilts the estimate by 6° within a second. Flow then sees an acceleration that was not felt,
//! and the comparison convicts flow, the only sensor that is right. But a shift leaves a course of its own. With a zero that is
//! too high by b since the time t₀, at the distance d, the difference of both velocities is, turned by a quarter about the vertical,
//!
//! ```text
//! b·(g·(t − t₀)²/2 − d)
//! ```
//!
//! because the tilt grows, and because the rotation that flow is compensated for is wrong. Where t₀ was before the record, a line
//! is added: the tilt that was there. The course is fitted to the last two seconds, for each t₀, with everything
//! undone that flow did to the filter meanwhile.
//!
//! Flow that is reversed or swapped makes an unstable vehicle, and the beginning of an exponential looks much the same. So these lies are
//! fitted, too, and the shift has to explain the record much better. Flow that is stuck makes a difference no larger than the
//! vehicle's own velocity, and is found while that is small.
//!
//! Not for a shift that is seen in a single sample: that is `eskf/gyro_monitor.rs`'s, which needs 50 ms.

use stampfly_types::{GRAVITY, math};

/// Sums over so many stretches of time, and how long each is, s.
const STRETCHES: usize = 16;
const STRETCH: f32 = 0.125;
/// A verdict needs so many stretches with the shift.
const SHORTEST: usize = 6;
/// Mean square of the difference that only a shift reaches, m²/s². In flights with shifts of 0.1 to 1 rad/s it was at least 0.14
/// and mostly above 0.5; of those whose flow lied in another way and left as little as [`LEFT`], at most 0.05.
const LARGE: f32 = 0.14;
/// Share of it that a shift may leave unexplained. Those shifts left 0.001 to 0.065.
const LEFT: f32 = 0.07;
/// Share that the best of the lies leaves, where the shift is believed: this much, or so many times what the shift leaves if that is less
/// than the third. Of 334 shifts 299 were believed so, of 192 flights with flow reversed or swapped none was.
const LIE_LEFT: f32 = 0.2;
const BETTER: f32 = 7.0;
const WELL: f32 = 0.02;
/// Where the vehicle stood as the record began, and it is this long, a shift began later and left no tilt before it. Flow lies if the best
/// such shift leaves more than this share, a tilt that was wrong on the ground as well, and a lie or an offset of the picture's motion less
/// than this share of that. Of 128 flights with shifts of 0.1 to 0.5 rad/s none was taken for a lie so; of 60 with lies that began with
/// or before the take-off 29 were told so, most of the others by the comparison over half a second.
const LONG_ENOUGH: usize = 9;
const MUCH_LEFT: f32 = 0.15;
const LESS: f32 = 0.5;
/// Acceleration of the largest tilt that is wrong on the ground, m/s²: 1.5°, what a slope and the accelerometer's zero leave.
const WRONG_TILT: f32 = 0.026 * GRAVITY;
/// Flow's velocity as a lie makes it of the true one, each a matrix: reversed, and swapped in both ways.
const LIES: [[[f32; 2]; 2]; 3] = [[[-1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]], [[0.0, -1.0], [-1.0, 0.0]]];
/// Largest shift, rad/s: a larger one is a jump that is seen at once.
const LARGEST: f32 = 1.2;

/// A shift of the gyro's zero, as corrections of the present estimate, world, about north and east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GyroShift {
    /// What to add to the gyro's bias, rad/s.
    pub bias: [f32; 2],
    /// How far to turn the estimated attitude, rad.
    pub tilt: [f32; 2],
}

/// Sums over a stretch of time, world, north and east.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Stretch {
    elapsed: f32,
    readings: f32,
    /// Of flow's velocity and of the distance, over all readings.
    flow: [f32; 2],
    distance: f32,
    /// Integral of the acceleration, m/s.
    change: [f32; 2],
    /// What flow added to the acceleration and to the gyro's bias.
    added: [f32; 2],
    gyro_bias: [f32; 2],
}

/// The last two seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Record {
    /// A ring; `newest` is being added to.
    stretches: [Stretch; STRETCHES],
    newest: usize,
    /// How many hold something.
    filled: usize,
}

/// Means over a stretch: flow's velocity, what remains of it without the integral of the acceleration, and the distance.
#[derive(Clone, Copy, Default)]
struct Point {
    time: f32,
    flow: [f32; 2],
    apart: [f32; 2],
    distance: f32,
}

/// A point per stretch, oldest first.
struct Course {
    points: [Point; STRETCHES],
    count: usize,
    /// What flow has added since the beginning.
    added: [f32; 2],
    gyro_bias: [f32; 2],
}

/// A course that was fitted: quarter-turned shift, rad/s, acceleration of a tilt that was there before, m/s², since when, s, and
/// what it leaves, m²/s².
struct Fit {
    shift: [f32; 2],
    slope: [f32; 2],
    since: f32,
    left: f32,
}

impl Record {
    /// Takes a reading: flow's velocity, the change of velocity that was felt over `dt` seconds, and the distance.
    pub(super) fn reading(&mut self, flow: [f32; 2], change: [f32; 2], dt: f32, distance: f32) {
        if self.filled == 0 || self.stretches[self.newest % STRETCHES].elapsed >= STRETCH {
            self.newest = (self.newest + 1) % STRETCHES;
            self.filled = (self.filled + 1).min(STRETCHES);
            self.stretches[self.newest % STRETCHES] = Stretch::default();
        }
        let stretch = &mut self.stretches[self.newest % STRETCHES];
        stretch.elapsed += dt;
        stretch.readings += 1.0;
        stretch.distance += distance;
        for axis in 0..2 {
            stretch.flow[axis] += flow[axis];
            stretch.change[axis] += change[axis];
        }
    }

    /// Flow changed the predicted acceleration and the gyro's bias by this much.
    pub(super) fn corrected(&mut self, acceleration: [f32; 2], gyro_bias: [f32; 2]) {
        let stretch = &mut self.stretches[self.newest % STRETCHES];
        for axis in 0..2 {
            stretch.added[axis] += acceleration[axis];
            stretch.gyro_bias[axis] += gyro_bias[axis];
        }
    }

    /// The shift that explains the record, if one does.
    pub(super) fn shift(&self) -> Option<GyroShift> {
        let course = self.course();
        let points = course.points.get(..course.count)?;
        let size = scatter(points, points.len(), |point| point.apart);
        // Nothing is fitted to what is small.
        if size < LARGE {
            return None;
        }
        let best = best_shift(points, 0)?;
        let [x, y] = best.shift;
        if best.left > LEFT * size || x * x + y * y > LARGEST * LARGEST {
            return None;
        }
        let lie = best_lie(points);
        if lie < LIE_LEFT * size && (best.left > WELL * size || lie < BETTER * best.left) {
            return None;
        }
        let since = points.last()?.time - best.since;
        let apart: [f32; 2] =
            core::array::from_fn(|axis| best.slope[axis] + GRAVITY * best.shift[axis] * since - course.added[axis]);
        Some(GyroShift {
            bias: [-y - course.gyro_bias[0], x - course.gyro_bias[1]],
            tilt: [apart[1] / GRAVITY, -apart[0] / GRAVITY],
        })
    }

    /// Does a lie of flow's explain the record since the vehicle stood, and better than a shift does?
    pub(super) fn shows_a_lie(&self) -> bool {
        let course = self.course();
        let points = course.points.get(..course.count).unwrap_or(&[]);
        let Some(shift) = best_shift(points, 1).filter(|_| points.len() >= LONG_ENOUGH) else { return false };
        let size = scatter(points, points.len(), |point| point.apart);
        let honest = shift.left.min(tilted(points));
        honest > MUCH_LEFT * size && best_lie(points).min(offset(points)) < LESS * honest
    }

    fn course(&self) -> Course {
        let mut course =
            Course { points: [Point::default(); STRETCHES], count: self.filled, added: [0.0; 2], gyro_bias: [0.0; 2] };
        let (mut inertial, mut time) = ([0.0; 2], 0.0);
        for (n, point) in course.points.iter_mut().take(self.filled).enumerate() {
            let stretch = &self.stretches[(self.newest + STRETCHES + 1 + n - self.filled) % STRETCHES];
            // A bias is subtracted from the rate, so it turns the tilt the opposite way.
            let [x, y] = course.gyro_bias;
            let turned = [GRAVITY * y * stretch.elapsed, -GRAVITY * x * stretch.elapsed];
            let share = 1.0 / stretch.readings.max(1.0);
            for axis in 0..2 {
                let grown = stretch.added[axis] + turned[axis];
                let change = stretch.change[axis] - (course.added[axis] + 0.5 * grown) * stretch.elapsed;
                point.flow[axis] = stretch.flow[axis] * share;
                point.apart[axis] = point.flow[axis] - inertial[axis] - 0.5 * change;
                inertial[axis] += change;
                course.added[axis] += grown;
                course.gyro_bias[axis] += stretch.gyro_bias[axis];
            }
            point.time = time + 0.5 * stretch.elapsed;
            point.distance = stretch.distance * share;
            time += stretch.elapsed;
        }
        course
    }
}

fn mean(points: &[Point], value: impl Fn(&Point) -> [f32; 2]) -> [f32; 2] {
    let mut sum = [0.0; 2];
    for point in points {
        let [x, y] = value(point);
        sum = [sum[0] + x, sum[1] + y];
    }
    sum.map(|sum| sum / points.len().max(1) as f32)
}

/// Sum of squares about the mean, over so many points.
fn scatter(points: &[Point], count: usize, value: impl Fn(&Point) -> [f32; 2]) -> f32 {
    let middle = mean(points, &value);
    let mut squares = 0.0;
    for point in points {
        let [x, y] = value(point);
        squares += (x - middle[0]) * (x - middle[0]) + (y - middle[1]) * (y - middle[1]);
    }
    squares / count as f32
}

/// The shift that leaves the least, of those that began with point `first` or later. `None` for a record that is too short.
fn best_shift(points: &[Point], first: usize) -> Option<Fit> {
    let mut best: Option<Fit> = None;
    for onset in first..=points.len().checked_sub(SHORTEST)? {
        let found = fit(points, onset)?;
        if best.as_ref().is_none_or(|best| found.left < best.left) {
            best = Some(found);
        }
    }
    best
}

/// What the best of the lies leaves.
fn best_lie(points: &[Point]) -> f32 {
    let onsets = 0..=points.len().saturating_sub(SHORTEST);
    onsets.map(|onset| lie(points, onset)).fold(f32::MAX, f32::min)
}

/// What an offset of the picture's motion leaves, which is the larger a velocity the farther the floor is.
fn offset(points: &[Point]) -> f32 {
    let rate = slope(points, |point| point.distance);
    remains(points, rate, |point| point.distance)
}

/// What a tilt leaves that was wrong from the beginning.
fn tilted(points: &[Point]) -> f32 {
    let [x, y] = slope(points, |point| point.time);
    let share = WRONG_TILT / math::sqrt(x * x + y * y).max(WRONG_TILT);
    remains(points, [share * x, share * y], |point| point.time)
}

/// How much the difference grows with `along`, by least squares.
fn slope(points: &[Point], along: impl Fn(&Point) -> f32) -> [f32; 2] {
    let [middle, _] = mean(points, |point| [along(point), 0.0]);
    let apart = mean(points, |point| point.apart);
    let [power, _] = mean(points, |point| [(along(point) - middle) * (along(point) - middle), 0.0]);
    let product = |point: &Point, axis: usize| (along(point) - middle) * (point.apart[axis] - apart[axis]);
    mean(points, |point| [product(point, 0), product(point, 1)]).map(|product| product / power.max(f32::EPSILON))
}

/// What is left of the difference without what grows with `along` by `slope`.
fn remains(points: &[Point], slope: [f32; 2], along: impl Fn(&Point) -> f32) -> f32 {
    scatter(points, points.len(), |point| {
        let grown = slope.map(|slope| slope * along(point));
        [point.apart[0] - grown[0], point.apart[1] - grown[1]]
    })
}

/// What the best of the lies leaves, if it began with this point.
fn lie(points: &[Point], onset: usize) -> f32 {
    let (before, since) = points.split_at_checked(onset).unwrap_or((points, &[]));
    let left = |[north, east]: &[[f32; 2]; 2]| {
        scatter(since, points.len(), |&Point { flow, apart, .. }| {
            let [x, y] = [flow[0] - apart[0], flow[1] - apart[1]];
            [flow[0] - north[0] * x - north[1] * y, flow[1] - east[0] * x - east[1] * y]
        })
    };
    scatter(before, points.len(), |point| point.apart) + LIES.iter().map(left).fold(f32::MAX, f32::min)
}

/// Fits a shift that began with this point; with the first: there or before, with a tilt.
fn fit(points: &[Point], onset: usize) -> Option<Fit> {
    let since = points.get(onset)?.time;
    let before = onset == 0;
    let model = |point: &Point| {
        let age = point.time - since;
        if age > 0.0 || before { 0.5 * GRAVITY * age * age - point.distance } else { 0.0 }
    };
    let [middle, time] = mean(points, |point| [model(point), point.time]);
    let apart = mean(points, |point| point.apart);
    let line = |point: &Point| if before { point.time - time } else { 0.0 };
    let [along, lines] = mean(points, |point| [(model(point) - middle) * line(point), line(point) * line(point)]);
    // The share of the line in the model: what is left of it is at right angles to the line.
    let share = if before { along / lines } else { 0.0 };
    let across = |point: &Point| model(point) - middle - share * line(point);
    let [power, _] = mean(points, |point| [across(point) * across(point), 0.0]);
    if power < f32::EPSILON {
        return None;
    }
    let product = |point: &Point, axis: usize| across(point) * (point.apart[axis] - apart[axis]);
    let shift = mean(points, |point| [product(point, 0), product(point, 1)]).map(|product| product / power);
    let rest = |point: &Point| {
        let away = model(point) - middle;
        [point.apart[0] - apart[0] - shift[0] * away, point.apart[1] - apart[1] - shift[1] * away]
    };
    let slope = if before {
        mean(points, |point| rest(point).map(|rest| rest * line(point))).map(|product| product / lines)
    } else {
        [0.0; 2]
    };
    let [x, y] = mean(points, |point| {
        let ([x, y], line) = (rest(point), line(point));
        let [x, y] = [x - slope[0] * line, y - slope[1] * line];
        [x * x, y * y]
    });
    Some(Fit { shift, slope, since, left: x + y })
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f32 = 0.01;
    const DISTANCE: f32 = 0.5;

    /// A vehicle that climbs to half a metre within a second.
    fn climb(now: f32) -> f32 {
        (0.5 * now).min(DISTANCE)
    }

    /// Is flow seen to lie within two seconds from the ground on, on a vehicle that feels nothing?
    fn lies(flow: impl Fn(f32) -> f32) -> bool {
        let mut record = Record::default();
        (1..=190u16).map(|n| f32::from(n) * DT).any(|now| {
            record.reading([flow(now), 0.0], [0.0; 2], DT, climb(now));
            record.shows_a_lie()
        })
    }

    #[test]
    fn an_offset_from_the_take_off_on_is_told_from_a_shift_of_the_gyro() {
        for rate in [1.0, -2.0] {
            assert!(lies(|now| rate * climb(now)), "{rate} rad/s");
        }
        for bias in [0.1, 0.3, -0.6] {
            for since in [0.0, 0.3, 0.8] {
                let shifted = |now: f32| {
                    let age = (now - since).max(0.0);
                    bias * (0.5 * GRAVITY * age * age - if age > 0.0 { climb(now) } else { 0.0 })
                };
                assert!(!lies(shifted), "{bias} rad/s since {since} s");
            }
        }
        assert!(!lies(|_| 0.0));
    }

    #[test]
    fn a_tilt_that_was_wrong_on_the_ground_is_no_lie() {
        for acceleration in [0.12, -0.25] {
            assert!(!lies(|now| acceleration * now), "{acceleration} m/s²");
        }
        assert!(lies(|now| 0.8 * now.min(1.0)), "no tilt of the ground is as large");
    }

    #[test]
    fn reversed_axes_of_a_vehicle_that_circles_faster_and_faster_are_told_from_a_shift() {
        let circles =
            |now: f32| [math::cos(4.0 * now), math::sin(4.0 * now)].map(|part| part * 0.05 * math::exp(2.0 * now));
        let reversed = |seconds| record(seconds, |now| circles(now).map(|part| -part), circles, |_| ()).shows_a_lie();
        assert!(reversed(1.4) && !reversed(1.0), "once it is long enough");
    }

    /// A record of so many seconds. `flow` and `inertial` are velocities north and east, m/s, as functions of time.
    fn record(
        seconds: f32,
        flow: impl Fn(f32) -> [f32; 2],
        inertial: impl Fn(f32) -> [f32; 2],
        mut each: impl FnMut(&mut Record),
    ) -> Record {
        let mut record = Record::default();
        for n in 1..=(seconds / DT) as u16 {
            let [now, before] = [f32::from(n) * DT, f32::from(n - 1) * DT];
            let [[x, y], [x0, y0]] = [inertial(now), inertial(before)];
            record.reading(flow(now), [x - x0, y - y0], DT, DISTANCE);
            each(&mut record);
        }
        record
    }

    /// Flow's velocity of a vehicle that hovers by the estimate, whose roll rate is too high by this since then.
    fn shifted(bias: f32, since: f32) -> impl Fn(f32) -> [f32; 2] {
        move |now| {
            let age = now - since;
            [0.0, if age > 0.0 { -bias * (0.5 * GRAVITY * age * age - DISTANCE) } else { 0.0 }]
        }
    }

    /// What a lie makes of a velocity.
    type Lie = fn([f32; 2]) -> [f32; 2];

    const STILL: fn(f32) -> [f32; 2] = |_| [0.0; 2];

    #[test]
    fn a_shift_is_found_with_its_size_and_the_tilt_that_it_has_made() {
        for bias in [0.15, 0.3, -0.45, 0.8] {
            let shift = record(1.9, shifted(bias, 0.3), STILL, |_| ()).shift().expect("found");
            assert!((shift.bias[0] - bias).abs() < 0.1 * bias.abs() + 0.01 && shift.bias[1].abs() < 0.01, "{shift:?}");
            // It has turned the estimate to positive roll for 1.6 s.
            assert!((shift.tilt[0] + 1.6 * bias).abs() < 0.15 * bias.abs() && shift.tilt[1].abs() < 0.01, "{shift:?}");
        }
    }

    #[test]
    fn what_flow_has_put_right_already_is_not_put_right_again() {
        let bias = 0.3;
        // Flow takes a third of the shift out of the bias, at once.
        let mut first = true;
        let taken = |record: &mut Record| {
            record.corrected([0.0; 2], if core::mem::take(&mut first) { [0.1, 0.0] } else { [0.0; 2] });
        };
        let inertial = |now: f32| [0.0, -0.5 * GRAVITY * 0.1 * now * now];
        let shift = record(1.5, shifted(bias, 0.0), inertial, taken).shift().expect("found");
        assert!((shift.bias[0] - 0.2).abs() < 0.03, "{shift:?}");
        assert!((shift.tilt[0] + 0.2 * 1.5).abs() < 0.06, "{shift:?}");
    }

    #[test]
    fn lies_of_flow_and_honest_readings_are_no_shift() {
        let grows = |now: f32| 0.05 * math::exp(3.0 * now);
        let lies: [(&str, f32, Lie); 4] = [
            ("reversed", 1.0, |[x, y]| [-x, -y]),
            ("swapped", 1.0, |[x, y]| [y, x]),
            ("stuck", 0.5, |_| [0.0; 2]),
            ("honest", 1.0, |true_one| true_one),
        ];
        for (name, speed, lie) in lies {
            let moves = |now: f32| [0.5 * speed * grows(now), -speed * grows(now)];
            assert_eq!(record(1.2, |now| lie(moves(now)), moves, |_| ()).shift(), None, "{name}");
        }
        // An offset is there at once, and does not grow.
        assert_eq!(record(1.5, |now| [if now > 0.7 { 1.0 } else { 0.0 }, 0.0], STILL, |_| ()).shift(), None);
    }
}
