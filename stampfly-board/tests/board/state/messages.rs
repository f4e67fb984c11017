//! Messages as bytes: what is no value is refused, as it is on the bus.

use super::bytes;
use proptest::prelude::*;
use stampfly_types::messages::{Alerts, FlightMode, FlightStatus, ImuData, MotorOutput, StateEstimate};
use stampfly_types::{ActivationRecord, Duration, Field, InputRecord, Instant, Message, Quat, Stamped};

// Declared outside `stampfly-types`, with fields that serde knows nothing of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Percent(u8);

impl Field for Percent {
    const KIND: stampfly_types::FieldKind = stampfly_types::FieldKind::U8;
    const COUNT: usize = 1;
    const SIZE: usize = 1;
    fn initial() -> Self {
        Self(0)
    }
    fn write(&self, words: &mut [u32]) {
        self.0.write(words);
    }
    fn read(words: &[u32]) -> Option<Self> {
        u8::read(words).filter(|percent| *percent <= 100).map(Self)
    }
}

stampfly_types::message! {
    struct Own {
        /// An array.
        many: [u16; 3],
        /// A field of its own kind.
        share: Percent,
    }
}

fn read<T: serde::de::DeserializeOwned>(value: &impl serde::Serialize) -> Option<T> {
    postcard::from_bytes(&bytes(value)).ok()
}

fn comes_back<T: serde::Serialize + serde::de::DeserializeOwned + PartialEq>(value: &T) -> bool {
    read::<T>(value).as_ref() == Some(value)
}

proptest! {
    #[test]
    fn every_number_comes_back_bit_for_bit(words: [u32; ImuData::WORDS], micros: u64, generation: u32) {
        let data = ImuData::from_words(&words).expect("floats accept every word");
        let at = Instant::from_micros(micros);
        let back: Stamped<ImuData> = read(&Stamped { at, generation, data }).expect("written a moment ago");
        prop_assert_eq!((back.at, back.generation, back.data.to_words()), (at, generation, words));
        prop_assert!(comes_back(&Duration::from_micros(micros)));
    }

    #[test]
    fn only_known_numbers_are_taken(number: u32, low in 0u32..20) {
        for number in [number, low, 1 << low] {
            prop_assert_eq!(read::<FlightMode>(&number), FlightMode::from_number(number));
            prop_assert_eq!(read::<Alerts>(&number), Alerts::read(&[number]));
        }
    }

    #[test]
    fn a_message_refuses_what_the_bus_refuses(mut words in Just(FlightStatus::default().to_words()), place in 0..FlightStatus::WORDS, word in 0u32..20) {
        words[place] = word;
        prop_assert_eq!(read::<FlightStatus>(&words), FlightStatus::from_words(&words));
    }
}

#[test]
fn a_quaternion_of_another_norm_is_refused() {
    let estimate = StateEstimate { attitude: Quat::from_euler_angles(0.1, 0.2, 0.3), ..Default::default() };
    assert!(comes_back(&estimate) && comes_back(&MotorOutput::default()));
    let mut words = estimate.to_words();
    words[0] = 3.0f32.to_bits();
    assert_eq!(read::<StateEstimate>(&words), None);
}

#[test]
fn a_message_of_another_crate_needs_nothing_of_its_fields() {
    let own = Own { many: [1, 300, 65_535], share: Percent(99) };
    assert!(comes_back(&own));
    let mut words = own.to_words();
    words[3] = 100;
    assert_eq!(read::<Own>(&words), Some(Own { share: Percent(100), ..own }));
    words[3] = 101;
    assert_eq!(read::<Own>(&words), None);
}

#[test]
fn a_record_has_no_more_inputs_than_fit() {
    let mut record = ActivationRecord::new(3, Instant::from_millis(7));
    record.push(InputRecord { generation: 70_000, taken: 2 }).expect("room");
    assert!(comes_back(&record));
    let mut written = bytes(&record);
    *written.last_mut().expect("the number of inputs") = 17;
    assert!(postcard::from_bytes::<ActivationRecord>(&written).is_err());
}
