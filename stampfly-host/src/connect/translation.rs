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
    /// Numbers of commands by the counters of their frames, of questions by the places of their parameters, of the line and of the newest kill.
    commands: VecDeque<(u32, u16)>,
    parameters: VecDeque<(u16, u16)>,
    line: u16,
    kill: u16,
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
            kill: 0,
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
            if payload.is_kill() {
                self.kill = number;
            }
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

    /// The newest kill was said again, in the frame with this counter: to acknowledge either is an answer.
    pub fn kill_again(&mut self, counter: u32) {
        remember(&mut self.commands, (counter, self.kill));
    }

    /// Takes what the vehicle says.
    pub fn hear(&mut self, payload: &Payload<'_>) {
        if let Payload::Tables { fingerprint } = *payload {
            self.tables = if fingerprint == self.ours { Tables::Ours } else { Tables::Others(fingerprint) };
        }
        let (table, number) = match (self.tables, payload) {
            // The station sees the fingerprint, and nothing else.
            (Tables::Others(table), Payload::Tables { .. }) => (table, 0),
            (Tables::Ours, Payload::Acknowledgement { counter, taken }) => {
                let number = take(&mut self.commands, counter);
                // Of a kill that is said again and again, the vehicle has no room for the last ones because it has the first.
                if !taken && number == self.kill {
                    return;
                }
                (self.ours, number)
            }
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

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_link::secure::Sample;
    use stampfly_types::Instant;
    use stampfly_types::messages::{GuidedCommand, GuidedKind};

    const OURS: u16 = 7;

    /// The station's end of the line, a radio that seals everything, and what is between them.
    struct Line {
        translation: Translation,
        /// What was sent, and the counter of the next frame.
        sent: Vec<String>,
        counter: u32,
    }

    impl Line {
        fn new() -> Self {
            Self { translation: Translation::new(), sent: Vec::new(), counter: 100 }
        }

        /// The station says this.
        fn say(&mut self, number: u16, payload: &Payload<'_>) {
            let (mut writer, mut bytes) = (MavlinkWriter::new(245, 190), Vec::new());
            Envelope::write(OURS, number, payload, &mut |part| {
                let mut room = [0; LONGEST];
                let tunnel = Tunnel::new(TYPE, [0; 2], part).expect("it fits");
                let frame = writer.write_payload::<MavMessage>(Tunnel::ID, &tunnel.payload(), &mut room);
                bytes.extend_from_slice(frame.expect("it fits"));
            });
            let Self { translation, sent, counter } = self;
            translation.say(&bytes, &mut |payload| {
                sent.push(format!("{payload:?}"));
                *counter += 1;
                Some(*counter)
            });
        }

        /// The vehicle says this: fingerprint, number and payload that the station reads.
        fn hear(&mut self, payload: &Payload<'_>) -> Option<(u16, u16, String)> {
            self.translation.hear(payload);
            let (mut decoder, mut assembly) = (MavlinkDecoder::<MavMessage>::new(), Assembly::default());
            let bytes: Vec<u8> = self.translation.frames.drain(..).collect();
            let mut read = None;
            for byte in bytes {
                let tunnel = decoder.feed(byte).and_then(|frame| Tunnel::read(frame.payload));
                if let Some((envelope, payload)) = tunnel.as_ref().and_then(|tunnel| assembly.feed(&tunnel.bytes)) {
                    read = Some((envelope.table, envelope.number, format!("{payload:?}")));
                }
            }
            read
        }
    }

    fn read(payload: &Payload<'_>, number: u16) -> Option<(u16, u16, String)> {
        Some((OURS, number, format!("{payload:?}")))
    }

    #[test]
    fn every_answer_has_the_number_of_its_question() {
        let mut line = Line::new();
        line.say(1, &Payload::Watch { topic: 3, period: 40 });
        line.hear(&Payload::Tables { fingerprint: OURS });
        let arm = GuidedCommand { kind: GuidedKind::Arm, ..GuidedCommand::default() };
        line.say(2, &Payload::Guided(arm));
        line.say(3, &Payload::Kill);
        line.say(4, &Payload::ReadParameter { index: 9 });
        line.say(5, &Payload::WriteParameter { index: 8, value: 1.0 });
        line.say(6, &Payload::ReadParameter { index: 9 });
        line.say(7, &Payload::Line("status"));
        let taken = |counter| Payload::Acknowledgement { counter, taken: true };
        let value = |index| Payload::Parameter { index, value: 1.0, taken: true };
        let reply = |last| Payload::Reply { text: "well", last };
        // In another order, as on a radio: frames 101 to 107, a watch first.
        for (answer, number) in [
            (taken(103), 3),
            (taken(102), 2),
            (taken(102), 0),
            (value(8), 5),
            (value(9), 4),
            (value(9), 6),
            (value(9), 0),
            (reply(false), 7),
            (reply(true), 7),
        ] {
            assert_eq!(line.hear(&answer), read(&answer, number));
        }
    }

    #[test]
    fn nothing_that_depends_on_tables_passes_before_they_are_known_and_with_others_only_a_kill() {
        let words = [[0; 4]; 52];
        let sample = Payload::Sample(Sample::new(3, Instant::ZERO, &words));
        let mut line = Line::new();
        line.say(1, &Payload::WriteParameter { index: 8, value: 1.0 });
        assert_eq!((line.sent.len(), line.hear(&sample)), (0, None));

        line.say(2, &Payload::Watch { topic: 3, period: 40 });
        let told = Payload::Tables { fingerprint: OURS + 1 };
        assert_eq!(line.hear(&told), Some((OURS + 1, 0, format!("{told:?}"))));
        assert_eq!(line.hear(&sample), None);
        line.say(3, &Payload::WriteParameter { index: 8, value: 1.0 });
        line.say(4, &Payload::Line("param reset"));
        line.say(5, &Payload::Kill);
        assert_eq!(line.sent[1..], ["Kill"]);

        // Another vehicle, or another firmware.
        line.hear(&Payload::Tables { fingerprint: OURS });
        assert_eq!(line.hear(&sample), read(&sample, 0));
    }

    #[test]
    fn a_kill_that_is_said_again_is_answered_by_either_frame() {
        let mut line = Line::new();
        line.say(1, &Payload::Watch { topic: 3, period: 40 });
        line.hear(&Payload::Tables { fingerprint: OURS });
        line.say(2, &Payload::Kill);
        line.translation.kill_again(149);
        line.translation.kill_again(150);
        let full = Payload::Acknowledgement { counter: 149, taken: false };
        assert_eq!(line.hear(&full), None);
        let taken = Payload::Acknowledgement { counter: 150, taken: true };
        assert_eq!(line.hear(&taken), read(&taken, 2));
    }

    #[test]
    fn what_is_never_answered_is_forgotten() {
        let mut line = Line::new();
        line.say(1, &Payload::Watch { topic: 3, period: 40 });
        line.hear(&Payload::Tables { fingerprint: OURS });
        (0..1_000).for_each(|number| line.say(number, &Payload::ReadParameter { index: number }));
        assert_eq!(line.translation.parameters.len(), ASKED);
        let newest = Payload::Parameter { index: 999, value: 0.0, taken: true };
        assert_eq!(line.hear(&newest), read(&newest, 999));
    }
}
