//! A vehicle in the hands of other programs, in real time.
//!
//! Virtual time waits for the wall: the task [`Live::serve`] holds the whole simulation until a tick's time has come, and
//! hears meanwhile what arrives. What it publishes is in the log, so the flight can be replayed without the programs.

use crate::time::Clock;
use stampfly_types::{Duration, Instant};
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;

/// Datagrams heard in one tick: a bound on what a flood can cost.
const DATAGRAMS: usize = 256;
/// Longest datagram, bytes.
const LONGEST: usize = 2048;
/// Between a tick and its answers: the executor has run it by then.
const AFTER_TICK: Duration = Duration::from_millis(1);

/// Where other programs reach a vehicle, and for how long.
#[derive(Clone, Debug)]
pub struct Live {
    /// Where they are heard and answered.
    pub socket: Arc<UdpSocket>,
    /// The flight is broken off after this long.
    pub limit: Duration,
}

/// What a vehicle makes of datagrams.
pub trait Link {
    /// One has arrived.
    fn hear(&mut self, now: Instant, from: SocketAddr, bytes: &[u8]);

    /// A tick has run: hands the answers to `put`.
    fn answer(&mut self, now: Instant, tick: u32, put: &mut dyn FnMut(&SocketAddr, &[u8]));
}

impl Live {
    /// Connects a vehicle to other programs, tick by tick, the first one period after the clock's zero.
    pub async fn serve(&self, clock: Clock, period: Duration, mut link: impl Link) {
        let begun = std::time::Instant::now();
        for tick in 1_u32.. {
            let due = period.as_micros() * u64::from(tick);
            clock.sleep_until(Instant::from_micros(due)).await;
            let until = begun + std::time::Duration::from_micros(due);
            self.receive(until, &mut |from, bytes| link.hear(clock.now(), from, bytes));
            clock.sleep_until(clock.now() + AFTER_TICK).await;
            // An answer that cannot be sent is lost, as on any network.
            link.answer(clock.now(), tick, &mut |to, bytes| _ = self.socket.send_to(bytes, to));
        }
    }

    /// Hears until then, on the wall clock. What has arrived already is heard even when it is later.
    fn receive(&self, until: std::time::Instant, hear: &mut dyn FnMut(SocketAddr, &[u8])) {
        let left = || until.saturating_duration_since(std::time::Instant::now());
        let mut buffer = [0; LONGEST];
        for _ in 0..DATAGRAMS {
            let left = left();
            // The socket refuses to wait for no time at all.
            let wait = Some(left.max(std::time::Duration::from_micros(1)));
            match self.socket.set_read_timeout(wait).and_then(|()| self.socket.recv_from(&mut buffer)) {
                Ok((length, from)) => hear(from, &buffer[..length]),
                Err(_) if left.is_zero() => return,
                // The time is over, or the system reports that an answer found its receiver gone.
                Err(_) => {}
            }
        }
        std::thread::sleep(left());
    }
}
