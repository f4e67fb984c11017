//! The StampFly's parameters, by name.
//!
//! One line per parameter: name, range, unit, field, meaning. Ranges exclude what no vehicle could fly with alone, and
//! [`rules`](crate::rules) what it could not fly with together. Defaults are the fields' own. The log stores every
//! value, so a replay flies with the parameters of the flight. [`stampfly_flight::parameters`] finds and changes them by name.
//! Those marked `in_flight` are factors that a loop applies afresh in every step: none is part of a state, a limit or what protects the vehicle.
//!
//! ```
//! let mut config = stampfly_board::VehicleConfig::default();
//! assert!(stampfly_flight::parameters::set(&mut config, "eskf.obs.flow_noise", 0.2).is_ok());
//! let refused = stampfly_flight::parameters::set(&mut config, "position.tilt.max", 0.7).unwrap_err().to_string();
//! assert!(refused.starts_with("position.tilt.max with failsafe.tip.tilt: a tilt that the position loop asks for"));
//! ```

use crate::config::{ControllerKind, EstimatorKind, VehicleConfig};
use crate::rules::RULES;
use crate::schedule::Id;
use stampfly_flight::parameters::ParameterError;
use stampfly_param::{Conflict, rules};

/// The name in flash of the transmitter the vehicle is paired with: all of its address is one value, which no power cut can halve.
pub const PEER: &str = "link.peer";
/// The name in flash of the vehicle's key. It is no parameter: nothing lists or logs it.
pub const KEY: &str = "link.key";

stampfly_flight::parameter_kinds!(EstimatorKind ControllerKind);

