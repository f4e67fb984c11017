//! What a link of a small vehicle has to survive, attack by attack. Someone hears everything, and says whatever he likes.

use crate::air::{Air, Fate, PERIOD, Random, TICK, To, key, sticks};
use stampfly_link::secure::{
    Guarded, Heard, Key, KeyError, MAX_FRAME, MIN_FRAME, NotTaken, Payload, Policy, Refused, SealError, Station,
    Vehicle,
};
use stampfly_link::{Address, ControlPacket, Session};
use stampfly_types::messages::{GuidedCommand, GuidedKind, PilotInput};
use stampfly_types::{Duration, Instant};

const FRAMES: usize = 100_000;

/// Frames that an attacker makes up. Half of them look right but for the tag.
fn made_up(random: &mut Random, air: &Air, counter: u32) -> Vec<u8> {
    let mut frame = vec![0; random.below(251)];
    random.fill(&mut frame);
    if random.next().is_multiple_of(2) && frame.len() >= MIN_FRAME {
        let kinds = [0x01, 0x02, 0x10, 0x11, 0x12, 0x20, 0x21, 0x30];
        frame[..3].copy_from_slice(&[1, kinds[random.below(kinds.len())], air.key.id()]);
        frame[3..7].copy_from_slice(&air.vehicle.session().unwrap_or(7).to_le_bytes());
        frame[7..11].copy_from_slice(&counter.wrapping_add(random.next() as u32 % 1_000).to_le_bytes());
    }
    frame
}

#[test]
fn l01_random_frames_of_every_length_are_refused_and_are_no_sign_of_life() {
    for mut air in [Air::new(1), Air::joined(1)] {
        let (taken, last, mut random) = (air.taken(), air.vehicle.age(air.now), Random(11));
        let begun = air.now;
        for _ in 0..FRAMES / 2 {
            // One a tick, so that every one is looked at.
            air.now += TICK;
            let frame = made_up(&mut random, &air, 100);
            assert!(air.deliver(To::Vehicle, &frame).is_err() && air.deliver(To::Station, &frame).is_err());
        }
        assert_eq!(air.taken(), taken);
        assert_eq!(air.vehicle.age(air.now), last.map(|age| age + air.now.since(begun)));
        let tally = air.vehicle.tally();
        assert_eq!(tally.flood, 0);
        assert!(tally.length > 0 && tally.version > 0 && (tally.tag > 10_000 || air.vehicle.session().is_none()));
    }
}

#[test]
fn l02_no_frame_survives_a_flipped_bit() {
    let mut air = Air::joined(2);
    let mut random = Random(22);
    let payloads = [sticks(), Payload::Kill, Payload::Line("status"), Payload::ReadParameter { index: 3 }];
    let frames = payloads.map(|payload| air.seal(&payload));
    let taken = air.taken();
    let mut refused = 0;
    let mut refuse = |air: &mut Air, frame: &[u8]| {
        air.now += TICK;
        assert!(air.deliver(To::Vehicle, frame).is_err(), "{frame:?}");
        refused += 1;
    };
    for frame in &frames {
        for bit in 0..8 * frame.len() {
            let mut frame = frame.clone();
            frame[bit / 8] ^= 1 << (bit % 8);
            refuse(&mut air, &frame);
        }
        for length in 1..=frame.len() {
            refuse(&mut air, &frame[..length - 1]);
            refuse(&mut air, &[frame, &frame[..length]].concat());
        }
        // The head of one and the rest of another.
        for other in frames.iter().filter(|other| *other != frame) {
            for place in 1..frame.len().min(other.len()) {
                let spliced = [&frame[..place], &other[place..]].concat();
                if !frames.contains(&spliced) {
                    refuse(&mut air, &spliced);
                }
            }
        }
    }
    while refused < FRAMES {
        let whole = &frames[random.below(frames.len())];
        let mut frame = whole.clone();
        for _ in 0..1 + random.below(16) {
            let bit = random.below(8 * frame.len());
            frame[bit / 8] ^= 1 << (bit % 8);
        }
        if frame != *whole {
            air.now += TICK;
            assert!(air.deliver(To::Vehicle, &frame).is_err());
            refused += 1;
        }
    }
    assert_eq!(air.taken(), taken);
    // The frames themselves are none the worse. Minutes have gone by, so all but the kill are stale.
    let outcomes = frames.each_ref().map(|frame| air.deliver(To::Vehicle, frame));
    assert_eq!(outcomes[..2], [Err(Refused::Stale), Ok(true)]);
}

