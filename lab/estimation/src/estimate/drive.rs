//! Takes an estimator through a recording, sample by sample, in the order a vehicle would have seen them.

use super::start::Start;
use super::{Method, Receiver, Suite};
use crate::dataset::Recording;
use stampfly_board::EstimatorKind;
use stampfly_drivers::Sample;
use stampfly_eskf::attitude::AttitudeFilter;
use stampfly_eskf::{Complementary, Eskf, Estimator, Fusion};
use stampfly_types::messages::{EstimatorStatus, StateEstimate};
use stampfly_types::{Duration, Instant, Quat, Vec3, frame};
use std::collections::BTreeMap;
use std::iter::Peekable;
use std::slice::Iter;

/// Velocities from motion capture are offered at most this often.
const VELOCITY_PERIOD: Duration = Duration::from_millis(20);
/// Their standard deviation, m/s.
const VELOCITY_SIGMA: f32 = 0.05;

/// What became of the samples of one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Samples offered to the estimator.
    pub offered: usize,
    /// Those that disagreed with the estimate and were left out.
    pub gated: usize,
    /// Those it did not look at: not valid, out of range, tilted too far, not needed.
    pub refused: usize,
    /// Those the estimate was moved to, after it had been at odds with the sensor for too long.
    pub resets: usize,
}

impl Tally {
    fn add(&mut self, fusion: Fusion) {
        self.offered += 1;
        match fusion {
            Fusion::Fused { .. } => {}
            Fusion::Gated { .. } => self.gated += 1,
            Fusion::Reset => self.resets += 1,
            Fusion::Refused(_) => self.refused += 1,
        }
    }

    /// Share of the samples that were left out because they disagreed.
    #[must_use]
    pub fn rejected(&self) -> Option<f64> {
        (self.offered > 0).then(|| self.gated as f64 / self.offered as f64)
    }
}

/// The estimate after one inertial sample and everything that came with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Stamp of the inertial sample.
    pub at: Instant,
    /// The state, in the recording's world: heading as in the reference, origin where the estimator started.
    pub state: StateEstimate,
    /// How the sensors fared so far.
    pub status: EstimatorStatus,
}

/// One way through a recording.
#[derive(Clone, Debug)]
pub struct Drive {
    /// One per inertial sample.
    pub instances: Vec<Instance>,
    /// Does this estimator hold a position? Otherwise its positions are nothing to compare.
    pub holds_position: bool,
    /// By sensor: `tof`, `flow`, `mag`, `baro`, `velocity` of the reference, `gnss position`, `gnss velocity`, `gravity`.
    pub tallies: BTreeMap<&'static str, Tally>,
    /// Calls of the estimator a second of wall time.
    pub updates_per_s: f64,
}

/// Samples of one sensor up to an instant.
fn up_to<M: Copy>(samples: &mut Peekable<Iter<'_, Sample<M>>>, at: Instant) -> impl Iterator<Item = (Instant, M)> {
    std::iter::from_fn(move || samples.next_if(|sample| sample.at <= at).map(|sample| (sample.at, sample.data)))
}

/// Velocities of a reference at an even pace, in the estimator's world.
fn velocities(recording: &Recording, start: &Start) -> Vec<Sample<Vec3>> {
    let back = frame::from_yaw(-start.heading);
    let mut velocities: Vec<Sample<Vec3>> = Vec::new();
    for point in recording.truth.iter().filter(|point| point.at >= start.at) {
        let due = velocities.last().is_none_or(|last| point.at.since(last.at) >= VELOCITY_PERIOD);
        if let Some(velocity) = point.velocity.filter(|_| due) {
            velocities.push(Sample { at: point.at, data: back * velocity });
        }
    }
    velocities
}

