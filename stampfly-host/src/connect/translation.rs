//! Between a cable's envelopes and payloads of the secure link: what each has that the other has not.
//!
//! An envelope has the number of the question that it asks or answers, and the fingerprint of the tables. On the secure link an acknowledgement names a command's number or a
//! frame's counter, a parameter its place, a part of an answer its line, and the fingerprint comes by itself once a second. Nothing that depends on the vehicle's tables
//! passes before it is known, and with other tables than the station's nothing but a kill does. What a cable does not lose is said again until it is answered, by [`Orders`] and
//! [`Questions`]. No socket, no clock, no key.

use super::orders::Orders;
use super::questions::{Questions, Send};
use stampfly_link::mavlink::dialects::common::MavMessage;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkWriter, Tunnel};
use stampfly_link::secure::Payload;
use stampfly_services::cable::{Assembly, Envelope, TYPE};
use stampfly_types::messages::GuidedKind;
use stampfly_types::{Duration, Instant};
use std::collections::VecDeque;

/// Who the vehicle is on the station's line: system and component.
pub(super) const VEHICLE: [u8; 2] = [1, 1];
/// A command was not taken.
const REFUSED: Payload<'static> = Payload::Acknowledgement { counter: 0, taken: false };

/// Why sticks are refused is told again after this long.
const TOLD_AGAIN: Duration = Duration::from_secs(10);

/// What of the vehicle's tables is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Tables {
    #[default]
    Unknown,
    Ours,
    /// Another program's.
    Others(u16),
}

/// What is known of both sides.
pub(super) struct Translation {
    decoder: MavlinkDecoder<MavMessage>,
    assembly: Assembly,
    writer: MavlinkWriter,
    /// Fingerprint of the station's tables.
    ours: u16,
    tables: Tables,
    /// The number of the newest command or line, not that of the question: a station's signs of life are counted there as well, and come round.
    counted: u32,
    orders: Orders,
    questions: Questions,
    /// The vehicle's clock, ms, in its newest sample, and when that came: as the station knows it.
    clock: Option<(u32, Instant)>,
    /// The number of the newest notice.
    noticed: Option<u32>,
    /// Why sticks were refused, and when that was told last.
    refused: Option<(String, Instant)>,
    /// Frames for the station.
    pub frames: VecDeque<u8>,
}

impl Translation {
    /// Commands and lines have numbers that are counted from `first`, which is random: the vehicle remembers the last one of the run before.
    pub fn new(first: u32) -> Self {
        Self {
            decoder: MavlinkDecoder::new(),
            assembly: Assembly::default(),
            writer: MavlinkWriter::new(VEHICLE[0], VEHICLE[1]),
            ours: 0,
            tables: Tables::Unknown,
            counted: first,
            orders: Orders::default(),
            questions: Questions::default(),
            clock: None,
            noticed: None,
            refused: None,
            frames: VecDeque::new(),
        }
    }

    /// Takes what the station says on its line.
    pub fn say(&mut self, now: Instant, bytes: &[u8], send: Send<'_>) {
        for byte in bytes {
            let Some(frame) = self.decoder.feed(*byte) else { continue };
            // MAVLink's own messages are for a cable.
            let tunnel = (frame.id == Tunnel::ID).then(|| Tunnel::read(frame.payload)).flatten();
            let Some(tunnel) = tunnel.filter(|tunnel| tunnel.kind == TYPE) else { continue };
            let Some((Envelope { table, number, said, .. }, payload)) = self.assembly.feed(&tunnel.bytes) else {
                continue;
            };
            self.ours = table;
            let passes = match self.tables {
                Tables::Ours => true,
                // What is watched is what makes the vehicle say which tables it has.
                Tables::Unknown => !matches!(payload, Payload::ReadParameter { .. } | Payload::WriteParameter { .. }),
                Tables::Others(_) => payload.is_kill(),
            };
            if !passes {
                continue;
            }
            self.counted = self.counted.wrapping_add(1);
            let asked = asked(now, self.clock, said);
            // What says nothing but that somebody is there comes again anyway.
            if let Some(command) = payload.command().filter(|command| command.kind != GuidedKind::None) {
                if !self.orders.say(now, asked, (self.counted, number), command) {
                    put(&mut self.writer, &mut self.frames, table, number, &REFUSED);
                }
            } else if !self.questions.ask(now, asked, (number, self.counted), &payload) {
                if payload.is_kill() {
                    self.orders.end(now);
                }
                send(&payload);
            }
        }
        self.poll(now, send);
    }

