//! Rejects combinations of parameters that are not a quadrotor or cannot be simulated.
//!
//! Each parameter has a [range](stampfly_param::ParameterInfo) wide enough for vehicles from 10 g
//! to 2 kg. Within the ranges, combinations are still possible that make no sense: a battery of 1 Ω
//! in a vehicle of 37 g, feet too stiff for the step of the physics. A flight with them would give
//! an arbitrary result, so it is refused with the reason.
//!
//! For parameters entered by users. Code that constructs [`PlantParameters`] may skip the check,
//! for example a test with a weightless body.

use super::{DT, PlantParameters, ROTORS};
use crate::plant::battery::Battery;
use core::fmt;

/// Least lift at full duty, in weights. A vehicle that lifts 0.9 of its weight is a valid test of
/// the flight stack. Below one half the rotors do not spin up.
const LIFT: f64 = 0.5;
/// Largest phase of a contact spring's oscillation per step, rad. An explicit step is unstable
/// above 2.
const SPRING: f64 = 1.0;
/// Largest share of a velocity that a damper removes per step. An explicit step is unstable above
/// 2.
const DAMPER: f64 = 1.5;
/// Rate at which rotational drag is evaluated, rad/s: the end of the gyro's range.
const RATE: f64 = 35.0;

/// Why parameters, each within its range, do not describe a vehicle that can be simulated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CannotSimulate(pub String);

impl fmt::Display for CannotSimulate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for CannotSimulate {}

/// Steady state of the rotors at full duty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullThrottle {
    /// Sum of thrusts over the weight; infinite without gravity.
    pub lift: f64,
    /// Battery voltage under that load, V.
    pub voltage: f64,
    /// Battery current, A.
    pub current: f64,
}

