//! Does optical flow agree with what the accelerometer felt?
//!
//! Flow that lies is not rejected: it moves tilt, accelerometer bias and gyro bias until acceleration and flow agree
//! again. So the comparison undoes what flow did to the predicted acceleration over the last seconds: at once through
//! tilt and accelerometer bias, and second after second through the gyro bias, which goes on turning the tilt. What
//! remains of flow's velocity less the integral of that acceleration, over half a second, is what no motion explains: a
//! frozen reading while the vehicle accelerates, axes swapped or reversed, an offset that begins.
//!
//! The limit is the root of a sum of squares, one for each reason why honest readings differ:
//!
//! | term | reason |
//! |---|---|
//! | constant, and for each metre of distance | accelerometer and tilt; resolution of the picture |
//! | share of the picture's motion, and of the motion that the body's turning gives it | a reading holds one frame, two or none; its scale; the camera's mounting |
//! | turning's change within [`LATE`], times the distance | the picture is older than expected |
//! | share of the velocity that was gained | the picture's scale |
//! | standard deviation that was added to the tilt | the filter found its own tilt to be wrong, so the acceleration that is restored is wrong, too |
//!
//! Four things it leaves to others: what lies from the take-off on is [`departure`]'s, a picture that does not move is [`picture`]'s, a
//! velocity that jumps [`jump`]'s, and whether it is not flow but the gyro that is wrong [`gyro`]'s.
//!
//! What single readings may be wrong by counts for as long as it stays in the difference. Not for
//! an error of scale of some tens of per cent, nor for a constant offset that was there from the
//! beginning: no other sensor on board measures a constant velocity.

mod departure;
mod gyro;
mod jump;
mod picture;

use departure::Departure;
pub(super) use gyro::GyroShift;
use gyro::Record;
use jump::Jump;
use picture::Picture;
use stampfly_types::{GRAVITY, Vec3, math};

/// Time constant over which velocities are compared, s, and of the low-pass on their difference.
const OVER: f32 = 0.5;
const SMOOTH: f32 = 0.06;
/// Time constants with which flow's corrections of tilt and accelerometer bias are forgotten, s, and those of the gyro
/// bias. The latter act through the former, so they have to outlast them.
const FORGOTTEN: f32 = 2.0;
const BIAS_FORGOTTEN: f32 = 4.0;
/// Largest difference, m/s, and for each metre of distance. Over [`OVER`] 0.55 m/s are 1.1 m/s², as much as a tilt that
/// is wrong by 6.4°.
const DIFFERENCE: f32 = 0.55;
const PER_METRE: f32 = 0.15;
/// Share of the picture's motion. A PMW3901 takes 121 frames a second: of 100 readings every fifth holds two frames, and
/// one that is read early none. Such a single reading is wrong by all of the motion, of which [`SMOOTH`] lets a seventh
/// through, and a quarter of two that follow each other.
const SHARE: f32 = 0.25;
/// A picture is as much older than expected, s: of cameras it is 4 to 12 ms old, and 4 are
/// expected.
const LATE: f32 = 0.008;
/// Error of the picture's scale from one specimen to the next, share of the velocity.
const SCALE: f32 = 0.12;
/// Square of the velocity that vibration adds up to in the tenth of a second over which jumps are looked for, of its mean square change from
/// sample to sample, s²: half of that, over 2.5 ms times 0.1 s, and 2.5 standard deviations.
const SHAKES: f32 = 8.0e-4;
/// Largest difference for each radian that is added to the tilt's standard deviation, m/s: two deviations of the
/// velocity that gravity brings about over [`OVER`].
const PER_RADIAN: f32 = 2.0 * GRAVITY * OVER;
/// For how long, s.
const LASTS: f32 = 0.1;
/// Both velocities begin with the mean of so many readings: a single one may hold two frames, and what it is wrong by would
/// stay in every difference for [`OVER`].
const BEGINNING: u32 = 10;
/// After a start in the air the filter first has to find tilt and biases, s. A gyro bias of 3°/s takes as long.
const UNKNOWN: f32 = 20.0;
/// A vehicle that turns over moves the picture faster than a PMW3901 follows, 7.4 rad/s. Its readings are wrong by metres a second
/// until it hardly turns any more, rad/s, for so long, s.
const FAST: f32 = 7.0;
const CALM: f32 = 1.0;
const SETTLES: f32 = 0.1;
/// A lie that begins in flight has lasted this long when it is found, s, and what it did in that time is undone.
const LIED: f32 = 1.0;
/// After a shift of the gyro's zero was put right, the filter needs some time to settle, s.
const SHIFTED: f32 = 0.5;
/// To be believed again flow has to agree with a motion of this much, m/s, for this long, s.
const MOTION: f32 = 0.2;
const AGREES_FOR: f32 = 0.5;
/// Largest mean rate of the picture on a vehicle that stands, rad/s, over [`OVER`] and over the second time, s. The second is
/// for what begins while the motors spool up.
const STANDING_RATE: [f32; 2] = [0.6, 1.0];
const STANDING_SOON: f32 = 0.1;

