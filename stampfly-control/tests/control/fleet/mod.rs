//! The same rules for vehicles from a palm's size to eight rotors of ten inches: gains from mass, inertia and motor lag, any loop rate.
//!
//! `cargo test -p stampfly-control --test control fleet -- --nocapture` prints the figures.

mod plant;

use plant::{Body, NOMINAL, Truth};
use stampfly_control::indi::IndiRate;
use stampfly_control::{
    Airframe, CascadeConfig, CascadeController, Controller, GeometricConfig, GeometricController, IndiConfig,
    IndiController, MotorCurve, Rotor, Spin,
};
use stampfly_types::{Vec3, frame};

const fn rotor(x: f32, y: f32, spin: Spin, kappa: f32) -> Rotor {
    Rotor { x, y, spin, kappa }
}

const CCW: Spin = Spin::CounterClockwise;
const CW: Spin = Spin::Clockwise;

/// No flight here asks for volts.
const CURVE: MotorCurve = MotorCurve { ct: 1e-6, am: 0.0, bm: 1e-2, cm: 0.0 };

const FLEET: [(&str, Airframe); 4] = [
    (
        "quadcopter 37 g",
        Airframe {
            mass: 0.037,
            inertia: Vec3::new(1.1e-5, 1.2e-5, 2.1e-5),
            rotors: &Rotor::quadrotor_x(0.025, 4.5e-3),
            motor: CURVE,
            motor_lag: 0.018,
            motor_thrust_max: 0.18,
            cells: 1,
        },
    ),
    (
        "quadcopter 250 g",
        Airframe {
            mass: 0.25,
            inertia: Vec3::new(2.2e-4, 2.6e-4, 4.4e-4),
            rotors: &Rotor::quadrotor_x(0.055, 0.012),
            motor: CURVE,
            motor_lag: 0.022,
            motor_thrust_max: 2.2,
            cells: 3,
        },
    ),
    (
        "hexacopter 1.8 kg",
        Airframe {
            mass: 1.8,
            inertia: Vec3::new(0.022, 0.024, 0.042),
            rotors: &[
                rotor(0.28, 0.0, CCW, 0.016),
                rotor(0.14, 0.2425, CW, 0.016),
                rotor(-0.14, 0.2425, CCW, 0.016),
                rotor(-0.28, 0.0, CW, 0.016),
                rotor(-0.14, -0.2425, CCW, 0.016),
                rotor(0.14, -0.2425, CW, 0.016),
            ],
            motor: CURVE,
            motor_lag: 0.045,
            motor_thrust_max: 7.0,
            cells: 4,
        },
    ),
    (
        "coaxial octocopter 4.5 kg",
        Airframe {
            mass: 4.5,
            inertia: Vec3::new(0.085, 0.09, 0.15),
            rotors: &[
                rotor(0.25, 0.25, CCW, 0.018),
                rotor(0.25, -0.25, CW, 0.018),
                rotor(-0.25, -0.25, CCW, 0.018),
                rotor(-0.25, 0.25, CW, 0.018),
                rotor(0.25, -0.25, CCW, 0.018),
                rotor(0.25, 0.25, CW, 0.018),
                rotor(-0.25, 0.25, CCW, 0.018),
                rotor(-0.25, -0.25, CW, 0.018),
            ],
            motor: CURVE,
            motor_lag: 0.06,
            motor_thrust_max: 12.0,
            cells: 6,
        },
    ),
];

fn cascade(airframe: &Airframe) -> CascadeController {
    CascadeController::new(&CascadeConfig::for_airframe(airframe))
}

fn indi(airframe: &Airframe) -> IndiController {
    let rate = IndiRate::new(&IndiConfig::for_airframe(airframe));
    IndiController::with_rate_law(&CascadeConfig::for_airframe(airframe), rate)
}

fn geometric(airframe: &Airframe) -> GeometricController {
    GeometricController::new(&GeometricConfig::for_airframe(airframe))
}

/// Twenty vehicles that are not what their airframe says: mass, inertia and lag each up to 30 % off, all corners among them.
fn variations() -> Vec<Truth> {
    let corners = (0..8).map(|n| [n & 1, n >> 1 & 1, n >> 2 & 1].map(|high| if high == 1 { 1.3 } else { 0.7 }));
    let mut random = 1u32;
    let mut draw = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.7 + 0.6 * (random >> 8) as f32 / (1 << 24) as f32
    };
    let within = (0..12).map(|_| [draw(), draw(), draw()]).collect::<Vec<_>>();
    corners.chain(within).map(|[mass, inertia, lag]| Truth { mass, inertia, lag, ..NOMINAL }).collect()
}

