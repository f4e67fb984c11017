//! State that the [`Estimator`](crate::Estimator) interface requires of the attitude filter: time,
//! calibration, commands and status.

use stampfly_types::Instant;
use stampfly_types::messages::{CalibrationResult, EstimatorCommand, EstimatorStatus};

/// State for the trait that the filter itself does not use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Bookkeeping {
    pub now: Instant,
    pub initialized: bool,
    pub calibration: CalibrationResult,
    pub command: EstimatorCommand,
    pub mag_at: Option<Instant>,
    pub mag_fused: Option<Instant>,
    pub status: EstimatorStatus,
}
