//! What runs beside the runnables: drivers that publish, and the task that flies.
//!
//! | task | waits for | then |
//! |---|---|---|
//! | [`pump`] | a driver's next sample | publishes it; counts errors and tries again |
//! | [`fly`] | a sample of the inertial sensor, or the next deadline | runs what is due and turns the motors, without a hand-off |
//!
//! Beside them stands [`DeadMan`], by which whoever watches the flight task knows that it is alive.
//!
//! The tasks are plain `async` functions on the traits of `stampfly-drivers` and know no executor: firmware spawns them on
//! hardware, a test on virtual time.

mod dead_man;
mod flight;
mod sensing;

pub use dead_man::DeadMan;
pub use flight::fly;
pub use sensing::{Health, pump};
