//! Transmitters that share a channel: nobody sends in another's slot, and nobody can be silenced.

use proptest::prelude::*;
use stampfly_link::{SlotBeacon, SlotTurn, Slots};
use stampfly_types::{Duration, Instant};

fn at(micros: u64) -> Instant {
    Instant::from_micros(micros)
}

/// Time as a transmitter has it whose clock runs fast by so many parts in a million, started at some other instant.
fn local(now: u64, drift: i64, offset: u64) -> Instant {
    at((now as i64 + now as i64 * drift / 1_000_000) as u64 + offset)
}

#[test]
fn ten_transmitters_with_clocks_of_their_own_never_send_at_once() {
    let clocks: Vec<(i64, u64)> = (0..10).map(|number| (number * 60 - 300, number as u64 * 7_777)).collect();
    let mut all: Vec<Slots> = (0..10)
        .map(|number: u8| {
            let (drift, offset) = clocks[usize::from(number)];
            Slots::new(number, local(0, drift, offset)).expect("one of ten")
        })
        .collect();
    let mut sent: Vec<(u64, usize)> = Vec::new();
    for now in (0..2_000_000).step_by(50) {
        for number in 0..10 {
            let (drift, offset) = clocks[number];
            while let Some(turn) = all[number].poll(local(now, drift, offset)) {
                match turn {
                    SlotTurn::Beacon => {
                        assert_eq!(number, 0);
                        // Every tenth beacon is heard by nobody, and 300 µs pass on the way.
                        let heard = now + 300;
                        for other in 1..10 {
                            let (drift, offset) = clocks[other];
                            if now / 20_000 % 10 != 3 {
                                all[other].heard(local(heard, drift, offset), SlotBeacon);
                            }
                        }
                    }
                    SlotTurn::Packet => sent.push((now, number)),
                    other => panic!("{other:?}"),
                }
            }
        }
    }
    // After the first beacons.
    let sent: Vec<_> = sent.into_iter().filter(|(now, _)| *now > 100_000).collect();
    for pair in sent.windows(2) {
        let (gap, from, to) = (pair[1].0 - pair[0].0, pair[0].1, pair[1].1);
        assert_eq!((from + 1) % 10, to, "in turn");
        // The ten share their frame with the way of the beacon.
        assert!((1_600..=2_400).contains(&gap), "{gap} µs from {from} to {to}");
    }
    for number in 0..10 {
        let count = sent.iter().filter(|(_, sender)| *sender == number).count();
        assert!((94..=96).contains(&count), "{number}: {count}");
    }
}

#[test]
fn the_master_sends_the_beacon_before_its_packet() {
    let mut master = Slots::new(0, at(5_000)).expect("one of ten");
    assert!(master.is_master() && !master.is_lost(at(10_000_000)));
    let mut turns = Vec::new();
    for now in (5_000..45_000).step_by(100) {
        turns.extend(master.poll(at(now)).map(|turn| (now, turn)));
    }
    let (beacon, packet) = (SlotTurn::Beacon, SlotTurn::Packet);
    assert_eq!(turns, [(5_000, beacon), (5_500, packet), (25_000, beacon), (25_500, packet)]);
    // A stranger's beacon changes nothing.
    let before = master.clone();
    master.heard(at(45_000), SlotBeacon);
    assert_eq!(master, before);
    assert_eq!(master.due(), at(45_000));
}

#[test]
fn a_slot_that_was_missed_is_not_made_up_for() {
    let mut slots = Slots::new(4, at(0)).expect("one of ten");
    assert_eq!(slots.due(), at(8_500));
    assert_eq!(slots.poll(at(8_499)), None);
    assert_eq!(slots.poll(at(10_500)), None, "the slot is over");
    assert_eq!(slots.poll(at(28_500 + 1_999)), Some(SlotTurn::Packet));
    assert_eq!(slots.poll(at(28_500 + 1_999)), None);
    // After a long pause the slot is where it was.
    assert_eq!(slots.poll(at(1_000_000)), None);
    assert_eq!(slots.due(), at(1_008_500));
}

/// Also those that come just when a packet is due.
#[test]
fn beacons_without_end_silence_nobody() {
    for number in 1..10 {
        let mut slots = Slots::new(number, at(0)).expect("one of ten");
        let mut sent = vec![0];
        for now in (0..1_000_000).step_by(500) {
            slots.heard(at(now), SlotBeacon);
            if slots.poll(at(now)) == Some(SlotTurn::Packet) {
                sent.push(now);
            }
        }
        let gap = sent.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert!(gap.is_some_and(|gap| gap <= 40_000), "{number}: {gap:?} µs");
    }
}

#[test]
fn without_a_beacon_it_goes_on_and_says_so() {
    assert_eq!(Slots::new(10, at(0)), None);
    let mut slots = Slots::new(9, at(0)).expect("one of ten");
    assert!(slots.is_lost(at(0)), "never heard");
    slots.heard(at(100_000), SlotBeacon);
    assert!(!slots.is_lost(at(299_999)) && slots.is_lost(at(300_000)));
    let sent = (100_000..2_100_000).step_by(500).filter(|now| slots.poll(at(*now)).is_some()).count();
    assert_eq!(sent, 100);
}

proptest! {
    /// Whoever sends beacons, however often.
    #[test]
    fn nobody_is_silenced_by_beacons(number in 1u8..10, gaps in prop::collection::vec(0u64..25_000, 1..400)) {
        let mut slots = Slots::new(number, at(0)).expect("one of ten");
        let (mut now, mut sent) = (0, vec![0]);
        for gap in gaps {
            let next = now + gap;
            // Polled as soon as something is due.
            while slots.due() < at(next) {
                let due = slots.due();
                if slots.poll(due) == Some(SlotTurn::Packet) {
                    sent.push(due.as_micros());
                }
            }
            now = next;
            slots.heard(at(now), SlotBeacon);
        }
        for pair in sent.windows(2) {
            let gap = Duration::from_micros(pair[1] - pair[0]);
            prop_assert!(gap <= Duration::from_millis(40), "{gap}");
        }
        for pair in sent.windows(2).skip(1) {
            prop_assert!(pair[1] - pair[0] >= 10_000, "{pair:?}");
        }
        prop_assert!(now.saturating_sub(*sent.last().expect("some")) <= 40_000);
    }
}
