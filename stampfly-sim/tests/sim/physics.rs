//! The plant compared with mechanics.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use stampfly_sim::plant::{Plant, PlantParameters, Pose, WindConfig};

const STEPS_PER_SECOND: u32 = 1600;

fn perfect() -> PlantParameters {
    PlantParameters { manufacturing_spread: 0.0, ..PlantParameters::EXAMPLE }
}

fn calm(parameters: &PlantParameters, pose: Option<&Pose>) -> Plant {
    Plant::new(parameters, &WindConfig::CALM, pose, 1)
}

fn run(plant: &mut Plant, seconds: f64) {
    for _ in 0..(seconds * f64::from(STEPS_PER_SECOND)) as u32 {
        plant.step();
    }
}

#[test]
fn free_fall_is_exact_without_air() {
    let parameters = PlantParameters { drag_quadratic: 0.0, ..perfect() };
    let pose = Pose { velocity: Vector3::new(1.0, -2.0, -3.0), rotors: 0.0, ..Pose::hovering(50.0) };
    let mut plant = calm(&parameters, Some(&pose));
    run(&mut plant, 2.0);
    let motion = plant.motion();
    let expected = Vector3::new(2.0, -4.0, -50.0 - 6.0 + 0.5 * 9.80665 * 4.0);
    assert!((motion.position - expected).norm() < 1e-9, "{}", motion.position);
    assert!(motion.specific_force.norm() < 1e-12, "falling is weightless");
}

#[test]
fn falling_through_air_ends_at_the_speed_where_drag_is_the_weight() {
    let parameters = perfect();
    let mut plant = calm(&parameters, Some(&Pose { rotors: 0.0, ..Pose::hovering(500.0) }));
    run(&mut plant, 10.0);
    let expected = (parameters.mass * parameters.gravity / parameters.drag_quadratic).sqrt();
    assert!((plant.motion().velocity.z - expected).abs() < 0.01 * expected, "{}", plant.motion().velocity.z);
}

#[test]
fn a_body_spinning_free_keeps_angular_momentum_and_energy() {
    let parameters = PlantParameters { drag_quadratic: 0.0, drag_rotation: 0.0, gravity: 0.0, ..perfect() };
    let pose = Pose { rotors: 0.0, rate: Vector3::new(3.0, 12.0, -5.0), ..Pose::hovering(10.0) };
    let mut plant = calm(&parameters, Some(&pose));
    let inertia = Vector3::new(parameters.inertia_x, parameters.inertia_y, parameters.inertia_z);
    let momentum = |p: &Plant| p.motion().attitude * inertia.component_mul(&p.motion().rate);
    let energy = |p: &Plant| 0.5 * p.motion().rate.dot(&inertia.component_mul(&p.motion().rate));
    let (momentum_before, energy_before) = (momentum(&plant), energy(&plant));
    run(&mut plant, 1.0);
    assert!((momentum(&plant) - momentum_before).norm() < 1e-4 * momentum_before.norm());
    assert!((energy(&plant) / energy_before - 1.0).abs() < 1e-4);
}

#[test]
fn a_vehicle_that_stands_stands_perfectly_still() {
    let mut plant = calm(&PlantParameters::EXAMPLE, None);
    for _ in 0..STEPS_PER_SECOND {
        plant.step();
        let motion = plant.motion();
        assert!(plant.ground().contact());
        assert!((motion.specific_force - Vector3::new(0.0, 0.0, -9.80665)).norm() < 1e-9, "{}", motion.specific_force);
        assert!(motion.rate.norm() < 1e-12 && motion.velocity.norm() < 1e-12);
    }
    assert!((plant.motion().position.z + PlantParameters::EXAMPLE.ground_height).abs() < 1e-9);
}

