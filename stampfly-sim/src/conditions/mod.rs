//! Under what conditions a vehicle flies: how worn and how cold its battery is, how far one specimen lies from the next, what floor, light
//! and air it meets.
//!
//! An [airframe](crate::plant::Airframe) says what a vehicle was designed to be; these are the numbers of the world. Each acts in one model, and
//! each has a neutral value, with which that model is not there at all: [`Conditions::GENTLE`] is a vehicle as its maker would like to
//! show it. [`Conditions::harsh`] draws them from the seed, as far apart as recordings and data sheets are.
//!
//! A row is either the thing itself (`battery_temperature`) or how far specimens lie apart (`…_spread`, `…_scale`): the specimen is drawn
//! from the seed by the model that has it. Not for what a vehicle's designer decides, nor for [what goes wrong](crate::fault) in a flight.

mod draw;

use crate::plant::table::parameters;

parameters! {
    /// The conditions of a flight, each settable by name.
    ///
    /// ```
    /// use stampfly_sim::Conditions;
    ///
    /// let mut conditions = Conditions::GENTLE;
    /// conditions.set("battery_temperature", 5.0)?;
    /// assert!(conditions.set("battery_temperature", 200.0).is_err());
    /// assert_ne!(Conditions::harsh(1, |_| true), Conditions::harsh(2, |_| true));
    /// # Ok::<(), stampfly_sim::plant::ParameterError>(())
    /// ```
    Conditions,
    /// No model of this table acts.
    GENTLE {
        battery_age = 0.0 ["1"] in 0.0 ..= 1.5, "Wear of the battery: 0 is new, 1 at the end of its life.";
        battery_temperature = 25.0 ["degC"] in -20.0 ..= 60.0, "Temperature of the battery.";
        battery_drained = 0.0 ["1"] in 0.0 ..= 1.0, "Share of the charge that is gone at the start.";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_neutral_value_is_in_its_range() {
        for row in Conditions::GENTLE.iter() {
            assert!((row.range.0..=row.range.1).contains(&row.value), "{}", row.name);
        }
    }
}
