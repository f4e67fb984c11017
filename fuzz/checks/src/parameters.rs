//! What the parameter store finds in flash.

use crate::Input;
use crate::flash::{Flash, FlashError, PAGE};
use embassy_futures::block_on;
use stampfly_param::{Disarmed, ParameterStore, SaveError};
use stampfly_types::messages::FlightStatus;

const PAGES: usize = 5;
const RANGE: core::ops::Range<u32> = 0..(PAGES * PAGE) as u32;
const NAMES: [&str; 3] = ["hover.thrust", "eskf.gate", "landing.descent"];
const BOUNDS: core::ops::RangeInclusive<f32> = -1e3..=1e3;
const ADDRESS: &str = "link.peer";

/// The first two bytes say when the power fails, counted in words; the third, what the image lies on: blank pages, or a
/// store with values. The rest is the image, laid over it.
pub fn parameter_image(data: &[u8]) {
    let mut input = Input(data);
    let cut = u32::from(u16::from_le_bytes([input.byte(), input.byte()]));
    let mut image = if input.byte() & 1 == 1 { image_of_a_store() } else { vec![0xFF; PAGES * PAGE] };
    let given = input.bytes(image.len());
    for (place, byte) in image.iter_mut().zip(given) {
        *place = *byte;
    }

    let mut flash = Flash::new(image);
    // More words than there are: the power does not fail.
    flash.words_left = Some(cut).filter(|cut| *cut < 2_000);
    use_store(flash.clone());
    flash.words_left = None;
    use_store(flash);
}

/// Opens a store, looks at what is in it, saves, and looks again after a restart.
fn use_store(flash: Flash) {
    // Without power nothing can be said, and there is no flash left to look at: the store owned it.
    let Ok(mut store) = open(flash) else { return };
    let before = NAMES.map(|name| load(&mut store, name));
    let _ = block_on(store.load::<[u8; 6]>(ADDRESS));
    let mut expected = before;
    for (index, name) in NAMES.into_iter().enumerate() {
        let value = index as f32 + 0.5;
        match block_on(store.save_within(disarmed(), name, value, BOUNDS)) {
            Ok(()) => expected[index] = Some(value),
            // Half of it may be there.
            Err(SaveError::Flash(FlashError::Power)) => return restart(store, None),
            Err(SaveError::OutOfRange) => panic!("{value} is in range"),
            // Damaged pages. Erasing them helps.
            Err(_) => {
                match block_on(store.erase(disarmed())) {
                    Ok(()) => {}
                    Err(_) => return restart(store, None),
                }
                expected = [None; 3];
                if block_on(store.save_within(disarmed(), name, value, BOUNDS)).is_err() {
                    return restart(store, None);
                }
                expected[index] = Some(value);
            }
        }
    }
    restart(store, Some(expected));
}

/// Takes the flash to a new store. What was saved is there; without such knowledge, what is there is at least in range.
fn restart(store: ParameterStore<Flash>, expected: Option<[Option<f32>; 3]>) {
    let mut flash = store.into_flash();
    flash.words_left = None;
    let mut store = open(flash).expect("a flash with power and five pages");
    let found = NAMES.map(|name| load(&mut store, name));
    if let Some(expected) = expected {
        assert_eq!(found, expected);
    }
}

fn open(flash: Flash) -> Result<ParameterStore<Flash>, stampfly_param::OpenError<FlashError>> {
    block_on(ParameterStore::open(flash, RANGE))
}

/// A value that is there and may be used.
fn load(store: &mut ParameterStore<Flash>, name: &str) -> Option<f32> {
    let value = block_on(store.load_within(name, BOUNDS)).ok().flatten();
    assert!(value.is_none_or(|value| BOUNDS.contains(&value)), "{name}: {value:?}");
    value
}

fn disarmed() -> Disarmed {
    Disarmed::proven_by(&FlightStatus::default()).expect("the default is disarmed")
}

/// The bytes of a store in use.
pub fn image_of_a_store() -> Vec<u8> {
    let mut store = open(Flash::new(vec![0xFF; PAGES * PAGE])).expect("five pages");
    for round in 0..20u8 {
        for name in NAMES {
            block_on(store.save_within(disarmed(), name, f32::from(round), BOUNDS)).expect("a flash with power");
        }
    }
    block_on(store.save(disarmed(), ADDRESS, [2, 0, 0, 0, 0, 7])).expect("a flash with power");
    store.into_flash().into_bytes()
}
