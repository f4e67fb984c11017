//! Tuning parameters of the error-state Kalman filter, with the reason for each default.

use stampfly_types::Vec3;

/// Tuning of [`Eskf`](crate::Eskf).
///
/// One set of values describes one sensor suite. The defaults are for a small multirotor indoors
/// with BMI270, VL53L3CX, PMW3901 and BMP280. Start from [`EskfConfig::indoors`] for a vehicle in a
/// room and from [`EskfConfig::outdoors`] for a satellite receiver.
///
/// All standard deviations are one sigma. Units are SI and stated at each field.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EskfConfig {
    /// Accelerometer noise density, m/s²/√Hz. Far above the data sheet's 0.0016, because it also
    /// covers errors of scale and axis alignment. Vibration is added through `accel_vibration`.
    pub accel_noise: f32,
    /// Gyro noise density, rad/s/√Hz. Above the data sheet's 0.00012 for the same reason.
    pub gyro_noise: f32,
    /// Share (0 to 1) of the squared sample-to-sample change of the accelerometer that is added to
    /// its noise variance. One third suits white noise of 800 Hz bandwidth sampled at 400 Hz. See
    /// [`Vibration`](crate::filter::Vibration).
    pub accel_vibration: f32,
    /// The same share for the gyro.
    pub gyro_vibration: f32,
    /// Largest angular acceleration of the body, rad/s². An inertial sample that implies more is
    /// treated as corrupt and bridged with the last good sample. Up to three consecutive samples
    /// are bridged if they are consistent with each other, and up to 20 if they are not; after that
    /// the samples are used.
    pub angular_acceleration: f32,
    /// Full scale of the accelerometer, m/s². A sample with every axis at full scale is treated as
    /// corrupt, too.
    pub accel_full_scale: f32,
    /// Random walk of the gyro bias, rad/s/√s.
    pub gyro_bias_walk: f32,
    /// Random walk of the accelerometer bias, m/s²/√s.
    pub accel_bias_walk: f32,

    /// Initial standard deviation of position, m.
    pub initial_position: f32,
    /// Initial standard deviation of velocity, m/s.
    pub initial_velocity: f32,
    /// Initial standard deviation of attitude, rad.
    pub initial_attitude: f32,
    /// Initial standard deviation of the gyro bias after a still calibration, rad/s.
    pub initial_gyro_bias: f32,
    /// Initial standard deviation of the accelerometer bias, m/s². MEMS start-up biases are 0.1 to
    /// 0.4, but most of the horizontal part has already been absorbed by the initial attitude.
    pub initial_accel_bias: f32,
    /// Standard deviation added to the accelerometer's vertical bias when the motors start, m/s²:
    /// vibration rectification. Recorded StampFly flights average −8.7 to −9.2 instead of −9.8.
    pub vibration_bias: f32,
    /// Random walk of the accelerometer's vertical bias in flight, m/s²/√s, because vibration
    /// changes with thrust. Applied only while no range observes that bias; the barometer then
    /// finds a bias change of 1 m/s² within three seconds.
    pub thrust_bias_walk: f32,

    /// Standard deviation of a range, m.
    pub tof_sigma: f32,
    /// Shortest range used, m.
    pub tof_min: f32,
    /// Longest range used, m.
    pub tof_max: f32,
    /// Cosine of the largest tilt at which the level-surface model is used.
    pub min_cos_tilt: f32,
    /// Distance from the range sensor to the ground while the vehicle stands, m. Used where the
    /// sensor has no reading at that distance.
    pub ground_clearance: f32,

    /// Standard deviation of a flow sample, rad/s. One count in 10 ms is 0.22 rad/s.
    pub flow_sigma: f32,
    /// Part of the flow error that is proportional to the image motion, as a share. A PMW3901 takes
    /// 121 frames a second and is read 100 times a second, so a reading holds the motion of one
    /// frame or of two: it is 17 % low or 65 % high.
    pub flow_scale_sigma: f32,
    /// Delay between the end of the interval that a flow sample covers and its time stamp, s:
    /// frames wait for comparison and readout. 4 ms by the data sheet; 17 ms in recorded logs, part
    /// of which is the logger.
    pub flow_delay: f32,
    /// Lowest surface quality used.
    pub flow_min_quality: u8,
    /// Shortest distance to the floor at which flow is used, m. The image is blurred closer to it:
    /// a PMW3901 works from 80 mm. During a take-off, flow is not used below this distance.
    pub flow_min_distance: f32,
    /// Fastest image motion that the camera tracks, rad/s: 7.4 for a PMW3901. Faster motion aliases
    /// to a wrong reading.
    pub flow_max_rate: f32,

    /// Standard deviation of a barometric altitude, m.
    pub baro_sigma: f32,
    /// Fuse the barometer.
    pub baro_enable: bool,
    /// Use the barometer as a backup: while an external measurement of the height is younger than
    /// two seconds, the barometer only estimates its offset; afterwards it holds the height. The
    /// offset is not a filter state and has no correlation with the others. A receiver is noisier
    /// than the barometer from second to second, so if both were fused, the many barometer samples
    /// would make the height variance too small.
    pub baro_backup: bool,
    /// Random walk of the barometer's offset, m/√s. 0.017 is one metre an hour.
    pub baro_walk: f32,
    /// Shift of the barometer's offset when the propellers start, and standard deviation of its
    /// altitude near the floor, m. With turning propellers a StampFly reads 0.6 m lower at the
    /// floor and 0.2 m lower above it.
    pub baro_wash: f32,
    /// Standard deviation of a magnetic direction, rad.
    pub mag_sigma: f32,
    /// Which part of the magnetic field is used.
    pub mag_model: MagModel,
    /// Fuse the magnetometer. Off by default: the StampFly's motor currents distort the field.
    pub mag_enable: bool,

    /// When the accelerometer is used as an inclinometer.
    pub gravity_use: GravityUse,
    /// Standard deviation of the accelerometer as an inclinometer in flight, m/s².
    pub gravity_sigma: f32,
    /// The same while stationary, m/s².
    pub stationary_gravity_sigma: f32,
    /// Standard deviation of the zero-velocity update while stationary, m/s.
    pub stationary_velocity_sigma: f32,
    /// Standard deviation of the update that holds the position while stationary, m.
    pub stationary_position_sigma: f32,

    /// Linear drag of a multirotor divided by its mass, 1/s: the share of its airspeed that drag of
    /// rotors and body removes per second. Drag is the only source of velocity when no sensor
    /// measures it. An error of a factor of two is acceptable. 0 disables it.
    pub drag: f32,
    /// Standard deviation of the wind, m/s: the error of a velocity derived from drag.
    pub wind: f32,

    /// Standard deviation of the pseudo-measurement "velocity is small" while the vehicle is tilted
    /// too far to see the ground, (m/s)·√s. Divided by the accelerometer noise it is the time
    /// constant with which the velocity decays.
    pub unobserved_velocity: f32,

    /// Innovation gate, in standard deviations of one axis.
    pub gate: f32,
    /// Lock-out time, s: when every measurement of a sensor has been rejected for this long, the
    /// state is reset to that sensor. Applies to range, flow, barometer, magnetometer and, four
    /// times as long, gravity.
    pub lockout: f32,
    /// Lock-out time of external position, velocity and attitude, s. A receiver between walls is
    /// wrong for seconds.
    pub external_lockout: f32,
    /// Number of consecutive rejections that a reset requires in addition to the lock-out time, so
    /// that two bad fixes of a slow receiver do not cause a reset.
    pub lockout_samples: u16,

    /// Age of the oldest measurement that is accepted, s: the delay of the slowest sensor plus its
    /// clock error. The memory used does not depend on it. Beyond 0.11 s the history becomes
    /// coarser, see [`History`](crate::filter::History).
    pub horizon: f32,
    /// External positions may have an error that stays constant for minutes, as those of satellite
    /// receivers do. The position variance is then not reduced below the part of the stated
    /// variance that does not show as scatter from fix to fix.
    pub position_wander: bool,
    /// Time for which a measurement of external position or velocity, or of
    /// [`Eskf::fuse`](crate::Eskf::fuse), keeps the outputs valid, s. In between, the inertial
    /// sensor propagates them and the covariance states the error.
    pub aiding_timeout: f32,
    /// Standard deviation at which an unmeasured velocity is reset to zero, m/s.
    pub unaided_velocity: f32,
    /// Largest standard deviation of an unmeasured position, m.
    pub unaided_position: f32,
    /// Largest coordinate of the position along any axis, m; beyond it the filter reports
    /// divergence. At 100 km an `f32` resolves 8 mm and the flat-earth model no longer holds.
    pub max_position: f32,
    /// Largest velocity along any axis, m/s; beyond it the filter reports divergence.
    pub max_velocity: f32,

    /// Knowledge of the heading at the start.
    pub start_heading: StartHeading,
    /// Earth's magnetic field at the place of operation, true NED; its length is ignored. `None`:
    /// north is magnetic north, and the inclination is taken from the calibration.
    /// [`aid::field::earth`](crate::aid::field::earth) computes it from declination and
    /// inclination. Ignored with [`StartHeading::Nose`].
    pub earth_field: Option<Vec3>,
}

