//! Self-test of the BMP280's driver.

use super::{Bench, FAILED, Outcome, configuration, identification, put};
use crate::drivers::spoilt::{Spoil, Spoilt};
use crate::standing;
use stampfly_drivers::Barometer;
use stampfly_drivers::chip::bmp280::{Bmp280, Config};
use stampfly_drivers::chip::{ChipError, I2cRegisters, TransferLimit};
use stampfly_sim::chips::{self, Faults, I2cBus};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Duration;

fn barometer(spoil: Spoil) -> Bench<Bmp280<I2cRegisters<Spoilt<I2cBus>>, Clock>> {
    let (simulation, config) = (standing(), Config::default());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let attached = bus.attach(Bmp280::SDO_LOW, chips::Bmp280::new(&simulation.world, &clock, 1));
    clock.advance_to(clock.now() + Duration::from_millis(2));
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    let driver =
        Bmp280::i2c(bus, Bmp280::SDO_LOW, clock.clone(), config).with_transfer_limit(TransferLimit::I2C_SENSORS);
    (clock, attached, driver)
}

#[test]
fn tells_a_healthy_chip_from_a_broken_one() {
    tells_healthy_from_broken!(barometer, 30, pressure, 20.0);
}

#[test]
fn ends_in_time() {
    ends_in_time!(barometer, 9, 400);
}

#[test]
fn says_what_failed() {
    const NO_SAMPLE: Outcome = Err(ChipError::NoSample);
    const DATA: Outcome = Err(ChipError::Data);
    says!(
        barometer,
        60,
        [
            (put(0xD0, 1, 0, &[0x55]), identification(0x55)),
            // No calibration, T1 or P1 of zero; P1 that makes any pressure too high.
            (put(0x88, 24, 0, &[0; 24]), DATA),
            (put(0x88, 24, 0, &[0xFF; 24]), DATA),
            (put(0x88, 24, 0, &[0, 0]), DATA),
            (put(0x88, 24, 6, &[0, 0]), DATA),
            (put(0x88, 24, 6, &[1, 0]), FAILED),
            // Copies its calibration endlessly; keeps neither oversampling nor filter.
            (put(0xF3, 1, 0, &[1]), configuration(1)),
            (put(0xF4, 2, 0, &[0x24]), configuration(0x24)),
            (put(0xF4, 2, 1, &[0]), configuration(0)),
            // Begins no conversion; ends none.
            (put(0xF3, 2, 0, &[0, 0]), NO_SAMPLE),
            (put(0xF3, 10, 0, &[8]), NO_SAMPLE),
            // Pressure and temperature: never measured, at either limit; 90 °C.
            (put(0xF3, 10, 4, &[0x80, 0, 0]), FAILED),
            (put(0xF3, 10, 7, &[0x80, 0, 0]), FAILED),
            (put(0xF3, 10, 4, &[0; 3]), FAILED),
            (put(0xF3, 10, 4, &[0xFF; 3]), FAILED),
            (put(0xF3, 10, 7, &[0; 3]), FAILED),
            (put(0xF3, 10, 7, &[0xFF; 3]), FAILED),
            (put(0xF3, 10, 7, &[0xB1, 0x40, 0]), FAILED),
        ]
    );
}