    /// Says what is due to be said, for the first time or again. Call it every 20 ms.
    pub fn poll(&mut self, now: Instant, send: Send<'_>) {
        if let Some(payload) = self.orders.next(now) {
            send(&payload);
        }
        self.questions.poll(now, send);
    }

    /// There is another session: the vehicle may have started anew, and done what a line said before that.
    pub fn renewed(&mut self) {
        self.questions.end_line();
    }

    /// Is this another reason than the one that people know, or was that long ago?
    fn is_news(&mut self, now: Instant, why: &str) -> bool {
        let is_known = self.refused.as_ref().is_some_and(|(known, at)| known == why && now.since(*at) < TOLD_AGAIN);
        if !is_known {
            self.refused = Some((why.to_owned(), now));
        }
        !is_known
    }

    /// Takes what the vehicle says.
    pub fn hear(&mut self, now: Instant, payload: &Payload<'_>) {
        if let Payload::Tables { fingerprint } = *payload {
            self.tables = if fingerprint == self.ours { Tables::Ours } else { Tables::Others(fingerprint) };
        }
        if self.tables == Tables::Unknown {
            // It is said again.
            return;
        }
        if let Payload::Sample(sample) = payload {
            let at = (sample.at.as_micros() / 1_000) as u32;
            if self.clock.is_none_or(|(before, _)| is_newer(at, before)) {
                self.clock = Some((at, now));
            }
        }
        let (numbers, payload) = match *payload {
            Payload::Acknowledgement { counter, taken } => {
                let mut numbers = self.orders.acknowledge(counter, taken);
                if !taken {
                    numbers.extend(self.questions.refused(counter));
                }
                (numbers, *payload)
            }
            // It comes several times.
            Payload::Refusal { counter, .. } if self.orders.was_refused(counter) => return,
            Payload::Refusal { counter, why } => match self.orders.refuse(counter) {
                // Sticks have no question: people are told.
                numbers if numbers.is_empty() && self.is_news(now, why) => {
                    (vec![0], Payload::Notice { number: counter, text: why })
                }
                numbers => (numbers, Payload::Reply { text: why, last: true }),
            },
            // It comes several times.
            Payload::Notice { number, .. } if self.noticed.replace(number) == Some(number) => return,
            Payload::Parameter { index, value, taken } => {
                (vec![self.questions.parameter(index, value, taken)], *payload)
            }
            Payload::Part { number, from, text, last } => {
                let numbers = self.questions.part(now, number, from, text, last).into_iter().collect();
                (numbers, Payload::Reply { text, last })
            }
            _ => (vec![0], *payload),
        };
        let table = match (self.tables, payload) {
            // The station sees the fingerprint, and nothing else.
            (Tables::Others(table), Payload::Tables { .. }) => table,
            (Tables::Ours, _) => self.ours,
            _ => return,
        };
        for number in numbers {
            put(&mut self.writer, &mut self.frames, table, number, &payload);
        }
    }
}

/// Is this time of a vehicle's clock, ms, newer than that one? Samples may pass each other. A vehicle
/// that has started anew has another clock.
pub(super) const fn is_newer(at: u32, before: u32) -> bool {
    (at.wrapping_sub(before) as i32) >= 0 || before.wrapping_sub(at) > 500
}

/// When something was asked that the station has said at this time of the vehicle's clock, ms. Not
/// before the clock was known, and not in the future.
fn asked(now: Instant, clock: Option<(u32, Instant)>, said: Option<u32>) -> Instant {
    let Some(((at, heard), said)) = clock.zip(said) else { return now };
    let passed = now.since(heard).as_micros() / 1_000;
    let age = at.wrapping_add(passed as u32).wrapping_sub(said) as i32;
    now - Duration::from_millis(age.max(0).unsigned_abs().into())
}

