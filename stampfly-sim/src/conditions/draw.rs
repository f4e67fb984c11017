//! The harsh world: conditions drawn from the seed.
//!
//! Each draw states the source of its range.

use super::Conditions;
use crate::noise::{Noise, Stream};

/// Attempts to draw a battery that lifts the vehicle; after these a new battery is used.
const BATTERIES: usize = 30;

impl Conditions {
    /// Draws conditions from a seed, as far apart as recordings and data sheets are.
    ///
    /// `bears` returns whether the vehicle can be flown with the battery of these conditions. Worn,
    /// cold and discharged batteries are drawn until it returns true, at most 30 times; then the
    /// battery is new and full.
    #[must_use]
    pub fn harsh(seed: u64, bears: impl Fn(&Self) -> bool) -> Self {
        let mut draw = Draw(Noise::stream(seed, Stream::Conditions));
        let mut conditions = Self {
            // Published masses of the StampFly are 35 to 37 g with and without accessories, 36.8 g
            // weighed; the battery is a quarter of it.
            mass_spread: 0.04,
            inertia_spread: 0.2,
            // Two families of measurements of the same propellers differ by 25 %.
            thrust_spread: 0.1,
            // 5 % from motor to motor as measured, at most half of the difference between the
            // families.
            rotor_spread: 0.05,
            // At most 3 mm: a battery of a quarter of the mass, displaced by 12 mm.
            centre_spread: 0.0012,
            spread_limit: 2.5,
            // Magnets and brushes of motors from one bag.
            rotor_curve_spread: 0.05,
            rotor_place_spread: 0.0005,
            // 14 to 30 ms, of which 20 is nominal.
            rotor_lag_spread: 0.4,
            // 110 ms are measured from command to acceleration, of which the rotors take 20.
            collective_lag: draw.between(0.0, 0.09),
            // Two degrees about each axis: chip on board, board in frame. 1 % of scale, in addition
            // to the chip's own 0.5 %.
            imu_misalignment: 0.035,
            imu_scale: 0.01,
            imu_lever: 0.006,
            ceiling: draw.between(2.3, 3.2),
            ceiling_effect: 1.0,
            wall_effect: 1.0,
            vortex_ring: 1.0,
            room_side: draw.between(2.5, 6.0),
            // A rug, a doorstep, a bed. The edge of a table is a scene that tests build. The floor
            // does not move.
            floor_step: draw.step(),
            floor_step_distance: draw.between(0.4, 2.0),
            floor_step_bearing: draw.between(0.0, core::f64::consts::TAU),
            // Ranging error of the data sheets, ±20 to 25 mm: 10 mm at any distance, the rest
            // proportional to it.
            range_offset: 0.01,
            range_scale: 0.05,
            // Maximum range in the title of the VL53L3CX data sheet, and its cone of 25°.
            range_reach: 3.0,
            range_cone: 0.218,
            range_cover: draw.cover(),
            // Grey and white chart of the data sheet: a dark carpet to a white sheet of paper.
            floor_reflectance: draw.between(0.17, 0.88),
            // From an evening with closed curtains over an office (5) to a sunny day behind a
            // window (50): data sheet of the VL53L1X, § 3.1.
            ambient_light: draw.evenly_over_magnitudes(0.5, 50.0),
            baro_wander: 1.0,
            // One flight record shows +2.5 Pa; the sign on other specimens is unknown. Up to 0.3 m
            // either way in hover, 0.6 m at the floor.
            baro_wash: draw.between(-1.4, 1.4),
            baro_wash_floor: draw.between(0.0, 1.0),
            // A door moves once a minute. In a closed room it changes the pressure by 5 to 20 Pa.
            baro_doors: 1.0 / 60.0,
            baro_door: 18.0,
            // The recordings of carried vehicles fit scales from 0.79 to 1.11, and axes of 0.943
            // and 1.015.
            flow_scale: 0.12,
            flow_axis_scale: 0.05,
            flow_mounting: 0.035,
            // From a good to a poor floor. The delay is about the time between two pictures.
            flow_motion_noise: draw.between(0.03, 0.2),
            flow_delay: draw.between(0.004, 0.012),
            // PMW3901MB, data sheet.
            flow_largest_rate: 7.4,
            ..Self::GENTLE
        };
        // The number of battery draws varies, so they come last and shift no other draw.
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

    /// Light returned by the cover glass, 10⁶/s. Half of the range finders are clean (the StampFly
    /// has no window). 0.2 is a good window (10³/s at each of 200 detectors), 5 a fingerprint on
    /// it.
    fn cover(&mut self) -> f64 {
        let smeared = self.evenly_over_magnitudes(0.2, 5.0);
        if self.0.chance(0.5) { smeared } else { 0.0 }
    }

    /// Height of a floor step, m. Half of the floors are level; the other steps are 5 mm to 0.3 m
    /// high, one in four of them down.
    fn step(&mut self) -> f64 {
        let high = self.evenly_over_magnitudes(0.005, 0.3);
        let (level, down) = (self.0.chance(0.5), self.0.chance(0.25));
        match (level, down) {
            (true, _) => 0.0,
            (false, true) => -high,
            (false, false) => high,
        }
    }

    /// Battery state: new to worn out, from a cold hall to a hot afternoon, full to half empty,
    /// since a flight begins with the charge the last one left. With the StampFly's 0.06 Ω this
    /// gives 0.05 to 0.22 Ω immediately and half of that later, which matches the published 0.06 to
    /// 0.30 Ω.
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
