//! Sensor readings compared with the truth.

use core::f32::consts::PI;
use nalgebra::{UnitQuaternion, Vector3};
use stampfly_drivers::{Barometer, Imu, Magnetometer, OpticalFlow, PowerMonitor, RangeFinder};
use stampfly_sim::plant::{PlantParameters, Pose, WindConfig};
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::{Duration, Instant, Vec3, math};

/// A vehicle without weight, motors and air: it keeps its velocity and its rotation.
fn drifting(seed: u64, pose: Pose) -> Simulation {
    let plant = PlantParameters {
        gravity: 0.0,
        ground_height: 0.005,
        drag_quadratic: 0.0,
        drag_rotation: 0.0,
        inertia_x: 1e-5,
        inertia_y: 1e-5,
        inertia_z: 1e-5,
        ..PlantParameters::EXAMPLE
    };
    let pose = Some(Pose { rotors: 0.0, ..pose });
    Simulation::new(&SimulationConfig { seed, plant, wind: WindConfig::CALM, pose, ..SimulationConfig::example() })
}

fn standing(seed: u64) -> Simulation {
    Simulation::new(&SimulationConfig { seed, wind: WindConfig::CALM, ..SimulationConfig::example() })
}

fn mean_and_deviation(values: &[f32]) -> (f32, f32) {
    let n = values.len() as f64;
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    let variance = values.iter().map(|v| (f64::from(*v) - mean) * (f64::from(*v) - mean)).sum::<f64>() / n;
    (mean as f32, variance.sqrt() as f32)
}

#[test]
fn the_inertial_sensor_at_rest_reads_gravity_and_its_offsets() {
    for seed in 1..=8 {
        let mut simulation = standing(seed);
        let clock = simulation.clock.clone();
        let (accel_bias, gyro_bias) = simulation.sensors.imu.bias();
        let mut channels: [Vec<f32>; 6] = Default::default();
        let mut times = Vec::new();
        for _ in 0..4000 {
            let Ok(sample) = block_on(&clock, simulation.sensors.imu.next());
            times.push(sample.at);
            let age = clock.now().since(sample.at);
            assert!(
                (Duration::from_micros(1_900)..Duration::from_micros(2_200)).contains(&age),
                "three chip samples and the read-out: {age}"
            );
            let values = sample.data.accel.iter().chain(sample.data.gyro.iter());
            channels.iter_mut().zip(values).for_each(|(channel, value)| channel.push(*value));
        }
        let rate = 3999.0 / times[3999].since(times[0]).seconds();
        assert!((392.0..408.0).contains(&rate), "{rate} Hz");
        let expected = [accel_bias.x, accel_bias.y, accel_bias.z - 9.80665, gyro_bias.x, gyro_bias.y, gyro_bias.z];
        for (axis, (channel, expected)) in channels.iter().zip(expected).enumerate() {
            let (mean, deviation) = mean_and_deviation(channel);
            // Scale and misalignment of 0.5 % act on the accelerometer's 9.8 m/s².
            let (tolerance, noise) = if axis < 3 { (0.06, 0.014) } else { (5e-4, 0.0017) };
            assert!((mean - expected).abs() < tolerance, "axis {axis}: {mean} instead of {expected}");
            assert!((deviation / noise - 1.0).abs() < 0.25, "axis {axis}: {deviation}");
            assert!(gyro_bias.amax() <= PI / 180.0);
        }
    }
}

#[test]
fn the_inertial_sensor_follows_a_turn_and_saturates_beyond_its_range() {
    for (rate, expected) in [(10.0f64, 10.0f32), (60.0, 32767.0 / 16.4 * PI / 180.0)] {
        let pose = Pose { rate: Vector3::new(0.0, 0.0, rate), ..Pose::hovering(10.0) };
        let mut simulation = drifting(3, pose);
        let clock = simulation.clock.clone();
        for _ in 0..100 {
            let Ok(sample) = block_on(&clock, simulation.sensors.imu.next());
            assert!((sample.data.gyro.z - expected).abs() < 0.1, "{} for {rate}", sample.data.gyro.z);
        }
    }
}

