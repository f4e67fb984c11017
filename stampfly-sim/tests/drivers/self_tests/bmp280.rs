//! BMP280.

use super::{Bench, Change, FAILED, Outcome, configuration, identification};
use crate::spoilt::{Spoil, Spoilt};
use crate::standing;
use stampfly_drivers::Barometer;
use stampfly_drivers::chip::bmp280::{Bmp280, Config};
use stampfly_drivers::chip::{ChipError, I2cRegisters};
use stampfly_sim::chips::{self, Faults, I2cBus};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Micros;

fn barometer(spoil: Spoil) -> Bench<Bmp280<I2cRegisters<Spoilt<I2cBus>>, Clock>> {
    let (simulation, config) = (standing(), Config::default());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let attached = bus.attach(Bmp280::SDO_LOW, chips::Bmp280::new(&simulation.world, &clock, 1));
    clock.advance_to(clock.now() + Micros::from_millis(2));
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    (clock.clone(), attached, Bmp280::new(bus, Bmp280::SDO_LOW, clock, config))
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
    // The result: status, control, configuration, nothing, pressure, temperature.
    says!(
        barometer,
        60,
        [
            (
                |register, answer| if register == 0xD0 {
                    answer[0] = 0x55
                },
                identification(0x55)
            ),
            (
                |register, answer| if register == 0x88 {
                    answer.fill(0)
                },
                Err(ChipError::Data)
            ),
            (
                |register, answer| if register == 0x88 {
                    answer.fill(0xFF)
                },
                Err(ChipError::Data)
            ),
            // T1, P1.
            (
                |register, answer| if register == 0x88 {
                    answer[..2].fill(0)
                },
                Err(ChipError::Data)
            ),
            (
                |register, answer| if register == 0x88 {
                    answer[6..8].fill(0)
                },
                Err(ChipError::Data)
            ),
            // Copies its calibration for ever.
            (
                |register, answer| if (register, answer.len()) == (0xF3, 1) {
                    answer[0] = 1
                },
                configuration(1)
            ),
            (
                |register, answer| if register == 0xF4 {
                    answer[0] = 0x24
                },
                configuration(0x24)
            ),
            (
                |register, answer| if register == 0xF4 {
                    answer[1] = 0
                },
                configuration(0)
            ),
            // Begins no conversion, ends none.
            (
                |register, answer| if (register, answer.len()) == (0xF3, 2) {
                    answer.fill(0)
                },
                Err(ChipError::NoSample)
            ),
            (
                |register, answer| if answer.len() == 10 && register == 0xF3 {
                    answer[0] = 8
                },
                Err(ChipError::NoSample)
            ),
            // Never measured; either one at an end; 90 °C.
            (
                |_, answer| if answer.len() == 10 {
                    answer[4..7].copy_from_slice(&[0x80, 0, 0])
                },
                FAILED
            ),
            (
                |_, answer| if answer.len() == 10 {
                    answer[7..].copy_from_slice(&[0x80, 0, 0])
                },
                FAILED
            ),
            (
                |_, answer| if answer.len() == 10 {
                    answer[4..7].fill(0)
                },
                FAILED
            ),
            (
                |_, answer| if answer.len() == 10 {
                    answer[4..7].fill(0xFF)
                },
                FAILED
            ),
            (
                |_, answer| if answer.len() == 10 {
                    answer[7..].fill(0)
                },
                FAILED
            ),
            (
                |_, answer| if answer.len() == 10 {
                    answer[7..].copy_from_slice(&[0xB1, 0x40, 0])
                },
                FAILED
            ),
        ]
    );
}