/// How the body turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turn {
    /// The picture shows its motion.
    Slow,
    /// Faster than the sensor follows, or it was a moment ago: the reading says nothing.
    Fast,
    /// No longer: it has turned by this angle, rad.
    Over(f32),
}

/// What a reading has shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// Nothing new.
    Unchanged,
    /// Flow has just become implausible, and has lied for so long, s.
    Implausible(f32),
    /// What looked so was the gyro.
    GyroShifted(GyroShift),
}

/// What is remembered of flow and acceleration, horizontal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct FlowMonitor {
    /// Integral of the acceleration since the last reading, and over which time.
    change: [f32; 2],
    elapsed: f32,
    /// What flow added to the acceleration lately, and to the gyro bias.
    added: [f32; 2],
    gyro_bias: [f32; 2],
    /// Standard deviation that was added to the tilt lately.
    tilt: f32,
    /// Flow's and the accelerometer's velocity above their mean of the last half second.
    flow: [f32; 2],
    inertial: [f32; 2],
    last: Option<[f32; 2]>,
    /// Readings since the comparison began, and how far apart the velocities were in the first of them.
    readings: u32,
    apart: [f32; 2],
    jump: Jump,
    difference: [f32; 2],
    /// Square of what readings were wrong by, as far as it is still in the difference, m²/s², and
    /// the last turning.
    uncertain: f32,
    turning: [f32; 2],
    differs: f32,
    agrees: f32,
    picture: Picture,
    record: Record,
    departure: Departure,
    standing: [[f32; 2]; 2],
    implausible: bool,
    /// How long it has to hold back, s.
    waits: f32,
    /// The same after a fast turn, and its angle, rad.
    settles: f32,
    turned: f32,
}

impl FlowMonitor {
    /// Of a filter that starts in the air, with errors of every kind.
    pub(super) fn airborne() -> Self {
        Self { waits: UNKNOWN, ..Self::default() }
    }

    /// The vehicle stands: what moves it from here on is felt.
    #[inline]
    pub(super) fn ready(&mut self) {
        self.waits = 0.0;
    }

    /// Is flow not to be believed?
    pub(super) fn is_implausible(&self) -> bool {
        self.implausible
    }

    /// Integrates the change of the velocity, world, in `dt`.
    #[inline]
    pub(super) fn predict(&mut self, change: &Vec3, dt: f32) {
        self.elapsed += dt;
        self.change[0] += change.x;
        self.change[1] += change.y;
    }

    /// Flow changed the predicted acceleration and the gyro bias by this much, world.
    pub(super) fn corrected(&mut self, acceleration: &Vec3, gyro_bias: &Vec3) {
        self.added[0] += acceleration.x;
        self.added[1] += acceleration.y;
        self.gyro_bias[0] += gyro_bias.x;
        self.gyro_bias[1] += gyro_bias.y;
        let (acceleration, gyro_bias) = ([acceleration.x, acceleration.y], [gyro_bias.x, gyro_bias.y]);
        self.record.corrected(acceleration, gyro_bias);
        self.departure.corrected(acceleration, gyro_bias);
    }

