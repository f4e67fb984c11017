//! What is printed about an estimate.

use super::Receiver;
use super::accuracy::Accuracy;
use super::dead_reckoning::{Reach, path, reach};
use super::drive::{Drive, Instance};
use super::receiver::AgainstReceiver;
use super::start::Start;
use crate::dataset::{Kind, Recording, TruthPoint};
use serde::Serialize;
use stampfly_types::messages::{StateEstimate, Validity};
use stampfly_types::{Duration, Instant};
use std::collections::BTreeMap;

/// Farther than this from the reference, horizontally, an estimate is lost, m.
const LOST: f64 = 2.0;
/// An estimate older than this is not compared with the truth.
const STALE: Duration = Duration::from_millis(50);
/// NanoBench counts flight, not the floor: above this height, m, and after this time.
const NANOBENCH_HEIGHT: f32 = 0.3;
const NANOBENCH_SETTLED: Duration = Duration::from_secs(3);

/// How good an estimate is. `None` where the recording has nothing to tell by.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Kind of the recording.
    pub kind: &'static str,
    /// First to last inertial sample.
    pub duration_s: f64,
    /// Did the estimator give up, say something that is no number, or go more than two metres astray?
    pub diverged: bool,
    /// Horizontal distance from the start in the end.
    pub end_xy_m: Option<f64>,
    /// Largest horizontal distance from the start.
    pub max_xy_m: Option<f64>,
    /// The same two by flow alone: see [`path`](super::path).
    pub flow_dead_reckoning_max_xy_m: Option<f64>,
    /// In the end.
    pub flow_dead_reckoning_end_xy_m: Option<f64>,
    /// Error of the vertical.
    pub tilt_rmse_deg: Option<f64>,
    /// The same with one constant rotation of the body removed.
    pub tilt_rmse_aligned_deg: Option<f64>,
    /// Error of the vertical that the recording's own device believed at the time, over the same instants.
    pub device_tilt_rmse_deg: Option<f64>,
    /// Error about the vertical.
    pub heading_rmse_deg: Option<f64>,
    /// Error of the attitude.
    pub total_rmse_deg: Option<f64>,
    /// Error of the position, where a position is measured against a reference.
    pub position_rmse_m: Option<f64>,
    /// Error of the velocity.
    pub velocity_rmse_mps: Option<f64>,
    /// Beside a satellite receiver, where there is one.
    pub receiver: Option<AgainstReceiver>,
    /// Stretches in which the reference was not seen. They are not compared.
    pub truth_gaps: usize,
    /// Inertial samples that were left out because the recording's clock had gone back before them.
    pub clock_back: usize,
    /// Instants that were compared with the reference.
    pub truth_samples: usize,
    /// Share of a sensor's samples that disagreed with the estimate and were left out.
    pub rejected: BTreeMap<&'static str, f64>,
    /// Share of a sensor's samples that were not looked at: not valid, out of range, not needed.
    pub unused: BTreeMap<&'static str, f64>,
    /// How often the estimate was moved to a sensor it had been at odds with for too long.
    pub resets: u32,
    /// Was the vehicle at rest at the start, so that the gyro's bias was known?
    pub started_still: bool,
    /// Calls of the estimator a second of wall time.
    pub updates_per_s: f64,
}

/// A kind's name in files that programs read.
fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::StampFlyLog => "stampfly_log",
        Kind::StampFlyFlight => "stampfly_flight",
        Kind::NanoBench => "nanobench",
        Kind::Broad => "broad",
        Kind::Px4Replay => "px4_replay",
    }
}

