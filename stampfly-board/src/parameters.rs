//! The StampFly's parameters, by name.
//!
//! Each has its meaning, name, field, range and unit. Ranges exclude what no vehicle could fly with
//! alone, and [`rules`](crate::rules) what it could not fly with together. Defaults are the fields'
//! own. The log stores every value, so a replay flies with the parameters of the flight.
//! [`stampfly_param::parameters`](mod@stampfly_param::parameters) finds and changes them by name.
//! Those marked `in_flight` are factors that a loop applies afresh in every step: none is part of a
//! state, a limit or a protection of the vehicle.
//!
//! ```
//! use stampfly_param::parameters;
//! let mut config = stampfly_board::VehicleConfig::default();
//! assert!(parameters::set(&mut config, "eskf.obs.flow_noise", 0.2).is_ok());
//! let refused = parameters::set(&mut config, "position.tilt.max", 0.7).unwrap_err().to_string();
//! let conflict = "position.tilt.max with failsafe.tip.tilt: a tilt that the position loop asks for";
//! assert!(refused.starts_with(conflict));
//! ```

use crate::config::{ControllerKind, EstimatorKind, VehicleConfig};
use crate::rules::RULES;
use crate::schedule::Id;
use stampfly_param::{ParameterInfo, ParameterTable, parameter_enums, parameters};

/// The name in flash of the transmitter the vehicle is paired with: all of its address is one value, which no power cut can halve.
pub const PEER: &str = "link.peer";
/// The name in flash of the vehicle's key. It is no parameter: nothing lists or logs it.
pub const KEY: &str = "link.key";

parameter_enums!(EstimatorKind, ControllerKind);

