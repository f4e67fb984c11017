//! What an [`Estimator`](crate::Estimator) has to answer for and the attitude filter does not need: time, and a record.

use stampfly_types::Instant;
use stampfly_types::messages::{CalibrationResult, EstimatorCommand, EstimatorStatus};

/// What the trait needs and the filter does not: time, and a record.
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