#[test]
fn a_dropped_vehicle_comes_to_rest_on_its_feet() {
    let pose = Pose {
        attitude: UnitQuaternion::from_euler_angles(0.2, -0.1, 1.0),
        velocity: Vector3::new(0.2, 0.1, 0.0),
        rotors: 0.0,
        ..Pose::hovering(0.15)
    };
    let mut plant = calm(&PlantParameters::EXAMPLE, Some(&pose));
    run(&mut plant, 3.0);
    let motion = plant.motion();
    assert!(motion.velocity.norm() < 1e-6 && motion.rate.norm() < 1e-6, "{motion:?}");
    assert!((motion.attitude * Vector3::z()).z > 0.9999, "upright but for what friction holds: {motion:?}");
    assert!((motion.position.z + PlantParameters::EXAMPLE.ground_height).abs() < 1e-4);
}

#[test]
fn a_crashed_vehicle_lies_on_its_back_above_the_floor() {
    let pose = Pose { attitude: UnitQuaternion::from_euler_angles(2.9, 0.1, 0.0), rotors: 0.0, ..Pose::hovering(0.5) };
    let mut plant = calm(&PlantParameters::EXAMPLE, Some(&pose));
    run(&mut plant, 5.0);
    let motion = plant.motion();
    assert!((motion.attitude * Vector3::z()).z < -0.99 && motion.velocity.norm() < 1e-3, "{motion:?}");
    assert!((motion.position.z + PlantParameters::EXAMPLE.corner_height).abs() < 1e-3 && plant.ground().contact());
}

#[test]
fn friction_holds_on_the_floor_up_to_its_limit() {
    // A steady wind with less, then with more force than static friction.
    let parameters = PlantParameters { drag_quadratic: 0.1, ..perfect() };
    let slip = |speed: f32| {
        let wind = WindConfig { mean: stampfly_types::Vec3::x() * speed, ..WindConfig::CALM };
        let mut plant = Plant::new(&parameters, &wind, None, 1);
        run(&mut plant, 2.0);
        plant.motion().position.x
    };
    // At the height of the body an eleventh of the wind remains: 10 m/s push with 0.08 N, 25 m/s
    // with 0.5 N; friction holds 0.29 N.
    assert!(slip(10.0).abs() < 1e-3, "{}", slip(10.0));
    assert!(slip(25.0) > 0.05, "{}", slip(25.0));
}

#[test]
fn the_floor_adds_lift_and_the_extra_fades_with_height() {
    let thrust = |height: f64| {
        let mut plant = calm(&perfect(), Some(&Pose::hovering(height)));
        plant.step();
        -plant.motion().specific_force.z / 9.80665
    };
    assert!((thrust(0.05) - 1.0 - 0.1 * (-1f64).exp()).abs() < 1e-3, "{}", thrust(0.05));
    assert!((thrust(1.0) - 1.0).abs() < 1e-3, "{}", thrust(1.0));
}

#[test]
fn speeding_up_a_rotor_pushes_the_body_the_other_way_before_drag_does() {
    let parameters = perfect();
    let mut plant = calm(&parameters, Some(&Pose { rotors: 0.5, ..Pose::hovering(5.0) }));
    // The counter-clockwise pair gets power: its drag and its acceleration both turn the body
    // clockwise.
    plant.set_duty([0.8, 0.0, 0.8, 0.0]);
    plant.step();
    let acceleration = plant.motion().angular_acceleration.z;
    let w = 0.5 * plant.rotors().hover_speed();
    let drag_alone = 2.0 * parameters.torque_coefficient * w * w / parameters.inertia_z;
    assert!(acceleration > 3.0 * drag_alone, "{acceleration} rad/s² against {drag_alone} from drag");
}

