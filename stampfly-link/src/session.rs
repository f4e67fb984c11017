//! The vehicle's end of the link: whom it listens to, and what it throws away.
//!
//! Before it is paired, and while it looks for a new transmitter, the vehicle calls twice a second and takes the first
//! station that answers with a whole control packet for this very vehicle and its arm switch off. From then on it
//! listens to that station and to nobody else. Looking starts only on the pilot's demand.
//!
//! With motors armed, of which [`Session::set_armed`] is told, it never looks, whoever armed them: it keeps the
//! transmitter it has, and without one it listens to nobody. So nobody can talk a flying vehicle out of its pilot's hands
//! by shouting.
//!
//! Nothing that was refused counts as a sign of life: [`Session::receive`] is the only door, and what it lets through is
//! what may be published.

use crate::{Address, ControlError, ControlPacket, PairingPacket};
use stampfly_types::messages::PilotInput;
use stampfly_types::{Duration, Instant};

/// Time between two calls for a transmitter.
const CALL_PERIOD: Duration = Duration::from_millis(500);
/// A transmitter that has been silent for this long is looking for vehicles, too.
const SILENCE: Duration = Duration::from_secs(1);

/// What came in since power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Taken.
    pub accepted: u32,
    /// Older than the newest that was taken.
    pub old: u32,
    /// From a station the vehicle does not listen to, or does not take as its own.
    pub strangers: u32,
    /// Not of a control packet's length.
    pub length: u32,
    /// For another vehicle.
    pub other_vehicles: u32,
    /// With a wrong checksum.
    pub checksum: u32,
    /// With sticks or switches that no transmitter has.
    pub content: u32,
}

/// Why a packet was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rejected {
    /// From a station the vehicle does not listen to.
    Stranger,
    /// No control packet for this vehicle.
    Malformed(ControlError),
    /// Older than the newest that was taken.
    Old,
    /// From a transmitter that wants to be the vehicle's and has its arm switch on.
    ArmSwitch,
}

impl core::fmt::Display for Rejected {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Stranger => f.write_str("from a station the vehicle does not listen to"),
            Self::Malformed(error) => error.fmt(f),
            Self::Old => f.write_str("older than the newest"),
            Self::ArmSwitch => f.write_str("its arm switch is on"),
        }
    }
}

impl core::error::Error for Rejected {}

/// The vehicle is armed: it keeps its transmitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PairingRefused;

impl core::fmt::Display for PairingRefused {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the vehicle is armed")
    }
}

impl core::error::Error for PairingRefused {}

/// The vehicle's end of the link.
///
/// ```
/// use stampfly_link::{Address, ControlPacket, Session};
/// use stampfly_types::{Duration, Instant, messages::PilotInput};
/// let (vehicle, pilot) = (Address([1; 6]), Address([2; 6]));
/// let mut session = Session::new(vehicle, 1, Some(pilot));
/// assert_eq!(session.beacon(Instant::ZERO), None, "paired: it does not call");
/// session.set_armed(true);
/// assert!(session.start_pairing(Instant::ZERO).is_err(), "not with motors armed");
///
/// let bytes = ControlPacket::centred(vehicle).to_bytes();
/// assert!(session.receive(Instant::ZERO, Address([3; 6]), &bytes).is_err());
/// assert_eq!(session.age(Instant::from_micros(20_000)), None, "a stranger is no sign of life");
/// assert!(session.receive(Instant::from_micros(10_000), pilot, &bytes).is_ok());
/// assert_eq!(session.age(Instant::from_micros(20_000)), Some(Duration::from_micros(10_000)));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    vehicle: Address,
    channel: u8,
    peer: Option<Address>,
    armed: bool,
    /// While looking for a transmitter, and without one while armed: when to call next.
    next_call: Option<Instant>,
    newest: Option<Instant>,
    /// While looking: when the present transmitter was last heard, or looking began.
    present_heard: Instant,
    counters: Counters,
}

impl Session {
    /// A vehicle at power-on. Without a peer it looks for one.
    #[must_use]
    pub fn new(vehicle: Address, channel: u8, peer: Option<Address>) -> Self {
        let next_call = if peer.is_none() { Some(Instant::ZERO) } else { None };
        Self {
            vehicle,
            channel,
            peer,
            armed: false,
            next_call,
            newest: None,
            present_heard: Instant::ZERO,
            counters: Counters::default(),
        }
    }

