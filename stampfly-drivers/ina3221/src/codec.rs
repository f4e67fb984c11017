//! Registers and scales of the INA3221, from Texas Instruments SBOS576B. Registers are words, high
//! byte first, described in its §8.6 "Register Maps".

use super::config::Config;
pub use super::config::{Average, Channel, ConversionTime};
use stampfly_types::Duration;

/// Register addresses, §8.6.1.
pub mod register {
    /// Channels, averaging, conversion times, mode.
    pub const CONFIGURATION: u8 = 0x00;
    /// Shunt voltage of channel 1, followed by its bus voltage and the registers of the other
    /// channels.
    pub const SHUNT_1: u8 = 0x01;
    /// Flags.
    pub const MASK_ENABLE: u8 = 0x0F;
    /// Manufacturer: [`MANUFACTURER_VALUE`](super::MANUFACTURER_VALUE).
    pub const MANUFACTURER: u8 = 0xFE;
    /// Part: [`DIE_VALUE`](super::DIE_VALUE).
    pub const DIE: u8 = 0xFF;
}

/// "TI", §8.6.2.
pub const MANUFACTURER_VALUE: u16 = 0x5449;
/// Value of [`register::DIE`], §8.6.2.
pub const DIE_VALUE: u16 = 0x3220;
/// Reset, in [`register::CONFIGURATION`].
pub const RESET: u16 = 0x8000;
/// All conversions of the enabled channels are complete; cleared by a read. In
/// [`register::MASK_ENABLE`].
pub const CONVERSION_READY: u16 = 0x0001;
/// Valid range of a bus voltage in counts of 8 mV: above zero and at most 26 V ("Recommended
/// operating conditions"), less than the range of the register.
const BUS: core::ops::RangeInclusive<i16> = 1..=3_250;
/// Limits of the shunt registers without their three low bits. A voltage out of range reads as one
/// of them.
const SHUNT_ENDS: [i16; 2] = [-4_096, 4_095];
/// Continuous conversion of shunt and bus.
const CONTINUOUS: u16 = 0b111;

impl Channel {
    /// Address of the shunt voltage.
    #[must_use]
    pub const fn shunt_register(self) -> u8 {
        register::SHUNT_1 + 2 * self as u8
    }

    /// Address of the bus voltage.
    #[must_use]
    pub const fn bus_register(self) -> u8 {
        self.shunt_register() + 1
    }
}

impl Average {
    const fn conversions(self) -> u64 {
        match self {
            Self::A1 => 1,
            Self::A4 => 4,
            Self::A16 => 16,
            Self::A64 => 64,
            Self::A128 => 128,
            Self::A256 => 256,
            Self::A512 => 512,
            Self::A1024 => 1_024,
        }
    }
}

impl ConversionTime {
    const fn micros(self) -> u64 {
        match self {
            Self::Us140 => 140,
            Self::Us204 => 204,
            Self::Us332 => 332,
            Self::Us588 => 588,
            Self::Us1100 => 1_100,
            Self::Us2116 => 2_116,
            Self::Us4156 => 4_156,
            Self::Us8244 => 8_244,
        }
    }
}

/// CONFIGURATION with the channels that have a shunt, and the same conversion time for shunt and
/// bus.
#[must_use]
pub const fn configuration(config: &Config) -> u16 {
    let time = config.time as u16;
    let [one, two, three] = enabled(config);
    let channels = one << 14 | two << 13 | three << 12;
    channels | (config.average as u16) << 9 | time << 6 | time << 3 | CONTINUOUS
}

/// Whether each channel is measured, as one or zero.
const fn enabled(config: &Config) -> [u16; 3] {
    let [one, two, three] = config.shunts_ohms;
    [one.is_some() as u16, two.is_some() as u16, three.is_some() as u16]
}

/// Time between two results: the conversions of shunt and bus of all channels in sequence.
#[must_use]
pub const fn cycle(config: &Config) -> Duration {
    let [one, two, three] = enabled(config);
    let channels = (one + two + three) as u64;
    Duration::from_micros(channels * 2 * config.average.conversions() * config.time.micros())
}

/// Shunt voltage, V: 13 bits, left-justified, 40 µV each, §8.6.2.
#[must_use]
pub fn shunt_volts(register: u16) -> f32 {
    f32::from((register as i16) >> 3) * 40e-6
}

/// Bus voltage, V: 13 bits, left-justified, 8 mV each, §8.6.2.
#[must_use]
pub fn bus_volts(register: u16) -> f32 {
    f32::from((register as i16) >> 3) * 8e-3
}

/// Whether these registers of shunt and bus are plausible for a supply: a bus voltage above zero
/// and within the operating conditions of the pin, and a shunt voltage within the scale.
#[must_use]
pub fn is_measurable(shunt: u16, bus: u16) -> bool {
    BUS.contains(&((bus as i16) >> 3)) && !SHUNT_ENDS.contains(&((shunt as i16) >> 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_those_of_the_data_sheet() {
        // −80 mV are 2000 counts of 40 µV in two's complement: 0xC180.
        assert!((shunt_volts(0xC180) + 0.08).abs() < 1e-7);
        assert!((shunt_volts(0x7FF8) - 0.163_8).abs() < 1e-6, "full scale");
        assert!((bus_volts(0x7FF8) - 32.76).abs() < 1e-4, "full scale");
        assert_eq!(shunt_volts(0xFFF8), -40e-6);
        assert_eq!(shunt_volts(0x0007), 0.0, "the low three bits are not data");
    }

    #[test]
    fn the_configuration_word_is_the_reset_value_with_other_choices() {
        // Reset value 0x7127: three channels, no averaging, 1.1 ms, continuous.
        let config = Config { average: Average::A1, time: ConversionTime::Us1100, ..Config::default() };
        assert_eq!(configuration(&config), 0x2127, "channel 2 only");
        let shunt = Some(0.01);
        for (shunts_ohms, word) in [([shunt, None, None], 0x4127), ([None, None, shunt], 0x1127), ([shunt; 3], 0x7127)]
        {
            assert_eq!(configuration(&Config { shunts_ohms, ..config }), word);
        }
        assert_eq!(configuration(&Config { average: Average::A1024, ..config }), 0x2F27);
        assert_eq!((Channel::Two.shunt_register(), Channel::Two.bus_register()), (3, 4));
    }

    #[test]
    fn a_supply_is_above_nothing_and_below_what_the_pin_may_have() {
        // 3.8 V, 40 µV.
        assert!(is_measurable(0x0008, 475 << 3) && is_measurable(0xFFF8, 475 << 3), "either direction");
        assert!(is_measurable(0x7FF0, 1 << 3) && is_measurable(0x8008, 3_250 << 3), "the last before the ends");
        assert!(!is_measurable(8, 0), "no supply");
        assert!(!is_measurable(8, 3_251 << 3) && !is_measurable(8, 0xFFF8), "26.008 V, −8 mV");
        assert!(!is_measurable(0x7FF8, 475 << 3) && !is_measurable(0x8000, 475 << 3), "an open shunt");
    }

    #[test]
    fn the_default_gives_more_than_ten_results_a_second() {
        let cycle = cycle(&Config::default());
        assert_eq!(cycle, Duration::from_micros(2 * 64 * 588));
        assert!(cycle < Duration::from_millis(100));
        let all = Config { shunts_ohms: [Some(0.1); 3], ..Config::default() };
        assert_eq!(super::cycle(&all), cycle * 3, "one channel after the other");
    }
}
