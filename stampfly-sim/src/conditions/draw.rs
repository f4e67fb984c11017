//! The harsh world: conditions drawn from the seed.
//!
//! How far apart is written beside each draw, with its source.

use super::Conditions;
use crate::noise::{Noise, Stream};

/// How often a battery is drawn that does not bear the vehicle, before a new one is taken.
const BATTERIES: usize = 30;

impl Conditions {
    /// Conditions as far apart as recordings and data sheets are, drawn from a seed.
    ///
    /// `bears` says whether the vehicle can be flown at all with a battery like this one: people put a battery aside that does not lift the
    /// vehicle. Worn, cold and drained ones are drawn until one does.
    #[must_use]
    pub fn harsh(seed: u64, bears: impl Fn(&Self) -> bool) -> Self {
        let mut draw = Draw(Noise::stream(seed, Stream::Conditions));
        let mut conditions = Self {
            // The StampFly's published masses are 35 to 37 g without and with what people add, 36.8 g weighed; a quarter of it is the pack.
            mass_spread: 0.04,
            inertia_spread: 0.2,
            // Two families of measurements of the same propellers lie 25 % apart.
            thrust_spread: 0.1,
            // 5 % from motor to motor, as measured, and no more than half of what lies between the families.
            rotor_spread: 0.05,
            // Three millimetres at most: 12 mm of a pack that weighs a quarter of the vehicle.
            centre_spread: 0.0012,
            spread_limit: 2.5,
            // Magnets and brushes of motors of one bag.
            rotor_curve_spread: 0.05,
            rotor_place_spread: 0.0005,
            // 14 to 30 ms, of which 20 is nominal.
            rotor_lag_spread: 0.4,
            // 110 ms are measured from the command to the acceleration, 20 of them the rotors'.
            collective_lag: draw.between(0.0, 0.09),
            // Two degrees about each axis: chip on board, board in frame. A per cent of scale, beside the half per cent that the chip itself has.
            imu_misalignment: 0.035,
            imu_scale: 0.01,
            imu_lever: 0.006,
            ceiling: draw.between(2.3, 3.2),
            ceiling_effect: 1.0,
            wall_effect: 1.0,
            vortex_ring: 1.0,
            room_side: draw.between(2.5, 6.0),
            // A rug, a doorstep, a bed; over a table's edge flies who wants to. A floor stands still.
            floor_step: draw.step(),
            floor_step_distance: draw.between(0.4, 2.0),
            floor_step_bearing: draw.between(0.0, core::f64::consts::TAU),
            // The data sheets' ranging error, ±20 to 25 mm: 10 mm of it everywhere, the rest with the distance.
            range_offset: 0.01,
            range_scale: 0.05,
            // The title of the VL53L3CX's data sheet, and its cone of 25°.
            range_reach: 3.0,
            range_cone: 0.218,
            range_cover: draw.cover(),
            // The grey and the white chart of the data sheet: a dark carpet to a white sheet of paper.
            floor_reflectance: draw.between(0.17, 0.88),
            // An evening with the curtains drawn, an office (5), a sunny day behind a window (50): data sheet of the VL53L1X, § 3.1.
            ambient_light: draw.evenly_over_magnitudes(0.5, 50.0),
            baro_wander: 1.0,
            // One flight record has +2.5 Pa, the sign on another specimen is unknown: up to 0.3 m either way in a hover, 0.6 m with the floor.
            baro_wash: draw.between(-1.4, 1.4),
            baro_wash_floor: draw.between(0.0, 1.0),
            // Somebody comes or goes once in a minute. A door of a closed room makes 5 to 20 Pa.
            baro_doors: 1.0 / 60.0,
            baro_door: 18.0,
            // The carried recordings fit scales from 0.79 to 1.11, and axes of 0.943 and 1.015.
            flow_scale: 0.12,
            flow_axis_scale: 0.05,
            flow_mounting: 0.035,
            // From a good floor to a bad one; a picture is compared in the time of about the next one.
            flow_motion_noise: draw.between(0.03, 0.2),
            flow_delay: draw.between(0.004, 0.012),
            // PMW3901MB, data sheet.
            flow_largest_rate: 7.4,
            ..Self::GENTLE
        };
        let worn = conditions.clone();
        let mut batteries = (0..BATTERIES).map(|_| draw.battery(&worn));
        if let Some(battery) = batteries.find(bears) {
            conditions = battery;
        }
        conditions
    }
}

struct Draw(Noise);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.unit()
    }

    fn evenly_over_magnitudes(&mut self, low: f64, high: f64) -> f64 {
        low * libm::exp(self.0.unit() * libm::log(high / low))
    }

    /// Half of all range finders are clean, and the StampFly's have no window. 0.2·10⁶/s are a good window (10³/s at each of 200 detectors), 5·10⁶/s a
    /// thumb's print on it.
    fn cover(&mut self) -> f64 {
        let smeared = self.evenly_over_magnitudes(0.2, 5.0);
        if self.0.chance(0.5) { smeared } else { 0.0 }
    }

    /// Half of all floors are level. What is on the others is 5 mm to 0.3 m high, and one in four of those steps leads down.
    fn step(&mut self) -> f64 {
        let high = self.evenly_over_magnitudes(0.005, 0.3);
        let (level, down) = (self.0.chance(0.5), self.0.chance(0.25));
        match (level, down) {
            (true, _) => 0.0,
            (false, true) => -high,
            (false, false) => high,
        }
    }

    /// New to worn out, from a cold hall to a hot afternoon, full to half empty: flights begin with what the last one has left. With the
    /// StampFly's 0.06 Ω these are 0.05 to 0.22 Ω at once and half of that later, which are the 0.06 to 0.30 Ω that are published.
    fn battery(&mut self, conditions: &Conditions) -> Conditions {
        Conditions {
            battery_age: self.between(0.0, 1.0),
            battery_temperature: self.between(5.0, 35.0),
            battery_drained: self.between(0.0, 0.5),
            ..conditions.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_draw_is_the_seeds_and_stays_in_range() {
        for seed in 0..200 {
            let conditions = Conditions::harsh(seed, |_| true);
            assert_eq!(conditions, Conditions::harsh(seed, |_| true));
            assert_eq!(stampfly_param::parameters::validate(&conditions), Ok(()), "seed {seed}");
        }
    }

    #[test]
    fn a_battery_that_does_not_bear_the_vehicle_is_put_aside() {
        for seed in 0..50 {
            assert!(Conditions::harsh(seed, |conditions| conditions.battery_age < 0.3).battery_age < 0.3);
        }
        let new = Conditions::harsh(1, |_| false);
        assert_eq!((new.battery_age, new.battery_drained), (0.0, 0.0), "none bears it: a new one");
    }
}
