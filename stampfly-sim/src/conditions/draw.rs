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
        let mut conditions = Self::GENTLE;
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
            for row in conditions.iter() {
                assert!((row.range.0..=row.range.1).contains(&row.value), "seed {seed}: {} {}", row.name, row.value);
            }
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
