//! Altitude and airspeed by total energy: the throttle makes energy, the pitch divides it between height and speed.
//!
//! Two loops that each own one quantity fight: a nose that is raised for height costs speed, for which the throttle opens, which raises the height. Here the throttle sees the rate of
//! the sum of both energies, γ + V̇/g, and the pitch the rate of their difference, γ − V̇/g, so a demand for one hardly disturbs the other (Lambregts 1983). When the throttle is at its end or the aircraft is
//! slow, speed goes before height: the nose is lowered. When it is closed, height goes before speed.
//!
//! Use it between the ground and the stall. Not for the take-off roll, nor for a flare, where the pitch is given.

use crate::bound::{symmetric, within};
use stampfly_types::GRAVITY;

/// Gains and limits of [`Energy`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EnergyConfig {
    /// Throttle in level flight at `speed_trim`, share.
    pub throttle_trim: f32,
    /// Throttle for each unit of energy rate, that is for each unit of thrust over weight: m·g over the full thrust at that speed.
    pub throttle_feed: f32,
    /// Throttle for an error of the energy rate.
    pub throttle_gain: f32,
    /// The same for one that lasts a second, 1/s.
    pub throttle_integral: f32,
    /// More throttle in a bank, for the induced drag: times 1/cos² φ − 1.
    pub throttle_bank: f32,
    /// Pitch in level flight at `speed_trim`, rad.
    pub pitch_trim: f32,
    /// Pitch for an error of the balance, rad.
    pub pitch_gain: f32,
    /// The same for one that lasts a second, rad/s.
    pub pitch_integral: f32,
    /// Lowest and highest pitch, rad.
    pub pitch: [f32; 2],
    /// Rate of climb for an error of the height, 1/s.
    pub height_gain: f32,
    /// Largest rates of climb and sink, m/s, both positive.
    pub climb_max: f32,
    /// See `climb_max`.
    pub sink_max: f32,
    /// Acceleration for an error of the airspeed, 1/s.
    pub speed_gain: f32,
    /// Largest acceleration that is asked for, m/s².
    pub acceleration_max: f32,
    /// Airspeed, m/s, below which height is given up for speed, all of it at nine tenths of this.
    pub speed_min: f32,
}

/// How it flies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyInput {
    /// m.
    pub height: f32,
    /// Rate of climb, m/s.
    pub climb: f32,
    /// True airspeed, m/s.
    pub airspeed: f32,
    /// Its rate, m/s²: the specific force along the nose less what gravity is there.
    pub acceleration: f32,
    /// Bank, rad.
    pub bank: f32,
}

/// How it should.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyDemand {
    /// m.
    pub height: f32,
    /// How fast that height changes, m/s: negative on a slope down.
    pub climb: f32,
    /// True airspeed, m/s.
    pub airspeed: f32,
    /// The pitch is the height's alone, whatever the speed: in a flare, where the throttle is closed.
    pub height_alone: bool,
}

/// What it does for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyOutput {
    /// rad.
    pub pitch: f32,
    /// Share of full throttle.
    pub throttle: f32,
}

/// The two loops.
///
/// ```
/// use stampfly_control::fixed_wing::{Energy, EnergyConfig, EnergyDemand, EnergyInput};
/// let config = EnergyConfig { throttle_trim: 0.4, ..EnergyConfig::default() };
/// let mut energy = Energy::default();
/// let level = EnergyInput { height: 50.0, climb: 0.0, airspeed: 15.0, acceleration: 0.0, bank: 0.0 };
/// let stay = EnergyDemand { height: 50.0, climb: 0.0, airspeed: 15.0, height_alone: false };
/// assert_eq!(energy.step(0.02, &level, &stay, &config).throttle, 0.4);
/// // Higher: throttle and nose. Faster: throttle, and the nose down.
/// let higher = energy.step(0.02, &level, &EnergyDemand { height: 60.0, ..stay }, &config);
/// let faster = energy.step(0.02, &level, &EnergyDemand { airspeed: 17.0, ..stay }, &config);
/// assert!(higher.throttle > 0.4 && higher.pitch > 0.05 && faster.throttle > 0.4 && faster.pitch < 0.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Energy {
    throttle: f32,
    pitch: f32,
    last: (f32, f32),
}

