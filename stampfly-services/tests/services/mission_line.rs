//! The mission protocol over lines that are slow, lose frames, say them twice and in another order.
#![allow(deprecated, reason = "older programs send what the protocol has superseded")]

use crate::common::Vehicle;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_services::mavlink::{Identity, Mavlink};
use stampfly_types::Instant;

const IDENTITY: Identity =
    Identity { system: 7, kind: MavType::MAV_TYPE_QUADROTOR, take_off_height: 0.5, reach: 0.25, version: [1, 2, 3] };
/// The one connection, behind which a router has all stations.
const LINE: u8 = 1;
const ITEMS: u16 = 50;
/// Round trips, ms.
const ROUND_TRIPS: [u64; 3] = [0, 300, 1_200];
/// A conversation that takes longer has failed, ms.
const LONGEST_TALK: u64 = 600_000;

/// Numbers that look like chance: xorshift.
struct Chance(u64);

impl Chance {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % end
    }
}

/// What a line does to frames: how long a round trip takes, and how many of a hundred are lost,
/// come twice, come late.
#[derive(Clone, Copy)]
struct Quality {
    round_trip: u64,
    lost: u64,
    twice: u64,
    late: u64,
}

impl Quality {
    const fn clean(round_trip: u64) -> Self {
        Self { round_trip, lost: 0, twice: 0, late: 0 }
    }

    const fn bad(round_trip: u64) -> Self {
        Self { round_trip, lost: 10, twice: 10, late: 20 }
    }
}

/// A vehicle, its service, and the line to its stations.
struct Line {
    mavlink: Mavlink<u8>,
    vehicle: Vehicle,
    quality: Quality,
    chance: Chance,
    /// ms.
    now: u64,
    /// When they arrive, and their bytes.
    up: Vec<(u64, Vec<u8>)>,
    down: Vec<(u64, MavMessage)>,
    /// Every message of the mission protocol that the vehicle has sent.
    said: Vec<MavMessage>,
}

impl Line {
    fn new(quality: Quality, seed: u64) -> Self {
        let mut line = Self {
            mavlink: Mavlink::new(IDENTITY),
            vehicle: Vehicle::standing(),
            quality,
            chance: Chance(0x9E37_79B9_7F4A_7C15 ^ (seed + 1).wrapping_mul(0x2545_F491_4F6C_DD1D)),
            now: 0,
            up: Vec::new(),
            down: Vec::new(),
            said: Vec::new(),
        };
        let origin = SET_GPS_GLOBAL_ORIGIN_DATA {
            latitude: 473_977_418,
            longitude: 85_455_939,
            target_system: 7,
            ..Default::default()
        };
        let frame = frame(255, 190, &MavMessage::SET_GPS_GLOBAL_ORIGIN(origin));
        line.mavlink.hear(Instant::ZERO, LINE, &frame, &mut line.vehicle, &mut |_, _| {});
        line
    }

    /// When the copies of a frame arrive.
    fn arrivals(&mut self) -> Vec<u64> {
        let Quality { round_trip, lost, twice, late } = self.quality;
        let copies = if self.chance.below(100) < lost { 0 } else { 1 + u64::from(self.chance.below(100) < twice) };
        let mut at = |_| {
            let delay = if self.chance.below(100) < late { self.chance.below(round_trip / 2 + 40) } else { 0 };
            self.now + round_trip / 2 + delay
        };
        (0..copies).map(&mut at).collect()
    }

    fn says(&mut self, system: u8, component: u8, message: &MavMessage) {
        let bytes = frame(system, component, message);
        for at in self.arrivals() {
            self.up.push((at, bytes.clone()));
        }
    }

    /// A millisecond passes. Returns what has arrived at the stations.
    fn passes(&mut self) -> Vec<MavMessage> {
        self.now += 1;
        let now = Instant::from_millis(self.now);
        let mut sent = Vec::new();
        for (_, bytes) in arrived(&mut self.up, self.now) {
            self.mavlink.hear(now, LINE, &bytes, &mut self.vehicle, &mut |_, frame| sent.extend(frame));
        }
        if self.now.is_multiple_of(20) {
            self.mavlink.poll(now, &mut self.vehicle, &mut |_, frame| sent.extend(frame));
        }
        for message in read(&sent) {
            use MavMessage as M;
            if matches!(
                message,
                M::MISSION_ACK(_) | M::MISSION_REQUEST_INT(_) | M::MISSION_ITEM_INT(_) | M::MISSION_COUNT(_)
            ) {
                self.said.push(message.clone());
                for at in self.arrivals() {
                    self.down.push((at, message.clone()));
                }
            }
        }
        arrived(&mut self.down, self.now).into_iter().map(|(_, message)| message).collect()
    }

