//! BMP280 after BST-BMP280-DS001, with the integer compensation of section 3.11.3; the emulator
//! inverts the floating-point one of section 8.1.

use super::wait;
use crate::compensation::bmp280 as compensate;
use crate::standing;
use embedded_hal::i2c::I2c;
use embedded_hal::spi::{Operation, SpiDevice};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{Bmp280, I2cBus, SpiBus, SpiPort};

const ADDRESS: u8 = 0x76;
/// Normal mode, pressure ×4, temperature ×2; 62.5 ms of standby, filter 4.
const NORMAL: u8 = 0b010_011_11;
const SLOW_FILTERED: u8 = 0b001_010_00;

fn chip() -> (Simulation, I2cBus) {
    let simulation = standing();
    let bus = I2cBus::new(&simulation.clock, 1);
    bus.attach(ADDRESS, Bmp280::new(&simulation.world, &simulation.clock, 1));
    wait(&simulation, 2_000);
    (simulation, bus)
}

fn read<const N: usize>(bus: &mut I2cBus, register: u8) -> [u8; N] {
    let mut bytes = [0; N];
    bus.write_read(ADDRESS, &[register], &mut bytes).unwrap();
    bytes
}

fn write(bus: &mut I2cBus, bytes: &[u8]) {
    bus.write(ADDRESS, bytes).unwrap();
}

#[test]
fn identity_and_reset_state() {
    let (_, mut bus) = chip();
    assert_eq!(read(&mut bus, 0xD0), [0x58]);
    assert_eq!(read(&mut bus, 0xF3), [0, 0, 0], "status, control, configuration");
    assert_eq!(read(&mut bus, 0xF7), [0x80, 0, 0, 0x80, 0, 0]);
    assert_eq!(read(&mut bus, 0xE0), [0]);
}

#[test]
fn the_data_sheets_example_comes_out_of_the_formula() {
    let (_, mut bus) = chip();
    let calibration = read(&mut bus, 0x88);
    let data = [415_148u32, 519_888].map(|adc| (adc << 4).to_be_bytes());
    let data = [data[0][1], data[0][2], data[0][3], data[1][1], data[1][2], data[1][3]];
    let (temperature, pressure) = compensate(&calibration, &data);
    assert_eq!(temperature, 25.08);
    assert!((pressure - 100_653.25).abs() < 0.05, "{pressure}");
}

#[test]
fn a_forced_conversion_shows_its_progress_and_ends_in_sleep() {
    let (simulation, mut bus) = chip();
    let calibration = read(&mut bus, 0x88);
    write(&mut bus, &[0xF4, 0b001_001_01]);
    assert_eq!(read(&mut bus, 0xF3), [8, 0b001_001_01], "converting");
    assert_eq!(read(&mut bus, 0xF7), [0x80, 0, 0, 0x80, 0, 0], "too early: still the reset value");
    wait(&simulation, 6_000);
    assert_eq!(read(&mut bus, 0xF3), [0, 0b001_001_00]);
    let data: [u8; 6] = read(&mut bus, 0xF7);
    assert_eq!((data[2], data[5]), (0, 0), "16 bits without oversampling");
    let (temperature, pressure) = compensate(&calibration, &data);
    assert!((temperature - 25.0).abs() < 0.05, "{temperature}");
    assert!((pressure - 101_000.0).abs() < 250.0, "{pressure}");
    wait(&simulation, 500_000);
    assert_eq!(read(&mut bus, 0xF7), data, "asleep");
}

#[test]
fn normal_mode_converts_at_its_rate_and_follows_the_world() {
    let (simulation, mut bus) = chip();
    let calibration = read(&mut bus, 0x88);
    write(&mut bus, &[0xF5, SLOW_FILTERED, 0xF4, NORMAL]);
    let (mut changes, mut before) = (0, read::<6>(&mut bus, 0xF7));
    let mut sum = 0.0;
    for _ in 0..10_000 {
        wait(&simulation, 1_000);
        let data = read(&mut bus, 0xF7);
        if data != before {
            changes += 1;
            sum += compensate(&calibration, &data).1;
        }
        before = data;
    }
    // 13.5 ms of conversion and 62.5 ms of standby, within 2 %; each poll takes 1.2 ms.
    assert!((143..=166).contains(&changes), "{changes} in 12.1 s");
    let mean = sum / f64::from(changes);
    assert!((mean - 101_000.0).abs() < 250.0, "{mean}");
}