impl Default for EnergyConfig {
    /// Of a model aircraft of one or two kilograms at 15 m/s; `throttle_trim`, `throttle_feed` and `pitch_trim` are the aircraft's own.
    fn default() -> Self {
        Self {
            throttle_trim: 0.5,
            throttle_feed: 1.5,
            throttle_gain: 0.5,
            throttle_integral: 0.3,
            throttle_bank: 0.1,
            pitch_trim: 0.0,
            pitch_gain: 0.5,
            pitch_integral: 0.2,
            pitch: [-0.35, 0.4],
            height_gain: 0.4,
            climb_max: 4.0,
            sink_max: 3.0,
            speed_gain: 0.4,
            acceleration_max: 2.0,
            speed_min: 9.0,
        }
    }
}

/// Slower than this, m/s, nothing is divided by the airspeed.
const SLOWEST: f32 = 3.0;

impl Energy {
    /// One step of `dt` seconds. Input that is no number repeats the last output.
    pub fn step(&mut self, dt: f32, input: &EnergyInput, demand: &EnergyDemand, config: &EnergyConfig) -> EnergyOutput {
        let c = config;
        let speed = input.airspeed.max(SLOWEST);
        let climb = demand.climb + c.height_gain * (demand.height - input.height);
        let climb = within(climb, -c.sink_max, c.climb_max);
        let faster = symmetric(c.speed_gain * (demand.airspeed - input.airspeed), c.acceleration_max);
        // Of height and of speed, as thrust over weight: wanted, and as it is.
        let [high, quick] = [climb / speed, faster / GRAVITY];
        let [rises, quickens] = [input.climb / speed, input.acceleration / GRAVITY];

        let cos = stampfly_types::math::cos(symmetric(input.bank, 1.0));
        let error = high + quick - rises - quickens;
        let throttle = c.throttle_trim
            + c.throttle_feed * (high + quick)
            + c.throttle_bank * (1.0 / (cos * cos) - 1.0)
            + c.throttle_gain * error;
        let slow = within((c.speed_min - input.airspeed) / (0.1 * c.speed_min), 0.0, 1.0);
        let wanted = throttle + self.throttle;
        // A throttle that is at its end cannot make what is missing: it is taken from the height.
        let spent = if wanted > 1.0 { within(4.0 * (wanted - 1.0), 0.0, 1.0) } else { 0.0 };
        let (for_height, for_speed) = (1.0 - slow.max(0.5 * spent), 1.0 + slow.max(0.5 * spent));
        // One that is closed cannot take away what is too much: it goes into speed, and the height is held.
        let for_speed = for_speed * (1.0 - within(-4.0 * wanted, 0.0, 1.0));
        let (for_height, for_speed) = if demand.height_alone { (1.0, 0.0) } else { (for_height, for_speed) };
        let balance = for_height * high - for_speed * quick;
        let off = balance - (for_height * rises - for_speed * quickens);
        let pitch = c.pitch_trim + balance + c.pitch_gain * off;
        if !(throttle.is_finite() && pitch.is_finite() && dt > 0.0) {
            return EnergyOutput { pitch: self.last.0, throttle: self.last.1 };
        }
        // Neither learns what its own limit makes.
        if !(wanted > 1.0 && error > 0.0 || wanted < 0.0 && error < 0.0) {
            self.throttle = symmetric(self.throttle + c.throttle_integral * error * dt, 0.5);
        }
        let [low, up] = c.pitch;
        let nose = pitch + self.pitch;
        if !(nose > up && off > 0.0 || nose < low && off < 0.0) {
            self.pitch = symmetric(self.pitch + c.pitch_integral * off * dt, 0.15);
        }
        self.last = (within(pitch + self.pitch, low, up), within(throttle + self.throttle, 0.0, 1.0));
        EnergyOutput { pitch: self.last.0, throttle: self.last.1 }
    }

    /// Forgets what it has learned.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A point with thrust, drag and a path that follows its pitch. Full thrust is 0.6 of its weight, drag 0.12 at 15 m/s.
    #[derive(Clone, Copy)]
    struct Point {
        height: f32,
        path: f32,
        speed: f32,
        thrust: f32,
    }

    impl Point {
        fn fly(&mut self, energy: &mut Energy, demand: &EnergyDemand, config: &EnergyConfig, steps: u32) -> [f32; 2] {
            let (dt, mut worst) = (0.02, [0f32; 2]);
            for _ in 0..steps {
                let drag = 0.12 * (self.speed / 15.0) * (self.speed / 15.0);
                let acceleration = GRAVITY * (0.6 * self.thrust - drag - stampfly_types::math::sin(self.path));
                let climb = self.speed * stampfly_types::math::sin(self.path);
                let input = EnergyInput { height: self.height, climb, airspeed: self.speed, acceleration, bank: 0.0 };
                let output = energy.step(dt, &input, demand, config);
                self.thrust += (output.throttle - self.thrust) * dt / 0.3;
                self.path += (output.pitch - 0.03 - self.path) * dt / 0.7;
                self.speed += acceleration * dt;
                self.height += climb * dt;
                worst = [
                    worst[0].max((self.height - demand.height).abs()),
                    worst[1].max((self.speed - demand.airspeed).abs()),
                ];
            }
            worst
        }
    }

