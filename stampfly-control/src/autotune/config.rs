//! How an axis is excited, what has to hold meanwhile, and what the result has to keep.

use stampfly_types::messages::Alerts;
use stampfly_types::{Duration, math};

use super::axis::AutotuneAxis;
use crate::airframe::Airframe;
use crate::attitude::AttitudeConfig;
use crate::rate::{TILT_BANDWIDTH, YAW_BANDWIDTH};

/// Window times bandwidth: two seconds for roll and pitch of a quick vehicle, whose tones then lie between 2.5 and 25.5 Hz, a third
/// of the crossover and four times as much.
const WINDOW_BANDWIDTHS: f32 = 2.0 * TILT_BANDWIDTH;
/// Largest torque of the excitation over that of the rate loop. Yaw needs more, because a rotor's drag is weak.
const TILT_SHARE: f32 = 0.3;
const YAW_SHARE: f32 = 0.4;
/// Highest crossover over the bandwidth of the rule for an airframe. Yaw's stays: its torque is little, however good its margins.
const TILT_QUICKEST: f32 = 1.4;
const YAW_QUICKEST: f32 = 1.0;

/// Excitation, conditions and goals of an [`Autotune`](super::Autotune).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AutotuneConfig {
    /// Largest torque of the excitation, N·m.
    pub amplitude: f32,
    /// Largest torque of the axis, excitation included, N·m: that of the rate loop.
    pub torque_max: f32,
    /// Length of a window; [`frequencies`](super::frequencies) follow from it.
    pub window: Duration,
    /// Windows before the first look at the result, and after which no more are waited for.
    pub windows: [u16; 2],
    /// Spread of every point with which no further window is waited for, and with which a result is refused after the last.
    pub spread: [f32; 2],
    /// Largest misfit of the model.
    pub misfit_max: f32,
    /// The excitation is given up after this long.
    pub time_limit: Duration,
    /// Least height above the surface, m.
    pub height_min: f32,
    /// Largest tilt, rad.
    pub tilt_max: f32,
    /// Largest rate about any axis, rad/s.
    pub rate_max: f32,
    /// Largest horizontal and vertical speed, m/s.
    pub speed_max: f32,
    /// Largest deflection of any stick.
    pub stick_max: f32,
    /// Share of steps whose torque may be cut, by [`torque_max`](Self::torque_max) or by the mixer, over the last few tenths of a
    /// second.
    pub saturation_max: f32,
    /// Alerts in whose presence it does not begin, and that end it.
    pub alerts: Alerts,
    /// Rate asked for per angle by the attitude loop around the rate loop, 1/s. Zero for the margins of a rate loop alone.
    pub attitude_gain: f32,
    /// Phase margin that the result keeps, rad.
    pub phase_margin: f32,
    /// Gain margin that the result keeps, a factor.
    pub gain_margin: f32,
    /// Highest crossover of the result, rad/s: where more would only drive the motors into their limits.
    pub crossover_max: f32,
    /// Integral time times crossover, rad: 20 costs 3° of phase.
    pub integral_share: f32,
    /// Factor by which no gain may differ from the present one.
    pub change_max: f32,
}

impl AutotuneConfig {
    /// The rule for an axis of an airframe. The window follows from the bandwidth that [`RateConfig`](crate::rate::RateConfig) has, the
    /// amplitude from its torque. Goals are 55° and 8 dB with the attitude loop closed, of which 45° and 6 dB are left
    /// when the estimate is as wrong as it may be.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe, axis: AutotuneAxis) -> Self {
        let attitude = AttitudeConfig::for_airframe(airframe);
        let (share, bandwidth, quickest, attitude_gain) = match axis {
            AutotuneAxis::Roll | AutotuneAxis::Pitch => (TILT_SHARE, TILT_BANDWIDTH, TILT_QUICKEST, attitude.tilt_gain),
            AutotuneAxis::Yaw => (YAW_SHARE, YAW_BANDWIDTH, YAW_QUICKEST, attitude.heading_gain),
        };
        let bandwidth = airframe.quickness() * bandwidth;
        let tenths = math::round(10.0 * WINDOW_BANDWIDTHS / bandwidth);
        let window = Duration::from_millis(100) * (tenths.clamp(1.0, 600.0) as u64);
        let torque_max = axis.of(&airframe.torque_limit());
        Self {
            amplitude: share * torque_max,
            torque_max,
            window,
            windows: [4, 8],
            spread: [0.05, 0.25],
            misfit_max: 0.2,
            time_limit: window * 10,
            height_min: 0.5,
            tilt_max: 0.26,
            rate_max: 3.0,
            speed_max: 0.8,
            stick_max: 0.05,
            saturation_max: 0.1,
            alerts: Alerts::ALL.without(Alerts::SELF_TEST_DIFFERS),
            attitude_gain,
            phase_margin: 0.96,
            gain_margin: 2.512,
            crossover_max: quickest * bandwidth,
            integral_share: 20.0,
            change_max: 3.0,
        }
    }
}
