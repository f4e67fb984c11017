//! Registers, tables and the motion burst of the PMW3901, from PixArt's PMW3901MB-TXQT product data
//! sheet.

/// Register addresses ("Registers", table in the last chapter of the data sheet).
pub mod register {
    /// Identification: [`PRODUCT`](super::PRODUCT).
    pub const PRODUCT_ID: u8 = 0x00;
    /// Motion; reading it and the following four registers resets the counts.
    pub const MOTION: u8 = 0x02;
    /// A complete sample in one transfer.
    pub const MOTION_BURST: u8 = 0x16;
    /// Reset.
    pub const POWER_UP_RESET: u8 = 0x3A;
    /// Bitwise inverse of the identification.
    pub const INVERSE_PRODUCT_ID: u8 = 0x5F;
    /// Selects the bank of the performance registers.
    pub const BANK: u8 = 0x7F;
}

/// Value of [`register::PRODUCT_ID`].
pub const PRODUCT: u8 = 0x49;
/// Value that [`register::POWER_UP_RESET`] takes for a reset.
pub const RESET: u8 = 0x5A;
/// Angle of one count, rad. Not from the data sheet: from a regression of recorded flights on the
/// gyroscope.
pub const RADIANS_PER_COUNT: f32 = 0.002_22;
/// Quality below which the data sheet ("Burst mode") considers a sample with a fully open shutter
/// invalid.
pub const MINIMUM_QUALITY: u8 = 0x19;
const SHUTTER_OPEN: u8 = 0x1F;

/// One step of the start-up sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Write a value to a register.
    Write(u8, u8),
    /// Wait for a number of milliseconds.
    Wait(u8),
}

/// Prepares reading the chip's own calibration ("Performance optimization registers", first part).
pub const PREPARE: [(u8, u8); 5] = [(0x7F, 0x00), (0x55, 0x01), (0x50, 0x07), (0x7F, 0x0E), (0x43, 0x10)];

/// Prepares reading the second part of the calibration.
pub const PREPARE_CALIBRATION: [(u8, u8); 5] = [(0x7F, 0x00), (0x51, 0x7B), (0x50, 0x00), (0x55, 0x00), (0x7F, 0x0E)];

/// Two values to be written back, from the chip's calibration in registers 0x70 and 0x71 of bank
/// 0x0E.
#[must_use]
pub const fn calibration(first: u8, second: u8) -> [u8; 2] {
    let raised = if first <= 28 { first + 14 } else { first.saturating_add(11) };
    let raised = if raised > 0x3F { 0x3F } else { raised };
    [raised, (second as u16 * 45 / 100) as u8]
}

/// Prepares writing the calibration, from bank 0.
pub const BEFORE_CALIBRATION: [(u8, u8); 4] = [(0x7F, 0x00), (0x61, 0xAD), (0x51, 0x70), (0x7F, 0x0E)];

/// The rest of the list ("Performance optimization registers").
///
/// The data sheet prints it in columns, which public copies read in two orders. This order is that
/// of PX4, Crazyflie's firmware, Bitcraze's library for Arduino and ten further copies. The
/// StampFly's own firmware writes 0x63 in bank 7 and 0x32 in bank 9 after an additional pause, and
/// the first value of the calibration to 0x51 instead of 0x70.
///
/// For 0x65 and 0x63 in bank 0x14 and 0x48 in bank 0x15 there are two sets of values; Bitcraze's
/// library has 0x60, 0x78 and 0x58. The pause is 10 ms or 100 ms. **Unverified** whether these
/// differences matter to the chip.
#[rustfmt::skip]
pub const PERFORMANCE: &[Step] = {
    use Step::{Wait as P, Write as W};
    &[
        W(0x7F, 0x00), W(0x61, 0xAD),
        W(0x7F, 0x03), W(0x40, 0x00),
        W(0x7F, 0x05), W(0x41, 0xB3), W(0x43, 0xF1), W(0x45, 0x14), W(0x5B, 0x32), W(0x5F, 0x34), W(0x7B, 0x08),
        W(0x7F, 0x06), W(0x44, 0x1B), W(0x40, 0xBF), W(0x4E, 0x3F),
        W(0x7F, 0x08), W(0x65, 0x20), W(0x6A, 0x18),
        W(0x7F, 0x09), W(0x4F, 0xAF), W(0x5F, 0x40), W(0x48, 0x80), W(0x49, 0x80), W(0x57, 0x77), W(0x60, 0x78),
        W(0x61, 0x78), W(0x62, 0x08), W(0x63, 0x50),
        W(0x7F, 0x0A), W(0x45, 0x60),
        W(0x7F, 0x00), W(0x4D, 0x11), W(0x55, 0x80), W(0x74, 0x1F), W(0x75, 0x1F), W(0x4A, 0x78), W(0x4B, 0x78),
        W(0x44, 0x08), W(0x45, 0x50), W(0x64, 0xFF), W(0x65, 0x1F),
        W(0x7F, 0x14), W(0x65, 0x67), W(0x66, 0x08), W(0x63, 0x70),
        W(0x7F, 0x15), W(0x48, 0x48),
        W(0x7F, 0x07), W(0x41, 0x0D), W(0x43, 0x14), W(0x4B, 0x0E), W(0x45, 0x0F), W(0x44, 0x42), W(0x4C, 0x80),
        W(0x7F, 0x10), W(0x5B, 0x02),
        W(0x7F, 0x07), W(0x40, 0x41), W(0x70, 0x00),
        P(10),
        W(0x32, 0x44),
        W(0x7F, 0x07), W(0x40, 0x40),
        W(0x7F, 0x06), W(0x62, 0xF0), W(0x63, 0x00),
        W(0x7F, 0x0D), W(0x48, 0xC0), W(0x6F, 0xD5),
        W(0x7F, 0x00), W(0x5B, 0xA0), W(0x4E, 0xA8), W(0x5A, 0x50), W(0x40, 0x80),
    ]
};

