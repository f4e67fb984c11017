//! What a flight controller is: state and set-point in, thrust and torque out.
//!
//! Everything that differs between control laws lives behind [`Controller`]; everything they agree on (which loops
//! the flight phase, the flight mode and the valid outputs of the estimator call for) is decided once, in
//! [`crate::intent`]. [`CascadeController`](crate::CascadeController) is the default,
//! [`IndiController`](crate::IndiController) the same with an innermost loop that learns at once what else turns the vehicle,
//! [`GeometricController`](crate::GeometricController) the proof that another law fits the same socket.

pub use crate::input::ControlInput;
use crate::intent::Intent;
use stampfly_types::Instant;
use stampfly_types::messages::ControlOutput;

/// A control law.
///
/// [`Self::step`] flies the flight modes of the family. A mode of one's own says what it wants as an [`Intent`] and calls
/// [`Self::follow`] instead; what the set-point says is then the mode's, whatever `flight_status` calls itself.
///
/// # Contract
/// * One of the two is called once per control period, at 20 Hz to 10 kHz; `now` never goes backwards.
/// * The output is finite and within the airframe's limits, whatever the input, for an intent that has been
///   [read](Intent::read) or made [possible](Intent::possible).
/// * Zero thrust and zero torque without an intent, which is unless the vehicle is armed and taking off, flying or landing.
/// * Outputs of the estimate whose validity bit is cleared are not used.
///
/// ```
/// use stampfly_control::intent::{Heading, Horizontal, Intent, Vertical};
/// use stampfly_control::{Airframe, CascadeConfig, CascadeController, ControlInput, Controller};
/// use stampfly_types::messages::*;
/// use stampfly_types::{Instant, Vec3, math};
///
/// /// A mode of one's own: a circle at a height, the nose along the way.
/// struct Orbit { radius: f32, rate: f32, height: f32 }
///
/// impl Orbit {
///     /// Where to be after so many seconds, and what of it is to be followed.
///     fn step(&self, seconds: f32) -> (Setpoint, Intent) {
///         let angle = self.rate * seconds;
///         let (sin, cos) = math::sin_cos(angle);
///         let (r, w) = (self.radius, self.rate);
///         let setpoint = Setpoint {
///             position: Vec3::new(r * cos, r * sin, -self.height),
///             velocity: Vec3::new(-r * w * sin, r * w * cos, 0.0),
///             acceleration: Vec3::new(-r * w * w * cos, -r * w * w * sin, 0.0),
///             ..Default::default()
///         };
///         let heading = Heading::Hold { yaw: angle + core::f32::consts::FRAC_PI_2, rate: w };
///         let (horizontal, vertical) = (Horizontal::Path, Vertical::Path);
///         (setpoint, Intent { horizontal, vertical, heading, grounded: false, tan_tilt_max: 0.4 })
///     }
/// }
///
/// let mut controller = CascadeController::new(&CascadeConfig::for_airframe(&Airframe::EXAMPLE));
/// let orbit = Orbit { radius: 2.0, rate: 0.8, height: 1.5 };
/// let (setpoint, intent) = orbit.step(0.0);
/// let input = ControlInput {
///     estimate: &StateEstimate { position: setpoint.position, velocity: setpoint.velocity, valid: Validity::ALL, ..Default::default() },
///     setpoint: &setpoint,
///     // Neither a pilot nor one of the family's modes flies.
///     command: &CommandSetpoint::default(),
///     flight_status: &FlightStatus::default(),
///     land_detected: &LandDetected { thrust_ceiling: f32::MAX, ..Default::default() },
///     unmet: [0.0; 4],
/// };
/// let output = controller.follow(Instant::from_micros(2_500), Some(intent.possible(&input)), &input);
/// assert!(output.torque.y > 0.0, "nose up: the circle's middle is behind");
/// assert_eq!(controller.step(Instant::from_micros(5_000), &input).thrust, 0.0, "the family's machine has not armed it");
/// ```
pub trait Controller {
    /// One control period in a flight mode of the family.
    #[inline]
    fn step(&mut self, now: Instant, input: &ControlInput<'_>) -> ControlOutput {
        self.follow(now, Intent::read(input), input)
    }

    /// One control period that follows an intent; `None` is motors that have nothing to do.
    fn follow(&mut self, now: Instant, intent: Option<Intent>, input: &ControlInput<'_>) -> ControlOutput;

    /// Forgets integrators and filters. What was learned about the vehicle (its hover thrust) stays.
    fn reset(&mut self);
}
