//! A vehicle at a serial port: how it is told to fly a world that is elsewhere.

use crate::doctor::Lost;
use crate::doctor::console::{Serial, ask};
use stampfly_flight::hil::COMMAND;
use std::time::Duration;

/// A vehicle that restarts has its port again by then.
const RESTARTED: Duration = Duration::from_secs(15);
/// And no port of before that any more.
const GONE: Duration = Duration::from_millis(500);

/// Opens a port whose vehicle waits to be greeted: it is restarted for that.
///
/// # Errors
/// When there is no such port, or the vehicle does not want to, for instance because it is armed.
pub fn open(path: &str) -> Result<Serial, Lost> {
    let mut port = Serial::open(path, RESTARTED)?;
    // A vehicle that restarts has no prompt for the next line, nor has one that waits to be greeted already.
    if let Ok(answer) = ask(&mut port, COMMAND) {
        return Err(Lost(format!("it stays as it is: {}", answer.trim())));
    }
    drop(port);
    std::thread::sleep(GONE);
    Serial::open(path, RESTARTED)
}
