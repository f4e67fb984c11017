//! Start sequences of four other PMW3901 drivers, compared with this one value by value.
//!
//! The performance registers are undocumented: PixArt's data sheet lists them without explanation.
//! The only reference is what drivers write that have flown with the chip. Read on 2026-11-26;
//! numbers only.
//!
//! | column | driver | file, at commit |
//! |---|---|---|
//! | 0 | PX4 | `PX4/PX4-Autopilot`, `src/drivers/optical_flow/pmw3901/PMW3901.cpp`, 11f64b1e |
//! | 1 | Crazyflie | `bitcraze/crazyflie-firmware`, `src/drivers/src/pmw3901.c`, 37524f42 |
//! | 2 | Bitcraze's library for Arduino | `bitcraze/Bitcraze_PMW3901`, `src/Bitcraze_PMW3901.cpp`, 3ae7e5ce |
//! | 3 | ArduPilot | `ArduPilot/ardupilot`, `AP_OpticalFlow_Pixart_SROM.h` 1b979bc9 and `AP_OpticalFlow_Pixart.cpp` 00adba28 |
//!
//! Other differences: only PX4 reads the chip's own calibration at the beginning. Crazyflie's list
//! ends with two more registers of bank 0, 0x5A = 0x10 and 0x54 = 0x00. ArduPilot reads each
//! register back after its write, up to five times, and continues when the values never agree; the
//! others do not read back. As no driver is known to depend on read-back, this one does not either:
//! a register that reads the same other value after two starts counts as write-only.

use stampfly_pmw3901::codec::{self, Step, register};

/// One setting: its bank, its register, and the values of the four drivers.
type Row = (u8, u8, [u8; 4]);

const fn all(bank: u8, register: u8, value: u8) -> Row {
    (bank, register, [value; 4])
}

/// In the order of the drivers. The banks are from the writes to 0x7F before each setting.
const LIST: [Row; 56] = [
    all(0x00, 0x61, 0xAD),
    all(0x03, 0x40, 0x00),
    all(0x05, 0x41, 0xB3),
    all(0x05, 0x43, 0xF1),
    all(0x05, 0x45, 0x14),
    all(0x05, 0x5B, 0x32),
    all(0x05, 0x5F, 0x34),
    all(0x05, 0x7B, 0x08),
    all(0x06, 0x44, 0x1B),
    all(0x06, 0x40, 0xBF),
    all(0x06, 0x4E, 0x3F),
    all(0x08, 0x65, 0x20),
    all(0x08, 0x6A, 0x18),
    all(0x09, 0x4F, 0xAF),
    all(0x09, 0x5F, 0x40),
    all(0x09, 0x48, 0x80),
    all(0x09, 0x49, 0x80),
    all(0x09, 0x57, 0x77),
    all(0x09, 0x60, 0x78),
    all(0x09, 0x61, 0x78),
    all(0x09, 0x62, 0x08),
    all(0x09, 0x63, 0x50),
    all(0x0A, 0x45, 0x60),
    all(0x00, 0x4D, 0x11),
    all(0x00, 0x55, 0x80),
    (0x00, 0x74, [0x21, 0x1F, 0x1F, 0x1F]),
    all(0x00, 0x75, 0x1F),
    all(0x00, 0x4A, 0x78),
    all(0x00, 0x4B, 0x78),
    all(0x00, 0x44, 0x08),
    all(0x00, 0x45, 0x50),
    all(0x00, 0x64, 0xFF),
    all(0x00, 0x65, 0x1F),
    (0x14, 0x65, [0x67, 0x67, 0x60, 0x60]),
    all(0x14, 0x66, 0x08),
    (0x14, 0x63, [0x70, 0x70, 0x78, 0x78]),
    (0x15, 0x48, [0x48, 0x48, 0x58, 0x58]),
    all(0x07, 0x41, 0x0D),
    all(0x07, 0x43, 0x14),
    all(0x07, 0x4B, 0x0E),
    all(0x07, 0x45, 0x0F),
    all(0x07, 0x44, 0x42),
    all(0x07, 0x4C, 0x80),
    all(0x10, 0x5B, 0x02),
    all(0x07, 0x40, 0x41),
    all(0x07, 0x70, 0x00),
    all(0x07, 0x32, 0x44),
    all(0x07, 0x40, 0x40),
    all(0x06, 0x62, 0xF0),
    all(0x06, 0x63, 0x00),
    all(0x0D, 0x48, 0xC0),
    all(0x0D, 0x6F, 0xD5),
    all(0x00, 0x5B, 0xA0),
    all(0x00, 0x4E, 0xA8),
    all(0x00, 0x5A, 0x50),
    all(0x00, 0x40, 0x80),
];