stampfly_flight::parameter_table! { VehicleConfig, check = |config, about| {
        let name = about.map(|index| TABLE.get(index).map_or("", |line| line.info.name));
        let refused = |Conflict { parameters, reason }| ParameterError::Conflict { parameters, reason };
        rules::check(RULES, config, name).map_err(refused)
    }, corrections = corrections;
    "estimator.type" [0.0, 1.0] "1" estimator => "0: error-state Kalman filter, 1: complementary filter";
    "controller.type" [0.0, 2.0] "1" controller => "0: cascade, 1: geometric, 2: cascade with incremental inner loop";

    "rate.roll.kp" [0.0002, 0.01] "N*m/(rad/s)" cascade.rate.roll.kp => "roll rate gain", in_flight;
    "rate.roll.ti" [0.01, 100.0] "s" cascade.rate.roll.ti => "roll rate integral time", in_flight;
    "rate.roll.td" [0.0, 0.2] "s" cascade.rate.roll.td => "roll rate derivative time", in_flight;
    "rate.pitch.kp" [0.00025, 0.01] "N*m/(rad/s)" cascade.rate.pitch.kp => "pitch rate gain", in_flight;
    "rate.pitch.ti" [0.01, 100.0] "s" cascade.rate.pitch.ti => "pitch rate integral time", in_flight;
    "rate.pitch.td" [0.0, 0.2] "s" cascade.rate.pitch.td => "pitch rate derivative time", in_flight;
    "rate.yaw.kp" [0.0, 0.002] "N*m/(rad/s)" cascade.rate.yaw.kp => "yaw rate gain", in_flight;
    "rate.yaw.ti" [0.01, 100.0] "s" cascade.rate.yaw.ti => "yaw rate integral time", in_flight;
    "rate.yaw.td" [0.0, 1.0] "s" cascade.rate.yaw.td => "yaw rate derivative time", in_flight;
    "indi.roll.bandwidth" [5.0, 100.0] "1/s" indi.bandwidth.x => "incremental loop: roll acceleration per rate error", in_flight;
    "indi.pitch.bandwidth" [5.0, 100.0] "1/s" indi.bandwidth.y => "incremental loop: pitch acceleration per rate error", in_flight;
    "indi.yaw.bandwidth" [2.0, 50.0] "1/s" indi.bandwidth.z => "incremental loop: yaw acceleration per rate error", in_flight;
    "indi.roll.smoothing" [0.01, 10.0] "s" indi.smoothing.x => "incremental loop: roll, filter of the increment", in_flight;
    "indi.pitch.smoothing" [0.01, 10.0] "s" indi.smoothing.y => "incremental loop: pitch, filter of the increment", in_flight;
    "indi.yaw.smoothing" [0.01, 10.0] "s" indi.smoothing.z => "incremental loop: yaw, filter of the increment", in_flight;
    "attitude.tilt.kp" [2.0, 20.0] "1/s" cascade.attitude.tilt_gain => "tilt gain", in_flight;
    "attitude.heading.kp" [0.1, 20.0] "1/s" cascade.attitude.heading_gain => "heading gain", in_flight;
    "position.pos.kp" [0.1, 5.0] "1/s" cascade.position.position_gain => "position gain", in_flight;
    "position.vel.kp" [0.5, 20.0] "1/s" cascade.position.velocity.kp => "horizontal velocity gain", in_flight;
    "position.vel.ti" [0.1, 100.0] "s" cascade.position.velocity.ti => "horizontal velocity integral time", in_flight;
    "position.tilt.max" [0.05, 0.7] "rad" cascade.position.tilt_max => "largest tilt the position loop asks for";
    "altitude.alt.kp" [0.1, 5.0] "1/s" cascade.altitude.height_gain => "height gain", in_flight;
    "altitude.vel.kp" [1.0, 20.0] "1/s" cascade.altitude.velocity.kp => "climb gain", in_flight;
    "altitude.vel.ti" [0.1, 100.0] "s" cascade.altitude.velocity.ti => "climb integral time", in_flight;
    "hover.thrust" [0.3, 0.6] "N" cascade.altitude.hover_thrust => "hover thrust before it is learned";

    "eskf.process.gyro_noise" [1e-5, 0.03] "rad/s/sqrt(Hz)" eskf.gyro_noise => "gyro noise density";
    "eskf.process.accel_noise" [1e-4, 10.0] "m/s^2/sqrt(Hz)" eskf.accel_noise => "accelerometer noise density";
    "eskf.process.accel_vibration" [0.0, 10.0] "1" eskf.accel_vibration => "share of vibration that is accelerometer noise";
    "eskf.process.gyro_bias_walk" [0.0, 0.1] "rad/s/sqrt(s)" eskf.gyro_bias_walk => "gyro bias random walk";
    "eskf.process.accel_bias_walk" [0.0, 0.3] "m/s^2/sqrt(s)" eskf.accel_bias_walk => "accelerometer bias random walk";
    "eskf.obs.tof_noise" [1e-3, 0.3] "m" eskf.tof_sigma => "range noise";
    "eskf.obs.flow_noise" [1e-3, 3.0] "rad/s" eskf.flow_sigma => "flow noise";
    "eskf.obs.baro_noise" [1e-2, 10.0] "m" eskf.baro_sigma => "barometer noise";
    "eskf.obs.mag_noise" [1e-3, 3.0] "rad" eskf.mag_sigma => "magnetic heading noise";
    "eskf.obs.gravity_noise" [1e-2, 20.0] "m/s^2" eskf.gravity_sigma => "noise of the accelerometer as an inclinometer";
    "eskf.gate" [1.0, 20.0] "1" eskf.gate => "innovation gate, standard deviations";
    "eskf.lockout" [0.05, 10.0] "s" eskf.lockout => "after this long at the gate the state moves to the sensor";

    "motor.duty.max" [0.7, 1.0] "1" motor.duty_max => "largest duty";
    "motor.slew.max" [5.0, 1000.0] "1/s" motor.slew_max => "largest change of duty";

    "mode.arming.tilt" [0.05, 0.7] "rad" mode.arming_tilt => "largest tilt that allows arming";
    "mode.arming.throttle" [0.01, 0.09] "1" mode.throttle_rest => "largest throttle that allows arming in a manual mode";
    "mode.takeoff.throttle" [0.1, 0.5] "1" mode.throttle_take_off => "throttle that takes off in a manual mode";
    "mode.takeoff.delay" [0.1, 2.0] "s" mode.spool => "time between arming and a take-off by itself";
    "mode.armed.timeout" [3.0, 60.0] "s" mode.armed_timeout => "armed without a take-off, it disarms after this long";
    "mode.link.back" [0.2, 10.0] "s" mode.link_back => "a lost link counts as back when heard for this long";
    "mode.blind.timeout" [0.0, 3.0] "s" mode.blind => "without height it lands after this long";
    "mode.adrift.timeout" [0.0, 10.0] "s" mode.adrift => "without horizontal velocity and without a pilot it lands after this long";
    "mode.link.timeout" [0.0, 60.0] "s" mode.hover_without_link => "without a link it hovers this long, then lands";
    "mode.held.height" [0.11, 0.5] "m" mode.held_height => "above this height somebody holds it";
    "mode.standing.height" [0.05, 0.1] "m" mode.standing_height => "below this height it stands again";
    "mode.button.release" [0.5, 10.0] "s" mode.button_release => "presses count again after a stop and this long released";
    "button.click.double" [0.2, 1.0] "s" button.double_click => "longest time between the clicks of a double click";
    "button.hold.pair" [1.0, 4.0] "s" button.hold_pair => "a press this long pairs";
    "button.hold.reset" [4.5, 20.0] "s" button.hold_reset => "a press this long restarts";

    "monitor.without" [0.0, 4095.0] "1" monitor.without => "hypotheses about sensors that are not asked, a bit each";

    "failsafe.impact.flying" [20.0, 150.0] "m/s^2" failsafe.impact => "specific force of an impact";
    "failsafe.impact.landing" [20.0, 150.0] "m/s^2" failsafe.landing_impact => "specific force of an impact while landing";
    "failsafe.touch.height" [0.0, 1.0] "m" failsafe.touch_height => "a push from below this near to the ground is a touchdown";
    "failsafe.touch.speed" [0.3, 3.0] "m/s" failsafe.touch_speed => "sink rate of a fall, whose end is an impact";
    "failsafe.impact.sigmas" [3.0, 20.0] "1" failsafe.impact_sigmas => "impact, standard deviations of the vibration";
    "failsafe.rate.max" [5.0, 34.0] "rad/s" failsafe.rate => "rate at which the motors stop";
    "failsafe.tumble.tilt" [0.8, 3.0] "rad" failsafe.tumble_tilt => "tilt of a vehicle that tumbles";
    "failsafe.tumble.time" [0.05, 2.0] "s" failsafe.tumble_time => "tilted for this long it tumbles";
    "failsafe.tip.tilt" [0.3, 1.3] "rad" failsafe.tip_tilt => "tilt of a vehicle that tips over while it takes off";
    "failsafe.tip.time" [0.02, 1.0] "s" failsafe.tip_time => "tilted for this long it tips over";
    "failsafe.lift.tilt" [0.1, 1.3] "rad" failsafe.lift_tilt => "tilt of a vehicle that tips on a leg while it takes off";
    "failsafe.lift.height" [0.0, 0.2] "m" failsafe.lift_height => "below this a leg may still touch the ground";
    "failsafe.lift.lead" [0.0, 0.2] "s" failsafe.lift_lead => "that tilt is the one in so many seconds, if it goes on turning";
    "failsafe.weak.roll" [0.0001, 0.1] "N*m" failsafe.weak_roll => "torque about roll that betrays a weak motor";
    "failsafe.weak.pitch" [0.0001, 0.1] "N*m" failsafe.weak_pitch => "torque about pitch that betrays a weak motor";
    "failsafe.weak.time" [0.02, 2.0] "s" failsafe.weak_motor_time => "for this long it is a weak motor";
    "failsafe.imu.degraded" [0.005, 0.02] "s" failsafe.imu_degraded => "silence of a degraded inertial sensor";
    "failsafe.imu.lost" [0.02, 0.1] "s" failsafe.imu_lost => "silence of a lost inertial sensor, stops the motors";
    "failsafe.link.timeout" [0.1, 5.0] "s" failsafe.link_silence => "silence of a lost link";
    "failsafe.battery.low" [3.2, 4.0] "V" failsafe.battery_low => "low battery: warns, no arming";
    "failsafe.battery.critical" [2.5, 3.2] "V" failsafe.battery_critical => "critical battery: lands";
    "failsafe.battery.idle" [0.2, 10.0] "A" failsafe.idle_current => "a disarmed vehicle that takes more has a motor that turns";
    "failsafe.battery.usb" [2.5, 3.6] "V" failsafe.usb => "disarmed below this it has no battery, no arming";
    "failsafe.battery.hysteresis" [0.0, 0.3] "V" failsafe.battery_hysteresis => "an alert of the battery clears this much higher";
    "failsafe.battery.time" [0.1, 20.0] "s" failsafe.battery_time => "time constant of the voltage's low-pass";
    "failsafe.power.timeout" [0.2, 10.0] "s" failsafe.power_silence => "silence of a lost battery monitor";
    "failsafe.aiding.timeout" [0.2, 10.0] "s" failsafe.aiding_silence => "silence of lost range or flow in the air";
    "failsafe.mismatch.tilt" [0.05, 0.7] "rad" failsafe.tilt_mismatch => "gravity and tilt so far apart on the ground";
    "failsafe.mismatch.time" [0.1, 5.0] "s" failsafe.tilt_mismatch_time => "for this long apart is an alert";

    "landing.descent.speed" [0.2, 1.0] "m/s" landing.descent => "descent";
    "landing.touchdown.speed" [0.12, 0.2] "m/s" landing.touchdown => "descent at the ground";
    "landing.flare.height" [0.05, 2.0] "m" landing.flare_height => "below this height the descent slows down";
    "landing.ceiling.height" [0.04, 0.2] "m" landing.ceiling_height => "below this height the thrust ceiling falls";
    "landing.ceiling.share" [0.3, 0.75] "1" landing.ceiling_share => "where the thrust ceiling ends, share of hover thrust";
    "landing.ceiling.time" [0.1, 5.0] "s" landing.ceiling_time => "how long the thrust ceiling falls";
    "landing.still.speed" [0.02, 0.1] "m/s" landing.still_speed => "slower than this is not sinking";
    "landing.still.time" [0.3, 10.0] "s" landing.stall_time => "not sinking this long, the thrust ceiling falls at any height";
    "landing.touchdown.time" [0.1, 2.0] "s" landing.touchdown_time => "not sinking this long under the ceiling is touchdown";
    "takeoff.airborne.rise" [0.02, 0.3] "m" landing.airborne_rise => "a rise that is airborne";
    "takeoff.airborne.speed" [0.1, 0.5] "m/s" landing.airborne_speed => "a climb rate that is airborne";
    "takeoff.ceiling" [1.05, 10.0] "1" landing.takeoff_ceiling => "largest thrust of a take-off at first, share of hover thrust";
    "takeoff.ceiling.rise" [0.0, 10.0] "1/s" landing.takeoff_ceiling_rise => "it rises so fast";
    "takeoff.arrived.band" [0.02, 0.3] "m" landing.takeoff_band => "take-off has arrived this close to its goal";
    "takeoff.arrived.speed" [0.05, 0.5] "m/s" landing.takeoff_speed => "take-off has arrived slower than this";
    "takeoff.arrived.time" [0.1, 5.0] "s" landing.takeoff_settle => "arrived for this long, take-off is complete";
    "takeoff.limit.time" [2.0, 14.0] "s" landing.takeoff_limit => "take-off is complete after this long in any case";

    "navigator.takeoff.height" [0.2, 3.0] "m" navigator.take_off_height => "take-off height when a command names none";
    "navigator.takeoff.speed" [0.1, 2.0] "m/s" navigator.take_off_speed => "take-off speed when a command names none";
    "navigator.route.speed" [0.05, 5.0] "m/s" navigator.route_speed => "way-point speed when a command names none";
    "navigator.stick.speed" [0.05, 5.0] "m/s" navigator.stick_speed => "horizontal speed at full stick";
    "navigator.stick.climb" [0.05, 2.0] "m/s" navigator.climb_rate => "climb rate at full throttle stick";
    "navigator.stick.sink" [0.05, 2.0] "m/s" navigator.sink_rate => "rate of descent at full throttle stick down";
    "navigator.stick.turn" [0.1, 6.0] "rad/s" navigator.turn_rate => "rate of turn at full yaw stick";
    "navigator.height.min" [0.1, 0.5] "m" navigator.height_min => "least height over the place of take-off";
    "navigator.height.max" [0.5, 100.0] "m" navigator.height_max => "largest height over the place of take-off";
    "navigator.waypoint.radius" [0.03, 1.0] "m" navigator.reached => "a way-point is reached this close";
    "navigator.leash.length" [0.2, 5.0] "m" navigator.leash => "the path waits for a vehicle farther away";
    "navigator.landing.lead" [0.05, 1.0] "m" navigator.landing_lead => "while landing the path is this far below at most";
    "navigator.horizontal.speed" [0.1, 5.0] "m/s" navigator.limits.horizontal.speed => "largest speed north and east";
    "navigator.horizontal.accel" [0.1, 5.0] "m/s^2" navigator.limits.horizontal.acceleration => "largest acceleration north and east";
    "navigator.horizontal.jerk" [1.0, 50.0] "m/s^3" navigator.limits.horizontal.jerk => "largest jerk north and east";
    "navigator.vertical.speed" [0.2, 2.0] "m/s" navigator.limits.vertical.speed => "largest speed up and down";
    "navigator.vertical.accel" [0.1, 5.0] "m/s^2" navigator.limits.vertical.acceleration => "largest acceleration up and down";
    "navigator.vertical.jerk" [1.0, 50.0] "m/s^3" navigator.limits.vertical.jerk => "largest jerk up and down";
    "navigator.heading.rate" [0.1, 6.0] "rad/s" navigator.limits.heading.speed => "largest rate of turn";
    "navigator.heading.accel" [0.5, 20.0] "rad/s^2" navigator.limits.heading.acceleration => "largest acceleration of the turn";
    "navigator.heading.jerk" [5.0, 200.0] "rad/s^3" navigator.limits.heading.jerk => "largest jerk of the turn";

    "authority.stick.dead_band" [0.0, 0.1] "1" authority.dead_band => "sticks this close to their centre are centred";
    "authority.stick.take_over" [0.1, 0.9] "1" mode.take_over => "deflection that takes over from a program";
    "authority.stick.time" [0.0, 1.0] "s" mode.take_over_time => "the sticks take over after this long";
    "authority.switch.debounce" [0.04, 0.5] "s" mode.switch_debounce => "a switch counts after this long";
    "authority.pilot.back" [0.2, 10.0] "s" authority.back => "after a silence, sticks count when heard for this long";
    "authority.pilot.timeout" [0.1, 5.0] "s" authority.stale => "a pilot's frame as old as this counts as none";
    "link.unauthenticated" [0.0, 1.0] "1" accept_unauthenticated => "1: packets without a key may fly it, 0: they are refused";
}

