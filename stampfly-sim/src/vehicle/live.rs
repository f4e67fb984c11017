//! A vehicle in the hands of other programs, in real time or slower or faster.
//!
//! Virtual time waits for the wall: the task [`Live::serve`] holds the whole simulation until a
//! tick's time has come, and hears meanwhile what arrives. Ticks that come late keep the plan, up to
//! a quarter of a second; after a longer stop the plan begins anew. What is published is in the
//! log, so the flight can be replayed without the programs.
//!
//! A vehicle lists its ports ([`PortSpec`]); the program that flies it opens them ([`Ports`]), and
//! the vehicle makes of the bytes what it wants ([`Link`]). No socket is known here.

use crate::time::Clock;
use core::fmt;
use core::net::SocketAddr;
use stampfly_types::{Duration, Instant};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// In a pause, programs are heard this often.
const PAUSE: std::time::Duration = std::time::Duration::from_millis(20);
/// Between a tick and its answers: the executor has run it by then.
const AFTER_TICK: Duration = Duration::from_millis(1);

/// How bytes come to a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Datagrams come to it, and answers go from it.
    Udp,
    /// Datagrams are sent to it, whether or not somebody listens, and answers are heard.
    UdpTo,
    /// Programs connect to it.
    Tcp,
    /// A serial port that exists in this machine alone: a pseudo-terminal.
    Terminal,
    /// A page in a browser, which the program that flies the vehicle serves for all vehicles
    /// together.
    Page,
}

/// The language of a port. A stream whose first bytes are of another one is ended before anything
/// is made of it: a web page can open a stream to any port of the machine that shows it, and say
/// what it likes behind the head of its request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Speech {
    /// MAVLink: frames from the first byte on.
    Mavlink,
    /// MSP: frames from the first byte on.
    Msp,
    /// Lines that a person types.
    Text,
    /// What a board speaks on USB: frames of MAVLink, and lines that a person types.
    Cable,
    /// HTTP, which its server judges.
    Http,
    /// Datagrams, each of which is judged by itself.
    Datagrams,
}

/// What stops others than programs on this machine at a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guard {
    /// Nothing: the vehicle only sends there.
    SendsOnly,
    /// The key: what is not signed or sealed with it does nothing. Without a key the port is not
    /// opened for others.
    Key,
    /// A secret in the address of the page, which is made from the key. Without a key the port is
    /// not opened for others.
    Secret,
    /// The language has no room for a key: the port is on this machine alone.
    Loopback,
}

/// A port of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PortSpec {
    /// Name, as options take it.
    pub name: &'static str,
    /// How bytes come to it.
    pub transport: Transport,
    /// Its number, unless another is asked for. Of the n-th vehicle from zero: ten times n more,
    /// but for [`Transport::UdpTo`] and [`Transport::Page`].
    pub number: u16,
    /// What is spoken there.
    pub meaning: &'static str,
    /// What a program there may do.
    pub may: &'static str,
    /// Its language.
    pub speech: Speech,
    /// What stops others.
    pub guard: Guard,
    /// Is it opened only when an option names it?
    pub when_named: bool,
}

/// What is said at ports that others can reach is signed with this.
#[derive(Clone, PartialEq, Eq)]
pub struct Signing {
    /// The key that both ends share.
    pub key: [u8; 32],
    /// The pass-phrase of stations that speak MAVLink, which is made of the key.
    pub phrase: String,
    /// The time at which it is asked for, in MAVLink's units: 10 µs since 2015 began.
    pub time: u64,
}

impl fmt::Debug for Signing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Signing")
    }
}

/// What a station with the key may do.
const STATION: &str = "fly; with motors off everything that the console does";
/// What configurators may do.
const TUNE: &str = "read its state, change gains";
/// What a program may do at a port, unless another thing is said of it.
const FLY: &str = "fly, change parameters";

impl PortSpec {
    /// The page of a ground station.
    pub const PAGE: Self = Self {
        transport: Transport::Page,
        guard: Guard::Secret,
        may: "fly, change parameters, calibrate, turn motors, inject faults, take the log",
        ..Self::tcp("http", 8_080, Speech::Http, "the ground station, in a browser")
    };
    /// Where ground stations expect MAVLink to be sent to.
    pub const MAVLINK_UDP: Self = Self {
        transport: Transport::UdpTo,
        guard: Guard::Key,
        ..Self::udp("mavlink-udp", 14_550, "MAVLink, for ground stations")
    };
    /// Where programs connect for MAVLink.
    pub const MAVLINK_TCP: Self = Self {
        guard: Guard::Key,
        ..Self::tcp("mavlink-tcp", 5_760, Speech::Mavlink, "MAVLink, for programs that connect")
    };
    /// Where a station with the vehicle's key speaks in sealed frames. Without a key nothing is
    /// heard there, and it is not opened.
    pub const SEALED: Self = Self {
        guard: Guard::Key,
        may: STATION,
        ..Self::udp("sealed", 14_560, "sealed frames of a station with the key")
    };
    /// Where configurators connect for MSP.
    pub const MSP: Self = Self { may: TUNE, ..Self::tcp("msp", 5_761, Speech::Msp, "MSP, for configurators") };
    /// The same for programs that open a serial port.
    pub const MSP_SERIAL: Self = Self {
        name: "msp-serial",
        transport: Transport::Terminal,
        number: 0,
        meaning: "the same, at a serial port",
        ..Self::MSP
    };

