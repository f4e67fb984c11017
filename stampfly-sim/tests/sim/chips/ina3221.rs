//! INA3221 after Texas Instruments SBOS576.

use super::wait;
use crate::standing;
use embedded_hal::i2c::I2c;
use stampfly_sim::Simulation;
use stampfly_sim::chips::{I2cBus, Ina3221};

const ADDRESS: u8 = 0x40;

fn chip() -> (Simulation, I2cBus) {
    let simulation = standing();
    let bus = I2cBus::new(&simulation.clock, 1);
    bus.attach(ADDRESS, Ina3221::new(&simulation.world, &simulation.clock, 1));
    (simulation, bus)
}

fn read(bus: &mut I2cBus, register: u8) -> u16 {
    let mut word = [0; 2];
    bus.write_read(ADDRESS, &[register], &mut word).unwrap();
    u16::from_be_bytes(word)
}

fn write(bus: &mut I2cBus, register: u8, value: u16) {
    let [high, low] = value.to_be_bytes();
    bus.write(ADDRESS, &[register, high, low]).unwrap();
}

#[test]
fn registers_after_power_on() {
    let (_, mut bus) = chip();
    let words = [(0xFE, 0x5449), (0xFF, 0x3220), (0x00, 0x7127), (0x03, 0), (0x07, 0x7FF8), (0x0F, 2), (0x11, 0x2328)];
    for (register, value) in words {
        assert_eq!(read(&mut bus, register), value, "{register:#04x}");
    }
}

#[test]
fn it_converts_from_power_on_and_says_when_it_is_ready() {
    let (simulation, mut bus) = chip();
    // Six conversions of 1.1 ms.
    wait(&simulation, 6_000);
    assert_eq!((read(&mut bus, 0x0F), read(&mut bus, 0x04)), (2, 0));
    wait(&simulation, 700);
    assert_eq!(read(&mut bus, 0x0F), 3);
    assert_eq!(read(&mut bus, 0x0F), 2, "cleared by reading");
    let volts = f64::from(read(&mut bus, 0x04) >> 3) * 0.008;
    let amperes = f64::from(read(&mut bus, 0x03) >> 3) * 40e-6 / 0.01;
    let truth = simulation.truth();
    assert!((volts - f64::from(truth.battery_voltage)).abs() < 0.03, "{volts}");
    assert!((amperes - f64::from(truth.battery_current)).abs() < 0.03, "{amperes}");
    assert!(amperes > 0.0 && read(&mut bus, 0x04) & 7 == 0);
    assert_eq!([0x01, 0x02, 0x05, 0x06].map(|register| read(&mut bus, register)), [0; 4], "nothing is connected");
}

#[test]
fn averages_and_channels_make_the_conversion_time() {
    let (simulation, mut bus) = chip();
    // Channel 2 alone, 64 averages, 1.1 ms each, shunt and bus: 141 ms.
    write(&mut bus, 0x00, 0b0_010_011_100_100_111);
    wait(&simulation, 136_000);
    assert_eq!((read(&mut bus, 0x0F) & 1, read(&mut bus, 0x04)), (0, 0));
    wait(&simulation, 8_000);
    assert_eq!(read(&mut bus, 0x0F) & 1, 1);
    assert_ne!(read(&mut bus, 0x04), 0);
}

#[test]
fn one_shot_converts_once_and_power_down_never() {
    let (simulation, mut bus) = chip();
    write(&mut bus, 0x00, 0b0_010_000_100_100_011);
    wait(&simulation, 3_000);
    assert_eq!(read(&mut bus, 0x0F) & 1, 1);
    wait(&simulation, 50_000);
    assert_eq!(read(&mut bus, 0x0F) & 1, 0, "no second one");
    write(&mut bus, 0x00, 0b0_010_000_100_100_100);
    wait(&simulation, 50_000);
    assert_eq!(read(&mut bus, 0x0F) & 1, 0);
}

#[test]
fn a_new_configuration_begins_anew() {
    let (simulation, mut bus) = chip();
    for _ in 0..5 {
        wait(&simulation, 2_000);
        write(&mut bus, 0x00, 0x7127);
    }
    assert_eq!(read(&mut bus, 0x0F) & 1, 0, "never left alone for 6.6 ms");
    assert_eq!(read(&mut bus, 0x04), 0);
}

#[test]
fn reset_restores_everything() {
    let (simulation, mut bus) = chip();
    write(&mut bus, 0x07, 0x1234);
    assert_eq!(read(&mut bus, 0x07), 0x1230, "the lowest three bits do not exist");
    write(&mut bus, 0x00, 0b0_010_011_100_100_111);
    wait(&simulation, 200_000);
    write(&mut bus, 0x00, 0x8000);
    assert_eq!((read(&mut bus, 0x00), read(&mut bus, 0x07), read(&mut bus, 0x04)), (0x7127, 0x7FF8, 0));
}

#[test]
fn the_current_has_a_sign_and_a_range_of_its_own() {
    use stampfly_drivers::MotorOutputs;
    use stampfly_types::messages::MotorOutput;
    let (mut simulation, mut bus) = chip();
    let output = MotorOutput { duty: [0.5; 8], count: 4, armed: true, ..Default::default() };
    assert!(simulation.sensors.motors.write(&output).is_ok());
    wait(&simulation, 100_000);
    let amperes = f64::from(read(&mut bus, 0x03) as i16 >> 3) * 40e-6 / 0.01;
    let truth = f64::from(simulation.truth().battery_current);
    assert!(truth > 1.0 && (amperes / truth - 1.0).abs() < 0.06, "{amperes} {truth}");
}

#[test]
fn a_read_during_a_conversion_gives_the_one_before() {
    let (simulation, mut bus) = chip();
    // Channel 2, 64 averages of 1.1 ms: 141 ms.
    write(&mut bus, 0x00, 0b0_010_011_100_100_111);
    wait(&simulation, 145_000);
    let first = read(&mut bus, 0x04);
    assert_eq!(read(&mut bus, 0x0F) & 1, 1);
    wait(&simulation, 100_000);
    assert_eq!((read(&mut bus, 0x04), read(&mut bus, 0x0F) & 1), (first, 0), "the second one runs");
    wait(&simulation, 45_000);
    assert_eq!(read(&mut bus, 0x0F) & 1, 1);
}
