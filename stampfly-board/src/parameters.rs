//! The StampFly's parameters, by name.
//!
//! One line per parameter: name, range, unit, field, meaning. Defaults are the fields' own. The log stores every
//! value, so a replay flies with the parameters of the flight. [`stampfly_flight::parameters`] finds and changes them by
//! name.

use crate::config::{ControllerKind, EstimatorKind, VehicleConfig};
use stampfly_flight::parameters::{ParameterError, ParameterInfo, Parameters};

/// The name in flash of the transmitter the vehicle is paired with: the six bytes of its address as one value, so that a
/// power cut cannot leave half of an address.
pub const PEER: &str = "link.peer";

/// A line of the table.
struct Line {
    info: ParameterInfo<'static>,
    get: fn(&VehicleConfig) -> f32,
    /// Refuses a number that is no value of the field.
    set: fn(&mut VehicleConfig, f32) -> Option<()>,
}

/// What a parameter can be: a number, or one of several kinds by its number.
trait Value: Copy {
    fn number(self) -> f32;
    fn from_number(number: f32) -> Option<Self>;
}

impl Value for f32 {
    fn number(self) -> f32 {
        self
    }
    fn from_number(number: f32) -> Option<Self> {
        Some(number)
    }
}

macro_rules! kinds {
    ($($Kind:ident)+) => { $(
        impl Value for $Kind {
            fn number(self) -> f32 {
                Self::number(self)
            }
            fn from_number(number: f32) -> Option<Self> {
                Self::from_number(number)
            }
        }
    )+ };
}

kinds!(EstimatorKind ControllerKind);

macro_rules! parameters {
    ($($name:literal [$min:literal, $max:literal] $unit:literal $($field:ident).+ => $meaning:literal;)+) => {
        const TABLE: &[Line] = &[$(Line {
            info: ParameterInfo { name: $name, min: $min, max: $max, unit: $unit, meaning: $meaning },
            get: |config| config.$($field).+.number(),
            set: |config, number| {
                config.$($field).+ = Value::from_number(number)?;
                Some(())
            },
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

/// Every parameter, in the order of their numbers.
pub fn all() -> impl ExactSizeIterator<Item = ParameterInfo<'static>> {
    TABLE.iter().map(|line| line.info)
}

/// ```
/// use stampfly_board::VehicleConfig;
/// use stampfly_flight::parameters;
/// let mut config = VehicleConfig::default();
/// parameters::set(&mut config, "eskf.obs.flow_noise", 0.2)?;
/// assert!(parameters::set(&mut config, "eskf.obs.flow_noise", f32::NAN).is_err());
/// assert_eq!(config.eskf.flow_sigma, 0.2);
/// # Ok::<(), parameters::ParameterError>(())
/// ```
impl Parameters for VehicleConfig {
    fn describe(&self, index: usize) -> Option<ParameterInfo<'_>> {
        TABLE.get(index).map(|line| line.info)
    }

    fn get(&self, index: usize) -> Option<f32> {
        TABLE.get(index).map(|line| (line.get)(self))
    }

    fn set(&mut self, index: usize, value: f32) -> Result<(), ParameterError> {
        let Line { info: ParameterInfo { min, max, .. }, set, .. } = TABLE.get(index).ok_or(ParameterError::Unknown)?;
        if !(*min..=*max).contains(&value) {
            return Err(ParameterError::OutOfRange { min: *min, max: *max });
        }
        set(self, value).ok_or(ParameterError::OutOfRange { min: *min, max: *max })?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn every_default_is_in_range_and_every_name_is_unique() {
        let config = VehicleConfig::default();
        for (index, info) in all().enumerate() {
            let value = config.get(index).expect("in the table");
            assert!((info.min..=info.max).contains(&value), "{} = {value}", info.name);
            assert!(all().take(index).all(|other| other.name != info.name), "{}", info.name);
        }
    }

    #[test]
    fn a_kind_has_no_number_between_its_own() {
        let mut config = VehicleConfig::default();
        for refused in [0.5, 2.0, -1.0, f32::NAN] {
            assert!(config.set(0, refused).is_err() && config.set(1, refused).is_err(), "{refused}");
        }
        assert_eq!((config.set(0, 1.0), config.set(1, 1.0)), (Ok(()), Ok(())));
        assert_eq!((config.estimator, config.controller), (EstimatorKind::Complementary, ControllerKind::Geometric));
        assert_eq!((config.set(0, 0.0), config.estimator), (Ok(()), EstimatorKind::Eskf));
    }

    #[test]
    fn no_two_names_share_a_key_in_flash() {
        let names: Vec<&str> = all().map(|info| info.name).chain([PEER]).collect();
        for (index, name) in names.iter().enumerate() {
            let key = stampfly_param::key(name);
            let twin = names[..index].iter().find(|other| stampfly_param::key(other) == key);
            assert!(twin.is_none(), "{name}");
        }
    }

    #[test]
    fn each_parameter_is_a_field_of_its_own() {
        let default = VehicleConfig::default();
        for (index, info) in all().enumerate() {
            let mut config = VehicleConfig::default();
            let changed = if config.get(index) == Some(info.min) { info.max } else { info.min };
            config.set(index, changed).expect("the range includes its ends");
            for (other, of_other) in all().enumerate() {
                let expected = if other == index { Some(changed) } else { default.get(other) };
                assert_eq!(config.get(other), expected, "{} changed {}", info.name, of_other.name);
            }
        }
    }
}
