//! Calibration of sensors on the ground.
//!
//! | component | finds | the vehicle | result |
//! |---|---|---|---|
//! | [`StillCalibration`] | gyro bias, attitude, ground altitude | lies still, each power-on | [`CalibrationResult`] |
//! | [`SixPosition`] | accelerometer scale and bias | lies on each of six faces, once | [`AccelCorrection`] |
//! | [`EllipsoidFit`] | magnetometer hard and soft iron | is turned all ways, once per place | [`MagCorrection`] |
//! | [`LevelTrim`] | tilt of the sensor in the airframe | stands on a level floor, once | [`Trim`] |
//! | [`TemperatureTable`] | bias against temperature | lies still while warming up | [`TemperatureBias`] |
//! | [`DriftFit`] | the same as a straight line | lies still while warming up | [`Drift`] |
//!
//! All are plain data, stepped with the time as an argument. An unusable sample is refused with the
//! reason; a result comes with its quality or not at all. All but the ellipsoid use
//! [`StillAverage`], so they share one definition of still.
//!
//! A [`CalibrationSession`] runs all but the first on request. [`Corrections`] hold the results,
//! and a [`Corrector`] applies them in this order: drift with temperature, accelerometer or
//! magnetometer correction, trim.
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
