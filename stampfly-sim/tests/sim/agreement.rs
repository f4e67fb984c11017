//! Drivers on emulated chips agree with the sensor models in the same flight.
//!
//! Both members of each pair are the same specimen, given by the seed, but sample at their own
//! instants and draw their own noise. The mean difference has to be within the resolution of the
//! sensor.

use crate::{mounting, pilot};
use core::cell::RefCell;
use embedded_hal::digital::OutputPin;
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::chip::vl53l3cx::{self, BootAddress, Vl53l3cx};
use stampfly_drivers::{Barometer, Imu, Magnetometer, MotorOutputs, OpticalFlow, PowerMonitor, RangeFinder, Sample};
use stampfly_sim::chips::{Board, stand_in_image};
use stampfly_sim::plant::{PlantParameters, Pose, WindConfig};
use stampfly_sim::sensors::Sensors;
use stampfly_sim::time::{Tasks, block_on};
use stampfly_sim::{Conditions, Simulation, SimulationConfig};
use stampfly_types::{Duration, Instant};

/// Samples of one source: instants and channels.
type Series<const N: usize> = Vec<(Instant, [f32; N])>;

/// The flight: one second on the ground, climb to 0.8 m, hover in gusts.
const END: Instant = Instant::from_secs(14);
/// Start of the comparison: all drivers run and the vehicle hovers.
const BEGIN: Instant = Instant::from_secs(3);

/// Counts of the inertial sensor: ±8 g and ±2000 °/s in 16 bits.
const IMU: [f32; 6] = [0.0024, 0.0024, 0.0024, 0.001, 0.001, 0.001];

/// Value of a series at this instant, by linear interpolation.
fn at<const N: usize>(series: &Series<N>, instant: Instant) -> Option<[f32; N]> {
    let after = series.partition_point(|(at, _)| *at < instant);
    let ((begin, before), (end, next)) = (series.get(after.checked_sub(1)?)?, series.get(after)?);
    let share = instant.since(*begin).seconds() / end.since(*begin).seconds().max(1e-6);
    Some(core::array::from_fn(|n| before[n] + (next[n] - before[n]) * share))
}

/// Mean difference of each channel, driver minus model.
fn difference<const N: usize>(driver: &Series<N>, model: &Series<N>) -> [f32; N] {
    let compared = driver.iter().filter(|(at, _)| *at >= BEGIN);
    let differences: Vec<[f32; N]> = compared
        .filter_map(|(instant, values)| at(model, *instant).map(|m| core::array::from_fn(|n| values[n] - m[n])))
        .collect();
    let sum = differences.iter().fold([0.0; N], |sum, d| core::array::from_fn(|n| sum[n] + d[n]));
    assert!(differences.len() > 100, "there is something to compare");
    sum.map(|s| s / differences.len() as f32)
}

/// Running sums from the start of the comparison to each instant.
fn summed(series: &Series<2>) -> Series<2> {
    let mut sum = [0.0; 2];
    let add = |(at, [x, y]): &(Instant, [f32; 2])| {
        sum = [sum[0] + x, sum[1] + y];
        (*at, sum)
    };
    series.iter().filter(|(at, _)| *at >= BEGIN).map(add).collect()
}

macro_rules! watch {
    ($tasks:ident, $sensor:expr, $into:ident, $channels:expr) => {{
        let (mut sensor, into) = ($sensor, &$into);
        $tasks.spawn(async move {
            loop {
                let Sample { at, data } = sensor.next().await.expect("no fault is simulated");
                into.borrow_mut().extend($channels(data).map(|channels| (at, channels)));
            }
        });
    }};
}

#[test]
fn drivers_and_models_report_the_same_flight() {
    for seed in 1..=6 {
        // Counts accumulate, and so does their noise: four standard deviations of the difference
        // after eleven seconds.
        compare(&SimulationConfig { seed, ..SimulationConfig::example() }, [80.0, 2.5, 0.004]);
    }
}