#[test]
fn rotors_turning_one_way_deflect_a_pitch_into_a_roll() {
    // Only the clockwise pair turns: its angular momentum points down, so pitching up rolls the
    // vehicle: −ω × h.
    let parameters = PlantParameters { drag_vertical: 0.0, drag_rotation: 0.0, drag_quadratic: 0.0, ..perfect() };
    let mut plant = calm(&parameters, Some(&Pose { rotors: 0.0, ..Pose::hovering(50.0) }));
    plant.set_duty([0.0, 0.6, 0.0, 0.6]);
    run(&mut plant, 0.3);
    let still = plant.motion().angular_acceleration.x;
    let momentum = parameters.rotor_inertia * (plant.rotors().speed()[1] + plant.rotors().speed()[3]);
    let pose = Pose { rate: Vector3::new(0.0, 2.0, 0.0), rotors: 0.0, ..Pose::hovering(50.0) };
    let mut plant = calm(&parameters, Some(&pose));
    plant.set_duty([0.0, 0.6, 0.0, 0.6]);
    let mut rolled = 0.0;
    for _ in 0..480 {
        plant.step();
        rolled += plant.motion().angular_acceleration.x / 1600.0;
    }
    assert!(still.abs() < 1e-9);
    // The pitch rate stays near 2 rad/s while the momentum builds up; the sign matters, the size is
    // a bound.
    let limit = -2.0 * momentum / parameters.inertia_x * 0.3;
    assert!(rolled < 0.0 && rolled > 2.0 * limit, "{rolled} against {limit}");
}

#[test]
fn a_hover_drains_the_battery_as_fast_as_its_current_says() {
    let p = perfect();
    let mut plant = calm(&p, Some(&Pose::hovering(1000.0)));
    let (mut seconds, mut drawn) = (0.0, 0.0);
    while plant.battery().charge() > 0.1 && seconds < 1000.0 {
        let w = plant.rotors().hover_speed();
        let voltage = (p.motor_voltage_a * w + p.motor_voltage_b) * w + p.motor_voltage_c;
        plant.set_duty([(voltage / plant.battery().voltage()).min(1.0); 4]);
        run(&mut plant, 1.0);
        seconds += 1.0;
        drawn += plant.motion().current;
    }
    // 90 %, in A·s.
    assert!((drawn / (0.9 * 3600.0 * p.battery_capacity) - 1.0).abs() < 0.01, "{drawn} C");
    assert!((3.0..5.0).contains(&(drawn / seconds)), "{} A", drawn / seconds);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_duty_and_no_attitude_breaks_the_numbers(
        duty: [f64; 4],
        rate in proptest::array::uniform3(-40.0f64..40.0),
        angles in proptest::array::uniform3(-3.0f64..3.0),
        height in 0.0f64..2.0,
        seed: u64,
    ) {
        let pose = Pose {
            attitude: UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]),
            rate: Vector3::from(rate),
            ..Pose::hovering(height)
        };
        let mut plant = Plant::new(&PlantParameters::EXAMPLE, &WindConfig::default(), Some(&pose), seed);
        plant.set_duty(duty.map(|d| if d.is_finite() { d.abs().fract() } else { 0.5 }));
        run(&mut plant, 1.0);
        let motion = plant.motion();
        prop_assert!((motion.attitude.norm() - 1.0).abs() < 1e-12);
        prop_assert!(motion.position.iter().chain(motion.rate.iter()).all(|x| x.is_finite()));
        prop_assert!(motion.velocity.norm() < 60.0 && motion.rate.norm() < 400.0, "{:?}", motion);
        prop_assert!(motion.rotor_speed.iter().all(|w| (0.0..6000.0).contains(w)));
    }
}

