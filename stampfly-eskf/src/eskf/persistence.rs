//! Innovations that keep to one side: the sign of a filter that is wrong and does not doubt.
//!
//! A gate sees single innovations. A gyro bias far beyond its claimed doubt never reaches one: the tilt it makes settles
//! where flow pulls as hard as the bias pushes, innovations all within their standard deviation and all of one sign. The
//! innovations of a sound filter are white (Mehra, "On the identification of variances and adaptive Kalman filtering",
//! IEEE TAC 15(2), 1970), so their mean over a stretch of time is small, and a mean that is not says that something is
//! wrong which the filter believes to know.

/// Time over which innovations are averaged, s.
const MEMORY: f32 = 0.3;
/// Mean, in standard deviations of one innovation, beyond which it is no chance: five times its own deviation at 100 Hz.
const LIMIT: f32 = 0.8;

/// The mean of a sensor's innovations, each in its standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Persistence {
    mean: [f32; 2],
}

impl Persistence {
    /// Takes the innovations of a measurement that stands for `dt` seconds. True when they have kept to one side for too
    /// long; then the count begins anew.
    pub(super) fn see(&mut self, innovations: &[f32; 2], dt: f32) -> bool {
        let share = dt / (MEMORY + dt);
        for (mean, innovation) in self.mean.iter_mut().zip(innovations) {
            // One that is far off is the gate's business.
            *mean += (innovation.clamp(-3.0, 3.0) - *mean) * share;
        }
        let [x, y] = self.mean;
        let found = x * x + y * y > LIMIT * LIMIT;
        if found {
            *self = Self::default();
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_sides_is_chance_and_what_does_not_is_found() {
        let mut persistence = Persistence::default();
        for n in 0..1000 {
            let side = if n % 2 == 0 { 1.5 } else { -1.5 };
            assert!(!persistence.see(&[side, -side], 0.01));
        }
        let first = (0..100).find(|_| persistence.see(&[1.0, 0.8], 0.01)).expect("found");
        assert!((20..50).contains(&first), "after {first} readings");
        assert!(!persistence.see(&[1.0, 0.8], 0.01), "it begins anew");
    }
}
