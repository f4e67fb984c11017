//! Mounting of the emulated chips on their board, as configured in their drivers.

use stampfly_drivers::chip::{Axis, AxisMap};

/// The inertial sensor lies upside down: body = (y, x, −z) of the chip.
pub const IMU: AxisMap = AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::MinusZ).expect("a rotation");
/// The magnetometer: body = (−y, x, z) of the chip.
pub const MAGNETOMETER: AxisMap = AxisMap::new(Axis::MinusY, Axis::PlusX, Axis::PlusZ).expect("a rotation");
/// The flow sensor: body = (−y, x) of the chip.
pub const FLOW: AxisMap = AxisMap::new(Axis::MinusY, Axis::PlusX, Axis::PlusZ).expect("a rotation");