/// Every captured frame, again and again, to both ends: nothing that the ends do changes.
fn replay(air: &mut Air) {
    let captured = air.captured.clone();
    let session = (air.vehicle.session(), air.station.session());
    let (taken, accepted) = (air.taken(), air.station.tally().accepted);
    for (place, (_, frame)) in captured.iter().enumerate() {
        let times = if place % 97 == 0 { 1_000 } else { 3 };
        for _ in 0..times {
            air.now += Duration::from_micros(500);
            // To whom it was and, reflected, to whom it came from.
            assert!(air.deliver(To::Vehicle, frame).is_err(), "{frame:02x?}");
            let _ = air.deliver(To::Station, frame);
        }
    }
    assert_eq!(air.taken(), taken, "at the vehicle");
    assert_eq!(air.station.tally().accepted, accepted, "at the station");
    assert_eq!((air.vehicle.session(), air.station.session()), session);
}

#[test]
fn l03_replays_of_this_session_and_of_earlier_ones_are_refused() {
    let mut air = Air::joined(3);
    air.run(Duration::from_secs(2));
    replay(&mut air);

    // Armed: another session. Then frames of both, while the vehicle still waits, and when it does not.
    let first = air.vehicle.session();
    air.vehicle.set_armed(true);
    air.run(Duration::from_secs(2));
    assert!(air.vehicle.session() != first && air.vehicle.session() == air.station.session());
    replay(&mut air);

    // The vehicle starts again: with nobody there, with an announcement in force, and in a session.
    air.vehicle = Vehicle::new(air.key.clone());
    replay(&mut air);
    let mut room = [0; MAX_FRAME];
    let random = air.random.eight();
    let announcement = air.vehicle.transmit(air.now, random, &mut room).expect("it announces").to_vec();
    replay(&mut air);
    air.captured.push((To::Station, announcement));
    air.run(Duration::from_secs(1));
    assert!(air.vehicle.is_joined(air.now));
    replay(&mut air);

    // The station starts again.
    air.station = Station::new(air.key.clone());
    replay(&mut air);
    air.run(Duration::from_secs(2));
    assert!(air.vehicle.is_joined(air.now) && air.vehicle.session() == air.station.session());
    replay(&mut air);
}

#[test]
fn l03_a_frame_that_comes_back_to_its_sender_is_refused_for_its_direction() {
    let mut air = Air::joined(3);
    air.vehicle.set_armed(true);
    air.run(Duration::from_secs(1));
    for (to, frame) in air.captured.clone() {
        air.now += TICK;
        let back = if to == To::Vehicle { To::Station } else { To::Vehicle };
        assert_eq!(air.deliver(back, &frame), Err(Refused::Kind));
        // And with the bit of the direction turned, so that it seems to be for its sender.
        let mut turned = frame.clone();
        turned[1] ^= 0x80;
        assert!(air.deliver(back, &turned).is_err());
    }
}

/// One end's generator always says the same. The other end takes nothing old for it.
#[test]
fn l03_an_end_with_a_good_generator_takes_no_replay_when_the_other_has_none() {
    let (key, mut random, mut room) = (key(1), Random(33), [0; MAX_FRAME]);
    let mut captured: Vec<Vec<u8>> = Vec::new();
    let now = Instant::from_secs(1);
    for turn in 0..20 {
        // The same number in every life of the station; new ones of the vehicle.
        let (mut vehicle, mut station) = (Vehicle::new(key.clone()), Station::new(key.clone()));
        for frame in &captured {
            assert!(vehicle.receive(now, &mut frame.clone()).is_err(), "before anything, {turn}");
        }
        let announcement = vehicle.transmit(now, random.eight(), &mut room).expect("announces").to_vec();
        station.receive(now, &mut announcement.clone()).expect("an announcement");
        let join = station.transmit(now, [9; 8], &mut room).expect("answers").to_vec();
        for frame in &captured {
            assert!(vehicle.receive(now, &mut frame.clone()).is_err(), "announced, {turn}");
        }
        // So many bad answers use up the tick.
        let now = now + TICK;
        vehicle.receive(now, &mut join.clone()).expect("the answer");
        let welcome = vehicle.transmit(now, random.eight(), &mut room).expect("welcomes").to_vec();
        station.receive(now, &mut welcome.clone()).expect("the welcome");
        let ready = station.transmit(now, [9; 8], &mut room).expect("ready").to_vec();
        let kill = station.seal(now, &Payload::Kill, &mut room).expect("sealed").to_vec();
        for frame in &captured {
            assert!(vehicle.receive(now, &mut frame.clone()).is_err(), "welcomed, {turn}");
        }
        vehicle.receive(now, &mut ready.clone()).expect("ready");
        vehicle.receive(now, &mut kill.clone()).expect("a kill");
        captured.extend([announcement, join, welcome, ready, kill]);
    }
}