    /// A station uploads these, as honest stations do: it answers each question once, and says its
    /// last word again when nothing comes.
    fn uploads(&mut self, items: &[MISSION_ITEM_INT_DATA], mut beside: impl FnMut(&mut Self)) -> MavMissionResult {
        let count = MISSION_COUNT_DATA {
            count: items.len() as u16,
            target_system: 7,
            target_component: 1,
            ..Default::default()
        };
        let (mut last, mut spoke) = (MavMessage::MISSION_COUNT(count), self.now);
        self.says(255, 190, &last);
        let end = self.now + LONGEST_TALK;
        while self.now < end {
            for message in self.passes() {
                match message {
                    MavMessage::MISSION_ACK(ack) if (ack.target_system, ack.target_component) == (255, 190) => {
                        return ack.mavtype;
                    }
                    MavMessage::MISSION_REQUEST_INT(request) => {
                        assert_eq!((request.target_system, request.target_component), (255, 190));
                        last = MavMessage::MISSION_ITEM_INT(items[usize::from(request.seq)].clone());
                        self.says(255, 190, &last);
                        spoke = self.now;
                    }
                    _ => {}
                }
            }
            if self.now - spoke > 1_500 + 2 * self.quality.round_trip {
                self.says(255, 190, &last);
                spoke = self.now;
            }
            beside(self);
        }
        panic!("no end after {} s", LONGEST_TALK / 1_000);
    }

    /// What a station downloads, which asks again when nothing comes.
    fn downloads(&mut self) -> Vec<MISSION_ITEM_INT_DATA> {
        let list = MISSION_REQUEST_LIST_DATA { target_system: 7, target_component: 1, ..Default::default() };
        let (mut last, mut spoke) = (MavMessage::MISSION_REQUEST_LIST(list), self.now);
        self.says(200, 191, &last);
        let (mut items, mut count) = (Vec::new(), None);
        let end = self.now + LONGEST_TALK;
        while self.now < end {
            let mut next = false;
            for message in self.passes() {
                match message {
                    MavMessage::MISSION_COUNT(said) if count.is_none() => {
                        assert_eq!((said.target_system, said.target_component), (200, 191));
                        (count, next) = (Some(said.count), true);
                    }
                    MavMessage::MISSION_ITEM_INT(item) if usize::from(item.seq) == items.len() => {
                        assert_eq!((item.target_system, item.target_component), (200, 191));
                        items.push(item);
                        next = true;
                    }
                    _ => {}
                }
            }
            if count == Some(items.len() as u16) {
                return items;
            }
            if next {
                let seq = items.len() as u16;
                let request =
                    MISSION_REQUEST_INT_DATA { seq, target_system: 7, target_component: 1, ..Default::default() };
                last = MavMessage::MISSION_REQUEST_INT(request);
            }
            if next || self.now - spoke > 250 + 2 * self.quality.round_trip {
                self.says(200, 191, &last);
                spoke = self.now;
            }
        }
        panic!("no end after {} s", LONGEST_TALK / 1_000);
    }

    /// How often the vehicle has asked for each item.
    fn questions(&self) -> Vec<usize> {
        let mut questions = vec![0; usize::from(ITEMS)];
        for message in &self.said {
            if let MavMessage::MISSION_REQUEST_INT(request) = message {
                questions[usize::from(request.seq)] += 1;
            }
        }
        questions
    }

    /// Results that a station was told, with the number of the mission.
    fn results(&self, system: u8) -> Vec<(MavMissionResult, u32)> {
        let of = |message: &MavMessage| match message {
            MavMessage::MISSION_ACK(ack) if ack.target_system == system => Some((ack.mavtype, ack.opaque_id)),
            _ => None,
        };
        self.said.iter().filter_map(of).collect()
    }
}

fn arrived<T>(on_its_way: &mut Vec<(u64, T)>, now: u64) -> Vec<(u64, T)> {
    let mut there: Vec<_> = on_its_way.extract_if(.., |(at, _)| *at <= now).collect();
    there.sort_by_key(|(at, _)| *at);
    there
}

fn frame(system: u8, component: u8, message: &MavMessage) -> Vec<u8> {
    let mut bytes = [0; LONGEST];
    let frame = MavlinkWriter::new(system, component).write(MavlinkVersion::V2, message, &mut bytes);
    frame.expect("a frame").to_vec()
}

