//! The vehicle's end of the radio: frames in, sticks and commands on the bus; telemetry and calls out.
//!
//! Everything but moving the bytes: firmware, which has the radio, gives [`Link`] what it has received and sends what [`Link::transmit`] returns. Stations with the vehicle's key speak in sealed frames,
//! others, where the configuration lets them, in the ecosystem's packets. The link follows `flight_status`, and publishes the transmitter it is paired with.

use crate::messages::TelemetryFrame;
use crate::topics::{Id, LinkEnds};
use stampfly_link::secure::{Guarded, Heard, MAX_FRAME, NotTaken, Payload, Received, Sample, put};
use stampfly_link::{Address, TelemetryPacket};
use stampfly_types::messages::{Alerts, ArmBlocks, GuidedCommand, PilotInput};
use stampfly_types::{Duration, Instant, Message};

/// How often everything in [`Outgoing::ALL`] is asked for: how late a call or an answer may be.
pub const PERIOD: Duration = Duration::from_millis(20);

/// What the transmitter shows as a sensor's error.
const SENSOR_ERROR: Alerts =
    Alerts::IMU_DEGRADED.with(Alerts::IMU_LOST).with(Alerts::TOF_LOST).with(Alerts::POWER_LOST);

/// The vehicle's end of the radio. `tests/board` has `pairing.rs`, `secured.rs` and `air.rs`.
pub struct Link<'b> {
    /// Whom it listens to, and what it has refused.
    pub guarded: Guarded,
    pub(crate) ends: LinkEnds<'b>,
    counter: u8,
}

/// What there may be to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outgoing {
    /// A call for an unauthenticated transmitter, to everybody.
    Call,
    /// A part of the secure session's handshake, to everybody.
    Handshake,
    /// What became of a command, or that it is not done while armed, to the station that sent it.
    Acknowledgement,
    /// Telemetry, to who flies: sealed, by turns for a display and for a program.
    Telemetry,
}

impl Outgoing {
    /// All of it, in the order to be asked for.
    pub const ALL: [Self; 4] = [Self::Call, Self::Handshake, Self::Acknowledgement, Self::Telemetry];
}

impl<'b> Link<'b> {
    /// A link whose sessions are at their beginning.
    #[must_use]
    pub const fn new(guarded: Guarded, ends: LinkEnds<'b>) -> Self {
        Self { guarded, ends, counter: 0 }
    }

    /// Takes what a station has sent, `at` the instant it came in, and publishes sticks and commands. What else a station with the key has sent is returned,
    /// for a `RadioDesk` of `stampfly-services`, whose answers `guarded` seals.
    ///
    /// # Errors
    /// When it is refused. The session has counted it; nothing is published.
    pub fn receive<'f>(
        &mut self,
        at: Instant,
        source: Address,
        bytes: &'f mut [u8],
    ) -> Result<Option<Received<'f>>, NotTaken> {
        let before = self.guarded.session().peer();
        match self.guarded.receive(at, source, bytes)? {
            Heard::Authentic(received) => Ok(self.obey(at, received)),
            Heard::Unauthenticated(input) => {
                self.ends.command_pilot.publish(at, &input);
                if let Some(peer) = self.guarded.session().peer().filter(|peer| Some(*peer) != before) {
                    self.ends.link_peer.publish(at, &peer.into());
                }
                Ok(None)
            }
            Heard::Handshake => Ok(None),
        }
    }

    /// Publishes what a station with the key has sent, whichever way it came, and returns what is no command.
    pub fn obey<'f>(&mut self, at: Instant, received: Received<'f>) -> Option<Received<'f>> {
        if let Payload::Sticks(input) = received.payload {
            self.sticks(at, &input);
            return None;
        }
        let Some(command) = received.payload.command() else { return Some(received) };
        let taken = self.command(at, command);
        self.guarded.acknowledge(&received, taken);
        None
    }

    /// Publishes a command, of a station with the key or of a service. Was there room for it?
    pub fn command(&mut self, at: Instant, command: GuidedCommand) -> bool {
        self.ends.command_guided.publish(at, command).is_ok()
    }

    /// Publishes sticks, of a station with the key or of a service.
    pub fn sticks(&mut self, at: Instant, input: &PilotInput) {
        self.ends.command_pilot.publish(at, input);
    }

    /// Follows the mode machine, and returns what is to be sent now, and where. `random` are eight new bytes of a generator.
    pub fn transmit<'r>(
        &mut self,
        now: Instant,
        what: Outgoing,
        random: [u8; 8],
        room: &'r mut [u8; MAX_FRAME],
    ) -> Option<(Address, &'r [u8])> {
        match what {
            Outgoing::Call => {
                let mode = self.ends.flight_status.latest().map(|sample| sample.data).unwrap_or_default();
                self.guarded.follow(now, mode.armed, mode.pairing);
                Some((Address::BROADCAST, put(room, &self.guarded.beacon(now)?)?))
            }
            Outgoing::Handshake => Some((Address::BROADCAST, self.guarded.transmit(now, random, room)?)),
            Outgoing::Acknowledgement => self.guarded.seal_acknowledgement(now, room),
            Outgoing::Telemetry => {
                self.counter = self.counter.wrapping_add(1);
                let (at, frame) = self.ends.telemetry.latest().map(|new| (new.at, new.data)).unwrap_or_default();
                let packet = packet(self.counter, &frame);
                if let Some(peer) = self.guarded.open_peer(now) {
                    return Some((peer, put(room, &packet.to_bytes())?));
                }
                if self.counter.is_multiple_of(2) {
                    return self.guarded.seal(now, &Payload::Telemetry(packet), room);
                }
                let words = frame.to_words().map(u32::to_le_bytes);
                self.guarded.seal(now, &Payload::Sample(Sample::new(Id::telemetry as u16, at, &words)), room)
            }
        }
    }
}

fn packet(counter: u8, frame: &TelemetryFrame) -> TelemetryPacket {
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
