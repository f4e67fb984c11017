//! Driver of the INA3221.

use crate::standing;
use stampfly_drivers::PowerMonitor;
use stampfly_drivers::chip::ina3221::{Average, Channel, Config, ConversionTime, Ina3221};
use stampfly_drivers::chip::{ChipError, I2cRegisters};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{self, Attached, I2cBus};
use stampfly_sim::time::{Clock, block_on};

fn bench(config: Config) -> (Simulation, Attached, Ina3221<I2cRegisters<I2cBus>, Clock>) {
    let simulation = standing();
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let attached = bus.attach(Ina3221::A0_GROUND, chips::Ina3221::new(&simulation.world, &clock, 1));
    (simulation, attached, Ina3221::new(bus, Ina3221::A0_GROUND, clock, config))
}

#[test]
fn another_part_is_named() {
    let (simulation, attached, mut driver) = bench(Config::default());
    attached.set_id(0x3260);
    assert_eq!(block_on(&simulation.clock, driver.start()), Err(ChipError::Identification { found: 0x3260 }));
}

#[test]
fn the_chip_is_told_what_the_configuration_says() {
    for (channel, average, time, word) in [
        (Channel::One, Average::A1, ConversionTime::Us140, 0x4007),
        (Channel::Two, Average::A64, ConversionTime::Us588, 0x26DF),
        (Channel::Two, Average::A16, ConversionTime::Us4156, 0x25B7),
        (Channel::Three, Average::A1024, ConversionTime::Us8244, 0x1FFF),
    ] {
        let shunts_ohms = Channel::ALL.map(|measured| (measured == channel).then_some(0.01));
        let (simulation, attached, mut driver) = bench(Config { channel, shunts_ohms, average, time });
        assert_eq!(block_on(&simulation.clock, driver.start()), Ok(()));
        assert_eq!(attached.peek(0), word, "{channel:?} {average:?} {time:?}");
    }
}

#[test]
fn voltage_and_current_are_those_of_the_registers_and_the_truth() {
    let (simulation, attached, mut driver) = bench(Config::default());
    let clock = &simulation.clock;
    let mut stamps = Vec::new();
    for _ in 0..20 {
        let sample = block_on(clock, driver.next()).expect("a result");
        let counts = |register| f64::from(attached.peek(register) as i16 >> 3);
        assert!((f64::from(sample.data.voltage) - counts(4) * 0.008).abs() < 1e-5, "{sample:?}");
        assert!((f64::from(sample.data.current) - counts(3) * 0.004).abs() < 1e-5, "{sample:?}");
        assert!((sample.data.voltage - simulation.truth().battery_voltage).abs() < 0.03, "{sample:?}");
        let age = clock.now().since(sample.at).as_micros();
        // The middle of 75 ms, seen within 2 ms.
        assert!((37_000..41_000).contains(&age), "{age} µs");
        stamps.push(sample.at);
    }
    let mean = stamps[19].since(stamps[0]).seconds() / 19.0;
    assert!((mean / 0.075_264 - 1.0).abs() < 0.03, "{mean} s between samples");
}