/// Settings on which the drivers differ, and the value that this driver writes.
const DISPUTED: [(u8, u8, u8); 4] = [(0x00, 0x74, 0x1F), (0x14, 0x65, 0x67), (0x14, 0x63, 0x70), (0x15, 0x48, 0x48)];
/// Row before which the drivers pause, and the length of the pause, ms.
const PAUSE: (usize, [u8; 4]) = (46, [10, 10, 100, 100]);

/// This driver's list as rows of bank, register and value, and its pauses with the index of the
/// next row.
fn ours() -> (Vec<(u8, u8, u8)>, Vec<(usize, u8)>) {
    let (mut rows, mut pauses, mut bank) = (Vec::new(), Vec::new(), 0);
    for step in codec::PERFORMANCE {
        match *step {
            Step::Write(register::BANK, selected) => bank = selected,
            Step::Write(register, value) => rows.push((bank, register, value)),
            Step::Wait(millis) => pauses.push((rows.len(), millis)),
        }
    }
    (rows, pauses)
}

#[test]
fn every_value_of_our_list_is_that_of_all_four_but_for_four_of_which_they_differ() {
    let (ours, _) = ours();
    assert_eq!(ours.len(), LIST.len());
    for ((bank, register, value), (their_bank, their_register, theirs)) in ours.into_iter().zip(LIST) {
        assert_eq!((bank, register), (their_bank, their_register), "{bank:#04x} {register:#04x}: order");
        let same = theirs.iter().all(|other| *other == value);
        let disputed = DISPUTED.contains(&(bank, register, value)) && theirs.contains(&value);
        assert!(same != disputed && (same || disputed), "{bank:#04x} {register:#04x}: {value:#04x} of {theirs:#04x?}");
    }
}

#[test]
fn the_pause_is_where_all_have_it_and_no_shorter_than_those_who_fly_with_it() {
    let (place, theirs) = PAUSE;
    let (_, pauses) = ours();
    assert_eq!(pauses.len(), 1);
    assert_eq!(pauses.first().map(|pause| pause.0), Some(place));
    assert!(pauses.iter().all(|(_, millis)| theirs.contains(millis)));
}

#[test]
fn what_is_read_back_is_what_each_of_the_four_leaves_behind() {
    for source in 0..4 {
        let left = LIST.iter().enumerate().filter_map(|(place, (bank, register, values))| {
            let later = LIST.iter().skip(place + 1).any(|later| (later.0, later.1) == (*bank, *register));
            (!later).then_some((*bank, *register, values[source]))
        });
        let mut differ = Vec::new();
        let left: Vec<_> = left.collect();
        assert_eq!(left.len(), codec::SETTINGS);
        for (ours, theirs) in codec::settings().zip(left) {
            assert_eq!((ours.0, ours.1), (theirs.0, theirs.1));
            if ours != theirs {
                differ.push((theirs.0, theirs.1));
            }
        }
        let expected: &[(u8, u8)] = match source {
            0 => &[(0x00, 0x74)],
            1 => &[],
            _ => &[(0x14, 0x65), (0x14, 0x63), (0x15, 0x48)],
        };
        assert_eq!(differ, expected, "column {source}");
    }
}

#[test]
fn identities_and_reset_are_those_of_all() {
    // Crazyflie and ArduPilot compare both identifications, Bitcraze's library accepts either, PX4
    // checks the first.
    assert_eq!((register::PRODUCT_ID, codec::PRODUCT), (0x00, 0x49));
    assert_eq!((register::INVERSE_PRODUCT_ID, !codec::PRODUCT), (0x5F, 0xB6));
    assert_eq!((register::POWER_UP_RESET, codec::RESET), (0x3A, 0x5A));
    assert_eq!((register::BANK, register::MOTION, register::MOTION_BURST), (0x7F, 0x02, 0x16));
}

#[test]
fn the_calibration_is_that_of_px4() {
    assert_eq!(codec::PREPARE, [(0x7F, 0x00), (0x55, 0x01), (0x50, 0x07), (0x7F, 0x0E), (0x43, 0x10)]);
    let second = [(0x7F, 0x00), (0x51, 0x7B), (0x50, 0x00), (0x55, 0x00), (0x7F, 0x0E)];
    assert_eq!(codec::PREPARE_CALIBRATION, second);
    assert_eq!(codec::BEFORE_CALIBRATION, [(0x7F, 0x00), (0x61, 0xAD), (0x51, 0x70), (0x7F, 0x0E)]);
    // Values up to 28 are raised by 14, larger ones by 11, limited to 63. The other value is scaled
    // by 45 %.
    for (read, written) in [(0, 14), (28, 42), (29, 40), (52, 63), (53, 63), (244, 63)] {
        assert_eq!(codec::calibration(read, 0)[0], written, "{read}");
    }
    for (read, written) in [(0, 0), (2, 0), (3, 1), (96, 43), (100, 45), (255, 114)] {
        assert_eq!(codec::calibration(0, read)[1], written, "{read}");
    }
}
