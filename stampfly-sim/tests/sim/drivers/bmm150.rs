//! Driver of the BMM150.

use super::registers;
use crate::{compensation, mounting, standing};
use stampfly_drivers::Magnetometer;
use stampfly_drivers::chip::bmm150::{Bmm150, Config, Preset, Rate};
use stampfly_drivers::chip::{ChipError, I2cRegisters};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{self, Attached, I2cBus};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::{Duration, Vec3};

fn bench(config: Config) -> (Simulation, Attached, Bmm150<I2cRegisters<I2cBus>, Clock>) {
    let simulation = standing();
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let attached = bus.attach(Bmm150::ALL_LOW, chips::Bmm150::new(&simulation.world, &clock, 1));
    let driver = Bmm150::i2c(bus, Bmm150::ALL_LOW, clock, mounting::MAGNETOMETER, config);
    (simulation, attached, driver)
}

#[test]
fn another_part_is_named() {
    let (simulation, attached, mut driver) = bench(Config::default());
    attached.set_id(0x33);
    assert_eq!(block_on(&simulation.clock, driver.start()), Err(ChipError::Identification { found: 0x33 }));
}

#[test]
fn the_chip_is_told_what_the_configuration_says() {
    for (preset, rate, repetitions, mode) in [
        (Preset::LowPower, Rate::Hz30, [1, 2], 7 << 3),
        (Preset::Regular, Rate::Hz25, [4, 14], 6 << 3),
        (Preset::Enhanced, Rate::Hz10, [7, 26], 0),
        (Preset::HighAccuracy, Rate::Hz2, [23, 82], 1 << 3),
    ] {
        let (simulation, attached, mut driver) = bench(Config { preset, rate });
        let begun = simulation.clock.now();
        assert_eq!(block_on(&simulation.clock, driver.start()), Ok(()));
        let took = simulation.clock.now().since(begun);
        assert!((Duration::from_micros(6_000)..Duration::from_micros(9_000)).contains(&took), "7 ms: {took}");
        assert_eq!((attached.peek(0x4B), attached.peek(0x4C), registers(&attached, 0x51)), (1, mode, repetitions));
    }
}

#[test]
fn the_field_is_that_of_the_registers_and_the_models() {
    let (mut simulation, attached, mut driver) = bench(Config::default());
    let clock = simulation.clock.clone();
    let (mut read, mut stamps) = (Vec3::zeros(), Vec::new());
    for _ in 0..40 {
        let sample = block_on(&clock, driver.next()).expect("a field");
        let [x, y, z] = compensation::bmm150(&registers(&attached, 0x5D), &registers(&attached, 0x42));
        let expected = Vec3::new(-y as f32, x as f32, z as f32);
        // A count is 0.3 µT.
        assert!((sample.data.field - expected).norm() < 0.001, "{} {expected}", sample.data.field);
        assert_eq!(
            clock.now().since(sample.at),
            Duration::from_micros(4_892),
            "the middle of 145 µs · 9 + 500 µs · 15 + 980 µs"
        );
        read += sample.data.field / 40.0;
        stamps.push(sample.at);
    }
    let mean = stamps[39].since(stamps[0]).seconds() / 39.0;
    assert!((mean / 0.04 - 1.0).abs() < 0.025, "{mean} s between samples");
    // The chip keeps its rate; samples are seen within 2 ms plus a read of 0.3 ms, and so are the
    // two of which the mean is made.
    let late = (0u8..).zip(&stamps).map(|(n, at)| at.since(stamps[0]).seconds() - f32::from(n) * mean);
    let (least, most) = late.fold((0.0f32, 0.0f32), |(least, most), late| (least.min(late), most.max(late)));
    assert!(most - least < 2.0 * 0.0023, "{} s", most - least);
    let model =
        (0..40).map(|_| block_on(&clock, simulation.sensors.mag.next()).unwrap().data.field).sum::<Vec3>() / 40.0;
    assert!((read - model).norm() < 1.0, "{read:?} µT by the driver, {model:?} by the model");
}

#[test]
fn the_self_test_tells_a_healthy_chip_from_a_broken_one() {
    for broken in [false, true] {
        let (simulation, attached, mut driver) = bench(Config::default());
        attached.set_broken(broken);
        let begun = simulation.clock.now();
        let outcome = block_on(&simulation.clock, driver.self_test());
        assert_eq!(outcome, if broken { Err(ChipError::SelfTest) } else { Ok(()) });
        assert!(simulation.clock.now().since(begun) < Duration::from_millis(30));
        assert!(block_on(&simulation.clock, driver.next()).is_ok(), "set up again");
    }
}
