//! Connects a simulated vehicle to other programs in real time, slower or faster.
//!
//! Virtual time follows the wall clock: the task [`Live::serve`] blocks the simulation until a tick
//! is due and receives from the ports meanwhile. Late ticks catch up to the schedule within a
//! quarter of a second; after a longer stop the schedule starts again. All published samples are
//! logged, so the flight can be replayed without the programs.
//!
//! A vehicle lists its ports ([`PortSpec`]), the program that flies it opens them ([`Ports`]), and
//! the vehicle interprets the bytes ([`Link`]). This module opens no socket.

use crate::time::Clock;
use core::fmt;
use core::net::SocketAddr;
use stampfly_types::{Duration, Instant};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Longest time without receiving while simulated time is paused.
const PAUSE: std::time::Duration = std::time::Duration::from_millis(20);
/// Delay from a tick to the answers: the executor has run the tick by then.
const AFTER_TICK: Duration = Duration::from_millis(1);

/// Transport of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Receives datagrams, and answers from the same port.
    Udp,
    /// Sends datagrams to a fixed address, whether or not a receiver exists, and receives the
    /// answers.
    UdpTo,
    /// Accepts connections.
    Tcp,
    /// A pseudo-terminal: a serial port visible on this machine only.
    Terminal,
    /// A page in a browser, served for all vehicles by the program that flies them.
    Page,
}

/// Protocol of a port. A stream whose first bytes belong to another protocol is closed before they
/// are interpreted: a web page can open a stream to any port of the machine that displays it, and
/// send arbitrary text after the head of its request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Speech {
    /// MAVLink frames from the first byte on.
    Mavlink,
    /// MSP frames from the first byte on.
    Msp,
    /// Text lines typed by a user.
    Text,
    /// As a board on USB: MAVLink frames and text lines.
    Cable,
    /// HTTP, checked by its server.
    Http,
    /// Datagrams, each checked separately.
    Datagrams,
}

/// Protection of a port against programs on other machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guard {
    /// None: the vehicle only sends.
    SendsOnly,
    /// The key: messages that are not signed or sealed with it have no effect. Without a key the
    /// port is not opened to other machines.
    Key,
    /// A secret in the address of the page, derived from the key. Without a key the port is not
    /// opened to other machines.
    Secret,
    /// The protocol has no place for a key: the port is open on this machine only.
    Loopback,
}

/// Specification of one port of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PortSpec {
    /// Name used by options.
    pub name: &'static str,
    /// Transport.
    pub transport: Transport,
    /// Default number. The n-th vehicle, counted from zero, adds ten times n, except for
    /// [`Transport::UdpTo`] and [`Transport::Page`].
    pub number: u16,
    /// Description of the protocol, for display.
    pub meaning: &'static str,
    /// Description of permitted actions, for display.
    pub may: &'static str,
    /// Protocol.
    pub speech: Speech,
    /// Protection against other machines.
    pub guard: Guard,
    /// Opened only if an option names it.
    pub when_named: bool,
}

/// Signing data of ports that other machines can reach.
#[derive(Clone, PartialEq, Eq)]
pub struct Signing {
    /// The shared key.
    pub key: [u8; 32],
    /// The MAVLink pass-phrase derived from the key.
    pub phrase: String,
    /// Present time in MAVLink's unit: 10 µs since the beginning of 2015.
    pub time: u64,
}

impl fmt::Debug for Signing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Signing")
    }
}

/// Permitted actions of a station with the key.
const STATION: &str = "fly; with motors off everything that the console does";
/// Permitted actions of configurators.
const TUNE: &str = "read its state, change gains";
/// Default of permitted actions.
const FLY: &str = "fly, change parameters";

impl PortSpec {
    /// The ground station's page.
    pub const PAGE: Self = Self {
        transport: Transport::Page,
        guard: Guard::Secret,
        may: "fly, change parameters, calibrate, turn motors, inject faults, take the log",
        ..Self::tcp("http", 8_080, Speech::Http, "the ground station, in a browser")
    };
    /// MAVLink, sent to the port on which ground stations listen.
    pub const MAVLINK_UDP: Self = Self {
        transport: Transport::UdpTo,
        guard: Guard::Key,
        ..Self::udp("mavlink-udp", 14_550, "MAVLink, for ground stations")
    };
    /// MAVLink for programs that connect.
    pub const MAVLINK_TCP: Self = Self {
        guard: Guard::Key,
        ..Self::tcp("mavlink-tcp", 5_760, Speech::Mavlink, "MAVLink, for programs that connect")
    };
    /// Sealed frames of a station with the vehicle's key. Without a key the port is not opened.
    pub const SEALED: Self = Self {
        guard: Guard::Key,
        may: STATION,
        ..Self::udp("sealed", 14_560, "sealed frames of a station with the key")
    };
    /// MSP for configurators that connect.
    pub const MSP: Self = Self { may: TUNE, ..Self::tcp("msp", 5_761, Speech::Msp, "MSP, for configurators") };
    /// MSP for configurators that open a serial port.
    pub const MSP_SERIAL: Self = Self {
        name: "msp-serial",
        transport: Transport::Terminal,
        number: 0,
        meaning: "the same, at a serial port",
        ..Self::MSP
    };

