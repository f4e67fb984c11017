//! A clock that can also wait.

use embedded_hal_async::delay::DelayNs;
use stampfly_types::Micros;

/// What a driver needs to stamp its samples and to keep a chip's delays.
///
/// Implemented by boards on a hardware timer and by the simulator on virtual time. Only drivers and the tasks
/// that run them hold one; everything that computes is told the time instead.
pub trait Timebase: DelayNs + Clone {
    /// Time since power-on.
    fn now(&self) -> Micros;
}
