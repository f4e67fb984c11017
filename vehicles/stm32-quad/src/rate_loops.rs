//! The original's PID loops, step for step: sticks, angles and rates to shares of a motor's range.
//!
//! An angle's error times `rotation_max / angle_max` is the rate that is wanted, so full stick is the same share of both. The integral and the derivative are
//! sums and differences of single steps, and the document's constants turn them into seconds. Three things are kept as they are, because its reference
//! values have them: the first error after the throttle was down acts through the derivative with its whole size; a throttle that is down clears integral and last
//! error, and not the derivative's filter; the integral's limit is a rate of `rotation_max` for one second. For a loop with an integrator that knows what the motors
//! could not do, use [`stampfly_control::pid`].

use crate::parameters::Parameters;
use serde::{Deserialize, Serialize};
use stampfly_control::filter::LowPass;
use stampfly_types::{Duration, Vec3, math};

/// Time between two samples, and between two steps of the controller.
pub const PERIOD: Duration = Duration::from_micros(250);
/// And how many that is in a second.
pub const RATE: f32 = 4_000.0;

/// Sticks about roll, pitch, yaw, −1 to 1, and what full stick means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Demand {
    /// Sticks, 0 in the middle.
    pub sticks: [f32; 3],
    /// Sticks of roll and pitch are angles.
    pub angle_mode: bool,
}

/// What one step made of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// Rate that is wanted, rad/s.
    pub setpoint: f32,
    /// What is missing, rad/s.
    pub error: f32,
    /// Proportional, integral and derivative part.
    pub parts: [f32; 3],
}

impl Terms {
    /// The sum of the parts.
    #[must_use]
    pub fn output(&self) -> f32 {
        let [p, i, d] = self.parts;
        p + i + d
    }
}

/// One loop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct RateLoop {
    /// Sum of errors, rad/s.
    sum: f32,
    before: f32,
    difference: LowPass,
}

/// The three loops with their states.
///
/// ```
/// use stampfly_stm32_quad::Parameters;
/// use stampfly_stm32_quad::rate_loops::{Demand, RateLoops};
/// use stampfly_types::{Duration, Vec3};
/// let parameters = Parameters::default();
/// let mut loops = RateLoops::new(&parameters);
/// let right = Demand { sticks: [0.2, 0.0, 0.0], angle_mode: true };
/// let [roll, pitch, yaw] = loops.step(&right, &Vec3::zeros(), &Vec3::zeros(), &parameters);
/// assert!((roll.setpoint - 0.2 * parameters.stick.rotation_max).abs() < 1e-6);
/// assert_eq!([pitch.output(), yaw.output()], [0.0, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateLoops {
    loops: [RateLoop; 3],
    /// Corner frequency for which the filters are made, Hz.
    corner: f32,
}

impl RateLoops {
    /// Loops at rest.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let corner = parameters.filter.derivative;
        Self { loops: [RateLoop { sum: 0.0, before: 0.0, difference: filter(corner) }; 3], corner }
    }

    /// One step. Angles in rad, rates in rad/s, about roll, pitch, yaw.
    pub fn step(&mut self, demand: &Demand, angle: &Vec3, rate: &Vec3, parameters: &Parameters) -> [Terms; 3] {
        if self.corner != parameters.filter.derivative {
            self.corner = parameters.filter.derivative;
            for single in &mut self.loops {
                let value = single.difference.value();
                single.difference = filter(self.corner);
                single.difference.reset(value);
            }
        }
        let Parameters { roll, pitch, yaw, stick, .. } = parameters;
        let gains = [[roll.p, roll.i, roll.d], [pitch.p, pitch.i, pitch.d], [yaw.p, yaw.i, yaw.d]];
        let limit = stick.rotation_max * RATE;
        let measured = angle.to_array().into_iter().zip(rate.to_array());
        let mut terms = [Terms::default(); 3];
        let lines = self.loops.iter_mut().zip(gains).zip(demand.sticks).zip(measured).enumerate();
        for ((axis, (((single, [p, i, d]), stick_at), (angle, rate))), term) in lines.zip(&mut terms) {
            let setpoint = if demand.angle_mode && axis != 2 {
                (stick_at * stick.angle_max - angle) * (stick.rotation_max / stick.angle_max)
            } else {
                stick_at * stick.rotation_max
            };
            let error = setpoint - rate;
            // What is no number acts on nothing, now or later.
            if !error.is_finite() {
                continue;
            }
            // `clamp` panics when the limit is no number.
            single.sum = math::larger(math::smaller(single.sum + error, limit), -limit);
            let difference = single.difference.step(error - single.before);
            single.before = error;
            *term = Terms { setpoint, error, parts: [p * error, i * single.sum / RATE, d * difference * RATE] };
        }
        terms
    }

    /// The throttle is down: forgets the integrals and the last errors.
    pub fn cut(&mut self) {
        for single in &mut self.loops {
            (single.sum, single.before) = (0.0, 0.0);
        }
    }
}

/// A parameter is within its range, so there is a filter.
fn filter(corner: f32) -> LowPass {
    LowPass::with_corner(corner, RATE).unwrap_or(LowPass::with_alpha(1.0))
}
