//! Where and how an aeroplane has touched down on a strip.
//!
//! Seen from beside it: the truth, not what the aircraft thinks. A touch counts as a landing after the aircraft was high; the bounces behind it do not. For vehicles that land where they are see
//! [`watched`](crate::watched).

use crate::Truth;
use crate::vehicle::Figure;
use stampfly_types::{Vec3, frame, math};

/// Higher than this it flies, m.
const FLEW: f32 = 3.0;

/// One touchdown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Touchdown {
    /// Past the aiming point, m.
    pub past: f32,
    /// To the right of the strip's middle, m.
    pub across: f32,
    /// Rate of sink, m/s.
    pub sink: f32,
    /// Bank, rad.
    pub bank: f32,
    /// From the nose to the direction over the ground, rad.
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
    /// From the aiming point to the origin, where the strip's middle is, m.
    rolling: f32,
    all: Vec<Touchdown>,
    /// It has been high since the last one.
    flew: bool,
    /// Rate of sink before this look.
    sink: f32,
}

impl Touchdowns {
    /// On a strip of this direction, rad, through the origin, to either side. A landing aims at a point `rolling` before the origin, m.
    #[must_use]
    pub fn new(strip: f32, rolling: f32) -> Self {
        Self { strip, rolling, ..Self::default() }
    }

    /// Looks for one. `height` of the wheels, m.
    pub fn look(&mut self, height: f32, truth: &Truth) {
        self.flew |= height > FLEW;
        if truth.contact && self.flew {
            self.flew = false;
            let heading = frame::yaw(&truth.attitude);
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
        self.sink = truth.velocity.z;
    }

    /// All of them.
    #[must_use]
    pub fn all(&self) -> &[Touchdown] {
        &self.all
    }

    /// How many, and the worst of each number.
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
