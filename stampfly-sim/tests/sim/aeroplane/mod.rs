//! Aeroplane in flight, compared with flight mechanics computed without the simulator's force
//! models.

mod ground;
mod modes;

use nalgebra::{UnitQuaternion, Vector3};
use stampfly_sim::plant::{Aeroplane, AeroplaneParameters, Pose, SURFACES, Surface, Trim, WindConfig};

const PERFECT: AeroplaneParameters =
    AeroplaneParameters { manufacturing_spread: 0.0, propeller_spin: 0.0, ..AeroplaneParameters::EXAMPLE };

/// With the published mass and spring stiffness.
const PUBLISHED: AeroplaneParameters =
    AeroplaneParameters { manufacturing_spread: 0.0, propeller_spin: 0.0, ..AeroplaneParameters::ULTRA_STICK_25E };

fn fly(parameters: &AeroplaneParameters, trim: &Trim, height: f64) -> Aeroplane {
    let mut plane = Aeroplane::new(parameters, &WindConfig::CALM, Some(&trim.pose(height, 0.0)), 1);
    plane.settle(trim);
    plane
}

/// One step with the voltage of the trim.
fn step(plane: &mut Aeroplane, trim: &Trim) {
    plane.set_duty(trim.voltage / plane.battery().voltage());
    plane.step();
}

fn pitch(plane: &Aeroplane) -> f64 {
    -(plane.motion().attitude * Vector3::x()).z.asin()
}

fn roll(plane: &Aeroplane) -> f64 {
    let attitude = plane.motion().attitude;
    (attitude * Vector3::y()).z.atan2((attitude * Vector3::z()).z)
}

fn heading(plane: &Aeroplane) -> f64 {
    let nose = plane.motion().attitude * Vector3::x();
    nose.y.atan2(nose.x)
}

fn with(surfaces: &[(Surface, f64)]) -> [f64; SURFACES] {
    let mut shares = [0.0; SURFACES];
    surfaces.iter().for_each(|(surface, share)| shares[*surface as usize] = *share);
    shares
}

#[test]
fn trimmed_flight_holds_airspeed_and_height_for_a_minute() {
    for (airspeed, path) in [(7.0, 0.0), (10.0, 0.0), (15.0, 0.0), (15.0, 0.15), (8.0, -0.087)] {
        let trim = Aeroplane::trim(&PERFECT, airspeed, path).expect("flies");
        let mut plane = fly(&PERFECT, &trim, 200.0);
        for _ in 0..60 * 1600 {
            step(&mut plane, &trim);
        }
        let motion = plane.motion();
        let wanted = 200.0 + 60.0 * airspeed * path.sin();
        assert!((plane.airspeed() - airspeed).abs() < 0.02, "{airspeed} m/s: {}", plane.airspeed());
        assert!((-motion.position.z - wanted).abs() < 0.5, "{airspeed} m/s: {motion:?}");
        assert!((plane.alpha() - trim.alpha).abs() < 1e-3);
    }
}

/// Speeds grow with the square root of the mass: the laboratory flew the original at 17 to 19 m/s.
#[test]
fn as_heavy_as_published_it_flies_at_its_published_speeds() {
    let slowest = (80..120).map(|v| f64::from(v) * 0.1).find(|v| Aeroplane::trim(&PUBLISHED, *v, 0.0).is_ok());
    assert!(slowest.is_some_and(|v| (9.4..10.0).contains(&v)), "{slowest:?}");
    let trim = Aeroplane::trim(&PUBLISHED, 18.0, 0.0).expect("flies");
    assert!((0.0..0.06).contains(&trim.alpha) && trim.surfaces[2].abs() < 0.2, "{trim:?}");
    let mut plane = Aeroplane::new(&PUBLISHED, &WindConfig::CALM, None, 1);
    (0..8000).for_each(|_| plane.step());
    assert!((plane.motion().position.z + PUBLISHED.gear_height).abs() < 1e-4 && plane.motion().velocity.norm() < 1e-6);
}

/// The propeller's torque is balanced: after ten seconds without control the wings are nearly
/// level.
#[test]
fn trim_balances_the_propellers_torque() {
    let parameters = AeroplaneParameters { manufacturing_spread: 0.0, ..AeroplaneParameters::EXAMPLE };
    let trim = Aeroplane::trim(&parameters, 12.0, 0.0).expect("flies");
    let mut plane = fly(&parameters, &trim, 100.0);
    (0..16_000).for_each(|_| step(&mut plane, &trim));
    assert!(roll(&plane).abs() < 0.1 && trim.surfaces[0] < 0.0, "{} {trim:?}", roll(&plane));
    let surfaces = with(&[(Surface::Elevator, trim.surfaces[2])]);
    let mut alone = fly(&parameters, &Trim { surfaces, ..trim }, 100.0);
    (0..16_000).for_each(|_| step(&mut alone, &trim));
    assert!(roll(&alone) < -0.2, "without ailerons it rolls against the propeller: {}", roll(&alone));
}

