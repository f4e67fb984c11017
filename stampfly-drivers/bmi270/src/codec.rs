//! Registers, scales and frames of the BMI270, from Bosch BST-BMI270-DS000 revision 1.3. Register
//! addresses refer to its §5.2; other sections are cited by title.

use super::config::Config;
pub use super::config::{AccelRange, GyroRange, Rate};

/// Register addresses, §5.2.
pub mod register {
    /// Identification: [`CHIP_ID_VALUE`](super::CHIP_ID_VALUE).
    pub const CHIP_ID: u8 = 0x00;
    /// Accelerometer data, 6 bytes, followed by gyroscope data, 6 bytes.
    pub const DATA_8: u8 = 0x0C;
    /// Sensor time, 3 bytes; first register of the [`Status`](super::Status) burst.
    pub const SENSORTIME_0: u8 = 0x18;
    /// Start-up status.
    pub const INTERNAL_STATUS: u8 = 0x21;
    /// Selects the page of features at the registers from 0x30.
    pub const FEAT_PAGE: u8 = 0x2F;
    /// On page 1: longest burst, then the operation that [`GYRO_TRIGGER`](super::GYRO_TRIGGER)
    /// starts; one byte each.
    pub const G_TRIG_1: u8 = 0x32;
    /// On page 0: the reason why the triggered operation was refused.
    pub const GYR_GAIN_STATUS: u8 = 0x38;
    /// FIFO output.
    pub const FIFO_DATA: u8 = 0x26;
    /// Gyroscope cross-axis factor.
    pub const GYR_CAS: u8 = 0x3C;
    /// Accelerometer configuration, followed by its range and the gyroscope's configuration and
    /// range.
    pub const ACC_CONF: u8 = 0x40;
    /// FIFO down-sampling.
    pub const FIFO_DOWNS: u8 = 0x45;
    /// FIFO fill level that raises the interrupt, bytes, 2 bytes.
    pub const FIFO_WTM_0: u8 = 0x46;
    /// FIFO configuration, 2 bytes.
    pub const FIFO_CONFIG_0: u8 = 0x48;
    /// Electrical configuration of the pin INT1.
    pub const INT1_IO_CTRL: u8 = 0x53;
    /// Whether interrupts are latched until they are read.
    pub const INT_LATCH: u8 = 0x55;
    /// Assignment of data interrupts to pins.
    pub const INT_MAP_DATA: u8 = 0x58;
    /// Start of initialisation.
    pub const INIT_CTRL: u8 = 0x59;
    /// Address of the configuration data in words of two bytes, 2 bytes.
    pub const INIT_ADDR_0: u8 = 0x5B;
    /// Configuration data.
    pub const INIT_DATA: u8 = 0x5E;
    /// Gyroscope self test in progress: [`GYRO_TEST_RUNS`](super::GYRO_TEST_RUNS).
    pub const GYR_CRT_CONF: u8 = 0x69;
    /// Accelerometer self test.
    pub const ACC_SELF_TEST: u8 = 0x6D;
    /// Result of the gyroscope's self test.
    pub const GYR_SELF_TEST_AXES: u8 = 0x6E;
    /// Power saving mode.
    pub const PWR_CONF: u8 = 0x7C;
    /// Sensor enables.
    pub const PWR_CTRL: u8 = 0x7D;
    /// Commands.
    pub const CMD: u8 = 0x7E;
}

/// Value of [`register::CHIP_ID`], register 0x00.
pub const CHIP_ID_VALUE: u8 = 0x24;
/// Command: reset, register 0x7E.
pub const SOFT_RESET: u8 = 0xB6;
/// Command: empty the FIFO, register 0x7E.
pub const FIFO_FLUSH: u8 = 0xB0;
/// Temperature, accelerometer and gyroscope on, register 0x7D.
pub const ALL_SENSORS: u8 = 0x0E;
/// Watermark of four frames, register 0x46.
pub const WATERMARK: [u8; 2] = [4 * FRAME_BYTES as u8, 0];
/// Push-pull, active high, output enabled, register 0x53.
pub const INT1_PUSH_PULL_HIGH: u8 = 0x0A;
/// The pin follows the fill level without latching, register 0x55.
pub const NOT_LATCHED: u8 = 0x00;
/// The FIFO's watermark on INT1, register 0x58.
pub const WATERMARK_ON_INT1: u8 = 0x02;
/// Command: start the operation selected in [`register::G_TRIG_1`], register 0x7E.
pub const GYRO_TRIGGER: u8 = 0x02;
/// Selects the self test instead of the sensitivity calibration (bit 0 of the second byte), without
/// abort (its bit 1), with the burst length of a reset (the first byte): registers 0x32 and 0x33 of
/// page 1. Features are written in words of two bytes.
pub const SELECT_GYRO_SELF_TEST: [u8; 2] = [0x00, 0x00];
/// Set before the command, and cleared by the chip at the end of the test, register 0x69.
pub const GYRO_TEST_RUNS: u8 = 0x04;
/// Accelerometer only, register 0x7D.
pub const ACCELEROMETER_ONLY: u8 = 0x04;
/// Advanced power saving off, FIFO self wake-up on, register 0x7C.
pub const NORMAL_POWER: u8 = 0x02;
/// Filtered data into the FIFO, not down-sampled, register 0x45.
pub const FIFO_FILTERED: u8 = 0x88;
/// Overwrite the oldest frame, no sensor time frame; headers, accelerometer and gyroscope,
/// registers 0x48 and 0x49.
pub const FIFO_WITH_HEADERS: [u8; 2] = [0x00, 0xD0];
/// Header of a frame with both sensors, §4 "FIFO".
const BOTH_SENSORS: u8 = 0x8C;
/// Bytes of a frame with both sensors: header, gyroscope, accelerometer, §4 "FIFO".
pub const FRAME_BYTES: usize = 13;
/// Maximum length of the configuration, bytes, §4 "Device initialization".
pub const BLOB_LIMIT: usize = 8192;
/// Ticks of the sensor time in 5 ms; one tick is 39.0625 µs, register 0x18.
pub const TICKS_IN_5_MILLIS: u64 = 128;