    /// Says whether the motors may turn; call it at least as often as [`Session::beacon`] is asked. Who looks for a
    /// transmitter when that begins goes back to the present one; who has none goes on looking when it is over.
    pub fn set_armed(&mut self, armed: bool) {
        self.armed = armed;
        if armed {
            self.stop_pairing();
        }
    }

    /// Looks for a transmitter. The present one is heard no more, until it has been silent for a second.
    ///
    /// # Errors
    /// With motors armed; nothing has changed then.
    pub fn start_pairing(&mut self, now: Instant) -> Result<(), PairingRefused> {
        if self.armed {
            return Err(PairingRefused);
        }
        (self.next_call, self.present_heard) = (Some(now), now);
        Ok(())
    }

    /// Goes back to the present transmitter. Without one, the vehicle goes on looking.
    pub fn stop_pairing(&mut self) {
        if self.peer.is_some() {
            self.next_call = None;
        }
    }

    /// Is the vehicle looking for a transmitter?
    #[must_use]
    pub fn is_pairing(&self) -> bool {
        self.next_call.is_some() && !self.armed
    }

    /// The call that is due now, for everybody: ask at least as often as it is due.
    pub fn beacon(&mut self, now: Instant) -> Option<[u8; PairingPacket::LENGTH]> {
        let next = self.next_call.filter(|next| now >= *next && !self.armed)?;
        // From the plan, not from now, so that late questions do not add up; but never two at once.
        let planned = next + CALL_PERIOD;
        self.next_call = Some(if planned > now { planned } else { now + CALL_PERIOD });
        Some(PairingPacket { channel: self.channel, vehicle: self.vehicle }.to_bytes())
    }

    /// Takes what a station has sent, `at` the instant it came in.
    ///
    /// # Errors
    /// When it is not the pilot's newest word; it may not be used then.
    pub fn receive(&mut self, at: Instant, source: Address, bytes: &[u8]) -> Result<PilotInput, Rejected> {
        let outcome = self.judge(at, source, bytes);
        let Counters { accepted, old, strangers, length, other_vehicles, checksum, content } = &mut self.counters;
        let counter = match &outcome {
            Ok(_) => accepted,
            Err(Rejected::Old) => old,
            Err(Rejected::Stranger | Rejected::ArmSwitch) => strangers,
            Err(Rejected::Malformed(ControlError::Length)) => length,
            Err(Rejected::Malformed(ControlError::OtherVehicle)) => other_vehicles,
            Err(Rejected::Malformed(ControlError::Checksum)) => checksum,
            Err(Rejected::Malformed(ControlError::Range | ControlError::Switches)) => content,
        };
        *counter = counter.wrapping_add(1);
        outcome
    }

    fn judge(&mut self, at: Instant, source: Address, bytes: &[u8]) -> Result<PilotInput, Rejected> {
        // Whoever listens to one station looks at the source first; whoever looks for one, at everything else.
        if !self.is_pairing() && self.peer != Some(source) {
            return Err(Rejected::Stranger);
        }
        let packet = ControlPacket::decode(bytes, self.vehicle).map_err(Rejected::Malformed)?;
        if !source.is_station() {
            return Err(Rejected::Stranger);
        }
        if self.newest.is_some_and(|newest| at < newest) {
            return Err(Rejected::Old);
        }
        if self.is_pairing() {
            if self.peer == Some(source) {
                let heard = core::mem::replace(&mut self.present_heard, at);
                if at.since(heard) < SILENCE {
                    return Err(Rejected::Stranger);
                }
            }
            if packet.arm {
                return Err(Rejected::ArmSwitch);
            }
            (self.peer, self.next_call) = (Some(source), None);
        }
        self.newest = Some(at);
        Ok(packet.pilot_input())
    }

    /// The transmitter the vehicle belongs to. To be stored when it changes.
    #[must_use]
    pub fn peer(&self) -> Option<Address> {
        self.peer
    }

    /// How long ago the newest packet was taken.
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        self.newest.map(|at| now.since(at))
    }

    /// What came in since power-on.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }
}