#[test]
fn the_range_is_the_slant_range_to_the_floor() {
    for (roll, pitch) in [(0.0, 0.0), (0.3, 0.0), (0.0, -0.4), (0.2, 0.5)] {
        let attitude = UnitQuaternion::from_euler_angles(roll, pitch, 1.0);
        let mut simulation = drifting(4, Pose { attitude, ..Pose::hovering(1.2) });
        let clock = simulation.clock.clone();
        let ranges: Vec<f32> = (0..60)
            .map(|_| {
                let Ok(sample) = block_on(&clock, simulation.sensors.tof.next());
                let age = clock.now().since(sample.at).seconds();
                assert!((0.018..0.022).contains(&age), "half a measurement and the read-out: {age}");
                sample.data
            })
            .filter(|data| data.valid)
            .map(|data| data.distance)
            .collect();
        assert!(ranges.len() >= 55);
        let (mean, deviation) = mean_and_deviation(&ranges);
        let expected = 1.2 / (roll.cos() * pitch.cos()) as f32;
        assert!((mean - expected).abs() < 0.005, "{mean} instead of {expected}");
        assert!(deviation < 0.005);
    }
}

#[test]
fn a_range_while_climbing_is_valid_for_its_time_stamp() {
    let pose = Pose { velocity: Vector3::new(0.0, 0.0, -1.0), ..Pose::hovering(0.5) };
    let mut simulation = drifting(5, pose);
    let clock = simulation.clock.clone();
    for _ in 0..60 {
        let Ok(sample) = block_on(&clock, simulation.sensors.tof.next());
        let expected = 0.5 + sample.at.since(Instant::ZERO).seconds();
        let error = (sample.data.distance - expected).abs();
        assert!(!sample.data.valid || error < 0.02, "{} instead of {expected}", sample.data.distance);
    }
}

#[test]
fn ranges_too_near_too_far_or_into_the_sky_are_not_vouched_for() {
    let upside_down = UnitQuaternion::from_euler_angles(core::f64::consts::PI, 0.0, 0.0);
    let level = UnitQuaternion::identity();
    for (height, attitude) in [(0.015, level), (4.2, level), (30.0, level), (1.0, upside_down)] {
        let mut simulation = drifting(6, Pose { attitude, ..Pose::hovering(height) });
        let clock = simulation.clock.clone();
        for _ in 0..20 {
            let Ok(sample) = block_on(&clock, simulation.sensors.tof.next());
            assert!(!sample.data.valid && sample.data.status != 0, "{height} m: {:?}", sample.data);
        }
    }
}

/// Sum of the flow over about five seconds, and the duration.
fn sweep(simulation: &mut Simulation) -> (f32, f32, f32) {
    let clock = simulation.clock.clone();
    let mut sum = (0.0, 0.0, 0.0);
    for _ in 0..500 {
        let Ok(sample) = block_on(&clock, simulation.sensors.flow.next());
        assert!(sample.data.valid && sample.data.quality > 60);
        sum.0 += sample.data.delta_x;
        sum.1 += sample.data.delta_y;
        sum.2 += sample.data.interval;
        let counts = sample.data.delta_x / 0.00222;
        assert!((counts - counts.round()).abs() < 1e-3, "whole counts");
    }
    sum
}

#[test]
fn flow_is_velocity_over_height_forward_and_right_positive() {
    for seed in 1..=5 {
        let pose = Pose { velocity: Vector3::new(0.4, -0.3, 0.0), ..Pose::hovering(0.8) };
        let (x, y, time) = sweep(&mut drifting(seed, pose));
        let (expected_x, expected_y) = (0.4 / 0.8 * time, -0.3 / 0.8 * time);
        // 3 % of scale and 1° of mounting belong to the specimen; the noise of the sum is 0.01 rad.
        assert!((x - expected_x).abs() < 0.03 * expected_x + 0.07, "{x} instead of {expected_x}");
        assert!((y - expected_y).abs() < -0.03 * expected_y + 0.09, "{y} instead of {expected_y}");
        assert!((x / expected_x - 1.0).abs() < 0.06 && (y / expected_y - 1.0).abs() < 0.08);
    }
}

#[test]
fn flow_holds_the_rotation_with_the_signs_of_its_message() {
    // Pitching up adds to x, rolling right subtracts from y.
    let pose = Pose { rate: Vector3::new(0.0, 0.1, 0.0), ..Pose::hovering(1.0) };
    let (x, y, time) = sweep(&mut drifting(7, pose));
    assert!((x / (0.1 * time) - 1.0).abs() < 0.1 && y.abs() < 0.1, "{x} {y}");
    let pose = Pose { rate: Vector3::new(0.1, 0.0, 0.0), ..Pose::hovering(1.0) };
    let (x, y, time) = sweep(&mut drifting(7, pose));
    assert!((y / (-0.1 * time) - 1.0).abs() < 0.1 && x.abs() < 0.1, "{x} {y}");
}

