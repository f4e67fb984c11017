//! A vehicle's line over the secure link: sealed frames, a datagram each, as the firmware speaks them in a Wi-Fi network.
//!
//! The station's end of the session, and its socket. What is said on the line is a cable's, and [translated](super::translation).

use super::translation::Translation;
use crate::waited::wait_at_most;
use stampfly_link::secure::{Key, MAX_FRAME, Payload, Station};
use stampfly_services::network::SEALED_UDP;
use std::fmt;
use std::hash::{BuildHasher as _, RandomState};
use std::io;
use std::net::{ToSocketAddrs as _, UdpSocket};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// Between two signs of life. A vehicle looks for another station after half a second of silence.
const SIGN: Duration = Duration::from_millis(200);
/// Between two turns of the handshake.
const TURN: Duration = Duration::from_millis(20);
/// Datagrams taken in one look.
const AT_ONCE: usize = 64;
/// A topic that no vehicle has: to end watching it is a sign of life that does nothing.
const NO_TOPIC: u16 = u16::MAX;

/// Where a vehicle is that has joined a network: host and port.
///
/// ```
/// use stampfly_host::connect::RadioPlace;
/// let place: RadioPlace = "udp:192.168.4.23".parse()?;
/// assert_eq!(place.to_string(), "udp:192.168.4.23:14560");
/// assert_eq!("udp:vehicle:14560".parse::<RadioPlace>()?.to_string(), "udp:vehicle:14560");
/// assert!("udp:".parse::<RadioPlace>().is_err() && "192.168.4.23".parse::<RadioPlace>().is_err());
/// # Ok::<(), stampfly_host::connect::RadioPlaceError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RadioPlace(String);

/// The text says no such place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RadioPlaceError(String);

impl fmt::Display for RadioPlaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{}' is not udp:HOST or udp:HOST:PORT", self.0)
    }
}

impl std::error::Error for RadioPlaceError {}

impl FromStr for RadioPlace {
    type Err = RadioPlaceError;

    fn from_str(text: &str) -> Result<Self, RadioPlaceError> {
        let address = text.strip_prefix("udp:").filter(|address| !address.is_empty());
        let address = address.and_then(|address| match address.rsplit_once(':') {
            None => Some(format!("{address}:{SEALED_UDP}")),
            Some((host, port)) => (!host.is_empty() && port.parse::<u16>().is_ok()).then(|| address.to_owned()),
        });
        address.map(Self).ok_or_else(|| RadioPlaceError(text.to_owned()))
    }
}

impl fmt::Display for RadioPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "udp:{}", self.0)
    }
}

/// The line.
pub struct Sealed {
    socket: UdpSocket,
    look: Duration,
    station: Station,
    translation: Translation,
    begun: Instant,
    signed: Option<Instant>,
    turned: Option<Instant>,
}

impl Sealed {
    /// To the vehicle at this place that has this key. A look waits so long for something to come.
    pub fn open(RadioPlace(address): &RadioPlace, key: &Key, look: Duration) -> io::Result<Self> {
        let place = address.to_socket_addrs()?.next().ok_or(io::ErrorKind::NotFound)?;
        let socket = UdpSocket::bind(if place.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" })?;
        socket.connect(place)?;
        let [a, b, c, d, ..] = fresh();
        let (station, translation) = (Station::new(key.clone()), Translation::new(u32::from_le_bytes([a, b, c, d])));
        Ok(Self { socket, look, station, translation, begun: Instant::now(), signed: None, turned: None })
    }

    /// What has come, after a short wait if nothing has: so many bytes, as a cable has them.
    pub fn read(&mut self, room: &mut [u8]) -> io::Result<usize> {
        if self.translation.frames.is_empty() {
            self.keep_alive();
            self.receive()?;
        }
        let frames = &mut self.translation.frames;
        let count = room.len().min(frames.len());
        room.iter_mut().zip(frames.drain(..count)).for_each(|(to, byte)| *to = byte);
        Ok(count)
    }

    /// Seals what a cable's bytes say, and sends it.
    pub fn write(&mut self, bytes: &[u8]) {
        let now = self.now();
        let Self { socket, station, translation, .. } = self;
        translation.say(now, bytes, &mut |payload| seal(socket, station, now, payload));
    }

    fn now(&self) -> stampfly_types::Instant {
        stampfly_types::Instant::from_micros(self.begun.elapsed().as_micros() as u64)
    }

    /// The handshake's turn, what is said again, and a sign of life.
    fn keep_alive(&mut self) {
        let now = self.now();
        let Self { socket, station, translation, .. } = self;
        if is_due(&mut self.turned, TURN) {
            let mut room = [0; MAX_FRAME];
            if let Some(frame) = station.transmit(now, fresh(), &mut room) {
                send(socket, frame);
            }
            translation.poll(now, &mut |payload| seal(socket, station, now, payload));
        }
        if is_due(&mut self.signed, SIGN) {
            seal(socket, station, now, &Payload::Watch { topic: NO_TOPIC, period: 0 });
            // Whoever has spoken is offered a session, as long as the vehicle has none.
            send(socket, &[]);
        }
    }

    fn receive(&mut self) -> io::Result<()> {
        // Room for one byte more than a frame has: a datagram that fills it is none.
        let mut room = [0; MAX_FRAME + 1];
        wait_at_most(&self.socket, self.look)?;
        for _ in 0..AT_ONCE {
            // A vehicle that is not there yet is an error as well, and is waited for as one that is silent.
            let Ok(length) = self.socket.recv(&mut room) else { break };
            // The first was waited for; what else has come is there.
            self.socket.set_nonblocking(true)?;
            let (now, session) = (self.now(), self.station.session());
            // What is refused is no word of the vehicle's.
            if let Some(frame) = room.get_mut(..length)
                && let Ok(Some(received)) = self.station.receive(now, frame)
            {
                self.translation.hear(now, &received.payload);
            }
            if session.is_some() && self.station.session() != session {
                self.translation.renewed();
            }
        }
        self.socket.set_nonblocking(false)
    }
}

/// Returns the counter of the frame. `None` without a session, or when a value must not be sent.
fn seal(socket: &UdpSocket, station: &mut Station, now: stampfly_types::Instant, payload: &Payload<'_>) -> Option<u32> {
    let mut room = [0; MAX_FRAME];
    send(socket, station.seal(now, payload, &mut room).ok()?);
    Some(station.counter())
}

/// What cannot be sent is lost, as on any network.
fn send(socket: &UdpSocket, bytes: &[u8]) {
    _ = socket.send(bytes);
}

fn is_due(last: &mut Option<Instant>, period: Duration) -> bool {
    let is_due = last.is_none_or(|last| last.elapsed() >= period);
    if is_due {
        *last = Some(Instant::now());
    }
    is_due
}

/// Eight new bytes: the operating system's random numbers, by way of what hash maps use.
fn fresh() -> [u8; 8] {
    RandomState::new().hash_one(0_u8).to_le_bytes()
}