impl AccelRange {
    /// The value of the register.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::G2 => 0,
            Self::G4 => 1,
            Self::G8 => 2,
            Self::G16 => 3,
        }
    }

    /// Counts per standard gravity, §1.2.
    #[must_use]
    pub const fn counts_per_g(self) -> f32 {
        match self {
            Self::G2 => 16_384.0,
            Self::G4 => 8_192.0,
            Self::G8 => 4_096.0,
            Self::G16 => 2_048.0,
        }
    }
}

impl GyroRange {
    /// The value of the register.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Dps2000 => 0,
            Self::Dps1000 => 1,
            Self::Dps500 => 2,
            Self::Dps250 => 3,
            Self::Dps125 => 4,
        }
    }

    /// Counts per degree per second, §1.2.
    #[must_use]
    pub const fn counts_per_dps(self) -> f32 {
        match self {
            Self::Dps2000 => 16.4,
            Self::Dps1000 => 32.8,
            Self::Dps500 => 65.6,
            Self::Dps250 => 131.2,
            Self::Dps125 => 262.4,
        }
    }
}

impl Rate {
    /// Code of the chip's output data rate, four times this rate, for both sensors; registers 0x40
    /// and 0x42.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Hz400 => 0x0C,
            Self::Hz200 => 0x0B,
            Self::Hz100 => 0x0A,
        }
    }

    /// Ticks of the sensor time between two samples of the chip.
    #[must_use]
    pub const fn ticks(self) -> u64 {
        match self {
            Self::Hz400 => 16,
            Self::Hz200 => 32,
            Self::Hz100 => 64,
        }
    }
}

/// ACC_CONF, ACC_RANGE, GYR_CONF and GYR_RANGE, with performance filters of normal bandwidth;
/// registers 0x40 to 0x43.
#[must_use]
pub const fn sensor_registers(config: &Config) -> [u8; 4] {
    let rate = config.rate.code();
    [0xA0 | rate, config.accel_range.code(), 0xE0 | rate, config.gyro_range.code()]
}

/// Address of configuration byte `offset`: the word address, low four bits first; registers 0x5B
/// and 0x5C.
#[must_use]
pub const fn init_address(offset: usize) -> [u8; 2] {
    let word = offset / 2;
    [(word & 0x0F) as u8, (word >> 4) as u8]
}

/// The gyroscope's cross-axis factor: a signed number of seven bits, register 0x3C.
#[must_use]
pub const fn cross_axis_factor(register: u8) -> i8 {
    ((register << 1) as i8) >> 1
}

/// Status of the chip: registers 0x18 to 0x25, read in one burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// Free-running time in ticks of 39.0625 µs, 24 bits, register 0x18. The chip samples when it
    /// is a multiple of the sample period.
    pub sensor_time: u32,
    /// The configuration of the accelerometer or gyroscope is invalid, register 0x1B.
    pub configuration_error: bool,
    /// Low four bits of INTERNAL_STATUS, register 0x21: 0 not initialised, 1 running, 2
    /// configuration refused.
    pub start_up: u8,
    /// Die temperature in 1/512 K relative to 23 °C, register 0x22; `None` before the first
    /// measurement.
    pub temperature: Option<i16>,
    /// Fill level of the FIFO, bytes, register 0x24.
    pub fifo_bytes: u16,
}

impl Status {
    /// Value of [`start_up`](Self::start_up) of a running chip.
    pub const RUNNING: u8 = 1;

