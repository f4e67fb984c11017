//! Combinations of [parameters](crate::parameters) with which the StampFly cannot fly, in words. Each looks at two.

use crate::airframe::AIRFRAME;
use crate::config::VehicleConfig;
use stampfly_param::rules::Rule;

// What carries the weight leaves a fifth for climbing and leaning; a rate overshoots by less than a quarter; the path takes four fifths of
// the mode machine's time for a take-off; with an integral time below a quarter of the attitude loop's time constant the position loop swung.
const THRUST_RESERVE: f32 = 0.2;
const RATE_RESERVE: f32 = 1.25;
const TAKE_OFF_SHARE: f32 = 0.8;
const LOOP_RATIO: f32 = 0.5;

/// Every rule.
pub const RULES: &[Rule<VehicleConfig>] = stampfly_param::rules! { c:
    "navigator.height.min" "navigator.height.max" c.navigator.height_min < c.navigator.height_max => "no height is left to fly at";
    "navigator.takeoff.height" "navigator.height.max" c.navigator.take_off_height <= c.navigator.height_max => "take-off ends above the largest height";
    "navigator.takeoff.height" "navigator.height.min" c.navigator.take_off_height >= c.navigator.height_min => "take-off ends below the least height";
    "navigator.takeoff.height" "takeoff.airborne.rise" c.navigator.take_off_height > c.landing.airborne_rise => "take-off ends before it counts as airborne";
    "navigator.height.min" "takeoff.airborne.rise" c.navigator.height_min > c.landing.airborne_rise => "a take-off to the least height never counts as airborne";
    "navigator.takeoff.height" "takeoff.arrived.band" c.navigator.take_off_height > c.landing.takeoff_band => "take-off has arrived while it stands";
    "navigator.takeoff.height" "navigator.takeoff.speed" c.navigator.take_off_height <= TAKE_OFF_SHARE * c.mode.take_off_timeout.seconds() * c.navigator.take_off_speed => "take-off lasts longer than 15 s and ends in a landing";
    "takeoff.arrived.time" "takeoff.limit.time" c.landing.takeoff_settle < c.landing.takeoff_limit => "take-off is cut off before it has arrived";
    "motor.duty.max" "hover.thrust" 4.0 * AIRFRAME.motor.thrust(c.motor.duty_max * c.motor.nominal_voltage) >= (1.0 + THRUST_RESERVE) * c.cascade.altitude.hover_thrust => "the motors carry the weight and have nothing left to steer with";
    "position.tilt.max" "failsafe.tip.tilt" c.cascade.position.tilt_max < c.failsafe.tip_tilt => "a tilt that the position loop asks for counts as tipping over";
    "position.vel.ti" "attitude.tilt.kp" c.cascade.position.velocity.ti * c.cascade.attitude.tilt_gain >= LOOP_RATIO => "the position loop turns round before the attitude has followed";
    "mode.arming.tilt" "failsafe.tip.tilt" c.mode.arming_tilt < c.failsafe.tip_tilt => "it may be armed on a slope that counts as tipping over";
    "navigator.heading.rate" "failsafe.rate.max" RATE_RESERVE * c.navigator.limits.heading.speed <= c.failsafe.rate => "turning as fast as it may stops the motors";
    "navigator.stick.turn" "failsafe.rate.max" RATE_RESERVE * c.navigator.turn_rate <= c.failsafe.rate => "turning at full stick stops the motors";
    "failsafe.imu.degraded" "failsafe.imu.lost" c.failsafe.imu_degraded < c.failsafe.imu_lost => "a silent inertial sensor is lost before it is degraded";
    "failsafe.battery.low" "failsafe.battery.critical" c.failsafe.battery_low > c.failsafe.battery_critical => "it lands without a warning";
    "failsafe.impact.landing" "failsafe.impact.flying" c.failsafe.landing_impact >= c.failsafe.impact => "a touchdown counts as an impact before a blow in flight does";
    "failsafe.touch.speed" "landing.descent.speed" c.failsafe.touch_speed > c.landing.descent => "a landing counts as a fall";
    "landing.ceiling.height" "landing.flare.height" c.landing.ceiling_height <= c.landing.flare_height => "the thrust falls while it still comes down fast";
};
