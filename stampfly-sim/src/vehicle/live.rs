//! A vehicle in the hands of other programs, in real time or slower or faster.
//!
//! Virtual time waits for the wall: the task [`Live::serve`] holds the whole simulation until a tick's time has come, and
//! hears meanwhile what arrives. A machine that comes too late for a tick loses the time: the vehicle does not hurry after
//! it, because nobody could steer it there. What is published is in the log, so the flight can be replayed without the
//! programs.

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
    /// The flight is broken off after this long, in virtual time.
    pub limit: Duration,
    /// Virtual seconds in a second of the wall, above 0; 1 is real time.
    pub speed: f32,
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
        let real_period = std::time::Duration::from_micros(period.as_micros()).div_f32(self.speed);
        let mut until = std::time::Instant::now();
        for tick in 1_u32.. {
            let due = period.as_micros() * u64::from(tick);
            clock.sleep_until(Instant::from_micros(due)).await;
            until = next_tick(until, std::time::Instant::now(), real_period);
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

/// When the next tick is due. A late one keeps the plan up to a period, so a sleep that was a little long adds nothing.
fn next_tick(last: std::time::Instant, now: std::time::Instant, period: std::time::Duration) -> std::time::Instant {
    (last + period).max(now.checked_sub(period).unwrap_or(now))
}

#[cfg(test)]
mod tests {
    use super::next_tick;
    use std::time::{Duration, Instant};

    #[test]
    fn a_late_tick_keeps_the_plan_and_lost_time_is_not_made_up_for() {
        let (begun, ms) = (Instant::now(), Duration::from_millis);
        let next = |now| next_tick(begun, begun + ms(now), ms(10)).duration_since(begun);
        assert_eq!(next(0), ms(10));
        assert_eq!(next(19), ms(10), "a little late");
        assert_eq!(next(500), ms(490), "one period, not fifty");
    }
}