fn read(bytes: &[u8]) -> Vec<MavMessage> {
    let mut decoder = MavlinkDecoder::<MavMessage>::new();
    bytes.iter().filter_map(|byte| decoder.feed(*byte).map(|frame| frame.message().expect("a message"))).collect()
}

/// Local and global places, with bits that a conversion would not keep.
fn items() -> Vec<MISSION_ITEM_INT_DATA> {
    let item = |seq: u16| {
        let place = i32::from(seq);
        let global = seq.is_multiple_of(2);
        MISSION_ITEM_INT_DATA {
            seq,
            command: MavCmd::MAV_CMD_NAV_WAYPOINT,
            frame: match global {
                true => MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
                false => MavFrame::MAV_FRAME_LOCAL_NED,
            },
            param1: f32::from_bits(1 + u32::from(seq)),
            param2: 0.1 + 0.01 * f32::from(seq),
            param3: -0.0,
            param4: f32::from_bits(0x7FC0_0000 | u32::from(seq)),
            x: if global { 473_977_419 + 7 * place } else { -12_345 + 3 * place },
            y: if global { 85_455_938 - 5 * place } else { 54_321 - place },
            z: if global { 1.0 / f32::from(seq + 3) } else { -1.0 / f32::from(seq + 3) },
            target_system: 7,
            target_component: 1,
            autocontinue: 1,
            ..Default::default()
        }
    };
    (0..ITEMS).map(item).collect()
}

/// All of an item that must not change on its way up and down.
fn bits(item: &MISSION_ITEM_INT_DATA) -> ([u32; 5], [i32; 2], u16, MavCmd, MavFrame, u8) {
    let MISSION_ITEM_INT_DATA { param1, param2, param3, param4, x, y, z, seq, command, frame, autocontinue, .. } =
        *item;
    ([param1, param2, param3, param4, z].map(f32::to_bits), [x, y], seq, command, frame, autocontinue)
}

fn same(one: &[MISSION_ITEM_INT_DATA], other: &[MISSION_ITEM_INT_DATA]) {
    assert!(one.iter().map(bits).eq(other.iter().map(bits)), "{one:?}\n{other:?}");
}

const ACCEPTED: MavMissionResult = MavMissionResult::MAV_MISSION_ACCEPTED;
const DENIED: MavMissionResult = MavMissionResult::MAV_MISSION_DENIED;

#[test]
fn however_long_a_round_trip_takes_no_item_is_asked_for_more_than_twice_and_a_second_partner_is_denied() {
    for round_trip in ROUND_TRIPS {
        let mut line = Line::new(Quality::clean(round_trip), 0);
        let items = items();
        // Behind the same router, a station and another program of the first station's system.
        let others = [(200, 190), (255, 191)];
        let mut has_spoken = false;
        let accepted = line.uploads(&items, |line| {
            let begun = line.questions()[ITEMS as usize / 2] > 0;
            if begun && !core::mem::replace(&mut has_spoken, true) {
                for (system, component) in others {
                    let (target_system, target_component) = (7, 1);
                    let count = MISSION_COUNT_DATA { count: 2, target_system, target_component, ..Default::default() };
                    line.says(system, component, &MavMessage::MISSION_COUNT(count));
                    for item in &items {
                        line.says(
                            system,
                            component,
                            &MavMessage::MISSION_ITEM_INT(MISSION_ITEM_INT_DATA { z: -9.0, ..item.clone() }),
                        );
                    }
                    let clear = MISSION_CLEAR_ALL_DATA { target_system, target_component, ..Default::default() };
                    line.says(system, component, &MavMessage::MISSION_CLEAR_ALL(clear));
                }
            }
        });
        assert_eq!(accepted, ACCEPTED);
        let questions = line.questions();
        assert!(has_spoken && questions.iter().all(|count| (1..=2).contains(count)), "{round_trip} ms: {questions:?}");
        let most = usize::from(ITEMS) + 2;
        assert!(questions.iter().sum::<usize>() <= most, "{round_trip} ms: {questions:?}");
        let told: Vec<_> = line.results(200).into_iter().map(|(result, _)| result).collect();
        assert_eq!(told, [DENIED, DENIED], "the count and the clearing; items are passed over");
        let told: Vec<_> = line.results(255).into_iter().map(|(result, _)| result).collect();
        assert_eq!(told, [DENIED, DENIED, ACCEPTED], "{round_trip} ms");
        same(&line.downloads(), &items);
    }
}