/// What a flight was like: overshoot of the step, m; distance from the goal at its end, m; largest tilt while it hovers at its
/// end, deg; loss of height, m.
#[derive(Clone, Copy, Debug)]
struct Figures {
    over: f32,
    end: f32,
    tilt: f32,
    height: f32,
}

/// A law and how it is sent five metres away: at once if it bounds its speed itself, or along a path of so many seconds.
struct Law<C> {
    name: &'static str,
    make: fn(&Airframe) -> C,
    path: f32,
}

const CASCADE: Law<CascadeController> = Law { name: "cascade", make: cascade, path: 0.0 };
const INDI: Law<IndiController> = Law { name: "INDI", make: indi, path: 0.0 };
/// It tracks paths, and jumps after a place that jumps.
const GEOMETRIC: Law<GeometricController> = Law { name: "geometric", make: geometric, path: 5.0 };

/// Hovers until it knows its weight, goes five metres and hovers again.
fn step_of_five_metres<C: Controller>(
    airframe: &Airframe,
    truth: Truth,
    law: &Law<C>,
    watch: &mut dyn FnMut(&Body<C>),
) -> Figures {
    let mut body = Body::new(airframe, truth, (law.make)(airframe));
    body.fly(15.0, |_| ());
    let start = body.position.z;
    body.send(5.0, law.path);
    let (mut over, mut height, mut tilt) = (0.0f32, 0.0f32, 0.0f32);
    body.fly(11.0, |body| {
        over = over.max(body.position.x - 5.0);
        height = height.max((body.position.z - start).abs());
        watch(body);
    });
    body.fly(3.0, |body| tilt = tilt.max(frame::tilt(&body.attitude).to_degrees()));
    Figures { over, end: (body.position - body.setpoint.position).norm(), tilt, height }
}

fn every_variation<C: Controller>(law: &Law<C>) {
    let controller = law.name;
    for (name, airframe) in FLEET {
        let mut worst = Figures { over: 0.0, end: 0.0, tilt: 0.0, height: 0.0 };
        for truth in variations() {
            let f = step_of_five_metres(&airframe, truth, law, &mut |_| ());
            worst = Figures {
                over: worst.over.max(f.over),
                end: worst.end.max(f.end),
                tilt: worst.tilt.max(f.tilt),
                height: worst.height.max(f.height),
            };
            // NaN is no pass.
            let kept = f.over < 0.15 && f.end < 0.02 && f.tilt < 1.0 && f.height < 0.1;
            assert!(kept, "{controller}, {name}, {truth:?}: {f:?}");
        }
        println!("{controller:10} {name:26} {worst:.3?}");
    }
}

#[test]
fn the_cascade_flies_every_vehicle_of_the_fleet() {
    every_variation(&CASCADE);
}

#[test]
fn the_incremental_loop_flies_them_too() {
    every_variation(&INDI);
}

#[test]
fn the_geometric_law_flies_them_too() {
    every_variation(&GEOMETRIC);
}

/// The place along the step, m, and the pitch, rad, every tenth of a second.
fn trace<C: Controller>(airframe: &Airframe, hertz: u64, law: &Law<C>) -> Vec<[f32; 2]> {
    let truth = Truth { period: 1_000_000 / hertz, step: 125, ..NOMINAL };
    let (mut trace, mut n) = (Vec::new(), 0);
    step_of_five_metres(airframe, truth, law, &mut |body| {
        if n % (hertz / 10) == 0 {
            let [_, pitch, _] = frame::roll_pitch_yaw(&body.attitude);
            trace.push([body.position.x, pitch]);
        }
        n += 1;
    });
    trace
}

fn any_rate<C: Controller>(law: &Law<C>) {
    let controller = law.name;
    for (name, airframe) in FLEET {
        let reference = trace(&airframe, 1_000, law);
        for hertz in [250, 400, 4_000, 8_000] {
            let (mut place, mut pitch) = (0.0f32, 0.0f32);
            for (at, as_before) in trace(&airframe, hertz, law).iter().zip(&reference) {
                place = place.max((at[0] - as_before[0]).abs());
                pitch = pitch.max((at[1] - as_before[1]).abs().to_degrees());
            }
            println!("{controller:10} {name:26} {hertz:4} Hz: {:.1} mm, {pitch:.2} deg off 1 kHz", 1e3 * place);
            assert!(place < 0.01 && pitch < 0.5, "{controller}, {name}, {hertz} Hz: {place} m, {pitch} deg");
        }
    }
}

#[test]
fn any_loop_rate_gives_the_same_flight() {
    any_rate(&CASCADE);
    any_rate(&INDI);
    any_rate(&GEOMETRIC);
}
