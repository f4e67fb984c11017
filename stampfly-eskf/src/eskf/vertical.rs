//! A second opinion about climb and height, which the range has no part in, and what follows when they disagree.
//!
//! An observer of height, climb rate and accelerometer bias integrates the vertical acceleration and follows the barometer
//! slowly. The filter's own climb rate hangs on the range, which is a hundred times more precise and may lie: dirt on the
//! glass reads 3 cm, a wrapped phase reads a quarter of a metre, a frozen register reads what was. A jump of the range
//! is no lie by itself, because a table is one.
//!
//! | the range is implausible when | |
//! |---|---|
//! | it repeats itself while the observer moves by [`MOVED`], right after a jump, for 1.5 s, or from the ground on for 3 s | stuck |
//! | the filter's path while it fuses ranges and the barometer's differ by [`HEIGHT`] within some seconds, and accelerometer and barometer agree | ramp |
//! | the height was moved to it more than [`MOVES`] times within three seconds | aliased, an edge below |
//! | it jumps more than five times within about two seconds | outliers, an edge below |
//! | the barometer has risen more than the filter's height within ten seconds of the take-off, by what neither propellers nor doors make ([`rise`]) | aliased or scaled from the ground on |
//! | it jumps and stays there, and the vehicle does not move sideways | aliased, an offset, something below that was not there |
//!
//! The accelerometer alone convicts nobody: vibration moves its zero by 2 m/s² as the thrust
//! changes. Nor does the barometer: a door moves the pressure by 18 Pa within a second, which is
//! 1.5 m, and propellers press or suck. No vehicle moves so without feeling it: where the observer
//! does not follow the barometer, the pressure has changed, and paths are compared anew from there
//! on. A range that is off by a constant is a table, and one that is off by a factor is found only
//! where the path is long.
//!
//! Until then two kinds of readings do no harm: one that repeats itself [`UNUSED`] times is not used, and one that leaps is
//! rejected until another one confirms it.
//!
//! The range is believed again after a second of readings that change, do not jump and lie within [`AGREES`] of where
//! the filter expects them.

mod rise;

use rise::Rise;
use stampfly_types::{Duration, Instant, math};

/// Difference of the paths, which fades with [`FADING`], m. A slope of 20° at 0.5 m/s makes 0.7.
pub(super) const HEIGHT: f32 = 0.8;
const FADING: f32 = 4.0;
/// How far the observer moves while the range repeats itself, m.
const MOVED: f32 = 0.2;
/// Readings running that are equal are repeated: 0.5 s. Noise of a millimetre repeats one with a probability below 0.4.
const REPEATED: u32 = 15;
/// As many while the observer moves: a range that lives changes with it.
const REPEATED_MOVING: u32 = 6;
/// As many after a jump.
const REPEATED_JUMPED: u32 = 8;
/// As many whether anything moves or not: 1.5 s.
const REPEATED_ALWAYS: u32 = 45;
/// As many from the ground on, those on the ground and those in the air together: 3 s. Recorded StampFlys repeat one 24 times there.
const REPEATED_STANDING: u32 = 90;
/// A reading that repeats itself so often is not used any more: 0.13 s, in which a take-off rises by 4 cm.
const UNUSED: u32 = 4;
/// Below this height the pressure under the propellers changes with it, m.
const NEAR: f32 = 0.35;
/// Height of the sensor on a vehicle that stands, m.
const CLEARANCE: f32 = 0.03;
/// Times that the height was moved to the range.
const MOVES: u32 = 3;
/// Paths are compared this long after the take-off, s, because starting propellers change the pressure.
const SETTLED: f32 = 4.0;
/// As much later after a start in the air, s: first the filter has to find tilt and biases.
const UNKNOWN: f32 = 6.0;
/// A range so far from its predecessor and from what the filter expects leaps, m: an outlier at first.
const LEAP: f32 = 0.05;
/// At this speed a vehicle may cross an edge or a table within a rejection, m/s.
const CROSSES: f32 = 0.15;
/// Nor does it see something rise to less than this share of the distance: a phase that wraps looks so. Over a table the
/// barometer holds the height, and behind it the range is believed again.
const NEARER: f32 = 0.5;
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
/// A range that has not been used for so long holds neither height nor climb rate, s: six readings.
const SILENT: f32 = 0.2;
/// Time constants with which the observer follows the barometer, s: slower at first, because starting propellers change
/// the pressure by more than half a metre.
const FOLLOWS: f32 = 1.0;
const FOLLOWS_FIRST: f32 = 3.0;
const FIRST: f32 = 2.0;
/// Time constant with which its bias follows the filter's while nothing disagrees, s.
const BIAS_FOLLOWS: f32 = 1.0;
/// The same for the climb rate, until the observer has settled.
const CLIMB_FOLLOWS: f32 = 1.0;
/// The barometer disagrees with the accelerometer when the mean over this time, s, of what the
/// observer does not follow is so large, m: five standard deviations of it.
const DISAGREES_OVER: f32 = 0.3;
const DISAGREES: f32 = 0.25;
/// So long the paths have to be apart, s: until then the disagreement would have shown.
const APART_FOR: f32 = 0.5;
/// For so long the pressure may go on changing, s.
const SETTLES: f32 = 2.0;
/// The height of a pressure step that no climb makes between two readings, m: the difference that convicts a range, so that a step
/// alone convicts none.
const PRESSURE_STEP: f32 = HEIGHT;

