//! Tests of the BMI270 driver on a chip made of closures: registers, a FIFO that fills in virtual
//! time, and faults.

mod chip;
mod interrupt;
mod self_tests;

use chip::{BLOB, PERIOD, bench, driver};
use stampfly_bmi270::{Bmi270, Config};
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::{AxisMap, ChipError};
use stampfly_driver_core::{Imu, SensorError, SensorErrorKind, Timebase};
use stampfly_driver_fakes::closure::{AXES, Access, Fault, I2cBus, SpiBus, cancel};
use stampfly_types::{Duration, Instant};

#[test]
fn it_starts_as_the_data_sheet_says_and_uploads_every_byte_where_it_belongs() {
    let (clock, chip) = bench();
    block_on(driver(&clock, &chip, Config::default()).start()).expect("starts");
    let chip = chip.borrow();
    let registers: Vec<u8> = chip.writes.iter().map(|(register, _)| *register).collect();
    assert_eq!(
        registers,
        [0x7E, 0x7C, 0x59, 0x5B, 0x5E, 0x5B, 0x5E, 0x5B, 0x5E, 0x59, 0x40, 0x45, 0x48, 0x7D, 0x7C, 0x7E]
    );
    let addresses: Vec<&[u8]> = chip.writes.iter().filter(|w| w.0 == 0x5B).map(|w| &w.1[..]).collect();
    assert_eq!(addresses, [[0, 0], [0, 8], [0, 16]]);
    let uploaded: Vec<u8> = chip.writes.iter().filter(|w| w.0 == 0x5E).flat_map(|w| w.1.clone()).collect();
    assert_eq!(uploaded, BLOB);
    assert_eq!(chip.registers[0x40..0x44], [0xAC, 0x02, 0xEC, 0x00]);
    assert_eq!(chip.registers[0x48..0x4A], [0x00, 0xD0]);
}

#[test]
fn samples_come_at_400_hz_in_si_units_and_body_axes_with_the_cross_axis_correction() {
    let (clock, chip) = bench();
    // −64/512 of the rate about z is added to x.
    chip.borrow_mut().registers[0x3C] = 0x40;
    chip.borrow_mut().registers[0x22..0x24].copy_from_slice(&[0x00, 0x02]);
    let mut imu = driver(&clock, &chip, Config::default());
    let first = block_on(imu.next()).expect("a sample");
    let mut before = first.at;
    for _ in 0..400 {
        let sample = block_on(imu.next()).expect("a sample");
        let step = sample.at.since(before).as_micros();
        assert!((2_450..=2_550).contains(&step), "one tick of the chip's clock: {step}");
        before = sample.at;
        let latency = clock.now().since(sample.at).as_micros();
        assert!((1_875..2_150).contains(&latency), "three chip samples, the aim and two transfers: {latency}");
    }
    let g = stampfly_types::GRAVITY / 4096.0;
    assert!((first.data.accel - stampfly_types::Vec3::new(-4096.0 * g, -100.0 * g, -200.0 * g)).norm() < 1e-5);
    let degrees = first.data.gyro.map(f32::to_degrees);
    assert!((degrees - stampfly_types::Vec3::new(16.0 / 16.4, -10.0 - 2.0 / 16.4, 20.0)).norm() < 1e-4, "{degrees}");
    assert_eq!(first.data.temperature, 24.0);
    assert!((before.since(first.at).seconds() - 1.0).abs() < 1e-3);
}

#[test]
fn the_stamp_is_the_middle_of_the_filter() {
    let (clock, chip) = bench();
    // A ramp: chip sample n, taken at n periods, has the value n modulo a large number.
    chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
    let mut imu = driver(&clock, &chip, Config::default());
    for _ in 0..20 {
        let sample = block_on(imu.next()).expect("a sample");
        let counts = sample.data.accel.x / stampfly_types::GRAVITY * 4096.0;
        let instant = Instant::from_micros((counts.round() as u64) * PERIOD / 1_000);
        assert!(sample.at.as_micros().abs_diff(instant.as_micros()) <= 60, "{} {}", sample.at, instant);
    }
}

