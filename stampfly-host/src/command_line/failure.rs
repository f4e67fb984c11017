//! How a command ends when it does not succeed.
//!
//! | exit code | when |
//! |---|---|
//! | 0 | the flight, the comparison or the examination ended as it should |
//! | 1 | it did not, or began and was broken off: [`Unfinished`] |
//! | 2 | the command line, a value or a file is wrong: any other [`Failure`] |

use std::error::Error;
use std::fmt;
use std::process::ExitCode;

/// Why a command could not do what was typed. A flight that ended otherwise than it should is none:
/// its command prints the result and returns the code itself.
pub type Failure = Box<dyn Error>;

/// Exit code of a wrong command line, value or file; clap's own, too.
pub const UNUSABLE: u8 = 2;

/// A command began and was broken off: the line to the vehicle ended, a server lost its tasks.
#[derive(Debug)]
pub struct Unfinished(pub String);

impl fmt::Display for Unfinished {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Error for Unfinished {}

/// Tells it on standard error, and returns the exit code.
pub fn tell(failure: &Failure) -> ExitCode {
    errln!("stampfly: {failure}");
    if failure.is::<Unfinished>() { ExitCode::FAILURE } else { ExitCode::from(UNUSABLE) }
}