/// Scale, offset, lever and mounting belong to the specimen. Draughts differ between sensors and
/// picture errors between pictures: a tenth of the flow accumulated in eleven seconds of hover.
#[test]
fn drivers_and_models_are_the_same_specimen_in_the_harsh_world() {
    for seed in 1..=4 {
        let drawn = SimulationConfig { seed, ..SimulationConfig::example() }.in_harsh_world().conditions;
        // The pilot of this test needs a nominal airframe; only the sensors are harsh.
        let conditions = Conditions {
            mass_spread: 0.0,
            thrust_spread: 0.0,
            rotor_spread: 0.02,
            rotor_curve_spread: 0.0,
            centre_spread: 0.0004,
            ..drawn
        };
        compare(&SimulationConfig { seed, conditions, ..SimulationConfig::example() }, [250.0, 5.0, 0.008]);
    }
}

/// Limits of flow, pressure and current: counts, Pa, A.
fn compare(config: &SimulationConfig, [counts, pressure, current]: [f32; 3]) {
    let seed = config.seed;
    let image = stand_in_image();
    let Simulation { clock, world, sensors } = Simulation::new(config);
    let board = Board::new(&world, &clock, config, &image);
    let Sensors { imu, flow, tof, mag, baro, power, mut motors, .. } = sensors;
    // All chips have started.
    clock.advance_to(Instant::from_millis(60));

    let [imu_driver, imu_model] = [const { RefCell::new(Series::<6>::new()) }; 2];
    let [flow_driver, flow_model] = [const { RefCell::new(Series::<2>::new()) }; 2];
    let [mag_driver, mag_model] = [const { RefCell::new(Series::<3>::new()) }; 2];
    let [baro_driver, baro_model] = [const { RefCell::new(Series::<1>::new()) }; 2];
    let [range_driver, range_model] = [const { RefCell::new(Series::<1>::new()) }; 2];
    let [power_driver, power_model] = [const { RefCell::new(Series::<2>::new()) }; 2];
    let mut tasks = Tasks::new(clock.clone());
    let time = || clock.clone();
    let driver = Bmi270::spi(board.imu, time(), &image, mounting::IMU, bmi270::Config::default());
    let imu_channels = |data: stampfly_types::messages::ImuData| {
        let (a, g) = (data.accel, data.gyro);
        Some([a.x, a.y, a.z, g.x, g.y, g.z])
    };
    watch!(tasks, driver, imu_driver, imu_channels);
    watch!(tasks, imu, imu_model, imu_channels);
    let driver = Pmw3901::new(board.flow, time(), mounting::FLOW, pmw3901::Config::default());
    let flow_channels = |data: stampfly_types::messages::FlowData| Some([data.delta_x, data.delta_y]);
    watch!(tasks, driver, flow_driver, flow_channels);
    watch!(tasks, flow, flow_model, flow_channels);
    let axes = mounting::MAGNETOMETER;
    let driver = Bmm150::i2c(board.i2c.clone(), Bmm150::ALL_LOW, time(), axes, bmm150::Config::default());
    let mag_channels = |data: stampfly_types::messages::MagData| Some([data.field.x, data.field.y, data.field.z]);
    watch!(tasks, driver, mag_driver, mag_channels);
    watch!(tasks, mag, mag_model, mag_channels);
    let driver = Bmp280::i2c(board.i2c.clone(), Bmp280::SDO_LOW, time(), bmp280::Config::default());
    let baro_channels = |data: stampfly_types::messages::BaroData| Some([data.pressure]);
    watch!(tasks, driver, baro_driver, baro_channels);
    watch!(tasks, baro, baro_model, baro_channels);
    let boot = BootAddress::new();
    let (i2c, shutdown) = (board.i2c.clone(), board.shutdown_bottom);
    // The front range finder stays in reset, because both have the same address after power-on.
    let mut shutdown_front = board.shutdown_front;
    let Ok(()) = shutdown_front.set_low();
    let driver = Vl53l3cx::new(i2c, shutdown, &boot, 0x30, time(), vl53l3cx::Config::default());
    let range_channels = |data: stampfly_types::messages::TofData| data.valid.then_some([data.distance]);
    watch!(tasks, driver, range_driver, range_channels);
    watch!(tasks, tof, range_model, range_channels);
    let driver = Ina3221::new(board.i2c, Ina3221::A0_GROUND, time(), ina3221::Config::default());
    let power_channels = |data: stampfly_types::messages::PowerData| Some([data.voltage, data.current]);
    watch!(tasks, driver, power_driver, power_channels);
    watch!(tasks, power, power_model, power_channels);
    let pilot_clock = clock.clone();
    let pilot_world = world.clone();
    tasks.spawn(async move {
        loop {
            let now = pilot_clock.now();
            let truth = pilot_world.truth_at(now);
            if now > Instant::from_secs(1) {
                let Ok(()) = motors.write(&pilot::fly(&truth, -0.8));
            }
            pilot_clock.sleep_until(now + Duration::from_micros(2_500)).await;
        }
    });
    tasks.run_until(END);
    drop(tasks);
    assert!((world.truth_at(END).position.z + 0.8).abs() < 0.2, "it hovers");

    let close = |name: &str, difference: &[f32], resolution: &[f32]| {
        for (channel, (difference, resolution)) in difference.iter().zip(resolution).enumerate() {
            assert!(difference.abs() <= *resolution, "seed {seed}, {name} {channel}: {difference} beyond {resolution}");
        }
    };
    close("imu", &difference(&imu_driver.borrow(), &imu_model.borrow()), &IMU);
    close("mag", &difference(&mag_driver.borrow(), &mag_model.borrow()), &[0.3; 3]);
    // Each draws its own drift: 0.12 Pa/√s, four standard deviations of the difference after
    // fourteen seconds.
    close("baro", &difference(&baro_driver.borrow(), &baro_model.borrow()), &[pressure]);
    close("power", &difference(&power_driver.borrow(), &power_model.borrow()), &[0.008, current]);
    // Resolution: 1 mm.
    close("range", &difference(&range_driver.borrow(), &range_model.borrow()), &[0.001]);
    close("flow", &difference(&summed(&flow_driver.borrow()), &summed(&flow_model.borrow())), &[counts * 0.00222; 2]);
}

