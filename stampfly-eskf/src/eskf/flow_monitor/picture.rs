//! Does the picture of the floor move at all?
//!
//! A sensor that hangs repeats a reading; one that is covered, or sees no features and does not say so, gives zero. Equal readings
//! happen by chance for some hundredths of a second. A picture that stands still while the body turns says that the vehicle
//! moves by turn times distance the opposite way: a vehicle that is carried does so by millimetres.

/// Nearer to the floor than this, m, the picture may be blurred.
pub(super) const SHARP: f32 = 0.15;
/// Readings running that are equal and not zero: frozen. At 100 Hz 0.4 s.
const REPEATED: u32 = 40;
/// The picture cannot stand still while the body turns by this much, rad: three counts of a PMW3901.
const TURNED: f32 = 0.007;
/// Nor if the vehicle would have to move by this much, m, to keep it still. Over a quarter of a second 5 mm are
/// 0.16 m/s², as much as a tilt that is wrong by 1°: the accelerometer contradicts no less.
const COMPENSATED: f32 = 0.005;
/// For so many readings running, at least.
const ZEROS: u32 = 20;

/// Readings that were equal, or nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Picture {
    reading: [f32; 2],
    repeats: u32,
    /// Readings of nothing, and the largest turn of the body beside them.
    zeros: u32,
    turn: [f32; 2],
    turned: f32,
}

impl Picture {
    /// Takes a reading: counts as they came, rad, and what the body's turning makes of the picture, rad/s.
    pub(super) fn step(&mut self, counts: [f32; 2], turning: [f32; 2], distance: f32, interval: f32) {
        let repeated = counts == self.reading && counts != [0.0; 2];
        self.repeats = if repeated { self.repeats.saturating_add(1) } else { 0 };
        self.reading = counts;
        if counts == [0.0; 2] && distance > SHARP {
            self.zeros = self.zeros.saturating_add(1);
            for (turn, rate) in self.turn.iter_mut().zip(turning) {
                *turn += rate * interval;
                self.turned = self.turned.max(turn.abs());
            }
        } else {
            (self.zeros, self.turn, self.turned) = Default::default();
        }
    }

    /// Does it repeat one reading?
    pub(super) fn is_frozen(&self) -> bool {
        self.repeats >= REPEATED
    }

    /// Does it not show what the body does?
    pub(super) fn is_blind(&self, distance: f32) -> bool {
        self.is_still() && self.turned > TURNED && self.turned * distance > COMPENSATED
    }

    /// Has it shown no motion for a while?
    pub(super) fn is_still(&self) -> bool {
        self.zeros >= ZEROS
    }
}