impl EskfConfig {
    /// For a small multirotor in a room. Poses from cameras, if any, are frequent, so a short
    /// lock-out suffices; a position beyond 100 m or a velocity beyond 50 m/s is divergence.
    ///
    /// ```
    /// use stampfly_eskf::EskfConfig;
    /// assert!(EskfConfig::indoors().max_position < EskfConfig::outdoors().max_position);
    /// ```
    #[must_use]
    pub fn indoors() -> Self {
        Self { max_position: 100.0, max_velocity: 50.0, external_lockout: 0.2, lockout_samples: 1, ..Self::default() }
    }

    /// For a vehicle outdoors with a satellite receiver (up to half a second late), a barometer and
    /// possibly a magnetometer. Set the noise densities, `mag_enable` and `start_heading` for your
    /// vehicle.
    ///
    /// | differs from the default | reason |
    /// |---|---|
    /// | `horizon` 0.5 s | receivers report 50 to 300 ms late |
    /// | `external_lockout` 5 s, at least 10 fixes | a reflected signal lasts seconds |
    /// | `aiding_timeout` 10 s | receivers pause under trees and bridges |
    /// | `unaided_velocity`, `unaided_position` | a vehicle without aiding is not standing still |
    /// | `initial_position` 10 km | position is unknown until the first fix |
    /// | `gravity_sigma` 10 m/s² | circling without fixes must not be taken for level |
    /// | `position_wander` | a receiver's error stays constant for a minute |
    /// | `baro_backup` | the receiver measures the height; the barometer bridges gaps |
    /// | `start_heading` unknown | the receiver's velocity defines north |
    /// | `accel_noise`, `initial_accel_bias` | vibration adds noise; start-up bias of any MEMS part |
    /// | `vibration_bias`, `baro_wash` 0 | these describe a small multirotor's propellers |
    ///
    /// ```
    /// use stampfly_eskf::{EskfConfig, StartHeading, aid::field};
    /// let declination = 7.5f32.to_radians();
    /// let config = EskfConfig {
    ///     mag_enable: true,
    ///     start_heading: StartHeading::Magnetic,
    ///     earth_field: Some(field::earth(declination, 50f32.to_radians())),
    ///     ..EskfConfig::outdoors()
    /// };
    /// assert!(config.horizon >= 0.3);
    /// ```
    #[must_use]
    pub fn outdoors() -> Self {
        Self {
            accel_noise: 0.05,
            initial_position: 1e4,
            initial_velocity: 1.0,
            initial_accel_bias: 0.2,
            vibration_bias: 0.0,
            baro_wash: 0.0,
            baro_backup: true,
            external_lockout: 5.0,
            lockout_samples: 10,
            horizon: 0.5,
            aiding_timeout: 10.0,
            unaided_velocity: 50.0,
            unaided_position: 5e3,
            gravity_sigma: 10.0,
            position_wander: true,
            start_heading: StartHeading::Unknown,
            ..Self::default()
        }
    }

