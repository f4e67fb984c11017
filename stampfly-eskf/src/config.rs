//! Everything about the error-state Kalman filter that can be tuned, with the reason for each default.

use stampfly_types::Vec3;

/// Tuning of [`Eskf`](crate::Eskf). One set serves a sensor suite; the defaults are those of a small vehicle indoors (BMI270,
/// VL53L3CX, PMW3901, BMP280); [`EskfConfig::outdoors`] is for satellite receivers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EskfConfig {
    /// Accelerometer noise density, m/s²/√Hz. Far above the data sheet's 0.0016: it stands for errors of scale and
    /// axes; vibration is `accel_vibration`.
    pub accel_noise: f32,
    /// Gyro noise density, rad/s/√Hz. Above the data sheet's 0.00012 for the same reason.
    pub gyro_noise: f32,
    /// Share of the squared change of the accelerometer from sample to sample that adds to its noise, 1. A third for
    /// white noise of 800 Hz bandwidth sampled at 400 Hz. See [`Vibration`](crate::filter::Vibration).
    pub accel_vibration: f32,
    /// The same for the gyro.
    pub gyro_vibration: f32,
    /// Largest angular acceleration of the body, rad/s². An inertial sample that asks for more is
    /// garbage, unless it goes on: up to three running that follow from each other, and 20 that do
    /// not, are bridged with the last sample before them.
    pub angular_acceleration: f32,
    /// Full scale of the accelerometer, m/s²: a sample with every axis there is garbage in the same way.
    pub accel_full_scale: f32,
    /// Gyro bias random walk, rad/s/√s.
    pub gyro_bias_walk: f32,
    /// Accelerometer bias random walk, m/s²/√s.
    pub accel_bias_walk: f32,

    /// First standard deviation of position, m.
    pub initial_position: f32,
    /// First standard deviation of velocity, m/s.
    pub initial_velocity: f32,
    /// First standard deviation of attitude, rad.
    pub initial_attitude: f32,
    /// First standard deviation of the gyro bias after a still-calibration, rad/s.
    pub initial_gyro_bias: f32,
    /// First standard deviation of the accelerometer bias, m/s². MEMS start-up biases are 0.1 to 0.4, but most of the
    /// horizontal part already went into the first attitude.
    pub initial_accel_bias: f32,
    /// How far vibration may move the accelerometer's vertical zero when the motors start, m/s². Recorded StampFly
    /// flights average −8.7 to −9.2 instead of −9.8.
    pub vibration_bias: f32,
    /// How fast the accelerometer's vertical zero moves in flight, m/s²/√s, because the vibration changes with the thrust. Used while no
    /// range shows the zero: the barometer then finds a zero that has moved by 1 m/s² within three seconds.
    pub thrust_bias_walk: f32,

    /// Standard deviation of a range, m.
    pub tof_sigma: f32,
    /// Nearest range used, m.
    pub tof_min: f32,
    /// Farthest range used, m.
    pub tof_max: f32,
    /// Largest tilt at which the level-surface model holds, as the cosine.
    pub min_cos_tilt: f32,
    /// Distance from the sensor to the ground while standing, m: used when the sensor is blind there.
    pub ground_clearance: f32,

    /// Standard deviation of a flow sample, rad/s: one count in ten milliseconds is 0.22.
    pub flow_sigma: f32,
    /// Part of the flow error that grows with the image's motion, as a share. A PMW3901 sees 121 frames a second and is
    /// read a hundred times: a reading holds one frame's motion or two, so it is 17 % low or 65 % high.
    pub flow_scale_sigma: f32,
    /// How long before its stamp a flow sample's stretch of time ended, s: pictures wait to be compared and read. 4 ms
    /// by the data sheet, 17 in recorded logs, where the logger is part of it.
    pub flow_delay: f32,
    /// Smallest surface quality used.
    pub flow_min_quality: u8,
    /// Nearer to the floor, m, the picture is blurred: a PMW3901 works from 80 mm on. A take-off does
    /// not use it.
    pub flow_min_distance: f32,
    /// Fastest motion of the picture that the camera follows, rad/s: 7.4 for a PMW3901. A faster one it
    /// shows as another.
    pub flow_max_rate: f32,

    /// Standard deviation of a barometric altitude, m.
    pub baro_sigma: f32,
    /// Use the barometer.
    pub baro_enable: bool,
    /// While something from outside measures the height, the barometer only learns its zero, and holds the height when the other
    /// is silent for two seconds. Its zero is kept apart from the state, without their correlation, so that beside a receiver,
    /// which is worse than the barometer from second to second, its many samples would claim a height that nobody knows.
    pub baro_backup: bool,
    /// How fast the barometer's zero drifts, m/√s: a metre an hour is 0.017.
    pub baro_walk: f32,
    /// How far starting propellers move the barometer's zero, m, and how uncertain its altitude is near the floor. StampFlys read 0.6 m
    /// lower at the floor with turning propellers, and 0.2 m lower above it.
    pub baro_wash: f32,
    /// Standard deviation of a magnetic direction, rad.
    pub mag_sigma: f32,
    /// What of the magnetic field is used.
    pub mag_model: MagModel,
    /// Use the magnetometer. Off by default: the StampFly's motor currents bend the field.
    pub mag_enable: bool,

    /// When the accelerometer is an inclinometer.
    pub gravity_use: GravityUse,
    /// Its standard deviation as one, m/s².
    pub gravity_sigma: f32,
    /// The same while stationary, m/s².
    pub stationary_gravity_sigma: f32,
    /// Standard deviation of "does not move" while stationary, m/s.
    pub stationary_velocity_sigma: f32,
    /// Standard deviation of "is where it stood" while stationary, m.
    pub stationary_position_sigma: f32,

    /// Share of its velocity through still air that a multirotor loses each second to the drag of rotors and body, 1/s. It is the
    /// only thing that shows the velocity when nothing measures it; half or twice the true one still does. 0: not used.
    pub drag: f32,
    /// Standard deviation of the wind, m/s, an error of that velocity.
    pub wind: f32,

    /// Standard deviation of "hardly moves" while tilted too far to see the ground, (m/s)·√s: divided by the
    /// accelerometer noise it is the time in which the velocity fades.
    pub unobserved_velocity: f32,

    /// Gates, in standard deviations.
    pub gate: f32,
    /// Lock-out time: after this long with every measurement of a sensor rejected, the state is reset to it, s. Of range, flow,
    /// barometer, magnetometer and gravity.
    pub lockout: f32,
    /// The same for position, velocity and attitude from outside, s. A receiver between walls is wrong for seconds.
    pub external_lockout: f32,
    /// Measurements rejected running that a reset needs besides the time: two bad fixes of a slow receiver are no lock-out.
    pub lockout_samples: u16,

    /// Oldest measurement that is placed in time, s: the delay of the slowest sensor, and what its clock may be wrong by. The
    /// memory has the same size for any; beyond 0.11 s it becomes coarser, see [`History`](crate::filter::History).
    pub horizon: f32,
    /// Positions from outside may be wrong by the same for minutes, as those of satellite receivers are: a position is then not
    /// claimed better than the part of its stated deviation that does not show from fix to fix.
    pub position_wander: bool,
    /// For how long position and velocity from outside, and measurements of one's own, hold the outputs valid, s. Meanwhile the
    /// inertial sensor carries them and the covariance says how far.
    pub aiding_timeout: f32,
    /// Standard deviation at which a velocity that nothing measures is given up and set to zero, m/s.
    pub unaided_velocity: f32,
    /// Largest standard deviation of a position that nothing measures, m.
    pub unaided_position: f32,
    /// A position farther from the origin along any axis is divergence, m. At 100 km an `f32` resolves 8 mm, and the earth is no
    /// longer flat.
    pub max_position: f32,
    /// A velocity above this along any axis is divergence, m/s.
    pub max_velocity: f32,

    /// What is known about the heading at the start.
    pub start_heading: StartHeading,
    /// The earth's field at the place, true NED; its length does not matter. `None`: north is magnetic north, and the inclination
    /// that of the calibration. [`aid::field::earth`](crate::aid::field::earth) makes one from declination and inclination. With
    /// [`StartHeading::Nose`] it is not looked at.
    pub earth_field: Option<Vec3>,
}

