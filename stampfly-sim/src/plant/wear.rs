//! Effects of age and temperature on a lithium battery.
//!
//! By the usual definition a cell is at the end of its life at 80 % of its capacity or at twice the
//! resistance of a new one. Both are assumed to progress linearly and together.
//!
//! The resistance follows Arrhenius' law, as do conduction of the electrolyte and charge transfer
//! at the electrodes. The activation energy is about 20 kJ/mol at flight temperatures (17 to 35
//! kJ/mol for the parts: Chen et al. 2020, J. Electrochem. Soc. 167 080534; Marquis et al. 2019,
//! 166 A3693): twice the resistance at 0 °C as at 25 °C, and four times at −20 °C, where three to
//! five times are measured.
//!
//! Neglected: self-heating by the current, the lower usable capacity of a cold battery, and ageing
//! of the open-circuit voltage.

use super::BatterySpec;

/// Relative growth of the resistance up to the end of life.
const GROWTH: f64 = 1.0;
/// Relative loss of capacity up to the end of life.
const LOSS: f64 = 0.2;
/// Activation energy over the gas constant, K: 20 kJ/mol.
const ACTIVATION: f64 = 20_000.0 / 8.314_46;
/// Temperature at which resistances are given, °C.
const REFERENCE: f64 = 25.0;
/// 0 °C in K.
const ZERO: f64 = 273.15;

impl BatterySpec {
    /// The same battery after ageing: 0 is new, 1 the end of its life.
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