    /// Decodes the burst.
    #[must_use]
    pub const fn decode(burst: &[u8; 14]) -> Self {
        // The burst covers registers that are not used, because one transfer is cheaper than
        // several.
        let [time0, time1, time2, event, _, _, _, _, _, internal, temp0, temp1, fifo0, fifo1] = *burst;
        let temperature = i16::from_le_bytes([temp0, temp1]);
        Self {
            sensor_time: u32::from_le_bytes([time0, time1, time2, 0]),
            configuration_error: event & 0x1C != 0,
            start_up: internal & 0x0F,
            temperature: if temperature == i16::MIN { None } else { Some(temperature) },
            fifo_bytes: u16::from_le_bytes([fifo0, fifo1 & 0x3F]),
        }
    }

    /// Whether the fill level is a whole number of frames of both sensors. No single wrong bit
    /// changes one such fill level to another.
    #[must_use]
    pub const fn holds_whole_frames(&self) -> bool {
        (self.fifo_bytes as usize).is_multiple_of(FRAME_BYTES)
    }

    /// Die temperature, °C, register 0x22.
    #[must_use]
    pub fn celsius(&self) -> Option<f32> {
        self.temperature.map(|raw| 23.0 + f32::from(raw) / 512.0)
    }
}

/// Decodes four frames of both sensors into accelerometer x, y, z and gyroscope x, y, z, in counts.
///
/// `None` if there is any other frame among them: a skip frame (samples were lost), a frame of one
/// sensor (the other is starting up), a configuration change, the end of the data. §4 "FIFO".
///
/// All other frames are shorter than these, so the bytes after one are out of place. When the FIFO
/// held only whole frames ([`Status::holds_whole_frames`]) and three headers are correct, a single
/// wrong bit in the fourth is therefore a transmission error and is accepted.
#[must_use]
pub fn decode_frames(bytes: &[u8; 4 * FRAME_BYTES], whole: bool) -> Option<[[i16; 6]; 4]> {
    let mut group = [[0; 6]; 4];
    let mut wrong_bits = 0;
    let (frames, _) = bytes.as_chunks::<FRAME_BYTES>();
    for (sample, frame) in group.iter_mut().zip(frames) {
        let (header, values) = decode_frame(frame)?;
        // Bits 1:0 are tags of the interrupt pins, which are not used.
        wrong_bits += ((header ^ BOTH_SENSORS) & 0xFC).count_ones();
        *sample = values;
    }
    (wrong_bits <= u32::from(whole)).then_some(group)
}

fn decode_frame(frame: &[u8; FRAME_BYTES]) -> Option<(u8, [i16; 6])> {
    let [header, gx0, gx1, gy0, gy1, gz0, gz1, ax0, ax1, ay0, ay1, az0, az1] = *frame;
    let gyro = [[gx0, gx1], [gy0, gy1], [gz0, gz1]].map(i16::from_le_bytes);
    let [ax, ay, az] = [[ax0, ax1], [ay0, ay1], [az0, az1]].map(i16::from_le_bytes);
    let [gx, gy, gz] = gyro;
    // The code of a gyroscope without data, register 0x12. A saturated measurement does not have it
    // on all three axes.
    (gyro != [i16::MIN; 3]).then_some((header, [ax, ay, az, gx, gy, gz]))
}

/// Accelerometer x, y, z in counts, from the data registers.
#[must_use]
pub fn decode_acceleration(bytes: &[u8; 6]) -> [i16; 3] {
    let [x0, x1, y0, y1, z0, z1] = *bytes;
    [[x0, x1], [y0, y1], [z0, z1]].map(i16::from_le_bytes)
}

/// Whether the difference between the two deflections, at ±16 g, passes the self test: more than 16
/// g on x, less than −15 g on y, more than 10 g on z, §4 "Sensor self-test".
#[must_use]
pub fn passes_self_test(positive: [i16; 3], negative: [i16; 3]) -> bool {
    let [x, y, z] = core::array::from_fn(|axis| {
        let pick = |side: &[i16; 3]| side.get(axis).map_or(0.0, |counts| f32::from(*counts));
        (pick(&positive) - pick(&negative)) / AccelRange::G16.counts_per_g()
    });
    x > 16.0 && y < -15.0 && z > 10.0
}

/// Result of the gyroscope's self test, register 0x6E: bit 0 is "done", bits 1 to 3 are the axes
/// that passed. `None` while the test runs.
#[must_use]
pub const fn gyro_self_test(axes: u8) -> Option<bool> {
    if axes & 1 == 0 { None } else { Some(axes & 0x0E == 0x0E) }
}

