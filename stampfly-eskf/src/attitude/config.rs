//! Configuration of the attitude filter, with the reason for each default.

/// Configuration of the [`AttitudeFilter`](super::AttitudeFilter).
///
/// The defaults suit a consumer-grade sensor on a body moved by hand, wheels or rotors. No value
/// depends on the kind of motion. The two delays are properties of the sensors and worth measuring.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AttitudeConfig {
    /// Time constant of the specific force filter, s. Longer than a hand accelerates in one
    /// direction, shorter than the gyro takes to drift by a degree.
    pub accel_time: f32,
    /// Delay of an inertial sample before its stamp, s: the group delay of the sensor's low-pass.
    /// The attitude is extrapolated to the stamp with the current rate.
    pub inertial_delay: f32,
    /// Delay of a magnetometer sample before its stamp, s: conversion time and averaging.
    pub mag_delay: f32,
    /// Standard deviation of `mag_delay`, s. The remaining delay is estimated from the field in
    /// fast turns. Zero: known.
    pub mag_delay_sigma: f32,

    /// Standard deviation of the gyro bias without a calibration, rad/s. Half a degree per second:
    /// typical of sensors calibrated once, at another time and temperature.
    pub initial_bias_sigma: f32,
    /// Random walk of the bias, rad/s/√s: 0.2°/s in 100 s, as during warm-up.
    pub bias_walk: f32,
    /// Standard deviation of the bias after long motion, rad/s. Sets the weight of the drift of
    /// gravity.
    pub motion_bias_sigma: f32,
    /// Standard deviation of the bias after a long rest, rad/s; also after a complete calibration.
    pub rest_bias_sigma: f32,
    /// Largest difference of the bias from the calibration, rad/s. Two degrees per second: more is
    /// slow motion, not bias.
    pub bias_limit: f32,

    /// Time constant of the stationary detector, s.
    pub rest_filter_time: f32,
    /// Time for which the body must be quiet to count as stationary, s. With less, every pause of a
    /// hand is a rest.
    pub rest_time: f32,
    /// Largest deviation of the gyro from its mean at rest, rad/s: ten times the noise of consumer
    /// sensors.
    pub rest_rate: f32,
    /// Largest deviation of the specific force from its mean at rest, m/s²; chosen in the same way.
    pub rest_force: f32,

    /// Largest deviation of the strength from the reference field, as a share of it.
    pub mag_strength_tolerance: f32,
    /// Largest deviation of the dip from the reference field, rad.
    pub mag_dip_tolerance: f32,
    /// Time constant with which the reference field follows, s. The field differs between cities
    /// and floors, hardly within a room.
    pub mag_reference_time: f32,
    /// Time for which the field must agree again after a disturbance, s.
    pub mag_agree_time: f32,
    /// Time for which a different field must stay constant, while the body turns, to become the new
    /// reference, s. Turning is required because a body at rest next to a magnet sees a constant
    /// field, too.
    pub mag_renew_time: f32,
    /// The same without any reference, s. Alternatively the body has turned slowly by a whole
    /// circle in sum.
    pub mag_first_time: f32,
    /// Angular rate above which the body counts as turning for the two times above, rad/s.
    pub mag_renew_rate: f32,
    /// Direction error of a clean field, rad, from furniture and concrete.
    pub mag_sigma: f32,
    /// Direction error of the field where the filter starts, rad: observed in one place only,
    /// possibly on a desk with steel legs.
    pub mag_start_sigma: f32,
    /// Direction error of a disturbed field, rad. Large, so that only a very uncertain heading
    /// follows it.
    pub mag_disturbed_sigma: f32,
    /// Direction difference of the field in a new place, rad, given that it differs enough to
    /// become a new reference.
    pub mag_place_sigma: f32,
    /// Standard deviation of the vertical gyro bias after long motion in a clean field, rad/s. Sets
    /// how much of a drifting heading is attributed to the bias.
    pub mag_bias_sigma: f32,

    /// Estimate the field of magnetised parts that turn with the sensor, and subtract it.
    pub hard_iron: bool,
    /// Initial standard deviation of that field, µT.
    pub hard_iron_sigma: f32,
    /// Random walk of that field, µT/√s: the current of a motor, a phone put on top.
    pub hard_iron_walk: f32,
    /// Spatial variation of the world's field along the path of the body, µT. Furniture and
    /// concrete: one to two.
    pub field_sigma: f32,
    /// Correlation time of that variation, s: about the duration of one movement of a hand.
    pub field_time: f32,
    /// Random walk of the world's field, µT/√s, as when walking through a building.
    pub field_walk: f32,
    /// Smallest offset that is distinguished from field variation and subtracted, µT.
    pub hard_iron_least: f32,
}

impl Default for AttitudeConfig {
    fn default() -> Self {
        let degree = core::f32::consts::PI / 180.0;
        Self {
            accel_time: 3.0,
            inertial_delay: 0.0,
            mag_delay: 0.0,
            mag_delay_sigma: 0.01,
            initial_bias_sigma: 0.5 * degree,
            bias_walk: 0.02 * degree,
            motion_bias_sigma: 0.1 * degree,
            rest_bias_sigma: 0.03 * degree,
            bias_limit: 2.0 * degree,
            rest_filter_time: 0.5,
            rest_time: 1.5,
            rest_rate: 2.0 * degree,
            rest_force: 0.5,
            mag_strength_tolerance: 0.1,
            mag_dip_tolerance: 10.0 * degree,
            mag_reference_time: 20.0,
            mag_agree_time: 0.5,
            mag_renew_time: 20.0,
            mag_first_time: 5.0,
            mag_renew_rate: 20.0 * degree,
            mag_sigma: 4.0 * degree,
            mag_start_sigma: 8.0 * degree,
            mag_disturbed_sigma: 30.0 * degree,
            mag_place_sigma: 20.0 * degree,
            mag_bias_sigma: 0.15 * degree,
            hard_iron: true,
            hard_iron_sigma: 40.0,
            hard_iron_walk: 0.05,
            field_sigma: 1.0,
            field_time: 1.0,
            field_walk: 0.1,
            hard_iron_least: 2.0,
        }
    }
}
