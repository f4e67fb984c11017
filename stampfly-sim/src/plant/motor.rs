//! Model of four brushed motors with fixed propellers.
//!
//! A motor turns duty and battery voltage into rotor speed; a propeller turns speed into thrust and
//! drag torque:
//!
//! ```text
//! current  I = (duty·Vbat − Km·ω) / Rm, never negative: the switch is one-sided, braking needs a second one
//! speed    J·dω/dt = Km·I − Cq·ω² − Dm·ω − Qf
//! thrust   T = Ct·ω²
//! ```
//!
//! `Km`, `Dm` and `Qf` are not independent parameters: for a given resistance the measured steady
//! voltage curve V(ω) = Am·ω² + Bm·ω + Cm fixes them (set dω/dt = 0 and compare powers of ω). The
//! inductance of the winding is neglected, its time constant being some ten microseconds.
//!
//! A propeller that touches an obstacle stops: no thrust, and the stall current of its motor.

use super::battery::Load;
use super::lag::Lag;
use super::{DT, PlantParameters};
use crate::conditions::Conditions;
use crate::noise::{Noise, Stream};
use nalgebra::Vector3;
use stampfly_types::GRAVITY;

/// Number of rotors.
pub const ROTORS: usize = 4;

/// Rotor positions (x, y) in units of the rotor offset: front right, rear right, rear left, front
/// left.
pub(super) const PLACES: [(f64, f64); ROTORS] = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];

/// Direction of rotation about the body's z axis (down): −1 is counter-clockwise seen from above.
const SPINS: [f64; ROTORS] = [-1.0, 1.0, -1.0, 1.0];

/// Time constant with which a propeller that touches an obstacle stops, s. One turn of a five-inch
/// propeller takes 6 ms at hover.
const STOPS: f64 = 0.002;

/// Action of the rotors on the body in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RotorLoads {
    /// Sum of thrusts, N, along −z of the body.
    pub thrust: f64,
    /// Torque about the body's axes without the gyroscopic part, N·m.
    pub torque: Vector3<f64>,
    /// Angular momentum of the rotors along body z, N·m·s.
    pub momentum_z: f64,
    /// Current drawn from the battery, A.
    pub current: f64,
}

/// Fault of one rotor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorFault {
    /// Remaining share of the propeller's thrust, at the same speed and with the same drag.
    pub thrust: f64,
    /// Duty, 0 to 1, that replaces the command: a transistor that does not switch.
    pub duty: Option<f64>,
}

impl RotorFault {
    /// No fault.
    pub const NONE: Self = Self { thrust: 1.0, duty: None };
}

/// The four motors with their propellers.
#[derive(Clone, Debug, PartialEq)]
pub struct Rotors {
    duty: [f64; ROTORS],
    speed: [f64; ROTORS],
    /// Thrust coefficients without faults.
    thrust_coefficient: [f64; ROTORS],
    torque_coefficient: f64,
    resistance: [f64; ROTORS],
    motor_constant: [f64; ROTORS],
    viscous: f64,
    friction: f64,
    inertia: f64,
    faults: [RotorFault; ROTORS],
    /// Rotor positions relative to the centre of mass, m.
    places: [(f64, f64); ROTORS],
    lag: Option<Lag>,
    hover_speed: f64,
}

