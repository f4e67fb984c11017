//! What the attitude filter can be told, and why the defaults are what they are.

/// Configuration of the [`AttitudeFilter`](super::AttitudeFilter).
///
/// The defaults suit a consumer-grade sensor on anything that moves by hand, by wheel or by rotor. Nothing here needs
/// tuning to a motion; the two delays are properties of the sensors and worth measuring.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AttitudeConfig {
    /// Time over which specific force is averaged, s. Longer than a hand accelerates one way, shorter than the gyro
    /// needs to drift by a degree.
    pub accel_time: f32,
    /// By how much an inertial sample is older than its stamp says, s. The low-pass inside the sensor delays it: look
    /// up the group delay. The attitude is given for the stamp, by turning on at the current rate.
    pub inertial_delay: f32,
    /// The same of a magnetometer sample, s: conversion time and averaging.
    pub mag_delay: f32,
    /// How well `mag_delay` is known, s: the rest is estimated from what the field does in fast turns. Zero: it is known.
    pub mag_delay_sigma: f32,

    /// Standard deviation of the gyro's bias without a calibration, rad/s. Half a degree a second: what sensors have
    /// after they have been calibrated once, some day, at some temperature.
    pub initial_bias_sigma: f32,
    /// Random walk of the bias, rad/s/√s. A fifth of a degree a second in a hundred seconds: warming up.
    pub bias_walk: f32,
    /// Standard deviation of the bias after long motion, rad/s; sets the weight of the leaning of gravity.
    pub motion_bias_sigma: f32,
    /// Standard deviation of the bias after a long time at rest, rad/s; also the one that a complete calibration
    /// leaves.
    pub rest_bias_sigma: f32,
    /// Farthest from the calibration that the bias may go, rad/s. Two degrees a second: beyond it lies slow motion, not
    /// bias.
    pub bias_limit: f32,

    /// Low-pass of the rest detector, s.
    pub rest_filter_time: f32,
    /// Rest has to last this long, s. Shorter, and every pause of a hand is rest.
    pub rest_time: f32,
    /// Largest deviation of the gyro from its mean at rest, rad/s: noise of consumer sensors, times ten.
    pub rest_rate: f32,
    /// Largest deviation of the specific force from its mean at rest, m/s²: the same.
    pub rest_force: f32,

    /// Largest deviation of strength from the reference field, as a share of it.
    pub mag_strength_tolerance: f32,
    /// Largest deviation of dip from the reference field, rad.
    pub mag_dip_tolerance: f32,
    /// Time constant with which the reference field follows, s: cities and floors differ, rooms hardly.
    pub mag_reference_time: f32,
    /// After a disturbance the field must agree again for this long, s.
    pub mag_agree_time: f32,
    /// A different field that stays the same for so long, while the body turns, is the new reference, s. Turning is
    /// asked for because a body that lies beside a magnet sees a constant field too.
    pub mag_renew_time: f32,
    /// Without any reference, a field that stays the same for so long while the body turns, or while it turns slowly by a whole
    /// circle in sum, is it, s.
    pub mag_first_time: f32,
    /// The body turns, for the two above, at more than this, rad/s.
    pub mag_renew_rate: f32,
    /// Bend of a clean field, rad: how far furniture and concrete turn it.
    pub mag_sigma: f32,
    /// Bend of the field where the filter starts, rad: it has only been seen there, on a desk with steel feet.
    pub mag_start_sigma: f32,
    /// Bend of a disturbed field, rad: little is known, so only an even less known heading follows it.
    pub mag_disturbed_sigma: f32,
    /// Direction of the field in a new place, rad, where it is as different as it takes to be a new reference.
    pub mag_place_sigma: f32,
    /// Standard deviation of the vertical gyro bias after long motion in a clean field, rad/s; sets how much of a
    /// drifting heading is taken for bias.
    pub mag_bias_sigma: f32,

    /// Estimate magnetised parts that turn with the sensor, and take their field out.
    pub hard_iron: bool,
    /// Standard deviation of their field at the start, µT.
    pub hard_iron_sigma: f32,
    /// Random walk of their field, µT/√s: a motor's current, a phone put on top.
    pub hard_iron_walk: f32,
    /// Unevenness of the world's field where the body moves, µT. Furniture and concrete: one to two.
    pub field_sigma: f32,
    /// For how long that unevenness stays the same, s: about as long as a stroke of a hand.
    pub field_time: f32,
    /// Random walk of the world's field, µT/√s: walking through a building.
    pub field_walk: f32,
    /// An offset below this, µT, is not told from an uneven field and not taken out.
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