    /// A port that receives datagrams, on this machine only.
    #[must_use]
    pub const fn udp(name: &'static str, number: u16, meaning: &'static str) -> Self {
        let (transport, speech, guard) = (Transport::Udp, Speech::Datagrams, Guard::Loopback);
        Self { name, transport, number, meaning, may: FLY, speech, guard, when_named: false }
    }

    /// A port that accepts connections, on this machine only.
    #[must_use]
    pub const fn tcp(name: &'static str, number: u16, speech: Speech, meaning: &'static str) -> Self {
        let (transport, guard) = (Transport::Tcp, Guard::Loopback);
        Self { name, transport, number, meaning, may: FLY, speech, guard, when_named: false }
    }
}

/// A program at one of the vehicle's ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Client {
    /// Index of the port in [`Vehicle::PORTS`](super::Vehicle::PORTS).
    pub port: usize,
    /// Address of the program, unique at this port.
    pub address: SocketAddr,
}

/// An event at a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard<'b> {
    /// The program has connected. At a port of [`Transport::UdpTo`]: the address to which datagrams
    /// are sent.
    Opened,
    /// A datagram, or the next part of a stream.
    Bytes(&'b [u8]),
    /// Bytes that have waited for the vehicle for more than a second. Requests in them are
    /// obsolete, except for landing and stopping the motors.
    Late(&'b [u8]),
    /// The program has disconnected.
    Closed,
}

/// The open ports of one vehicle.
pub trait Ports: fmt::Debug + Send + Sync {
    /// Passes received events to `hear` in order, and waits for more until `until` if given.
    /// Bounded in number, so that a flood does not stall simulated time.
    fn receive(&self, until: Option<std::time::Instant>, hear: &mut dyn FnMut(Client, Heard<'_>));

    /// Sends without blocking. Datagrams that cannot be sent are lost, and a stream that accepts no
    /// data is closed.
    fn send(&self, to: &Client, bytes: &[u8]);

    /// Reports an event of the vehicle to all pages. Does nothing by default.
    fn tell(&self, _text: &str) {}

    /// Reports the program in command to all pages: its description, and its page number if it is a
    /// page. Empty if no program is in command. Does nothing by default.
    fn tell_commander(&self, _who: &str, _page: Option<u32>) {}

    /// Marks a program as authenticated: it has signed with the key of its port. Unauthenticated
    /// programs are dropped first when connections run out. Does nothing by default.
    fn believe(&self, _client: &Client) {}

    /// True if only programs on this machine reach the port.
    fn is_local(&self, _port: usize) -> bool {
        true
    }

    /// Signing data of the other ports, if any.
    fn signing(&self) -> Option<Signing> {
        None
    }

    /// True if the end of the flight has been requested.
    fn are_closed(&self) -> bool;
}

/// Connection of one vehicle to other programs.
#[derive(Clone, Debug)]
pub struct Live {
    /// The open ports.
    pub ports: Arc<dyn Ports>,
    /// Number of this vehicle among several, from zero.
    pub number: usize,
    /// Longest duration in virtual time; the flight is aborted after it.
    pub limit: Duration,
    /// Speed of virtual time. `None` if the caller paces it; then nothing here blocks.
    pub speed: Option<Speed>,
}

/// Virtual seconds per second of wall-clock time: 1 is real time, 0 a pause. A handle: clones share
/// the value.
#[derive(Clone, Debug)]
pub struct Speed(Arc<AtomicU32>);

impl Speed {
    /// A speed with this factor.
    #[must_use]
    pub fn new(factor: f32) -> Self {
        Self(Arc::new(AtomicU32::new(factor.to_bits())))
    }

    /// The factor.
    #[must_use]
    pub fn get(&self) -> f32 {
        f32::from_bits(self.0.load(Ordering::Relaxed))
    }

    /// Changes the factor.
    pub fn set(&self, factor: f32) {
        self.0.store(factor.to_bits(), Ordering::Relaxed);
    }
}

/// Callback that sends bytes to a client.
pub type Put<'p> = &'p mut dyn FnMut(&Client, &[u8]);

/// Protocol handler of a vehicle.
pub trait Link {
    /// Handles an event at a port. Answers go to `put`.
    fn hear(&mut self, now: Instant, from: Client, heard: Heard<'_>, put: Put<'_>);

    /// Called after each tick has run, to send periodic data to `put`.
    fn answer(&mut self, now: Instant, tick: u32, put: Put<'_>);
}

impl Live {
    /// Serves the ports tick by tick. The first tick comes one period after the present multiple of
    /// the period.
    pub async fn serve(&self, clock: Clock, period: Duration, mut link: impl Link) {
        let ports = &self.ports;
        let mut pace = self.speed.as_ref().map(|speed| Pace::new(speed, period));
        // Ticks are multiples of the period since zero, whenever serving begins.
        let begun = clock.now().as_micros() / period.as_micros();
        for tick in 1_u32.. {
            let due = period.as_micros() * (begun + u64::from(tick));
            clock.sleep_until(Instant::from_micros(due)).await;
            let mut hear = |until| {
                ports.receive(until, &mut |from, heard| {
                    link.hear(clock.now(), from, heard, &mut |to, bytes| ports.send(to, bytes));
                });
            };
            match &mut pace {
                Some(pace) => pace.wait(&mut |until| hear(Some(until)), &|| ports.are_closed()),
                None => hear(None),
            }
            // Other tasks and the executor run at the tick's instant before the answers are read.
            clock.sleep_until(clock.now() + AFTER_TICK).await;
            link.answer(clock.now(), tick, &mut |to, bytes| ports.send(to, bytes));
        }
    }
}

/// Holds virtual time to wall-clock time.
struct Pace<'s> {
    speed: &'s Speed,
    period: std::time::Duration,
    until: std::time::Instant,
}

impl<'s> Pace<'s> {
    fn new(speed: &'s Speed, period: Duration) -> Self {
        let period = std::time::Duration::from_micros(period.as_micros());
        Self { speed, period, until: std::time::Instant::now() }
    }

    /// Waits for the next tick and receives meanwhile.
    fn wait(&mut self, hear: &mut dyn FnMut(std::time::Instant), are_closed: &dyn Fn() -> bool) {
        let speed = loop {
            let speed = self.speed.get();
            if speed > 0.0 {
                break speed;
            }
            if are_closed() {
                return;
            }
            hear(std::time::Instant::now() + PAUSE);
            // The schedule continues from the end of a pause, without catching up.
            self.until = std::time::Instant::now();
        };
        // Avoids a division by a vanishing speed.
        let period = self.period.div_f32(speed.max(1e-5));
        self.until = next_tick(self.until, std::time::Instant::now(), period);
        hear(self.until);
        std::thread::sleep(self.until.saturating_duration_since(std::time::Instant::now()));
    }
}

/// Greatest delay that later ticks catch up. A busy machine delays a thread by tens of
/// milliseconds, and stations extrapolate the vehicle's clock. No new sticks are received while
/// catching up, so the limit is below the 500 ms after which vehicles declare a link lost.
const MADE_UP: std::time::Duration = std::time::Duration::from_millis(250);

/// Instant of the next tick: one period after the last, or now if that is more than [`MADE_UP`]
/// ago.
fn next_tick(last: std::time::Instant, now: std::time::Instant, period: std::time::Duration) -> std::time::Instant {
    let planned = last + period;
    if now.saturating_duration_since(planned) > MADE_UP { now } else { planned }
}

#[cfg(test)]
mod tests {
    use super::{Pace, Speed, next_tick};
    use std::time::{Duration, Instant};

    #[test]
    fn late_ticks_keep_the_plan_and_a_long_stop_is_not_made_up_for() {
        let (begun, ms) = (Instant::now(), Duration::from_millis);
        let next = |now| next_tick(begun, begun + ms(now), ms(10)).duration_since(begun);
        assert_eq!(next(0), ms(10));
        assert_eq!(next(19), ms(10), "a little late");
        assert_eq!(next(260), ms(10), "a busy machine");
        assert_eq!(next(300), ms(300), "a stop");
    }

    #[test]
    fn a_pause_ends_when_the_ports_close() {
        let speed = Speed::new(0.0);
        let mut pace = Pace::new(&speed, stampfly_types::Duration::from_micros(2_500));
        let mut heard = 0;
        let begun = Instant::now();
        let closed = std::cell::Cell::new(false);
        pace.wait(
            &mut |_| {
                heard += 1;
                closed.set(heard == 3);
            },
            &|| closed.get(),
        );
        assert_eq!(heard, 3);
        assert!(begun.elapsed() < Duration::from_secs(60));
    }
}