impl EskfConfig {
    /// For a small multirotor in a room: position or pose from cameras, if any, comes so often that two rejected ones are many, and
    /// what is 100 m away or flies at 50 m/s is lost.
    ///
    /// ```
    /// use stampfly_eskf::EskfConfig;
    /// assert!(EskfConfig::indoors().max_position < EskfConfig::outdoors().max_position);
    /// ```
    #[must_use]
    pub fn indoors() -> Self {
        Self { max_position: 100.0, max_velocity: 50.0, external_lockout: 0.2, lockout_samples: 1, ..Self::default() }
    }

    /// For a vehicle under the open sky: satellite receiver up to half a second late, barometer, perhaps a magnetometer, its own
    /// inertial sensor at any rate. Set noise densities, `mag_enable` and what the start knows of the heading to yours.
    ///
    /// | differs from the default | because |
    /// |---|---|
    /// | `horizon` 0.5 s | receivers report 50 to 300 ms late |
    /// | `external_lockout` 5 s of at least 10 fixes | a reflected signal lasts seconds |
    /// | `aiding_timeout` 10 s | receivers pause under trees and bridges |
    /// | `unaided_velocity`, `unaided_position` | a vehicle that nothing measures is not standing |
    /// | `initial_position` 10 km | the first fix says where it is; a barometer has nothing to be compared with until then |
    /// | `gravity_sigma` 10 m/s² | without fixes a vehicle that circles or speeds up is not upright because it feels so |
    /// | `position_wander` | a receiver's error stays the same for a minute |
    /// | `baro_backup` | a receiver's height beside a barometer's |
    /// | `start_heading` unknown | the receiver knows north, the nose does not |
    /// | `accel_noise`, `initial_accel_bias` | vibration is told by `accel_vibration`; start-up bias of any MEMS part |
    /// | `vibration_bias`, `baro_wash` 0 | no small multirotor's propellers |
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

