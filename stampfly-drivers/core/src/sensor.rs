//! One trait for each kind of sensor.

use crate::SensorError;
use stampfly_types::messages::{
    AirspeedData, BaroData, ExternalPose, FlowData, GnssData, ImuData, MagData, PowerData, TofData,
};
use stampfly_types::{Duration, Instant};

/// A measurement and the instant it is valid for. Its quality is part of the measurement: `valid`,
/// `sigma`, `quality`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample<T> {
    /// The instant the data is valid for.
    pub at: Instant,
    /// The measurement.
    pub data: T,
}

impl<T> Sample<T> {
    /// Age of the data at `now`; zero when its time stamp is in the future.
    ///
    /// ```
    /// use stampfly_driver_core::Sample;
    /// use stampfly_types::{Duration, Instant};
    /// let sample = Sample { at: Instant::from_micros(1_000), data: () };
    /// assert_eq!((sample.age(Instant::from_micros(3_000)), sample.age(Instant::ZERO)), (Duration::from_micros(2_000), Duration::ZERO));
    /// ```
    #[must_use]
    pub fn age(&self, now: Instant) -> Duration {
        now.since(self.at)
    }
}

macro_rules! sensor_trait {
    ($(#[$meta:meta])* $Name:ident, $Data:ty) => {
        $(#[$meta])*
        pub trait $Name {
            /// The driver's error.
            type Error: SensorError;

            /// Waits for the next sample. The front page of the crate states the contract of sensor
            /// traits.
            ///
            /// # Errors
            /// When this sample is lost. The next call tries again.
            async fn next(&mut self) -> Result<Sample<$Data>, Self::Error>;
        }

        impl<T: $Name + ?Sized> $Name for &mut T {
            type Error = T::Error;
            async fn next(&mut self) -> Result<Sample<$Data>, Self::Error> {
                T::next(self).await
            }
        }
    };
}

sensor_trait! {
    /// A six-axis inertial measurement unit that delivers samples at the control rate.
    ///
    /// A driver whose chip samples faster decimates with a filter, not by skipping samples.
    Imu, ImuData
}
sensor_trait! {
    /// A magnetometer with its factory compensation applied.
    Magnetometer, MagData
}
sensor_trait! {
    /// A barometer with its factory compensation applied.
    Barometer, BaroData
}
sensor_trait! {
    /// A range finder along a fixed beam.
    ///
    /// A distance that the driver considers invalid is a sample with `valid: false`, not an error:
    /// "no target in the beam" is a valid answer.
    RangeFinder, TofData
}
sensor_trait! {
    /// An optical flow sensor. The angles are the sum since the previous sample; no motion between
    /// two calls is lost.
    OpticalFlow, FlowData
}
sensor_trait! {
    /// A motion capture system. A sample is stamped with the instant of exposure and arrives tens
    /// of milliseconds later.
    MotionCapture, ExternalPose
}
sensor_trait! {
    /// A battery monitor.
    PowerMonitor, PowerData
}
sensor_trait! {
    /// A satellite receiver (GNSS). A sample is stamped with the instant of its fix and arrives 50
    /// to 300 ms later. Without satellites the receiver still delivers samples, with
    /// [`GnssFix::None`](stampfly_types::messages::GnssFix::None).
    Gnss, GnssData
}
sensor_trait! {
    /// A pitot tube with its pressure sensor. The offset of the sensor has been removed.
    Airspeed, AirspeedData
}
