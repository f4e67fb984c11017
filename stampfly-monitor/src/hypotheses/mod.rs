//! The hypotheses, one per file.

mod flow_disagrees;
mod flow_frozen;
mod flow_jumped;
mod flow_standing;
mod flow_still;
mod gyro_jumped;
mod gyro_shifted;
mod gyro_standing;
mod range_jumped;
mod range_outliers;
mod range_stuck;
mod range_wrapped;

pub use flow_disagrees::FlowDisagrees;
pub use flow_frozen::FlowFrozen;
pub use flow_jumped::FlowJumped;
pub use flow_standing::FlowStanding;
pub use flow_still::FlowStill;
pub use gyro_jumped::GyroJumped;
pub use gyro_shifted::GyroShifted;
pub use gyro_standing::GyroStanding;
pub use range_jumped::RangeJumped;
pub use range_outliers::RangeOutliers;
pub use range_stuck::RangeStuck;
pub use range_wrapped::RangeWrapped;