#[test]
fn it_stalls_near_five_metres_a_second_and_recovers_by_itself() {
    let slowest = (400..700).map(|v| f64::from(v) * 0.01).find(|v| Aeroplane::trim(&PERFECT, *v, 0.0).is_ok());
    assert!(slowest.is_some_and(|v| (4.8..5.2).contains(&v)), "{slowest:?}");

    // Without power, with the nose raised continuously.
    let trim = Aeroplane::trim(&PERFECT, 7.0, 0.0).expect("flies");
    let mut plane = fly(&PERFECT, &trim, 100.0);
    let (mut slow, mut sinks) = (f64::MAX, 0.0f64);
    for i in 0..8 * 1600 {
        let up = trim.surfaces[2] - f64::from(i) / 1600.0 * 0.15;
        plane.set_surfaces(with(&[(Surface::Elevator, up.max(-1.0))]));
        plane.set_duty(0.0);
        plane.step();
        slow = slow.min(plane.airspeed());
        sinks = sinks.max(plane.motion().velocity.z);
    }
    assert!(slow < 5.0 && sinks > 2.0, "{slow} m/s, sinks at {sinks} m/s");
    // Released, it dives and flies again.
    for _ in 0..8 * 1600 {
        plane.set_surfaces(trim.surfaces);
        step(&mut plane, &trim);
    }
    assert!(plane.airspeed() > 5.5 && plane.alpha() < 0.2 && -plane.motion().position.z > 40.0, "{:?}", plane.motion());
}

#[test]
fn without_drag_and_thrust_energy_is_conserved() {
    let without = AeroplaneParameters {
        drag_0: 0.0,
        drag_induced: 0.0,
        drag_elevator: 0.0,
        thrust_0: 0.0,
        thrust_1: 0.0,
        thrust_2: 0.0,
        thrust_3: 0.0,
        ..PERFECT
    };
    let trim = Aeroplane::trim(&PERFECT, 10.0, 0.0).expect("flies");
    let mut pose = trim.pose(100.0, 0.0);
    pose.velocity.x += 2.0;
    let mut plane = Aeroplane::new(&without, &WindConfig::CALM, Some(&pose), 1);
    plane.settle(&trim);
    plane.set_duty(0.0);
    let energy = |plane: &Aeroplane| {
        let motion = plane.motion();
        0.5 * motion.velocity.norm_squared() - 9.80665 * motion.position.z
    };
    let (before, mut heights) = (energy(&plane), (f64::MAX, 0.0f64));
    for _ in 0..20 * 1600 {
        plane.step();
        let height = -plane.motion().position.z;
        heights = (heights.0.min(height), heights.1.max(height));
    }
    assert!(heights.1 - heights.0 > 3.0, "there was something to exchange: {heights:?}");
    // J/kg; the flight exchanges 50 of them.
    assert!((energy(&plane) - before).abs() < 0.5, "{} of {before}", energy(&plane) - before);
}

#[test]
fn left_and_right_are_mirrored() {
    let fly = |sign: f64| {
        let parameters = AeroplaneParameters { propeller_spin: sign, ..PERFECT };
        let trim = Aeroplane::trim(&parameters, 10.0, 0.0).expect("flies");
        let mut plane = fly(&parameters, &trim, 50.0);
        for _ in 0..3 * 1600 {
            let mut shares = trim.surfaces;
            (shares[0], shares[1]) = (shares[0] - 0.2 * sign, shares[1] + 0.2 * sign);
            shares[3] -= 0.1 * sign;
            plane.set_surfaces(shares);
            step(&mut plane, &trim);
        }
        plane
    };
    let (right, left) = (fly(1.0), fly(-1.0));
    let (r, l) = (right.motion(), left.motion());
    assert!(roll(&right) > 0.3 && heading(&right) > 0.3, "{r:?}");
    let mirrored = [
        r.position.x - l.position.x,
        r.position.y + l.position.y,
        r.position.z - l.position.z,
        r.rate.x + l.rate.x,
        r.rate.y - l.rate.y,
        r.rate.z + l.rate.z,
        roll(&right) + roll(&left),
        pitch(&right) - pitch(&left),
    ];
    assert!(mirrored.iter().all(|difference| difference.abs() < 1e-9), "{mirrored:?}");
}