impl Rotors {
    /// Rotors at rest. `seed` draws the differences between them.
    pub(crate) fn new(parameters: &PlantParameters, conditions: &Conditions, seed: u64) -> Self {
        let noise = &mut Noise::stream(seed, Stream::Airframe);
        let p = parameters;
        let spread = p.manufacturing_spread;
        // Normal draws are truncated, so that no specimen is absurd.
        let limit = conditions.spread_limit;
        let per_volt = p.torque_coefficient / p.motor_voltage_a;
        let motor_constant = p.motor_constant();
        let thrust_coefficient = [(); ROTORS].map(|()| {
            p.thrust_coefficient * (1.0 + conditions.rotor_spread * spread * noise.normal().clamp(-limit, limit))
        });
        let across = conditions.centre_spread * spread;
        let differs = within(limit * across, [across * noise.normal(), across * noise.normal()]);
        // Design offset plus the specimen's.
        let centre = [p.centre_x + differs[0], p.centre_y + differs[1]];
        let motors = &mut Noise::stream(seed, Stream::RotorSpecimen);
        let mut differing = |mean: f64| {
            [(); ROTORS]
                .map(|()| mean * (1.0 + conditions.rotor_curve_spread * spread * motors.normal().clamp(-limit, limit)))
        };
        let (resistance, constants) = (differing(p.motor_resistance), differing(motor_constant));
        let askew = conditions.rotor_place_spread * spread;
        let places = PLACES.map(|(x, y)| {
            let [north, east] = within(limit * askew, [askew * motors.normal(), askew * motors.normal()]);
            (x * p.rotor_offset - centre[0] + north, y * p.rotor_offset - centre[1] + east)
        });
        Self {
            duty: [0.0; ROTORS],
            speed: [0.0; ROTORS],
            thrust_coefficient,
            torque_coefficient: p.torque_coefficient,
            resistance,
            motor_constant: constants,
            viscous: ((p.motor_voltage_b - motor_constant) * per_volt).max(0.0),
            friction: p.motor_voltage_c * per_volt,
            inertia: p.rotor_inertia,
            faults: [RotorFault::NONE; ROTORS],
            places,
            lag: Lag::new(conditions.collective_lag, DT),
            hover_speed: (p.mass * f64::from(GRAVITY) / (ROTORS as f64 * p.thrust_coefficient)).sqrt(),
        }
    }

    /// Sets the duty cycles, 0 to 1.
    pub(crate) fn set_duty(&mut self, duty: [f64; ROTORS]) {
        self.duty = duty;
    }

    /// Sets the fault of a rotor; a rotor that does not exist is ignored.
    pub(crate) fn set_fault(&mut self, rotor: usize, fault: RotorFault) {
        if let Some(place) = self.faults.get_mut(rotor) {
            *place = fault;
        }
    }

    /// Sets the rotor speeds, rad/s.
    pub(crate) fn set_speed(&mut self, speed: [f64; ROTORS]) {
        self.speed = speed;
    }

    /// Duty cycles.
    #[must_use]
    pub fn duty(&self) -> [f64; ROTORS] {
        self.duty
    }

    /// Rotor speeds, rad/s, never negative.
    #[must_use]
    pub fn speed(&self) -> [f64; ROTORS] {
        self.speed
    }

    /// Speed at which rotors without spread carry the vehicle on Earth, rad/s.
    #[must_use]
    pub fn hover_speed(&self) -> f64 {
        self.hover_speed
    }

    /// Effective duty cycles: a stuck transistor overrides its command.
    fn switched(&self) -> [f64; ROTORS] {
        core::array::from_fn(|i| self.faults[i].duty.unwrap_or(self.duty[i]))
    }

    /// The motors as loads of the battery at their present speeds.
    pub(crate) fn loads(&self) -> [Load; ROTORS] {
        let duty = self.switched();
        core::array::from_fn(|i| Load::of_motor(duty[i], self.resistance[i], self.motor_constant[i] * self.speed[i]))
    }

