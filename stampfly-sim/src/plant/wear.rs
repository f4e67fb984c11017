//! What age and cold do to a lithium battery.
//!
//! A cell has reached the end of its life, by the usual definition, with 80 % of its capacity or with twice the resistance of a new one. Both
//! are taken to come evenly and together.
//!
//! The resistance of a cell follows Arrhenius' law, because what takes part in it does: conduction of the electrolyte and transfer at the
//! electrodes. Its activation energy is some 20 kJ/mol over the temperatures at which one flies (17 to 35 kJ/mol for the parts: Chen et al. 2020,
//! J. Electrochem. Soc. 167 080534; Marquis et al. 2019, 166 A3693): twice as much at 0 °C as at 25 °C, and four times at −20 °C, where cells are
//! found to have three to five times.
//!
//! Left out: that a battery warms by its own current, that a cold one gives less charge before it is empty, and the slow change of the
//! open-circuit voltage.

use super::BatterySpec;

/// Share by which the resistance has grown at the end of life.
const GROWTH: f64 = 1.0;
/// Share of the capacity that is lost at the end of life.
const LOSS: f64 = 0.2;
/// Activation energy over the gas constant, K: 20 kJ/mol.
const ACTIVATION: f64 = 20_000.0 / 8.314_46;
/// Temperature at which resistances are given, °C.
const REFERENCE: f64 = 25.0;
/// Of the ice point, K.
const ZERO: f64 = 273.15;

impl BatterySpec {
    /// The same battery after so much wear: 0 is new, 1 the end of its life.
    #[must_use]
    pub fn worn(self, age: f64) -> Self {
        let growth = 1.0 + GROWTH * age;
        Self {
            resistance: self.resistance * growth,
            polarisation: self.polarisation * growth,
            capacity: self.capacity * (1.0 - LOSS * age),
            ..self
        }
    }

    /// The same battery at this temperature, °C; resistances are given at 25 °C.
    #[must_use]
    pub fn at(self, celsius: f64) -> Self {
        let growth = libm::exp(ACTIVATION * (1.0 / (ZERO + celsius) - 1.0 / (ZERO + REFERENCE)));
        Self { resistance: self.resistance * growth, polarisation: self.polarisation * growth, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_battery_at_25_degrees_is_the_battery() {
        assert_eq!(BatterySpec::CELL.worn(0.0).at(25.0), BatterySpec::CELL);
    }

    #[test]
    fn at_the_end_of_its_life_it_has_twice_the_resistance_and_80_per_cent_of_the_capacity() {
        let old = BatterySpec::CELL.worn(1.0);
        assert_eq!(old.resistance, 2.0 * BatterySpec::CELL.resistance);
        assert!((old.capacity / BatterySpec::CELL.capacity - 0.8).abs() < 1e-12);
    }

    #[test]
    fn resistance_doubles_at_the_ice_point_and_is_three_to_five_times_as_much_at_20_below() {
        let times = |celsius| BatterySpec::CELL.at(celsius).resistance / BatterySpec::CELL.resistance;
        assert!((1.9..2.3).contains(&times(0.0)), "{}", times(0.0));
        assert!((3.0..5.0).contains(&times(-20.0)), "{}", times(-20.0));
        assert!((0.7..0.85).contains(&times(35.0)), "{}", times(35.0));
    }
}
