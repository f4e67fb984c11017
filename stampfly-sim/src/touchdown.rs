//! Assesses where and how an aeroplane touches down on a strip.
//!
//! Works on the true motion, not on the aircraft's estimate. A touch counts as a landing only after
//! the wheels have been higher than 3 m, so bounces are not counted. For vehicles that land
//! vertically use [`watched`](crate::watched).

use crate::Truth;
use crate::vehicle::Figure;
use stampfly_types::{Vec3, frame, math};

/// Height of the wheels above which the aircraft counts as airborne, m.
const FLEW: f32 = 3.0;

/// One touchdown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Touchdown {
    /// Distance past the aiming point, m.
    pub past: f32,
    /// Distance to the right of the centre line, m.
    pub across: f32,
    /// Sink rate, m/s.
    pub sink: f32,
    /// Bank angle, rad.
    pub bank: f32,
    /// Angle from the heading to the course over the ground, rad.
    pub crab: f32,
}

/// The touchdowns of a flight.
///
/// ```
/// use stampfly_sim::{Truth, touchdown::Touchdowns};
/// use stampfly_types::Vec3;
/// let mut touchdowns = Touchdowns::new(0.0, 10.0);
/// let flies = Truth { position: Vec3::new(0.0, 1.0, -0.1), velocity: Vec3::new(12.0, 0.0, 0.6), ..Truth::default() };
/// touchdowns.look(5.0, &flies);
/// touchdowns.look(0.0, &Truth { contact: true, ..flies });
/// let [touch] = touchdowns.all() else { panic!("one") };
/// assert_eq!((touch.past, touch.across, touch.sink), (10.0, 1.0, 0.6));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Touchdowns {
    /// Direction of the strip, rad.
    strip: f32,
    /// Distance from the aiming point to the origin, the middle of the strip, m.
    rolling: f32,
    all: Vec<Touchdown>,
    /// The aircraft has been airborne since the last touchdown.
    flew: bool,
    /// Sink rate at the previous call: at the touch itself the ground has already slowed it.
    sink: f32,
}

impl Touchdowns {
    /// A strip through the origin with direction `strip`, rad, usable both ways. A landing aims at
    /// a point `rolling` metres before the origin.
    #[must_use]
    pub fn new(strip: f32, rolling: f32) -> Self {
        Self { strip, rolling, ..Self::default() }
    }

    /// Checks for a touchdown. `height` is the height of the wheels, m. Call it at regular
    /// intervals.
    pub fn look(&mut self, height: f32, truth: &Truth) {
        // Hysteresis: bounces below this height belong to the same landing.
        self.flew |= height > FLEW;
        if truth.contact && self.flew {
            self.flew = false;
            let heading = frame::yaw(&truth.attitude);
            // The strip can be used from both ends; distances count in the direction of landing.
            let towards = if math::cos(heading - self.strip) > 0.0 { 1.0 } else { -1.0 };
            let (sin, cos) = math::sin_cos(self.strip);
            let Vec3 { x, y, .. } = truth.position;
            let [bank, ..] = frame::roll_pitch_yaw(&truth.attitude);
            let course = math::atan2(truth.velocity.y, truth.velocity.x);
            self.all.push(Touchdown {
                past: towards * (x * cos + y * sin) + self.rolling,
                across: towards * (y * cos - x * sin),
                sink: self.sink,
                bank,
                crab: math::wrap_angle(course - heading),
            });
        }
        // Kept for the next call: at contact the ground has already reduced the sink rate.
        self.sink = truth.velocity.z;
    }

    /// All touchdowns in order.
    #[must_use]
    pub fn all(&self) -> &[Touchdown] {
        &self.all
    }

    /// Number of touchdowns and the worst value of each quantity.
    #[must_use]
    pub fn figures(&self) -> [Figure; 6] {
        let worst = |of: &dyn Fn(&Touchdown) -> f32| self.all.iter().map(of).reduce(f32::max).map(f64::from);
        let figure = |name, unit, value| Figure { name, unit, value };
        [
            figure("landings", "", Some(self.all.len() as f64)),
            figure("touchdown_sink_mps", "m/s", worst(&|touch| touch.sink)),
            figure("touchdown_across_m", "m", worst(&|touch| touch.across.abs())),
            figure("touchdown_past_most_m", "m", worst(&|touch| touch.past)),
            figure("touchdown_past_least_m", "m", worst(&|touch| -touch.past).map(|past| -past)),
            figure("touchdown_bank_deg", "deg", worst(&|touch| touch.bank.abs().to_degrees())),
        ]
    }
}
