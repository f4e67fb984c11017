//! The EEPROM's image: places as in the original's memory, and what becomes of one that is damaged.

use proptest::prelude::*;
use stampfly_link::hisky::HiskyLink;
use stampfly_param::ParameterTable;
use stampfly_param::parameters::validate;
use stampfly_stm32_quad::Parameters;
use stampfly_stm32_quad::eeprom::{SIZE, Stored};

fn link() -> HiskyLink {
    HiskyLink { address: [0x12, 0x34, 0x56, 0x78, 0x58], hops: core::array::from_fn(|hop| 2 + 3 * hop as u8) }
}

#[test]
fn every_number_is_where_the_original_has_it() {
    let mut parameters = Parameters::default();
    parameters.offset.accel_z = 9.806_65;
    parameters.offset.gyro_x = 0.25;
    let image = Stored { link: Some(link()), parameters }.image();
    let at = |offset: usize| f32::from_le_bytes(image[offset..offset + 4].try_into().expect("four bytes"));
    assert_eq!(image[..5], [0x12, 0x34, 0x56, 0x78, 0x58]);
    assert_eq!(image[5..25], link().hops);
    // Struct Offset { float acc[3]; float gyro[3]; }, in g.
    assert!((at(32 + 8) - 1.0).abs() < 1e-6);
    assert_eq!(at(32 + 12), 0.25);
    // Struct Parameter: pid[3][3], angle_max, …, filter_dterm.
    assert_eq!([at(64), at(64 + 4), at(64 + 8), at(64 + 24), at(64 + 32)], [0.2, 0.02, 0.002, 0.2, 0.0]);
    assert_eq!([at(64 + 36), at(64 + 52), at(64 + 64), at(64 + 76)], [0.872_664_6, 0.05, 3.1, 100.0]);
    assert_eq!(image[64 + 80..], [0; 16], "nothing more");
}

#[test]
fn a_transmitter_is_forgotten_by_its_first_channel() {
    let mut image = Stored { link: Some(link()), parameters: Parameters::default() }.image();
    assert_eq!(Stored::read(&image, &Parameters::default()).link, Some(link()));
    image[5] = 0xFF;
    assert_eq!(Stored::read(&image, &Parameters::default()).link, None);
}

proptest! {
    #[test]
    fn whatever_it_holds_the_parameters_are_ones_that_may_fly(image in prop::collection::vec(any::<u8>(), SIZE)) {
        let image: [u8; SIZE] = image.try_into().expect("as long as it should be");
        let stored = Stored::read(&image, &Parameters::default());
        prop_assert!(validate(&stored.parameters).is_ok());
        let again = Stored::read(&stored.image(), &Parameters::default());
        prop_assert_eq!(again.link, stored.link);
        for row in Parameters::TABLE {
            let (ours, theirs) = (row.get(&again.parameters), row.get(&stored.parameters));
            prop_assert!((ours - theirs).abs() <= 1e-6 * theirs.abs(), "{}", row.info.name);
        }
    }
}