    /// Advances by `dt` seconds at `voltage`, with the thrust multiplied by `lift`. `held` marks
    /// propellers that touch an obstacle.
    pub(crate) fn step(&mut self, dt: f64, voltage: f64, lift: f64, held: [bool; ROTORS]) -> RotorLoads {
        // Each line handles all rotors, so that the compiler can vectorise it.
        let duty = self.switched();
        let speed = self.speed;
        let current: [f64; ROTORS] = core::array::from_fn(|i| {
            ((duty[i] * voltage - self.motor_constant[i] * speed[i]) / self.resistance[i]).max(0.0)
        });
        let drag = speed.map(|speed| self.torque_coefficient * speed * speed);
        // Limited at zero: friction stops a rotor and does not turn it backwards.
        self.speed = core::array::from_fn(|i| {
            let net = self.motor_constant[i] * current[i] - drag[i] - self.viscous * speed[i] - self.friction;
            (speed[i] + net / self.inertia * dt).max(0.0)
        });
        // The airframe feels the opposite of what accelerates the rotor and of the propeller's
        // drag.
        let mut reaction: [f64; ROTORS] = core::array::from_fn(|i| {
            let acceleration = (self.speed[i] - speed[i]) / dt;
            -SPINS[i] * (drag[i] + self.inertia * acceleration)
        });
        let mut thrust: [f64; ROTORS] =
            core::array::from_fn(|i| self.thrust_coefficient[i] * self.faults[i].thrust * speed[i] * speed[i] * lift);
        // The lag acts on the thrust after faults, before contact removes single rotors.
        thrust = match &mut self.lag {
            Some(lag) => lag.pass(thrust),
            None => thrust,
        };
        for i in (0..ROTORS).filter(|i| held[*i]) {
            // The obstacle takes up the braking torque; the body receives the motor's torque only.
            self.speed[i] = speed[i] * (1.0 - dt / STOPS).max(0.0);
            (thrust[i], reaction[i]) = (0.0, -SPINS[i] * self.motor_constant[i] * current[i]);
        }
        let mut loads = RotorLoads::default();
        for i in 0..ROTORS {
            let (x, y) = self.places[i];
            loads.thrust += thrust[i];
            loads.torque += Vector3::new(-y * thrust[i], x * thrust[i], reaction[i]);
            loads.momentum_z += SPINS[i] * self.inertia * speed[i];
            loads.current += duty[i] * current[i];
        }
        loads
    }
}

