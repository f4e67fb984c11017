//! Flash that somebody else has used becomes a store, whatever is in it and whenever the power
//! fails.

use crate::flash::{self, Flash};
use embassy_futures::block_on;
use proptest::prelude::*;
use stampfly_param::{AnyValue, Disarmed, Kind, LONGEST_NAME, LoadError, ParameterStore, SaveError, key};
use stampfly_types::messages::FlightStatus;

const RANGE: core::ops::Range<u32> = 0..2304;
const PAGE: usize = 256;
/// As many as a StampFly has.
const VALUES: usize = 35;

fn open(flash: Flash) -> Result<ParameterStore<Flash>, stampfly_param::OpenError<flash::FlashError>> {
    block_on(ParameterStore::open(flash, RANGE))
}

fn disarmed() -> Disarmed {
    Disarmed::proven_by(&FlightStatus::default()).expect("standing on a table")
}

fn name(index: usize) -> String {
    format!("value.{index}")
}

/// Is nothing there, and does everything that is saved stay?
fn works(flash: Flash) {
    let mut store = open(flash).expect("nine pages");
    for index in 0..VALUES {
        assert_eq!(block_on(store.load_within(&name(index), -1e3..=1e3)), Ok(None));
    }
    for index in 0..VALUES {
        assert_eq!(block_on(store.save_within(disarmed(), &name(index), index as f32, -1e3..=1e3)), Ok(()));
    }
    let mut store = open(store.into_flash()).expect("nine pages");
    for index in 0..VALUES {
        assert_eq!(block_on(store.load_within(&name(index), -1e3..=1e3)), Ok(Some(index as f32)), "after a restart");
    }
}

/// A page as ESP-IDF's NVS library leaves it: state, sequence number, version, checksum, a bitmap
/// of two bits an entry, entries of 32 bytes. Layout: ESP-IDF Programming Guide, NVS Library,
/// "Structure of a page".
fn nvs_page(state: u32, number: u32, entries: usize, page: &mut [u8]) {
    page[..4].copy_from_slice(&state.to_le_bytes());
    page[4..8].copy_from_slice(&number.to_le_bytes());
    page[8] = 0xFE;
    page[28..32].copy_from_slice(&0x1357_9BDFu32.to_le_bytes());
    for entry in 0..entries {
        page[32 + entry / 4] &= !(1 << (entry % 4 * 2));
        let Some(place) = page.get_mut(64 + 32 * entry..96 + 32 * entry) else { break };
        place.fill(0x42);
        place[24..28].copy_from_slice(&(entry as u32).to_le_bytes());
        place[28..].fill(0xFF);
    }
}

const ACTIVE: u32 = 0xFFFF_FFFE;
const FULL: u32 = 0xFFFF_FFFC;

/// The images, by what they are of.
fn images() -> Vec<(&'static str, Vec<u8>)> {
    let blank = vec![0xFF; RANGE.end as usize];
    let nvs = |states: &[(u32, usize)]| {
        let mut image = blank.clone();
        for (number, ((state, entries), page)) in states.iter().zip(image.chunks_mut(PAGE)).enumerate() {
            nvs_page(*state, number as u32, *entries, page);
        }
        image
    };
    let one = nvs(&[(ACTIVE, 3)]);
    let mut half_erased = nvs(&[(FULL, 6); 5]);
    half_erased[..3 * PAGE + PAGE / 2].fill(0xFF);
    let mut boot_choice = one.clone();
    boot_choice[4 * PAGE..4 * PAGE + 4].copy_from_slice(&1u32.to_le_bytes());
    let mut state = 0x1234_5678u32;
    let random = core::iter::repeat_with(|| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as u8
    });
    vec![
        ("blank", blank.clone()),
        ("one page of NVS", one),
        ("a full page of NVS and the next", nvs(&[(FULL, 6), (ACTIVE, 2)])),
        ("NVS on every page", nvs(&[(FULL, 6); 5])),
        ("NVS, half erased", half_erased),
        ("NVS, and which program to start", boot_choice),
        ("random", random.take(RANGE.end as usize).collect()),
        ("zeros", vec![0; RANGE.end as usize]),
    ]
}

#[test]
fn whatever_was_there_is_erased() {
    for (what, image) in images() {
        println!("{what}");
        works(Flash::with(image));
    }
}

/// A cut at every word of the formatting, clean and in the middle of the word, and cut again while
/// it is repeated.
#[test]
fn no_power_cut_while_erasing_leaves_anything_behind() {
    for (what, image) in images() {
        let words = open(Flash::with(image.clone())).expect("nine pages").into_flash().words_written;
        assert!(words > RANGE.end as usize / 4, "{what} is erased");
        for cut in 0..words {
            let mut flash = Flash::with(image.clone()).cut_after(cut, cut % 2 == 0);
            assert!(block_on(ParameterStore::open(&mut flash, RANGE)).is_err(), "{what}, cut at {cut}");
            let mut flash = flash.cut_after(cut / 3, cut % 3 == 0);
            assert!(block_on(ParameterStore::open(&mut flash, RANGE)).is_err(), "{what}, cut at {cut} and again");
            works(flash.switch_on());
        }
    }
}