/// What a filter has to put right that a wrong range has misled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Correction {
    /// Climb rate up, m/s.
    pub climb: f32,
    /// Bias of the upward acceleration, m/s².
    pub bias: f32,
    /// How much higher the vehicle is than the filter believes, m.
    pub higher: f32,
}

/// What may be done with a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// What its gate says.
    Gate,
    /// It counts as one that its gate rejects.
    Reject,
    /// Nothing.
    Ignore,
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
    /// Its zero is not where the vehicle stood.
    restarted: bool,
    /// Altitude of the barometer at the observer's zero.
    zero: Option<f32>,
    baro_at: Instant,
    /// The filter's path less the barometer's, and the altitude it was last compared with.
    path: f32,
    altitude: Option<f32>,
    /// Altitudes running that are equal.
    baro_repeats: u32,
    rise: Rise,
    /// Since when the paths are apart.
    apart: Option<Instant>,
    /// Mean of what the observer does not follow of the altitude, m.
    unfollowed: f32,
    /// By how much the height was put right when the barometer had the last word about it, m.
    claimed: f32,
    rejected: Option<Instant>,
    /// Sum of the jumps that the filter's height was moved by lately.
    moved: f32,
    moves: u32,
    range: f32,
    /// What the filter expected it to be, m.
    expected: f32,
    range_at: Instant,
    /// Since a range was used, or could have been, s.
    unused: f32,
    repeats: u32,
    /// The same on the ground, before the take-off. Zero as soon as the range changes.
    stood: u32,
    /// The first of these readings had jumped.
    jumped: bool,
    /// Height of the observer when the range began to repeat itself.
    repeats_from: f32,
    jumps: f32,
    /// The filter rejected the last range.
    rejecting: bool,
    /// The first of the readings that are being rejected had jumped.
    rejected_since_jump: bool,
    /// Or leaped.
    rejected_since_leap: bool,
    agrees: f32,
    implausible: bool,
    /// It has been since the take-off: what the range did to the accelerometer's bias, and the propellers to the pressure, cannot be
    /// told apart.
    from_start: bool,
}

impl VerticalMonitor {
    /// Of a filter that starts in the air, with errors of every kind.
    pub(super) fn airborne() -> Self {
        Self { age: -UNKNOWN, restarted: true, ..Self::default() }
    }

    /// Is the range not to be believed?
    pub(super) fn is_implausible(&self) -> bool {
        self.implausible
    }

    /// How much higher than the range's last word the vehicle is by the barometer alone, m. A
    /// picture of the floor is not scaled by that: a velocity that is too small brakes less, and
    /// one that is too large swings.
    pub(super) fn claimed(&self) -> f32 {
        self.claimed
    }

    /// Has nothing that is to be believed told height and climb rate since the take-off?
    pub(super) fn knows_nothing(&self) -> bool {
        self.implausible && self.from_start
    }

    /// The vehicle stands: nothing moves, and the range may say what it wants.
    pub(super) fn stand(&mut self, bias: f32) {
        *self = Self {
            bias,
            zero: self.zero,
            baro_at: self.baro_at,
            range: self.range,
            range_at: self.range_at,
            stood: self.stood,
            altitude: self.altitude,
            rise: self.rise.at_rest(bias),
            ..Self::default()
        };
    }

    /// Takes a range of a vehicle that stands.
    pub(super) fn stand_range(&mut self, at: Instant, distance: f32) {
        self.stood = if distance.to_bits() == self.range.to_bits() { self.stood.saturating_add(1) } else { 0 };
        (self.range, self.range_at) = (distance, at);
    }