/// Limits a point in the plane to a circle around the origin.
fn within(radius: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let far = (x * x + y * y).sqrt();
    if far > radius { [x, y].map(|part| part * (radius / far)) } else { [x, y] }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDEAL: PlantParameters = PlantParameters { manufacturing_spread: 0.0, ..PlantParameters::EXAMPLE };
    const FREE: [bool; ROTORS] = [false; ROTORS];

    fn ideal() -> Rotors {
        Rotors::new(&IDEAL, &Conditions::GENTLE, 0)
    }

    #[test]
    fn a_weak_propeller_pushes_less_and_a_stuck_transistor_ignores_its_duty() {
        let settled = |fault: RotorFault, duty: f64| {
            let mut rotors = ideal();
            rotors.set_fault(1, fault);
            rotors.set_duty([duty; ROTORS]);
            let loads = (0..1600).map(|_| rotors.step(625e-6, 4.0, 1.0, FREE)).last().expect("steps");
            (rotors.speed(), loads)
        };
        let (healthy, all) = settled(RotorFault::NONE, 0.6);
        let (speed, loads) = settled(RotorFault { thrust: 0.5, duty: None }, 0.6);
        assert_eq!(speed, healthy, "it turns as before");
        assert!((loads.thrust / all.thrust - 0.875).abs() < 1e-3 && loads.torque.x.abs() > 1e-4, "{loads:?}");
        let (speed, _) = settled(RotorFault { duty: Some(1.0), ..RotorFault::NONE }, 0.0);
        assert!(speed[1] > healthy[1] && speed[0] < 1.0, "{speed:?}");
    }

    #[test]
    fn specimens_lie_apart_as_their_conditions_say_and_no_farther() {
        let conditions =
            Conditions { rotor_spread: 0.05, centre_spread: 0.0012, spread_limit: 2.5, ..Conditions::GENTLE };
        let (mut square, mut farthest, mut most) = (0.0, 0.0f64, 0.0f64);
        let count = 2_000;
        for seed in 0..count {
            let rotors = Rotors::new(&PlantParameters::EXAMPLE, &conditions, seed);
            let [x, y] = [0, 1].map(|axis| -rotors.places.iter().map(|p| [p.0, p.1][axis]).sum::<f64>() / 4.0);
            farthest = farthest.max((x * x + y * y).sqrt());
            for coefficient in rotors.thrust_coefficient {
                let share = coefficient / PlantParameters::EXAMPLE.thrust_coefficient - 1.0;
                most = most.max(share.abs());
                square += share * share / (4 * count) as f64;
            }
        }
        assert!((square.sqrt() / 0.05 - 1.0).abs() < 0.06, "{}", square.sqrt());
        assert!((0.12..=0.125 + 1e-12).contains(&most), "{most}");
        assert!((0.0029..=0.003 + 1e-12).contains(&farthest), "{farthest} m");
    }

    #[test]
    fn motors_turn_differently_fast_on_the_same_voltage() {
        let conditions = Conditions { rotor_curve_spread: 0.05, rotor_place_spread: 0.0005, ..Conditions::GENTLE };
        let (mut square, mut aside, count) = (0.0, 0.0, 200);
        for seed in 0..count {
            let mut rotors = Rotors::new(&PlantParameters { manufacturing_spread: 1.0, ..IDEAL }, &conditions, seed);
            rotors.set_duty([0.6; 4]);
            settle(&mut rotors, 4.0);
            let mean = rotors.speed().iter().sum::<f64>() / 4.0;
            square += rotors.speed().map(|speed| (speed / mean - 1.0).powi(2)).iter().sum::<f64>() / (4 * count) as f64;
            let across = rotors.places[0].1 - rotors.places[1].1;
            aside += across * across / count as f64;
        }
        // A stronger magnet needs less current for the same torque but has more back-EMF; the
        // effects partly cancel.
        assert!((0.01..0.04).contains(&square.sqrt()), "{}", square.sqrt());
        assert!((aside.sqrt() / (0.0005 * 2f64.sqrt()) - 1.0).abs() < 0.15, "{} m", aside.sqrt());
    }

    #[test]
    fn the_collective_lags_and_the_lift_comes_all_the_same() {
        let mut rotors = Rotors::new(&IDEAL, &Conditions { collective_lag: 0.09, ..Conditions::GENTLE }, 0);
        rotors.set_duty([0.62; 4]);
        let before = settle(&mut rotors, 4.15).thrust;
        rotors.set_duty([0.64; 4]);
        let trace: Vec<_> = (0..1600).map(|_| rotors.step(DT, 4.15, 1.0, FREE).thrust - before).collect();
        let goal = trace[1599] * (1.0 - (-1f64).exp());
        let lag = trace.iter().filter(|gain| **gain < goal).count() as f64 * DT;
        assert!((0.1..0.125).contains(&lag), "the rotors' 20 ms and 90: {lag} s");
    }

    /// Steady voltage at a speed.
    fn curve(w: f64) -> f64 {
        IDEAL.motor_voltage_a * w * w + IDEAL.motor_voltage_b * w + IDEAL.motor_voltage_c
    }

    fn settle(rotors: &mut Rotors, voltage: f64) -> RotorLoads {
        let mut loads = RotorLoads::default();
        for _ in 0..1600 {
            loads = rotors.step(1.0 / 1600.0, voltage, 1.0, FREE);
        }
        loads
    }

    #[test]
    fn steady_speed_follows_the_measured_voltage_curve() {
        for voltage in [0.5, 1.0, 2.0, 3.0, 4.0] {
            let mut rotors = ideal();
            rotors.set_duty([1.0; 4]);
            settle(&mut rotors, voltage);
            let w = rotors.speed()[0];
            let curve = curve(w);
            assert!((curve - voltage).abs() < 1e-3, "{voltage} V gives {w} rad/s, which needs {curve} V");
        }
    }

    #[test]
    fn hover_needs_the_weight_and_the_duty_of_the_curve() {
        let mut rotors = ideal();
        let w = rotors.hover_speed();
        for battery in [3.7, 4.2] {
            let duty = curve(w) / battery;
            rotors.set_duty([duty; 4]);
            let loads = settle(&mut rotors, battery);
            assert!((loads.thrust / (IDEAL.mass * IDEAL.gravity) - 1.0).abs() < 2e-3, "{}", loads.thrust);
            assert!(loads.torque.norm() < 1e-9 && loads.momentum_z.abs() < 1e-9, "balanced");
            // Torque divided by the motor constant, times the share of time for which the switch
            // conducts.
            let per_volt = IDEAL.torque_coefficient / IDEAL.motor_voltage_a;
            let each = (curve(w) - per_volt * IDEAL.motor_resistance * w) / IDEAL.motor_resistance;
            assert!((loads.current / (4.0 * duty * each) - 1.0).abs() < 2e-3, "{} A", loads.current);
        }
    }

    #[test]
    fn a_small_step_at_hover_has_a_time_constant_of_twenty_milliseconds() {
        let mut rotors = ideal();
        rotors.set_duty([0.62; 4]);
        settle(&mut rotors, 4.15);
        let before = rotors.speed()[0];
        rotors.set_duty([0.63; 4]);
        let mut trace = Vec::new();
        for _ in 0..320 {
            rotors.step(1.0 / 1600.0, 4.15, 1.0, FREE);
            trace.push(rotors.speed()[0] - before);
        }
        let goal = trace[319] * (1.0 - (-1f64).exp());
        let constant = trace.iter().filter(|gain| **gain < goal).count() as f64 / 1600.0;
        assert!((0.016..0.022).contains(&constant), "{constant} s");
    }

    #[test]
    fn each_motor_pushes_the_body_the_way_the_mixer_expects() {
        // Roll, pitch, yaw signs: front right (-,+,+), rear right (-,-,-), rear left (+,-,+), front
        // left (+,+,-).
        let signs = [(-1.0, 1.0, 1.0), (-1.0, -1.0, -1.0), (1.0, -1.0, 1.0), (1.0, 1.0, -1.0)];
        for (motor, (roll, pitch, yaw)) in signs.into_iter().enumerate() {
            let mut rotors = ideal();
            let mut duty = [0.0; 4];
            duty[motor] = 0.6;
            rotors.set_duty(duty);
            let t = settle(&mut rotors, 4.0).torque;
            assert!(t.x * roll > 1e-4 && t.y * pitch > 1e-4 && t.z * yaw > 1e-5, "motor {motor}: {t:?}");
        }
    }

    #[test]
    fn a_propeller_that_is_held_stands_and_its_motor_takes_the_current_of_a_stall() {
        let mut rotors = ideal();
        rotors.set_duty([0.6; 4]);
        let before = settle(&mut rotors, 4.0);
        let held = [true, false, false, false];
        let after = (0..16).map(|_| rotors.step(625e-6, 4.0, 1.0, held)).last().expect("steps");
        let [first, others @ ..] = rotors.speed();
        assert!(first < 0.01 * others[0], "{:?}", rotors.speed());
        assert!((after.thrust / before.thrust - 0.75).abs() < 1e-3 && after.torque.x > 1e-3, "{after:?}");
        // Duty times the winding current.
        let stall = 0.6 * 0.6 * 4.0 / IDEAL.motor_resistance;
        assert!((after.current - (0.75 * before.current + stall)).abs() < 0.02 * stall, "{after:?}");
        // Released, it turns again.
        assert!((settle(&mut rotors, 4.0).thrust / before.thrust - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_motor_that_is_switched_off_coasts_to_a_stop() {
        let mut rotors = ideal();
        rotors.set_duty([0.6; 4]);
        settle(&mut rotors, 4.0);
        rotors.set_duty([0.0; 4]);
        let loads = rotors.step(1.0 / 1600.0, 4.0, 1.0, FREE);
        assert_eq!(loads.current, 0.0, "no current flows back");
        settle(&mut rotors, 4.0);
        assert_eq!(rotors.speed(), [0.0; 4]);
    }
}
