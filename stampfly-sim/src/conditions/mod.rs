//! Conditions of a flight: battery state, spread between specimens, floor, light and air.
//!
//! An [airframe](crate::plant::Airframe) contains what a designer decides; conditions contain what
//! the world decides. Each acts in one model and has a neutral value that disables this model.
//! [`Conditions::GENTLE`] holds the neutral values, [`Conditions::harsh`] draws values from the
//! seed, with the spread of recordings and data sheets.
//!
//! A row is either a quantity (`battery_temperature`) or a spread between specimens (`…_spread`,
//! `…_scale`), from which the model draws the specimen with the seed. For failures during a flight
//! use [`fault`](crate::fault).

mod draw;

use crate::plant::table::parameters;

parameters! {
    /// The conditions of a flight, each settable by name.
    ///
    /// ```
    /// use stampfly_sim::{Conditions, param::parameters};
    ///
    /// let mut conditions = Conditions::GENTLE;
    /// parameters::set(&mut conditions, "battery_temperature", 5.0)?;
    /// assert!(parameters::set(&mut conditions, "battery_temperature", 200.0).is_err());
    /// assert_ne!(Conditions::harsh(1, |_| true), Conditions::harsh(2, |_| true));
    /// # Ok::<(), stampfly_sim::param::ParameterError<f64>>(())
    /// ```
    Conditions,
    /// Neutral values: no model of this table acts.
    GENTLE {
        battery_age = 0.0 ["1"] in 0.0 ..= 1.5, "Wear of the battery: 0 is new, 1 at the end of its life.";
        battery_temperature = 25.0 ["degC"] in -20.0 ..= 60.0, "Temperature of the battery.";
        battery_drained = 0.0 ["1"] in 0.0 ..= 1.0, "Share of the charge that is gone at the start.";

        mass_spread = 0.0 ["1"] in 0.0 ..= 0.2, "Bound of the share by which vehicles differ in mass.";
        inertia_spread = 0.0 ["1"] in 0.0 ..= 0.3, "Bound of the share by which vehicles differ in each moment of inertia.";
        thrust_spread = 0.0 ["1"] in 0.0 ..= 0.2, "Bound of the share by which the propellers of one vehicle push more than those of another.";
        rotor_spread = 0.02 ["1"] in 0.0 ..= 0.1, "Standard deviation of the share by which one rotor of a vehicle pushes more than the next.";
        centre_spread = 0.0004 ["m"] in 0.0 ..= 0.004, "Standard deviation of the centre of mass from the middle of the rotors, along x and along y.";
        rotor_curve_spread = 0.0 ["1"] in 0.0 ..= 0.1, "Standard deviation of the share by which each motor's constant and resistance differ from the next one's.";
        rotor_place_spread = 0.0 ["m"] in 0.0 ..= 0.005, "Standard deviation of each rotor's place, along x and along y.";
        rotor_lag_spread = 0.0 ["1"] in 0.0 ..= 0.6, "Bound of the share by which the rotors of one vehicle are heavier to turn than those of another.";
        collective_lag = 0.0 ["s"] in 0.0 ..= 0.2, "Lag of the lift behind the rotors' thrust.";
        spread_limit = 10.0 ["1"] in 1.0 ..= 10.0, "Rotors and centres of mass lie no more standard deviations apart than this.";
        imu_misalignment = 0.0 ["rad"] in 0.0 ..= 0.1, "Bound of the angle about each axis by which the inertial sensor is soldered askew.";
        imu_scale = 0.0 ["1"] in 0.0 ..= 0.05, "Bound of the share by which each axis of the inertial sensor measures too much, beyond half a per cent.";
        imu_lever = 0.0 ["m"] in 0.0 ..= 0.05, "Bound of the distance of the inertial sensor from the centre of mass, along each axis.";

        ceiling = 0.0 ["m"] in 0.0 ..= 100.0, "Height of the ceiling; 0 is none.";
        ceiling_effect = 0.0 ["1"] in 0.0 ..= 2.0, "How much a ceiling draws the rotors, in units of theory.";
        wall_effect = 0.0 ["1"] in 0.0 ..= 5.0, "How much a wall draws the rotors, in units of theory.";
        vortex_ring = 0.0 ["1"] in 0.0 ..= 2.0, "What rotors lose in their own wake when they sink, in units of what is measured.";
        room_side = 0.0 ["m"] in 0.0 ..= 100.0, "Side of the room whose walls send the wake back; 0 is none.";

        floor_step = 0.0 ["m"] in -3.0 ..= 0.5, "How much higher the floor is beyond a line, a table or a rug; negative where it is lower.";
        floor_step_distance = 1.0 ["m"] in 0.2 ..= 100.0, "Distance of that line from the origin.";
        floor_step_bearing = 0.0 ["rad"] in -6.3 ..= 6.3, "Where it is, from north to east.";
        floor_north = 0.0 ["m/s"] in -3.0 ..= 3.0, "How fast the floor moves to the north: a ship's deck, a conveyor, a curtain's shadow.";
        floor_east = 0.0 ["m/s"] in -3.0 ..= 3.0, "How fast it moves to the east.";

        range_offset = 0.003 ["m"] in 0.0 ..= 0.05, "Bound of the offset of a range finder.";
        range_scale = 0.0 ["1"] in 0.0 ..= 0.1, "Bound of the share by which a range finder measures too long.";
        range_reach = 100.0 ["m"] in 0.5 ..= 100.0, "Longest range over a white floor (88 %) in the dark; above 4 m it is 4 m.";
        range_cone = 0.0 ["rad"] in 0.0 ..= 0.4, "Half of the angle that the range finder sees; 0 is a thin beam.";
        range_cover = 0.0 ["1e6/s"] in 0.0 ..= 5.0, "Light that comes back from the range finder's cover glass and from what is smeared on it.";
        floor_reflectance = 0.4 ["1"] in 0.02 ..= 1.0, "Share of the range finder's light that the floor scatters.";
        ambient_light = 0.0 ["1e3/s"] in 0.0 ..= 300.0, "Infrared light at each detector of the range finder, beyond a dim room's.";

        baro_wander = 0.0 ["1"] in 0.0 ..= 5.0, "Wander of the pressure within seconds, in units of what is recorded.";
        baro_wash = 1.0 ["1"] in -5.0 ..= 5.0, "Pressure of the propellers at the barometer, in units of what the vehicle says; negative where they suck.";
        baro_wash_floor = 2.0 ["1"] in 0.0 ..= 5.0, "How much more of that there is with the vehicle at the floor, as a share.";
        baro_doors = 0.0 ["1/s"] in 0.0 ..= 1.0, "How often a door is opened or shut.";
        baro_door = 18.0 ["Pa"] in 0.0 ..= 100.0, "Largest step of the pressure when a door is opened or shut.";

        flow_scale = 0.0 ["1"] in 0.0 ..= 0.3, "Bound of the share by which the flow sensor of one vehicle counts more than that of another.";
        flow_axis_scale = 0.03 ["1"] in 0.0 ..= 0.2, "Bound of the share by which each axis of a flow sensor counts more than that.";
        flow_mounting = 0.017453292519943295 ["rad"] in 0.0 ..= 0.2, "Bound of the angle by which the flow sensor is turned about the vertical.";
        flow_motion_noise = 0.0 ["1"] in 0.0 ..= 0.5, "Standard deviation of the flow of one picture, as a share of that flow.";
        flow_delay = 0.0 ["s"] in 0.0 ..= 0.05, "Age of the newest picture that a read has counted, beyond half a picture.";
        flow_largest_rate = 1000.0 ["rad/s"] in 0.5 ..= 1000.0, "Largest flow that the sensor follows.";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_neutral_value_is_in_its_range() {
        assert_eq!(stampfly_param::parameters::validate(&Conditions::GENTLE), Ok(()));
    }
}