#[test]
fn l04_in_any_order_only_what_is_newer_is_taken() {
    for seed in 0..200 {
        let mut air = Air::joined(seed);
        let mut frames: Vec<_> = (0..50).map(|_| (air.seal(&sticks()), air.station.counter())).collect();
        frames.extend(frames.clone());
        for place in (1..frames.len()).rev() {
            frames.swap(place, air.random.below(place + 1));
        }
        let mut newest = 0;
        for (frame, counter) in frames {
            let outcome = air.deliver(To::Vehicle, &frame);
            let expected = if counter > newest { Ok(true) } else { Err(Refused::Old) };
            assert_eq!(outcome, expected);
            newest = newest.max(counter);
        }
    }
}

#[test]
fn l04_a_counter_ends_without_a_repetition_and_a_new_session_begins_before() {
    let mut air = Air::joined(4);
    let first = air.vehicle.session();
    air.run(Duration::from_secs(2));
    assert_eq!(air.vehicle.session(), first, "no reason for another");
    air.station.skip_counters(u32::MAX - 100);
    air.run(Duration::from_millis(600));
    assert!(air.vehicle.session() != first && air.vehicle.session() == air.station.session(), "before its end");
    // Nobody hears it: then nothing more is sealed.
    air.station.skip_counters(u32::MAX - 1);
    let mut room = [0; MAX_FRAME];
    assert!(air.station.seal(air.now, &Payload::Kill, &mut room).is_ok());
    assert_eq!(air.station.seal(air.now, &Payload::Kill, &mut room), Err(SealError::Exhausted));
    air.vehicle.skip_counters(u32::MAX);
    let reply = Payload::Reply { text: "", last: true };
    assert_eq!(air.vehicle.seal(air.now, &reply, &mut room), Err(SealError::Exhausted));
    air.run(Duration::from_secs(2));
    assert!(air.station.seal(air.now, &Payload::Kill, &mut room).is_ok(), "and a new session begins all the same");
}

#[test]
fn l05_a_station_with_another_key_of_the_same_number_is_refused() {
    let mut air = Air::joined(5);
    // Its twin: the same random numbers, the same session number, another key.
    let mut other = Air::new(5);
    other.key = Key::generate(1, core::array::from_fn(|place| place as u8)).expect("a key");
    (other.vehicle, other.station) = (Vehicle::new(other.key.clone()), Station::new(other.key.clone()));
    other.run(Duration::from_millis(400));
    assert_eq!(other.vehicle.session(), air.vehicle.session());
    let taken = air.taken();
    for (_, frame) in &other.captured {
        air.now += TICK;
        assert!(air.deliver(To::Vehicle, frame).is_err() && air.deliver(To::Station, frame).is_err());
    }
    assert_eq!(air.taken(), taken);
    assert!(air.vehicle.tally().tag > 10);

    // At a vehicle that is looking for a station, too.
    air.vehicle = Vehicle::new(air.key.clone());
    let mut room = [0; MAX_FRAME];
    let mut announcement = air.vehicle.transmit(air.now, [1; 8], &mut room).expect("announces").to_vec();
    assert_eq!(other.station.receive(air.now, &mut announcement), Err(Refused::Tag));
    assert_eq!(other.captured.iter().filter(|(_, frame)| air.deliver(To::Vehicle, frame).is_ok()).count(), 0);
}

/// A second of flood: so many frames a tick, and the pilot's 50. How many of those arrive, and how many bad ones are worked on in
/// a tick at most?
fn flood(air: &mut Air, per_tick: usize, kind: Option<u8>, seconds: u64) -> (u32, u32) {
    let (mut random, mut arrived, mut most) = (Random(66), 0, 0);
    for tick in 0..seconds * 400 {
        air.now += TICK;
        let bad = air.vehicle.tally().tag;
        let pilot = (tick % 8 == 0).then(|| random.below(per_tick));
        for place in 0..per_tick {
            let mut frame = vec![0; 37];
            random.fill(&mut frame);
            frame[..3].copy_from_slice(&[1, kind.unwrap_or(0x10 + (random.next() % 3) as u8), air.key.id()]);
            frame[3..7].copy_from_slice(&air.vehicle.session().expect("a session").to_le_bytes());
            frame[7..11].copy_from_slice(&u32::MAX.to_le_bytes());
            assert!(air.deliver(To::Vehicle, &frame).is_err());
            if pilot == Some(place) {
                let frame = air.seal(&sticks());
                arrived += u32::from(air.deliver(To::Vehicle, &frame) == Ok(true));
            }
        }
        most = most.max(air.vehicle.tally().tag - bad);
    }
    (arrived, most)
}

