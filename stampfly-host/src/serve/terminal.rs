//! A pseudo-terminal: a serial port that exists in this machine alone, for programs that speak
//! through one.
//!
//! The system gives it a name when it is opened, `/dev/pts/3` or `/dev/ttys003`. There is one line,
//! whichever program opens it, and the vehicle does not know whether one has: bytes that no program
//! reads are lost. Windows has no pseudo-terminals; every vehicle offers the same service at a TCP
//! port.

use super::connections::Connections;
use super::events::Events;
use stampfly_sim::vehicle::Client;
use std::io;
use std::sync::Arc;

/// Has this system any?
pub(super) const EXIST: bool = cfg!(unix);

/// Opens one, and returns its name.
#[cfg(unix)]
pub(super) fn open(client: Client, connections: &Arc<Connections>, events: &Events) -> io::Result<String> {
    use super::age::Looks;
    use crate::waited::has_only_waited;
    use serialport::{SerialPort as _, TTYPort};
    use stampfly_sim::vehicle::Heard;
    use std::io::{ErrorKind, Read, Write};
    use std::time::Instant;

    let (mut ours, mut theirs) = TTYPort::pair()?;
    // Whoever opens it by its name is not the one who holds it here.
    theirs.set_exclusive(false)?;
    let name = theirs.name().ok_or_else(|| io::Error::from(ErrorKind::NotFound))?;
    let mut writer = ours.try_clone_native()?;
    ours.set_timeout(super::events::POLL)?;
    writer.set_timeout(super::events::POLL)?;
    let waiting = connections.join(client);
    let events = events.clone();
    std::thread::spawn(move || {
        while let Some(bytes) = waiting.next() {
            // Nobody reads: it is lost.
            _ = writer.write_all(&bytes);
        }
    });
    std::thread::spawn(move || {
        events.put(client, Heard::Opened, Instant::now());
        let (mut part, mut looks) = ([0; 512], Looks::begin(Instant::now()));
        while events.are_open() {
            match ours.read(&mut part) {
                Ok(length) => {
                    let since = looks.found(Instant::now());
                    events.put(client, Heard::Bytes(part.get(..length).unwrap_or_default()), since);
                }
                Err(error) if has_only_waited(&error) => looks.failed(Instant::now(), &error),
                Err(_) => break,
            }
        }
        // Until here, so that the line does not end with each program that closes it.
        drop(theirs);
    });
    Ok(name)
}

/// There are none.
#[cfg(not(unix))]
pub(super) fn open(_: Client, _: &Arc<Connections>, _: &Events) -> io::Result<String> {
    Err(io::ErrorKind::Unsupported.into())
}