#[test]
fn open_propellers_that_touch_the_floor_stand_and_push_nothing() {
    let open = PlantParameters { propeller_radius: 0.022, ..perfect() };
    let over = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI);
    let lay = |parameters: &PlantParameters, attitude| {
        let mut plant = calm(parameters, Some(&Pose { attitude, rotors: 0.0, ..Pose::hovering(0.06) }));
        run(&mut plant, 1.0);
        plant.set_duty([0.4; 4]);
        run(&mut plant, 1.0);
        plant
    };
    let on_its_back = lay(&open, over);
    assert!(on_its_back.rotors().speed().iter().all(|speed| *speed < 1.0), "{:?}", on_its_back.motion());
    assert!(on_its_back.ground().scrapes() > 0 && on_its_back.motion().velocity.norm() < 0.01);
    // Four stalled motors.
    let stall = 4.0 * 0.4 * 0.4 * on_its_back.battery().voltage() / open.motor_resistance;
    assert!((on_its_back.motion().current / (stall + open.board_current) - 1.0).abs() < 0.05);
    assert!(on_its_back.battery().voltage() < on_its_back.battery().open_circuit() - 0.9 * 0.05 * stall);
    // Its right side is down.
    let attitude = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1.2);
    let mut tips = calm(&open, Some(&Pose { attitude, ..Pose::hovering(0.04) }));
    tips.set_duty([0.4; 4]);
    run(&mut tips, 0.02);
    let [right, _, left, _] = tips.rotors().speed();
    assert!(right < 0.4 * left && left > 500.0, "{right}, {left}");
    // Inside a frame as wide and as high as the propellers nothing touches them.
    assert!(lay(&perfect(), over).rotors().speed().iter().all(|speed| *speed > 500.0));

    let mut stands = calm(&open, None);
    stands.set_duty([0.3; 4]);
    run(&mut stands, 1.0);
    assert!(stands.ground().contact() && stands.ground().scrapes() == 0);
}

/// Regression: using the voltage of the previous step oscillated by volts above 0.125 Ω with these
/// motors.
#[test]
fn a_weak_battery_is_steady() {
    let parameters = PlantParameters { battery_resistance: 0.28, battery_polarisation: 0.0, ..perfect() };
    let mut plant = calm(&parameters, Some(&Pose::hovering(1000.0)));
    plant.set_duty([1.0; 4]);
    run(&mut plant, 1.0);
    let voltages: Vec<_> = (0..50)
        .map(|_| {
            plant.step();
            let (battery, current) = (plant.battery(), plant.motion().current);
            let left = battery.open_circuit() - current * parameters.battery_resistance;
            assert!((left - battery.voltage()).abs() < 1e-3, "{left} {}", battery.voltage());
            battery.voltage()
        })
        .collect();
    let (low, high) = voltages.iter().fold((f64::MAX, 0.0f64), |(low, high), v| (low.min(*v), high.max(*v)));
    assert!(high - low < 1e-3 && low > 2.0, "{low} to {high} V");
}

#[test]
fn what_leaves_the_battery_heats_it_and_the_motors_and_turns_the_rotors() {
    for battery_resistance in [0.05, 0.28] {
        let parameters = PlantParameters { battery_resistance, battery_polarisation: 0.0, ..perfect() };
        let constant = parameters.torque_coefficient / parameters.motor_voltage_a * parameters.motor_resistance;
        let mut plant = calm(&parameters, Some(&Pose::hovering(1000.0)));
        let (mut given, mut taken) = (0.0, 0.0);
        for step in 0..1600 {
            // Between idle and full, each motor at its own time.
            let duty: [f64; 4] = core::array::from_fn(|motor| f64::from((step / 40 + 3 * motor as u32) % 11) / 10.0);
            plant.set_duty(duty);
            let (speed, open) = (plant.rotors().speed(), plant.battery().open_circuit());
            plant.step();
            let (voltage, current) = (plant.battery().voltage(), plant.motion().current);
            given += open * current;
            taken += current * current * battery_resistance + parameters.board_current * voltage;
            for (duty, speed) in duty.into_iter().zip(speed) {
                let winding = ((duty * voltage - constant * speed) / parameters.motor_resistance).max(0.0);
                taken += winding * (winding * parameters.motor_resistance + constant * speed);
            }
        }
        assert!((taken / given - 1.0).abs() < 1e-3, "{battery_resistance} Ω: {taken} of {given}");
    }
}
