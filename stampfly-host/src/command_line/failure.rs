//! How a command ends when it does not succeed.

use std::process::ExitCode;

/// Something to tell, with an exit code of 1. A flight that was flown and did not go well is no failure: its command prints
/// the result and returns the code itself.
pub type Failure = Box<dyn std::error::Error>;

/// Tells it on standard error.
pub fn tell(failure: &Failure) -> ExitCode {
    errln!("stampfly: {failure}");
    ExitCode::FAILURE
}
