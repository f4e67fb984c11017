//! Evidence along the vertical: ranges, and how the estimate follows them.

use crate::altimeter::{Altimeter, AltitudeReading};
use stampfly_types::messages::{BaroData, EstimatorStatus, ImuData, StateEstimate, TofData};
use stampfly_types::{Duration, GRAVITY, Instant, Stamped, Vec3, frame, math};

/// Index of the range finder in the counters of the estimator's status.
const RANGE: usize = 0;
/// Length of an integration block of the upward acceleration, s.
const BLOCK: f32 = 9e-3;
/// Upper bound on the interval between samples, s.
const LONGEST_STEP: f32 = 0.05;
/// Time without an altitude after which the barometer is not used, s: a dozen readings.
const NO_ALTITUDE: f32 = 0.5;
/// Upper bound on the interval between ranges, s.
const LONGEST: f32 = 0.2;
/// Time after which a missing range no longer holds height and climb rate, s: six readings.
const SILENT: f32 = 0.2;
/// Smallest change from the last range that counts as a jump, m.
const JUMP: f32 = 0.15;
/// Smallest change from the last range and from the expected one that counts as a leap, m: possibly
/// an outlier.
const LEAP: f32 = 0.05;
/// Number of standard deviations of the climb rate that are allowed to move the range in addition.
const SIGMAS: f32 = 3.0;
/// Smallest change of the height that counts as a reset, m. At 4 m/s the vehicle falls by as much
/// in a step of 2.5 ms.
const MOVED: f32 = 0.01;
/// Time for which rejected ranges and resets are remembered.
const REMEMBERED: Duration = Duration::from_secs(3);

/// Repetitions of a range, whether the estimator compares it or not; it does not compare a
/// reflection from the sensor's window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeRepeat {
    /// Number of preceding readings with the same value.
    pub count: u32,
    /// It is far from the last one.
    pub jumps: bool,
}

/// A range that the estimator has compared in this step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeReading {
    /// Along the beam, m.
    pub distance: f32,
    /// Range predicted by the estimate, m.
    pub expected: f32,
    /// Time since the last one, s.
    pub dt: f32,
    /// The change from the last one exceeds `JUMP` and the motion of the vehicle.
    pub jumps: bool,
    /// The change exceeds `LEAP`, and so does the difference from the expected range.
    pub leaps: bool,
    /// The estimator has rejected it.
    pub rejected: bool,
}

/// A block of inertial samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Length, s.
    pub dt: f32,
    /// Change of the upward velocity, bias included, m/s.
    pub change: f32,
}

/// State of the vertical evidence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Vertical {
    pub(crate) altimeter: Altimeter,
    last: Option<Instant>,
    elapsed: f32,
    force: Vec3,
    /// Height and altitude of the last estimate, m.
    before: Option<[f32; 2]>,
    /// The estimator's counters of ranges compared and rejected, and of resets.
    tested: u32,
    refused: u32,
    resets: u32,
    /// The estimator has reset its state to the range in this step.
    reset: bool,
    /// The last range, m.
    newest: f32,
    /// The last compared range and its prediction, m.
    distance: f32,
    expected: f32,
    range_at: Option<Instant>,
    repeats: u32,
    /// Time of the last rejection.
    rejected: Option<Instant>,
    /// Recent upward displacement of the estimate by resets, m, and number of resets of height or
    /// surface.
    pub(crate) moved: f32,
    pub(crate) moves: u32,
    baro_at: Option<Instant>,
}

impl Vertical {
    pub(crate) fn airborne() -> Self {
        Self { altimeter: Altimeter::airborne(), ..Self::default() }
    }

    /// Whether the vehicle has a range finder.
    pub(crate) fn has_range(&self) -> bool {
        self.range_at.is_some()
    }

    /// Clears what is remembered of the range, after a finding or its end.
    pub(crate) fn forget(&mut self) {
        (self.moved, self.moves, self.rejected) = (0.0, 0, None);
    }

    /// Continues from a corrected estimate, which is `down` metres lower than before.
    pub(crate) fn see(&mut self, corrected: &StateEstimate, down: f32) {
        self.before = Some([corrected.height - down, -corrected.position.z - down]);
        self.altimeter.climb = -corrected.velocity.z;
    }

    /// Processes the inertial samples of a step.
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
            // The accelerometer alone drifts.
            self.altimeter.restart(-estimate.accel_bias.z);
            self.baro_at = None;
        }
        if stands {
            self.altimeter.stand(-estimate.accel_bias.z);
            return None;
        }
        // The estimate is usable only while ranges are accepted and not frozen.
        let believed = (self.rejected.is_none() && trusts_range && self.repeats < 6)
            .then_some([-estimate.velocity.z, -estimate.accel_bias.z]);
        self.altimeter.predict(dt, up, believed);
        Some(Block { dt, change: up })
    }

    /// Detects a reset of the estimate's height, or of the surface below it, to the range.
    fn see_moves(&mut self, estimate: &StateEstimate, stands: bool) {
        let now = [estimate.height, -estimate.position.z];
        let reset = core::mem::take(&mut self.reset) && !stands;
        let Some(before) = self.before.replace(now).filter(|_| reset) else { return };
        let [surface, moved] =
            [now[0] - before[0], now[1] - before[1]].map(|change| if change.abs() > MOVED { change } else { 0.0 });
        self.moved += moved;
        self.moves += u32::from(surface != 0.0 || moved != 0.0);
    }

    /// Processes the newest range of a step.
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
        // The vehicle's own motion is no jump: it may fall at 5 m/s, or change its lean between two
        // readings. The same holds for motion during a silence.
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

    /// Processes the newest altitude of a step.
    pub(crate) fn altitude(&mut self, baro: Option<&Stamped<BaroData>>, stands: bool) -> Option<AltitudeReading> {
        let Stamped { at, data, .. } = baro.filter(|baro| baro.data.altitude.is_finite())?;
        let last = self.baro_at.replace(*at).unwrap_or(*at);
        Some(self.altimeter.baro(data.altitude, at.since(last).seconds(), stands))
    }
}
