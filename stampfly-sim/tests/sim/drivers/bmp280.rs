//! Driver of the BMP280.

use super::registers;
use crate::{compensation, standing};
use stampfly_drivers::Barometer;
use stampfly_drivers::chip::bmp280::{Bmp280, Config, Filter, Oversampling};
use stampfly_drivers::chip::{ChipError, I2cRegisters};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{self, Attached, I2cBus};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::{Duration, Instant};

fn bench(config: Config) -> (Simulation, Attached, Bmp280<I2cRegisters<I2cBus>, Clock>) {
    let simulation = standing();
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let attached = bus.attach(Bmp280::SDO_LOW, chips::Bmp280::new(&simulation.world, &clock, 1));
    clock.advance_to(clock.now() + Duration::from_millis(2));
    (simulation, attached, Bmp280::i2c(bus, Bmp280::SDO_LOW, clock, config))
}

#[test]
fn another_part_is_named() {
    let (simulation, attached, mut driver) = bench(Config::default());
    attached.set_id(0x55);
    assert_eq!(block_on(&simulation.clock, driver.start()), Err(ChipError::Identification { found: 0x55 }));
}

#[test]
fn the_chip_is_told_what_the_configuration_says() {
    let filters = [Filter::Off, Filter::C2, Filter::C4, Filter::C8, Filter::C16];
    let samplings = [Oversampling::X1, Oversampling::X2, Oversampling::X4, Oversampling::X8, Oversampling::X16];
    for (code, (filter, pressure)) in (0..).zip(filters.into_iter().zip(samplings)) {
        let (simulation, attached, mut driver) =
            bench(Config { pressure, temperature: Oversampling::X2, filter, interval: Duration::from_millis(100) });
        block_on(&simulation.clock, driver.next()).expect("a conversion");
        // Asleep between conversions.
        assert_eq!(registers(&attached, 0xF4), [2 << 5 | (code + 1) << 2, code << 2]);
    }
}

#[test]
fn pressure_and_temperature_are_those_of_the_registers() {
    let (simulation, attached, mut driver) = bench(Config::default());
    let clock = &simulation.clock;
    let mut before = Instant::ZERO;
    for _ in 0..50 {
        let sample = block_on(clock, driver.next()).expect("a conversion");
        let (temperature, pressure) = compensation::bmp280(&registers(&attached, 0x88), &registers(&attached, 0xF7));
        // Resolution: 1/256 Pa and 0.01 °C.
        assert!((f64::from(sample.data.pressure) - pressure).abs() <= 1.0 / 256.0, "{sample:?} {pressure}");
        assert!((f64::from(sample.data.temperature) - temperature).abs() < 0.006, "{sample:?} {temperature}");
        assert!(before == Instant::ZERO || sample.at.since(before) == Duration::from_millis(40), "{}", sample.at);
        // 13.5 ms of conversion, of which the last 8 ms are pressure.
        let age = clock.now().since(sample.at).as_micros();
        assert!((4_000..8_000).contains(&age), "{age} µs");
        before = sample.at;
    }
}