impl PlantParameters {
    /// Steady state of rotors without spread at full duty, with the battery's initial charge and
    /// settled polarisation.
    #[must_use]
    pub fn full_throttle(&self) -> FullThrottle {
        let battery = self.battery();
        let open = Battery::new(&battery, 0.0).open_circuit();
        let resistance = battery.resistance + battery.polarisation;
        let constant = self.motor_constant();
        let at = |voltage: f64| {
            let speed = self.steady_speed(voltage);
            let each = ((voltage - constant * speed) / self.motor_resistance).max(0.0);
            (speed, ROTORS as f64 * each + self.board_current)
        };
        // The current grows with the voltage, and the remaining voltage falls with the current:
        // bisection finds their unique intersection.
        let (mut low, mut high) = (0.0, open);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let left = open - resistance * at(middle).1;
            if left > middle { low = middle } else { high = middle }
        }
        let (speed, current) = at(low);
        let thrust = ROTORS as f64 * self.thrust_coefficient * speed * speed;
        FullThrottle { lift: thrust / (self.mass * self.gravity), voltage: low, current }
    }

    /// Steady speed of a motor at this voltage, rad/s: the positive root of the voltage curve.
    fn steady_speed(&self, voltage: f64) -> f64 {
        let Self { motor_voltage_a: a, motor_voltage_b: b, motor_voltage_c: c, .. } = *self;
        let over = (voltage - c).max(0.0);
        ((b * b + 4.0 * a * over).sqrt() - b) / (2.0 * a)
    }

    /// Back-EMF constant, V·s/rad, which the voltage curve fixes for a given resistance.
    pub(super) fn motor_constant(&self) -> f64 {
        self.torque_coefficient / self.motor_voltage_a * self.motor_resistance
    }

    /// Checks that these parameters are a quadrotor that can be simulated.
    ///
    /// # Errors
    /// [`CannotSimulate`] with the reason.
    pub fn check(&self) -> Result<(), CannotSimulate> {
        let refused = |reason: String| Err(CannotSimulate(reason));
        let inertia = [self.inertia_x, self.inertia_y, self.inertia_z];
        let half = 0.5 * inertia.iter().sum::<f64>();
        for (axis, moment) in ["x", "y", "z"].into_iter().zip(inertia) {
            // The triangle inequality of principal moments, with a tolerance for flat bodies, which
            // reach equality.
            if moment > half * (1.0 + 1e-9) {
                return refused(format!(
                    "inertia_{axis} {moment}: no rigid body has a moment of inertia above the sum of the other two"
                ));
            }
        }
        let constant = self.motor_constant();
        if constant > self.motor_voltage_b {
            return refused(format!(
                "motor_resistance {}: with this voltage curve the motor would make more voltage than it is given",
                self.motor_resistance
            ));
        }
        self.check_step(constant)?;
        let full = self.full_throttle();
        if full.lift < LIFT {
            return refused(format!(
                "battery_resistance {} ohm, mass {} kg: at full duty the battery falls to {:.2} V, and the rotors make {:.0} % of the weight: \
                 they do not spin up",
                self.battery_resistance,
                self.mass,
                full.voltage,
                100.0 * full.lift
            ));
        }
        Ok(())
    }

    /// Checks that springs and dampers are slow enough for one step of the physics.
    fn check_step(&self, motor_constant: f64) -> Result<(), CannotSimulate> {
        let least = self.inertia_x.min(self.inertia_y);
        let reach = self.foot_offset.max(self.corner_offset);
        // Worst case: all four feet act at once, vertically and about the axis with the least
        // moment of inertia.
        let carried = 1.0 / self.mass + reach * reach / least;
        let spring = DT * (4.0 * self.foot_stiffness * carried).sqrt();
        let damper = DT * 4.0 * self.foot_damping * carried;
        let full_speed = self.steady_speed(Battery::new(&self.battery(), 0.0).open_circuit());
        let per_volt = self.torque_coefficient / self.motor_voltage_a;
        let viscous = (self.motor_voltage_b - motor_constant) * per_volt;
        // Damping of a rotor at full speed: electrical braking, the slope of the propeller's drag,
        // and viscous friction.
        let braked = motor_constant * motor_constant / self.motor_resistance
            + 2.0 * self.torque_coefficient * full_speed
            + viscous;
        let quickest = [
            ("foot_stiffness", self.foot_stiffness, spring, SPRING),
            ("foot_damping", self.foot_damping, damper, DAMPER),
            ("rotor_inertia", self.rotor_inertia, DT * braked / self.rotor_inertia, DAMPER),
            ("drag_rotation", self.drag_rotation, DT * self.drag_rotation * RATE / least, DAMPER),
        ];
        match quickest.into_iter().find(|(.., acts, limit)| acts > limit) {
            Some((name, value, ..)) => Err(CannotSimulate(format!(
                "{name} {value}: with these masses it acts quicker than a step of the physics, {} ms",
                1e3 * DT
            ))),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{GRAVITY, Plant, Pose, WindConfig};

    const GOOD: PlantParameters = PlantParameters { manufacturing_spread: 0.0, ..PlantParameters::EXAMPLE };

    fn reason(parameters: &PlantParameters) -> String {
        parameters.check().expect_err("no vehicle").to_string()
    }

    #[test]
    fn full_throttle_is_what_the_plant_makes_at_full_duty() {
        assert_eq!(GOOD.check(), Ok(()));
        let full = GOOD.full_throttle();
        // Short time constant: the polarisation acts at once. Far above the ground: no ground
        // effect.
        let parameters = PlantParameters { battery_time_constant: 0.1, battery_capacity: 10.0, ..GOOD };
        let mut plant = Plant::new(&parameters, &WindConfig::CALM, Some(&Pose::hovering(1000.0)), 1);
        plant.set_duty([1.0; 4]);
        (0..1600).for_each(|_| plant.step());
        let speed = plant.rotors().speed()[0];
        let lift = 4.0 * GOOD.thrust_coefficient * speed * speed / (GOOD.mass * GRAVITY);
        assert!((full.lift / lift - 1.0).abs() < 5e-3, "{full:?} {lift}");
        assert!((full.voltage - plant.battery().voltage()).abs() < 0.01, "{full:?} {}", plant.battery().voltage());
        assert!((full.current / plant.motion().current - 1.0).abs() < 5e-3, "{full:?}");
    }

    #[test]
    fn a_battery_that_cannot_spin_the_rotors_up_is_refused_and_says_why() {
        let weak = PlantParameters { battery_resistance: 1.0, ..GOOD };
        assert!(weak.full_throttle().lift < 0.4, "{:?}", weak.full_throttle());
        let reason = reason(&weak);
        assert!(reason.contains("battery_resistance 1 ohm") && reason.contains("do not spin up"), "{reason}");
        // More cells make it valid, and so does a body without weight.
        assert_eq!(PlantParameters { battery_cells: 3.0, ..weak.clone() }.check(), Ok(()));
        assert_eq!(PlantParameters { gravity: 0.0, ..weak }.check(), Ok(()));
    }

    #[test]
    fn what_nearly_lifts_is_a_test_and_is_not_refused() {
        let heavy = PlantParameters { mass: GOOD.mass * GOOD.full_throttle().lift / 0.8, ..GOOD };
        assert_eq!(heavy.check(), Ok(()));
        let too_heavy = PlantParameters { mass: GOOD.mass * GOOD.full_throttle().lift / 0.4, ..GOOD };
        assert!(reason(&too_heavy).contains("40 % of the weight"), "{}", reason(&too_heavy));
    }

    #[test]
    fn no_rigid_body_and_no_motor_is_refused() {
        assert!(reason(&PlantParameters { inertia_z: 5e-5, ..GOOD }).contains("inertia_z"));
        assert!(reason(&PlantParameters { motor_resistance: 0.6, ..GOOD }).contains("motor_resistance"));
    }

    #[test]
    fn what_acts_quicker_than_a_step_is_refused() {
        for (name, parameters) in [
            ("foot_stiffness", PlantParameters { corner_offset: 0.2, ..GOOD }),
            ("foot_damping", PlantParameters { inertia_x: 1.3e-5, inertia_y: 2.8e-5, foot_damping: 3.0, ..GOOD }),
            ("rotor_inertia", PlantParameters { rotor_inertia: 1e-10, ..GOOD }),
            ("drag_rotation", PlantParameters { drag_rotation: 2e-3, ..GOOD }),
        ] {
            let reason = reason(&parameters);
            assert!(reason.starts_with(name), "{name}: {reason}");
        }
    }
}
