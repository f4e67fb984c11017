//! BMM150 after Bosch BST-BMM150-DS001, with the compensation of Bosch's Sensor API.

use super::wait;
use crate::compensation::bmm150 as compensate;
use crate::standing;
use embedded_hal::i2c::I2c;
use embedded_hal::spi::{Operation, SpiDevice};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{Attached, Bmm150, I2cBus, SpiBus, SpiPort};

const ADDRESS: u8 = 0x10;

/// A powered chip in suspend.
fn chip() -> (Simulation, I2cBus, Attached) {
    let simulation = standing();
    let bus = I2cBus::new(&simulation.clock, 1);
    let attached = bus.attach(ADDRESS, Bmm150::new(&simulation.world, &simulation.clock, 1));
    (simulation, bus, attached)
}

fn awake() -> (Simulation, I2cBus) {
    let (simulation, mut bus, _) = chip();
    write(&mut bus, 0x4B, 1);
    wait(&simulation, 3_000);
    (simulation, bus)
}

fn read<const N: usize>(bus: &mut I2cBus, register: u8) -> [u8; N] {
    let mut bytes = [0; N];
    bus.write_read(ADDRESS, &[register], &mut bytes).unwrap();
    bytes
}

fn write(bus: &mut I2cBus, register: u8, value: u8) {
    bus.write(ADDRESS, &[register, value]).unwrap();
}

#[test]
fn in_suspend_only_the_power_register_answers() {
    let (simulation, mut bus, _) = chip();
    wait(&simulation, 10_000);
    assert_eq!((read(&mut bus, 0x40), read(&mut bus, 0x4B)), ([0], [0]));
    write(&mut bus, 0x4B, 1);
    assert_eq!((read(&mut bus, 0x40), read(&mut bus, 0x4B)), ([0], [1]), "waking");
    wait(&simulation, 3_000);
    assert_eq!((read(&mut bus, 0x40), read(&mut bus, 0x4C)), ([0x32], [0x06]), "asleep");
    write(&mut bus, 0x4B, 0);
    assert_eq!(read(&mut bus, 0x40), [0]);
}

#[test]
fn a_forced_conversion_takes_its_time_and_ends_in_sleep() {
    let (simulation, mut bus) = awake();
    write(&mut bus, 0x51, 4);
    write(&mut bus, 0x52, 14);
    write(&mut bus, 0x4C, 0x02);
    // 145 µs · 9 + 500 µs · 15 + 980 µs = 9.8 ms, within 2 %.
    wait(&simulation, 9_000);
    assert_eq!(read(&mut bus, 0x48).map(|byte| byte & 1), [0]);
    wait(&simulation, 1_000);
    let data: [u8; 8] = read(&mut bus, 0x42);
    assert_eq!((data[6] & 1, read(&mut bus, 0x4C)), (1, [0x06]));
    assert_eq!(read(&mut bus, 0x48).map(|byte| byte & 1), [0], "taken");
    wait(&simulation, 100_000);
    let again: [u8; 8] = read(&mut bus, 0x42);
    assert_eq!(again[..6], data[..6]);
}

#[test]
fn normal_mode_measures_the_field_at_its_rate() {
    let (simulation, mut bus) = awake();
    let trim = read(&mut bus, 0x5D);
    write(&mut bus, 0x51, 4);
    write(&mut bus, 0x52, 14);
    write(&mut bus, 0x4C, 6 << 3);
    let (mut fresh, mut sum) = (0, [0.0; 3]);
    for _ in 0..4_000 {
        wait(&simulation, 1_722);
        let data: [u8; 8] = read(&mut bus, 0x42);
        if data[6] & 1 != 0 {
            fresh += 1;
            sum.iter_mut().zip(compensate(&trim, &data)).for_each(|(sum, value)| *sum += value);
        }
    }
    // 8 s at 25 Hz of the chip's clock.
    assert!((195..=205).contains(&fresh), "{fresh}");
    let mean = sum.map(|sum| sum / f64::from(fresh));
    // The model of the same specimen; body is (−y, x, z) of the chip.
    let hard_iron = simulation.sensors.mag.hard_iron();
    let expected = [-4.3 + hard_iron.y, -30.8 - hard_iron.x, 36.4 + hard_iron.z].map(f64::from);
    for (axis, (mean, expected)) in mean.iter().zip(expected).enumerate() {
        assert!((mean - expected).abs() < 1.0, "axis {axis}: {mean} {expected}");
    }
}

#[test]
fn too_many_repetitions_slow_the_rate_down() {
    let (simulation, mut bus) = awake();
    write(&mut bus, 0x52, 255);
    write(&mut bus, 0x4C, 6 << 3);
    let mut fresh = 0;
    for _ in 0..1_000 {
        wait(&simulation, 1_000);
        fresh += u32::from(read::<8>(&mut bus, 0x42)[6] & 1);
    }
    assert!((8..=10).contains(&fresh), "129 ms each: {fresh}");
}

