//! What is stored stays stored, whatever happens to the power and to the bytes.

use crate::flash::{Flash, FlashError};
use embassy_futures::block_on;
use proptest::prelude::*;
use stampfly_param::{Disarmed, LoadError, OpenError, ParameterStore, SaveError};
use stampfly_types::messages::FlightStatus;

const RANGE: core::ops::Range<u32> = 0..1280;
const NAMES: [&str; 5] = ["rate.roll.kp", "rate.roll.ti", "hover.thrust", "eskf.gate", "motor.duty.max"];

fn disarmed() -> Disarmed {
    Disarmed::proven_by(&FlightStatus::default()).expect("disarmed")
}

fn store(flash: Flash) -> ParameterStore<Flash> {
    block_on(ParameterStore::open(flash, RANGE)).expect("five pages")
}

fn save(store: &mut ParameterStore<Flash>, name: &str, value: f32) -> Result<(), SaveError<FlashError>> {
    block_on(store.save_within(disarmed(), name, value, -1e6..=1e6))
}

fn load(store: &mut ParameterStore<Flash>, name: &str) -> Result<Option<f32>, LoadError<FlashError>> {
    block_on(store.load_within(name, -1e6..=1e6))
}

#[test]
fn values_outlive_a_restart_and_many_changes() {
    let mut at_work = store(Flash::new());
    for round in 0..200 {
        for (index, name) in NAMES.iter().enumerate() {
            assert_eq!(save(&mut at_work, name, (round * 10 + index) as f32), Ok(()));
        }
    }
    let mut restarted = store(at_work.into_flash());
    for (index, name) in NAMES.iter().enumerate() {
        assert_eq!(load(&mut restarted, name), Ok(Some((1990 + index) as f32)));
    }
    assert_eq!(load(&mut restarted, "never.saved"), Ok(None));
    assert_eq!(block_on(restarted.erase(disarmed())), Ok(()));
    assert_eq!(load(&mut restarted, NAMES[0]), Ok(None));
}

#[test]
fn what_is_there_already_is_not_written_again() {
    let mut store = store(Flash::new());
    assert_eq!(save(&mut store, "hover.thrust", 0.0), Ok(()));
    let written = |store: ParameterStore<Flash>| {
        let flash = store.into_flash();
        (flash.words_written, self::store(flash))
    };
    let (first, mut store) = written(store);
    assert_eq!(save(&mut store, "hover.thrust", 0.0), Ok(()));
    let (second, mut store) = written(store);
    assert_eq!(first, second);
    assert_eq!(save(&mut store, "hover.thrust", -0.0), Ok(()));
    assert!(written(store).0 > second, "other bits");
}

#[test]
fn nothing_out_of_range_goes_in_or_comes_out() {
    let mut store = store(Flash::new());
    for value in [f32::NAN, f32::INFINITY, 0.61, 0.09] {
        let saved = block_on(store.save_within(disarmed(), "hover.thrust", value, 0.1..=0.6));
        assert_eq!(saved, Err(SaveError::OutOfRange), "{value}");
    }
    assert_eq!(block_on(store.save_within(disarmed(), "hover.thrust", 0.6_f32, 0.1..=0.6)), Ok(()));
    // The next version of the firmware knows better.
    let loaded = block_on(store.load_within("hover.thrust", 0.1_f32..=0.5));
    assert_eq!(loaded, Err(LoadError::OutOfRange { stored: 0.6_f32.into() }));
    assert_eq!(
        block_on(store.save_within(disarmed(), "hover.thrust", 0.4_f32, 0.1..=0.5)),
        Ok(()),
        "and can be told so"
    );
}

#[test]
fn more_names_than_room_is_an_error_and_harms_none() {
    let mut store = store(Flash::new());
    let mut names = (0..).map(|index| format!("name.{index}"));
    let full = names.find_map(|name| save(&mut store, &name, 1.0).err());
    assert_eq!(full, Some(SaveError::Full));
    assert_eq!(load(&mut store, "name.0"), Ok(Some(1.0)));
    assert_eq!(load(&mut store, "name.20"), Ok(Some(1.0)));
}

