//! Parameters that survive a restart, and one that is refused: for `docs/guide/own-vehicle.md`.

use stampfly_param::types::messages::FlightStatus;
use stampfly_param::{Disarmed, RamFlash, blocking::ParameterStore};

fn main() {
    // ANCHOR: open
    // In memory here, on a chip its flash: four pages of 4 kB.
    let flash = RamFlash::<0x4000>::new();
    let mut store = ParameterStore::open(flash, 0..0x4000).expect("three whole pages or more");
    // ANCHOR_END: open

    // ANCHOR: save
    // The status comes from the mode machine; an armed vehicle gives no proof.
    let status = FlightStatus::default();
    let disarmed = || Disarmed::proven_by(&status).expect("it stands on a table");
    store.save_within(disarmed(), "attitude.kp", 7.5_f32, 0.5..=20.0).expect("in range");
    store.save(disarmed(), "serial", 16_777_217_u32).expect("any number");
    // ANCHOR_END: save

    // ANCHOR: load
    // After a restart.
    let mut store = ParameterStore::open(store.into_flash(), 0..0x4000).expect("as before");
    let kp = store.load_within("attitude.kp", 0.5..=20.0).ok().flatten().unwrap_or(6.0_f32);
    store.for_each(|name, value| println!("{name} = {value}")).expect("readable");
    // ANCHOR_END: load
    assert_eq!(kp, 7.5);

    let refused = store.save_within(disarmed(), "attitude.kp", 75.0_f32, 0.5..=20.0);
    println!("75 instead of 7.5: {}", refused.expect_err("out of range"));
    assert!(Disarmed::proven_by(&FlightStatus { armed: true, ..Default::default() }).is_none());
}
