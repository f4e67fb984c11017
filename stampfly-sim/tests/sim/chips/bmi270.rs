//! BMI270 after Bosch BST-BMI270-DS000.

use super::wait;
use crate::standing;
use embedded_hal::i2c::I2c;
use embedded_hal::spi::SpiDevice;
use stampfly_sim::Simulation;
use stampfly_sim::chips::{Attached, Bmi270, I2cBus, SpiBus, SpiPort};

/// A placeholder for the manufacturer's file, in which no two bursts are equal.
fn image() -> Vec<u8> {
    (0..8_192u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
}

pub struct Chip {
    pub simulation: Simulation,
    pub port: SpiPort<Bmi270>,
    pub attached: Attached,
}

impl Chip {
    /// After power-on.
    pub fn cold() -> Self {
        let simulation = standing();
        let chip = Bmi270::new(&simulation.world, &simulation.clock, 1, 1.0, &image());
        let (port, attached) = SpiBus::new(&simulation.clock, 1).attach(8_000_000, chip);
        Self { simulation, port, attached }
    }

    /// After start-up, on SPI.
    fn started() -> Self {
        let mut chip = Self::cold();
        chip.wait(2_000);
        chip.read::<1>(0);
        chip
    }

    /// With the image uploaded and checked.
    fn initialised() -> Self {
        let mut chip = Self::started();
        chip.write(0x7C, 0);
        chip.wait(450);
        chip.upload();
        chip.wait(20_000);
        assert_eq!(chip.read(0x21), [1]);
        chip
    }

    /// All sensors at 1600 Hz, ±8 g and ±2000 °/s, both in the FIFO.
    pub fn running() -> Self {
        let mut chip = Self::initialised();
        for (register, value) in [(0x40, 0xAC), (0x41, 2), (0x42, 0xAC), (0x43, 0), (0x49, 0xD0), (0x7D, 0x0E)] {
            chip.write(register, value);
            chip.wait(2);
        }
        chip
    }

    pub fn wait(&self, microseconds: u64) {
        wait(&self.simulation, microseconds);
    }

    pub fn read<const N: usize>(&mut self, register: u8) -> [u8; N] {
        let mut bytes = vec![0; N + 2];
        bytes[0] = register | 0x80;
        self.port.transfer_in_place(&mut bytes).unwrap();
        bytes[2..].try_into().unwrap()
    }

    pub fn read_fifo(&mut self, length: usize) -> Vec<u8> {
        let mut bytes = vec![0; length + 2];
        bytes[0] = 0xA6;
        self.port.transfer_in_place(&mut bytes).unwrap();
        bytes.split_off(2)
    }

    fn fifo_length(&mut self) -> usize {
        usize::from(u16::from_le_bytes(self.read(0x24)))
    }

    pub fn write(&mut self, register: u8, value: u8) {
        self.port.write(&[register, value]).unwrap();
    }

    /// The upload in bursts of 256 bytes.
    fn upload(&mut self) {
        self.write(0x59, 0);
        self.wait(2);
        for (burst, bytes) in image().chunks(256).enumerate() {
            let words = burst * 128;
            self.port.write(&[0x5B, (words & 0x0F) as u8, (words >> 4) as u8]).unwrap();
            self.wait(2);
            self.port.write(&[&[0x5E], bytes].concat()).unwrap();
            self.wait(2);
        }
        self.write(0x59, 1);
        self.wait(2);
    }
}

fn word(bytes: &[u8], place: usize) -> f64 {
    f64::from(i16::from_le_bytes([bytes[2 * place], bytes[2 * place + 1]]))
}

#[test]
fn the_first_transfer_only_chooses_spi() {
    let mut chip = Chip::cold();
    chip.wait(2_000);
    assert_ne!(chip.read(0), [0x24]);
    assert_eq!(chip.read(0), [0x24]);
    // One byte earlier is the dummy byte.
    let mut bytes = [0x80, 0];
    chip.port.transfer_in_place(&mut bytes).unwrap();
    assert_eq!(bytes[1], 0);
    chip.attached.set_id(0x43);
    assert_eq!(chip.read(0), [0x43]);
}

#[test]
fn registers_after_power_on() {
    let mut chip = Chip::started();
    assert_eq!(chip.read(0x1B), [1], "power-on");
    assert_eq!(chip.read(0x1B), [0], "told once");
    assert_eq!(chip.read(0x03), [0x10]);
    assert_eq!(chip.read(0x21), [0]);
    assert_eq!(chip.read(0x22), [0, 0x80]);
    assert_eq!(chip.read(0x40), [0xA8, 0x02, 0xA9, 0x00]);
    assert_eq!(chip.read(0x48), [0x02, 0x10]);
    assert_eq!(chip.read(0x7C), [3, 0]);
}

#[test]
fn the_upload_needs_power_order_and_every_byte() {
    // In advanced power save the upload is ignored.
    let mut chip = Chip::started();
    chip.upload();
    chip.wait(150_000);
    assert_eq!(chip.read(0x21), [0]);

    // Correct sequence: the result takes some time.
    chip.write(0x7C, 0);
    chip.wait(450);
    chip.upload();
    assert_eq!(chip.read(0x21), [0]);
    chip.wait(20_000);
    assert_eq!(chip.read(0x21), [1]);

    // Without addresses every burst overwrites the first.
    chip.write(0x59, 0);
    chip.wait(2);
    for bytes in image().chunks(256) {
        chip.port.write(&[0x5B, 0, 0]).unwrap();
        chip.wait(2);
        chip.port.write(&[&[0x5E], bytes].concat()).unwrap();
        chip.wait(2);
    }
    chip.write(0x59, 1);
    chip.wait(20_000);
    assert_eq!(chip.read(0x21), [2]);
}

#[test]
fn writes_in_power_save_need_their_pause() {
    let mut chip = Chip::started();
    chip.write(0x41, 1);
    chip.write(0x43, 1);
    chip.wait(450);
    assert_eq!((chip.read(0x41), chip.read(0x43)), ([1], [0]), "the second one came too early");
    chip.write(0x43, 1);
    chip.wait(450);
    assert_eq!(chip.read(0x43), [1]);
}

#[test]
fn nothing_is_measured_before_the_upload() {
    let mut chip = Chip::started();
    chip.write(0x7C, 0);
    chip.wait(450);
    chip.write(0x7D, 0x0E);
    chip.wait(100_000);
    assert_eq!(chip.read(0x0C), [0; 12]);
    assert_eq!(chip.read(0x03), [0x10]);
}

#[test]
fn at_rest_it_reads_gravity_upside_down_to_the_body() {
    let mut chip = Chip::running();
    chip.wait(1_000);
    assert_eq!(chip.read(0x12), [0; 6], "the gyroscope is not up yet");
    chip.wait(99_000);
    let [status] = chip.read(0x03);
    assert_eq!(status, 0xD0);
    chip.read::<12>(0x0C);
    assert_eq!(chip.read(0x03).map(|status| status & 0xC0), [0], "reading clears");
    let mut mean = [0.0; 6];
    for _ in 0..400 {
        chip.wait(700);
        let data: [u8; 12] = chip.read(0x0C);
        mean.iter_mut().enumerate().for_each(|(place, mean)| *mean += word(&data, place) / 400.0);
    }
    let (accel_bias, gyro_bias) = chip.simulation.sensors.imu.bias();
    // Chip axes: body y, body x, minus body z.
    let accel = [accel_bias.y, accel_bias.x, 9.806_65 - accel_bias.z].map(|si| f64::from(si) / 9.806_65 * 4_096.0);
    let gyro = [gyro_bias.y, gyro_bias.x, -gyro_bias.z].map(|si| f64::from(si).to_degrees() * 16.4);
    for place in 0..3 {
        assert!((mean[place] - accel[place]).abs() < 30.0, "accelerometer {place}: {mean:?} {accel:?}");
        assert!((mean[place + 3] - gyro[place]).abs() < 1.0, "gyroscope {place}: {mean:?} {gyro:?}");
    }
    let temperature = f64::from(i16::from_le_bytes(chip.read(0x22))) / 512.0 + 23.0;
    assert!((25.0..26.0).contains(&temperature), "{temperature}");
}

#[test]
fn ranges_scale_the_counts() {
    let mut chip = Chip::running();
    for (range, counts) in [(0, 16_384.0), (1, 8_192.0), (2, 4_096.0), (3, 2_048.0)] {
        chip.write(0x41, range);
        chip.wait(10_000);
        let z = word(&chip.read::<6>(0x0C), 2);
        assert!((z / counts - 1.0).abs() < 0.06, "range {range}: {z}");
    }
}

#[test]
fn the_fifo_holds_every_sample_of_both() {
    let mut chip = Chip::running();
    chip.wait(100_000);
    chip.write(0x7E, 0xB0);
    chip.wait(50_000);
    let length = chip.fifo_length();
    assert_eq!(length % 13, 0);
    assert!((78..=82).contains(&(length / 13)), "50 ms at 1600 Hz: {length}");
    let bytes = chip.read_fifo(length);
    for frame in bytes.chunks(13) {
        assert_eq!(frame[0], 0x8C);
        assert!((word(&frame[1..], 5) / 4_096.0 - 1.0).abs() < 0.06, "gyroscope first, accelerometer z last");
    }
    assert!(chip.fifo_length() <= 13);
}

#[test]
fn a_frame_read_in_part_comes_again_and_the_end_is_marked() {
    let mut chip = Chip::running();
    chip.wait(100_000);
    chip.write(0x7E, 0xB0);
    chip.wait(2_000);
    let two = chip.read_fifo(20);
    let again = chip.read_fifo(13);
    assert_eq!(two[13..], again[..7]);
    let before = chip.fifo_length();
    let rest = chip.read_fifo(before + 6);
    assert_eq!(rest[before], 0x44, "time of the chip: {rest:?}");
    assert_eq!(rest[before + 4..], [0x80, 0x80]);
}

#[test]
fn a_full_fifo_gives_up_the_oldest_and_says_so() {
    let mut chip = Chip::running();
    chip.wait(300_000);
    let length = chip.fifo_length();
    assert!((2_030..=2_048).contains(&length), "{length}");
    let bytes = chip.read_fifo(15);
    assert_eq!((bytes[0], bytes[2]), (0x40, 0x8C));
    assert!(bytes[1] > 100, "{} lost", bytes[1]);
    // In stop-on-full mode the oldest frames are kept.
    chip.write(0x48, 1);
    chip.wait(2);
    chip.write(0x7E, 0xB0);
    chip.wait(300_000);
    assert_eq!((chip.fifo_length(), chip.read_fifo(1)), (2_041, vec![0x8C]));
}

#[test]
fn slower_rates_and_refused_ones() {
    let mut chip = Chip::running();
    for (register, value) in [(0x40, 0xA8), (0x42, 0xA8)] {
        chip.write(register, value);
        chip.wait(2);
    }
    chip.wait(100_000);
    chip.write(0x7E, 0xB0);
    chip.wait(200_000);
    let frames = chip.fifo_length() / 13;
    assert!((19..=21).contains(&frames), "100 Hz: {frames}");
    chip.write(0x42, 0xA1);
    chip.wait(2);
    assert_eq!(chip.read(0x1B).map(|event| event >> 2 & 7), [2], "no such rate for the gyroscope");
}

#[test]
fn a_soft_reset_forgets_everything_and_returns_to_i2c() {
    let mut chip = Chip::running();
    chip.wait(100_000);
    chip.write(0x7E, 0xB6);
    chip.wait(2_000);
    assert_ne!(chip.read(0), [0x24], "lost");
    assert_eq!(chip.read(0), [0x24]);
    assert_eq!((chip.read(0x21), chip.read(0x7C), chip.fifo_length()), ([0], [3, 0], 0));
    // The same after a dip of the supply.
    let mut chip = Chip::running();
    chip.attached.reset();
    chip.wait(5_000);
    chip.read::<1>(0);
    assert_eq!((chip.read(0x0C), chip.read(0x21)), ([0; 12], [0]));
}

/// Mean of 40 accelerometer samples, g, after the 50 ms that a self-test needs.
fn accel_at_16_g(chip: &mut Chip, self_test: u8, pause: u64) -> [f64; 3] {
    chip.write(0x6D, self_test);
    chip.wait(pause);
    let mut mean = [0.0; 3];
    for _ in 0..40 {
        chip.wait(640);
        let data: [u8; 6] = chip.read(0x0C);
        mean.iter_mut().enumerate().for_each(|(place, mean)| *mean += word(&data, place) / 2_048.0 / 40.0);
    }
    mean
}

#[test]
fn the_self_test_moves_the_mass_both_ways_along_every_axis() {
    let difference = |range: u8, size: u8, pause: u64, broken: bool| {
        let mut chip = Chip::running();
        chip.attached.set_broken(broken);
        chip.write(0x41, range);
        chip.wait(3_000);
        let still = accel_at_16_g(&mut chip, 0, 50_000);
        let [positive, negative] = [0x05, 0x01].map(|sign| accel_at_16_g(&mut chip, size | sign, pause));
        let after = accel_at_16_g(&mut chip, 0, 50_000);
        assert!(still.iter().zip(after).all(|(still, after)| (still - after).abs() < 0.01), "{still:?} {after:?}");
        [0, 1, 2].map(|axis| positive[axis] - negative[axis])
    };
    let passes = |[x, y, z]: [f64; 3]| x > 16.0 && y < -15.0 && z > 10.0;
    let right = difference(3, 0x08, 50_000, false);
    assert!(passes(right), "{right:?}");
    assert!(!passes(difference(3, 0x08, 50_000, true)), "nothing moves");
    assert!(!passes(difference(3, 0x00, 50_000, false)), "the small amplitude");
    // At ±8 g a count is half as large, and the extremes saturate.
    assert!(!passes(difference(2, 0x08, 50_000, false).map(|g| g / 2.0)), "beyond the range");
    assert!(!passes(difference(3, 0x08, 2_000, false)), "too early");
}

#[test]
fn the_gyroscope_tests_itself_on_command() {
    for broken in [false, true] {
        let mut chip = Chip::started();
        chip.attached.set_broken(broken);
        chip.write(0x7E, 0x02);
        chip.wait(200_000);
        assert_eq!(chip.read(0x6E), [0], "without the image there is nobody to test");
        chip.write(0x7C, 0);
        chip.wait(450);
        chip.upload();
        chip.wait(20_000);
        let preparation = [(0x69, 0x04), (0x7D, 0x04), (0x2F, 1), (0x32, 0), (0x33, 0)];
        let test = |chip: &mut Chip, preparation: &[(u8, u8)]| {
            for (register, value) in preparation.iter().chain(&[(0x7E, 0x02)]) {
                chip.write(*register, *value);
                chip.wait(2);
            }
        };
        test(&mut chip, &preparation);
        chip.wait(50_000);
        assert_eq!((chip.read(0x6E), chip.read(0x69)), ([0], [4]), "running");
        chip.wait(50_000);
        assert_eq!((chip.read(0x6E), chip.read(0x69)), ([if broken { 1 } else { 0x0F }], [0]));
        chip.write(0x2F, 0);
        chip.wait(2);
        assert_eq!(chip.read(0x38), [0], "carried out");
        // Not announced, gyroscope on, retrimming, aborted, in bursts.
        for (place, other) in [(0, (0x69, 0)), (1, (0x7D, 0x06)), (4, (0x33, 1)), (4, (0x33, 2)), (3, (0x32, 8))] {
            let mut wrong = preparation;
            wrong[place] = other;
            test(&mut chip, &wrong);
            chip.write(0x2F, 0);
            chip.wait(200_000);
            assert_eq!((chip.read(0x6E), chip.read(0x38)), ([0], [0x08]), "{other:02x?}");
        }
    }
}

#[test]
fn over_i2c_it_answers_without_a_byte_of_no_meaning() {
    let simulation = standing();
    let mut bus = I2cBus::new(&simulation.clock, 1);
    bus.attach(0x68, Bmi270::new(&simulation.world, &simulation.clock, 1, 1.0, &image()));
    wait(&simulation, 2_000);
    let mut write = |bytes: &[u8]| {
        I2c::write(&mut bus, 0x68, bytes).unwrap();
        wait(&simulation, 450);
    };
    write(&[0x7C, 0]);
    write(&[0x59, 0]);
    for (burst, bytes) in image().chunks(256).enumerate() {
        write(&[0x5B, ((burst * 128) & 0x0F) as u8, (burst * 8) as u8]);
        write(&[&[0x5E], bytes].concat());
    }
    write(&[0x59, 1]);
    wait(&simulation, 20_000);
    for (register, value) in [(0x40, 0xAC), (0x42, 0xAC), (0x49, 0xD0), (0x7D, 0x0E)] {
        I2c::write(&mut bus, 0x68, &[register, value]).unwrap();
    }
    wait(&simulation, 100_000);
    I2c::write(&mut bus, 0x68, &[0x7E, 0xB0]).unwrap();
    wait(&simulation, 5_000);
    let mut read = |register: u8| {
        let mut bytes = [0; 13];
        bus.write_read(0x68, &[register], &mut bytes).unwrap();
        bytes
    };
    assert_eq!((read(0)[0], read(0x21)[0]), (0x24, 1));
    assert!((word(&read(0x0C), 2) / 4_096.0 - 1.0).abs() < 0.06, "gravity");
    let frame = read(0x26);
    assert!(frame[0] == 0x8C && (word(&frame[1..], 5) / 4_096.0 - 1.0).abs() < 0.06, "{frame:?}");
}

#[test]
fn a_read_that_a_sample_falls_into_sees_one_of_the_two() {
    let mut chip = Chip::running();
    chip.wait(100_000);
    // At 8 MHz the data take 14 µs; occasionally a sample falls into the read.
    let (mut before, mut changes) = ([0; 12], 0);
    for _ in 0..4_000 {
        let data: [u8; 12] = chip.read(0x0C);
        if data != before {
            changes += 1;
            assert!(before == [0; 12] || (before[..6] != data[..6] && before[6..] != data[6..]), "{before:?} {data:?}");
        }
        before = data;
    }
    assert!(changes > 80, "56 ms: {changes}");
}