#[test]
fn l06_a_flood_takes_eight_frames_a_tick_at_most_and_none_of_the_pilots() {
    let mut air = Air::joined(6);
    let (arrived, most) = flood(&mut air, 5, None, 30);
    assert!(most <= 8, "{most}");
    assert_eq!(arrived, 30 * 50, "2,000 frames a second for half a minute");

    let (arrived, most) = flood(&mut air, 100, None, 1);
    assert_eq!(most, 8, "40,000 frames a second");
    // Then most of the pilot's are lost, and the failsafe knows by the age, which no frame of the flood makes younger.
    assert!(arrived < 25 && air.vehicle.tally().flood > 30_000);
    let (taken, before) = (air.taken(), air.vehicle.age(air.now).expect("heard"));
    for _ in 0..400 {
        air.now += TICK;
        let frame = made_up(&mut Random(air.now.as_micros()), &air, 1_000);
        assert!(air.deliver(To::Vehicle, &frame).is_err());
    }
    assert_eq!(air.vehicle.age(air.now), Some(before + Duration::from_secs(1)));
    assert_eq!(air.taken(), taken);
}

/// The age that the failsafe goes by counts from the last authentic frame, whenever a jammer begins; and when he ends, the link is
/// back at once. What a vehicle does meanwhile, flights with the faults `link-lost` and `link-flap` of `stampfly-board` show, and what
/// its failsafe does, the tests of `stampfly-mode`.
#[test]
fn l07_jammed_at_any_moment_the_age_counts_from_the_last_authentic_frame() {
    for begin in 0..60 {
        let mut air = Air::new(7);
        air.vehicle.set_armed(begin % 3 == 0);
        air.run(PERIOD);
        for _ in 0..begin {
            air.run(PERIOD);
        }
        air.vehicle.set_armed(begin % 2 == 0);
        let (heard, age) = (air.now, air.vehicle.age(air.now));
        air.run_with(Duration::from_secs(3), |_, _, _| Fate::Lost);
        assert_eq!(air.vehicle.age(air.now), age.map(|age| age + air.now.since(heard)), "{begin}");
        assert!(!air.vehicle.is_joined(air.now));
        air.run(Duration::from_millis(400));
        assert!(air.vehicle.age(air.now) <= Some(PERIOD), "{begin}: back");
        air.run(Duration::from_secs(1));
        assert!(air.vehicle.is_joined(air.now) && air.vehicle.session() == air.station.session());
    }
}

/// A station that answered and then is gone, as one that starts again: the next is offered a session.
#[test]
fn l07_a_station_that_is_gone_in_the_middle_of_the_handshake_does_not_keep_others_out() {
    let (mut air, mut room) = (Air::new(7), [0; MAX_FRAME]);
    let mut announcement = air.vehicle.transmit(air.now, [1; 8], &mut room).expect("it announces").to_vec();
    air.station.receive(air.now, &mut announcement).expect("authentic");
    let answer = air.station.transmit(air.now, [2; 8], &mut room).expect("it answers").to_vec();
    assert_eq!(air.deliver(To::Vehicle, &answer), Ok(false));
    air.station = Station::new(air.key.clone());
    air.run(Duration::from_millis(900));
    assert_eq!(air.vehicle.session(), None, "it waits for the one that answered");
    air.run(Duration::from_millis(400));
    assert!(air.vehicle.is_joined(air.now) && air.vehicle.session() == air.station.session());
}

/// The way up is jammed just when the station goes over to the next session: it goes on hearing the vehicle, in the one before.
#[test]
fn l07_telemetry_goes_on_while_the_vehicle_does_not_know_of_the_change() {
    let mut air = Air::joined(7);
    air.run(Duration::from_secs(1));
    let first = air.station.session();
    air.vehicle.set_armed(true);
    while air.station.session() == first {
        air.run_with(
            PERIOD,
            |_, _, frame| if frame[1] == 0x02 || frame[1] == 0x10 { Fate::Lost } else { Fate::Arrives },
        );
    }
    let heard = air.station.tally().accepted;
    air.run_with(Duration::from_millis(400), |_, to, _| if to == To::Vehicle { Fate::Lost } else { Fate::Arrives });
    assert_eq!(air.vehicle.session(), first);
    assert!(air.station.tally().accepted >= heard + 19, "{} of 20", air.station.tally().accepted - heard);
    air.run(Duration::from_millis(100));
    assert_eq!(air.vehicle.session(), air.station.session());
}

#[test]
fn l08_with_a_part_of_the_frames_lost_a_session_comes_about_and_stays() {
    for percent in [10, 30, 50, 70, 90, 95] {
        let mut sessions = Vec::new();
        let mut air = Air::new(percent as u64);
        for _ in 0..3_000 {
            air.run_with(PERIOD, |random, _, _| if random.below(100) < percent { Fate::Lost } else { Fate::Arrives });
            sessions.extend(air.vehicle.session());
        }
        sessions.dedup();
        assert!(!sessions.is_empty(), "{percent} %: never");
        // A minute. Another session is offered only after half a second of silence, and the present one goes on meanwhile.
        let most = if percent < 70 { 1 } else { 60 };
        assert!(sessions.len() <= most, "{percent} %: {}", sessions.len());
    }
}

