//! Indices of the error states. Each kind of state has three, one per axis of its frame.
//!
//! Use these constants instead of literals wherever a Jacobian or a correction is written or read.

/// Number of error states.
pub const N: usize = 15;
/// Index of the first position error state.
pub const POSITION: usize = 0;
/// Index of the first velocity error state.
pub const VELOCITY: usize = 3;
/// Index of the first attitude error state.
pub const ATTITUDE: usize = 6;
/// Index of the first gyro bias error state.
pub const GYRO_BIAS: usize = 9;
/// Index of the first accelerometer bias error state.
pub const ACCEL_BIAS: usize = 12;