    /// Squared Mahalanobis distance at which the gate of a measurement of so many axes lies. A vector of more axes is
    /// more often far away by chance: its gate is wider, for the same chance (6·10⁻⁵ at four standard deviations).
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

    /// Squared gate of so many axes, relative to that of one.
    #[inline]
    pub(crate) fn axes_factor(axes: usize) -> f32 {
        GATE_OF_AXES.get(axes).copied().unwrap_or(GATE_OF_MORE)
    }
}

/// Squared gate, relative to that of one axis.
const GATE_OF_AXES: [f32; 4] = [1.0, 1.0, 1.21, 1.38];
/// The same for more than three: that of six, 31.9 of 16, which is on the safe side for four and five.
const GATE_OF_MORE: f32 = 1.8;

/// What is known about the heading at the start, and with it where north is.
///
/// With all but the first, `north` is true north, or magnetic north without [`EskfConfig::earth_field`], and
/// [`Validity::HEADING`](stampfly_types::messages::Validity::HEADING) is set only while the heading is known to a third of
/// a radian.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum StartHeading {
    /// "North" is where the nose points at the start: for rooms, where nothing tells another north. **Not for satellite
    /// receivers**, whose north is another one: their velocities would contradict the attitude.
    #[default]
    Nose,
    /// Not known: the first changes of a velocity from outside show it. Until then horizontal velocity, position and heading are
    /// not valid. The vehicle must stand at its calibration and then accelerate, in any direction.
    Unknown,
    /// From the field of the calibration. Without one it is [`Unknown`](Self::Unknown).
    Magnetic,
    /// Given: by a pilot, by two antennas, by a mark on the runway.
    Given {
        /// Heading, rad, east of north.
        heading: f32,
        /// Its standard deviation, rad.
        sigma: f32,
    },
}

/// What of the magnetic field is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MagModel {
    /// Its heading only: nearby motors bend it by more than any tilt. See [`aid::heading`](crate::aid::heading).
    #[default]
    Heading,
    /// All three axes, tilt included: nothing bends it. See [`aid::field`](crate::aid::field).
    Field,
}

/// When the accelerometer is an inclinometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum GravityUse {
    /// While nothing measures velocity: otherwise velocity shows the tilt, and better.
    #[default]
    WhenUnaided,
    /// All inertial samples, by their mean over 10 ms, less the acceleration that measured velocities show: for a vehicle whose velocity is
    /// measured badly and whose motors do not shake it.
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
