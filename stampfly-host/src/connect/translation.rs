//! Between a cable's envelopes and payloads of the secure link: what each has that the other has not.
//!
//! An envelope has the number of the question that it asks or answers, and the fingerprint of the tables. On the secure link an acknowledgement names a frame's counter,
//! a parameter its place, a reply the one line that was typed, and the fingerprint comes by itself once a second. Nothing that depends on the vehicle's tables passes before it
//! is known, and with other tables than the station's nothing but a kill does. No socket, no clock, no key.

use stampfly_link::mavlink::dialects::common::MavMessage;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkWriter, Tunnel};
use stampfly_link::secure::Payload;
use stampfly_services::cable::{Assembly, Envelope, TYPE};
use std::collections::VecDeque;

/// Questions whose answers are still to come. The station gives up after a while, and asks fewer in that time.
const ASKED: usize = 128;
/// Who the vehicle is on the station's line: system and component.
const VEHICLE: [u8; 2] = [1, 1];

/// What of the vehicle's tables is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Tables {
    #[default]
    Unknown,
    Ours,
    /// Another program's.
    Others(u16),
}

/// Seals a payload and sends it. Returns the counter of its frame; `None` when it could not be sealed.
pub(super) type Send<'s> = &'s mut dyn FnMut(&Payload<'_>) -> Option<u32>;

/// What is known of both sides.
pub(super) struct Translation {
    decoder: MavlinkDecoder<MavMessage>,
    assembly: Assembly,
    writer: MavlinkWriter,
    /// Fingerprint of the station's tables.
    ours: u16,
    tables: Tables,
    /// Numbers of commands by the counters of their frames, of questions by the places of their parameters, and of the line.
    commands: VecDeque<(u32, u16)>,
    parameters: VecDeque<(u16, u16)>,
    line: u16,
    /// Frames for the station.
    pub frames: VecDeque<u8>,
}

impl Translation {
    pub fn new() -> Self {
        Self {
            decoder: MavlinkDecoder::new(),
            assembly: Assembly::default(),
            writer: MavlinkWriter::new(VEHICLE[0], VEHICLE[1]),
            ours: 0,
            tables: Tables::Unknown,
            commands: VecDeque::new(),
            parameters: VecDeque::new(),
            line: 0,
            frames: VecDeque::new(),
        }
    }

    /// Takes what the station says on its line.
    pub fn say(&mut self, bytes: &[u8], send: Send<'_>) {
        for byte in bytes {
            let Some(frame) = self.decoder.feed(*byte) else { continue };
            // MAVLink's own messages are for a cable.
            let tunnel = (frame.id == Tunnel::ID).then(|| Tunnel::read(frame.payload)).flatten();
            let Some(tunnel) = tunnel.filter(|tunnel| tunnel.kind == TYPE) else { continue };
            let Some((Envelope { table, number, .. }, payload)) = self.assembly.feed(&tunnel.bytes) else { continue };
            self.ours = table;
            let passes = match self.tables {
                Tables::Ours => true,
                // What is watched is what makes the vehicle say which tables it has.
                Tables::Unknown => !matches!(payload, Payload::ReadParameter { .. } | Payload::WriteParameter { .. }),
                Tables::Others(_) => payload.is_kill(),
            };
            let Some(counter) = passes.then(|| send(&payload)).flatten() else { continue };
            match payload {
                Payload::Guided(_) | Payload::Kill => remember(&mut self.commands, (counter, number)),
                Payload::ReadParameter { index } | Payload::WriteParameter { index, .. } => {
                    remember(&mut self.parameters, (index, number));
                }
                Payload::Line(_) => self.line = number,
                _ => {}
            }
        }
    }

    /// Takes what the vehicle says.
    pub fn hear(&mut self, payload: &Payload<'_>) {
        if let Payload::Tables { fingerprint } = *payload {
            self.tables = if fingerprint == self.ours { Tables::Ours } else { Tables::Others(fingerprint) };
        }
        let (table, number) = match (self.tables, payload) {
            // The station sees the fingerprint, and nothing else.
            (Tables::Others(table), Payload::Tables { .. }) => (table, 0),
            (Tables::Ours, Payload::Acknowledgement { counter, .. }) => (self.ours, take(&mut self.commands, counter)),
            (Tables::Ours, Payload::Parameter { index, .. }) => (self.ours, take(&mut self.parameters, index)),
            (Tables::Ours, Payload::Reply { .. }) => (self.ours, self.line),
            (Tables::Ours, _) => (self.ours, 0),
            _ => return,
        };
        let Self { writer, frames, .. } = self;
        Envelope::write(table, number, payload, &mut |part| {
            let Some(tunnel) = Tunnel::new(TYPE, [0; 2], part) else { return };
            let mut room = [0; LONGEST];
            let frame = writer.write_payload::<MavMessage>(Tunnel::ID, &tunnel.payload(), &mut room);
            frames.extend(frame.unwrap_or_default());
        });
    }
}

fn remember<T>(asked: &mut VecDeque<(T, u16)>, question: (T, u16)) {
    if asked.len() >= ASKED {
        asked.pop_front();
    }
    asked.push_back(question);
}

/// The number of the oldest question for this. Zero, which no question has, when nobody has asked.
fn take<T: PartialEq>(asked: &mut VecDeque<(T, u16)>, of: &T) -> u16 {
    let place = asked.iter().position(|(other, _)| other == of);
    place.and_then(|place| asked.remove(place)).map_or(0, |(_, number)| number)
}
