//! A vehicle in the hands of other programs, in real time.
//!
//! Virtual time waits for the wall: a task of the surroundings that waits in [`Live::receive`] holds the whole simulation,
//! and hears meanwhile what arrives. What it publishes is in the log, so the flight can be replayed without the programs.

use stampfly_types::Duration;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::Instant;

/// Where other programs reach a vehicle, and for how long.
#[derive(Clone, Debug)]
pub struct Live {
    /// Where they are heard and answered.
    pub socket: Arc<UdpSocket>,
    /// The flight is broken off after this long.
    pub limit: Duration,
}

impl Live {
    /// Waits for a datagram, on the wall clock. Returns its length and sender; `None` when nothing has come until then. What
    /// has arrived already is returned even when it is later than that.
    pub fn receive(&self, until: Instant, buffer: &mut [u8]) -> Option<(usize, SocketAddr)> {
        loop {
            let left = until.saturating_duration_since(Instant::now());
            // The socket refuses to wait for no time at all.
            self.socket.set_read_timeout(Some(left.max(std::time::Duration::from_micros(1)))).ok()?;
            match self.socket.recv_from(buffer) {
                Ok(received) => return Some(received),
                Err(_) if left.is_zero() => return None,
                // The time is over, or the system reports that an answer found its receiver gone.
                Err(_) => {}
            }
        }
    }
}
