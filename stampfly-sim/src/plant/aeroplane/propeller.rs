//! Model of a brushless motor with a fixed propeller.
//!
//! ```text
//! current  I = (duty·Vbat − K·ω) / R, never negative: the motor controller does not brake
//! speed    J·dω/dt = K·(I − I0) − Q
//! thrust   T = ρ·n²·D⁴·Ct(J),  torque  Q = ρ·n²·D⁵·Cp(J) / 2π,  advance ratio J = V / (n·D)
//! ```
//!
//! V is the airspeed along the axis. Cross flow has no effect on the propeller, and the slipstream
//! none on wing and tail. A propeller that touches the ground stops: no thrust, and the stall
//! current of its motor.

use super::AeroplaneParameters;
use crate::plant::RotorFault;
use crate::plant::battery::Load;
use core::f64::consts::TAU;

/// Time constant with which a propeller that touches the ground stops, s: half a turn of a small
/// propeller.
const STOPS: f64 = 0.003;

/// Action of the propeller on the body in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PropellerLoads {
    /// Thrust along body x, N.
    pub thrust: f64,
    /// Torque on the airframe about body x without the gyroscopic part, N·m.
    pub torque: f64,
    /// Angular momentum along body x, N·m·s.
    pub momentum: f64,
    /// Current drawn from the battery, A.
    pub current: f64,
}

/// The propeller with its motor.
#[derive(Clone, Debug, PartialEq)]
pub struct Propeller {
    duty: f64,
    speed: f64,
    fault: RotorFault,
    /// ρ·D⁴ and ρ·D⁵ / 2π.
    scale: [f64; 2],
    diameter: f64,
    thrust: [f64; 4],
    power: [f64; 4],
    advance_limit: f64,
    constant: f64,
    resistance: f64,
    idle_current: f64,
    inertia: f64,
    spin: f64,
}

impl Propeller {
    /// A propeller that turns at `speed`, rad/s.
    pub(super) fn new(p: &AeroplaneParameters, speed: f64) -> Self {
        let d = p.propeller_diameter;
        let d4 = d * d * d * d;
        Self {
            duty: 0.0,
            speed,
            fault: RotorFault::NONE,
            scale: [p.air_density * d4, p.air_density * d4 * d / TAU],
            diameter: d,
            thrust: [p.thrust_0, p.thrust_1, p.thrust_2, p.thrust_3],
            power: [p.power_0, p.power_1, p.power_2, p.power_3],
            advance_limit: p.advance_limit,
            constant: p.motor_constant,
            resistance: p.motor_resistance,
            idle_current: p.motor_idle_current,
            inertia: p.propeller_inertia,
            spin: p.propeller_spin,
        }
    }

    pub(super) fn set_duty(&mut self, duty: f64) {
        self.duty = duty;
    }

    pub(super) fn set_fault(&mut self, fault: RotorFault) {
        self.fault = fault;
    }

    /// Duty cycle, 0 to 1.
    #[must_use]
    pub fn duty(&self) -> f64 {
        self.duty
    }

    /// Rotor speed, rad/s, never negative.
    #[must_use]
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Thrust, N, and drag torque, N·m, at this speed, rad/s, and axial airspeed, m/s.
    pub(super) fn at(&self, speed: f64, air: f64) -> [f64; 2] {
        let turns = speed / TAU;
        // Limited to the range of the polynomials: outside it they are meaningless.
        let advance = (air / (turns * self.diameter).max(1e-3)).clamp(0.0, self.advance_limit);
        let polynomial = |c: &[f64; 4]| c[0] + advance * (c[1] + advance * (c[2] + advance * c[3]));
        let square = turns * turns;
        [self.scale[0] * square * polynomial(&self.thrust), self.scale[1] * square * polynomial(&self.power)]
    }

    /// Motor voltage that holds this speed at this axial airspeed, V.
    pub(super) fn voltage(&self, speed: f64, air: f64) -> f64 {
        let current = self.at(speed, air)[1] / self.constant + self.idle_current;
        self.constant * speed + self.resistance * current.max(0.0)
    }

    /// Effective duty cycle: a stuck transistor overrides the command.
    fn switched(&self) -> f64 {
        self.fault.duty.unwrap_or(self.duty)
    }

    /// The motor as a load of the battery at its present speed.
    pub(super) fn load(&self) -> Load {
        Load::of_motor(self.switched(), self.resistance, self.constant * self.speed)
    }

