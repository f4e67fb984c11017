//! Where flow alone says a vehicle went: the plainest use of flow, range and gyro, to compare a filter with.
//!
//! Flow freed of the body's rotation, times the height, is the velocity over ground along the body's axes:
//! v_x = (flow_x / T − q)·h, v_y = (flow_y / T + p)·h, with h the range times the cosine of the tilt. Turned by the
//! heading and summed up, they are a path. Heading and tilt come from gyro and gravity. Nothing is weighed against
//! anything, so every error of the flow is in it, and none of a filter's.

use super::start::Start;
use crate::dataset::Recording;
use serde::Serialize;
use stampfly_eskf::{Complementary, ComplementaryConfig, Estimator};
use stampfly_types::{Instant, Vec3, frame, math};

/// A gap in the flow longer than this is not bridged.
const LONGEST_STEP: f32 = 0.1;

/// How far a path went from where it began, horizontally.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Reach {
    /// Farthest, m.
    pub max_xy_m: f64,
    /// In the end, m.
    pub end_xy_m: f64,
}

impl Reach {
    /// Takes the next point of the path, relative to its beginning.
    pub fn add(&mut self, north: f32, east: f32) {
        let away = f64::from(north).hypot(f64::from(east));
        self.end_xy_m = away;
        // A distance that is no number must show, and `max` would hide it.
        if away.is_nan() || self.max_xy_m < away {
            self.max_xy_m = away;
        }
    }
}

/// The path by flow alone: an instant, north and east in metres, per flow sample. Empty without flow or range.
#[must_use]
pub fn path(recording: &Recording, start: &Start) -> Vec<(Instant, [f32; 2])> {
    let mut attitude = Complementary::new(ComplementaryConfig::default());
    attitude.initialize(start.at, &start.calibration);
    let mut imu = recording.imu.iter().filter(|sample| sample.at >= start.at).peekable();
    let mut ranges = recording.tof.iter().filter(|sample| sample.data.valid).peekable();
    let (mut range, mut rates, mut count) = (None, Vec3::zeros(), 0.0f32);
    let (mut place, mut before) = ([0.0f32; 2], None::<Instant>);
    let mut path = Vec::new();
    for flow in recording.flow.iter().filter(|sample| sample.at >= start.at) {
        while let Some(sample) = imu.next_if(|sample| sample.at <= flow.at) {
            attitude.predict(sample.at, &sample.data);
            rates += sample.data.gyro - start.calibration.gyro_bias;
            count += 1.0;
        }
        while let Some(sample) = ranges.next_if(|sample| sample.at <= flow.at) {
            range = Some(sample.data.distance);
        }
        let step = before.map_or(0.0, |before| flow.at.since(before).seconds());
        let rate = rates / count.max(1.0);
        let usable = flow.data.valid && flow.data.interval > 0.0 && count > 0.0 && step <= LONGEST_STEP;
        (rates, count, before) = (Vec3::zeros(), 0.0, Some(flow.at));
        let Some(range) = range.filter(|_| usable) else { continue };
        let attitude = attitude.estimate().attitude;
        let height = range * math::cos(frame::tilt(&attitude)).max(0.0);
        let forward = (flow.data.delta_x / flow.data.interval - rate.y) * height;
        let right = (flow.data.delta_y / flow.data.interval + rate.x) * height;
        let (sin, cos) = math::sin_cos(frame::yaw(&attitude));
        place[0] += (forward * cos - right * sin) * step;
        place[1] += (forward * sin + right * cos) * step;
        path.push((flow.at, place));
    }
    path
}

/// How far flow alone says it went; `None` without flow or range.
#[must_use]
pub fn reach(path: &[(Instant, [f32; 2])]) -> Option<Reach> {
    let mut reach = Reach::default();
    path.iter().for_each(|(_, [north, east])| reach.add(*north, *east));
    (!path.is_empty()).then_some(reach)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset;

    /// A log of two seconds: this flow in counts, these rates, at this range.
    fn log(range: f64, row: impl Fn(usize) -> ([f64; 2], [f64; 3])) -> Recording {
        let mut text = "timestamp_ms,dt_ms,raw_accel_x,raw_accel_y,raw_accel_z,raw_gyro_x,raw_gyro_y,raw_gyro_z,\
            raw_baro_alt,raw_tof,raw_flow_squal,raw_flow_dx,raw_flow_dy,dev_pos_x,dev_pos_y,dev_pos_z,dev_vel_x,\
            dev_vel_y,dev_vel_z,dev_roll_deg,dev_pitch_deg,dev_yaw_deg\n"
            .to_owned();
        for n in 0..=200 {
            let ([dx, dy], [p, q, r]) = row(n);
            // Equal readings in a row would pass for one: let the quality change.
            let (wiggle, quality) = (1e-4 * (n % 3) as f64, 100 + n % 2);
            text += &format!(
                "{},10,{wiggle},0,-9.81,{p},{q},{r},0,{range},{quality},{dx},{dy}{}\n",
                n * 10,
                ",0".repeat(9)
            );
        }
        dataset::parse("made up", text.as_bytes()).expect("a log")
    }

    fn reach_of(log: &Recording) -> Reach {
        reach(&path(log, &Start::of(log))).expect("flow and range")
    }

    #[test]
    fn counts_times_height_is_way() {
        // From one second on, two counts in every sample: 2 · 0.00222 · 0.943 rad in 10 ms, half a metre up.
        let log = log(0.5, |n| (if n > 100 { [2.0, 0.0] } else { [0.0, 0.0] }, [0.0; 3]));
        let expected = 100.0 * 2.0 * 0.002_22 * 0.943 * 0.5;
        assert!((reach_of(&log).end_xy_m - expected).abs() < 1e-3, "{:?} for {expected}", reach_of(&log));
    }

    #[test]
    fn a_turn_on_the_spot_goes_nowhere() {
        // Pitching shows in the flow along x as it does in the gyro.
        let rate = |n: usize| if n > 100 { 0.4 * (0.1 * n as f64).sin() } else { 0.0 };
        let log = log(0.5, |n| ([rate(n) * 0.01 / (0.002_22 * 0.943), 0.0], [0.0, rate(n), 0.0]));
        assert!(reach_of(&log).max_xy_m < 2e-3, "{:?}", reach_of(&log));
    }

    #[test]
    fn there_and_back_is_back() {
        let log = log(0.3, |n| ([0.0, [0.0, 3.0, -3.0][if n <= 100 { 0 } else { 1 + (n - 101) / 50 }]], [0.0; 3]));
        let reach = reach_of(&log);
        assert!((reach.max_xy_m - 50.0 * 3.0 * 0.002_22 * 1.015 * 0.3).abs() < 1e-3, "{reach:?}");
        assert!(reach.end_xy_m < 1e-3, "{reach:?}");
    }

    #[test]
    fn what_is_no_number_is_not_hidden() {
        let mut reach = Reach::default();
        [1.0, f32::NAN, 2.0].iter().for_each(|north| reach.add(*north, 0.0));
        assert!(reach.max_xy_m.is_nan() && reach.end_xy_m == 2.0);
    }
}