/// What came of uploads and downloads on one kind of line.
#[derive(Default)]
struct Figures {
    /// Most questions for one item, and for all fifty.
    an_item: usize,
    all: usize,
    /// How often the station was told that it is accepted, at least and at most.
    accepted: Vec<usize>,
    denied: usize,
    /// ms, at most.
    up: u64,
    down: u64,
}

/// The whole conversation: fifty items up and down, beside a second partner on the same connection
/// that asks for its own upload three times.
fn talk(quality: Quality, seed: u64, figures: &mut Figures) {
    let mut line = Line::new(quality, seed);
    let items = items();
    let mut said = 0;
    let result = line.uploads(&items, |line| {
        if said < 3 && line.questions()[20 + 5 * said] > 0 {
            said += 1;
            let (target_system, target_component) = (7, 1);
            let count = MISSION_COUNT_DATA { count: 2, target_system, target_component, ..Default::default() };
            line.says(200, 190, &MavMessage::MISSION_COUNT(count));
        }
    });
    assert_eq!((result, said), (ACCEPTED, 3));
    figures.up = figures.up.max(line.now);
    // Frames that are still on their way arrive.
    for _ in 0..20_000 {
        line.passes();
    }
    let questions = line.questions();
    let told = line.results(255);
    assert!(told.iter().all(|told| *told == (ACCEPTED, 1)), "one mission, and nothing after it: {told:?}");
    let denied = line.results(200);
    assert!(!denied.is_empty() && denied.iter().all(|(result, _)| *result == DENIED), "{denied:?}");
    let begun = line.now;
    same(&line.downloads(), &items);
    figures.an_item = figures.an_item.max(questions.iter().copied().max().unwrap_or_default());
    figures.all = figures.all.max(questions.iter().sum());
    figures.accepted.push(told.len());
    figures.denied += denied.len();
    figures.down = figures.down.max(line.now - begun);
}

/// Questions for an item at most on a line that loses nothing, and the figures of every line.
#[test]
fn fifty_items_go_up_and_down_at_every_round_trip_on_clean_and_on_bad_lines() {
    println!("| round trip | line | questions an item | for 50 | ACCEPTED | second partner | up | down |");
    for round_trip in ROUND_TRIPS {
        let lines = [
            ("nothing lost", Quality::clean(round_trip), 1),
            ("all twice", Quality { twice: 100, ..Quality::clean(round_trip) }, 1),
            ("20 % late", Quality { late: 20, ..Quality::clean(round_trip) }, 20),
            ("10 % lost, 10 % twice, 20 % late", Quality::bad(round_trip), 20),
        ];
        for (name, quality, seeds) in lines {
            let mut figures = Figures::default();
            (0..seeds).for_each(|seed| talk(quality, seed, &mut figures));
            let Figures { an_item, all, accepted, denied, up, down } = figures;
            let [least, most] = [accepted.iter().min(), accepted.iter().max()].map(|told| told.copied().unwrap_or(0));
            println!(
                "| {round_trip} ms | {name} | {an_item} | {all} | {least} to {most} times | denied {denied} of {} | {:.1} s | {:.1} s |",
                3 * seeds,
                up as f32 * 1e-3,
                down as f32 * 1e-3
            );
            if quality.lost == 0 {
                assert!(an_item <= 2 && all <= usize::from(2 * ITEMS), "{an_item} an item, {all} for all");
            }
            if name == "nothing lost" {
                assert_eq!((least, most, denied), (1, 1, 3));
            }
            assert!(least > 0);
        }
    }
}

#[test]
fn a_bad_line_costs_time_and_nothing_else() {
    for round_trip in ROUND_TRIPS {
        for seed in 0..20 {
            let mut line = Line::new(Quality::bad(round_trip), seed);
            let items = items();
            assert_eq!(line.uploads(&items, |_| {}), ACCEPTED, "{round_trip} ms, seed {seed}");
            // Frames that are still on their way arrive.
            for _ in 0..20_000 {
                line.passes();
            }
            let results = line.results(255);
            assert!(!results.is_empty() && results.iter().all(|told| *told == (ACCEPTED, 1)), "{seed}: {results:?}");
            same(&line.downloads(), &items);
        }
    }
}

#[test]
fn a_station_that_says_every_item_twice_is_asked_for_each_once() {
    let mut line = Line::new(Quality { twice: 100, ..Quality::clean(0) }, 0);
    let items = items();
    assert_eq!(line.uploads(&items, |_| {}), ACCEPTED);
    for _ in 0..1_000 {
        line.passes();
    }
    assert!(line.questions()[1..].iter().all(|count| *count == 1), "{:?}", line.questions());
    let results = line.results(255);
    assert!(results.iter().all(|told| *told == (ACCEPTED, 1)), "{results:?}");
}