    const CONFIG: EnergyConfig = EnergyConfig {
        throttle_trim: 0.2,
        throttle_feed: 1.67,
        throttle_gain: 0.5,
        throttle_integral: 0.3,
        throttle_bank: 0.1,
        pitch_trim: 0.03,
        pitch_gain: 0.5,
        pitch_integral: 0.2,
        pitch: [-0.35, 0.4],
        height_gain: 0.4,
        climb_max: 4.0,
        sink_max: 3.0,
        speed_gain: 0.4,
        acceleration_max: 2.0,
        speed_min: 9.0,
    };

    #[test]
    fn it_settles_where_it_should_and_a_change_of_one_hardly_moves_the_other() {
        let mut point = Point { height: 50.0, path: 0.0, speed: 15.0, thrust: 0.2 };
        let mut energy = Energy::default();
        let stay = EnergyDemand { height: 50.0, climb: 0.0, airspeed: 15.0, height_alone: false };
        point.fly(&mut energy, &stay, &CONFIG, 1_000);
        let [_, speed_off] = point.fly(&mut energy, &EnergyDemand { height: 60.0, ..stay }, &CONFIG, 1_000);
        assert!(speed_off < 1.2 && (point.height - 60.0).abs() < 0.3, "{speed_off} m/s, {} m", point.height);
        let [height_off, _] =
            point.fly(&mut energy, &EnergyDemand { height: 60.0, airspeed: 18.0, ..stay }, &CONFIG, 1_000);
        assert!(height_off < 1.5 && (point.speed - 18.0).abs() < 0.2, "{height_off} m, {} m/s", point.speed);
    }

    /// How far it is above a slope of 5° after forty seconds, m.
    fn above_slope(airspeed: f32) -> f32 {
        let mut point = Point { height: 60.0, path: -0.087, speed: airspeed, thrust: 0.1 };
        let (mut energy, mut height) = (Energy::default(), 60.0);
        let climb = -0.087 * airspeed;
        for _ in 0..2_000 {
            point.fly(&mut energy, &EnergyDemand { height, climb, airspeed, height_alone: false }, &CONFIG, 1);
            height += 0.02 * climb;
        }
        point.height - height
    }

    #[test]
    fn a_slope_is_held_without_an_error_that_stays_and_with_a_small_one_where_the_drag_is_too_little() {
        assert!(above_slope(15.0).abs() < 0.1, "{} m", above_slope(15.0));
        // At 12 m/s the throttle is closed and it becomes faster.
        assert!(above_slope(12.0).abs() < 0.8, "{} m", above_slope(12.0));
    }

    #[test]
    fn without_thrust_it_keeps_its_speed_and_sinks() {
        let mut point = Point { height: 100.0, path: 0.0, speed: 12.0, thrust: 0.0 };
        let mut energy = Energy::default();
        let stay = EnergyDemand { height: 100.0, climb: 0.0, airspeed: 12.0, height_alone: false };
        for _ in 0..500 {
            point.fly(&mut energy, &stay, &CONFIG, 50);
            point.thrust = 0.0;
            if point.height < 20.0 {
                break;
            }
        }
        // A little thrust is made in each second before it is taken away.
        assert!(point.speed > 8.0, "{} m/s", point.speed);
    }

    proptest! {
        #[test]
        fn any_numbers_give_numbers_within_their_bounds(
            height: f32, climb: f32, airspeed: f32, acceleration: f32, bank: f32, to: [f32; 3], dt: f32,
        ) {
            let mut energy = Energy::default();
            let input = EnergyInput { height, climb, airspeed, acceleration, bank };
            let demand = EnergyDemand { height: to[0], climb: to[1], airspeed: to[2], height_alone: dt > 1.0 };
            for _ in 0..3 {
                let output = energy.step(dt, &input, &demand, &CONFIG);
                prop_assert!((0.0..=1.0).contains(&output.throttle), "{}", output.throttle);
                prop_assert!((-0.35..=0.4).contains(&output.pitch), "{}", output.pitch);
            }
        }
    }
}
