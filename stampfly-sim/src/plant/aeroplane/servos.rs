//! Servos and the control surfaces that they move.
//!
//! A servo receives its target with the next pulse and follows it with a first-order lag and a
//! limited speed. Play and aerodynamic load are neglected.

use super::AeroplaneParameters;
use crate::plant::DT;

/// Actuators of an aeroplane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Surface {
    /// Positive with the trailing edge down.
    RightAileron = 0,
    /// Positive with the trailing edge down.
    LeftAileron = 1,
    /// Positive with the trailing edge down.
    Elevator = 2,
    /// Positive with the trailing edge left; turns the nose wheel as well.
    Rudder = 3,
    /// Both flaps, positive with the trailing edge down; they do not deflect upwards.
    Flaps = 4,
    /// Brakes of the main wheels, 0 to 1; not a surface, but moved by a servo.
    Brake = 5,
}

/// Number of actuators.
pub const SURFACES: usize = 6;

/// State of all servos, in shares of the largest deflection.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Servos {
    /// Commands of the flight stack.
    commanded: [f64; SURFACES],
    /// Targets received with the last pulse.
    target: [f64; SURFACES],
    position: [f64; SURFACES],
    jammed: [Option<f64>; SURFACES],
    /// Share of the distance to the target covered per step.
    gain: f64,
    /// Largest movement per step.
    limit: f64,
    /// Steps between two pulses.
    period: u32,
    countdown: u32,
}

impl Servos {
    pub(super) fn new(p: &AeroplaneParameters) -> Self {
        Self {
            commanded: [0.0; SURFACES],
            target: [0.0; SURFACES],
            position: [0.0; SURFACES],
            jammed: [None; SURFACES],
            gain: 1.0 - libm::exp(-DT / p.servo_time_constant.max(1e-6)),
            limit: p.servo_speed * DT,
            period: (p.servo_period / DT).round().max(1.0) as u32,
            countdown: 1,
        }
    }

    /// Commands shares of the largest deflections, −1 to 1.
    pub(super) fn command(&mut self, shares: [f64; SURFACES]) {
        self.commanded = shares;
        // Flaps and brakes have no negative range.
        for surface in [Surface::Flaps, Surface::Brake] {
            self.commanded[surface as usize] = self.commanded[surface as usize].max(0.0);
        }
    }

    /// Moves all servos to their commands without delay, for a start in flight.
    pub(super) fn settle(&mut self) {
        (self.target, self.position) = (self.commanded, self.commanded);
    }

    pub(super) fn jam(&mut self, surface: Surface, at: Option<f64>) {
        self.jammed[surface as usize] = at;
    }

    /// Positions in shares of the largest deflection.
    pub(super) fn position(&self) -> [f64; SURFACES] {
        self.position
    }

    pub(super) fn step(&mut self) {
        self.countdown -= 1;
        if self.countdown == 0 {
            (self.countdown, self.target) = (self.period, self.commanded);
        }
        for ((position, target), jammed) in self.position.iter_mut().zip(self.target).zip(self.jammed) {
            // A jammed servo moves to its jam position with its own dynamics.
            let target = jammed.unwrap_or(target);
            *position += ((target - *position) * self.gain).clamp(-self.limit, self.limit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_servo_is_as_fast_as_it_can_and_ends_where_it_was_told() {
        let mut servos = Servos::new(&AeroplaneParameters::EXAMPLE);
        let mut shares = [0.0; SURFACES];
        (shares[2], shares[4]) = (-1.0, -1.0);
        servos.command(shares);
        let mut course = Vec::new();
        for _ in 0..480 {
            servos.step();
            course.push(servos.position()[2]);
        }
        // Limited to 11 shares per second at first, then the lag dominates: 70 % after about 64 ms.
        let fastest = course.windows(2).map(|pair| (pair[0] - pair[1]) / DT).fold(0.0, f64::max);
        assert!((fastest - 11.0).abs() < 0.01, "{fastest}");
        let reached = course.iter().position(|share| *share < -0.7).expect("moves") as f64 * DT;
        assert!((0.06..0.07).contains(&reached), "{reached} s");
        assert!((course[479] + 1.0).abs() < 0.01 && servos.position()[4] == 0.0, "flaps do not go up");
        servos.jam(Surface::Elevator, Some(0.25));
        (0..480).for_each(|_| servos.step());
        assert!((servos.position()[2] - 0.25).abs() < 0.01);
    }

    #[test]
    fn a_command_waits_for_the_next_pulse() {
        let mut servos = Servos::new(&AeroplaneParameters::EXAMPLE);
        servos.step();
        servos.command([1.0; SURFACES]);
        let waits = (0..100).take_while(|_| {
            servos.step();
            servos.position()[0] == 0.0
        });
        assert_eq!(waits.count(), 31, "20 ms after the last pulse");
    }
}