/// A register of the list, in the bank in which the list ends, and its value. After a restart the
/// chip has another value there.
pub const WITNESS: (u8, u8) = (0x4E, 0xA8);

/// Number of registers that the list sets.
pub const SETTINGS: usize = 55;

/// Final settings of [`PERFORMANCE`]: bank, register and value, in the order of the list. For a
/// register that the list writes twice, the last value.
pub fn settings() -> impl Iterator<Item = (u8, u8, u8)> {
    let mut written = writes();
    core::iter::from_fn(move || {
        loop {
            let (bank, register, value) = written.next()?;
            if !written.clone().any(|later| (later.0, later.1) == (bank, register)) {
                return Some((bank, register, value));
            }
        }
    })
}

/// The writes of the list, each with its bank.
fn writes() -> impl Iterator<Item = (u8, u8, u8)> + Clone {
    let mut bank = 0;
    PERFORMANCE.iter().filter_map(move |step| match *step {
        Step::Write(register::BANK, selected) => {
            bank = selected;
            None
        }
        Step::Write(register, value) => Some((bank, register, value)),
        Step::Wait(_) => None,
    })
}

/// The motion burst ("Burst mode").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motion {
    /// Whether motion was detected since the last read.
    pub moved: bool,
    /// Counts along the chip's x axis since the last read.
    pub delta_x: i16,
    /// Counts along the chip's y axis since the last read.
    pub delta_y: i16,
    /// SQUAL: a quarter of the number of features in the image.
    pub quality: u8,
    /// Value of the brightest pixel of the image, 7 bits.
    pub brightest: u8,
    /// Value of the darkest pixel of the image, 7 bits.
    pub darkest: u8,
    /// Exposure of the image, 13 bits. In the dark its upper five bits are all ones.
    pub shutter: u16,
}

impl Motion {
    /// Decodes the burst. `None` when no chip drives the bus: all bytes ones or all zeros.
    #[must_use]
    pub fn decode(bytes: &[u8; 12]) -> Option<Self> {
        if *bytes == [0xFF; 12] || *bytes == [0; 12] {
            return None;
        }
        let [motion, _observation, x0, x1, y0, y1, quality, _sum, brightest, darkest, shutter1, shutter0] = *bytes;
        Some(Self {
            moved: motion & 0x80 != 0,
            delta_x: i16::from_le_bytes([x0, x1]),
            delta_y: i16::from_le_bytes([y0, y1]),
            quality,
            brightest,
            darkest,
            shutter: u16::from_be_bytes([shutter1 & 0x1F, shutter0]),
        })
    }

    /// Whether the chip can have taken this image.
    ///
    /// False without an exposure, when the darkest pixel is brighter than the brightest, and when
    /// all pixels are black although the shutter is not fully open, as it is in the dark. The
    /// brightness of an image in the dark is **unverified**, so any value is accepted there.
    #[must_use]
    pub const fn is_exposed(&self) -> bool {
        let dark = self.shutter >> 8 == SHUTTER_OPEN as u16;
        self.shutter > 0 && self.darkest <= self.brightest && (self.brightest > 0 || dark)
    }

