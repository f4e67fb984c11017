//! Turns that move the picture faster than the camera follows.
//!
//! Above [`flow_max_rate`](crate::EskfConfig::flow_max_rate) its readings are wrong by metres per
//! second, until the vehicle hardly turns any more. Meanwhile the tilt rests on the gyro alone.

use stampfly_types::math;

/// A fast turn ends when the rate has stayed below `CALM`, rad/s, for `SETTLES`, s.
const CALM: f32 = 1.0;
const SETTLES: f32 = 0.1;

/// How the body turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turn {
    /// The picture shows its motion.
    Slow,
    /// Faster than the camera follows, or it was a moment ago: the reading says nothing.
    Fast,
    /// No longer: it has turned by this angle, rad.
    Over(f32),
}

/// What is remembered of a fast turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct FastTurn {
    /// How long it has to turn slowly yet, s.
    settles: f32,
    /// How far it has turned, rad.
    turned: f32,
}

impl FastTurn {
    /// Takes the rates about body x and y, rad/s, over the interval of a reading, s. A fast turn begins
    /// at the rate `fastest`.
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
        // It brakes: slower than the camera follows, and not yet calm.
        assert_eq!(turn.step([3.0, 0.0], 0.01, 7.0), Turn::Fast);
        let calm = (0..20).map(|_| turn.step([0.1, 0.0], 0.01, 7.0)).find(|turn| *turn != Turn::Fast);
        let Some(Turn::Over(angle)) = calm else { panic!("{calm:?}") };
        assert!((angle - 6.0).abs() < 0.1, "{angle} rad");
        assert_eq!(turn.step([0.1, 0.0], 0.01, 7.0), Turn::Slow);
    }
}
