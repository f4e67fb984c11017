//! Height and climb rate by accelerometer and barometer, independent of the range finder.
//!
//! An observer of height, climb rate and accelerometer bias integrates the vertical acceleration
//! and follows the barometer slowly. Its three poles coincide.
//!
//! Neither sensor suffices alone. Vibration shifts the accelerometer's zero by up to 2 m/s² as the
//! thrust changes. A door changes the pressure by 18 Pa within a second, which is 1.5 m, and
//! propellers change it, too. The accelerometer measures any real motion of that size: if the
//! observer does not follow the barometer, the pressure has changed, and both restart from there.

use stampfly_types::math;

/// Time constants with which the observer follows the barometer, s. The slower one holds for the
/// first `FIRST` seconds, because starting propellers change the pressure by more than half a
/// metre.
const FOLLOWS: f32 = 1.0;
const FOLLOWS_FIRST: f32 = 3.0;
const FIRST: f32 = 2.0;
/// Time constant with which the bias follows the estimator's while no finding exists, s.
const BIAS_FOLLOWS: f32 = 1.0;
/// The same for the climb rate, until the observer has settled.
const CLIMB_FOLLOWS: f32 = 1.0;
/// Settling time after the take-off, s, because starting propellers change the pressure.
const SETTLED: f32 = 4.0;
/// Additional time after a start in the air, s, in which the estimator finds tilt and biases.
const UNKNOWN: f32 = 6.0;
/// The barometer disagrees with the accelerometer if the mean residual over `DISAGREES_OVER`, s,
/// exceeds `DISAGREES`, m: five of its standard deviations.
const DISAGREES_OVER: f32 = 0.3;
const DISAGREES: f32 = 0.25;
/// Time for which the pressure may continue to change, s.
const SETTLES: f32 = 2.0;
/// Largest residual of an altitude in a real climb, m.
const PRESSURE_STEP: f32 = 0.8;
/// Time constant of the altitude of the place where the vehicle stands, s.
const STANDS: f32 = 0.3;
/// Upper bound on the interval between readings, s.
const LONGEST: f32 = 0.2;
/// Number of consecutive equal altitudes that indicates a frozen barometer.
const REPEATED: u32 = 15;

/// An altitude of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AltitudeReading {
    /// Change since the last one, m.
    pub change: f32,
    /// Time since the last one, s.
    pub dt: f32,
    /// The barometer is frozen.
    pub stuck: bool,
    /// The pressure has stepped; the height has not.
    pub stepped: bool,
}

/// The observer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Altimeter {
    /// Above the place where the vehicle stood or the observer started, m.
    pub height: f32,
    /// Upwards, m/s.
    pub climb: f32,
    /// Bias of the upward acceleration, m/s².
    pub bias: f32,
    /// Running time, s. Negative for the first seconds after a start in the air.
    age: f32,
    /// Its zero is not the place where the vehicle stood.
    restarted: bool,
    /// Altitude of the barometer at the observer's zero, m.
    zero: Option<f32>,
    last: Option<f32>,
    repeats: u32,
    /// Mean residual of the altitude, m.
    unfollowed: f32,
}

impl Altimeter {
    /// The observer of a vehicle in the air in an unknown state.
    #[must_use]
    pub fn airborne() -> Self {
        Self { age: -UNKNOWN, restarted: true, ..Self::default() }
    }

    /// Whether it has run for the settling time.
    #[must_use]
    pub fn has_settled(&self) -> bool {
        self.age > SETTLED
    }

    /// Whether the estimator has had time to converge after a start in the air.
    #[must_use]
    pub fn has_begun(&self) -> bool {
        self.age > 0.0
    }

    /// Whether its height refers to the place where the vehicle stood, shortly after the take-off.
    #[must_use]
    pub fn knows_take_off(&self) -> bool {
        self.age < SETTLED && !self.restarted
    }

    /// Whether an altitude has ever been received.
    #[must_use]
    pub fn has_zero(&self) -> bool {
        self.zero.is_some()
    }

    /// The vehicle stands, with this bias of the upward acceleration, m/s².
    pub fn stand(&mut self, bias: f32) {
        *self = Self { bias, zero: self.zero, last: self.last, repeats: self.repeats, ..Self::default() };
    }

