//! Both links of a vehicle behind one door: the secure one, and the ecosystem's packets that authenticate nobody.
//!
//! For a vehicle that is to be flown with stock transmitters as well. What came over which is marked in what is handed out.
//! A vehicle whose own transmitters all have keys needs [`Vehicle`] alone.

use super::frame::{MAX_FRAME, MIN_FRAME};
use super::received::Received;
use super::refused::Refused;
use super::vehicle::Vehicle;
use crate::{Address, PairingPacket, Rejected, Session};
use core::fmt;
use stampfly_types::messages::PilotInput;
use stampfly_types::{Duration, Instant};

/// What may be used of what authenticates nobody.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Policy {
    /// May control packets without a tag fly the vehicle? Even then, not while an authentic station is heard.
    pub accept_unauthenticated: bool,
}

/// What was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heard<'f> {
    /// From a station with the key.
    Authentic(Received<'f>),
    /// From anyone.
    Unauthenticated(PilotInput),
    /// A part of the handshake: nothing for the caller.
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
    vehicle: Vehicle,
    session: Session,
    policy: Policy,
    forbidden: u32,
}

impl Guarded {
    /// Both sessions, and what may be used of the second.
    #[must_use]
    pub const fn new(vehicle: Vehicle, session: Session, policy: Policy) -> Self {
        Self { vehicle, session, policy, forbidden: 0 }
    }

    /// What may be used from now on.
    pub const fn set_policy(&mut self, policy: Policy) {
        self.policy = policy;
    }

    /// Says whether the motors may turn, see [`Vehicle::set_armed`] and [`Session::set_armed`].
    pub fn set_armed(&mut self, armed: bool) {
        self.vehicle.set_armed(armed);
        self.session.set_armed(armed);
    }

    /// Takes what a station has sent. What is shorter than any frame of the secure link is a packet of the other.
    ///
    /// # Errors
    /// When it is refused; the link that it is for has counted it.
    pub fn receive<'f>(&mut self, at: Instant, source: Address, bytes: &'f mut [u8]) -> Result<Heard<'f>, NotTaken> {
        if bytes.len() >= MIN_FRAME {
            let received = self.vehicle.receive(at, bytes).map_err(NotTaken::Secure)?;
            return Ok(received.map_or(Heard::Handshake, Heard::Authentic));
        }
        if !self.policy.accept_unauthenticated || self.vehicle.is_joined(at) {
            self.forbidden = self.forbidden.wrapping_add(1);
            return Err(NotTaken::Forbidden);
        }
        self.session.receive(at, source, bytes).map(Heard::Unauthenticated).map_err(NotTaken::Unauthenticated)
    }

    /// What is to be sent to every station now, see [`Vehicle::transmit`].
    pub fn transmit<'r>(&mut self, now: Instant, random: [u8; 8], room: &'r mut [u8; MAX_FRAME]) -> Option<&'r [u8]> {
        self.vehicle.transmit(now, random, room)
    }

    /// The call for an unauthenticated transmitter, if one is wanted and due.
    pub fn beacon(&mut self, now: Instant) -> Option<[u8; PairingPacket::LENGTH]> {
        if self.policy.accept_unauthenticated { self.session.beacon(now) } else { None }
    }

    /// How long ago the newest was taken, over either link.
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        match (self.vehicle.age(now), self.session.age(now)) {
            (Some(secure), Some(open)) => Some(secure.min(open)),
            (secure, open) => secure.or(open),
        }
    }

    /// The secure session.
    #[must_use]
    pub const fn vehicle(&mut self) -> &mut Vehicle {
        &mut self.vehicle
    }

    /// The unauthenticated session.
    #[must_use]
    pub const fn session(&mut self) -> &mut Session {
        &mut self.session
    }

    /// Packets that authenticate nobody and were not looked at because of it.
    #[must_use]
    pub const fn forbidden(&self) -> u32 {
        self.forbidden
    }
}