    /// Advances by `dt` seconds at `voltage` with the axial airspeed `air`. `held`: it touches the
    /// ground.
    pub(super) fn step(&mut self, dt: f64, voltage: f64, air: f64, held: bool) -> PropellerLoads {
        let duty = self.switched();
        let current = ((duty * voltage - self.constant * self.speed) / self.resistance).max(0.0);
        let before = self.speed;
        if held {
            // The ground takes up the braking torque; the body receives the motor's torque only.
            self.speed = before * (1.0 - dt / STOPS).max(0.0);
            let torque = -self.spin * self.constant * current;
            let momentum = self.spin * self.inertia * before;
            return PropellerLoads { thrust: 0.0, torque, momentum, current: duty * current };
        }
        let [thrust, drag] = self.at(self.speed, air);
        // The idle current stands for friction, independent of speed.
        let net = self.constant * (current - self.idle_current) - drag;
        self.speed = (before + net / self.inertia * dt).max(0.0);
        let reaction = drag + self.inertia * (self.speed - before) / dt;
        PropellerLoads {
            thrust: thrust * self.fault.thrust,
            torque: -self.spin * reaction,
            momentum: self.spin * self.inertia * before,
            current: duty * current,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settled(duty: f64, air: f64) -> (Propeller, PropellerLoads) {
        let mut propeller = Propeller::new(&AeroplaneParameters::EXAMPLE, 500.0);
        propeller.set_duty(duty);
        let loads = (0..3200).map(|_| propeller.step(625e-6, 11.5, air, false)).last().expect("steps");
        (propeller, loads)
    }

    #[test]
    fn thrust_falls_with_airspeed_and_the_motor_has_the_power_that_the_propeller_takes() {
        let thrusts = [0.0, 5.0, 10.0, 15.0, 20.0, 30.0].map(|air| settled(1.0, air).1.thrust);
        assert!(thrusts.windows(2).all(|pair| pair[0] > pair[1]), "{thrusts:?}");
        assert!((5.0..8.0).contains(&thrusts[0]) && thrusts[3] > 3.0, "{thrusts:?}");
        let (propeller, loads) = settled(0.7, 15.0);
        let voltage = propeller.voltage(propeller.speed(), 15.0);
        assert!((voltage - 0.7 * 11.5).abs() < 1e-6, "{voltage} V");
        let shaft = propeller.at(propeller.speed(), 15.0)[1] * propeller.speed();
        let efficiency = shaft / (loads.current * 11.5);
        assert!((0.6..0.95).contains(&efficiency), "{efficiency}");
    }

    /// The manufacturer's table: 0.0514 and 0.0317 at an advance ratio of 0.4888.
    #[test]
    fn coefficients_are_the_published_ones() {
        let propeller = Propeller::new(&AeroplaneParameters::EXAMPLE, 0.0);
        let (turns, d) = (100.0, 0.2032f64);
        let [thrust, torque] = propeller.at(turns * TAU, 0.4888 * turns * d);
        assert!((thrust / (1.225 * turns * turns * d.powi(4)) - 0.0514).abs() < 1e-3);
        assert!((torque * TAU / (1.225 * turns * turns * d.powi(5)) - 0.0317).abs() < 1.1e-3);
    }

    #[test]
    fn in_the_ground_it_stands_and_its_motor_takes_the_current_of_a_stall() {
        let (mut propeller, before) = settled(0.5, 0.0);
        let loads = (0..32).map(|_| propeller.step(625e-6, 11.5, 0.0, true)).last().expect("steps");
        assert!(propeller.speed() < 1.0 && loads.thrust == 0.0, "{propeller:?} {loads:?}");
        // Duty times the winding current.
        let stall = 0.5 * 0.5 * 11.5 / AeroplaneParameters::EXAMPLE.motor_resistance;
        assert!((loads.current / stall - 1.0).abs() < 0.02 && loads.current > 3.0 * before.current, "{loads:?}");
    }

    #[test]
    fn without_power_it_windmills_and_brakes_a_little() {
        let (propeller, loads) = settled(0.0, 15.0);
        assert!(propeller.speed() > 300.0 && (-0.6..0.0).contains(&loads.thrust), "{propeller:?} {loads:?}");
        assert_eq!(loads.current, 0.0);
    }
}
