//! The vehicle's end of the pilot's radio: packets in, the pilot's frames on the bus; telemetry and calls out.
//!
//! Everything but moving the bytes: firmware, which has the radio, gives [`Link`] what it has received and sends what
//! [`Link::transmit`] returns. The mode machine decides whether the vehicle looks for a transmitter; the link follows
//! `flight_status`, and publishes the transmitter it is paired with, to be stored.

use crate::messages::{LinkPeer, TelemetryFrame};
use crate::topics::{CommandPilotTx, FlightStatusRx, LinkPeerTx, TelemetryRx};
use stampfly_link::{Address, PairingPacket, Rejected, Session, TelemetryPacket};
use stampfly_types::messages::{Alerts, ArmBlocks};
use stampfly_types::{Duration, Instant};

/// How often [`Link::transmit`] is called: the rate of telemetry, and how late a call for a transmitter may be.
pub const PERIOD: Duration = Duration::from_millis(20);

/// What the transmitter shows as a sensor's error.
const SENSOR_ERROR: Alerts =
    Alerts::IMU_DEGRADED.with(Alerts::IMU_LOST).with(Alerts::TOF_LOST).with(Alerts::POWER_LOST);

/// The vehicle's end of the pilot's radio. `tests/pairing.rs` flies with it.
pub struct Link<'b> {
    session: Session,
    pilot: CommandPilotTx<'b>,
    peer: LinkPeerTx<'b>,
    mode: FlightStatusRx<'b>,
    telemetry: TelemetryRx<'b>,
    /// What the mode machine wanted last.
    pairing: bool,
    counter: u8,
}

/// What is to be sent now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outgoing {
    /// A call for a transmitter, to every station.
    pub call: Option<[u8; PairingPacket::LENGTH]>,
    /// Telemetry, to the vehicle's transmitter.
    pub telemetry: Option<(Address, [u8; TelemetryPacket::LENGTH])>,
}

impl<'b> Link<'b> {
    /// A link whose session is at its beginning.
    #[must_use]
    pub const fn new(
        session: Session,
        pilot: CommandPilotTx<'b>,
        peer: LinkPeerTx<'b>,
        mode: FlightStatusRx<'b>,
        telemetry: TelemetryRx<'b>,
    ) -> Self {
        Self { session, pilot, peer, mode, telemetry, pairing: false, counter: 0 }
    }

    /// Whom it listens to, and what it has refused.
    #[must_use]
    pub const fn session(&self) -> &Session {
        &self.session
    }

    /// Takes what a station has sent, `at` the instant it came in, and publishes the pilot's frame.
    ///
    /// # Errors
    /// When the packet is refused. The session has counted it; nothing is published.
    pub fn receive(&mut self, at: Instant, source: Address, bytes: &[u8]) -> Result<(), Rejected> {
        let before = self.session.peer();
        let input = self.session.receive(at, source, bytes)?;
        self.pilot.publish(at, &input);
        if let Some(peer) = self.session.peer().filter(|peer| Some(*peer) != before) {
            self.peer.publish(at, &peer.into());
        }
        Ok(())
    }

    /// Follows the mode machine, and returns what is to be sent. Call it every [`PERIOD`].
    pub fn transmit(&mut self, now: Instant) -> Outgoing {
        let mode = self.mode.latest().map(|sample| sample.data).unwrap_or_default();
        self.session.set_armed(mode.armed);
        match (self.pairing, mode.pairing) {
            // Refused with motors armed: then the session keeps its transmitter.
            (false, true) => drop(self.session.start_pairing(now)),
            (true, false) => self.session.stop_pairing(),
            _ => {}
        }
        self.pairing = mode.pairing;
        let call = self.session.beacon(now);
        let peer = self.session.peer().filter(|_| !self.session.is_pairing());
        let telemetry = peer.map(|peer| {
            self.counter = self.counter.wrapping_add(1);
            let frame = self.telemetry.latest().map(|sample| sample.data).unwrap_or_default();
            (peer, packet(self.counter, &frame).to_bytes())
        });
        Outgoing { call, telemetry }
    }
}

pub(crate) fn packet(counter: u8, frame: &TelemetryFrame) -> TelemetryPacket {
    TelemetryPacket {
        counter,
        battery: frame.battery,
        height: -frame.position.z,
        velocity: frame.velocity,
        attitude: frame.attitude,
        state: frame.phase.into(),
        low_battery: frame.alerts.intersects(Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY),
        sensor_error: frame.alerts.intersects(SENSOR_ERROR),
        link_lost: frame.alerts.intersects(Alerts::COMM_LOST),
        calibrating: frame.blocks.contains(ArmBlocks::CALIBRATING),
    }
}

impl From<Address> for LinkPeer {
    fn from(Address([a, b, c, d, e, f]): Address) -> Self {
        Self { address: u64::from_be_bytes([0, 0, a, b, c, d, e, f]) }
    }
}

impl From<LinkPeer> for Address {
    fn from(peer: LinkPeer) -> Self {
        let [_, _, a, b, c, d, e, f] = peer.address.to_be_bytes();
        Self([a, b, c, d, e, f])
    }
}