#[test]
fn drivers_and_models_say_the_same_of_a_range_that_is_none() {
    // Too near, near, too far for the signal, no target.
    for (height, status) in [(0.015, 4), (1.0, 0), (4.2, 2), (30.0, 2)] {
        let plant =
            PlantParameters { gravity: 0.0, ground_height: 0.005, drag_quadratic: 0.0, ..PlantParameters::EXAMPLE };
        let pose = Some(Pose { rotors: 0.0, ..Pose::hovering(height) });
        let config = SimulationConfig { plant, wind: WindConfig::CALM, pose, ..SimulationConfig::example() };
        let Simulation { clock, world, mut sensors } = Simulation::new(&config);
        let board = Board::new(&world, &clock, &config, &stand_in_image());
        let (boot, mut shutdown_front) = (BootAddress::new(), board.shutdown_front);
        let Ok(()) = shutdown_front.set_low();
        let range = vl53l3cx::Config::default();
        let mut driver = Vl53l3cx::new(board.i2c, board.shutdown_bottom, &boot, 0x30, clock.clone(), range);
        block_on(&clock, driver.next()).expect("the first one, which is not vouched for");
        for _ in 0..20 {
            let driven = block_on(&clock, driver.next()).expect("a measurement").data;
            let Ok(Sample { data: modelled, .. }) = block_on(&clock, sensors.tof.next());
            for data in [driven, modelled] {
                assert_eq!((data.status, data.valid), (status, status == 0), "{height} m: {driven:?} {modelled:?}");
            }
        }
    }
}