#[test]
#[expect(clippy::reversed_empty_ranges, reason = "a caller's mistake")]
fn a_flash_of_two_pages_or_half_pages_is_refused() {
    for range in [0..0, 0..256, 0..512, 0..1000, 100..1280, 1024..0, u32::MAX - 255..u32::MAX] {
        let opened = block_on(ParameterStore::open(Flash::new(), range.clone()));
        assert_eq!(opened.err(), Some(OpenError::NoRoom), "{range:?}");
    }
    assert!(block_on(ParameterStore::open(Flash::new(), 0..768)).is_ok());
}

#[test]
fn a_flash_that_keeps_nothing_is_found_out() {
    let mut deaf = Flash::new();
    deaf.deaf = true;
    assert_eq!(block_on(ParameterStore::open(deaf, RANGE)).err(), Some(OpenError::NotKept));

    let mut at_work = store(Flash::new());
    assert_eq!(save(&mut at_work, "hover.thrust", 1.0), Ok(()));
    let mut deaf = at_work.into_flash();
    deaf.deaf = true;
    let mut store = store(deaf);
    assert_eq!(save(&mut store, "hover.thrust", 2.0), Err(SaveError::NotKept));
    assert_eq!(block_on(store.save(disarmed(), "peer", [2; 6])), Err(SaveError::NotKept));
    assert_eq!(load(&mut store, "hover.thrust"), Ok(Some(1.0)));
}

/// Bytes are kept whole: after every cut they are those before or those after, and other values are
/// as they were.
#[test]
fn no_power_cut_mixes_bytes() {
    let mut at_work = store(Flash::new());
    let [old, new] = [[2, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA], [6, 0x55, 0x55, 0x55, 0x55, 0x55]];
    assert_eq!(block_on(at_work.load::<[u8; 6]>("peer")), Ok(None));
    assert_eq!(save(&mut at_work, "hover.thrust", 0.25), Ok(()));
    // So full that keeping them erases a page.
    let mut full = at_work.into_flash();
    let erases = (0..).find_map(|index| {
        let mut store = store(full.clone());
        assert_eq!(save(&mut store, "filler", index as f32), Ok(()));
        assert_eq!(block_on(store.save(disarmed(), "peer", old)), Ok(()));
        let next = store.into_flash();
        let before = next.words_written;
        let mut store = self::store(next.clone());
        assert_eq!(block_on(store.save(disarmed(), "peer", new)), Ok(()));
        let words = store.into_flash().words_written - before;
        full = next;
        (words > 64).then_some(words)
    });
    let words = erases.expect("some time a page is full");
    for cut in 0..words {
        for torn in [false, true] {
            let mut store = store(full.clone().cut_after(cut, torn));
            assert!(block_on(store.save(disarmed(), "peer", new)).is_err(), "cut at {cut}");
            let mut store = self::store(store.into_flash().switch_on());
            let found = block_on(store.load::<[u8; 6]>("peer"));
            assert!([Ok(Some(old)), Ok(Some(new))].contains(&found), "cut at {cut}, torn {torn}: {found:?}");
            assert_eq!(load(&mut store, "hover.thrust"), Ok(Some(0.25)), "cut at {cut}, torn {torn}");
            assert_eq!(block_on(store.save(disarmed(), "peer", new)), Ok(()), "cut at {cut}, torn {torn}");
            assert_eq!(block_on(store.load("peer")), Ok(Some(new)));
        }
    }
}

/// Enough changes to go round all pages, so that every kind of write and every erasure is among
/// what is cut.
const CHANGES: usize = 120;

fn change(index: usize) -> (&'static str, f32) {
    (NAMES[index * index % NAMES.len()], index as f32 + 0.5)
}