#[test]
fn the_last_word_said_again_is_answered_again_and_the_same_mission_keeps_its_number() {
    let mut line = Line::new(Quality::clean(300), 0);
    let items = items();
    assert_eq!(line.uploads(&items, |_| {}), ACCEPTED);
    // The acknowledgement was lost, and one of the items comes late.
    line.says(255, 190, &MavMessage::MISSION_ITEM_INT(items[3].clone()));
    line.says(255, 190, &MavMessage::MISSION_ITEM_INT(items[49].clone()));
    // Another one was never asked for anything.
    line.says(200, 190, &MavMessage::MISSION_ITEM_INT(items[49].clone()));
    for _ in 0..1_000 {
        line.passes();
    }
    assert_eq!(line.results(255), [(ACCEPTED, 1), (ACCEPTED, 1)]);
    assert_eq!(line.results(200), [(MavMissionResult::MAV_MISSION_ERROR, 0)]);
    // The count of the upload that is over, come twice, begins nothing. One that is said when the
    // station has heard of it does.
    let count = MISSION_COUNT_DATA { count: ITEMS, target_system: 7, target_component: 1, ..Default::default() };
    let count = MavMessage::MISSION_COUNT(count);
    let accepted = line.uploads(&items, |line| {
        if line.results(255).len() == 3 {
            line.up.push((line.now, frame(255, 190, &count)));
        }
    });
    assert_eq!(accepted, ACCEPTED);
    assert_eq!(line.results(255), [(ACCEPTED, 1); 4]);
    assert_eq!(line.questions(), [2; ITEMS as usize], "once for each of the uploads");
    for _ in 0..1_000 {
        line.passes();
    }
    let mut other = items.clone();
    other[7].z = -2.0;
    assert_eq!(line.uploads(&other, |_| {}), ACCEPTED);
    assert_eq!(line.results(255)[4..], [(ACCEPTED, 2)]);
    same(&line.downloads(), &other);
}

#[test]
fn a_count_during_its_own_upload_begins_again() {
    let mut line = Line::new(Quality::clean(0), 0);
    let items = items();
    let mut is_said = false;
    let few = &items[..3];
    let accepted = line.uploads(&items, |line| {
        if line.questions()[20] > 0 && !core::mem::replace(&mut is_said, true) {
            let count = MISSION_COUNT_DATA { count: 3, target_system: 7, target_component: 1, ..Default::default() };
            line.says(255, 190, &MavMessage::MISSION_COUNT(count));
        }
    });
    assert_eq!(accepted, ACCEPTED);
    same(&line.downloads(), few);
}

#[test]
fn requests_are_served_in_any_order_and_as_often_as_they_come() {
    let mut line = Line::new(Quality::clean(0), 0);
    let items = items();
    line.uploads(&items, |_| {});
    let wanted = [7, 3, 3, 49, 0, 7];
    for seq in wanted {
        let request = MISSION_REQUEST_INT_DATA { seq, target_system: 7, target_component: 1, ..Default::default() };
        line.says(9, 9, &MavMessage::MISSION_REQUEST_INT(request));
    }
    let served: Vec<_> = (0..100).flat_map(|_| line.passes()).collect();
    let served: Vec<_> = served
        .into_iter()
        .filter_map(|message| match message {
            MavMessage::MISSION_ITEM_INT(item) => Some(item),
            _ => None,
        })
        .collect();
    let expected: Vec<_> = wanted.iter().map(|seq| items[usize::from(*seq)].clone()).collect();
    same(&served, &expected);
}

#[test]
fn parts_of_a_mission_are_refused_and_so_is_an_item_that_is_not_there() {
    let mut line = Line::new(Quality::clean(0), 0);
    let (target_system, target_component) = (7, 1);
    let write = MISSION_WRITE_PARTIAL_LIST_DATA { target_system, target_component, ..Default::default() };
    let read = MISSION_REQUEST_PARTIAL_LIST_DATA { target_system, target_component, ..Default::default() };
    line.says(255, 190, &MavMessage::MISSION_WRITE_PARTIAL_LIST(write));
    line.says(255, 190, &MavMessage::MISSION_REQUEST_PARTIAL_LIST(read));
    line.passes();
    assert_eq!(line.results(255), [(MavMissionResult::MAV_MISSION_UNSUPPORTED, 0); 2]);
}