#[test]
fn the_settings_of_normal_mode_wait_for_sleep() {
    let (simulation, mut bus) = chip();
    write(&mut bus, &[0xF4, NORMAL]);
    write(&mut bus, &[0xF5, SLOW_FILTERED]);
    assert_eq!(read(&mut bus, 0xF5), [0], "ignored");
    write(&mut bus, &[0xF4, 0]);
    assert_eq!(read(&mut bus, 0xF3), [8, NORMAL], "sleep begins when the conversion ends");
    wait(&simulation, 15_000);
    assert_eq!(read(&mut bus, 0xF3), [0, 0]);
    write(&mut bus, &[0xF5, SLOW_FILTERED]);
    assert_eq!(read(&mut bus, 0xF5), [SLOW_FILTERED]);
}

#[test]
fn a_burst_sees_one_conversion() {
    let (simulation, mut bus) = chip();
    // Standby 0.5 ms and single samples: a conversion about every 6 ms.
    write(&mut bus, &[0xF4, 0b001_001_11]);
    wait(&simulation, 6_000);
    let first: [u8; 6] = read(&mut bus, 0xF7);
    let mut torn = 0;
    for _ in 0..400 {
        wait(&simulation, 900);
        let mut parts = [0; 6];
        for (register, part) in (0xF7..).zip(parts.iter_mut()) {
            [*part] = read(&mut bus, register);
        }
        let whole: [u8; 6] = read(&mut bus, 0xF7);
        torn += u32::from(parts != whole);
    }
    assert!(torn > 10, "byte by byte mixes conversions: {torn}");
    assert_eq!(first[2] & 0x0F, 0);
}

#[test]
fn a_soft_reset_takes_its_time() {
    let (simulation, mut bus) = chip();
    write(&mut bus, &[0xF5, SLOW_FILTERED, 0xF4, NORMAL]);
    wait(&simulation, 100_000);
    write(&mut bus, &[0xE0, 0xB5]);
    assert_eq!(read(&mut bus, 0xF4), [NORMAL, SLOW_FILTERED], "only 0xB6 resets");
    write(&mut bus, &[0xE0, 0xB6]);
    assert_eq!(read(&mut bus, 0xF3), [1, 0, 0], "copying the calibration");
    assert_eq!(read(&mut bus, 0x88), [0, 0], "which is not there yet");
    write(&mut bus, &[0xF4, NORMAL]);
    wait(&simulation, 2_000);
    assert_eq!(read(&mut bus, 0xF3), [0, 0, 0], "what was written too early is lost");
    assert_eq!(read(&mut bus, 0x88), 27_504u16.to_le_bytes());
}

#[test]
fn a_quantity_that_is_not_measured_keeps_its_mark() {
    let (simulation, mut bus) = chip();
    write(&mut bus, &[0xF4, 0b001_000_01]);
    wait(&simulation, 4_000);
    let data: [u8; 6] = read(&mut bus, 0xF7);
    assert_eq!(data[..3], [0x80, 0, 0]);
    assert_ne!(data[3..], [0x80, 0, 0]);
}

/// An SPI transfer: bytes written, then number of bytes read.
fn transfer<const N: usize>(port: &mut SpiPort<Bmp280>, out: &[u8]) -> [u8; N] {
    let mut bytes = [0; N];
    port.transaction(&mut [Operation::Write(out), Operation::Read(&mut bytes)]).unwrap();
    bytes
}

#[test]
fn on_spi_seven_bits_are_the_address_and_data_follow_at_once() {
    let simulation = standing();
    let chip = Bmp280::new(&simulation.world, &simulation.clock, 1);
    let (mut port, _) = SpiBus::new(&simulation.clock, 1).attach(10_000_000, chip);
    wait(&simulation, 2_000);
    assert_eq!(transfer(&mut port, &[0xD0]), [0x58]);
    assert_eq!(transfer(&mut port, &[0x50]), [0xFF], "a write of nothing");
    let calibration = transfer(&mut port, &[0x88]);
    // 5.3.1: pairs of address and value without raising CSB.
    port.transaction(&mut [Operation::Write(&[0x75, 0b000_010_00, 0x74, 0b001_001_01])]).unwrap();
    assert_eq!(transfer(&mut port, &[0xF3]), [8, 0b001_001_01, 0b000_010_00], "converting");
    wait(&simulation, 6_500);
    let (temperature, pressure) = compensate(&calibration, &transfer(&mut port, &[0xF7]));
    assert!((90_000.0..110_000.0).contains(&pressure) && (0.0..50.0).contains(&temperature));
    port.transaction(&mut [Operation::Write(&[0x75, 1])]).unwrap();
    assert_eq!(transfer(&mut port, &[0xD0]), [0xFF], "three wires: SDO is silent");
}