    /// Restarts in the air, with this bias, m/s².
    pub fn restart(&mut self, bias: f32) {
        *self = Self { bias, last: self.last, repeats: self.repeats, ..Self::airborne() };
    }

    /// Propagates by `dt` seconds with a change of the upward velocity by `change`, m/s, bias
    /// included. `believed`: climb rate and bias of the estimator while its range is accepted.
    pub fn predict(&mut self, dt: f32, change: f32, believed: Option<[f32; 2]>) {
        let change = change - self.bias * dt;
        self.height += (self.climb + 0.5 * change) * dt;
        self.climb += change;
        self.age += dt;
        if let Some([climb, bias]) = believed {
            self.bias += (bias - self.bias) * (dt / BIAS_FOLLOWS);
            if self.age < SETTLED {
                // Starting propellers disturb both the pressure and the accelerometer; only the
                // range remains.
                self.climb += (climb - self.climb) * (dt / CLIMB_FOLLOWS);
            }
        }
    }

    /// Takes an altitude, m, `dt` seconds after the last one.
    pub fn baro(&mut self, altitude: f32, dt: f32, stands: bool) -> AltitudeReading {
        let dt = math::smaller(dt, LONGEST);
        let last = self.last.replace(altitude).unwrap_or(altitude);
        self.repeats = if altitude.to_bits() == last.to_bits() { self.repeats.saturating_add(1) } else { 0 };
        let zero = self.zero.get_or_insert(altitude - self.height);
        let off = altitude - *zero - self.height;
        self.unfollowed += (off - self.unfollowed) * (dt / (DISAGREES_OVER + dt));
        let mut stepped = false;
        if stands {
            *zero += off * (dt / (STANDS + dt));
            self.unfollowed = 0.0;
        } else if off.abs() > PRESSURE_STEP || self.age > SETTLED && self.unfollowed.abs() > DISAGREES {
            *zero += off;
            stepped = true;
            // Settle again as after a take-off, but from another zero.
            if self.age > SETTLED {
                (self.age, self.restarted, self.unfollowed) = (SETTLED - SETTLES, true, 0.0);
            }
        } else {
            // Gains of three coincident poles at −1/follows.
            let follows = if self.age < FIRST { FOLLOWS_FIRST } else { FOLLOWS };
            let rate = dt / follows;
            self.height += 3.0 * rate * off;
            self.climb += 3.0 * rate * off / follows;
            self.bias -= rate * off / (follows * follows);
        }
        AltitudeReading { change: altitude - last, dt, stuck: self.repeats >= REPEATED, stepped }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f32 = 0.04;

    /// A flight of `seconds` from the ground; altitude and acceleration are functions of time.
    fn fly(seconds: f32, altitude: impl Fn(f32) -> f32, acceleration: impl Fn(f32) -> f32) -> (Altimeter, u32) {
        let (mut altimeter, mut steps) = (Altimeter::default(), 0);
        for _ in 0..50 {
            altimeter.stand(0.2);
            altimeter.baro(altitude(0.0), DT, true);
        }
        for n in 1..=(seconds / DT) as u16 {
            let time = f32::from(n) * DT;
            altimeter.predict(DT, (acceleration(time) + 0.2) * DT, None);
            steps += u32::from(altimeter.baro(altitude(time), DT, false).stepped);
        }
        (altimeter, steps)
    }

    #[test]
    fn a_climb_is_followed_without_a_range() {
        let (altimeter, steps) =
            fly(8.0, |time| 0.25 * time * time.min(4.0), |time| if time < 4.0 { 0.5 } else { 0.0 });
        assert_eq!(steps, 0);
        assert!(altimeter.height > 6.0, "{altimeter:?}");
    }

    #[test]
    fn a_door_is_no_climb() {
        let door = |time: f32| 1.5 * ((time - 6.0) / 0.8).clamp(0.0, 1.0);
        let (altimeter, steps) = fly(9.0, door, |_| 0.0);
        assert!(steps > 0 && altimeter.climb.abs() < 0.3, "{steps}, {altimeter:?}");
    }
}
