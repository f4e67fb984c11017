//! Barometer BMP280: conversions at about 13 Hz, slow drift, and the pressure caused by the
//! propellers.

use super::schedule::Schedule;
use super::weather::{Doors, Wander};
use crate::noise::{Noise, Stream};
use crate::time::Clock;
use crate::world::World;
use core::convert::Infallible;
use stampfly_drivers::{Barometer, Sample};
use stampfly_types::messages::BaroData;
use stampfly_types::{Duration, Instant};

/// Conversions per second: conversion time plus 62.5 ms of standby.
pub(crate) const RATE: f64 = 13.5;
const READ_OUT: Duration = Duration::from_micros(400);
/// Pressure at the floor, Pa.
const FLOOR_PRESSURE: f64 = 101_000.0;
/// Standard deviation of one conversion after the chip's filter, Pa: 6 cm, as in static records.
pub(crate) const DEVIATION: f64 = 0.7;
/// Resolution, Pa.
const RESOLUTION: f64 = 0.16;
/// Drift by weather and warming, Pa/√s.
const DRIFT: f64 = 0.12;
/// Height over which the additional wash at the floor decays, m.
const WASH_HEIGHT: f64 = 0.2;

/// Pressure altitude in the standard atmosphere (ICAO doc 7488, troposphere), m.
fn altitude(pressure: f64) -> f64 {
    44_330.77 * (1.0 - libm::pow(pressure / 101_325.0, 0.190_263))
}

/// Air pressure at the chip, shared by the model and the register-level emulator.
#[derive(Debug)]
pub(crate) struct BaroPhysics {
    world: World,
    noise: Noise,
    drift: f64,
    start: Instant,
    /// Strength of the propellers' wash relative to the vehicle's value, and additional share at
    /// the floor.
    wash: [f64; 2],
    /// Wander of the room's pressure, if enabled.
    wander: Option<Wander>,
    doors: Option<Doors>,
}

impl BaroPhysics {
    pub(crate) fn new(world: &World, start: Instant, mut noise: Noise, seed: u64) -> Self {
        let conditions = world.conditions();
        Self {
            // Specimens differ by several metres.
            drift: 60.0 * noise.normal(),
            noise,
            start,
            wash: [conditions.baro_wash, conditions.baro_wash_floor],
            wander: Wander::new(&conditions, seed),
            doors: Doors::new(&conditions, start, seed),
            world: world.clone(),
        }
    }

    /// One conversion at `at`, Pa, `period` seconds after the previous one, with noise of this
    /// standard deviation.
    pub(crate) fn pressure(&mut self, at: Instant, period: f64, deviation: f64) -> f64 {
        let motion = self.world.motion_at(at);
        let (hover, wash) = self.world.inspect(|body| (body.nominal_rotor_speed(), body.disturbance().wash));
        let height = -motion.position.z;
        // Density of air at 20 °C and this pressure, times gravity: 11.8 Pa/m.
        let still = FLOOR_PRESSURE - 11.77 * height;
        let thrust = motion.rotor_speed.iter().map(|w| (w / hover) * (w / hover)).sum::<f64>() / 4.0;
        let [strength, at_floor] = self.wash;
        let wash = wash * strength * thrust * (1.0 + at_floor * libm::exp(-height.max(0.0) / WASH_HEIGHT));
        // Random walk, scaled by the time since the last conversion.
        self.drift += DRIFT * period.sqrt() * self.noise.normal();
        let (deviation, wander) = match &mut self.wander {
            Some(wander) => (Wander::white(deviation), wander.after(period)),
            None => (deviation, 0.0),
        };
        let quiet = still + wash + self.drift + deviation * self.noise.normal();
        quiet + wander + self.doors.as_mut().map_or(0.0, |doors| doors.at(at))
    }

    /// Die temperature, °C.
    pub(crate) fn temperature(&self, at: Instant) -> f32 {
        let minutes = at.since(self.start).seconds() / 60.0;
        25.0 + 8.0 * minutes / (minutes + 2.0)
    }
}

/// Model of the barometer. Implements [`Barometer`].
#[derive(Debug)]
pub struct BaroModel {
    clock: Clock,
    schedule: Schedule,
    physics: BaroPhysics,
}