/// Whether the trigger of the gyroscope's test was refused, aborted or not prepared, register 0x38
/// of page 0.
#[must_use]
pub const fn gyro_trigger_failed(status: u8) -> bool {
    status & 0x38 != 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gyroscope_passes_with_three_axes_and_when_it_is_done() {
        assert_eq!([0x00, 0x0E, 0x01, 0x0D, 0x0F, 0xFF].map(gyro_self_test), {
            [None, None, Some(false), Some(false), Some(true), Some(true)]
        });
    }

    #[test]
    fn the_default_configuration_is_what_the_registers_say() {
        // ODR 1600 Hz, normal bandwidth, performance filter; ±8 g; the same with low noise; ±2000
        // °/s.
        assert_eq!(sensor_registers(&Config::default()), [0xAC, 0x02, 0xEC, 0x00]);
    }

    #[test]
    fn words_are_addressed_in_four_and_eight_bits() {
        assert_eq!(init_address(0), [0x00, 0x00]);
        assert_eq!(init_address(256), [0x00, 0x08]);
        assert_eq!(init_address(8190), [0x0F, 0xFF]);
    }

    #[test]
    fn the_cross_axis_factor_has_seven_bits_and_a_sign() {
        assert_eq!([0x00, 0x3F, 0x40, 0x7F, 0x80].map(cross_axis_factor), [0, 63, -64, -1, 0]);
    }

    #[test]
    fn the_status_burst_is_taken_apart() {
        let mut burst = [0; 14];
        burst[..3].copy_from_slice(&[0x10, 0x32, 0x54]);
        burst[9] = 0x61;
        burst[10..12].copy_from_slice(&[0x00, 0x02]);
        burst[12..].copy_from_slice(&[0x34, 0xC1]);
        let status = Status::decode(&burst);
        assert_eq!(status.sensor_time, 0x54_32_10);
        assert_eq!(status.start_up, Status::RUNNING);
        assert_eq!(status.celsius(), Some(24.0));
        assert_eq!(status.fifo_bytes, 0x134, "two reserved bits are ignored");
        burst[3] = 0x04;
        burst[10..12].copy_from_slice(&[0x00, 0x80]);
        assert_eq!(Status::decode(&burst).celsius(), None, "0x8000 is no temperature");
        assert!(Status::decode(&burst).configuration_error);
    }

    #[test]
    fn only_four_whole_frames_are_a_group() {
        let mut bytes = [0u8; 52];
        for (number, frame) in bytes.chunks_mut(13).enumerate() {
            frame[0] = 0x8C;
            frame[1..7].copy_from_slice(&[number as u8, 0, 0xFF, 0xFF, 0x00, 0x80]);
            frame[7..13].copy_from_slice(&[1, 0, 2, 0, 0, 0x10]);
        }
        let group = decode_frames(&bytes, false).expect("four frames");
        assert_eq!(group[3], [1, 2, 4096, 3, -1, i16::MIN]);
        for header in [0x40, 0x44, 0x48, 0x80, 0x84, 0x88, 0x00, 0xFF] {
            let mut other = bytes;
            other[26] = header;
            assert_eq!(decode_frames(&other, false), None, "{header:#04x}");
            let one_bit = matches!(header, 0x84 | 0x88);
            assert_eq!(decode_frames(&other, true), one_bit.then_some(group), "{header:#04x}");
        }
        let mut twice = bytes;
        (twice[0], twice[26]) = (0x84, 0x84);
        assert_eq!(decode_frames(&twice, true), None, "two wrong bits are no accident");
        bytes[1..7].copy_from_slice(&[0x00, 0x80, 0x00, 0x80, 0x00, 0x80]);
        assert_eq!(decode_frames(&bytes, true), None, "a gyroscope that is starting up");
    }

    #[test]
    fn no_wrong_bit_makes_a_believable_fill_level() {
        let held = |fifo_bytes| Status { fifo_bytes, ..Status::decode(&[0; 14]) }.holds_whole_frames();
        for frames in 0..157u16 {
            let bytes = frames * FRAME_BYTES as u16;
            assert!(held(bytes) && (0..14).all(|bit| !held(bytes ^ 1 << bit)), "{bytes}");
        }
    }

    #[test]
    fn the_self_test_has_a_limit_on_every_axis() {
        let g = |x: f32, y: f32, z: f32| [x, y, z].map(|g| (g * 2048.0) as i16);
        assert!(passes_self_test(g(9.0, -8.0, 6.0), g(-8.0, 8.0, -5.0)));
        assert!(!passes_self_test(g(7.0, -8.0, 6.0), g(-8.0, 8.0, -5.0)));
        assert!(!passes_self_test(g(9.0, -6.0, 6.0), g(-8.0, 8.0, -5.0)));
        assert!(!passes_self_test(g(9.0, -8.0, 4.0), g(-8.0, 8.0, -5.0)));
        assert!(!passes_self_test([0; 3], [0; 3]));
    }
}
