//! Both links of a vehicle behind one door: the secure one, and the ecosystem's packets that authenticate nobody.
//!
//! For a vehicle that is to be flown with stock transmitters as well, or that has no key yet. What came over which is
//! marked in what is handed out. A vehicle whose own transmitters all have keys needs [`Vehicle`] alone.

use super::frame::{MAX_FRAME, MIN_FRAME};
use super::payload::Payload;
use super::received::Received;
use super::refused::Refused;
use super::vehicle::{Held, Vehicle};
use crate::{Address, PairingPacket, Rejected, Session};
use core::fmt;
use stampfly_types::messages::PilotInput;
use stampfly_types::{Duration, Instant};

/// What may be used of what authenticates nobody.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Policy {
    /// May control packets without a tag fly the vehicle? Even then, not while an authentic station is heard, and not for the rest of a
    /// flight in which one was, unless their transmitter [commands](Guarded::set_led).
    pub accept_unauthenticated: bool,
}

/// What was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heard<'f> {
    /// From a station with the key.
    Authentic(Received<'f>),
    /// From anyone.
    Unauthenticated(PilotInput),
    /// A part of the handshake, or a command that is said again: nothing for the caller.
    Handshake,
}

/// Why something was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NotTaken {
    /// The secure session refuses it.
    Secure(Refused),
    /// The unauthenticated session refuses it.
    Unauthenticated(Rejected),
    /// It authenticates nobody, and that is not wanted.
    Forbidden,
}

impl fmt::Display for NotTaken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Secure(refused) => refused.fmt(f),
            Self::Unauthenticated(rejected) => rejected.fmt(f),
            Self::Forbidden => f.write_str("not authenticated"),
        }
    }
}

impl core::error::Error for NotTaken {}

/// A vehicle's secure session, and its unauthenticated one beside it.
///
/// ```
/// use stampfly_link::secure::{Guarded, Heard, Key, NotTaken, Policy, Vehicle};
/// use stampfly_link::{Address, ControlPacket, Session};
/// use stampfly_types::Instant;
/// # let key = Key::generate(1, core::array::from_fn(|place| place as u8))?;
/// let (vehicle, pilot, now) = (Address([1; 6]), Address([2; 6]), Instant::ZERO);
/// let mut packet = ControlPacket::centred(vehicle).to_bytes();
/// let open = Session::new(vehicle, 1, Some(pilot));
///
/// let mut link = Guarded::new(Vehicle::new(key), open, Policy::default());
/// assert_eq!(link.receive(now, pilot, &mut packet), Err(NotTaken::Forbidden));
/// link.set_policy(Policy { accept_unauthenticated: true });
/// assert!(matches!(link.receive(now, pilot, &mut packet), Ok(Heard::Unauthenticated(_))));
/// # Ok::<(), stampfly_link::secure::KeyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Guarded {
    vehicle: Option<Vehicle>,
    session: Session,
    policy: Policy,
    forbidden: u32,
    /// Where the newest authentic frame came from.
    station: Option<Address>,
    /// Was a transmitter looked for, when it was said last?
    pairing: bool,
    armed: bool,
    /// Has a station with the key been heard since the motors may turn? Then nobody else takes over when it falls silent.
    is_claimed: bool,
    /// Does the paired transmitter command now?
    is_led: bool,
}

impl Guarded {
    /// Both sessions, and what may be used of the second. A vehicle that has no key has no secure session: `None`.
    #[must_use]
    pub fn new(vehicle: impl Into<Option<Vehicle>>, session: Session, policy: Policy) -> Self {
        Self {
            vehicle: vehicle.into(),
            session,
            policy,
            forbidden: 0,
            station: None,
            pairing: false,
            armed: false,
            is_claimed: false,
            is_led: false,
        }
    }

    /// A key was made: from now on there is a secure session.
    pub fn set_vehicle(&mut self, vehicle: Vehicle) {
        self.vehicle = Some(vehicle);
    }

    /// What may be used from now on.
    pub const fn set_policy(&mut self, policy: Policy) {
        self.policy = policy;
    }

    /// Says whether the motors may turn, see [`Vehicle::set_armed`] and [`Session::set_armed`].
    pub fn set_armed(&mut self, armed: bool) {
        if let Some(vehicle) = &mut self.vehicle {
            vehicle.set_armed(armed);
        }
        self.session.set_armed(armed);
        self.armed = armed;
        self.is_claimed &= armed;
    }

    /// Says whether the paired transmitter commands the armed vehicle now: a station with the key that only watches does not silence it then.
    /// The caller decides who commands.
    pub const fn set_led(&mut self, is_led: bool) {
        self.is_led = is_led;
    }

    /// Follows whoever decides whether the motors may turn and whether an unauthenticated transmitter is looked for. Call it
    /// every 20 ms or so; with motors armed, none is looked for.
    pub fn follow(&mut self, now: Instant, armed: bool, pairing: bool) {
        self.set_armed(armed);
        match (self.pairing, pairing) {
            // Refused with motors armed: then the session keeps its transmitter.
            (false, true) => drop(self.session.start_pairing(now)),
            (true, false) => self.session.stop_pairing(),
            _ => {}
        }
        self.pairing = pairing;
    }