#[test]
fn a_soft_reset_wants_both_bits_and_ends_in_sleep() {
    let (simulation, mut bus) = awake();
    write(&mut bus, 0x51, 4);
    write(&mut bus, 0x4B, 0x81);
    assert_eq!(read(&mut bus, 0x51), [4], "one bit is not enough");
    write(&mut bus, 0x4B, 0x83);
    wait(&simulation, 3_000);
    assert_eq!((read(&mut bus, 0x51), read(&mut bus, 0x4B), read(&mut bus, 0x40)), ([0], [1], [0x32]));
}

#[test]
fn the_self_test_marks_the_axes_and_clears_its_bit() {
    for broken in [false, true] {
        let (simulation, mut bus, attached) = chip();
        attached.set_broken(broken);
        write(&mut bus, 0x4B, 1);
        wait(&simulation, 3_000);
        write(&mut bus, 0x4C, 0x07);
        assert_eq!(read(&mut bus, 0x4C), [0x07], "running");
        wait(&simulation, 2_000);
        assert_eq!(read(&mut bus, 0x4C), [0x06]);
        let data: [u8; 5] = read(&mut bus, 0x42);
        assert_eq!([0, 2, 4].map(|place| data[place] & 1), [u8::from(!broken); 3]);
    }
    // Only in sleep mode.
    let (simulation, mut bus) = awake();
    write(&mut bus, 0x4C, 0x01);
    wait(&simulation, 2_000);
    assert_eq!(read::<5>(&mut bus, 0x42)[0] & 1, 0);
}

#[test]
fn the_advanced_self_test_turns_its_field_round() {
    for broken in [false, true] {
        let (simulation, mut bus, attached) = chip();
        attached.set_broken(broken);
        write(&mut bus, 0x4B, 1);
        wait(&simulation, 3_000);
        let trim = read(&mut bus, 0x5D);
        // Only z, five repetitions: within the 4 ms for which the manufacturer's code waits.
        write(&mut bus, 0x4E, 0x1F);
        write(&mut bus, 0x52, 4);
        let [positive, negative] = [0xC2, 0x82].map(|mode| {
            write(&mut bus, 0x4C, mode);
            wait(&simulation, 4_000);
            let data: [u8; 8] = read(&mut bus, 0x42);
            assert_eq!((data[6] & 1, &data[..4]), (1, &[0; 4][..]), "x and y are not measured");
            compensate(&trim, &data)[2]
        });
        let difference = positive - negative;
        assert_eq!((180.0..240.0).contains(&difference), !broken, "{difference} µT");
    }
}

#[test]
fn a_read_during_a_conversion_gives_the_one_before() {
    let (simulation, mut bus) = awake();
    write(&mut bus, 0x51, 4);
    write(&mut bus, 0x52, 14);
    write(&mut bus, 0x4C, 0x02);
    wait(&simulation, 11_000);
    let first: [u8; 8] = read(&mut bus, 0x42);
    write(&mut bus, 0x4C, 0x02);
    wait(&simulation, 5_000);
    let during: [u8; 8] = read(&mut bus, 0x42);
    assert_eq!((&during[..6], during[6] & 1), (&first[..6], 0), "the old field, marked as taken");
    wait(&simulation, 6_000);
    let second: [u8; 8] = read(&mut bus, 0x42);
    assert!(second[6] & 1 == 1 && second[..6] != first[..6]);
}

/// An SPI transfer: bytes written, then number of bytes read.
fn transfer<const N: usize>(port: &mut SpiPort<Bmm150>, out: &[u8]) -> [u8; N] {
    let mut bytes = [0; N];
    port.transaction(&mut [Operation::Write(out), Operation::Read(&mut bytes)]).unwrap();
    bytes
}

#[test]
fn on_spi_it_starts_suspended_too_and_takes_one_register_a_write() {
    let simulation = standing();
    let chip = Bmm150::new(&simulation.world, &simulation.clock, 1);
    let (mut port, _) = SpiBus::new(&simulation.clock, 1).attach(10_000_000, chip);
    wait(&simulation, 10_000);
    assert_eq!((transfer(&mut port, &[0xC0]), transfer(&mut port, &[0xCB])), ([0], [0]), "suspended");
    port.transaction(&mut [Operation::Write(&[0x4B, 1])]).unwrap();
    wait(&simulation, 3_000);
    assert_eq!(
        (transfer(&mut port, &[0xC0]), transfer(&mut port, &[0xCB, 0])),
        ([0x32], [6]),
        "0x4C after one more clocked byte"
    );
    port.transaction(&mut [Operation::Write(&[0x51, 4, 14])]).unwrap();
    assert_eq!(transfer(&mut port, &[0xD1]), [4, 0], "the second value is no one's");
    port.transaction(&mut [Operation::Write(&[0x4B, 5])]).unwrap();
    assert_eq!(transfer(&mut port, &[0xC0]), [0xFF], "three wires: SDO is silent");
    port.transaction(&mut [Operation::Write(&[0x4B, 1])]).unwrap();
    assert_eq!(transfer(&mut port, &[0xC0]), [0x32]);
}
