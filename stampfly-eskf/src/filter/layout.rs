//! The error states: how many there are, and where each kind begins. Each kind has three, one for each axis of its frame.
//!
//! Use these instead of numbers wherever a Jacobian or a correction is filled or read.

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
