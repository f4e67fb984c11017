//! What is seen along the vertical: ranges, and how the estimate moves with them.

use crate::altimeter::{Altimeter, AltitudeReading};
use stampfly_types::messages::{BaroData, EstimatorStatus, ImuData, StateEstimate, TofData};
use stampfly_types::{Duration, GRAVITY, Instant, Stamped, Vec3, frame, math};

/// Position of the range finder in the counters of an estimator's status.
const RANGE: usize = 0;
/// The upward acceleration is integrated in blocks of this length, s.
const BLOCK: f32 = 9e-3;
/// A gap in the samples counts as this long at most, s.
const LONGEST_STEP: f32 = 0.05;
/// Without an altitude for so long nothing is compared with the barometer, s: a dozen readings.
const NO_ALTITUDE: f32 = 0.5;
/// Two ranges are at most so far apart, s.
const LONGEST: f32 = 0.2;
/// A range that has not been used for so long holds neither height nor climb rate, s: six readings.
const SILENT: f32 = 0.2;
/// A range so far from its predecessor jumps, m.
const JUMP: f32 = 0.15;
/// One so far from its predecessor and from what is expected leaps, m: an outlier at first.
const LEAP: f32 = 0.05;
/// What the climb rate may be wrong by, in standard deviations, moves the range as well.
const SIGMAS: f32 = 3.0;
/// A reset that changes the height by less, m, has not moved the estimate: it falls by as much in a
/// step of 2.5 ms at 4 m/s.
const MOVED: f32 = 0.01;
/// Rejected ranges, and heights that were moved, count for this long.
const REMEMBERED: Duration = Duration::from_secs(3);

/// A range that came in a step, whether the estimator compares it or not, as it does not with a window
/// that reports itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeRepeat {
    /// Number of readings before it that had the same value.
    pub count: u32,
    /// It is far from the one before.
    pub jumps: bool,
}

/// A range that the estimator has compared in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeReading {
    /// Along the beam, m.
    pub distance: f32,
    /// What the estimate makes it, m.
    pub expected: f32,
    /// Time since the one before, s.
    pub dt: f32,
    /// It is far from the one before, by more than the vehicle has moved.
    pub jumps: bool,
    /// It is nearer to that, and just as far from what is expected.
    pub leaps: bool,
    /// The estimator has rejected it.
    pub rejected: bool,
}

/// A block of inertial samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Its length, s.
    pub dt: f32,
    /// By how much the upward velocity changed in it, no bias removed, m/s.
    pub change: f32,
}

/// What is remembered along the vertical.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Vertical {
    pub(crate) altimeter: Altimeter,
    last: Option<Instant>,
    elapsed: f32,
    force: Vec3,
    /// Height and depth of the estimate a step ago, m.
    before: Option<[f32; 2]>,
    /// Ranges that the estimator has looked at, and rejected, and how often it has reset its state.
    tested: u32,
    refused: u32,
    resets: u32,
    /// It has reset its state to the range in this step.
    reset: bool,
    /// The last range, m.
    newest: f32,
    /// The last one that was compared, and what was expected of it, m.
    distance: f32,
    expected: f32,
    range_at: Option<Instant>,
    repeats: u32,
    /// When the estimator rejected one last.
    rejected: Option<Instant>,
    /// How far the height was moved lately, upwards, m, and how often height or surface were.
    pub(crate) moved: f32,
    pub(crate) moves: u32,
    baro_at: Option<Instant>,
}

impl Vertical {
    pub(crate) fn airborne() -> Self {
        Self { altimeter: Altimeter::airborne(), ..Self::default() }
    }

    /// Is there a range finder at all?
    pub(crate) fn has_range(&self) -> bool {
        self.range_at.is_some()
    }

    /// A range was found to be wrong, or is used again: what was remembered of it is over.
    pub(crate) fn forget(&mut self) {
        (self.moved, self.moves, self.rejected) = (0.0, 0, None);
    }

    /// The estimate has been put right, and is `down` lower than it was, m.
    pub(crate) fn see(&mut self, corrected: &StateEstimate, down: f32) {
        self.before = Some([corrected.height - down, -corrected.position.z - down]);
        self.altimeter.climb = -corrected.velocity.z;
    }