    /// Takes what a station has sent. What is shorter than any frame of the secure link is a packet of the other, and so is
    /// everything on a vehicle without a key.
    ///
    /// # Errors
    /// When it is refused; the link that it is for has counted it.
    pub fn receive<'f>(&mut self, at: Instant, source: Address, bytes: &'f mut [u8]) -> Result<Heard<'f>, NotTaken> {
        if self.vehicle.is_some() && bytes.len() >= MIN_FRAME {
            return self.receive_sealed(at, source, bytes);
        }
        if !self.is_open(at) {
            self.forbidden = self.forbidden.wrapping_add(1);
            return Err(NotTaken::Forbidden);
        }
        self.session.receive(at, source, bytes).map(Heard::Unauthenticated).map_err(NotTaken::Unauthenticated)
    }

    /// Takes what has come over a network, where there is nothing but sealed frames.
    ///
    /// # Errors
    /// When it is none of a station with the key, or the vehicle has no key.
    pub fn receive_sealed<'f>(
        &mut self,
        at: Instant,
        source: Address,
        bytes: &'f mut [u8],
    ) -> Result<Heard<'f>, NotTaken> {
        let Some(vehicle) = &mut self.vehicle else {
            self.forbidden = self.forbidden.wrapping_add(1);
            return Err(NotTaken::Forbidden);
        };
        let received = vehicle.receive(at, bytes).map_err(NotTaken::Secure)?;
        self.station = Some(source);
        self.is_claimed |= self.armed && received.is_some();
        Ok(received.map_or(Heard::Handshake, Heard::Authentic))
    }

    /// Where the newest authentic frame came from.
    #[must_use]
    pub const fn station(&self) -> Option<Address> {
        self.station
    }

    /// May packets that authenticate nobody be used now?
    fn is_open(&self, now: Instant) -> bool {
        let is_joined = self.vehicle.as_ref().is_some_and(|vehicle| vehicle.is_joined(now));
        let is_another = (is_joined || self.is_claimed) && !(self.is_led && self.armed);
        self.policy.accept_unauthenticated && !is_another
    }

    /// What is to be sent to every station now, see [`Vehicle::transmit`].
    pub fn transmit<'r>(&mut self, now: Instant, random: [u8; 8], room: &'r mut [u8; MAX_FRAME]) -> Option<&'r [u8]> {
        self.vehicle.as_mut()?.transmit(now, random, room)
    }

    /// The announcement in force, see [`Vehicle::announcement`].
    pub fn announcement<'r>(&self, room: &'r mut [u8; MAX_FRAME]) -> Option<&'r [u8]> {
        self.vehicle.as_ref()?.announcement(room)
    }

    /// The call for an unauthenticated transmitter, if one is wanted and due.
    pub fn beacon(&mut self, now: Instant) -> Option<[u8; PairingPacket::LENGTH]> {
        if self.policy.accept_unauthenticated { self.session.beacon(now) } else { None }
    }

    /// Seals what the vehicle says to the station with the key, and says where that is. `None` when there is none, or it must
    /// not be sent.
    pub fn seal<'r>(
        &mut self,
        now: Instant,
        payload: &Payload<'_>,
        room: &'r mut [u8; MAX_FRAME],
    ) -> Option<(Address, &'r [u8])> {
        let station = self.station?;
        Some((station, self.vehicle.as_mut()?.seal(now, payload, room).ok()?))
    }

    /// Notes what became of a command, see [`Vehicle::acknowledge`].
    pub fn acknowledge(&mut self, received: &Received<'_>, taken: bool) {
        if let Some(vehicle) = &mut self.vehicle {
            vehicle.acknowledge(received, taken);
        }
    }

    /// Notes that a command was taken whose effect is not seen yet, see [`Vehicle::hold`].
    pub fn hold(&mut self, received: &Received<'_>) -> Option<Held> {
        Some(self.vehicle.as_mut()?.hold(received))
    }

    /// What became of a command that was held, see [`Vehicle::settle`].
    pub fn settle(&mut self, held: Held, is_done: bool) {
        if let Some(vehicle) = &mut self.vehicle {
            vehicle.settle(held, is_done);
        }
    }

    /// Seals what there is to acknowledge, as [`Guarded::seal`] does.
    pub fn seal_acknowledgement<'r>(
        &mut self,
        now: Instant,
        room: &'r mut [u8; MAX_FRAME],
    ) -> Option<(Address, &'r [u8])> {
        let payload = self.vehicle.as_mut()?.acknowledgement()?;
        self.seal(now, &payload, room)
    }

    /// To whom telemetry goes in the clear: the unauthenticated transmitter, while it may fly the vehicle.
    #[must_use]
    pub fn open_peer(&self, now: Instant) -> Option<Address> {
        self.session.peer().filter(|_| self.is_open(now) && !self.session.is_pairing())
    }

    /// How long ago the newest was taken, over either link.
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        match (self.vehicle.as_ref().and_then(|vehicle| vehicle.age(now)), self.session.age(now)) {
            (Some(secure), Some(open)) => Some(secure.min(open)),
            (secure, open) => secure.or(open),
        }
    }

    /// The secure session, if the vehicle has a key.
    #[must_use]
    pub const fn vehicle(&self) -> Option<&Vehicle> {
        self.vehicle.as_ref()
    }

    /// The same, to be used by itself.
    #[must_use]
    pub const fn vehicle_mut(&mut self) -> Option<&mut Vehicle> {
        self.vehicle.as_mut()
    }

    /// The unauthenticated session.
    #[must_use]
    pub const fn session(&self) -> &Session {
        &self.session
    }

    /// Packets that authenticate nobody and were not looked at because of it.
    #[must_use]
    pub const fn forbidden(&self) -> u32 {
        self.forbidden
    }
}
