//! A second opinion about climb and height, which the range has no part in, and what follows when they disagree.
//!
//! An observer of height, climb rate and accelerometer bias integrates the vertical acceleration and follows the barometer
//! slowly. The filter's own climb rate hangs on the range, which is a hundred times more precise and may lie: dirt on the
//! glass reads 3 cm, a wrapped phase reads a quarter of a metre, a frozen register reads what was. A jump of the range
//! is no lie by itself, because a table is one; a climb that range and inertia see differently is.
//!
//! | the range is implausible when | |
//! |---|---|
//! | it was rejected in the last three seconds, and the climb rates differ by [`CLIMB`] for 0.3 s | stuck, aliased, random |
//! | it was rejected in the last three seconds, and the paths differ by [`HEIGHT`] over some seconds | ramp, scale |
//! | it repeats itself while the observer moves by [`MOVED`] | stuck |
//! | it jumps more than five times within about two seconds | outliers, alias, an edge below |
//!
//! Climb rates that differ though the range was never rejected speak against the barometer: the observer starts again.
//! The range is believed again after a second of readings that change, do not jump and lie within [`AGREES`] of where
//! the filter expects them.

use stampfly_types::{Duration, Instant};

/// Difference of the climb rates, m/s.
pub(super) const CLIMB: f32 = 0.7;
/// Difference of the paths, which fades with [`FADING`], m.
pub(super) const HEIGHT: f32 = 0.5;
const FADING: f32 = 2.5;
/// For how long the climb rates differ, s.
const LASTS: f32 = 0.3;
/// How far the observer moves while the range repeats itself, m.
const MOVED: f32 = 0.2;
/// Readings running that are equal are repeated: 0.5 s. Noise of a millimetre repeats one with a probability below 0.4.
const REPEATED: u32 = 15;
/// A range so far from its predecessor jumps, m.
const JUMP: f32 = 0.15;
/// Jumps, less one for every [`JUMP_FADING`] seconds.
const JUMPS: f32 = 5.0;
const JUMP_FADING: f32 = 0.4;
/// Rejections count for this long.
const REMEMBERED: Duration = Duration::from_secs(3);
/// How near a range has to be to what is expected, m, and for how long, to be believed again, s.
const AGREES: f32 = 0.15;
const AGREES_FOR: f32 = 1.0;
/// Time constants with which the observer follows the barometer, s: slower at first, because starting propellers change
/// the pressure by more than half a metre.
const FOLLOWS: f32 = 1.0;
const FOLLOWS_FIRST: f32 = 3.0;
const FIRST: f32 = 2.0;
/// Time constant with which its bias follows the filter's while nothing disagrees, s.
const BIAS_FOLLOWS: f32 = 1.0;
/// The height of a pressure step that no climb makes between two readings, m.
const PRESSURE_STEP: f32 = 1.5;

/// Who contradicts whom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// Nobody.
    Agreement,
    /// The range is wrong: climb rate up, m/s, accelerometer bias along the vertical, m/s², and how much higher the
    /// vehicle is than the filter believes, m.
    Range { climb: f32, bias: f32, higher: f32 },
}

/// The observer and what is remembered of the range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct VerticalMonitor {
    /// Upwards: m, m/s, and the bias of the upward acceleration, m/s².
    height: f32,
    climb: f32,
    bias: f32,
    age: f32,
    /// Altitude of the barometer at the observer's zero.
    zero: Option<f32>,
    baro_at: Instant,
    /// Difference of the paths, and for how long the climb rates have differed.
    path: f32,
    differs: f32,
    rejected: Option<Instant>,
    /// Sum of the jumps that the filter's height was moved by lately.
    moved: f32,
    range: f32,
    range_at: Instant,
    repeats: u32,
    /// Height of the observer when the range began to repeat itself.
    repeats_from: f32,
    jumps: f32,
    agrees: f32,
    implausible: bool,
}

impl VerticalMonitor {
    /// Is the range not to be believed?
    pub(super) fn is_implausible(&self) -> bool {
        self.implausible
    }

    /// The vehicle stands: nothing moves, and the range may say what it wants.
    pub(super) fn stand(&mut self, bias: f32) {
        *self = Self {
            bias,
            zero: self.zero,
            baro_at: self.baro_at,
            range: self.range,
            range_at: self.range_at,
            ..Self::default()
        };
    }

