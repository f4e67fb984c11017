//! The parameters people may change, by name.
//!
//! One line per parameter: name, range, unit, field, meaning. Defaults are the fields' own. The log stores every
//! value, so a replay flies with the parameters of the flight.

use crate::config::VehicleConfig;

/// The name in flash of the transmitter the vehicle belongs to: the six bytes of its address, as one value, because half
/// an address is somebody else's.
pub const PEER: &str = "link.peer";

/// One parameter.
#[derive(Clone, Copy)]
pub struct Parameter {
    /// `function.target.parameter`.
    pub name: &'static str,
    /// Smallest value accepted.
    pub min: f32,
    /// Largest value accepted.
    pub max: f32,
    /// SI unit, `"1"` where there is none.
    pub unit: &'static str,
    /// What it does.
    pub meaning: &'static str,
    field: fn(&mut VehicleConfig) -> &mut f32,
}

/// Why a parameter was not changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ParameterError {
    /// There is no parameter of this name.
    Unknown,
    /// The value is outside the range, or not a number.
    OutOfRange {
        /// Smallest value accepted.
        min: f32,
        /// Largest value accepted.
        max: f32,
    },
}

impl core::fmt::Display for ParameterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Unknown => write!(f, "there is no such parameter"),
            Self::OutOfRange { min, max } => write!(f, "the value must be from {min} to {max}"),
        }
    }
}

impl core::error::Error for ParameterError {}

macro_rules! parameters {
    ($($name:literal [$min:literal, $max:literal] $unit:literal $($field:ident).+ => $meaning:literal;)+) => {
        /// Every parameter, in the order people look for them.
        pub const PARAMETERS: &[Parameter] = &[$(Parameter {
            name: $name, min: $min, max: $max, unit: $unit, meaning: $meaning,
            field: |config| &mut config.$($field).+,
        }),+];
    };
}

parameters! {
    "estimator.type" [0.0, 1.0] "1" estimator => "0: error-state Kalman filter, 1: complementary filter";
    "controller.type" [0.0, 1.0] "1" controller => "0: cascade, 1: geometric";

    "rate.roll.kp" [0.0, 0.01] "N*m/(rad/s)" cascade.rate.roll.kp => "roll rate gain";
    "rate.roll.ti" [0.01, 100.0] "s" cascade.rate.roll.ti => "roll rate integral time";
    "rate.roll.td" [0.0, 1.0] "s" cascade.rate.roll.td => "roll rate derivative time";
    "rate.pitch.kp" [0.0, 0.01] "N*m/(rad/s)" cascade.rate.pitch.kp => "pitch rate gain";
    "rate.pitch.ti" [0.01, 100.0] "s" cascade.rate.pitch.ti => "pitch rate integral time";
    "rate.pitch.td" [0.0, 1.0] "s" cascade.rate.pitch.td => "pitch rate derivative time";
    "rate.yaw.kp" [0.0, 0.01] "N*m/(rad/s)" cascade.rate.yaw.kp => "yaw rate gain";
    "rate.yaw.ti" [0.01, 100.0] "s" cascade.rate.yaw.ti => "yaw rate integral time";
    "rate.yaw.td" [0.0, 1.0] "s" cascade.rate.yaw.td => "yaw rate derivative time";
    "attitude.tilt.kp" [0.5, 20.0] "1/s" cascade.attitude.tilt_gain => "tilt gain";
    "attitude.heading.kp" [0.1, 20.0] "1/s" cascade.attitude.heading_gain => "heading gain";
    "position.pos.kp" [0.1, 5.0] "1/s" cascade.position.position_gain => "position gain";
    "position.vel.kp" [0.1, 20.0] "1/s" cascade.position.velocity.kp => "horizontal velocity gain";
    "position.vel.ti" [0.1, 100.0] "s" cascade.position.velocity.ti => "horizontal velocity integral time";
    "position.tilt.max" [0.05, 0.7] "rad" cascade.position.tilt_max => "largest tilt the position loop asks for";
    "altitude.alt.kp" [0.1, 5.0] "1/s" cascade.altitude.height_gain => "height gain";
    "altitude.vel.kp" [0.1, 20.0] "1/s" cascade.altitude.velocity.kp => "climb gain";
    "altitude.vel.ti" [0.1, 100.0] "s" cascade.altitude.velocity.ti => "climb integral time";
    "hover.thrust" [0.1, 0.6] "N" cascade.altitude.hover_thrust => "hover thrust before it is learned";

    "eskf.process.gyro_noise" [1e-5, 1.0] "rad/s/sqrt(Hz)" eskf.gyro_noise => "gyro noise density";
    "eskf.process.accel_noise" [1e-4, 10.0] "m/s^2/sqrt(Hz)" eskf.accel_noise => "accelerometer noise density";
    "eskf.process.gyro_bias_walk" [0.0, 0.1] "rad/s/sqrt(s)" eskf.gyro_bias_walk => "gyro bias random walk";
    "eskf.process.accel_bias_walk" [0.0, 1.0] "m/s^2/sqrt(s)" eskf.accel_bias_walk => "accelerometer bias random walk";
    "eskf.obs.tof_noise" [1e-3, 1.0] "m" eskf.tof_sigma => "range noise";
    "eskf.obs.flow_noise" [1e-3, 10.0] "rad/s" eskf.flow_sigma => "flow noise";
    "eskf.obs.baro_noise" [1e-2, 10.0] "m" eskf.baro_sigma => "barometer noise";
    "eskf.obs.mag_noise" [1e-3, 3.0] "rad" eskf.mag_sigma => "magnetic heading noise";
    "eskf.obs.gravity_noise" [1e-2, 20.0] "m/s^2" eskf.gravity_sigma => "noise of the accelerometer as an inclinometer";
    "eskf.gate" [1.0, 20.0] "1" eskf.gate => "innovation gate, standard deviations";
    "eskf.lockout" [0.05, 10.0] "s" eskf.lockout => "after this long at the gate the state moves to the sensor";

    "motor.duty.max" [0.1, 1.0] "1" motor.duty_max => "largest duty";
    "motor.slew.max" [1.0, 1000.0] "1/s" motor.slew_max => "largest change of duty";
}