    /// Squared Mahalanobis distance of the gate for a measurement of `axes` axes. A vector of more
    /// axes is more often far away by chance, so its gate is wider for the same probability (6·10⁻⁵
    /// at four standard deviations).
    ///
    /// ```
    /// let config = stampfly_eskf::EskfConfig { gate: 4.0, ..Default::default() };
    /// assert_eq!(config.gate_distance(1), 16.0);
    /// assert!((config.gate_distance(2) - 19.36).abs() < 1e-3);
    /// ```
    #[inline]
    #[must_use]
    pub fn gate_distance(&self, axes: usize) -> f32 {
        self.gate * self.gate * Self::axes_factor(axes)
    }

    /// Squared gate of `axes` axes, relative to that of one.
    #[inline]
    pub(crate) fn axes_factor(axes: usize) -> f32 {
        GATE_OF_AXES.get(axes).copied().unwrap_or(GATE_OF_MORE)
    }
}

/// Squared gate for 0 to 3 axes, relative to that of one axis.
const GATE_OF_AXES: [f32; 4] = [1.0, 1.0, 1.21, 1.38];
/// The same for more than three axes: the value for six (31.9 / 16), conservative for four and
/// five.
const GATE_OF_MORE: f32 = 1.8;

/// Knowledge of the heading at the start; it also defines "north".
///
/// With every variant except [`Nose`](Self::Nose), north is true north, or magnetic north without
/// [`EskfConfig::earth_field`], and
/// [`Validity::HEADING`](stampfly_types::messages::Validity::HEADING) is set only while the
/// standard deviation of the heading is below a third of a radian.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum StartHeading {
    /// North is where the nose points at the start: for rooms without another reference. **Not for
    /// satellite receivers**: their velocities refer to true north and would contradict the
    /// attitude.
    #[default]
    Nose,
    /// Unknown: found from the first changes of an external velocity. Until then horizontal
    /// velocity, position and heading are not valid. The vehicle must stand still during
    /// calibration and then accelerate, in any direction.
    Unknown,
    /// From the magnetic field of the calibration. Without one, the same as
    /// [`Unknown`](Self::Unknown).
    Magnetic,
    /// Given, for example by a pilot, a two-antenna receiver or the direction of a runway.
    Given {
        /// Heading, rad, east of north.
        heading: f32,
        /// Its standard deviation, rad.
        sigma: f32,
    },
}