    /// Integrates a step: the change of the upward velocity without any bias removed, the filter's climb rate and bias.
    #[inline]
    pub(super) fn predict(&mut self, dt: f32, change: f32, climb: f32, bias: f32) {
        let change = change - self.bias * dt;
        self.height += (self.climb + 0.5 * change) * dt;
        self.climb += change;
        self.age += dt;
        let differs = climb - self.climb;
        self.path += (differs - self.path * (1.0 / FADING)) * dt;
        let limit = if self.age < FIRST { 1.7 * CLIMB } else { CLIMB };
        self.differs = if differs.abs() > limit { self.differs + dt } else { 0.0 };
        if self.rejected.is_none() && !self.implausible {
            self.bias += (bias - self.bias) * (dt / BIAS_FOLLOWS);
        }
    }

    /// Takes an altitude. `stands` as in [`stand`](Self::stand).
    pub(super) fn baro(&mut self, at: Instant, altitude: f32, stands: bool) {
        let dt = at.since(self.baro_at).seconds().min(0.2);
        self.baro_at = at;
        let zero = self.zero.get_or_insert(altitude - self.height);
        let off = altitude - *zero - self.height;
        if stands {
            *zero += off * (dt / (0.3 + dt));
        } else if off.abs() > PRESSURE_STEP {
            *zero += off;
        } else {
            let follows = if self.age < FIRST { FOLLOWS_FIRST } else { FOLLOWS };
            let rate = dt / follows;
            // All three poles at one place.
            self.height += 3.0 * rate * off;
            self.climb += 3.0 * rate * off / follows;
            self.bias -= rate * off / (follows * follows);
        }
    }

    /// Takes a range before the filter does. True when it may be used.
    pub(super) fn range(&mut self, at: Instant, distance: f32, expected: f32) -> bool {
        let dt = at.since(self.range_at).seconds().min(0.2);
        let jumps = (distance - self.range).abs() > JUMP && self.range > 0.0;
        if distance.to_bits() == self.range.to_bits() {
            self.repeats = self.repeats.saturating_add(1);
        } else {
            (self.repeats, self.repeats_from) = (0, self.height);
        }
        (self.range, self.range_at) = (distance, at);
        self.jumps = (self.jumps - dt / JUMP_FADING).max(0.0) + f32::from(u8::from(jumps));
        if self.implausible {
            let agrees = (distance - expected).abs() < AGREES && !jumps && self.repeats < REPEATED;
            self.agrees = if agrees { self.agrees + dt } else { 0.0 };
            if self.agrees > AGREES_FOR {
                // The second opinion has become a first one: it begins anew.
                *self = Self { bias: self.bias, range: distance, range_at: at, ..Self::default() };
            }
        }
        !self.implausible
    }

    /// The filter rejected a range.
    pub(super) fn rejected(&mut self, at: Instant) {
        self.rejected = Some(at);
    }

    /// The filter moved its height up by this much, to the range.
    pub(super) fn moved(&mut self, up: f32) {
        self.moved += up;
    }

    /// Who is wrong. After a verdict the observer goes on from there.
    pub(super) fn judge(&mut self, now: Instant) -> Verdict {
        if self.rejected.is_some_and(|at| now.since(at) > REMEMBERED) {
            (self.rejected, self.moved) = (None, 0.0);
        }
        if self.implausible || self.zero.is_none() {
            return Verdict::Agreement;
        }
        let stuck = self.repeats >= REPEATED && (self.height - self.repeats_from).abs() > MOVED;
        let apart = self.differs > LASTS || self.path.abs() > HEIGHT;
        if stuck || self.jumps > JUMPS || (apart && self.rejected.is_some()) {
            let higher = -self.path - self.moved;
            (self.implausible, self.path, self.moved, self.differs) = (true, 0.0, 0.0, 0.0);
            return Verdict::Range { climb: self.climb, bias: self.bias, higher };
        }
        if apart {
            // The barometer is wrong.
            *self = Self { bias: self.bias, range: self.range, range_at: self.range_at, ..Self::default() };
            self.climb = f32::NAN;
        }
        Verdict::Agreement
    }

    /// The observer starts again from the filter's climb rate, where its own is of no use.
    pub(super) fn restart(&mut self, climb: f32) {
        if !self.climb.is_finite() {
            (self.height, self.climb) = (0.0, climb);
        }
    }

    /// For the tuning: differences of climb rate and path.
    pub(super) fn differences(&self, climb: f32) -> [f32; 2] {
        [climb - self.climb, self.path]
    }
}
