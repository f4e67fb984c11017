//! Which of the three rate loops is tuned.

use stampfly_types::messages::{GuidedKind, SetpointAxes};
use stampfly_types::{Vec3, message_enum};

use crate::pid::PidGains;
use crate::rate::RateConfig;

message_enum! {
    /// A body axis.
    pub enum AutotuneAxis {
        /// About x.
        #[default]
        Roll = 0,
        /// About y.
        Pitch = 1,
        /// About z.
        Yaw = 2,
    }
}

impl AutotuneAxis {
    /// The axis that a command asks to tune, if it does.
    ///
    /// ```
    /// use stampfly_control::autotune::AutotuneAxis;
    /// use stampfly_types::messages::GuidedKind;
    /// assert_eq!(AutotuneAxis::commanded(GuidedKind::AutotuneYaw), Some(AutotuneAxis::Yaw));
    /// assert_eq!(AutotuneAxis::commanded(GuidedKind::Hold), None);
    /// ```
    #[must_use]
    pub const fn commanded(kind: GuidedKind) -> Option<Self> {
        match kind {
            GuidedKind::AutotuneRoll => Some(Self::Roll),
            GuidedKind::AutotunePitch => Some(Self::Pitch),
            GuidedKind::AutotuneYaw => Some(Self::Yaw),
            _ => None,
        }
    }

    /// The flag of a set-point that asks to tune it.
    #[must_use]
    pub const fn flag(self) -> SetpointAxes {
        match self {
            Self::Roll => SetpointAxes::AUTOTUNE_ROLL,
            Self::Pitch => SetpointAxes::AUTOTUNE_PITCH,
            Self::Yaw => SetpointAxes::AUTOTUNE_YAW,
        }
    }

    /// The axis that a set-point asks to tune, if it does.
    #[must_use]
    pub fn asked(axes: SetpointAxes) -> Option<Self> {
        Self::ALL.iter().copied().find(|axis| axes.contains(axis.flag()))
    }

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