#[test]
fn l09_nobody_joins_an_armed_vehicle_that_hears_its_station_and_no_key_is_handed_over_by_radio() {
    let mut air = Air::joined(9);
    air.vehicle.set_armed(true);
    air.run(Duration::from_secs(1));
    let taken = air.vehicle.session();
    // Someone with the same key, and an answer to the announcement before: it is void.
    let announcements: Vec<_> = air.captured.iter().filter(|(_, frame)| frame[1] == 0x81).cloned().collect();
    let mut other = Station::new(air.key.clone());
    let mut room = [0; MAX_FRAME];
    for (_, announcement) in announcements {
        other.receive(air.now, &mut announcement.clone()).expect("authentic");
        let random = air.random.eight();
        let answer = other.transmit(air.now, random, &mut room).expect("it answers").to_vec();
        assert_eq!(air.deliver(To::Vehicle, &answer), Err(Refused::Session));
    }
    assert_eq!(air.vehicle.session(), taken);
    assert_eq!(air.vehicle.transmit(air.now, [3; 8], &mut room), None, "and nothing is offered");

    // Beside it, packets that authenticate nobody: not even where they are allowed.
    let (address, stranger) = (Address([1; 6]), Address([2; 6]));
    let policy = Policy { accept_unauthenticated: true };
    let mut link = Guarded::new(air.vehicle.clone(), Session::new(address, 1, None), policy);
    link.set_armed(true);
    let mut packet = ControlPacket::centred(address).to_bytes();
    assert_eq!(link.receive(air.now, stranger, &mut packet), Err(NotTaken::Forbidden));
    assert_eq!((link.beacon(air.now), link.forbidden()), (None, 1));
    // With the authentic station gone, they are the unauthenticated session's to judge, which pairs with nobody while armed.
    let later = air.now + Duration::from_secs(1);
    assert!(matches!(link.receive(later, stranger, &mut packet), Err(NotTaken::Unauthenticated(_))));
    link.set_armed(false);
    assert!(matches!(link.receive(later, stranger, &mut packet), Ok(Heard::Unauthenticated(_))));
    link.set_policy(Policy::default());
    assert_eq!(link.receive(later, stranger, &mut packet), Err(NotTaken::Forbidden));
}

#[test]
fn l9_who_jams_the_station_does_not_get_the_vehicle_that_it_flies() {
    let mut air = Air::joined(9);
    let (address, transmitter) = (Address([1; 6]), Address([2; 6]));
    let policy = Policy { accept_unauthenticated: true };
    let session = Session::new(address, 1, Some(transmitter));
    let mut link = Guarded::new(air.vehicle.clone(), session, policy);
    link.follow(air.now, true, false);
    let mut frame = air.seal(&Payload::Sticks(PilotInput::default()));
    assert!(matches!(link.receive(air.now, transmitter, &mut frame), Ok(Heard::Authentic(_))));
    // Silence, and packets that the session without keys would take.
    let mut packet = ControlPacket::centred(address).to_bytes();
    for seconds in [1, 10, 100] {
        let later = air.now + Duration::from_secs(seconds);
        assert_eq!(link.receive(later, transmitter, &mut packet), Err(NotTaken::Forbidden));
        assert_eq!(link.open_peer(later), None);
    }
    let later = air.now + Duration::from_secs(100);
    link.follow(later, false, false);
    assert!(matches!(link.receive(later, transmitter, &mut packet), Ok(Heard::Unauthenticated(_))));
    assert_eq!(link.open_peer(later), Some(transmitter));
}

#[test]
fn a_vehicle_without_a_key_has_no_secure_session() {
    let mut air = Air::joined(9);
    let (address, stranger) = (Address([1; 6]), Address([2; 6]));
    let policy = Policy { accept_unauthenticated: true };
    let mut link = Guarded::new(None, Session::new(address, 1, Some(stranger)), policy);
    let mut frame = air.seal(&Payload::Kill);
    assert!(matches!(link.receive(air.now, stranger, &mut frame), Err(NotTaken::Unauthenticated(_))));
    assert!(link.transmit(air.now, [3; 8], &mut [0; MAX_FRAME]).is_none());
    assert!(link.seal(air.now, &Payload::Line("no"), &mut [0; MAX_FRAME]).is_none());
    let mut packet = ControlPacket::centred(address).to_bytes();
    assert!(matches!(link.receive(air.now, stranger, &mut packet), Ok(Heard::Unauthenticated(_))));
}