    /// The filter found its tilt to be wrong, and added this standard deviation, rad.
    pub(super) fn inflated(&mut self, tilt: f32) {
        self.tilt = tilt;
    }

    /// Takes the turning of the picture that the body makes, rad/s.
    #[inline]
    pub(super) fn turns_fast(&mut self, turning: [f32; 2], interval: f32) -> Turn {
        let [x, y] = turning;
        let square = x * x + y * y;
        // Nothing but a fast turn begins it.
        let limit = if self.settles > 0.0 { CALM } else { FAST };
        let fast = square > limit * limit;
        self.settles = if fast { SETTLES } else { math::larger(self.settles - interval, 0.0) };
        if self.settles > 0.0 {
            self.turned += math::sqrt(square) * interval;
            self.last = None;
            self.forget();
            return Turn::Fast;
        }
        let turned = core::mem::take(&mut self.turned);
        if turned > 0.0 { Turn::Over(turned) } else { Turn::Slow }
    }

    /// What was compared until now says nothing.
    pub(super) fn forget(&mut self) {
        (self.flow, self.inertial, self.difference) = Default::default();
        (self.differs, self.agrees, self.uncertain) = (0.0, 0.0, 0.0);
        (self.readings, self.apart) = Default::default();
        self.jump.forget();
        self.record = Record::default();
    }

    /// The gyro's zero has jumped, and attitude, bias and velocity were put right.
    pub(super) fn gyro_jumped(&mut self) {
        self.forget();
        self.departure.gyro_jumped();
    }

    /// What flow did to the filter was right, or is undone.
    pub(super) fn start_over(&mut self) {
        self.forget();
        // It was the gyro, whatever was found meanwhile.
        self.departure = Departure::default();
        (self.added, self.gyro_bias) = Default::default();
    }

    /// Takes a reading of a standing vehicle: rate of the picture less the gyro's without its bias, rad/s.
    pub(super) fn stand(&mut self, rate: [f32; 2], dt: f32) {
        let mut standing = self.standing;
        let mut implausible = false;
        for ((mean, over), limit) in standing.iter_mut().zip([OVER, STANDING_SOON]).zip(STANDING_RATE) {
            let share = dt / (over + dt);
            *mean = core::array::from_fn(|axis| mean[axis] + (rate[axis] - mean[axis]) * share);
            let [x, y] = *mean;
            implausible |= x * x + y * y > limit * limit;
        }
        let mut departure = self.departure;
        departure.stand(dt);
        *self = Self { standing, implausible, departure, readings: BEGINNING, last: Some([0.0; 2]), ..Self::default() };
    }