    /// Whether the image quality supports the counts.
    ///
    /// False by the data sheet's rule: low quality in the dark. Also false without motion at low
    /// quality, because a sensor without features must not be mistaken for one that does not move.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let poor = self.quality < MINIMUM_QUALITY;
        let dark = self.shutter >> 8 == u16::from(SHUTTER_OPEN);
        let still = self.delta_x == 0 && self.delta_y == 0;
        !(poor && (dark || still))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_burst_is_taken_apart() {
        let bytes = [0xB0, 0xBF, 0x05, 0x00, 0xFE, 0xFF, 0x50, 0x30, 0x70, 0x10, 0x0A, 0xBC];
        let motion = Motion::decode(&bytes).expect("a burst");
        assert!(motion.moved);
        assert_eq!((motion.delta_x, motion.delta_y, motion.quality), (5, -2, 0x50));
        assert_eq!((motion.brightest, motion.darkest, motion.shutter), (0x70, 0x10, 0x0ABC));
        assert_eq!(Motion::decode(&[0xFF; 12]), None, "nobody drives the bus");
        assert_eq!(Motion::decode(&[0; 12]), None);
    }

    #[test]
    fn low_quality_counts_in_the_light_and_with_motion_only() {
        let burst = |quality, shutter: u8, delta| {
            Motion::decode(&[0x80, 0, delta, 0, 0, 0, quality, 1, 1, 1, shutter, 0]).expect("a burst").is_valid()
        };
        assert!(burst(0x19, 0x1F, 3), "quality is good enough even in the dark");
        assert!(!burst(0x18, 0x1F, 3), "the data sheet's rule");
        assert!(burst(0x18, 0x1E, 3));
        assert!(!burst(0x18, 0x1E, 0), "sees nothing");
        assert!(burst(0x19, 0x1E, 0), "stands still");
        assert!(!burst(0, 0xFF, 3), "reserved bits of the shutter do not open it");
    }

    #[test]
    fn a_picture_goes_with_its_exposure() {
        let burst = |brightest, darkest, shutter: [u8; 2]| {
            let [high, low] = shutter;
            let bytes = [0, 0xBF, 0, 0, 0, 0, 0, 0, brightest, darkest, high, low];
            Motion::decode(&bytes).expect("a burst").is_exposed()
        };
        assert!(burst(0x60, 0x10, [0x01, 0x40]), "a floor");
        assert!(burst(0x20, 0x20, [0x00, 0x01]), "a sheet of paper in the sun");
        assert!(burst(2, 0, [0x1F, 0xFF]) && burst(0, 0, [0x1F, 0x00]), "the dark");
        assert!(!burst(0, 0, [0x01, 0x40]), "black, and no longer exposed");
        assert!(!burst(0x10, 0x11, [0x01, 0x40]), "the darkest is the brightest");
        assert!(!burst(0x60, 0x10, [0, 0]) && !burst(0x60, 0x10, [0xE0, 0]), "never exposed");
    }

    #[test]
    fn the_calibration_is_raised_and_limited() {
        assert_eq!(calibration(28, 100), [42, 45]);
        assert_eq!(calibration(29, 255), [40, 114]);
        assert_eq!(calibration(60, 0), [0x3F, 0]);
        assert_eq!(calibration(255, 1), [0x3F, 0]);
    }

    #[test]
    fn the_witness_is_written_in_the_last_bank_and_not_again() {
        let last = PERFORMANCE.iter().rposition(|step| matches!(step, Step::Write(register::BANK, 0)));
        let tail = PERFORMANCE.get(last.expect("a bank")..).expect("steps");
        let (register, value) = WITNESS;
        assert!(tail.contains(&Step::Write(register, value)));
        assert_eq!(tail.iter().filter(|step| matches!(step, Step::Write(at, _) if *at == register)).count(), 1);
    }

    #[test]
    fn the_list_ends_in_the_bank_that_holds_the_motion() {
        let mut banks = PERFORMANCE.iter().filter_map(|step| match step {
            Step::Write(register::BANK, bank) => Some(*bank),
            _ => None,
        });
        assert_eq!(banks.next_back(), Some(0));
        let writes = PERFORMANCE.iter().filter(|step| matches!(step, Step::Write(..))).count();
        assert_eq!((writes, PERFORMANCE.len()), (73, 74));
    }

    #[test]
    fn what_the_list_leaves_behind_is_the_last_value_of_every_register() {
        assert_eq!(settings().count(), SETTINGS);
        assert_eq!(settings().filter(|setting| (setting.0, setting.1) == (0x07, 0x40)).count(), 1);
        assert!(settings().any(|setting| setting == (0x07, 0x40, 0x40)), "not 0x41, which it had before");
        assert_eq!(settings().last(), Some((0x00, 0x40, 0x80)));
    }
}