#[test]
fn a_chip_clock_that_is_off_costs_no_sample() {
    for period in [PERIOD * 97 / 100, PERIOD * 103 / 100] {
        let (clock, chip) = bench();
        chip.borrow_mut().period = period;
        chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
        let mut imu = driver(&clock, &chip, Config::default());
        let mut before = block_on(imu.next()).expect("a sample");
        for _ in 0..500 {
            let sample = block_on(imu.next()).expect("a sample");
            let step = (sample.data.accel.x - before.data.accel.x) / stampfly_types::GRAVITY * 4096.0;
            assert!((step - 4.0).abs() < 1e-2, "{step}");
            // Tolerance: one tick, and three nominal periods that take another time on the chip.
            assert!((sample.at.since(before.at).as_micros() * 1_000).abs_diff(4 * period) <= 60_000);
            assert!(clock.now().since(sample.at) < Duration::from_micros(2_300));
            before = sample;
        }
    }
}

#[test]
fn a_late_reader_gets_every_sample() {
    let (clock, chip) = bench();
    chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
    let mut imu = driver(&clock, &chip, Config::default());
    let mut before = block_on(imu.next()).expect("a sample").data.accel.x;
    for round in 0..50 {
        if round == 10 {
            clock.advance(60_000);
        }
        let now = block_on(imu.next()).expect("a sample").data.accel.x;
        let step = (now - before) / stampfly_types::GRAVITY * 4096.0;
        assert!((step - 4.0).abs() < 1e-2, "four chip samples on: {step}");
        before = now;
    }
}

#[test]
fn an_overrun_starts_anew_instead_of_mixing_old_samples_with_new() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    clock.advance(300_000);
    chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
    let sample = block_on(imu.next()).expect("a sample");
    let counts = sample.data.accel.x / stampfly_types::GRAVITY * 4096.0;
    assert!(sample.at.as_micros().abs_diff(counts.round() as u64 * PERIOD / 1_000) <= 60);
    assert!(clock.now().since(sample.at) < Duration::from_micros(2_150));
}

#[test]
fn lost_samples_restart_the_filter_and_cost_two_periods() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    let before = block_on(imu.next()).expect("a sample").at;
    chip.borrow_mut().header = Some(0x40);
    let after = block_on(imu.next()).expect("a sample").at;
    assert!((7_000..=8_000).contains(&after.since(before).as_micros()), "{}", after.since(before));
    assert_eq!(chip.borrow().writes.iter().filter(|w| w.0 == 0x7E && w.1 == [0xB0]).count(), 2);
}

#[test]
fn another_chip_is_told_apart_from_one_that_does_not_start() {
    let (clock, chip) = bench();
    chip.borrow_mut().registers[0] = 0xD1;
    let error = block_on(driver(&clock, &chip, Config::default()).next()).expect_err("a BMI160");
    assert_eq!(error, ChipError::Identification { found: 0xD1 });
    assert_eq!(error.kind(), SensorErrorKind::Identification);
    let (clock, chip) = bench();
    chip.borrow_mut().starts = false;
    let error = block_on(driver(&clock, &chip, Config::default()).next()).expect_err("a broken file");
    assert_eq!(error, ChipError::Configuration { status: 2 });
}

#[test]
fn a_chip_that_forever_initialises_is_given_up() {
    let (clock, chip) = bench();
    let shared = chip.clone();
    let bus = SpiBus {
        clock: clock.clone(),
        chip: move |access: Access<'_>| {
            let outcome = shared.borrow_mut().access(access);
            shared.borrow_mut().registers[0x21] = 0;
            outcome
        },
    };
    let before = clock.now();
    let outcome = block_on(Bmi270::spi(bus, clock.clone(), &BLOB, AxisMap::IDENTITY, Config::default()).start());
    assert_eq!(outcome, Err(ChipError::Configuration { status: 0 }));
    assert!(clock.now().since(before) < Duration::from_millis(170));
}

#[test]
fn a_configuration_that_cannot_be_is_not_sent() {
    for blob in [&[][..], &[0; 7], &[0; 8_194]] {
        let (clock, chip) = bench();
        let shared = chip.clone();
        let bus = SpiBus { clock: clock.clone(), chip: move |access: Access<'_>| shared.borrow_mut().access(access) };
        let outcome = block_on(Bmi270::spi(bus, clock, blob, AxisMap::IDENTITY, Config::default()).start());
        assert_eq!(outcome, Err(ChipError::InvalidConfiguration));
        assert!(chip.borrow().writes.is_empty());
    }
}

#[test]
fn a_chip_that_stops_sampling_times_out_and_is_set_up_again() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    chip.borrow_mut().frozen = true;
    let before = clock.now();
    let error = block_on(imu.next()).expect_err("nothing new");
    assert_eq!((error, error.kind()), (ChipError::NoSample, SensorErrorKind::Timeout));
    assert!(clock.now().since(before) < Duration::from_millis(15), "{}", clock.now().since(before));
    chip.borrow_mut().frozen = false;
    chip.borrow_mut().writes.clear();
    block_on(imu.next()).expect("a sample");
    assert!(chip.borrow().writes.iter().any(|w| w.0 == 0x5E), "uploaded again");
}