#[test]
fn l10_an_authentic_frame_with_a_value_that_must_not_be_used_is_refused_whole() {
    let mut air = Air::joined(10);
    let sticks_body = |value: f32| [&value.to_le_bytes()[..], &[0; 12], &[0, 0]].concat();
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.000_001, -1.5, f32::MAX, 1e-40, -0.0];
    let mut bodies: Vec<(u8, Vec<u8>)> = bad.iter().map(|value| (0x10, sticks_body(*value))).collect();
    for value in [f32::NAN, f32::INFINITY, 1e5, 1e-40, -0.0] {
        for field in 0..6 {
            let mut body = vec![4; 1];
            body.extend((0..6).flat_map(|place| if place == field { value } else { 0.0f32 }.to_le_bytes()));
            bodies.push((0x11, body));
        }
    }
    bodies.extend([
        // Modes and switches that nobody knows, lengths of no kind, commands that nobody knows, negative times.
        (0x10, [&[0; 16][..], &[9, 0]].concat()),
        (0x10, [&[0; 16][..], &[0, 4]].concat()),
        (0x10, vec![0; 17]),
        (0x10, vec![0; 19]),
        (0x11, [&[200][..], &[0; 24]].concat()),
        (0x11, [&[4][..], &[0; 20], &(-1.0f32).to_le_bytes()].concat()),
        (0x12, vec![0]),
        (0x20, vec![0; 3]),
        (0x21, [&[0; 2][..], &f32::NAN.to_le_bytes()].concat()),
        (0x30, vec![0xFF, 0xFE]),
        (0x30, b"clear \x1b[2J".to_vec()),
        (0x02, vec![0]),
    ]);
    let (count, age) = (bodies.len() as u32, air.vehicle.age(air.now).expect("heard"));
    let (begun, counter) = (air.now, air.station.counter());
    for (place, (kind, body)) in bodies.into_iter().enumerate() {
        air.now += TICK;
        let frame = air.forge(kind, counter + 1 + place as u32, air.tick(), &body);
        assert_eq!(air.deliver(To::Vehicle, &frame), Err(Refused::Content), "{kind:02x} {body:?}");
    }
    assert_eq!(air.vehicle.tally().content, count);
    assert_eq!(air.vehicle.age(air.now), Some(age + air.now.since(begun)), "no sign of life");
    // And the forger can say what a station can.
    let frame = air.forge(0x10, counter + 1 + count, air.tick(), &sticks_body(0.5));
    assert_eq!(air.deliver(To::Vehicle, &frame), Ok(true));
}

#[test]
fn l10_a_station_sends_nothing_that_would_be_refused() {
    let mut air = Air::joined(10);
    let mut room = [0; MAX_FRAME];
    for value in [f32::NAN, f32::INFINITY, 1.5] {
        let payload = Payload::Sticks(PilotInput { yaw: value, ..Default::default() });
        assert_eq!(air.station.seal(air.now, &payload, &mut room), Err(SealError::Value));
    }
    for value in [-0.0, 1e-40] {
        let frame = air.seal(&Payload::Sticks(PilotInput { yaw: value, ..Default::default() }));
        assert_eq!(air.deliver(To::Vehicle, &frame), Ok(true), "sent as zero");
    }
    assert_eq!(air.station.seal(air.now, &Payload::Line("\u{7}"), &mut room), Err(SealError::Value));
    let telling = Payload::Reply { text: "", last: true };
    assert_eq!(air.station.seal(air.now, &telling, &mut room), Err(SealError::Direction));
    assert_eq!(air.vehicle.seal(air.now, &Payload::Kill, &mut room), Err(SealError::Direction));
}

#[test]
fn l11_an_armed_vehicle_takes_no_parameters_and_no_lines() {
    let mut air = Air::joined(11);
    let question = Payload::Question { number: 1, from: 0, line: "format" };
    let commands = [Payload::WriteParameter { index: 1, value: 2.0 }, Payload::Line("format"), question];
    let asks = Payload::ReadParameter { index: 1 };
    for (armed, expected) in [(false, Ok(true)), (true, Err(Refused::Armed)), (false, Ok(true))] {
        air.vehicle.set_armed(armed);
        for command in &commands {
            let frame = air.seal(command);
            assert_eq!(air.deliver(To::Vehicle, &frame), expected, "{command:?}");
        }
        let frame = air.seal(&asks);
        assert_eq!(air.deliver(To::Vehicle, &frame), Ok(true), "what only asks is harmless");
    }
    assert_eq!(air.vehicle.tally().armed, 3);
}

