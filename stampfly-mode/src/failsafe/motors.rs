//! A motor or a propeller that has become weak.
//!
//! Its thrust is missed on one corner, so the controller asks for torque about roll and pitch at
//! once, and keeps asking. A gust or a manoeuvre asks for as much for a moment, a shifted load
//! about one axis. What the motors cannot make of the demand does not count: on a tired battery a
//! controller asks for it whatever its rotors are like. A battery that lies askew asks for it from
//! the take-off on: so what has become so counts from [`WEAK_SHARE`](super::WEAK_SHARE) of a
//! rotor's share of the weight on, what has been so from [`STANDING`] times that on. Half a
//! propeller that was broken before looks like a battery that lies askew, and is trimmed as one. A
//! vehicle on the ground says nothing, because what holds it looks the same. Nor does one whose motors
//! are hardly asked to push: slow rotors slow down over many of their lags, so what is asked of them
//! is not what they make.
//!
//! With half of a rotor's thrust a vehicle lands. A controller that asks for more than one rotor's whole share about both axes
//! does not get it: the other three have nothing left, and the vehicle turns over as it comes down. That motor is lost. It shows at
//! once, or it is a weak one.

use super::config::{FailsafeConfig, WEAK_SHARE};
use super::input::FailsafeInput;
use crate::lasting::lasts;
use stampfly_types::messages::{FlightPhase, Validity};
use stampfly_types::{Duration, Instant, math};

/// Weight of a step in the mean torque: a time constant of 50 ms at 400 Hz, two of a motor.
const WEIGHT: f32 = 0.05;
/// Weight of a step in the usual torque: 3 s, which a weakness of a tenth of a second does not move.
const USUAL: f32 = 0.0008;
/// Largest usual torque, as a multiple of a weak motor's: three quarters of a rotor's share of the
/// weight. A centre of mass 3 mm aside of a StampFly's 23 about both axes asks for 0.52 of it,
/// and rotors that differ by an eighth for 0.18.
const STANDING: f32 = 2.5;
/// A motor is lost from this many times a weak one's torque on: a rotor's share of the weight.
const LOST: f32 = 1.0 / WEAK_SHARE;

/// A lost motor asks for that this soon after the torque has become uneven. One that asks later is weak, and lands: it is not dropped.
const SOON: Duration = Duration::from_millis(160);

/// Mean thrust, in shares of the weight, below which a torque is not what the motors make.
const PUSHES: f32 = 0.5;

/// What is remembered of the torque that the motors are told to make.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct MotorMonitor {
    /// About roll and pitch, N·m.
    mean: [f32; 2],
    usual: [f32; 2],
    /// Along the thrust, N.
    thrust: f32,
    uneven: Option<Instant>,
    uncontrolled: Option<Instant>,
}

impl MotorMonitor {
    /// Is a motor weak, and is one lost? `known_weak`: one of them was found weak in this flight.
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        now: Instant,
        input: &FailsafeInput<'_>,
        known_weak: bool,
    ) -> [bool; 2] {
        let (estimate, phase) = (input.estimate, input.flight_status.phase);
        let height = estimate.valid.contains(Validity::HEIGHT).then_some(estimate.height);
        let near = height.is_some_and(|height| height < config.lift_height);
        let flies = matches!(phase, FlightPhase::TakeOff | FlightPhase::Flying) && !near;
        // One that lands cannot do more about a weak motor, and a lost one drops it from any height. But what stands without
        // knowing it looks the same.
        let above = if known_weak { config.lift_height } else { config.touch_height };
        let lands = phase == FlightPhase::Landing && height.is_some_and(|height| height > above);
        self.thrust += (input.output.thrust - self.thrust) * WEIGHT;
        let pushes = math::smaller(self.thrust, input.output.thrust) > PUSHES * config.hover_thrust
            || config.hover_thrust == f32::INFINITY;
        if !pushes && (flies || lands) {
            // What is usual remains so.
            (self.uneven, self.uncontrolled) = (self.uneven.filter(|_| known_weak), None);
            return [false; 2];
        }
        let made = input.torque();
        let made = [made.x, made.y];
        let limits = [config.weak_roll, config.weak_pitch];
        let (mut became, mut stands, mut exceeds) = (true, true, true);
        for axis in 0..2 {
            self.mean[axis] += (made[axis] - self.mean[axis]) * WEIGHT;
            let risen = self.mean[axis] - self.usual[axis];
            self.usual[axis] += risen * USUAL;
            became &= risen.abs() > limits[axis];
            stands &= self.mean[axis].abs() > STANDING * limits[axis];
            exceeds &= self.mean[axis].abs() > LOST * limits[axis];
        }
        if !flies && !lands {
            // What the ground has asked for is no weakness, and is gone soon. A motor that was found weak remains it.
            self.uneven = self.uneven.filter(|_| known_weak);
            (self.usual, self.uncontrolled) = (self.mean, None);
            return [false; 2];
        }
        let uneven = lasts(&mut self.uneven, now, became || stands || known_weak, config.weak_motor_time);
        let shows = self.uncontrolled.is_some() || self.uneven.is_some_and(|since| now.since(since) < SOON);
        let lost = lasts(&mut self.uncontrolled, now, exceeds && shows, config.weak_motor_time);
        [uneven && flies, lost]
    }
}
