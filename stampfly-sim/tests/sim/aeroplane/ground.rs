//! Aeroplane on the runway: steering, braking, coasting, and contact of its parts.

use super::{PERFECT, heading, roll, with};
use nalgebra::Vector3;
use stampfly_sim::plant::{Aeroplane, Pose, Surface, WindConfig};

/// Rolls north at a speed, after one second in which springs and tyres settle.
fn rolling(speed: f64, surfaces: &[(Surface, f64)]) -> Aeroplane {
    let standing = PERFECT.standing([0.0; 2], 0.0);
    let pose = Pose { velocity: Vector3::new(speed, 0.0, 0.0), ..standing };
    let mut plane = Aeroplane::new(&PERFECT, &WindConfig::CALM, Some(&pose), 1);
    plane.set_surfaces(with(surfaces));
    plane
}

fn run(plane: &mut Aeroplane, seconds: f64) {
    (0..(seconds * 1600.0) as u32).for_each(|_| plane.step());
}

#[test]
fn it_coasts_straight_without_a_pilot_and_comes_to_rest() {
    let mut plane = rolling(5.0, &[]);
    run(&mut plane, 15.0);
    let motion = plane.motion();
    // v² / (2·μ·g) = 15.9 m, less the effect of aerodynamic drag.
    assert!((12.0..16.0).contains(&motion.position.x) && motion.velocity.norm() < 1e-4, "{motion:?}");
    assert!(motion.position.y.abs() < 1e-6 && heading(&plane).abs() < 1e-6);
}

#[test]
fn it_turns_as_the_nose_wheel_and_the_wheelbase_say() {
    for (share, side) in [(-0.5, 1.0), (0.5, -1.0)] {
        let mut plane = rolling(2.0, &[(Surface::Rudder, share)]);
        run(&mut plane, 0.5);
        let (before, start) = (heading(&plane), plane.motion().velocity.norm());
        run(&mut plane, 0.5);
        let rate = (heading(&plane) - before) / 0.5;
        let speed = 0.5 * (start + plane.motion().velocity.norm());
        // Bicycle model: speed · tan(angle) / wheelbase.
        let expected = speed * (0.1f64).tan() / (PERFECT.gear_nose + PERFECT.gear_main);
        assert!((rate * side / expected - 1.0).abs() < 0.1, "{rate} rad/s, expected {expected}");
        assert!(plane.gear().wheels() == [true; 3] && roll(&plane).abs() < 0.05);
    }
}

#[test]
fn brakes_stop_it_in_a_third_of_the_way_and_without_tipping() {
    let mut plane = rolling(5.0, &[(Surface::Brake, 1.0)]);
    run(&mut plane, 8.0);
    let (way, motion) = (plane.motion().position.x, plane.motion());
    assert!((3.0..6.0).contains(&way) && motion.velocity.norm() < 1e-4, "{motion:?}");
    assert_eq!(plane.gear().strikes(), 0);
    // The brakes also hold against power that otherwise moves the aeroplane.
    let moved = |surfaces: &[(Surface, f64)]| {
        let mut plane = rolling(0.0, surfaces);
        run(&mut plane, 1.0);
        plane.set_duty(0.35);
        run(&mut plane, 3.0);
        plane.motion().position.x
    };
    let (free, braked) = (moved(&[]), moved(&[(Surface::Brake, 1.0)]));
    assert!(free > 1.0 && braked < 0.01, "{free} m, {braked} m");
}

#[test]
fn a_wing_that_touches_is_a_strike_and_a_landing_on_wheels_is_none() {
    let trim = Aeroplane::trim(&PERFECT, 7.0, -0.05).expect("flies");
    let land = |bank: f64| {
        let mut pose = trim.pose(0.6, 0.0);
        let (sin, cos) = (0.5 * bank).sin_cos();
        let bank = nalgebra::Quaternion::new(cos, sin, 0.0, 0.0);
        pose.attitude *= nalgebra::UnitQuaternion::new_normalize(bank);
        let mut plane = Aeroplane::new(&PERFECT, &WindConfig::CALM, Some(&pose), 1);
        plane.settle(&trim);
        run(&mut plane, 3.0);
        plane
    };
    let level = land(0.0);
    assert!(level.gear().contact() && level.gear().strikes() == 0, "{:?}", level.gear());
    assert!(land(0.9).gear().strikes() > 0);
}

#[test]
fn a_cross_wind_pushes_but_does_not_turn_it_over() {
    let wind = WindConfig { mean: stampfly_types::Vec3::new(0.0, 8.0, 0.0), gust: 0.0, ..WindConfig::MEADOW };
    let mut plane = Aeroplane::new(&PERFECT, &wind, Some(&PERFECT.standing([0.0; 2], 0.0)), 1);
    run(&mut plane, 20.0);
    assert!(roll(&plane).abs() < 0.05 && plane.gear().strikes() == 0, "{:?}", plane.motion());
}

/// Regression: the propeller used to turn in the ground and pull the overturned aeroplane along.
#[test]
fn a_propeller_that_touches_the_ground_stands_and_takes_the_current_of_a_stall() {
    let turned = |angle: f64, axis: Vector3<f64>| {
        let (sin, cos) = (0.5 * angle).sin_cos();
        let axis = axis * sin;
        nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(cos, axis.x, axis.y, axis.z))
    };
    let lay = |attitude, height: f64| {
        let standing = PERFECT.standing([0.0; 2], 0.0);
        let pose = Pose { position: Vector3::new(0.0, 0.0, -height), attitude, rotors: 0.5, ..standing };
        let mut plane = Aeroplane::new(&PERFECT, &WindConfig::CALM, Some(&pose), 1);
        plane.set_duty(0.8);
        run(&mut plane, 3.0);
        plane
    };
    for (attitude, height) in [(turned(core::f64::consts::PI, Vector3::x()), 0.2), (turned(-1.3, Vector3::y()), 0.35)] {
        let plane = lay(attitude, height);
        assert!(plane.propeller().speed() < 1.0 && plane.gear().scrapes() > 0, "{:?}", plane.motion());
        assert!(plane.motion().current > 0.8 * 0.8 * 9.0 / PERFECT.motor_resistance, "{:?}", plane.motion());
        assert!(plane.motion().velocity.norm() < 0.1, "nothing pulls it: {:?}", plane.motion());
    }
    let mut plane = rolling(0.0, &[(Surface::Brake, 1.0)]);
    plane.set_duty(0.35);
    run(&mut plane, 2.0);
    assert!(plane.propeller().speed() > 300.0 && plane.gear().scrapes() == 0, "{:?}", plane.motion());
}

#[test]
fn the_skid_is_there_to_touch() {
    let standing = PERFECT.standing([0.0; 2], 0.0);
    let (sin, cos) = 0.15f64.sin_cos();
    let nose_up = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(cos, 0.0, sin, 0.0));
    let pose = Pose { attitude: nose_up, ..standing };
    let mut plane = Aeroplane::new(&PERFECT, &WindConfig::CALM, Some(&pose), 1);
    run(&mut plane, 2.0);
    assert!(plane.gear().strikes() > 0 && plane.gear().scrapes() == 0, "{:?}", plane.gear());
}
