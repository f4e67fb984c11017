//! What Com sends and receives: the rover's table of datagrams.
//!
//! The layout is that of [`stampfly_link::datagram`], with the magic `RVR1`; as text it is [`stampfly_link::json`]. The
//! fields of each message are listed at its type. `examples/python` speaks both, and both sides are tested against
//! `tests/vectors/datagrams.json`.
//!
//! ```
//! use stampfly_link::{Datagram, DatagramError};
//! use stampfly_rover::{com::{Body, MAX}, messages::OperatorCommand};
//! use stampfly_types::Instant;
//! let body = OperatorCommand { throttle: 0.5, ..OperatorCommand::default() }.into();
//! let datagram: Datagram<Body> = Datagram { sequence: 1, time: Instant::ZERO, body };
//! let mut buffer = [0; MAX];
//! assert_eq!(Datagram::read(datagram.write(&mut buffer)?), Ok(datagram));
//! # Ok::<(), DatagramError>(())
//! ```

use crate::messages::*;
use stampfly_link::{datagram, datagrams};
use stampfly_param::{ParameterRequest, ParameterStatus};
use stampfly_types::Duration;

/// Room for the longest datagram, bytes.
pub const MAX: usize = datagram::length::<LogRecord>();

/// How long a [`Subscription`] lasts without being repeated.
pub const SUBSCRIPTION: Duration = Duration::from_secs(2);

fn is_input(throttle: f32, brake: f32, steer: f32) -> bool {
    (0.0..=1.0).contains(&throttle) && (0.0..=1.0).contains(&brake) && (-1.0..=1.0).contains(&steer)
}

datagrams! {
    /// The messages between the rover and other programs.
    pub enum Body, magic b"RVR1";

    /// To the rover: what the operator asks for.
    OperatorCommand = 1, valid if |m| is_input(m.throttle, m.brake, m.steer);
    /// To the rover: a step of a change of parameters; the parameter's table has the range of the value.
    ParameterRequest = 2, valid if |_| true;
    /// To the rover, from an engine in another process. Each one is its heartbeat.
    DriveCommand = 3, valid if |m| m.acceleration >= 0.0;
    /// From the rover: the selected input, for an engine in another process.
    DriverInput = 4, valid if |m| is_input(m.throttle, m.brake, m.steer);
    /// From the rover: the supervisor's decision.
    SafetyStatus = 5, valid if |_| true;
    /// From the rover: the log, live.
    LogRecord = 6, valid if |m| is_input(m.throttle, m.brake, m.steer) && m.v >= 0.0;
    /// From the rover: which parameters are in use.
    ParameterStatus = 7, valid if |_| true;
    /// To the rover: who wants the log.
    Subscription = 8, valid if |_| true;
}
