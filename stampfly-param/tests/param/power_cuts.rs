//! The power is cut at every byte of a thousand saved values, and the figures are printed:
//! `cargo test -p stampfly-param --test param power_cuts -- --nocapture`.

use crate::flash::Flash;
use embassy_futures::block_on;
use stampfly_param::{Disarmed, ParameterStore};
use stampfly_types::messages::FlightStatus;

const RANGE: core::ops::Range<u32> = 0..1280;
const NAMES: [&str; 5] = ["rate.roll.kp", "rate.roll.ti", "hover.thrust", "eskf.gate", "motor.duty.max"];
const WRITES: usize = 1000;

fn save(store: &mut ParameterStore<Flash>, name: &str, value: f32) -> bool {
    let disarmed = Disarmed::proven_by(&FlightStatus::default()).expect("disarmed");
    block_on(store.save_within(disarmed, name, value, -1e6..=1e6)).is_ok()
}

fn load(store: &mut ParameterStore<Flash>, name: &str) -> Option<f32> {
    block_on(store.load_within(name, -1e6..=1e6)).expect("a value or none")
}

/// Switches on, saves a value, and gives the flash back. `None` when the power failed while the
/// store was opened.
fn life(flash: Flash, name: &str, value: f32) -> Option<(bool, Flash)> {
    let mut store = block_on(ParameterStore::open(flash, RANGE)).ok()?;
    let saved = save(&mut store, name, value);
    Some((saved, store.into_flash()))
}

/// Every cut is made from the flash as the writes before have left it: before every byte, and
/// before every fourth, another one from write to write, once more with half of the bits of the
/// rest of its word changed. After it every name has its last value, or the one being saved its new
/// one, and saving goes on.
#[test]
fn no_cut_at_any_byte_of_a_thousand_writes_loses_a_value() {
    let mut flash = block_on(ParameterStore::open(Flash::new(), RANGE)).expect("five pages").into_flash();
    let mut known = [None; NAMES.len()];
    let (mut bytes, mut cuts, mut old, mut new, mut largest) = (0, 0, 0, 0, 0);
    for index in 0..WRITES {
        let slot = index * index % NAMES.len();
        let (name, value) = (NAMES[slot], index as f32 + 0.5);
        let (saved, after) = life(flash.clone(), name, value).expect("power");
        assert!(saved, "write {index}");
        let written = 4 * (after.words_written - flash.words_written);
        assert!(written > 0, "write {index} writes");
        for (cut, torn) in
            (0..written).flat_map(|cut| [Some((cut, false)), ((cut + index) % 4 == 0).then_some((cut, true))]).flatten()
        {
            let (saved, cut_off) = life(flash.clone().cut_after_bytes(cut, torn), name, value).expect("opened before");
            assert!(!saved, "write {index}: the cut at byte {cut} of {written} lies within it");
            let mut store = block_on(ParameterStore::open(cut_off.switch_on(), RANGE)).expect("opens again");
            for (other, known) in known.iter().enumerate() {
                let found = load(&mut store, NAMES[other]);
                let is_new = other == slot && found == Some(value);
                assert!(
                    is_new || found == *known,
                    "write {index}, byte {cut}, torn {torn}: {} is {found:?}",
                    NAMES[other]
                );
                if other == slot {
                    *(if is_new { &mut new } else { &mut old }) += 1;
                }
            }
            assert!(save(&mut store, name, -value), "write {index}, byte {cut}, torn {torn}: saving goes on");
            assert_eq!(load(&mut store, name), Some(-value));
            cuts += 1;
        }
        (bytes, largest) = (bytes + written, largest.max(written));
        (known[slot], flash) = (Some(value), after);
    }
    assert!(largest > 256, "pages were erased among them");
    assert_eq!(old + new, cuts);
    println!(
        "{WRITES} writes, {bytes} bytes written or erased: {cuts} power cuts, {old} with the value before, {new} with the new one, 0 lost"
    );
}
