//! Which of the three rate loops is tuned.

use stampfly_types::Vec3;

use crate::pid::PidGains;
use crate::rate::RateConfig;

/// A body axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AutotuneAxis {
    /// About x.
    #[default]
    Roll,
    /// About y.
    Pitch,
    /// About z.
    Yaw,
}

impl AutotuneAxis {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Roll, Self::Pitch, Self::Yaw];

    /// The component of a vector about this axis.
    #[must_use]
    pub fn of(self, vector: &Vec3) -> f32 {
        match self {
            Self::Roll => vector.x,
            Self::Pitch => vector.y,
            Self::Yaw => vector.z,
        }
    }

    /// That component, to change it.
    pub fn of_mut(self, vector: &mut Vec3) -> &mut f32 {
        match self {
            Self::Roll => &mut vector.x,
            Self::Pitch => &mut vector.y,
            Self::Yaw => &mut vector.z,
        }
    }

    /// The gains of this axis.
    ///
    /// ```
    /// use stampfly_control::Airframe;
    /// use stampfly_control::autotune::AutotuneAxis;
    /// use stampfly_control::rate::RateConfig;
    /// let mut config = RateConfig::for_airframe(&Airframe::EXAMPLE);
    /// AutotuneAxis::Pitch.gains_mut(&mut config).kp *= 2.0;
    /// assert_eq!(AutotuneAxis::Pitch.gains(&config).kp, config.pitch.kp);
    /// ```
    #[must_use]
    pub fn gains(self, config: &RateConfig) -> PidGains {
        match self {
            Self::Roll => config.roll,
            Self::Pitch => config.pitch,
            Self::Yaw => config.yaw,
        }
    }

    /// The gains of this axis, to change them.
    pub fn gains_mut(self, config: &mut RateConfig) -> &mut PidGains {
        match self {
            Self::Roll => &mut config.roll,
            Self::Pitch => &mut config.pitch,
            Self::Yaw => &mut config.yaw,
        }
    }
}
