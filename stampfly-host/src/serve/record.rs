//! Where the compact record of a simulated flight goes: datagrams, or memory.
//!
//! A vehicle would stream it the same way: what sends has a ring and a
//! [`Streamer`](stampfly_flight::compact::Streamer), what receives writes chunks behind each other.
//! [`receive`] is that end here.

use crate::waited::has_only_waited;
use stampfly_bus::Schedule;
use stampfly_flight::Observer;
use stampfly_flight::compact::{MAGIC, Receiver};
use stampfly_sim::vehicle::Witness;
use std::io::{self, ErrorKind, Write};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

/// Longest datagram there is.
const DATAGRAM: usize = 65_536;
/// A record that has been silent for so long is over.
const SILENCE: Duration = Duration::from_secs(3);

/// Takes the compact record of a flight, as a witness of it.
#[derive(Debug)]
pub struct RecordOut {
    name: &'static str,
    to: To,
}

#[derive(Debug)]
enum To {
    Nowhere,
    Memory(Vec<u8>),
    Datagrams(UdpSocket),
}

impl RecordOut {
    /// No record is made.
    #[must_use]
    pub const fn nowhere() -> Self {
        Self { name: "", to: To::Nowhere }
    }

    /// A file in memory, of the vehicle of this name.
    #[must_use]
    pub fn memory(name: &'static str) -> Self {
        Self { name, to: To::Memory(MAGIC.to_vec()) }
    }

    /// A datagram a chunk, whether or not somebody listens.
    ///
    /// # Errors
    /// When there is no socket for it.
    pub fn datagrams(name: &'static str, to: SocketAddr) -> io::Result<Self> {
        let any = if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
        let socket = UdpSocket::bind(any)?;
        socket.connect(to)?;
        Ok(Self { name, to: To::Datagrams(socket) })
    }

    /// The file, if it is one in memory.
    #[must_use]
    pub fn file(&self) -> &[u8] {
        if let To::Memory(file) = &self.to { file } else { &[] }
    }
}

impl Observer for RecordOut {}

impl<R: Schedule> Witness<R> for RecordOut {
    fn record_of(&self) -> Option<&'static str> {
        (!matches!(self.to, To::Nowhere)).then_some(self.name)
    }

    fn recorded(&mut self, chunk: &[u8]) {
        match &mut self.to {
            To::Nowhere => {}
            // Memory takes everything.
            To::Memory(file) => _ = write_chunk(file, chunk),
            // What nobody hears is missing there, and is counted there.
            To::Datagrams(socket) => _ = socket.send(chunk),
        }
    }
}

/// A chunk in a file: its length goes before it.
pub(crate) fn write_chunk(file: &mut impl Write, chunk: &[u8]) -> io::Result<()> {
    let length = u16::try_from(chunk.len()).map_err(|_| ErrorKind::InvalidInput)?;
    file.write_all(&length.to_le_bytes())?;
    file.write_all(chunk)
}

/// Writes the chunks that arrive into a file, until so much time has passed, or none has come for
/// three seconds after the first.
///
/// # Errors
/// When the socket or the file fails. What is no chunk is ignored.
pub fn receive(socket: &UdpSocket, file: &mut impl Write, limit: Duration) -> io::Result<Receiver> {
    let (mut receiver, begun, mut heard) = (Receiver::default(), Instant::now(), None);
    let mut datagram = vec![0; DATAGRAM];
    file.write_all(&MAGIC)?;
    socket.set_read_timeout(Some(Duration::from_millis(200)))?;
    while begun.elapsed() < limit && heard.is_none_or(|heard: Instant| heard.elapsed() < SILENCE) {
        match socket.recv(&mut datagram) {
            Ok(length) => {
                let chunk = &datagram[..length];
                if receiver.take(chunk).is_ok() {
                    heard = Some(Instant::now());
                    write_chunk(file, chunk)?;
                }
            }
            Err(error) if has_only_waited(&error) => {}
            // A datagram of ours was refused where it went to.
            Err(error) if error.kind() == ErrorKind::ConnectionReset => {}
            Err(error) => return Err(error),
        }
    }
    file.flush()?;
    Ok(receiver)
}
