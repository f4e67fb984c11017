//! Thresholds that depend on the vehicle and its sensors. Each name ends with its unit; each
//! comment states the origin. Thresholds of a single hypothesis are constants in its file.

/// Thresholds of the monitor. The defaults are for a palm-sized multirotor with a camera for
/// optical flow, a time-of-flight range finder and a barometer.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MonitorConfig {
    /// Bit mask of the [`HYPOTHESES`](crate::HYPOTHESES) that are disabled, to measure the effect
    /// of each one.
    pub without: u16,
    /// Height of the range finder while the vehicle stands, m. A property of the airframe.
    pub ground_clearance_m: f32,

    /// Gate for residuals, in standard deviations. In two axes, 5 are exceeded with a probability
    /// of 4·10⁻⁶: once in a day and a half of independent half-second intervals.
    pub gate_sigmas: f32,
    /// Time for which a residual must exceed the gate, s, so that a single reading is not enough.
    pub lasts_s: f32,

    /// Initial standard deviation of a reckoner's velocity, m/s.
    pub velocity_sigma_m_s: f32,
    /// Standard deviation of the accelerometer's bias along a horizontal axis, m/s²: its change
    /// within seconds, added to the estimator's own acceleration uncertainty.
    pub accel_sigma_m_s2: f32,
    /// Full scale of the accelerometer, m/s². A reading near it may have been clipped.
    pub accel_full_scale_m_s2: f32,
    /// Error of the accelerometer's mean as a share of its root mean square sample-to-sample
    /// change. A recorded change of 4 m/s² gives 0.06 m/s².
    pub vibration_share: f32,
    /// Standard deviation of the gyro's scale and axis errors, as a share of the angle turned. Data
    /// sheets allow three of them.
    pub gyro_scale: f32,

    /// Scale error of flow between specimens, as a share of the velocity. Recorded cameras have
    /// scales of 0.79 to 1.11; up to 5 m/s the part beyond this value fits into the rest of the
    /// gate.
    pub flow_scale: f32,
    /// Error of a single reading after smoothing, as a share of the image motion. A PMW3901 takes
    /// 121 frames a second and is read 100 times, so a reading holds one frame, two or none. For
    /// two successive readings that are wrong by all of the motion, a quarter remains after
    /// smoothing.
    pub flow_frame_share: f32,
    /// Largest additional delay of a frame, s. Cameras take 4 to 12 ms, of which 4 are expected.
    pub flow_late_s: f32,
    /// Standard deviation of the smoothed image rate, rad/s. One count in 10 ms is 0.22, uniformly
    /// distributed 0.063, of which 0.026 remain after six readings; the features of the surface add
    /// as much again.
    pub flow_rate_sigma_rad_s: f32,
    /// Time constant of the smoothing, s: six readings.
    pub flow_smooth_s: f32,
    /// Distance to the floor, m, below which the image may be blurred.
    pub flow_sharp_m: f32,
    /// Reckoned change of velocity with which flow must agree to be used again, m/s.
    pub flow_motion_m_s: f32,
    /// Duration of that agreement, s.
    pub flow_agrees_s: f32,

    /// Time for which a range must agree with the estimate to be used again, s.
    pub range_agrees_s: f32,

    /// Number of consecutive equal readings, not zero, that indicates a frozen camera: 0.4 s.
    pub flow_repeats: u32,
    /// Number of consecutive zero readings after which `FlowStill` is tested.
    pub flow_zeros: u32,
    /// Rotation during the zero readings that a camera must show, rad: three counts of a PMW3901.
    pub flow_turn_rad: f32,
    /// Translation that could have cancelled that rotation in the image, m. A larger one is
    /// excluded: 5 mm in a fifth of a second correspond to a tilt of 1.5°.
    pub flow_motion_m: f32,
    /// Largest image rate of a vehicle at rest, rad/s, to allow for people walking by and
    /// flickering lamps.
    pub flow_standing_rad_s: f32,
    /// Time constant of the mean image rate, s.
    pub flow_standing_s: f32,
    /// Largest change of velocity within 0.15 s that is not measured by the accelerometer, m/s: an
    /// acceleration error of 1.3 m/s².
    pub flow_jump_m_s: f32,
    /// Addition per metre of distance, rad/s: the noise of the mean of five readings.
    pub flow_jump_rad_s: f32,

    /// Smallest jump of the gyro's zero between samples, rad/s. Smaller ones are found later as a
    /// shift, after some degrees of tilt error.
    pub gyro_jump_rad_s: f32,
    /// The same in root mean squares of the gyro's sample-to-sample change.
    pub gyro_jump_rms: f32,
    /// Largest shift of the gyro's zero that is fitted in flight, rad/s. A larger one is a jump.
    pub gyro_shift_rad_s: f32,
    /// Smallest shift of the zero that is detected on the ground, rad/s: 3°/s, which is 6° at a
    /// take-off two seconds later.
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
