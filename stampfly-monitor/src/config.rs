//! The thresholds that belong to a vehicle and its sensors, with units in their names and where they
//! come from. What belongs to one hypothesis alone stands beside it, as a constant.

/// Thresholds. The defaults are for a multirotor of a palm's size with a camera for optical flow, a
/// time-of-flight ranger and a barometer.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MonitorConfig {
    /// Bits of [`HYPOTHESES`](crate::HYPOTHESES) that are not asked: to find out what each is worth.
    pub without: u16,
    /// Height of the range finder on a vehicle that stands, m. An airframe value.
    pub ground_clearance_m: f32,

    /// Residuals are compared with so many standard deviations. In two axes 5 are exceeded with a
    /// probability of 4·10⁻⁶, once in a day and a half of independent half seconds.
    pub gate_sigmas: f32,
    /// And for so long: a single reading is not enough.
    pub lasts_s: f32,

    /// Standard deviation of the velocity with which a reckoner begins, m/s.
    pub velocity_sigma_m_s: f32,
    /// Standard deviation of the accelerometer's zero along a horizontal axis, m/s², beside what the
    /// estimator says of its acceleration: what it moves by within seconds.
    pub accel_sigma_m_s2: f32,
    /// Full scale of the accelerometer, m/s²: what has been near it may have been more.
    pub accel_full_scale_m_s2: f32,
    /// Share of the accelerometer's root mean square change from sample to sample by which its mean is
    /// wrong: of 4 m/s², as recorded, 0.06 m/s².
    pub vibration_share: f32,
    /// Standard deviation of a gyro's scale and axes, share of the angle that it has turned by: data
    /// sheets allow three of them.
    pub gyro_scale: f32,

    /// Error of a picture's scale from one specimen to the next, share of the velocity. Recorded
    /// cameras lie between 0.79 and 1.11 of the true one; what the first lacks beyond this is within
    /// the rest of the gate up to 5 m/s.
    pub flow_scale: f32,
    /// Share of the picture's motion that a single reading may be wrong by, once it is smoothed: a
    /// PMW3901 takes 121 pictures a second and is read 100 times, so a reading holds one picture, two
    /// or none. Of two readings that follow each other with an error of all of the motion a quarter
    /// comes through the smoothing.
    pub flow_frame_share: f32,
    /// How much older than expected a picture is at most, s: cameras need 4 to 12 ms, 4 are expected.
    pub flow_late_s: f32,
    /// Standard deviation of a smoothed rate of the picture, rad/s: a count in 10 ms is 0.22, evenly
    /// distributed 0.063, of which six readings leave 0.026; features as much again.
    pub flow_rate_sigma_rad_s: f32,
    /// Time constant of that smoothing, s: six readings.
    pub flow_smooth_s: f32,
    /// Nearer to the floor, m, the picture may be blurred.
    pub flow_sharp_m: f32,
    /// To be used again flow has to agree with a motion of this much, m/s,
    pub flow_motion_m_s: f32,
    /// for so long, s.
    pub flow_agrees_s: f32,

    /// To be used again a range has to lie where it is expected for so long, s.
    pub range_agrees_s: f32,

    /// Readings running of one value that a camera gives only when it hangs: 0.4 s of them.
    pub flow_repeats: u32,
    /// Readings running of zero that show nothing,
    pub flow_zeros: u32,
    /// while the body turns by this much, rad: three counts of a PMW3901,
    pub flow_turn_rad: f32,
    /// and would have to move by this much, m, to keep the picture still: 5 mm in a fifth of a second
    /// are as much as 1.5° of tilt.
    pub flow_motion_m: f32,
    /// Largest rate of the picture of a vehicle that stands, rad/s: people walk by, and lamps flicker.
    pub flow_standing_rad_s: f32,
    /// Time constant of that rate's mean, s.
    pub flow_standing_s: f32,
    /// Largest change of the velocity within 0.15 s that no sensor has felt, m/s: an acceleration of
    /// 1.3 m/s² that is wrong.
    pub flow_jump_m_s: f32,
    /// The same for each metre of distance: what the means of five readings are noisy by.
    pub flow_jump_rad_s: f32,

    /// Smallest jump of a gyro's zero from one sample to the next, rad/s: what is smaller can be found
    /// as a shift, while it has tilted the vehicle by some degrees.
    pub gyro_jump_rad_s: f32,
    /// The same in root mean squares of the gyro's change from sample to sample.
    pub gyro_jump_rms: f32,
    /// Largest shift of a gyro's zero that is looked for in the air, rad/s: a larger one is a jump.
    pub gyro_shift_rad_s: f32,
    /// Smallest shift of the zero on the ground, rad/s: 3°/s, 6° until a take-off two seconds later.
    pub gyro_standing_rad_s: f32,
}

impl Default for MonitorConfig {
    fn default() -> Self {
        Self {
            without: 0,
            ground_clearance_m: 0.03,
            gate_sigmas: 5.0,
            lasts_s: 0.1,
            velocity_sigma_m_s: 0.09,
            accel_sigma_m_s2: 0.02,
            accel_full_scale_m_s2: 78.5,
            vibration_share: 0.015,
            gyro_scale: 0.01,
            flow_scale: 0.12,
            flow_frame_share: 0.25,
            flow_late_s: 0.008,
            flow_rate_sigma_rad_s: 0.04,
            flow_smooth_s: 0.06,
            flow_sharp_m: 0.15,
            flow_motion_m_s: 0.2,
            flow_agrees_s: 0.5,
            range_agrees_s: 1.0,
            flow_repeats: 40,
            flow_zeros: 20,
            flow_turn_rad: 0.007,
            flow_motion_m: 0.005,
            flow_standing_rad_s: 0.6,
            flow_standing_s: 0.5,
            flow_jump_m_s: 0.2,
            flow_jump_rad_s: 0.5,
            gyro_jump_rad_s: 0.35,
            gyro_jump_rms: 4.0,
            gyro_shift_rad_s: 1.2,
            gyro_standing_rad_s: 0.05,
        }
    }
}
