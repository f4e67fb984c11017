//! Driver of the BMI270.

use super::{Tap, hover, registers};
use crate::{mounting, standing};
use core::cell::RefCell;
use stampfly_drivers::Imu;
use stampfly_drivers::chip::bmi270::{AccelRange, Bmi270, Config, GyroRange, Rate};
use stampfly_drivers::chip::{ChipError, SpiRegisters};
use stampfly_sim::chips::{self, Attached, I2cBus, SpiBus, SpiPort, stand_in_image};
use stampfly_sim::time::{Clock, Tasks, block_on};
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, Instant, Vec3};

type Driver<'b> = Bmi270<'b, SpiRegisters<SpiPort<chips::Bmi270>>, Clock>;

/// A chip after power-on, on SPI at 10 MHz. The seed determines its clock error.
pub fn soldered(simulation: &Simulation, seed: u64) -> (SpiPort<chips::Bmi270>, Attached) {
    let chip = chips::Bmi270::new(&simulation.world, &simulation.clock, seed, 1.0, &stand_in_image());
    SpiBus::new(&simulation.clock, 1).attach(10_000_000, chip)
}

fn driver<'b>(port: SpiPort<chips::Bmi270>, clock: &Clock, image: &'b [u8], config: Config) -> Driver<'b> {
    Bmi270::spi(port, clock.clone(), image, mounting::IMU, config)
}

/// Duration of a call.
fn timed<T>(clock: &Clock, call: impl Future<Output = T>) -> (Duration, T) {
    let begun = clock.now();
    let outcome = block_on(clock, call);
    (clock.now().since(begun), outcome)
}

#[test]
fn another_part_is_named_and_a_refused_image_too() {
    let simulation = standing();
    let (clock, image) = (&simulation.clock, stand_in_image());
    let (port, attached) = soldered(&simulation, 1);
    attached.set_id(0x43);
    let mut imu = driver(port, clock, &image, Config::default());
    assert_eq!(block_on(clock, imu.start()), Err(ChipError::Identification { found: 0x43 }));
    attached.set_id(0x24);
    assert_eq!(block_on(clock, imu.start()), Ok(()), "from any state");
    let wrong = vec![0x11; 8_192];
    let (port, _) = soldered(&simulation, 1);
    let mut imu = driver(port, clock, &wrong, Config::default());
    assert_eq!(block_on(clock, imu.start()), Err(ChipError::Configuration { status: 2 }));
}

#[test]
fn the_chip_is_told_what_the_configuration_says_in_the_promised_time() {
    let image = stand_in_image();
    let accel = [(AccelRange::G2, 0), (AccelRange::G4, 1), (AccelRange::G8, 2), (AccelRange::G16, 3)];
    let gyro = [(GyroRange::Dps2000, 0), (GyroRange::Dps1000, 1), (GyroRange::Dps500, 2), (GyroRange::Dps125, 4)];
    let rate = [(Rate::Hz400, 0xC), (Rate::Hz200, 0xB), (Rate::Hz100, 0xA), (Rate::Hz400, 0xC)];
    for (((accel_range, a), (gyro_range, g)), (rate, r)) in accel.into_iter().zip(gyro).zip(rate) {
        let simulation = standing();
        let clock = &simulation.clock;
        let (port, attached) = soldered(&simulation, 1);
        let mut imu = driver(port, clock, &image, Config { accel_range, gyro_range, rate });
        let (took, outcome) = timed(clock, imu.start());
        assert_eq!(outcome, Ok(()));
        assert!((Duration::from_millis(60)..Duration::from_millis(220)).contains(&took), "{took}");
        // Normal bandwidth and performance; low noise of the gyroscope.
        assert_eq!(registers(&attached, 0x40), [0xA0 | r, a, 0xE0 | r, g]);
        // FIFO: filtered data, headers, accelerometer and gyroscope, oldest dropped, no time.
        assert_eq!((attached.peek(0x45), registers(&attached, 0x48)), (0x88, [0x00, 0xD0]));
        // No interrupt, power save off, everything on.
        assert_eq!((attached.peek(0x53), attached.peek(0x58)), (0, 0));
        assert_eq!((attached.peek(0x7C) & 1, attached.peek(0x7D)), (0, 0x0E));
    }
}