#[test]
fn a_brown_out_is_noticed_at_the_next_read_and_healed_by_the_one_after() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    chip.borrow_mut().registers[0x21] = 0;
    assert_eq!(block_on(imu.next()), Err(ChipError::Restarted));
    block_on(imu.next()).expect("a sample");
}

#[test]
fn one_wrong_bit_anywhere_in_flight_costs_no_more_than_a_sample() {
    for (register, bytes) in [(0x18, 14), (0x26, 52)] {
        for bit in 0..8 * bytes {
            let (clock, chip) = bench();
            let mut imu = driver(&clock, &chip, Config::default());
            let mut sample = block_on(imu.next()).expect("a sample");
            let mut came = clock.now();
            chip.borrow_mut().flip = Some((register, bit));
            for _ in 0..5 {
                let before = core::mem::replace(&mut sample, block_on(imu.next()).expect("a sample"));
                let (gap, step) = (clock.now().since(came), sample.at.since(before.at));
                came = clock.now();
                let place = format!("bit {bit} of {register:#04x}");
                assert!(gap <= Duration::from_millis(5), "{place}: {gap} without a sample");
                assert!(
                    (Duration::from_micros(1_800)..=Duration::from_micros(3_200)).contains(&step),
                    "{place}: the next one is {step} later"
                );
            }
            assert_eq!(chip.borrow().flip, None, "it was read");
        }
    }
}

#[test]
fn after_refused_transfers_the_samples_made_meanwhile_come_at_once() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    for register in [0x18, 0x26] {
        block_on(imu.next()).expect("a sample");
        chip.borrow_mut().faults.push((register, Fault::Nack));
        assert_eq!(block_on(imu.next()), Err(ChipError::Bus(Fault::Nack)));
        clock.advance(18_000);
        let begun = clock.now();
        let sample = block_on(imu.next()).expect("a sample");
        assert!(clock.now().since(begun) < Duration::from_micros(1_000), "{}", clock.now().since(begun));
        assert!(begun.since(sample.at) > Duration::from_micros(10_000), "from the time of the refusals");
    }
}

#[test]
fn bus_faults_cost_one_call_each_and_bounded_time() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    for (register, fault, expected) in [
        (0x18, Fault::Nack, ChipError::Bus(Fault::Nack)),
        (0x26, Fault::Nack, ChipError::Bus(Fault::Nack)),
        (0x18, Fault::Hang, ChipError::BusTimeout),
        (0x26, Fault::Hang, ChipError::BusTimeout),
    ] {
        chip.borrow_mut().faults.push((register, fault));
        let before = clock.now();
        assert_eq!(block_on(imu.next()), Err(expected));
        assert!(clock.now().since(before) <= Duration::from_millis(13));
        block_on(imu.next()).expect("a sample");
    }
}

#[test]
fn a_call_dropped_in_the_middle_of_a_fifo_read_never_mixes_old_samples_with_new() {
    let (clock, chip) = bench();
    chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    chip.borrow_mut().faults.push((0x26, Fault::Hang));
    // The bus hangs in the FIFO read, and the caller gives up before the driver does.
    clock.advance(2_500);
    clock.stop(true);
    cancel(imu.next());
    clock.stop(false);
    assert!(chip.borrow().faults.is_empty(), "it was the FIFO read that hung");
    let sample = block_on(imu.next()).expect("a sample");
    let counts = sample.data.accel.x / stampfly_types::GRAVITY * 4096.0;
    assert!(sample.at.as_micros().abs_diff(counts.round() as u64 * PERIOD / 1_000) <= 60);
}

#[test]
fn it_works_on_i2c_too() {
    let (clock, chip) = bench();
    let shared = chip.clone();
    let bus = I2cBus {
        address: 0x68,
        clock: clock.clone(),
        chip: move |access: Access<'_>| shared.borrow_mut().access(access),
    };
    let mut imu = Bmi270::i2c(bus, 0x68, clock, &BLOB, AXES, Config::default());
    let sample = block_on(imu.next()).expect("a sample");
    assert!((sample.data.accel.x + stampfly_types::GRAVITY).abs() < 1e-5);
}
