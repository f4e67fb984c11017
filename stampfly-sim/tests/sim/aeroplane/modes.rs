//! Small motions compared with the linear equations of flight (Etkin and Reid, Dynamics of Flight,
//! 1996, chapter 4) with the published derivatives, written here independently of the simulator's
//! code.

use super::{PERFECT, fly, roll, step};
use nalgebra::{Complex, Matrix4, UnitQuaternion, Vector3, Vector4};
use stampfly_sim::plant::{Aeroplane, AeroplaneParameters, Trim, WindConfig};

/// A propeller whose thrust is independent of airspeed, so that the textbook's equations need no
/// term for it.
const P: AeroplaneParameters = AeroplaneParameters {
    thrust_1: 0.0,
    thrust_2: 0.0,
    thrust_3: 0.0,
    power_1: 0.0,
    power_2: 0.0,
    power_3: 0.0,
    ..PERFECT
};
const SPEED: f64 = 10.0;

fn trim() -> Trim {
    Aeroplane::trim(&P, SPEED, 0.0).expect("flies")
}

/// System matrix of speed, angle of attack, pitch rate and pitch.
fn longitudinal(trim: &Trim) -> Matrix4<f64> {
    let p = P;
    let force = 0.5 * p.air_density * SPEED * SPEED * p.wing_area / p.mass;
    let moment = force * p.mass * p.wing_chord / p.inertia_y;
    let half = p.wing_chord / (2.0 * SPEED);
    let lift = p.gravity / force;
    let drag = trim.thrust / p.mass / force;
    let drag_alpha = 2.0 * p.drag_induced * (lift - p.drag_lift_0) * p.lift_alpha;
    Matrix4::new(
        -2.0 * drag * force / SPEED,
        (lift - drag_alpha) * force,
        0.0,
        -p.gravity,
        -2.0 * lift * force / SPEED / SPEED,
        -(p.lift_alpha + drag) * force / SPEED,
        1.0 - p.lift_q * half * force / SPEED,
        0.0,
        0.0,
        p.pitch_alpha * moment,
        p.pitch_q * half * moment,
        0.0,
        0.0,
        0.0,
        1.0,
        0.0,
    )
}

/// System matrix of sideslip, roll rate, yaw rate and bank.
fn lateral(trim: &Trim) -> Matrix4<f64> {
    let p = P;
    let force = 0.5 * p.air_density * SPEED * SPEED * p.wing_area / p.mass;
    let moment = force * p.mass * p.wing_span;
    let half = p.wing_span / (2.0 * SPEED);
    let inertia = nalgebra::Matrix2::new(p.inertia_x, -p.inertia_xz, -p.inertia_xz, p.inertia_z);
    let inverse = inertia.try_inverse().expect("regular");
    let turn = |roll: f64, yaw: f64| inverse * nalgebra::Vector2::new(roll, yaw) * moment;
    let by_slip = turn(p.roll_beta, p.yaw_beta);
    let by_roll = turn(p.roll_p, p.yaw_p) * half;
    let by_yaw = turn(p.roll_r, p.yaw_r) * half;
    // Drag contributes to the side force in sideslip: its component across the body.
    let drag = trim.thrust / p.mass / force;
    let (sin, cos) = trim.alpha.sin_cos();
    Matrix4::new(
        (p.side_beta - drag) * force / SPEED,
        p.side_p * half * force / SPEED + sin,
        p.side_r * half * force / SPEED - cos,
        p.gravity / SPEED,
        by_slip.x,
        by_roll.x,
        by_yaw.x,
        0.0,
        by_slip.y,
        by_roll.y,
        by_yaw.y,
        0.0,
        0.0,
        1.0,
        trim.alpha.tan(),
        0.0,
    )
}

/// States after each step, by the classical Runge-Kutta method.
fn course(a: &Matrix4<f64>, mut x: Vector4<f64>, steps: usize) -> Vec<Vector4<f64>> {
    let dt = 1.0 / 1600.0;
    (0..steps)
        .map(|_| {
            let k1 = a * x;
            let k2 = a * (x + k1 * (0.5 * dt));
            let k3 = a * (x + k2 * (0.5 * dt));
            let k4 = a * (x + k3 * dt);
            x += (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0);
            x
        })
        .collect()
}

/// Largest difference between two courses relative to the largest value, for each state.
fn differences(simulated: &[Vector4<f64>], predicted: &[Vector4<f64>]) -> [f64; 4] {
    core::array::from_fn(|i| {
        let largest = predicted.iter().map(|x| x[i].abs()).fold(0.0, f64::max);
        simulated.iter().zip(predicted).map(|(s, p)| (s[i] - p[i]).abs()).fold(0.0, f64::max) / largest
    })
}