#[test]
fn it_stands_still_on_the_runway() {
    for (wind, bound) in [(0.0, 1e-6_f64), (4.0, 1e-3)] {
        let wind = WindConfig { mean: stampfly_types::Vec3::new(-wind, wind, 0.0), ..WindConfig::MEADOW };
        let wind = WindConfig { gust: if bound < 1e-4 { 0.0 } else { wind.gust }, ..wind };
        let pose = PERFECT.standing([3.0, -2.0], 0.7);
        let mut plane = Aeroplane::new(&PERFECT, &wind, Some(&pose), 1);
        (0..8000).for_each(|_| plane.step());
        let after_settling = *plane.motion();
        (0..60 * 1600).for_each(|_| plane.step());
        let (motion, way) = (plane.motion(), (plane.motion().position - after_settling.position).norm());
        assert!(plane.gear().wheels() == [true; 3] && plane.gear().strikes() == 0);
        assert!((motion.position.z + PERFECT.gear_height).abs() < 2e-3, "{motion:?}");
        assert!(way < 10.0 * bound.max(1e-5), "{way} m in a minute in {wind:?}: {motion:?}");
        assert!((heading(&plane) - 0.7).abs() < 0.01);
    }
}

/// Take-off roll, rotation at 7 m/s and climb with a minimal autopilot; then a landing with power
/// off, and a stop.
#[test]
fn it_takes_off_lands_and_stops() {
    let parameters = AeroplaneParameters::EXAMPLE;
    let pose = parameters.standing([0.0; 2], 0.0);
    let mut plane = Aeroplane::new(&parameters, &WindConfig::CALM, Some(&pose), 3);
    plane.step();
    let (mut lifted_at, mut highest, mut touched) = (None, 0.0f64, None);
    let mut worst_drift = 0.0f64;
    let mut time = 0.0;
    for i in 0..120 * 1600 {
        time = f64::from(i) / 1600.0;
        let (speed, height) = (plane.airspeed(), -plane.motion().position.z);
        highest = highest.max(height);
        let grounded = plane.gear().contact();
        let descending = highest > 15.0;
        let want_pitch = match (descending, speed, height) {
            (false, v, _) if v < 7.0 && lifted_at.is_none() => 0.0,
            (false, ..) => 0.2,
            (true, _, h) if h > 1.5 => -0.08,
            // Flare.
            (true, ..) if touched.is_none() => 0.07,
            (true, ..) => 0.0,
        };
        let rate = plane.motion().rate;
        let elevator = -2.0 * (want_pitch - pitch(&plane)) + 0.15 * rate.y - 0.1;
        let aileron = 1.0 * roll(&plane) + 0.1 * rate.x;
        let rudder = if grounded { 2.0 * heading(&plane) + 0.3 * rate.z } else { 0.2 * rate.z };
        let brake = if touched.is_some() { 1.0 } else { 0.0 };
        let limit = |share: f64| share.clamp(-1.0, 1.0);
        plane.set_surfaces(with(&[
            (Surface::RightAileron, limit(aileron)),
            (Surface::LeftAileron, limit(-aileron)),
            (Surface::Elevator, limit(elevator)),
            (Surface::Rudder, limit(rudder)),
            (Surface::Brake, brake),
        ]));
        plane.set_duty(if descending { 0.0 } else { 0.85 });
        plane.step();
        if !grounded && lifted_at.is_none() {
            lifted_at = Some((time, plane.motion().position.x, speed));
        }
        if grounded && lifted_at.is_none() {
            worst_drift = worst_drift.max(plane.motion().position.y.abs());
        }
        if descending && grounded && touched.is_none() {
            touched = Some((time, plane.motion().velocity.z));
        }
        if touched.is_some() && plane.motion().velocity.norm() < 0.01 {
            break;
        }
    }
    println!("lifted {lifted_at:?}, highest {highest}, touched {touched:?}, stopped at {time} s");
    assert!(lifted_at.is_some_and(|(_, way, speed)| way < 40.0 && speed > 5.0), "{lifted_at:?}");
    assert!(worst_drift < 0.5, "rolled straight: {worst_drift} m");
    assert!(touched.is_some_and(|(_, sink)| sink < 1.5), "{touched:?}");
    assert!(time < 119.0 && plane.gear().strikes() == 0, "{time} s, {:?}", plane.gear());
}

/// For any controls and any ground contact, all values stay finite and bounded.
#[test]
fn no_crash_explodes() {
    for seed in 0..60u64 {
        let parameters = if seed < 40 { AeroplaneParameters::EXAMPLE } else { PUBLISHED };
        let mut noise = stampfly_sim::Noise::new(seed, 99);
        let axis = noise.normal3();
        let pose = Pose {
            position: Vector3::new(0.0, 0.0, -0.5 - 5.0 * noise.unit()),
            velocity: noise.normal3() * 8.0,
            attitude: UnitQuaternion::from_scaled_axis(axis),
            rate: noise.normal3() * 3.0,
            rotors: noise.unit(),
        };
        let mut plane = Aeroplane::new(&parameters, &WindConfig::MEADOW, Some(&pose), seed);
        for i in 0..20 * 1600 {
            if i % 80 == 0 {
                plane.set_surfaces(core::array::from_fn(|_| noise.within(1.0)));
                plane.set_duty(noise.unit());
            }
            plane.step();
            let motion = plane.motion();
            assert!(motion.velocity.norm() < 60.0 && motion.rate.norm() < 100.0, "seed {seed}, step {i}: {motion:?}");
        }
    }
}