/// Accelerometer and gyroscope of a frame along the chip's axes, counts, by the data sheet's
/// layout.
fn frame(bytes: &[u8]) -> [f64; 6] {
    assert_eq!(bytes[0], 0x8C);
    let word = |place: usize| f64::from(i16::from_le_bytes([bytes[1 + 2 * place], bytes[2 + 2 * place]]));
    [word(3), word(4), word(5), word(0), word(1), word(2)]
}

/// The decimated value of seven consecutive frames, body axes, SI, at ±8 g and ±2000 °/s.
fn decimated(frames: &[[f64; 6]]) -> (Vec3, Vec3) {
    let weights = [1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0];
    let [x, y, z, p, q, r] = core::array::from_fn(|channel| {
        frames.iter().zip(weights).map(|(frame, weight)| frame[channel] * weight).sum::<f64>() / 16.0
    });
    let accel = [y, x, -z].map(|counts| (counts / 4_096.0 * 9.806_65) as f32);
    let gyro = [q, p, -r].map(|counts| (counts / 16.4).to_radians() as f32);
    (Vec3::from(accel), Vec3::from(gyro))
}

#[test]
fn in_flight_every_sample_is_what_the_fifo_held() {
    let image = stand_in_image();
    let simulation = Simulation::new(&SimulationConfig::example());
    let (port, _) = soldered(&simulation, 1);
    let (tap, transfers) = Tap::new(port);
    let Simulation { clock, world, sensors } = simulation;
    let mut imu = Bmi270::spi(tap, clock.clone(), &image, mounting::IMU, Config::default());
    let samples = RefCell::new(Vec::new());
    let mut tasks = Tasks::new(clock.clone());
    hover(&mut tasks, clock.clone(), world, sensors.motors);
    tasks.spawn(async {
        loop {
            let ImuData { accel, gyro, .. } = imu.next().await.expect("no fault is simulated").data;
            samples.borrow_mut().push((accel, gyro));
        }
    });
    tasks.run_until(Instant::from_secs(4));
    drop(tasks);
    let transfers = transfers.borrow();
    let reads = transfers.iter().filter(|(command, _)| *command == 0xA6);
    let frames: Vec<_> = reads.flat_map(|(_, bytes)| bytes.chunks(13)).map(frame).collect();
    let samples = samples.into_inner();
    assert!(samples.len() > 1_400, "{}", samples.len());
    // The first group only fills the filter. A count is 0.0024 m/s² or 0.001 rad/s.
    for (number, (accel, gyro)) in samples.iter().enumerate() {
        let (expected_accel, expected_gyro) = decimated(&frames[4 * number + 1..4 * number + 8]);
        assert!((accel - expected_accel).norm() < 1e-4, "{number}: {accel} {expected_accel}");
        assert!((gyro - expected_gyro).norm() < 1e-5, "{number}: {gyro} {expected_gyro}");
    }
    let shaken = samples.iter().filter(|(accel, gyro)| accel.horizontal().norm() > 0.5 && gyro.norm() > 0.05).count();
    assert!(shaken > 100, "there is something to compare: {shaken}");
}

#[test]
fn samples_come_at_the_configured_rate_and_a_late_reader_gets_every_one() {
    let image = stand_in_image();
    for (rate, period) in [(Rate::Hz400, 2_500.0), (Rate::Hz200, 5_000.0), (Rate::Hz100, 10_000.0)] {
        let simulation = standing();
        let clock = &simulation.clock;
        let (port, _) = soldered(&simulation, 1);
        let mut imu = driver(port, clock, &image, Config { rate, ..Config::default() });
        let (mut before, mut late) = (None, 0.0);
        for number in 0..200 {
            if number % 50 == 49 {
                // 80 ms at 400 Hz, more at the other rates.
                late = 32.0 * period;
                clock.advance_to(clock.now() + Duration::from_micros(late as u64));
            }
            let sample = block_on(clock, imu.next()).expect("a sample");
            assert!((sample.data.accel.z + 9.81).abs() < 0.6 && sample.data.gyro.norm() < 0.05, "{sample:?}");
            if let Some(before) = before.replace(sample.at) {
                let step = sample.at.since(before).as_micros() as f64;
                // 2 % of the chip's clock, two ticks, and the clock error accumulated without
                // polling.
                let error = (step - period).abs();
                assert!(
                    error < 0.02 * (period + late) + 80.0,
                    "{rate:?} {number}: {step} µs, none missing, none twice"
                );
            }
            late = (late - period).max(0.0);
        }
    }
}