#[test]
fn l12_what_was_held_up_for_longer_than_200_ms_is_not_used() {
    for held in (0..=1_000).step_by(10) {
        let mut air = Air::joined(12);
        let (frame, kill) = (air.seal(&sticks()), air.seal(&Payload::Kill));
        air.now += Duration::from_millis(held);
        let outcome = air.deliver(To::Vehicle, &frame);
        match held {
            // A millisecond of either clock's steps and of what is taken off for their drift.
            ..=190 => assert_eq!(outcome, Ok(true), "{held}"),
            210.. => assert_eq!(outcome, Err(Refused::Stale), "{held}"),
            _ => {}
        }
        assert_eq!(air.deliver(To::Vehicle, &kill), Ok(true), "a kill is used late rather than never");
    }
    let mut air = Air::joined(12);
    let counter = air.station.counter();
    let ahead = air.forge(0x10, counter + 1, air.tick() + 100, &[0; 18]);
    assert_eq!(air.deliver(To::Vehicle, &ahead), Err(Refused::Future));
}

/// A simulator that is held up loses time. What the station seals is from the future then, until it
/// has the vehicle's clock from another handshake.
#[test]
fn l12_a_vehicle_whose_clock_lost_time_is_commanded_again_soon() {
    for lost in [30, 100, 900, 5_000] {
        let mut air = Air::joined(12);
        air.run(Duration::from_secs(10));
        let session = air.vehicle.session();
        air.lost = Duration::from_millis(lost);
        let frame = air.seal(&sticks());
        assert_eq!(air.deliver(To::Vehicle, &frame), Err(Refused::Future), "{lost}");
        air.run(Duration::from_millis(300));
        let frame = air.seal(&sticks());
        assert_eq!(air.deliver(To::Vehicle, &frame), Ok(true), "{lost}");
        // One handshake, and the session that it gave stays.
        let renewed = air.vehicle.session();
        air.run(Duration::from_secs(10));
        assert!(renewed != session && air.vehicle.session() == renewed);
    }
}

/// Whatever is held up on the way to the station, and however its clock runs: the age is never less than it is, and not
/// much more as long as something comes through.
#[test]
fn l12_the_age_is_never_underestimated() {
    for (seed, parts_per_million) in [-90i64, -20, 0, 20, 90].into_iter().enumerate() {
        let (mut air, mut random, mut room) = (Air::joined(seed as u64), Random(seed as u64), [0; MAX_FRAME]);
        let begun = air.now;
        let station_time = |now: Instant| {
            let since = now.since(begun).as_micros() as i64;
            Instant::from_micros((begun.as_micros() as i64 + since + since * parts_per_million / 1_000_000) as u64)
        };
        for turn in 0..6_000u64 {
            let down = Duration::from_millis(if turn % 50 == 0 { 2 } else { 2 + random.next() % 300 });
            let up = Duration::from_millis(random.next() % 150);
            let reply = Payload::Reply { text: "", last: true };
            // Half a minute in which the station hears nothing.
            if !(1_000..1_600).contains(&turn) {
                let mut frame = air.vehicle.seal(air.now, &reply, &mut room).expect("sealed").to_vec();
                air.station.receive(station_time(air.now + down), &mut frame).expect("the newest");
            }
            let sealed = air.now + down;
            let mut frame = air.station.seal(station_time(sealed), &sticks(), &mut room).expect("sealed").to_vec();
            air.now = sealed + up;
            let received = air.vehicle.receive(air.now, &mut frame).expect("fresh enough").expect("sticks");
            let slack = Duration::from_millis(1);
            assert!(received.age + slack >= up, "{turn}: {:?} of {up:?}", received.age);
            assert!(received.age <= up + Duration::from_millis(30), "{turn}: {:?} of {up:?}", received.age);
        }
    }
}

/// Bytes of keys as anything would print them, without white space.
fn printed(secret: &[u8]) -> Vec<String> {
    let forms = |bytes: &[u8]| {
        let hexadecimal: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let lists = [format!("{bytes:?}"), format!("{bytes:02x?}"), format!("{bytes:x?}"), format!("{bytes:02X?}")];
        let lists = lists.map(|list| bare(list.trim_matches(['[', ']'])));
        [lists.to_vec(), vec![hexadecimal.to_uppercase(), hexadecimal]].concat()
    };
    secret.windows(3).flat_map(forms).collect()
}

fn bare(text: &str) -> String {
    text.split_whitespace().collect()
}

