//! Does optical flow agree with what the accelerometer felt?
//!
//! Flow that lies is not rejected: it moves tilt and accelerometer bias until acceleration and flow agree again. So the
//! comparison undoes what flow did to the predicted acceleration over the last seconds. What remains of flow's velocity
//! less the integral of that acceleration, over half a second, is what no motion explains: zeros or a frozen reading
//! while the vehicle accelerates, axes swapped or reversed, an offset that begins.
//!
//! Not for an error of scale of some tens of per cent, nor for a constant offset that was there from the beginning: no
//! other sensor on board measures a constant velocity.

use stampfly_types::Vec3;

/// Time constant over which velocities are compared, s, and of the low-pass on their difference.
const OVER: f32 = 0.5;
const SMOOTH: f32 = 0.06;
/// Time constant with which flow's corrections are forgotten, s.
const FORGOTTEN: f32 = 2.0;
/// Largest difference, m/s, for each metre of distance, and as a share of the velocity.
const DIFFERENCE: f32 = 0.7;
const PER_METRE: f32 = 0.15;
const SHARE: f32 = 0.25;
/// For how long, s.
const LASTS: f32 = 0.1;
/// Readings running that are equal and not zero: frozen. At 100 Hz 0.4 s.
const REPEATED: u32 = 40;
/// The picture cannot stand still while the body turns by this much, rad: ten counts of a PMW3901. Nearer to the floor
/// than [`SHARP`], m, it may be blurred.
const TURNED: f32 = 0.025;
const SHARP: f32 = 0.15;
/// For so many readings running, at least.
const ZEROS: u32 = 20;
/// After a start in the air the filter first has to find tilt and biases, s.
const UNKNOWN: f32 = 10.0;
/// To be believed again flow has to agree with a motion of this much, m/s, for this long, s.
const MOTION: f32 = 0.2;
const AGREES_FOR: f32 = 0.5;
/// Largest mean rate of the picture on a vehicle that stands, rad/s.
const STANDING_RATE: f32 = 0.6;

/// What is remembered of flow and acceleration, horizontal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct FlowMonitor {
    /// Integral of the acceleration since the last reading.
    change: [f32; 2],
    /// What flow added to the acceleration lately.
    added: [f32; 2],
    /// Flow's and the accelerometer's velocity above their mean of the last half second.
    flow: [f32; 2],
    inertial: [f32; 2],
    last: Option<[f32; 2]>,
    difference: [f32; 2],
    differs: f32,
    agrees: f32,
    reading: [f32; 2],
    repeats: u32,
    /// Readings of nothing, and the largest turn of the body beside them.
    zeros: u32,
    turn: [f32; 2],
    turned: f32,
    standing: [f32; 2],
    implausible: bool,
    /// How long it has to hold back, s.
    waits: f32,
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

    /// Integrates the change of the velocity, world.
    #[inline]
    pub(super) fn predict(&mut self, change: &Vec3) {
        self.change[0] += change.x;
        self.change[1] += change.y;
    }

    /// Flow changed the predicted acceleration by this much, world.
    pub(super) fn corrected(&mut self, change: &Vec3) {
        self.added[0] += change.x;
        self.added[1] += change.y;
    }

    /// Takes a reading of a standing vehicle: rate of the picture less the gyro's, rad/s.
    pub(super) fn stand(&mut self, rate: [f32; 2], dt: f32) {
        let share = dt / (OVER + dt);
        let standing = core::array::from_fn(|axis| self.standing[axis] + (rate[axis] - self.standing[axis]) * share);
        let [x, y] = standing;
        *self = Self { standing, implausible: x * x + y * y > STANDING_RATE * STANDING_RATE, ..Self::default() };
    }

    /// Takes a reading: counts as they came, what the body's own turning makes of
    /// the picture, rad/s, velocity, world, and the distance to the floor. `known` says that the distance is
    /// certain. True when it has just become implausible.
    pub(super) fn flow(
        &mut self,
        counts: [f32; 2],
        turning: [f32; 2],
        velocity: &Vec3,
        distance: f32,
        dt: f32,
        known: bool,
    ) -> bool {
        let velocity = [velocity.x, velocity.y];
        let change = core::mem::take(&mut self.change);
        let Some(last) = self.last.replace(velocity).filter(|_| known && dt > 0.0) else {
            // Where the distance jumps, the velocity does.
            (self.flow, self.inertial, self.difference) = Default::default();
            (self.differs, self.agrees) = (0.0, 0.0);
            return false;
        };
        let (fade, forget) = (1.0 - dt / (OVER + dt), 1.0 - dt / FORGOTTEN);
        let smooth = dt / (SMOOTH + dt);
        let [mut difference, mut motion, mut speed] = [0.0; 3];
        for axis in 0..2 {
            self.flow[axis] = (self.flow[axis] + velocity[axis] - last[axis]) * fade;
            self.inertial[axis] = (self.inertial[axis] + change[axis] - self.added[axis] * dt) * fade;
            self.added[axis] *= forget;
            let apart = self.flow[axis] - self.inertial[axis];
            self.difference[axis] += (apart - self.difference[axis]) * smooth;
            difference += self.difference[axis] * self.difference[axis];
            motion += self.inertial[axis] * self.inertial[axis];
            speed += velocity[axis] * velocity[axis];
        }
        let repeated = counts == self.reading && counts != [0.0; 2];
        self.repeats = if repeated { self.repeats.saturating_add(1) } else { 0 };
        self.reading = counts;
        if counts == [0.0; 2] && distance > SHARP {
            self.zeros = self.zeros.saturating_add(1);
            for (turn, rate) in self.turn.iter_mut().zip(turning) {
                *turn += rate * dt;
                self.turned = self.turned.max(turn.abs());
            }
        } else {
            (self.zeros, self.turn, self.turned) = Default::default();
        }
        let blind = self.zeros >= ZEROS && self.turned > TURNED;
        let limit = DIFFERENCE + PER_METRE * distance;
        // The share is of squares: a sum of both would do as well, and costs a root.
        let limit = limit * limit + SHARE * SHARE * speed;
        self.differs = if difference > limit { self.differs + dt } else { 0.0 };
        if self.implausible {
            if motion > MOTION * MOTION {
                let agrees = difference < 0.2 * motion && self.repeats < REPEATED && self.zeros < ZEROS;
                self.agrees = if agrees { self.agrees + dt } else { 0.0 };
            }
            self.implausible = self.agrees < AGREES_FOR;
            return false;
        }
        self.waits = (self.waits - dt).max(0.0);
        self.implausible = (self.differs > LASTS && self.waits == 0.0) || self.repeats >= REPEATED || blind;
        self.agrees = 0.0;
        self.implausible
    }
}