parameters! {
    impl VehicleConfig {
        /// 0: error-state Kalman filter, 1: complementary filter
        "estimator.type" = estimator in [0.0, 1.0] "1";
        /// 0: cascade, 1: geometric, 2: cascade with incremental inner loop
        "controller.type" = controller in [0.0, 2.0] "1";

        /// roll rate gain
        "rate.roll.kp" = cascade.rate.roll.kp in [0.0002, 0.01] "N*m/(rad/s)", in_flight;
        /// roll rate integral time
        "rate.roll.ti" = cascade.rate.roll.ti in [0.01, 100.0] "s", in_flight;
        /// roll rate derivative time
        "rate.roll.td" = cascade.rate.roll.td in [0.0, 0.2] "s", in_flight;
        /// pitch rate gain
        "rate.pitch.kp" = cascade.rate.pitch.kp in [0.00025, 0.01] "N*m/(rad/s)", in_flight;
        /// pitch rate integral time
        "rate.pitch.ti" = cascade.rate.pitch.ti in [0.01, 100.0] "s", in_flight;
        /// pitch rate derivative time
        "rate.pitch.td" = cascade.rate.pitch.td in [0.0, 0.2] "s", in_flight;
        /// yaw rate gain
        "rate.yaw.kp" = cascade.rate.yaw.kp in [0.0, 0.002] "N*m/(rad/s)", in_flight;
        /// yaw rate integral time
        "rate.yaw.ti" = cascade.rate.yaw.ti in [0.01, 100.0] "s", in_flight;
        /// yaw rate derivative time
        "rate.yaw.td" = cascade.rate.yaw.td in [0.0, 1.0] "s", in_flight;
        /// incremental loop: roll acceleration per rate error
        "indi.roll.bandwidth" = indi.bandwidth.x in [5.0, 100.0] "1/s", in_flight;
        /// incremental loop: pitch acceleration per rate error
        "indi.pitch.bandwidth" = indi.bandwidth.y in [5.0, 100.0] "1/s", in_flight;
        /// incremental loop: yaw acceleration per rate error
        "indi.yaw.bandwidth" = indi.bandwidth.z in [2.0, 50.0] "1/s", in_flight;
        /// incremental loop: roll, filter of the increment
        "indi.roll.smoothing" = indi.smoothing.x in [0.01, 10.0] "s", in_flight;
        /// incremental loop: pitch, filter of the increment
        "indi.pitch.smoothing" = indi.smoothing.y in [0.01, 10.0] "s", in_flight;
        /// incremental loop: yaw, filter of the increment
        "indi.yaw.smoothing" = indi.smoothing.z in [0.01, 10.0] "s", in_flight;
        /// tilt gain
        "attitude.tilt.kp" = cascade.attitude.tilt_gain in [2.0, 20.0] "1/s", in_flight;
        /// heading gain
        "attitude.heading.kp" = cascade.attitude.heading_gain in [0.1, 20.0] "1/s", in_flight;
        /// position gain
        "position.pos.kp" = cascade.position.position_gain in [0.1, 5.0] "1/s", in_flight;
        /// horizontal velocity gain
        "position.vel.kp" = cascade.position.velocity.kp in [0.5, 20.0] "1/s", in_flight;
        /// horizontal velocity integral time
        "position.vel.ti" = cascade.position.velocity.ti in [0.1, 100.0] "s", in_flight;
        /// largest tilt the position loop asks for
        "position.tilt.max" = cascade.position.tilt_max in [0.05, 0.7] "rad";
        /// height gain
        "altitude.alt.kp" = cascade.altitude.height_gain in [0.1, 5.0] "1/s", in_flight;
        /// climb gain
        "altitude.vel.kp" = cascade.altitude.velocity.kp in [1.0, 20.0] "1/s", in_flight;
        /// climb integral time
        "altitude.vel.ti" = cascade.altitude.velocity.ti in [0.1, 100.0] "s", in_flight;
        /// hover thrust before it is learned
        "hover.thrust" = cascade.altitude.hover_thrust in [0.3, 0.6] "N";

        /// gyro noise density
        "eskf.process.gyro_noise" = eskf.gyro_noise in [1e-5, 0.03] "rad/s/sqrt(Hz)";
        /// accelerometer noise density
        "eskf.process.accel_noise" = eskf.accel_noise in [1e-4, 10.0] "m/s^2/sqrt(Hz)";
        /// share of vibration that is accelerometer noise
        "eskf.process.accel_vibration" = eskf.accel_vibration in [0.0, 10.0] "1";
        /// gyro bias random walk
        "eskf.process.gyro_bias_walk" = eskf.gyro_bias_walk in [0.0, 0.1] "rad/s/sqrt(s)";
        /// accelerometer bias random walk
        "eskf.process.accel_bias_walk" = eskf.accel_bias_walk in [0.0, 0.3] "m/s^2/sqrt(s)";
        /// range noise
        "eskf.obs.tof_noise" = eskf.tof_sigma in [1e-3, 0.3] "m";
        /// flow noise
        "eskf.obs.flow_noise" = eskf.flow_sigma in [1e-3, 3.0] "rad/s";
        /// barometer noise
        "eskf.obs.baro_noise" = eskf.baro_sigma in [1e-2, 10.0] "m";
        /// magnetic heading noise
        "eskf.obs.mag_noise" = eskf.mag_sigma in [1e-3, 3.0] "rad";
        /// noise of the accelerometer as an inclinometer
        "eskf.obs.gravity_noise" = eskf.gravity_sigma in [1e-2, 20.0] "m/s^2";
        /// innovation gate, standard deviations
        "eskf.gate" = eskf.gate in [1.0, 20.0] "1";
        /// after this long at the gate the state moves to the sensor
        "eskf.lockout" = eskf.lockout in [0.05, 10.0] "s";

        /// largest duty
        "motor.duty.max" = motor.duty_max in [0.7, 1.0] "1";
        /// largest change of duty
        "motor.slew.max" = motor.slew_max in [5.0, 1000.0] "1/s";

        /// largest tilt that allows arming
        "mode.arming.tilt" = mode.arming_tilt in [0.05, 0.7] "rad";
        /// largest throttle that allows arming in a manual mode
        "mode.arming.throttle" = mode.throttle_rest in [0.01, 0.09] "1";
        /// throttle that takes off in a manual mode
        "mode.takeoff.throttle" = mode.throttle_take_off in [0.1, 0.5] "1";
        /// time between arming and a take-off by itself
        "mode.takeoff.delay" = mode.spool in [0.1, 2.0] "s";
        /// armed without a take-off, it disarms after this long
        "mode.armed.timeout" = mode.armed_timeout in [3.0, 60.0] "s";
        /// a lost link counts as back when heard for this long
        "mode.link.back" = mode.link_back in [0.2, 10.0] "s";
        /// without height it lands after this long
        "mode.blind.timeout" = mode.blind in [0.0, 3.0] "s";
        /// without horizontal velocity and without a pilot it lands after this long
        "mode.adrift.timeout" = mode.adrift in [0.0, 10.0] "s";
        /// without a link it hovers this long, then lands
        "mode.link.timeout" = mode.hover_without_link in [0.0, 60.0] "s";
        /// above this height somebody holds it
        "mode.held.height" = mode.held_height in [0.11, 0.5] "m";
        /// below this height it stands again
        "mode.standing.height" = mode.standing_height in [0.05, 0.1] "m";
        /// presses count again after a stop and this long released
        "mode.button.release" = mode.button_release in [0.5, 10.0] "s";
        /// longest time between the clicks of a double click
        "button.click.double" = button.double_click in [0.2, 1.0] "s";
        /// a press this long pairs
        "button.hold.pair" = button.hold_pair in [1.0, 4.0] "s";
        /// a press this long restarts
        "button.hold.reset" = button.hold_reset in [4.5, 20.0] "s";

        /// hypotheses about sensors that are not asked, a bit each
        "monitor.without" = monitor.without in [0.0, 4095.0] "1";

        /// specific force of an impact
        "failsafe.impact.flying" = failsafe.impact in [20.0, 150.0] "m/s^2";
        /// specific force of an impact while landing
        "failsafe.impact.landing" = failsafe.landing_impact in [20.0, 150.0] "m/s^2";
        /// a push from below this near to the ground is a touchdown
        "failsafe.touch.height" = failsafe.touch_height in [0.0, 1.0] "m";
        /// sink rate of a fall, whose end is an impact
        "failsafe.touch.speed" = failsafe.touch_speed in [0.3, 3.0] "m/s";
        /// impact, standard deviations of the vibration
        "failsafe.impact.sigmas" = failsafe.impact_sigmas in [3.0, 20.0] "1";
        /// rate at which the motors stop
        "failsafe.rate.max" = failsafe.rate in [5.0, 34.0] "rad/s";
        /// tilt of a vehicle that tumbles
        "failsafe.tumble.tilt" = failsafe.tumble_tilt in [0.8, 3.0] "rad";
        /// tilted for this long it tumbles
        "failsafe.tumble.time" = failsafe.tumble_time in [0.05, 2.0] "s";
        /// tilt of a vehicle that tips over while it takes off
        "failsafe.tip.tilt" = failsafe.tip_tilt in [0.3, 1.3] "rad";
        /// tilted for this long it tips over
        "failsafe.tip.time" = failsafe.tip_time in [0.02, 1.0] "s";
        /// tilt of a vehicle that tips on a leg while it takes off
        "failsafe.lift.tilt" = failsafe.lift_tilt in [0.1, 1.3] "rad";
        /// below this a leg may still touch the ground
        "failsafe.lift.height" = failsafe.lift_height in [0.0, 0.2] "m";
        /// that tilt is the one in so many seconds, if it goes on turning
        "failsafe.lift.lead" = failsafe.lift_lead in [0.0, 0.2] "s";
        /// torque about roll that betrays a weak motor
        "failsafe.weak.roll" = failsafe.weak_roll in [0.0001, 0.1] "N*m";
        /// torque about pitch that betrays a weak motor
        "failsafe.weak.pitch" = failsafe.weak_pitch in [0.0001, 0.1] "N*m";
        /// for this long it is a weak motor
        "failsafe.weak.time" = failsafe.weak_motor_time in [0.02, 2.0] "s";
        /// silence of a degraded inertial sensor
        "failsafe.imu.degraded" = failsafe.imu_degraded in [0.005, 0.02] "s";
        /// silence of a lost inertial sensor, stops the motors
        "failsafe.imu.lost" = failsafe.imu_lost in [0.02, 0.1] "s";
        /// silence of a lost link
        "failsafe.link.timeout" = failsafe.link_silence in [0.1, 5.0] "s";
        /// low battery: warns, no arming
        "failsafe.battery.low" = failsafe.battery_low in [3.2, 4.0] "V";
        /// critical battery: lands
        "failsafe.battery.critical" = failsafe.battery_critical in [2.5, 3.2] "V";
        /// a disarmed vehicle that takes more has a motor that turns
        "failsafe.battery.idle" = failsafe.idle_current in [0.2, 10.0] "A";
        /// disarmed below this it has no battery, no arming
        "failsafe.battery.usb" = failsafe.usb in [2.5, 3.6] "V";
        /// an alert of the battery clears this much higher
        "failsafe.battery.hysteresis" = failsafe.battery_hysteresis in [0.0, 0.3] "V";
        /// time constant of the voltage's low-pass
        "failsafe.battery.time" = failsafe.battery_time in [0.1, 20.0] "s";
        /// silence of a lost battery monitor
        "failsafe.power.timeout" = failsafe.power_silence in [0.2, 10.0] "s";
        /// silence of lost range or flow in the air
        "failsafe.aiding.timeout" = failsafe.aiding_silence in [0.2, 10.0] "s";
        /// gravity and tilt so far apart on the ground
        "failsafe.mismatch.tilt" = failsafe.tilt_mismatch in [0.05, 0.7] "rad";
        /// for this long apart is an alert
        "failsafe.mismatch.time" = failsafe.tilt_mismatch_time in [0.1, 5.0] "s";

        /// descent
        "landing.descent.speed" = landing.descent in [0.2, 1.0] "m/s";
        /// descent at the ground
        "landing.touchdown.speed" = landing.touchdown in [0.12, 0.2] "m/s";
        /// below this height the descent slows down
        "landing.flare.height" = landing.flare_height in [0.05, 2.0] "m";
        /// below this height the thrust ceiling falls
        "landing.ceiling.height" = landing.ceiling_height in [0.04, 0.2] "m";
        /// where the thrust ceiling ends, share of hover thrust
        "landing.ceiling.share" = landing.ceiling_share in [0.3, 0.75] "1";
        /// how long the thrust ceiling falls
        "landing.ceiling.time" = landing.ceiling_time in [0.1, 5.0] "s";
        /// slower than this is not sinking
        "landing.still.speed" = landing.still_speed in [0.02, 0.1] "m/s";
        /// not sinking this long, the thrust ceiling falls at any height
        "landing.still.time" = landing.stall_time in [0.3, 10.0] "s";
        /// not sinking this long under the ceiling is touchdown
        "landing.touchdown.time" = landing.touchdown_time in [0.1, 2.0] "s";
        /// a rise that is airborne
        "takeoff.airborne.rise" = landing.airborne_rise in [0.02, 0.3] "m";
        /// a climb rate that is airborne
        "takeoff.airborne.speed" = landing.airborne_speed in [0.1, 0.5] "m/s";
        /// largest thrust of a take-off at first, share of hover thrust
        "takeoff.ceiling" = landing.takeoff_ceiling in [1.05, 10.0] "1";
        /// it rises so fast
        "takeoff.ceiling.rise" = landing.takeoff_ceiling_rise in [0.0, 10.0] "1/s";
        /// take-off has arrived this close to its goal
        "takeoff.arrived.band" = landing.takeoff_band in [0.02, 0.3] "m";
        /// take-off has arrived slower than this
        "takeoff.arrived.speed" = landing.takeoff_speed in [0.05, 0.5] "m/s";
        /// arrived for this long, take-off is complete
        "takeoff.arrived.time" = landing.takeoff_settle in [0.1, 5.0] "s";
        /// take-off is complete after this long in any case
        "takeoff.limit.time" = landing.takeoff_limit in [2.0, 14.0] "s";

        /// take-off height when a command names none
        "navigator.takeoff.height" = navigator.take_off_height in [0.2, 3.0] "m";
        /// take-off speed when a command names none
        "navigator.takeoff.speed" = navigator.take_off_speed in [0.1, 2.0] "m/s";
        /// way-point speed when a command names none
        "navigator.route.speed" = navigator.route_speed in [0.05, 5.0] "m/s";
        /// horizontal speed at full stick
        "navigator.stick.speed" = navigator.stick_speed in [0.05, 5.0] "m/s";
        /// climb rate at full throttle stick
        "navigator.stick.climb" = navigator.climb_rate in [0.05, 2.0] "m/s";
        /// rate of descent at full throttle stick down
        "navigator.stick.sink" = navigator.sink_rate in [0.05, 2.0] "m/s";
        /// rate of turn at full yaw stick
        "navigator.stick.turn" = navigator.turn_rate in [0.1, 6.0] "rad/s";
        /// least height over the place of take-off
        "navigator.height.min" = navigator.height_min in [0.1, 0.5] "m";
        /// largest height over the place of take-off
        "navigator.height.max" = navigator.height_max in [0.5, 100.0] "m";
        /// a way-point is reached this close
        "navigator.waypoint.radius" = navigator.reached in [0.03, 1.0] "m";
        /// the path waits for a vehicle farther away
        "navigator.leash.length" = navigator.leash in [0.2, 5.0] "m";
        /// while landing the path is this far below at most
        "navigator.landing.lead" = navigator.landing_lead in [0.05, 1.0] "m";
        /// largest speed north and east
        "navigator.horizontal.speed" = navigator.limits.horizontal.speed in [0.1, 5.0] "m/s";
        /// largest acceleration north and east
        "navigator.horizontal.accel" = navigator.limits.horizontal.acceleration in [0.1, 5.0] "m/s^2";
        /// largest jerk north and east
        "navigator.horizontal.jerk" = navigator.limits.horizontal.jerk in [1.0, 50.0] "m/s^3";
        /// largest speed up and down
        "navigator.vertical.speed" = navigator.limits.vertical.speed in [0.2, 2.0] "m/s";
        /// largest acceleration up and down
        "navigator.vertical.accel" = navigator.limits.vertical.acceleration in [0.1, 5.0] "m/s^2";
        /// largest jerk up and down
        "navigator.vertical.jerk" = navigator.limits.vertical.jerk in [1.0, 50.0] "m/s^3";
        /// largest rate of turn
        "navigator.heading.rate" = navigator.limits.heading.speed in [0.1, 6.0] "rad/s";
        /// largest acceleration of the turn
        "navigator.heading.accel" = navigator.limits.heading.acceleration in [0.5, 20.0] "rad/s^2";
        /// largest jerk of the turn
        "navigator.heading.jerk" = navigator.limits.heading.jerk in [5.0, 200.0] "rad/s^3";

        /// sticks this close to their centre are centred
        "authority.stick.dead_band" = authority.dead_band in [0.0, 0.1] "1";
        /// deflection that takes over from a program
        "authority.stick.take_over" = mode.take_over in [0.1, 0.9] "1";
        /// the sticks take over after this long
        "authority.stick.time" = mode.take_over_time in [0.0, 1.0] "s";
        /// a switch counts after this long
        "authority.switch.debounce" = mode.switch_debounce in [0.04, 0.5] "s";
        /// after a silence, sticks count when heard for this long
        "authority.pilot.back" = authority.back in [0.2, 10.0] "s";
        /// a pilot's frame as old as this counts as none
        "authority.pilot.timeout" = authority.stale in [0.1, 5.0] "s";
        /// 1: packets without a key may fly it, 0: they are refused
        "link.unauthenticated" = accept_unauthenticated in [0.0, 1.0] "1";

        /// accelerometer, forward: shown without force
        "calibration.accel.bias_x" = corrections.accel.bias.x in [-3.0, 3.0] "m/s^2";
        /// accelerometer, right: shown without force
        "calibration.accel.bias_y" = corrections.accel.bias.y in [-3.0, 3.0] "m/s^2";
        /// accelerometer, down: shown without force
        "calibration.accel.bias_z" = corrections.accel.bias.z in [-3.0, 3.0] "m/s^2";
        /// accelerometer, forward: factor of the rest
        "calibration.accel.scale_x" = corrections.accel.scale.x in [0.8, 1.2] "1";
        /// accelerometer, right: factor of the rest
        "calibration.accel.scale_y" = corrections.accel.scale.y in [0.8, 1.2] "1";
        /// accelerometer, down: factor of the rest
        "calibration.accel.scale_z" = corrections.accel.scale.z in [0.8, 1.2] "1";
        /// the inertial sensor is rolled so in the airframe
        "calibration.level.roll" = corrections.level.roll in [-0.1, 0.1] "rad";
        /// the inertial sensor is pitched so in the airframe
        "calibration.level.pitch" = corrections.level.pitch in [-0.1, 0.1] "rad";
        /// hard iron, forward
        "calibration.mag.offset_x" = corrections.mag.offset.x in [-2000.0, 2000.0] "uT";
        /// hard iron, right
        "calibration.mag.offset_y" = corrections.mag.offset.y in [-2000.0, 2000.0] "uT";
        /// hard iron, down
        "calibration.mag.offset_z" = corrections.mag.offset.z in [-2000.0, 2000.0] "uT";
        /// soft iron undone, forward to forward
        "calibration.mag.matrix_xx" = corrections.mag.diagonal.x in [0.5, 2.0] "1";
        /// soft iron undone, right to right
        "calibration.mag.matrix_yy" = corrections.mag.diagonal.y in [0.5, 2.0] "1";
        /// soft iron undone, down to down
        "calibration.mag.matrix_zz" = corrections.mag.diagonal.z in [0.5, 2.0] "1";
        /// soft iron undone, forward to right
        "calibration.mag.matrix_xy" = corrections.mag.across.x in [-0.5, 0.5] "1";
        /// soft iron undone, forward to down
        "calibration.mag.matrix_xz" = corrections.mag.across.y in [-0.5, 0.5] "1";
        /// soft iron undone, right to down
        "calibration.mag.matrix_yz" = corrections.mag.across.z in [-0.5, 0.5] "1";
        /// no drift is corrected at this temperature
        "calibration.drift.reference" = corrections.drift.reference in [-40.0, 85.0] "degC";
        /// gyro bias a kelvin, forward
        "calibration.drift.gyro_x" = corrections.drift.gyro.x in [-2e-3, 2e-3] "rad/s/K";
        /// gyro bias a kelvin, right
        "calibration.drift.gyro_y" = corrections.drift.gyro.y in [-2e-3, 2e-3] "rad/s/K";
        /// gyro bias a kelvin, down
        "calibration.drift.gyro_z" = corrections.drift.gyro.z in [-2e-3, 2e-3] "rad/s/K";
        /// accelerometer bias a kelvin, forward
        "calibration.drift.accel_x" = corrections.drift.accel.x in [-0.02, 0.02] "m/s^2/K";
        /// accelerometer bias a kelvin, right
        "calibration.drift.accel_y" = corrections.drift.accel.y in [-0.02, 0.02] "m/s^2/K";
        /// accelerometer bias a kelvin, down
        "calibration.drift.accel_z" = corrections.drift.accel.z in [-0.02, 0.02] "m/s^2/K";
    }
    where RULES;
}

/// Every parameter, in the order of their numbers.
pub fn all() -> impl ExactSizeIterator<Item = ParameterInfo<'static>> {
    VehicleConfig::TABLE.iter().map(|parameter| parameter.info)
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
    use stampfly_param::{ParameterError, ParameterField, Parameters};
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
        let comes_back = |time: Duration| Duration::from_number(time.number()) == Some(time);
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