/// Which part of the magnetic field is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MagModel {
    /// Heading only, because nearby motors distort the field by more than any tilt. See
    /// [`aid::heading`](crate::aid::heading).
    #[default]
    Heading,
    /// All three axes, including tilt, for a field that is not distorted. See
    /// [`aid::field`](crate::aid::field).
    Field,
}

/// When the accelerometer is used as an inclinometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum GravityUse {
    /// While velocity is not measured. A measured velocity observes the tilt better.
    #[default]
    WhenUnaided,
    /// Always: the mean of the inertial samples over 10 ms, less the acceleration found from
    /// measured velocities. For a vehicle with a poor velocity measurement and little vibration.
    Always,
}

impl Default for EskfConfig {
    fn default() -> Self {
        Self {
            accel_noise: 0.1,
            gyro_noise: 5e-4,
            accel_vibration: 0.35,
            gyro_vibration: 0.25,
            angular_acceleration: 3_000.0,
            accel_full_scale: 78.4,
            gyro_bias_walk: 3e-5,
            accel_bias_walk: 1e-3,
            initial_position: 0.01,
            initial_velocity: 0.05,
            initial_attitude: 0.05,
            initial_gyro_bias: 8e-4,
            initial_accel_bias: 0.12,
            vibration_bias: 3.0,
            thrust_bias_walk: 0.15,
            tof_sigma: 0.005,
            tof_min: 0.02,
            tof_max: 4.0,
            min_cos_tilt: 0.8,
            ground_clearance: 0.03,
            flow_sigma: 0.1,
            flow_scale_sigma: 0.35,
            flow_delay: 0.004,
            flow_min_quality: 25,
            flow_min_distance: 0.08,
            flow_max_rate: 7.0,
            baro_sigma: 0.3,
            baro_enable: true,
            baro_backup: false,
            baro_walk: 0.02,
            baro_wash: 0.6,
            mag_sigma: 0.1,
            mag_model: MagModel::Heading,
            mag_enable: false,
            gravity_use: GravityUse::WhenUnaided,
            gravity_sigma: 1.0,
            stationary_gravity_sigma: 0.1,
            stationary_velocity_sigma: 0.01,
            stationary_position_sigma: 0.005,
            drag: 0.0,
            wind: 0.5,
            unobserved_velocity: 0.07,
            gate: 4.0,
            lockout: 0.2,
            external_lockout: 2.0,
            lockout_samples: 5,
            horizon: 0.1,
            position_wander: false,
            aiding_timeout: 1.0,
            unaided_velocity: 3.0,
            unaided_position: 10.0,
            max_position: 1e5,
            max_velocity: 300.0,
            start_heading: StartHeading::Nose,
            earth_field: None,
        }
    }
}