#[test]
fn the_self_tests_tell_a_healthy_chip_from_a_broken_one() {
    let image = stand_in_image();
    for broken in [false, true] {
        let simulation = standing();
        let clock = &simulation.clock;
        let (port, attached) = soldered(&simulation, 1);
        attached.set_broken(broken);
        let mut imu = driver(port, clock, &image, Config::default());
        let expected = if broken { Err(ChipError::SelfTest) } else { Ok(()) };
        let (took, outcome) = timed(clock, imu.self_test());
        assert_eq!(outcome, expected);
        assert!(took < Duration::from_millis(180), "{took}");
        assert_eq!(attached.peek(0x6D), 0, "no force is left");
        let (took, outcome) = timed(clock, imu.gyro_self_test());
        assert_eq!(outcome, expected);
        assert!(took < Duration::from_millis(700), "{took}");
        let sample = block_on(clock, imu.next()).expect("set up again");
        assert!(broken || (sample.data.accel.z + 9.81).abs() < 0.6, "{sample:?}");
    }
}

#[test]
fn over_i2c_it_measures_the_same() {
    let image = stand_in_image();
    // Chips with clocks up to 2 % fast and slow.
    for seed in 1..=12 {
        let simulation = standing();
        let clock = &simulation.clock;
        let bus = I2cBus::new(clock, 1);
        let attached = bus.attach(0x68, chips::Bmi270::new(&simulation.world, clock, seed, 1.0, &image));
        let mut imu = Bmi270::i2c(bus, 0x68, clock.clone(), &image, mounting::IMU, Config::default());
        let samples: Vec<_> = (0..400).map(|_| block_on(clock, imu.next()).expect("a sample")).collect();
        assert_eq!(registers(&attached, 0x40), [0xAC, 0x02, 0xEC, 0x00]);
        assert!(samples.iter().all(|sample| (sample.data.accel.z + 9.81).abs() < 0.6), "gravity");
        let mean = samples[399].at.since(samples[0].at).as_micros() as f64 / 399.0;
        assert!((mean / 2_500.0 - 1.0).abs() < 0.025, "{mean} µs between samples");
        for (number, sample) in samples.iter().enumerate() {
            // One tick, and the address bytes on the bus.
            let error = sample.at.as_micros() as f64 - samples[0].at.as_micros() as f64 - mean * number as f64;
            assert!(error.abs() < 2.0 * (40.0 + 40.0), "seed {seed}, sample {number}: {error} µs off the rhythm");
        }
    }
}

#[test]
fn beside_a_floating_select_it_hardly_ever_starts_until_that_is_driven() {
    let image = stand_in_image();
    let simulation = standing();
    let (world, clock) = (&simulation.world, &simulation.clock);
    let bus = SpiBus::new(clock, 1);
    let (port, _) = bus.attach(10_000_000, chips::Bmi270::new(world, clock, 1, 1.0, &image));
    let (flow, _) = bus.attach_floating(2_000_000, chips::Pmw3901::new(world, clock, 1));
    let mut imu = driver(port, clock, &image, Config::default());
    let starts: Vec<_> = (0..20).map(|_| timed(clock, imu.start())).collect();
    let failed = starts.iter().filter(|(_, outcome)| outcome.is_err()).count();
    assert!(failed >= 12, "{failed} of 20: {starts:?}");
    assert!(starts.iter().all(|(took, _)| *took < Duration::from_millis(220)), "none hangs: {starts:?}");
    flow.park();
    assert_eq!(block_on(clock, imu.start()), Ok(()));
    assert!((0..100).all(|_| block_on(clock, imu.next()).is_ok()));
}