/// Runs the estimator of the suite over a recording.
#[must_use]
pub fn drive(recording: &Recording, start: &Start, suite: &Suite) -> Drive {
    match (suite.method, suite.vehicle.estimator) {
        (Method::Attitude, _) => {
            let drive = through(recording, start, suite, AttitudeFilter::new(suite.attitude));
            Drive { holds_position: false, ..drive }
        }
        (Method::Vehicle, EstimatorKind::Complementary) => {
            through(recording, start, suite, Complementary::new(suite.vehicle.complementary))
        }
        (Method::Vehicle, EstimatorKind::Eskf) => through(recording, start, suite, Eskf::new(suite.vehicle.eskf)),
    }
}

fn through(recording: &Recording, start: &Start, suite: &Suite, mut estimator: impl Estimator) -> Drive {
    let Receiver { delay, position_sigma, velocity_sigma } = suite.receiver;
    let velocities = velocities(recording, start);
    let mut tof = recording.tof.iter().peekable();
    let mut flow = recording.flow.iter().peekable();
    let mut mag = recording.mag.iter().peekable();
    let mut baro = recording.baro.iter().peekable();
    let mut gnss = recording.gnss.iter().peekable();
    let mut velocity = velocities.iter().peekable();
    let mut tallies: BTreeMap<&'static str, Tally> = BTreeMap::new();
    let mut tally = |sensor, fusion| tallies.entry(sensor).or_default().add(fusion);
    let mut instances = Vec::with_capacity(recording.imu.len());

    let begun = std::time::Instant::now();
    let mut updates = 0u64;
    estimator.initialize(start.at, &start.calibration);
    for sample in recording.imu.iter().filter(|sample| sample.at > start.at) {
        estimator.predict(sample.at, &sample.data);
        for (at, data) in up_to(&mut tof, sample.at) {
            tally("tof", estimator.fuse_tof(at, &data));
        }
        for (at, data) in up_to(&mut flow, sample.at) {
            tally("flow", estimator.fuse_flow(at, &data));
        }
        for (at, data) in up_to(&mut mag, sample.at) {
            tally("mag", estimator.fuse_mag(at, &data));
        }
        for (at, data) in up_to(&mut baro, sample.at) {
            tally("baro", estimator.fuse_baro(at, &data));
        }
        for (arrived, fix) in up_to(&mut gnss, sample.at) {
            let at = arrived - delay;
            tally("gnss position", estimator.fuse_position(at, &fix.position, &position_sigma));
            tally("gnss velocity", estimator.fuse_velocity(at, &fix.velocity, &velocity_sigma));
        }
        for (at, data) in up_to(&mut velocity, sample.at) {
            tally(
                "velocity",
                estimator.fuse_velocity(at, &data, &Vec3::new(VELOCITY_SIGMA, VELOCITY_SIGMA, VELOCITY_SIGMA)),
            );
        }
        updates += 1;
        instances.push(Instance { at: sample.at, state: estimator.estimate(), status: estimator.status() });
    }
    let wall = begun.elapsed().as_secs_f64();
    updates += tallies.values().map(|tally| tally.offered as u64).sum::<u64>();

    // The estimator looks at gravity by itself and counts for itself: last of its five counters.
    if let Some(EstimatorStatus { offered: [.., offered], refused: [.., refused], .. }) =
        instances.last().map(|last| last.status)
        && offered > 0
    {
        let tally = Tally { offered: offered as usize, gated: refused as usize, ..Tally::default() };
        tallies.insert("gravity", tally);
    }
    let heading = frame::from_yaw(start.heading);
    instances.iter_mut().for_each(|instance| turn(&mut instance.state, &heading));
    Drive {
        instances,
        holds_position: true,
        tallies,
        updates_per_s: if wall > 0.0 { updates as f64 / wall } else { 0.0 },
    }
}

/// From the estimator's world, which begins at heading zero, into the recording's.
fn turn(state: &mut StateEstimate, heading: &Quat) {
    state.attitude = heading * state.attitude;
    state.position = heading * state.position;
    state.velocity = heading * state.velocity;
}
