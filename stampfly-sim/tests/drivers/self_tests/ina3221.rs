//! INA3221.

use super::{Bench, Change, FAILED, Outcome, configuration, identification};
use crate::spoilt::{Spoil, Spoilt};
use crate::standing;
use stampfly_drivers::PowerMonitor;
use stampfly_drivers::chip::ina3221::{Channel, Config, Ina3221};
use stampfly_drivers::chip::{ChipError, I2cRegisters};
use stampfly_sim::chips::{self, Faults, I2cBus};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Micros;

fn monitor_of(channel: Channel, spoil: Spoil) -> Bench<Ina3221<I2cRegisters<Spoilt<I2cBus>>, Clock>> {
    let (simulation, config) = (standing(), Config { channel, ..Default::default() });
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let attached = bus.attach(Ina3221::A0_GROUND, chips::Ina3221::new(&simulation.world, &clock, 1));
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    (clock.clone(), attached, Ina3221::new(bus, Ina3221::A0_GROUND, clock, config))
}

fn monitor(spoil: Spoil) -> Bench<Ina3221<I2cRegisters<Spoilt<I2cBus>>, Clock>> {
    monitor_of(Channel::Two, spoil)
}

#[test]
fn tells_a_healthy_chip_from_a_broken_one() {
    tells_healthy_from_broken!(monitor, 12, voltage, 0.03);
}

#[test]
fn ends_in_time() {
    ends_in_time!(monitor, 9, 200);
}

#[test]
fn says_what_failed() {
    says!(
        monitor,
        30,
        [
            (
                |register, answer| if register == 0xFE {
                    answer.fill(0)
                },
                identification(0)
            ),
            (
                |register, answer| if register == 0xFF {
                    answer[1] = 0x60
                },
                identification(0x3260)
            ),
            (
                |register, answer| if register == 0 {
                    answer.copy_from_slice(&[0x71, 0x27])
                },
                configuration(0x71)
            ),
            (
                |register, answer| if register == 0x0F {
                    answer[1] &= !1
                },
                Err(ChipError::NoSample)
            ),
            // 0 V, −8 mV, 26.008 V, the scale's end.
            (
                |register, answer| if register == 4 {
                    answer.fill(0)
                },
                FAILED
            ),
            (
                |register, answer| if register == 4 {
                    answer.copy_from_slice(&[0xFF, 0xF8])
                },
                FAILED
            ),
            (
                |register, answer| if register == 4 {
                    answer.copy_from_slice(&[0x65, 0x98])
                },
                FAILED
            ),
            (
                |register, answer| if register == 3 {
                    answer.copy_from_slice(&[0x7F, 0xF8])
                },
                FAILED
            ),
            (
                |register, answer| if register == 3 {
                    answer.copy_from_slice(&[0x80, 0x00])
                },
                FAILED
            ),
        ]
    );
}

#[test]
fn fails_on_a_channel_without_a_supply() {
    for channel in [Channel::One, Channel::Three] {
        let (clock, _, mut driver) = monitor_of(channel, Spoil::NOT);
        assert_eq!(block_on(&clock, driver.self_test()), FAILED, "{channel:?}");
    }
}
