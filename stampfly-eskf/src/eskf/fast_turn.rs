//! Detects rotation faster than the flow camera can track.
//!
//! Above [`flow_max_rate`](crate::EskfConfig::flow_max_rate) flow readings are wrong by metres per
//! second, until the vehicle has nearly stopped turning. In that time the tilt depends on the gyro
//! alone.

use stampfly_types::math;

/// A fast turn ends when the rate has stayed below `CALM`, rad/s, for `SETTLES`, s.
const CALM: f32 = 1.0;
const SETTLES: f32 = 0.1;

/// Phase of a rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turn {
    /// Slow enough for the camera.
    Slow,
    /// Too fast, or too fast within the last `SETTLES`: the reading is unusable.
    Fast,
    /// Just ended. The body has turned by this angle, rad.
    Over(f32),
}

/// State of the detector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct FastTurn {
    /// Time for which the body must still turn slowly, s.
    settles: f32,
    /// Angle turned so far, rad.
    turned: f32,
}

impl FastTurn {
    /// Takes the rates about body x and y, rad/s, over the interval of a reading, s. A fast turn
    /// begins above the rate `fastest`, rad/s.
    #[inline]
    pub(super) fn step(&mut self, [x, y]: [f32; 2], interval: f32, fastest: f32) -> Turn {
        let square = x * x + y * y;
        let limit = if self.settles > 0.0 { CALM } else { fastest };
        let fast = square > limit * limit;
        self.settles = if fast { SETTLES } else { math::larger(self.settles - interval, 0.0) };
        if self.settles > 0.0 {
            self.turned += math::sqrt(square) * interval;
            return Turn::Fast;
        }
        let turned = core::mem::take(&mut self.turned);
        if turned > 0.0 { Turn::Over(turned) } else { Turn::Slow }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flip_is_over_when_the_vehicle_has_been_calm() {
        let mut turn = FastTurn::default();
        assert_eq!(turn.step([5.0, 3.0], 0.01, 7.0), Turn::Slow);
        assert!((0..50).all(|_| turn.step([12.0, 0.0], 0.01, 7.0) == Turn::Fast));
        // Braking: within the camera's range, but not yet calm.
        assert_eq!(turn.step([3.0, 0.0], 0.01, 7.0), Turn::Fast);
        let calm = (0..20).map(|_| turn.step([0.1, 0.0], 0.01, 7.0)).find(|turn| *turn != Turn::Fast);
        let Some(Turn::Over(angle)) = calm else { panic!("{calm:?}") };
        assert!((angle - 6.0).abs() < 0.1, "{angle} rad");
        assert_eq!(turn.step([0.1, 0.0], 0.01, 7.0), Turn::Slow);
    }
}
