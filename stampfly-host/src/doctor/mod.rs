//! The doctor: walks a newcomer through a vehicle before it flies for the first time, and names what is wrong with it.
//!
//! | module | what it is |
//! |---|---|
//! | [`visit`] | what the doctor can do: ask the vehicle, wait, ask somebody to do something or to say what he sees |
//! | [`walk`] | the examination, step by step |
//! | [`reading`] | the vehicle's answers as numbers |
//! | [`axes`] | which way a sensor is soldered, from what it feels |
//! | [`chart`] | what was found, as a table and as a file to send |
//! | [`console`] | the vehicle's console over a serial port |
//! | [`newcomer`] | somebody at a terminal |
//! | [`emulated`] | a vehicle on a bench of this computer, and somebody who does as he is asked |
//!
//! What the vehicle can judge of itself it does ([`stampfly_flight::doctor`]); here is judged what needs somebody who tilts,
//! looks and listens. Names of findings are stable. Not for flights: `stampfly replay` and the report are for those.

pub mod axes;
pub mod chart;
pub mod console;
pub mod emulated;
pub mod newcomer;
pub mod reading;
pub mod visit;
pub mod walk;

pub use chart::{Chart, Row};
pub use visit::{Act, Lost, Question, Visit};
pub use walk::examine;