    /// Takes a reading over `interval`: counts as they came, rad, what the body's own turning makes of the picture,
    /// rad/s, velocity, world, and the distance to the floor. `shaken`: mean square change of the accelerometer from sample to
    /// sample, (m/s²)²; `None` where it or the distance says nothing.
    pub(super) fn flow(
        &mut self,
        counts: [f32; 2],
        turning: [f32; 2],
        velocity: &Vec3,
        distance: f32,
        interval: f32,
        shaken: Option<f32>,
    ) -> Verdict {
        let velocity = [velocity.x, velocity.y];
        let change = core::mem::take(&mut self.change);
        let dt = core::mem::take(&mut self.elapsed);
        self.departure.felt(change, dt);
        let before = self.last.replace(velocity).zip(shaken);
        let Some((last, shaken)) = before.filter(|_| dt > 0.0 && interval > 0.0) else {
            // Where the distance jumps, the velocity does.
            self.forget();
            return Verdict::Unchanged;
        };
        let fade = OVER / (OVER + dt);
        let forget = FORGOTTEN / (FORGOTTEN + dt);
        let smooth = dt / (SMOOTH + dt);
        let [x, y] = self.gyro_bias;
        // A tilt that is turned by w changes the acceleration by gravity times w, a quarter turn about the vertical on.
        // The bias is subtracted from the rate, so it turns the opposite way.
        self.added[0] += GRAVITY * y * dt;
        self.added[1] -= GRAVITY * x * dt;
        self.gyro_bias = self.gyro_bias.map(|bias| bias * (BIAS_FORGOTTEN / (BIAS_FORGOTTEN + dt)));
        self.tilt *= forget;
        let ([mut difference, mut motion, mut picture], mut apart) = ([0.0; 3], [0.0; 2]);
        let begins = self.readings < BEGINNING;
        self.readings += u32::from(begins);
        for axis in 0..2 {
            self.flow[axis] = (self.flow[axis] + velocity[axis] - last[axis]) * fade;
            self.inertial[axis] = (self.inertial[axis] + change[axis] - self.added[axis] * dt) * fade;
            self.added[axis] *= forget;
            apart[axis] = self.flow[axis] - self.inertial[axis];
            if begins {
                self.apart[axis] += apart[axis] / BEGINNING as f32;
                self.flow[axis] -= if self.readings == BEGINNING { self.apart[axis] } else { 0.0 };
            } else {
                self.difference[axis] += (apart[axis] - self.difference[axis]) * smooth;
            }
            difference += self.difference[axis] * self.difference[axis];
            motion += self.inertial[axis] * self.inertial[axis];
            let rate = counts[axis] / interval;
            picture += rate * rate + turning[axis] * turning[axis];
        }
        self.record.reading(velocity, change, dt, distance);
        self.picture.step(counts, turning, distance, interval);
        let [base, share, tilt] = [DIFFERENCE + PER_METRE * distance, SHARE * distance, PER_RADIAN * self.tilt];
        let [x, y] = [turning[0] - self.turning[0], turning[1] - self.turning[1]];
        self.turning = turning;
        let late = LATE / interval * distance;
        let uncertain = share * share * picture + late * late * (x * x + y * y) + SCALE * SCALE * motion;
        // It leaves the difference as it came in: of squares, twice as fast.
        self.uncertain = math::larger(uncertain, self.uncertain * (SMOOTH / (SMOOTH + 2.0 * dt)));
        self.departure.reading(velocity, interval, self.uncertain, shaken);
        if !begins {
            self.jump.step(apart, distance, uncertain + SHAKES * shaken, interval, self.waits == 0.0);
        }
        // Of squares: a sum would do as well, and costs a root.
        let limit = base * base + self.uncertain + tilt * tilt;
        self.differs = if difference > limit { self.differs + interval } else { 0.0 };
        if self.implausible {
            if motion > MOTION * MOTION && !begins {
                let agrees = difference < 0.2 * motion && !self.picture.is_frozen() && !self.picture.is_still();
                self.agrees = if agrees { self.agrees + interval } else { 0.0 };
            }
            self.implausible = self.agrees < AGREES_FOR || self.jump.has_jumped() || self.departure.is_convicted();
            return Verdict::Unchanged;
        }
        self.waits = math::larger(self.waits - interval, 0.0);
        let mut apart = (self.differs > LASTS && self.waits == 0.0) || self.jump.has_jumped();
        let unmoved = self.picture.is_frozen() || self.picture.is_blind(distance);
        let shift = if apart && !unmoved { self.record.shift() } else { None };
        if let Some(shift) = shift {
            self.waits = SHIFTED;
            return Verdict::GyroShifted(shift);
        }
        if self.departure.contradicts() && self.record.shows_a_lie() {
            self.departure.convict();
            apart = true;
        }
        self.implausible = apart || unmoved;
        self.agrees = 0.0;
        if !self.implausible {
            return Verdict::Unchanged;
        }
        // What lies soon after the take-off has lied since then.
        let since = self.departure.time().unwrap_or(LIED);
        self.departure.end();
        Verdict::Implausible(since)
    }
}

#[cfg(test)]
mod tests;