impl Figures {
    /// The figures of one way through a recording.
    #[must_use]
    pub fn of(recording: &Recording, start: &Start, drive: &Drive, receiver: &Receiver) -> Self {
        let accuracy = accuracy(recording, start, drive);
        let reckoned = path(recording, start);
        let by_flow = reach(&reckoned);
        let places = drive.instances.iter().any(|now| now.state.valid.contains(Validity::POSITION_XY));
        let travelled = places.then(|| travelled(&drive.instances));
        let astray =
            accuracy.position_max().or_else(|| apart(&drive.instances, &reckoned).filter(|_| drive.holds_position));
        let finite = drive.instances.iter().all(|now| is_finite(&now.state));
        let lost = drive.instances.iter().any(|now| now.status.diverged);
        let share = |count: fn(&super::Tally) -> usize| {
            let offered = drive.tallies.iter().filter(|(_, tally)| tally.offered > 0);
            offered.map(|(sensor, tally)| (*sensor, count(tally) as f64 / tally.offered as f64)).collect()
        };
        Self {
            kind: kind_name(recording.kind),
            duration_s: recording.duration().seconds_f64(),
            diverged: lost || !finite || astray.is_some_and(|astray| astray.is_nan() || astray > LOST),
            end_xy_m: travelled.map(|reach| reach.end_xy_m),
            max_xy_m: travelled.map(|reach| reach.max_xy_m),
            flow_dead_reckoning_max_xy_m: by_flow.map(|reach| reach.max_xy_m),
            flow_dead_reckoning_end_xy_m: by_flow.map(|reach| reach.end_xy_m),
            tilt_rmse_deg: accuracy.tilt(),
            tilt_rmse_aligned_deg: accuracy.tilt_aligned(),
            device_tilt_rmse_deg: device(recording).tilt(),
            heading_rmse_deg: accuracy.heading(),
            total_rmse_deg: accuracy.total(),
            position_rmse_m: accuracy.position_rms(),
            velocity_rmse_mps: accuracy.velocity_rms(),
            receiver: AgainstReceiver::of(recording, start, drive, receiver),
            truth_gaps: recording.truth_gaps,
            clock_back: recording.timing.backwards,
            truth_samples: accuracy.samples(),
            rejected: share(|tally| tally.gated),
            unused: share(|tally| tally.refused),
            resets: drive.instances.last().map_or(0, |last| last.status.resets),
            started_still: start.calibration.complete,
            updates_per_s: drive.updates_per_s,
        }
    }
}

/// The newest estimate at or before an instant.
fn newest(instances: &[Instance], at: Instant) -> Option<&Instance> {
    let index = instances.partition_point(|instance| instance.at <= at).checked_sub(1)?;
    instances.get(index).filter(|instance| at.since(instance.at) < STALE)
}

/// Does the data set's own metric count this instant?
fn counts(kind: Kind, start: Instant, point: &TruthPoint) -> bool {
    let flying = point.position.is_some_and(|place| -place.z > NANOBENCH_HEIGHT);
    point.counts && (kind != Kind::NanoBench || (flying && point.at.since(start) >= NANOBENCH_SETTLED))
}

fn accuracy(recording: &Recording, start: &Start, drive: &Drive) -> Accuracy {
    let first = recording.imu.first().map_or(start.at, |sample| sample.at);
    let origin = super::origin(recording, start);
    let mut accuracy = Accuracy::default();
    for point in recording.truth.iter().filter(|point| counts(recording.kind, first, point)) {
        let Some(Instance { state, .. }) = newest(&drive.instances, point.at) else { continue };
        if let Some(attitude) = point.attitude {
            accuracy.attitude(&state.attitude, &attitude);
        }
        // Without velocities a position is a guess that nobody makes.
        if let (Some(position), Some(velocity), true) = (point.position, point.velocity, drive.holds_position) {
            accuracy.position(&(state.position + origin), &position);
            accuracy.velocity(&state.velocity, &velocity);
        }
    }
    accuracy
}

/// How good the device's own attitude was, where the data set's metric counts.
fn device(recording: &Recording) -> Accuracy {
    let first = recording.imu.first().map_or(Instant::ZERO, |sample| sample.at);
    let own = recording.device.as_deref().unwrap_or_default();
    let mut accuracy = Accuracy::default();
    for point in recording.truth.iter().filter(|point| counts(recording.kind, first, point)) {
        let index = own.partition_point(|device| device.at <= point.at).checked_sub(1);
        let newest = index.and_then(|index| own.get(index)).filter(|device| point.at.since(device.at) < STALE);
        if let (Some(newest), Some(attitude)) = (newest, point.attitude) {
            accuracy.attitude(&newest.attitude, &attitude);
        }
    }
    accuracy
}

fn travelled(instances: &[Instance]) -> Reach {
    let mut reach = Reach::default();
    instances.iter().for_each(|now| reach.add(now.state.position.x, now.state.position.y));
    reach
}

/// Largest horizontal distance between the estimate and the way by flow alone.
fn apart(instances: &[Instance], reckoned: &[(Instant, [f32; 2])]) -> Option<f64> {
    let mut reach = Reach::default();
    for (at, [north, east]) in reckoned {
        let Some(now) = newest(instances, *at) else { continue };
        reach.add(now.state.position.x - north, now.state.position.y - east);
    }
    (!reckoned.is_empty()).then_some(reach.max_xy_m)
}

fn is_finite(state: &StateEstimate) -> bool {
    let StateEstimate { attitude, position, velocity, height, .. } = state;
    let rest = position.iter().chain(velocity.iter()).chain([height]);
    attitude.wxyz().iter().chain(rest).all(|value| value.is_finite())
}