/// Which runnables hold the parameters whose names begin so. Those of link and sensors apply from the next start.
const HOLDERS: &[(&[&str], &[Id])] = &[
    (&["estimator.", "eskf."], &[Id::estimation]),
    (&["monitor."], &[Id::monitor]),
    (&["failsafe."], &[Id::failsafe]),
    (&["landing.", "takeoff."], &[Id::landing]),
    (&["authority.stick.dead_band", "authority.pilot.back"], &[Id::command]),
    (&["authority.pilot.timeout"], &[Id::mode, Id::command]),
    (&["mode.", "authority."], &[Id::mode]),
    (&["navigator.height.max"], &[Id::mode, Id::navigation]),
    (&["navigator."], &[Id::navigation]),
    (&["motor."], &[Id::actuation]),
    (&["button."], &[Id::button]),
    (&["link.", "calibration."], &[]),
    (&[""], &[Id::control]),
];

/// The runnables that hold the parameter of this name.
#[must_use]
pub fn holders(name: &str) -> &'static [Id] {
    let begins = |(beginnings, _): &&(&[&str], _)| beginnings.iter().any(|beginning| name.starts_with(beginning));
    HOLDERS.iter().find(begins).map_or(&[], |(_, holders)| *holders)
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_flight::parameters::{Parameters, Value};
    use stampfly_types::Duration;
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
        for refused in [0.5, 3.0, -1.0, f32::NAN] {
            assert!(config.set(0, refused).is_err() && config.set(1, refused).is_err(), "{refused}");
        }
        assert_eq!((config.set(0, 1.0), config.set(1, 1.0)), (Ok(()), Ok(())));
        assert_eq!((config.estimator, config.controller), (EstimatorKind::Complementary, ControllerKind::Geometric));
        assert_eq!(
            (config.set(0, 2.0), config.set(1, 2.0)),
            (Err(ParameterError::OutOfRange { min: 0.0, max: 1.0 }), Ok(()))
        );
        assert_eq!(config.controller, ControllerKind::Indi);
        assert_eq!((config.set(0, 0.0), config.estimator), (Ok(()), EstimatorKind::Eskf));
    }

    #[test]
    fn a_time_comes_back_exactly() {
        let comes_back = |time: Duration| Value::from_number(time.number()) == Some(time);
        for micros in (0..16_000_000).step_by(997).chain(15_999_900..=16_000_000) {
            assert!(comes_back(Duration::from_micros(micros)), "{micros} us");
        }
        // Above, a number is coarser than a microsecond; what was set by one still comes back.
        for step in 0..4_400u16 {
            let set = Duration::from_seconds(16.0 + f32::from(step) * 0.010_01);
            assert!(comes_back(set), "{set}");
        }
    }

    /// The log of a flight has every parameter as a number, and a replay sets them one by one.
    #[test]
    fn the_numbers_of_a_flight_give_its_configuration() {
        let mut flown = VehicleConfig::default();
        flown.failsafe.tumble_time = Duration::from_micros(123_457);
        flown.mode.armed_timeout = Duration::from_micros(9_999_999);
        flown.navigator.height_max = 2.1;
        let mut replayed = VehicleConfig::default();
        for (index, _) in all().enumerate() {
            replayed.set(index, flown.get(index).expect("in the table")).expect("in range");
        }
        assert_eq!(replayed, flown);
    }

    #[test]
    fn no_two_names_share_a_key_in_flash() {
        let names: Vec<&str> = all().map(|info| info.name).chain([PEER, KEY]).collect();
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