impl BaroModel {
    pub(crate) fn new(world: &World, clock: &Clock, seed: u64) -> Self {
        let mut noise = Noise::stream(seed, Stream::Baro);
        Self {
            schedule: Schedule::new(clock.now(), RATE, 0.02, &mut noise),
            physics: BaroPhysics::new(world, clock.now(), noise, seed),
            clock: clock.clone(),
        }
    }
}

impl Barometer for BaroModel {
    type Error = Infallible;

    async fn next(&mut self) -> Result<Sample<BaroData>, Infallible> {
        let number = self.schedule.upcoming(self.clock.now(), READ_OUT.as_micros() as f64);
        let at = self.schedule.instant(number);
        self.clock.sleep_until(at + READ_OUT).await;
        self.schedule.reported(number);
        let pressure = self.physics.pressure(at, self.schedule.period() * 1e-6, DEVIATION);
        let pressure = (pressure / RESOLUTION).round() * RESOLUTION;
        let data = BaroData {
            pressure: pressure as f32,
            temperature: self.physics.temperature(at),
            altitude: altitude(pressure) as f32,
        };
        Ok(Sample { at, data })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Conditions;
    use crate::plant::{Body, Disturbance, Motion};

    /// Rotor speed in hover, rad/s.
    const HOVER: f64 = 3_000.0;
    /// Wash in hover given by the vehicle, Pa.
    const WASH: f64 = 2.5;

    /// A body that keeps its position with turning rotors.
    #[derive(Debug)]
    struct Held(Motion);

    impl Body for Held {
        fn step(&mut self) {}

        fn motion(&self) -> &Motion {
            &self.0
        }

        fn nominal_rotor_speed(&self) -> f64 {
            HOVER
        }

        fn disturbance(&self) -> Disturbance {
            Disturbance { wash: WASH, ..Disturbance::NONE }
        }
    }

    /// Pressure added by the propellers at a height, m, with rotors at `faster` times their hover
    /// speed, Pa.
    fn added(conditions: &Conditions, height: f64, faster: f64) -> f64 {
        let pressure = |faster: f64| {
            let mut motion = Motion { rotor_speed: [HOVER * faster; 4], ..Motion::default() };
            motion.position.z = -height;
            let world = World::new(Held(motion), Instant::ZERO).with_conditions(conditions.clone());
            let noise = Noise::stream(1, Stream::Baro);
            BaroPhysics::new(&world, Instant::ZERO, noise, 1).pressure(Instant::from_millis(100), 0.07, DEVIATION)
        };
        // Both have the same noise, which cancels.
        pressure(faster) - pressure(0.0)
    }

    fn near(is: f64, expected: f64) -> bool {
        (is - expected).abs() < 1e-6
    }

    #[test]
    fn propellers_press_or_suck_as_they_are_told_and_with_the_square_of_their_speed() {
        for wash in [1.0, -1.0, 1.4, -1.4, 0.0] {
            let conditions = Conditions { baro_wash: wash, ..Conditions::GENTLE };
            assert!(near(added(&conditions, 10.0, 1.0), wash * WASH), "{wash}");
            assert!(near(added(&conditions, 10.0, 1.5), 2.25 * wash * WASH), "{wash}");
        }
    }

    #[test]
    fn near_the_floor_there_is_more_of_it_by_the_share_that_fades_with_the_height() {
        for wash in [1.0, -1.0] {
            for floor in [0.5, 2.0] {
                let conditions = Conditions { baro_wash: wash, baro_wash_floor: floor, ..Conditions::GENTLE };
                let share = |height: f64| added(&conditions, height, 1.0) / (wash * WASH) - 1.0;
                assert!(near(share(0.0), floor), "on it: {}", share(0.0));
                assert!(near(share(WASH_HEIGHT), floor * (-1f64).exp()), "above it: {}", share(WASH_HEIGHT));
                let heights = [0.0, 0.05, 0.1, 0.2, 0.5, 1.0, 3.0].map(share);
                assert!(heights.windows(2).all(|two| two[0] > two[1]), "{heights:?}");
                assert!(heights[6] < 1e-6 * floor + 1e-9, "three metres above nothing is left: {heights:?}");
            }
        }
    }
}