    /// Integrates a step: the change of the upward velocity without any bias removed, the filter's climb rate, bias and
    /// height.
    #[inline]
    pub(super) fn predict(&mut self, dt: f32, change: f32, climb: f32, bias: f32, height: f32) {
        self.rise.felt(change, climb, dt);
        let change = change - self.bias * dt;
        self.height += (self.climb + 0.5 * change) * dt;
        self.climb += change;
        self.age += dt;
        self.unused += dt;
        // What the filter does while it rejects ranges is not what they say, and without any it is nobody's lie.
        if self.unused > SILENT {
            self.path = 0.0;
        } else if !self.rejecting {
            self.path += (climb - self.path * (1.0 / FADING)) * dt;
        }
        if self.rejected.is_none() && !self.implausible {
            if height < NEAR {
                self.path = 0.0;
            }
            self.bias += (bias - self.bias) * (dt / BIAS_FOLLOWS);
            if self.age < SETTLED && self.repeats < REPEATED_MOVING {
                // Starting propellers change the pressure and the accelerometer's zero; the range is what is left.
                self.climb += (climb - self.climb) * (dt / CLIMB_FOLLOWS);
                self.path = 0.0;
            }
        }
    }

    /// The propellers stop, and with their vibration goes an error of the accelerometer: what the observer moves by meanwhile does not
    /// say that a range is stuck.
    pub(super) fn rest(&mut self) {
        self.repeats_from = self.height;
    }

    /// Takes an altitude, where the filter believes in this height. `stands` as in [`stand`](Self::stand).
    pub(super) fn baro(&mut self, at: Instant, altitude: f32, height: f32, stands: bool) {
        let dt = at.since(self.baro_at).seconds().min(0.2);
        self.baro_at = at;
        let last = self.altitude.replace(altitude).unwrap_or(altitude);
        let stuck = self.baro_repeats >= REPEATED;
        if stuck {
            self.rise = Rise::default();
        } else if stands {
            self.rise.stand(altitude - last, dt);
        } else if !self.implausible {
            self.rise.baro(altitude - last, height - CLEARANCE, dt);
        }
        self.baro_repeats = if altitude.to_bits() == last.to_bits() { self.baro_repeats.saturating_add(1) } else { 0 };
        if stuck {
            // It measured nothing, so there is nothing to compare until it has begun again.
            self.path = 0.0;
        } else if (altitude - last).abs() < PRESSURE_STEP && !self.rejecting {
            self.path -= altitude - last;
        }
        let zero = self.zero.get_or_insert(altitude - self.height);
        let off = altitude - *zero - self.height;
        self.unfollowed += (off - self.unfollowed) * (dt / (DISAGREES_OVER + dt));
        if stands {
            *zero += off * (dt / (0.3 + dt));
            self.unfollowed = 0.0;
        } else if off.abs() > PRESSURE_STEP || self.age > SETTLED && self.unfollowed.abs() > DISAGREES {
            *zero += off;
            // As after a start, but for the zero.
            if self.age > SETTLED {
                (self.path, self.unfollowed) = (0.0, 0.0);
                (self.age, self.restarted) = (SETTLED - SETTLES, true);
            }
        } else {
            let follows = if self.age < FIRST { FOLLOWS_FIRST } else { FOLLOWS };
            let rate = dt / follows;
            // All three poles at one place.
            self.height += 3.0 * rate * off;
            self.climb += 3.0 * rate * off / follows;
            self.bias -= rate * off / (follows * follows);
        }
    }

    /// Takes a range before the filter does. `rejecting`: the filter rejected the one before.
    pub(super) fn range(&mut self, at: Instant, distance: f32, expected: f32, rejecting: bool) -> Use {
        let silence = at.since(self.range_at).seconds();
        let dt = math::smaller(silence, 0.2);
        // Nor does what the vehicle itself moves by: it falls at 5 m/s, and leans to the other side
        // within two readings.
        let moved = expected - self.expected;
        let change = math::smaller((distance - self.range).abs(), (distance - self.range - moved).abs());
        self.expected = expected;
        // What the vehicle did while there was none is no jump.
        let follows = self.range > 0.0 && silence < SILENT;
        let jumps = follows && change > JUMP;
        let leaps = follows && change > LEAP && (distance - expected).abs() > LEAP;
        self.rejecting = rejecting;
        if !rejecting {
            (self.rejected_since_jump, self.rejected_since_leap) = (jumps, leaps);
        }
        if distance.to_bits() == self.range.to_bits() {
            self.repeats = self.repeats.saturating_add(1);
        } else {
            (self.repeats, self.repeats_from, self.jumped) = (0, self.height, jumps);
            self.stood = 0;
        }
        (self.range, self.range_at) = (distance, at);
        self.jumps = math::larger(self.jumps - dt / JUMP_FADING, 0.0) + f32::from(u8::from(jumps));
        if self.implausible {
            let agrees = (distance - expected).abs() < AGREES && !jumps && self.repeats < REPEATED;
            self.agrees = if agrees { self.agrees + dt } else { 0.0 };
            if self.agrees > AGREES_FOR {
                // The second opinion has become a first one: it begins anew.
                self.implausible = false;
                self.restart(self.bias);
            }
        }
        if self.implausible || self.repeats >= UNUSED {
            return Use::Ignore;
        }
        self.unused = 0.0;
        if leaps { Use::Reject } else { Use::Gate }
    }