/// Forgetting everything is the same work, and a start finishes what a cut has left.
#[test]
fn no_power_cut_while_forgetting_leaves_half() {
    let mut store = open(Flash::new()).expect("nine pages");
    for index in 0..VALUES {
        assert_eq!(block_on(store.save_within(disarmed(), &name(index), index as f32, -1e3..=1e3)), Ok(()));
    }
    let full = store.into_flash();
    let words = RANGE.end as usize / 4;
    for cut in 1..words {
        let mut store = open(full.clone().cut_after(cut, true)).expect("it is ours");
        assert!(block_on(store.erase(disarmed())).is_err(), "cut at {cut}");
        works(store.into_flash().switch_on());
    }
}

/// A store of another size is not taken for this one.
#[test]
fn a_store_of_another_size_is_foreign() {
    let mut small = block_on(ParameterStore::open(Flash::new(), 0..1024)).expect("four pages");
    assert_eq!(block_on(small.save_within(disarmed(), &name(0), 1.0, 0.0..=1.0)), Ok(()));
    works(small.into_flash());
}

/// What is ours is opened without a word written.
#[test]
fn a_store_is_opened_without_writing() {
    let flash = open(Flash::new()).expect("nine pages").into_flash();
    let before = flash.words_written;
    let flash = open(flash).expect("nine pages").into_flash();
    assert_eq!(flash.words_written, before);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// Pages that begin and end as the store's own or as NVS's do, with anything in between.
    #[test]
    fn any_image_becomes_a_store(
        fill in any::<u8>(),
        scattered in prop::collection::vec((0..RANGE.end as usize, any::<u8>()), 0..400),
        edges in prop::collection::vec((0usize..9, any::<bool>(), prop::sample::select(vec![0u32, !0, ACTIVE, FULL])), 0..10),
        cut in prop::option::of(0usize..RANGE.end as usize / 4),
    ) {
        let mut image = vec![fill; RANGE.end as usize];
        for (place, byte) in scattered {
            image[place] = byte;
        }
        for (page, end, word) in edges {
            let place = page * PAGE + if end { PAGE - 4 } else { 0 };
            image[place..place + 4].copy_from_slice(&word.to_le_bytes());
        }
        let mut flash = Flash::with(image);
        if let Some(cut) = cut {
            flash = flash.cut_after(cut, true);
            prop_assert!(block_on(ParameterStore::open(&mut flash, RANGE)).is_err());
        }
        works(flash.switch_on());
    }
}

/// A value of one type is none of another, and is told apart from damage.
#[test]
fn a_value_of_another_type_is_no_value() {
    let mut store = open(Flash::new()).expect("nine pages");
    assert_eq!(block_on(store.save(disarmed(), "x", [1, 2])), Ok(()));
    let stored = Kind::Bytes(2);
    assert_eq!(block_on(store.load_within("x", 0.0..=1.0)), Err(LoadError::OtherKind { stored }));
    assert_eq!(block_on(store.load::<[u8; 6]>("x")), Err(LoadError::OtherKind { stored }));
    assert_eq!(block_on(store.load::<u16>("x")), Err(LoadError::OtherKind { stored }));
    assert_eq!(block_on(store.save(disarmed(), "x", 16_777_217_u32)), Ok(()), "a new type replaces it");
    assert_eq!(block_on(store.load("x")), Ok(Some(16_777_217_u32)));
}

/// These have one hash.
const TWINS: [&str; 2] = ["costarring", "liquid"];

#[test]
fn two_names_with_one_hash_are_told_apart() {
    let [first, second] = TWINS;
    assert_eq!(key(first), key(second));
    let mut store = open(Flash::new()).expect("nine pages");
    assert_eq!(block_on(store.save(disarmed(), first, 1u8)), Ok(()));
    assert_eq!(block_on(store.load::<u8>(second)), Err(LoadError::NameTaken));
    assert_eq!(block_on(store.save(disarmed(), second, 2u8)), Err(SaveError::NameTaken));
    assert_eq!(block_on(store.load(first)), Ok(Some(1u8)));
}

#[test]
fn a_list_shows_each_name_once_with_its_newest_value() {
    let mut store = open(Flash::new()).expect("nine pages");
    // More than the pages hold at a time.
    for round in 0..60u16 {
        for index in 0..7 {
            assert_eq!(block_on(store.save(disarmed(), &name(index), round + index as u16)), Ok(()));
        }
    }
    let mut listed = Vec::new();
    block_on(store.for_each(|name, value| listed.push((name.to_string(), value)))).expect("readable");
    listed.sort_by(|a, b| a.0.cmp(&b.0));
    let expected: Vec<_> = (0..7).map(|index| (name(index), AnyValue::from(59 + index as u16))).collect();
    assert_eq!(listed, expected);
    let long = "x".repeat(LONGEST_NAME + 1);
    assert_eq!(block_on(store.save(disarmed(), &long, 1u8)), Err(SaveError::NameTooLong));
    assert_eq!(block_on(store.save(disarmed(), &long[1..], 1u8)), Ok(()));
    assert_eq!(block_on(store.load(&long[1..])), Ok(Some(1u8)));
}