/// Puts an envelope into frames for the station.
fn put(writer: &mut MavlinkWriter, frames: &mut VecDeque<u8>, table: u16, number: u16, payload: &Payload<'_>) {
    Envelope::write(table, number, None, payload, &mut |part| {
        let Some(tunnel) = Tunnel::new(TYPE, [0; 2], part) else { return };
        let mut room = [0; LONGEST];
        let frame = writer.write_payload::<MavMessage>(Tunnel::ID, &tunnel.payload(), &mut room);
        frames.extend(frame.unwrap_or_default());
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_link::secure::Sample;
    use stampfly_types::messages::{GuidedCommand, PilotInput};

    const OURS: u16 = 7;
    /// Behind what [`Line::to`] says and one command more, numbers go on at zero.
    const FIRST: u32 = u32::MAX - 2;

    /// The station's end of the line, a radio that seals everything, and what is between them.
    struct Line {
        translation: Translation,
        now: Instant,
        /// What was sent, and the counter of the newest frame.
        sent: Vec<String>,
        counter: u32,
    }

    impl Line {
        fn new() -> Self {
            Self { translation: Translation::new(FIRST), now: Instant::ZERO, sent: Vec::new(), counter: 100 }
        }

        /// To a vehicle with these tables.
        fn to(table: u16) -> Self {
            let mut line = Self::new();
            line.say(1, &Payload::Watch { topic: 3, period: 40 });
            line.hear(&Payload::Tables { fingerprint: table });
            line.sent.clear();
            line
        }

        /// The station says this.
        fn say(&mut self, number: u16, payload: &Payload<'_>) {
            let (mut writer, mut bytes) = (MavlinkWriter::new(245, 190), VecDeque::new());
            put(&mut writer, &mut bytes, OURS, number, payload);
            let Self { translation, now, sent, counter } = self;
            translation.say(*now, bytes.make_contiguous(), &mut |payload| {
                sent.push(format!("{payload:?}"));
                *counter += 1;
                Some(*counter)
            });
        }

        /// Time passes, and what is said again is sent.
        fn pass(&mut self, millis: u64) {
            let Self { translation, now, sent, counter } = self;
            for _ in 0..millis / 20 {
                *now += Duration::from_millis(20);
                translation.poll(*now, &mut |payload| {
                    sent.push(format!("{payload:?}"));
                    *counter += 1;
                    Some(*counter)
                });
            }
        }

        /// The vehicle says this: fingerprint, number and payload that the station reads.
        fn hear(&mut self, payload: &Payload<'_>) -> Option<(u16, u16, String)> {
            self.translation.hear(self.now, payload);
            self.read()
        }

        fn read(&mut self) -> Option<(u16, u16, String)> {
            self.read_all().pop()
        }

        fn read_all(&mut self) -> Vec<(u16, u16, String)> {
            let (mut decoder, mut assembly) = (MavlinkDecoder::<MavMessage>::new(), Assembly::default());
            let bytes: Vec<u8> = self.translation.frames.drain(..).collect();
            let mut read = Vec::new();
            for byte in bytes {
                let tunnel = decoder.feed(byte).and_then(|frame| Tunnel::read(frame.payload));
                if let Some((envelope, payload)) = tunnel.as_ref().and_then(|tunnel| assembly.feed(&tunnel.bytes)) {
                    read.push((envelope.table, envelope.number, format!("{payload:?}")));
                }
            }
            read
        }
    }

    fn read(payload: &Payload<'_>, number: u16) -> Option<(u16, u16, String)> {
        Some((OURS, number, format!("{payload:?}")))
    }

    fn guided(kind: GuidedKind) -> Payload<'static> {
        Payload::Guided(GuidedCommand { kind, ..GuidedCommand::default() })
    }

    const fn acknowledgement(counter: u32, taken: bool) -> Payload<'static> {
        Payload::Acknowledgement { counter, taken }
    }

    #[test]
    fn every_answer_has_the_number_of_its_question() {
        let mut line = Line::to(OURS);
        line.say(2, &guided(GuidedKind::Arm));
        line.say(3, &guided(GuidedKind::TakeOff));
        line.say(4, &Payload::ReadParameter { index: 9 });
        line.say(5, &Payload::WriteParameter { index: 8, value: 1.0 });
        line.say(6, &Payload::ReadParameter { index: 9 });
        // The answer to a reading that was said again.
        let late = Payload::Parameter { index: 8, value: 0.5, taken: true };
        assert_eq!(line.hear(&late), read(&late, 0));
        line.say(7, &Payload::Line("status"));
        let value = |index| Payload::Parameter { index, value: 1.0, taken: true };
        // In another order, as on a radio. Commands are acknowledged by their numbers, one after the other.
        let (arm, take_off) = (acknowledgement(FIRST.wrapping_add(2), true), acknowledgement(0, true));
        assert_eq!(line.hear(&take_off), None, "it has not been said yet");
        assert_eq!(line.hear(&arm), read(&arm, 2));
        assert_eq!(line.hear(&arm), None);
        line.pass(20);
        assert_eq!(line.hear(&take_off), read(&take_off, 3));
        for (answer, number) in [(value(8), 5), (value(9), 4), (value(9), 6), (value(9), 0)] {
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
        line.say(5, &guided(GuidedKind::Arm));
        line.say(6, &Payload::Kill);
        assert_eq!(line.sent[1..], ["Kill"]);

        // Another vehicle, or another firmware.
        line.hear(&Payload::Tables { fingerprint: OURS });
        assert_eq!(line.hear(&sample), read(&sample, 0));
    }

    #[test]
    fn what_is_not_answered_is_said_again_for_two_seconds_and_what_is_answered_is_not() {
        let mut line = Line::to(OURS);
        line.say(2, &guided(GuidedKind::Land));
        line.say(3, &Payload::ReadParameter { index: 9 });
        line.say(4, &Payload::WriteParameter { index: 8, value: 1.0 });
        line.say(5, &Payload::WriteParameter { index: 8, value: 2.0 });
        line.say(6, &Payload::Line("status"));
        line.pass(3_000);
        let sent = |what: &str| line.sent.iter().filter(|sent| sent.contains(what)).count();
        // Every 60 and every 300 ms; the older of two values is not said again.
        let counts = ["Land", "ReadParameter", "value: 2.0", "value: 1.0", "status"].map(sent);
        assert_eq!(counts, [34, 7, 7, 1, 7]);

        line.say(7, &guided(GuidedKind::Land));
        line.hear(&acknowledgement(FIRST.wrapping_add(7), true));
        line.say(8, &Payload::ReadParameter { index: 9 });
        line.hear(&Payload::Parameter { index: 9, value: 1.0, taken: true });
        line.sent.clear();
        line.pass(3_000);
        assert!(line.sent.is_empty(), "{:?}", line.sent);
    }

    #[test]
    fn the_station_is_told_that_there_is_no_room_and_what_is_refused_while_armed() {
        let mut line = Line::to(OURS);
        line.say(2, &guided(GuidedKind::Hold));
        assert_eq!(line.hear(&acknowledgement(FIRST.wrapping_add(2), false)), None, "it is said again");
        line.pass(2_000);
        assert_eq!(line.read(), None, "nobody knows whether it was taken in the end");

        (3..=7).for_each(|number| line.say(number, &guided(GuidedKind::WayPoint)));
        assert_eq!(line.read(), Some((OURS, 7, format!("{REFUSED:?}"))));

        line.say(8, &Payload::Line("reboot"));
        let armed = acknowledgement(line.counter, false);
        assert_eq!(line.hear(&armed), read(&armed, 8));
        line.say(9, &Payload::WriteParameter { index: 8, value: 1.0 });
        let armed = acknowledgement(line.counter, false);
        assert_eq!(line.hear(&armed), read(&armed, 9));
        line.sent.clear();
        line.pass(1_000);
        assert!(!line.sent.iter().any(|sent| sent.contains("WriteParameter")));
    }

    #[test]
    fn a_refusal_answers_its_command_which_is_not_said_again_and_what_is_told_is_told_once() {
        let mut line = Line::to(OURS);
        let why = "page 1 commands";
        line.say(2, &guided(GuidedKind::TakeOff));
        let refusal = Payload::Refusal { counter: FIRST.wrapping_add(2), why };
        assert_eq!(line.hear(&refusal), read(&Payload::Reply { text: why, last: true }, 2));
        line.sent.clear();
        line.pass(2_000);
        assert!(line.sent.is_empty(), "{:?}", line.sent);

        // Of sticks, which have no number: people are told, and not again and again.
        for seconds in [0, 2, 4] {
            let sticks = Payload::Refusal { counter: 70 + seconds, why };
            let told = line.hear(&sticks);
            assert_eq!(told, read(&Payload::Notice { number: 70, text: why }, 0).filter(|_| seconds == 0));
            line.pass(2_000);
        }
        let other = Payload::Refusal { counter: 77, why: "page 2 commands" };
        assert!(line.hear(&other).is_some());

        let notice = Payload::Notice { number: 5, text: "page 1: take off" };
        assert_eq!(line.hear(&notice), read(&notice, 0));
        assert_eq!([line.hear(&notice), line.hear(&notice)], [None, None]);
        let next = Payload::Notice { number: 6, text: "page 1: land" };
        assert_eq!(line.hear(&next), read(&next, 0));
    }

    #[test]
    fn a_part_that_is_lost_is_asked_for_and_the_answer_has_no_hole() {
        let mut line = Line::to(OURS);
        line.say(8, &Payload::Line("param list"));
        let part = |from, text, last| Payload::Part { number: FIRST.wrapping_add(2), from, text, last };
        let reply = |text, last| read(&Payload::Reply { text, last }, 8);
        assert_eq!(line.hear(&part(0, "a is 1\n", false)), reply("a is 1\n", false));
        assert_eq!(line.hear(&part(0, "a is 1\n", false)), None);
        // The next is lost.
        assert_eq!(line.hear(&part(14, "c is 3\n", false)), None);
        line.pass(40);
        assert_eq!(line.hear(&part(21, "d is 4\n", true)), None);
        line.pass(20);
        assert_eq!(
            line.sent.last().map(String::as_str),
            Some("Question { number: 4294967295, from: 7, line: \"param list\" }")
        );
        assert_eq!(line.hear(&part(7, "b is 2\n", false)), reply("b is 2\n", false));
        // Of another line, which was given up.
        let other = Payload::Part { number: 4, from: 14, text: "", last: true };
        assert_eq!(line.hear(&other), None);
        assert_eq!(line.hear(&part(14, "c is 3\nd is 4\n", true)), reply("c is 3\nd is 4\n", true));
        line.sent.clear();
        line.pass(1_000);
        assert_eq!(line.sent.len(), 0);
    }

    #[test]
    fn a_verdict_that_comes_when_a_command_is_not_said_any_more_is_an_answer_once() {
        let mut line = Line::to(OURS);
        line.say(2, &guided(GuidedKind::TakeOff));
        line.pass(1_500);
        line.sent.clear();
        let why = "refused: a pilot flies";
        let refusal = Payload::Refusal { counter: FIRST.wrapping_add(2), why };
        assert_eq!(line.hear(&refusal), read(&Payload::Reply { text: why, last: true }, 2));
        assert_eq!(line.hear(&refusal), None, "it comes three times");
        line.say(3, &guided(GuidedKind::Hold));
        line.pass(1_500);
        let done = acknowledgement(FIRST.wrapping_add(3), true);
        assert_eq!(line.hear(&done), read(&done, 3));
        assert_eq!(line.hear(&done), None);
    }

    #[test]
    fn a_kill_in_the_place_of_a_kill_answers_both_and_one_that_came_to_nothing_none() {
        let mut line = Line::to(OURS);
        line.say(2, &guided(GuidedKind::Kill));
        line.pass(1_000);
        line.say(3, &Payload::Kill);
        line.pass(1_500);
        let (first, second) = (FIRST.wrapping_add(2), FIRST.wrapping_add(3));
        assert_eq!(line.hear(&acknowledgement(first, true)), None, "it has been replaced");
        line.translation.hear(line.now, &acknowledgement(second, true));
        let answered = [read(&acknowledgement(second, true), 2), read(&acknowledgement(second, true), 3)];
        assert_eq!(line.read_all(), answered.map(Option::unwrap));
        assert_eq!(line.hear(&acknowledgement(second, true)), None);

        line.say(4, &guided(GuidedKind::Kill));
        line.pass(2_000);
        line.say(5, &guided(GuidedKind::Kill));
        let third = acknowledgement(FIRST.wrapping_add(5), true);
        assert_eq!(line.hear(&third), read(&third, 5));
    }

    #[test]
    fn a_kill_by_the_switch_ends_commands_and_another_session_ends_a_line() {
        let mut line = Line::to(OURS);
        line.say(2, &guided(GuidedKind::TakeOff));
        line.say(3, &Payload::Line("reboot"));
        line.say(4, &Payload::Sticks(PilotInput { kill: true, ..PilotInput::default() }));
        line.translation.renewed();
        line.sent.clear();
        line.pass(2_000);
        assert!(line.sent.is_empty(), "{:?}", line.sent);
    }

    #[test]
    fn before_the_tables_are_known_nothing_is_an_answer() {
        let mut line = Line::new();
        line.say(1, &Payload::Line("param list"));
        let part = |from, text, last| Payload::Part { number: FIRST + 1, from, text, last };
        assert_eq!(line.hear(&part(0, "a is 1", true)), None);
        line.hear(&Payload::Tables { fingerprint: OURS });
        line.pass(300);
        assert!(line.sent.last().is_some_and(|sent| sent.contains("from: 0")), "{:?}", line.sent);
        assert_eq!(line.hear(&part(0, "a is 1", true)), read(&Payload::Reply { text: "a is 1", last: true }, 1));
    }

    #[test]
    fn what_is_never_answered_is_forgotten() {
        let mut line = Line::to(OURS);
        (0..1_000).for_each(|number| line.say(number, &Payload::ReadParameter { index: number }));
        assert_eq!(line.translation.questions.parameters(), 128);
        let newest = Payload::Parameter { index: 999, value: 0.0, taken: true };
        assert_eq!(line.hear(&newest), read(&newest, 999));
        line.pass(3_000);
        assert_eq!(line.translation.questions.parameters(), 0);
    }
}