    /// A port that datagrams come to, on this machine alone.
    #[must_use]
    pub const fn udp(name: &'static str, number: u16, meaning: &'static str) -> Self {
        let (transport, speech, guard) = (Transport::Udp, Speech::Datagrams, Guard::Loopback);
        Self { name, transport, number, meaning, may: FLY, speech, guard, when_named: false }
    }

    /// A port that programs connect to, on this machine alone.
    #[must_use]
    pub const fn tcp(name: &'static str, number: u16, speech: Speech, meaning: &'static str) -> Self {
        let (transport, guard) = (Transport::Tcp, Guard::Loopback);
        Self { name, transport, number, meaning, may: FLY, speech, guard, when_named: false }
    }
}

/// Who speaks: a program at one of the vehicle's ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Client {
    /// Place of the port in [`Vehicle::PORTS`](super::Vehicle::PORTS).
    pub port: usize,
    /// Where the program is. Unlike every other at this port.
    pub address: SocketAddr,
}

/// What is heard of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard<'b> {
    /// It has connected; at a port of [`Transport::UdpTo`], the address to which datagrams are to
    /// be sent.
    Opened,
    /// A datagram, or the next part of a stream.
    Bytes(&'b [u8]),
    /// The same, which has waited for the vehicle for more than a second: what it asks for is not
    /// wanted any more, but for landing and for motors off.
    Late(&'b [u8]),
    /// It is gone.
    Closed,
}

/// The open ports of one vehicle.
pub trait Ports: fmt::Debug + Send + Sync {
    /// Hands over what has come in, in order, and waits for more until then, if at all; a bounded
    /// number, so that a flood does not hold time up.
    fn receive(&self, until: Option<std::time::Instant>, hear: &mut dyn FnMut(Client, Heard<'_>));

    /// Sends. Never waits: what cannot be sent is lost, as on any network, and a stream that takes
    /// nothing is closed.
    fn send(&self, to: &Client, bytes: &[u8]);

    /// Tells every page what happens to the vehicle. Nothing by default.
    fn tell(&self, _text: &str) {}

    /// Tells every page who commands, in words, and the number of its page if it is one. Empty when
    /// no program does. Nothing by default.
    fn tell_commander(&self, _who: &str, _page: Option<u32>) {}

    /// This program has signed with the key that its port asks for: others make room for it.
    /// Nothing by default.
    fn believe(&self, _client: &Client) {}

    /// Do only programs on this machine reach that port?
    fn is_local(&self, _port: usize) -> bool {
        true
    }

    /// What is said at the other ports is signed with, if with anything.
    fn signing(&self) -> Option<Signing> {
        None
    }

    /// Has somebody asked for the end of the flight?
    fn are_closed(&self) -> bool;
}

/// Where other programs reach a vehicle, and for how long.
#[derive(Clone, Debug)]
pub struct Live {
    /// Where they are heard and answered.
    pub ports: Arc<dyn Ports>,
    /// Which of several vehicles this is, from zero.
    pub number: usize,
    /// The flight is broken off after this long, in virtual time.
    pub limit: Duration,
    /// How fast time passes. `None` where somebody else sees to that, and nothing here may wait.
    pub speed: Option<Speed>,
}

/// Virtual seconds in a second of the wall: 1 is real time, 0 is a pause. A handle: clones share
/// it.
#[derive(Clone, Debug)]
pub struct Speed(Arc<AtomicU32>);

impl Speed {
    /// This fast.
    #[must_use]
    pub fn new(factor: f32) -> Self {
        Self(Arc::new(AtomicU32::new(factor.to_bits())))
    }

    /// How fast.
    #[must_use]
    pub fn get(&self) -> f32 {
        f32::from_bits(self.0.load(Ordering::Relaxed))
    }

    /// From now on this fast.
    pub fn set(&self, factor: f32) {
        self.0.store(factor.to_bits(), Ordering::Relaxed);
    }
}

/// Where answers go.
pub type Put<'p> = &'p mut dyn FnMut(&Client, &[u8]);

/// What a vehicle makes of what it hears.
pub trait Link {
    /// Something was heard.
    fn hear(&mut self, now: Instant, from: Client, heard: Heard<'_>, put: Put<'_>);

    /// A tick has run.
    fn answer(&mut self, now: Instant, tick: u32, put: Put<'_>);
}

impl Live {
    /// Connects a vehicle to other programs, tick by tick, the first one period after the clock's
    /// zero.
    pub async fn serve(&self, clock: Clock, period: Duration, mut link: impl Link) {
        let ports = &self.ports;
        let mut pace = self.speed.as_ref().map(|speed| Pace::new(speed, period));
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
            clock.sleep_until(clock.now() + AFTER_TICK).await;
            link.answer(clock.now(), tick, &mut |to, bytes| ports.send(to, bytes));
        }
    }
}

/// Holds virtual time to the wall's.
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

    /// Waits for the next tick, and has programs heard meanwhile.
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
            // A pause is not made up for.
            self.until = std::time::Instant::now();
        };
        // A speed of a hundred thousandth is none.
        let period = self.period.div_f32(speed.max(1e-5));
        self.until = next_tick(self.until, std::time::Instant::now(), period);
        hear(self.until);
        std::thread::sleep(self.until.saturating_duration_since(std::time::Instant::now()));
    }
}

/// Greatest delay that later ticks make up for. A busy machine runs a thread late by tens of
/// milliseconds, and stations count on from the vehicle's clock. Ticks that catch up hear no new
/// sticks, so all of them together stay below the 500 ms after which vehicles call a link silent.
const MADE_UP: std::time::Duration = std::time::Duration::from_millis(250);

/// When the next tick is due: a period after the one before, or earlier than now when that was late.
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
