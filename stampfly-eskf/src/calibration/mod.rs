//! Calibration: what a sensor does wrong that can be found out on the ground.
//!
//! | component | finds | the vehicle has to | result |
//! |---|---|---|---|
//! | [`StillCalibration`] | gyro bias, first attitude, ground altitude | lie still, after every power-on | [`CalibrationResult`] |
//! | [`SixPosition`] | accelerometer scale and bias | lie on each of its six faces, once | [`AccelCorrection`] |
//! | [`EllipsoidFit`] | magnetometer hard and soft iron | be turned all ways, once per place | [`MagCorrection`] |
//! | [`LevelTrim`] | tilt of the sensor in the airframe | stand on a level floor, once | [`Trim`] |
//! | [`TemperatureTable`] | bias against temperature | lie still while it warms up | [`TemperatureBias`] |
//! | [`DriftFit`] | the same as a straight line | lie still while it warms up | [`Drift`] |
//!
//! All are plain data stepped with the time as an argument. A sample that is of no use is refused with the reason; a
//! result comes with its quality, or not at all. Five of them listen to [`StillAverage`], so all mean the same by still.
//!
//! A [`CalibrationSession`] does all but the first as somebody asks for them, [`Corrections`] are what was found, and a [`Corrector`]
//! applies it, in this order: temperature bias, accelerometer or magnetometer correction, trim.
//!
//! [`CalibrationResult`]: stampfly_types::messages::CalibrationResult

mod corrections;
mod drift;
mod ellipsoid;
mod least_squares;
mod level_trim;
mod principal_axes;
mod session;
mod six_position;
mod still;
mod stillness;
mod temperature;

pub use corrections::{Corrections, Corrector, DriftCorrection, IronCorrection, LevelCorrection};
pub use drift::{Drift, DriftFit, DriftRefusal};
pub use ellipsoid::{EllipsoidConfig, EllipsoidFailure, EllipsoidFit, EllipsoidQuality, MagCorrection, MagRefusal};
pub use level_trim::{LevelTrim, LevelTrimQuality, LevelTrimRefusal, Trim};
pub use session::CalibrationSession;
pub use six_position::{
    AccelCorrection, Face, SixPosition, SixPositionFailure, SixPositionQuality, SixPositionRefusal,
};
pub use still::{StillCalibration, StillQuality};
pub use stillness::{NotStill, StillAverage, StillMean, StillnessConfig};
pub use temperature::{Coverage, TemperatureBias, TemperatureQuality, TemperatureRefusal, TemperatureTable};
