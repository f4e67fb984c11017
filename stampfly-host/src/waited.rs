//! Reads and writes that wait for a limited time: which of their errors say only that nothing has happened meanwhile.

use std::io::{Error, ErrorKind};

/// Has it only waited? Systems name that differently, and a computer that wakes up from sleep, or a program that goes on after it
/// was stopped, finds its reads interrupted (`man 7 signal`, "Interruption of system calls and library functions by stop signals").
pub(crate) fn has_only_waited(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