    /// Takes the inertial samples of a step.
    pub(crate) fn inertial(
        &mut self,
        now: Instant,
        samples: &[Stamped<ImuData>],
        estimate: &StateEstimate,
        stands: bool,
        trusts_range: bool,
    ) -> Option<Block> {
        for Stamped { at, data, .. } in samples {
            let last = self.last.replace(*at).unwrap_or(*at);
            if data.accel.norm_squared().is_finite() {
                let dt = math::smaller(at.since(last).seconds(), LONGEST_STEP);
                self.elapsed += dt;
                self.force += data.accel * dt;
            }
        }
        self.see_moves(estimate, stands);
        if self.rejected.is_some_and(|at| now.since(at) > REMEMBERED) {
            self.forget();
        }
        if self.elapsed < BLOCK {
            return None;
        }
        let (dt, force) = (core::mem::take(&mut self.elapsed), core::mem::take(&mut self.force));
        let up = -estimate.attitude.transform_vector(&force).z - GRAVITY * dt;
        if self.baro_at.is_some_and(|at| now.since(at).seconds() > NO_ALTITUDE) {
            // The accelerometer alone drifts away.
            self.altimeter.restart(-estimate.accel_bias.z);
            self.baro_at = None;
        }
        if stands {
            self.altimeter.stand(-estimate.accel_bias.z);
            return None;
        }
        let believed = (self.rejected.is_none() && trusts_range && self.repeats < 6)
            .then_some([-estimate.velocity.z, -estimate.accel_bias.z]);
        self.altimeter.predict(dt, up, believed);
        Some(Block { dt, change: up })
    }

    /// Has the estimate's height, or that of the surface below it, been reset to the range?
    fn see_moves(&mut self, estimate: &StateEstimate, stands: bool) {
        let now = [estimate.height, -estimate.position.z];
        let reset = core::mem::take(&mut self.reset) && !stands;
        let Some(before) = self.before.replace(now).filter(|_| reset) else { return };
        let [surface, moved] =
            [now[0] - before[0], now[1] - before[1]].map(|change| if change.abs() > MOVED { change } else { 0.0 });
        self.moved += moved;
        self.moves += u32::from(surface != 0.0 || moved != 0.0);
    }

    /// Takes the newest range, if there is one in this step.
    pub(crate) fn range(
        &mut self,
        at: Instant,
        tof: Option<&TofData>,
        estimate: &StateEstimate,
        status: &EstimatorStatus,
    ) -> (Option<RangeRepeat>, Option<RangeReading>) {
        let tested = core::mem::replace(&mut self.tested, status.tested[RANGE]);
        let refused = core::mem::replace(&mut self.refused, status.refused[RANGE]);
        let resets = core::mem::replace(&mut self.resets, status.resets);
        let Some(&TofData { distance, .. }) = tof.filter(|tof| tof.valid && tof.distance.is_finite()) else {
            return (None, None);
        };
        let newest = core::mem::replace(&mut self.newest, distance);
        self.repeats = if distance.to_bits() == newest.to_bits() { self.repeats.saturating_add(1) } else { 0 };
        let count = self.repeats;
        if tested == status.tested[RANGE] {
            return (Some(RangeRepeat { count, jumps: (distance - newest).abs() > JUMP }), None);
        }
        let expected = estimate.height / frame::cos_tilt(&estimate.attitude);
        self.reset = resets != status.resets;
        let silence = self.range_at.map(|last| at.since(last).seconds());
        self.range_at = Some(at);
        // What the vehicle itself moves by is no jump: it falls at 5 m/s, and leans to the other side
        // within two readings. Nor is what it did while there was none.
        let moved = expected - self.expected;
        let change = math::smaller((distance - self.distance).abs(), (distance - self.distance - moved).abs());
        let follows = silence.is_some_and(|silence| silence < SILENT);
        let free = SIGMAS * status.climb_sigma * silence.unwrap_or(0.0);
        let jumps = follows && change > JUMP + free;
        let leaps = follows && change > LEAP + free && (distance - expected).abs() > LEAP;
        (self.distance, self.expected) = (distance, expected);
        let rejected = refused != status.refused[RANGE];
        if rejected {
            self.rejected = Some(at);
        }
        let dt = math::smaller(silence.unwrap_or(0.0), LONGEST);
        let reading = RangeReading { distance, expected, dt, jumps, leaps, rejected };
        (Some(RangeRepeat { count, jumps }), Some(reading))
    }

    /// Takes the newest altitude.
    pub(crate) fn altitude(&mut self, baro: Option<&Stamped<BaroData>>, stands: bool) -> Option<AltitudeReading> {
        let Stamped { at, data, .. } = baro.filter(|baro| baro.data.altitude.is_finite())?;
        let last = self.baro_at.replace(*at).unwrap_or(*at);
        Some(self.altimeter.baro(data.altitude, at.since(last).seconds(), stands))
    }
}
