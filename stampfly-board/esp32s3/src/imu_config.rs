//! The configuration the BMI270 does not run without.
//!
//! Bosch publishes it with its sensor API under the licence in `NOTICE`. Without the feature `bmi270-config` there is
//! none: the inertial sensor does not start then, and the vehicle does not arm.

/// Bosch's file, 8 kB, or nothing.
#[cfg(feature = "bmi270-config")]
pub static FILE: &[u8] = &bmi2::config::BMI270_CONFIG_FILE;

#[cfg(not(feature = "bmi270-config"))]
pub static FILE: &[u8] = &[];