impl Parameter {
    /// The value in this configuration.
    #[must_use]
    pub fn get(&self, config: &VehicleConfig) -> f32 {
        *(self.field)(&mut config.clone())
    }

    /// Changes the value.
    ///
    /// # Errors
    /// [`ParameterError::OutOfRange`]; the configuration is unchanged.
    pub fn set(&self, config: &mut VehicleConfig, value: f32) -> Result<(), ParameterError> {
        if !(self.min..=self.max).contains(&value) {
            return Err(ParameterError::OutOfRange { min: self.min, max: self.max });
        }
        *(self.field)(config) = value;
        Ok(())
    }
}

/// The parameter of this name.
///
/// # Errors
/// [`ParameterError::Unknown`].
pub fn find(name: &str) -> Result<&'static Parameter, ParameterError> {
    PARAMETERS.iter().find(|parameter| parameter.name == name).ok_or(ParameterError::Unknown)
}

/// Changes a parameter by name.
///
/// ```
/// use stampfly_board::{VehicleConfig, parameters};
/// let mut config = VehicleConfig::default();
/// parameters::set(&mut config, "eskf.obs.flow_noise", 0.2)?;
/// assert!(parameters::set(&mut config, "eskf.obs.flow_noise", f32::NAN).is_err());
/// assert_eq!(config.eskf.flow_sigma, 0.2);
/// # Ok::<(), parameters::ParameterError>(())
/// ```
///
/// # Errors
/// When there is no such parameter or the value is out of range; the configuration is unchanged.
pub fn set(config: &mut VehicleConfig, name: &str, value: f32) -> Result<(), ParameterError> {
    find(name)?.set(config, value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn every_default_is_in_range_and_every_name_is_unique() {
        let config = VehicleConfig::default();
        for (index, parameter) in PARAMETERS.iter().enumerate() {
            let value = parameter.get(&config);
            assert!((parameter.min..=parameter.max).contains(&value), "{} = {value}", parameter.name);
            assert!(PARAMETERS[..index].iter().all(|other| other.name != parameter.name), "{}", parameter.name);
        }
    }

    #[test]
    fn no_two_names_share_a_place_in_flash() {
        let names: Vec<&str> = PARAMETERS.iter().map(|parameter| parameter.name).chain([PEER]).collect();
        for (index, name) in names.iter().enumerate() {
            let key = stampfly_param::key(name);
            let twin = names[..index].iter().find(|other| stampfly_param::key(other) == key);
            assert!(twin.is_none(), "{name}");
        }
    }

    #[test]
    fn each_parameter_reaches_a_field_of_its_own() {
        for parameter in PARAMETERS {
            let mut config = VehicleConfig::default();
            let changed = if parameter.get(&config) == parameter.min { parameter.max } else { parameter.min };
            parameter.set(&mut config, changed).expect("the range includes its ends");
            for other in PARAMETERS {
                let expected =
                    if other.name == parameter.name { changed } else { other.get(&VehicleConfig::default()) };
                assert_eq!(other.get(&config), expected, "{} changed {}", parameter.name, other.name);
            }
        }
    }
}