#[test]
fn l13_no_key_is_printed_but_where_it_is_asked_for() {
    let air = Air::joined(13);
    let uri = air.key.uri().to_string();
    let mut texts = vec![format!("{:?} {:?} {:?} {:#?}", air.key, air.vehicle, air.station, air.vehicle)];
    let session = Session::new(Address([1; 6]), 1, None);
    texts.push(format!("{:?}", Guarded::new(air.vehicle.clone(), session, Policy::default())));
    // A key with every kind of mistake in it.
    for place in 0..uri.len() {
        for wrong in [uri[..place].to_owned(), uri.replacen(&uri[place..=place], "x", 1), format!("{uri}{place}")] {
            let error = Key::from_uri(&wrong).err();
            texts.extend(error.map(|error| format!("{error} {error:?}")));
        }
    }
    let texts: Vec<String> = texts.iter().map(|text| bare(text)).collect();
    let secrets = [printed(air.key.bytes()), printed(&air.session_key())].concat();
    for secret in &secrets {
        assert!(!texts.iter().any(|text| text.contains(secret)), "{secret}");
    }
    assert!(printed(air.key.bytes()).iter().any(|secret| uri.contains(secret)), "the search finds what is there");
}

#[test]
fn l13_the_tag_is_compared_by_the_authenticators_own_constant_time_comparison() {
    // `universal_hash::UniversalHash::verify`, which is `ct_eq` of the crate `ctutils`. A stopwatch on a shared machine would say less.
    let source = include_str!("../../src/secure/cipher.rs");
    assert!(source.contains("absorb(mac, head, text).verify(&tag.into()).is_ok()"));
    assert!(!source.contains("tag ==") && !source.contains("== tag"));
}

#[test]
fn l13_random_numbers_that_are_none_are_not_used() {
    assert_eq!(Key::generate(1, [0; 32]).err(), Some(KeyError::NotRandom));
    assert_eq!(Key::generate(1, [0xFF; 32]).err(), Some(KeyError::NotRandom));
    // Every session has numbers of its own, and one that was used is not used again.
    assert_eq!(Vehicle::new(key(1)).transmit(Instant::ZERO, [0; 8], &mut [0; MAX_FRAME]), None);
    let mut air = Air::joined(13);
    let mut room = [0; MAX_FRAME];
    let used = air.numbers.0;
    air.vehicle.set_armed(true);
    assert_eq!(air.vehicle.transmit(air.now, used, &mut room), None);
    let mut same = used;
    same[7] ^= 1;
    assert_eq!(air.vehicle.transmit(air.now, same, &mut room), None, "a session of the same number");
    assert!(air.vehicle.transmit(air.now, [5; 8], &mut room).is_some());
}

#[test]
fn l14_one_authentic_kill_is_enough_at_any_time() {
    let kills = [
        Payload::Kill,
        Payload::Sticks(PilotInput { kill: true, ..Default::default() }),
        Payload::Guided(GuidedCommand { kind: GuidedKind::Kill, ..Default::default() }),
    ];
    for kill in kills {
        for turn in 0..100 {
            let mut air = Air::joined(14);
            air.vehicle.set_armed(true);
            // At every moment of the change to the session of the armed vehicle.
            (0..turn).for_each(|_| air.run(PERIOD));
            let frame = air.seal(&kill);
            air.now += Duration::from_millis(10 * turn);
            let mut frame = frame.clone();
            let received = air.vehicle.receive(air.now, &mut frame).expect("taken").expect("a kill");
            assert!(received.payload.is_kill());
        }
    }
}

#[test]
fn l14_a_kill_is_not_delayed_by_a_flood() {
    // A flood of other kinds, far beyond what a radio carries: in the same tick.
    let mut air = Air::joined(14);
    for second in 0..20 {
        flood(&mut air, [5, 20, 200][second % 3], Some(0x10), 1);
        let frame = air.seal(&Payload::Kill);
        assert_eq!(air.deliver(To::Vehicle, &frame), Ok(true));
    }
    // A flood of false kills: within what is worked on, in the same tick.
    flood(&mut air, 7, Some(0x12), 1);
    let frame = air.seal(&Payload::Kill);
    assert_eq!(air.deliver(To::Vehicle, &frame), Ok(true));

    // Beyond it, a station that repeats its kill every 10 ms is heard soon: 8 of 20 frames a tick are looked at.
    let mut worst = Duration::ZERO;
    for seed in 0..200 {
        let (mut air, mut random) = (Air::joined(seed), Random(seed));
        let begun = air.now;
        'until_heard: for tick in 0.. {
            air.now += TICK;
            let ours = (tick % 4 == 0).then(|| random.below(20));
            for place in 0..20 {
                let mut frame = air.seal(&Payload::Kill);
                if ours == Some(place) && air.deliver(To::Vehicle, &frame) == Ok(true) {
                    break 'until_heard;
                }
                frame[20] ^= 1;
                assert!(air.deliver(To::Vehicle, &frame).is_err());
            }
        }
        worst = worst.max(air.now.since(begun));
    }
    assert!(worst <= Duration::from_millis(250), "{worst:?}");
}