#[test]
fn flow_sees_no_motion_on_the_floor_and_nothing_far_above_it() {
    let pose = Pose { velocity: Vector3::new(0.05, 0.0, 0.0), ..Pose::hovering(0.03) };
    let mut simulation = drifting(8, pose);
    let clock = simulation.clock.clone();
    let mut sum = 0.0;
    for _ in 0..100 {
        let Ok(sample) = block_on(&clock, simulation.sensors.flow.next());
        sum += sample.data.delta_x;
    }
    // The sum of the measured flow is noise, while 1.7 rad passed.
    assert!(sum.abs() < 0.03, "{sum}");
    let mut simulation = drifting(8, Pose::hovering(5.0));
    let clock = simulation.clock.clone();
    let Ok(sample) = block_on(&clock, simulation.sensors.flow.next());
    assert!(!sample.data.valid && sample.data.quality == 0);
}

#[test]
fn a_late_flow_reader_loses_no_motion() {
    let pose = Pose { velocity: Vector3::new(0.5, 0.0, 0.0), ..Pose::hovering(1.0) };
    let mut simulation = drifting(9, pose);
    let clock = simulation.clock.clone();
    let (mut swept, mut time) = (0.0, 0.0);
    for pause in 0..100u64 {
        clock.advance_to(clock.now() + Duration::from_millis(pause % 7 * 8));
        let Ok(sample) = block_on(&clock, simulation.sensors.flow.next());
        swept += sample.data.delta_x;
        time += sample.data.interval;
    }
    assert!((swept / (0.5 * time) - 1.0).abs() < 0.06, "{swept} in {time} s");
}

#[test]
fn the_field_turns_with_the_vehicle_around_its_hard_iron() {
    let mut headings = Vec::new();
    for yaw in [0.0, 1.0, 2.5] {
        let pose = Pose::standing(&PlantParameters::EXAMPLE, yaw);
        let mut simulation = Simulation::new(&SimulationConfig { pose: Some(pose), ..SimulationConfig::example() });
        let clock = simulation.clock.clone();
        let hard_iron = simulation.sensors.mag.hard_iron();
        let sum = (0..50).fold(Vec3::zeros(), |sum, _| {
            let Ok(sample) = block_on(&clock, simulation.sensors.mag.next());
            sum + sample.data.field - hard_iron
        });
        let field = sum / 50.0;
        assert!((field.norm() - 47.9).abs() < 1.0, "{field}");
        headings.push(-math::atan2(field.y, field.x) - yaw as f32);
    }
    let declination = headings[0];
    assert!((declination - 0.139).abs() < 0.03, "8° west, so the needle sits left of north: {declination}");
    for heading in headings {
        assert!((math::wrap_angle(heading - declination)).abs() < 0.03, "{heading}");
    }
}

#[test]
fn the_barometer_reports_each_conversion_once_and_feels_a_metre() {
    let altitude = |height: f64| {
        let mut simulation = drifting(10, Pose::hovering(height));
        let clock = simulation.clock.clone();
        let mut last = Instant::ZERO;
        let values: Vec<f32> = (0..200)
            .map(|_| {
                let Ok(sample) = block_on(&clock, simulation.sensors.baro.next());
                assert!(last == Instant::ZERO || (0.068..0.080).contains(&sample.at.since(last).seconds()));
                last = sample.at;
                sample.data.altitude
            })
            .collect();
        mean_and_deviation(&values)
    };
    let ((low, noise), (high, _)) = (altitude(1.0), altitude(11.0));
    assert!((high - low - 10.0).abs() < 0.3, "{low} {high}");
    assert!((0.04..0.25).contains(&noise), "{noise}");
}

#[test]
fn the_battery_monitor_reads_what_the_board_draws() {
    let mut simulation = standing(11);
    let clock = simulation.clock.clone();
    for _ in 0..20 {
        let Ok(sample) = block_on(&clock, simulation.sensors.power.next());
        assert!(
            (sample.data.current - PlantParameters::EXAMPLE.board_current as f32).abs() < 0.02,
            "{:?}",
            sample.data
        );
        assert!((sample.data.voltage - 4.34).abs() < 0.03, "{:?}", sample.data);
        assert!((sample.data.power - sample.data.voltage * sample.data.current).abs() < 1e-6);
    }
}

#[test]
fn a_read_that_was_given_up_loses_no_sample() {
    use core::future::Future;
    use core::task::{Context, Waker};
    let (mut given_up, mut patient) = (standing(12), standing(12));
    let (clock, other) = (given_up.clock.clone(), patient.clock.clone());
    for _ in 0..20 {
        {
            let mut future = core::pin::pin!(given_up.sensors.tof.next());
            assert!(future.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending());
        }
        let Ok(one) = block_on(&clock, given_up.sensors.tof.next());
        let Ok(two) = block_on(&other, patient.sensors.tof.next());
        assert_eq!(one, two);
    }
}