/// Cuts the power at every word of a long life, cleanly and in the middle of the word. After each
/// cut every name has its last value, or for the one being saved the new one, and life goes on.
#[test]
fn no_power_cut_loses_a_value() {
    let opened = store(Flash::new()).into_flash();
    let mut at_work = store(opened.clone());
    for index in 0..CHANGES {
        let (name, value) = change(index);
        assert_eq!(save(&mut at_work, name, value), Ok(()));
    }
    let words = at_work.into_flash().words_written - opened.words_written;
    assert!(words > 800, "pages have been erased again and again: {words} words");

    for cut in 0..words {
        for torn in [false, true] {
            let mut known: [Option<f32>; NAMES.len()] = [None; NAMES.len()];
            let mut store = store(opened.clone().cut_after(cut, torn));
            let mut under_way = None;
            for index in 0..CHANGES {
                let (name, value) = change(index);
                let slot = NAMES.iter().position(|known| *known == name).expect("one of them");
                if save(&mut store, name, value).is_err() {
                    under_way = Some((slot, value));
                    break;
                }
                known[slot] = Some(value);
            }
            let (slot, value) = under_way.expect("the cut lies within this life");
            let mut store = self::store(store.into_flash().switch_on());
            for (index, name) in NAMES.iter().enumerate() {
                let found = load(&mut store, name);
                let new = index == slot && found == Ok(Some(value));
                assert!(new || found == Ok(known[index]), "cut at {cut}, torn {torn}: {name} is {found:?}");
            }
            assert_eq!(save(&mut store, "after.the.cut", 1.0), Ok(()), "cut at {cut}, torn {torn}");
            assert_eq!(load(&mut store, "after.the.cut"), Ok(Some(1.0)));
        }
    }
}

/// A cut while everything is erased leaves each name with its value or with none.
#[test]
fn no_power_cut_makes_erasing_invent_a_value() {
    let mut at_work = store(Flash::new());
    for index in 0..CHANGES {
        let (name, value) = change(index);
        assert_eq!(save(&mut at_work, name, value), Ok(()));
    }
    let full = at_work.into_flash();
    for cut in (0..RANGE.end as usize / 4).step_by(7) {
        let mut store = store(full.clone().cut_after(cut, true));
        assert!(block_on(store.erase(disarmed())).is_err());
        let mut store = self::store(store.into_flash().switch_on());
        for name in NAMES {
            if let Ok(Some(value)) = load(&mut store, name) {
                assert!((0..CHANGES).any(|index| change(index) == (name, value)), "cut at {cut}: {name} is {value}");
            }
        }
        assert_eq!(block_on(store.erase(disarmed())), Ok(()));
        assert_eq!(save(&mut store, NAMES[0], 1.0), Ok(()), "cut at {cut}");
    }
}

proptest! {
    /// Bits that have fallen over: a value may be gone, but what is loaded was once saved, and
    /// erasing always helps.
    #[test]
    fn damaged_flash_invents_nothing(flips in prop::collection::vec((0usize..1280, 0u8..8), 1..40)) {
        let mut at_work = store(Flash::new());
        for index in 0..60 {
            let (name, value) = change(index);
            prop_assert_eq!(save(&mut at_work, name, value), Ok(()));
        }
        let mut flash = at_work.into_flash();
        for (byte, bit) in flips {
            flash.bytes[byte] ^= 1 << bit;
        }
        let mut damaged = store(flash);
        for name in NAMES {
            if let Ok(Some(value)) = load(&mut damaged, name) {
                prop_assert!((0..60).any(|index| change(index) == (name, value)), "{} is {}", name, value);
            }
        }
        prop_assert_eq!(block_on(damaged.erase(disarmed())), Ok(()));
        prop_assert_eq!(save(&mut damaged, NAMES[0], 2.0), Ok(()));
        prop_assert_eq!(load(&mut damaged, NAMES[0]), Ok(Some(2.0)));
    }
}