    /// Has no range been used lately?
    pub(super) fn is_silent(&self) -> bool {
        self.unused > SILENT
    }

    /// The filter rejected a range.
    pub(super) fn rejected(&mut self, at: Instant) {
        self.rejected = Some(at);
    }

    /// The filter has rejected ranges for so long that its height would be reset to them, at this horizontal speed, m/s, if that
    /// is known. Is it the range that is wrong? A height and a climb rate that the range has no part in stay as they are.
    /// `share`: of the range that is expected.
    pub(super) fn refuses_jump(&mut self, speed: Option<f32>, share: f32) -> bool {
        let nearer = share < NEARER && (self.rejected_since_jump || self.rejected_since_leap);
        let alone = self.rejected_since_jump && speed.is_some_and(|speed| speed < CROSSES);
        // A filter that started in the air has to find its height first.
        let wrong = self.age > 0.0 && (nearer || alone);
        if wrong {
            self.leave_out();
        }
        wrong
    }

    /// Did the first of the ranges that are being rejected jump?
    pub(super) fn rejects_since_jump(&self) -> bool {
        self.rejected_since_jump
    }

    /// From here on the range is implausible, and what it did before does not count again.
    fn leave_out(&mut self) {
        (self.implausible, self.path, self.moved, self.moves) = (true, 0.0, 0.0, 0);
        (self.rise, self.claimed) = (Rise::default(), 0.0);
    }

    /// The filter moved its height up by this much, to the range.
    pub(super) fn moved(&mut self, up: f32) {
        self.moved += up;
        self.moves = self.moves.saturating_add(1);
    }

    /// The filter took another surface for the one below, which moves nothing.
    pub(super) fn stepped(&mut self) {
        self.moves = self.moves.saturating_add(1);
    }

    /// The filter starts again in flight; what is known of the range is still known.
    pub(super) fn restart(&mut self, bias: f32) {
        let (range, range_at, implausible) = (self.range, self.range_at, self.implausible);
        *self = Self { bias, range, range_at, implausible, ..Self::airborne() };
    }

    /// Is the range wrong, and what has a filter to put right that believes in this height? Nothing where it did not use what was
    /// wrong. The observer goes on from there.
    pub(super) fn judge(&mut self, now: Instant, height: f32) -> Option<Correction> {
        if self.rejected.is_some_and(|at| now.since(at) > REMEMBERED) {
            (self.rejected, self.moved, self.moves) = (None, 0.0, 0);
        }
        // A vehicle that has no range finder has none that lies.
        let has_range = self.range_at > Instant::ZERO;
        if self.implausible || self.zero.is_none() || !has_range {
            return None;
        }
        // Until it has settled the observer may drift while the vehicle still stands, where ranges repeat themselves.
        let settled = self.age > SETTLED;
        let repeated = if settled { REPEATED_MOVING } else { REPEATED };
        let stuck = self.repeats >= repeated && (self.height - self.repeats_from).abs() > MOVED
            || self.repeats >= REPEATED_JUMPED && self.jumped
            || self.repeats >= REPEATED_ALWAYS
            || self.stood.saturating_add(self.repeats) >= REPEATED_STANDING;
        let far = settled && self.path.abs() > HEIGHT && self.baro_repeats < REPEATED;
        self.apart = self.apart.or(Some(now)).filter(|_| far);
        let apart = self.apart.is_some_and(|since| now.since(since).seconds() >= APART_FOR);
        let above = self.rise.is_above();
        let wrong = stuck || apart || above.is_some() || self.jumps > JUMPS || (settled && self.moves > MOVES);
        if !wrong {
            return None;
        }
        // Right after the take-off the observer knows how far it came.
        let young = self.age < SETTLED && !self.restarted;
        let (higher, climb) = match above {
            Some(above) => above,
            None if young => (self.height + CLEARANCE - height, self.climb),
            None => (-self.path - self.moved, self.climb),
        };
        let misled = apart || above.is_some() || self.moved != 0.0;
        self.climb = climb;
        self.from_start = young;
        self.leave_out();
        if apart {
            self.claimed = higher;
        }
        misled.then_some(Correction { climb, bias: self.bias, higher })
    }
}

#[cfg(test)]
mod tests;
