//! Self-test of the INA3221's driver.

use super::{Bench, FAILED, Outcome, configuration, identification, put};
use crate::drivers::spoilt::{Spoil, Spoilt};
use crate::standing;
use stampfly_drivers::PowerMonitor;
use stampfly_drivers::chip::ina3221::{Channel, Config, Ina3221};
use stampfly_drivers::chip::{ChipError, I2cRegisters, TransferLimit};
use stampfly_sim::chips::{self, Faults, I2cBus};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Duration;

fn monitor_of(channel: Channel, spoil: Spoil) -> Bench<Ina3221<I2cRegisters<Spoilt<I2cBus>>, Clock>> {
    let shunts_ohms = Channel::ALL.map(|measured| (measured == channel).then_some(0.01));
    let (simulation, config) = (standing(), Config { channel, shunts_ohms, ..Default::default() });
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let attached = bus.attach(Ina3221::A0_GROUND, chips::Ina3221::new(&simulation.world, &clock, 1));
    let bus = Spoilt { bus, clock: clock.clone(), spoil };
    let driver =
        Ina3221::new(bus, Ina3221::A0_GROUND, clock.clone(), config).with_transfer_limit(TransferLimit::I2C_SENSORS);
    (clock, attached, driver)
}

fn monitor(spoil: Spoil) -> Bench<Ina3221<I2cRegisters<Spoilt<I2cBus>>, Clock>> {
    monitor_of(Channel::Two, spoil)
}

#[test]
fn tells_a_healthy_chip_from_a_broken_one() {
    tells_healthy_from_broken!(monitor, 6, voltage, 0.03);
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
            (put(0xFE, 2, 0, &[0, 0]), identification(0)),
            (put(0xFF, 2, 1, &[0x60]), identification(0x3260)),
            (put(0x00, 2, 0, &[0x71, 0x27]), configuration(0x71)),
            (put(0x0F, 2, 1, &[0]), Err(ChipError::NoSample)),
            // 0 V, −8 mV, 26.008 V; both limits of the shunt's range.
            (put(4, 2, 0, &[0, 0]), FAILED),
            (put(4, 2, 0, &[0xFF, 0xF8]), FAILED),
            (put(4, 2, 0, &[0x65, 0x98]), FAILED),
            (put(3, 2, 0, &[0x7F, 0xF8]), FAILED),
            (put(3, 2, 0, &[0x80, 0x00]), FAILED),
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