fn modes(a: &Matrix4<f64>) -> Vec<Complex<f64>> {
    let mut roots: Vec<_> = a.complex_eigenvalues().iter().copied().collect();
    roots.sort_by(|one, other| one.re.hypot(one.im).total_cmp(&other.re.hypot(other.im)));
    roots
}

/// Period, s, and damping ratio of an oscillation.
fn oscillation(root: Complex<f64>) -> (f64, f64) {
    let natural = root.re.hypot(root.im);
    (core::f64::consts::TAU / natural, -root.re / natural)
}

#[test]
fn speed_and_pitch_go_as_the_linear_equations_say() {
    let trim = trim();
    let a = longitudinal(&trim);
    let pitch = |plane: &Aeroplane| super::pitch(plane) - trim.alpha;
    for start in [Vector4::new(0.2, 0.0, 0.0, 0.0), Vector4::new(0.0, 0.0, 0.3, 0.0)] {
        let mut pose = trim.pose(100.0, 0.0);
        pose.velocity.x += start[0];
        pose.rate.y = start[2];
        let mut plane = Aeroplane::new(&P, &WindConfig::CALM, Some(&pose), 1);
        plane.settle(&trim);
        let simulated: Vec<_> = (0..6 * 1600)
            .map(|_| {
                step(&mut plane, &trim);
                let rate = plane.motion().rate.y;
                Vector4::new(plane.airspeed() - SPEED, plane.alpha() - trim.alpha, rate, pitch(&plane))
            })
            .collect();
        let off = differences(&simulated, &course(&a, start, simulated.len()));
        println!("longitudinal, {start:?}: {off:?}");
        assert!(off.iter().all(|share| *share < 0.06), "{off:?}");
    }
}

#[test]
fn slip_and_bank_go_as_the_linear_equations_say() {
    let trim = trim();
    let a = lateral(&trim);
    for start in
        [Vector4::new(0.03, 0.0, 0.0, 0.0), Vector4::new(0.0, 0.3, 0.0, 0.0), Vector4::new(0.0, 0.0, 0.0, 0.05)]
    {
        let mut pose = trim.pose(100.0, 0.0);
        pose.attitude *= UnitQuaternion::from_axis_angle(&Vector3::x_axis(), start[3]);
        pose.velocity.y += SPEED * start[0];
        pose.rate.x = start[1];
        let mut plane = Aeroplane::new(&P, &WindConfig::CALM, Some(&pose), 1);
        plane.settle(&trim);
        // At a pitch angle, bank converts part of the angle of attack into sideslip.
        let start = Vector4::new(plane.beta(), start[1], 0.0, start[3]);
        let simulated: Vec<_> = (0..4 * 1600)
            .map(|_| {
                step(&mut plane, &trim);
                let rate = plane.motion().rate;
                Vector4::new(plane.beta(), rate.x, rate.z, roll(&plane))
            })
            .collect();
        let off = differences(&simulated, &course(&a, start, simulated.len()));
        println!("lateral, {start:?}: {off:?}");
        assert!(off.iter().all(|share| *share < 0.06), "{off:?}");
    }
}

#[test]
fn the_modes_are_those_of_an_aeroplane() {
    let trim = trim();
    let long = modes(&longitudinal(&trim));
    let (phugoid, short) = (oscillation(long[0]), oscillation(long[3]));
    let side = modes(&lateral(&trim));
    let (spiral, dutch, subsidence) = (side[0], oscillation(side[1]), side[3]);
    println!("phugoid {phugoid:?}, short period {short:?}, dutch roll {dutch:?}, spiral {spiral}, roll {subsidence}");
    // Lanchester's approximation gives 4.5 s; the strong pitch damping of so light an aeroplane
    // doubles the period.
    assert!((8.0..12.0).contains(&phugoid.0) && (0.1..0.5).contains(&phugoid.1), "{phugoid:?}");
    assert!(short.0 < 0.5 && short.1 > 0.7, "{short:?}");
    assert!((0.5..1.5).contains(&dutch.0) && (0.2..0.8).contains(&dutch.1), "{dutch:?}");
    // The spiral mode may diverge slowly.
    assert!(spiral.im == 0.0 && spiral.re.abs() < 0.1 && subsidence.re < -10.0, "{spiral} {subsidence}");
}

#[test]
fn with_its_own_propeller_it_comes_back_to_its_airspeed() {
    let trim = Aeroplane::trim(&PERFECT, SPEED, 0.0).expect("flies");
    let mut plane = fly(&PERFECT, &trim, 100.0);
    let mut pose = trim.pose(100.0, 0.0);
    pose.velocity.x += 2.0;
    plane.clone_from(&Aeroplane::new(&PERFECT, &WindConfig::CALM, Some(&pose), 1));
    plane.settle(&trim);
    (0..30 * 1600).for_each(|_| step(&mut plane, &trim));
    assert!((plane.airspeed() - SPEED).abs() < 0.05, "{}", plane.airspeed());
}
