//! Everything about the vehicle that can be tuned, as one value.
//!
//! Each crate owns its own configuration and the rules by which it follows from an airframe; this struct only gathers
//! them, for the StampFly's [`AIRFRAME`]. The names people use are in [`parameters`](crate::parameters).

use crate::airframe::{AIRFRAME, DRAG, DRAG_SQUARE, DRAG_VERTICAL, FOOT_OFFSET, GROUND_HEIGHT, LAST_RATES, MASS};
use stampfly_control::guidance::NavigatorConfig;
use stampfly_control::{CascadeConfig, FlipConfig, GeometricConfig, IndiConfig, MotorConfig};
use stampfly_eskf::calibration::Corrections;
use stampfly_eskf::{ComplementaryConfig, EskfConfig};
use stampfly_mode::failsafe::WEAK_SHARE;
use stampfly_mode::{AuthorityConfig, ButtonConfig, FailsafeConfig, LandingConfig, ModeConfig};
use stampfly_monitor::MonitorConfig;
use stampfly_types::{math, message_enum};

message_enum! {
    /// Which estimator flies. The numbers are those of the parameter `estimator.type`.
    pub enum EstimatorKind {
        /// Error-state Kalman filter.
        #[default]
        Eskf = 0,
        /// Complementary filter.
        Complementary = 1,
    }
}

message_enum! {
    /// Which controller flies. The numbers are those of the parameter `controller.type`.
    pub enum ControllerKind {
        /// Cascade of loops.
        #[default]
        Cascade = 0,
        /// Geometric controller.
        Geometric = 1,
        /// Cascade whose innermost loop is incremental nonlinear dynamic inversion.
        Indi = 2,
    }
}

/// Share of the tilt at which the centre of mass stands above two feet, from which a vehicle that
/// tips still falls back. It goes on turning while its motors stop: with a fifth more thrust than
/// its weight and all its torque at 70 rad/s², for 40 ms, which is 0.05 rad and 2.7 rad/s. A foot
/// is 0.07 s away from there as a pendulum falls, so half of 45° is left.
const FALLS_BACK: f32 = 0.5;

/// Noise density squared of the accelerometer over its mean squared change from sample to sample and
/// the time between samples, 1. The driver weighs seven samples of the chip 1 2 3 4 3 2 1: white noise
/// of variance σ² at 1600 Hz is then σ² / 1600 Hz below 50 Hz, and changes by 0.266 σ² from one sample
/// at 400 Hz to the next, which makes 0.94. A quarter of the recorded change comes from the airframe's
/// resonance at 150 Hz, which adds nothing at low frequencies.
const ACCEL_VIBRATION: f32 = 0.7;

/// Configuration of every component of one vehicle.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct VehicleConfig {
    /// Which estimator flies.
    pub estimator: EstimatorKind,
    /// Which controller flies.
    pub controller: ControllerKind,
    /// Error-state Kalman filter.
    pub eskf: EskfConfig,
    /// Complementary filter.
    pub complementary: ComplementaryConfig,
    /// Cascaded controller.
    pub cascade: CascadeConfig,
    /// Geometric controller.
    pub geometric: GeometricConfig,
    /// Innermost loop of the incremental controller; its outer loops are those of the cascade.
    pub indi: IndiConfig,
    /// Motors and battery.
    pub motor: MotorConfig,
    /// Take-off, route and sticks.
    pub navigator: NavigatorConfig,
    /// Mode machine and arming.
    pub mode: ModeConfig,
    /// Monitor of the sensors.
    pub monitor: MonitorConfig,
    /// Detectors of what can go wrong.
    pub failsafe: FailsafeConfig,
    /// Take-off and landing manager. Its ceilings are shares of the cascade's hover thrust.
    pub landing: LandingConfig,
    /// Whose sticks count.
    pub authority: AuthorityConfig,
    /// Gestures on the button.
    pub button: ButtonConfig,
    /// What calibrations have found of its sensors; applied where samples come from the drivers, from the next start on.
    pub corrections: Corrections,
    /// May packets that authenticate nobody fly it?
    pub accept_unauthenticated: bool,
    /// Protections stop no motors in the air: a simulated flight, to find out whether they were
    /// right to. No firmware has it.
    #[cfg(feature = "simulation")]
    #[serde(skip)]
    pub flies_on: bool,
}

impl Default for VehicleConfig {
    /// The StampFly as it is built.
    fn default() -> Self {
        let ground_clearance = GROUND_HEIGHT as f32;
        let weak = AIRFRAME.rotor_torque() * WEAK_SHARE;
        let cascade = CascadeConfig::for_airframe(&AIRFRAME);
        let flip = FlipConfig::for_airframe(&AIRFRAME);
        Self {
            estimator: EstimatorKind::default(),
            controller: ControllerKind::default(),
            eskf: EskfConfig {
                ground_clearance,
                drag: (DRAG / MASS) as f32,
                // Errors of scale and axes alone: vibration adds `accel_vibration`.
                accel_noise: 0.05,
                accel_vibration: ACCEL_VIBRATION,
                ..EskfConfig::indoors()
            },
            complementary: ComplementaryConfig { ground_clearance, ..ComplementaryConfig::default() },
            cascade,
            geometric: GeometricConfig::for_airframe(&AIRFRAME),
            indi: IndiConfig::for_airframe(&AIRFRAME),
            motor: MotorConfig::for_airframe(&AIRFRAME),
            navigator: NavigatorConfig::default(),
            mode: ModeConfig {
                flip_height: flip.height_min,
                flip_room: flip.room,
                hover_throttle: cascade.altitude.hover_thrust / cascade.altitude.thrust_max,
                ..ModeConfig::default()
            },
            monitor: MonitorConfig { ground_clearance_m: ground_clearance, ..MonitorConfig::default() },
            failsafe: FailsafeConfig {
                imu_lost: LAST_RATES,
                weak_roll: weak.x,
                weak_pitch: weak.y,
                hover_thrust: AIRFRAME.hover_thrust(),
                // Rotors at full speed turn half as fast again as in a hover.
                drag: (1.5 * DRAG_VERTICAL / MASS) as f32,
                drag_square: (DRAG_SQUARE / MASS) as f32,
                lift_tilt: FALLS_BACK * math::atan2(FOOT_OFFSET as f32, ground_clearance),
                // Chips, lights and radio take up to 0.4 A; a motor at a quarter of its duty takes as much again.
                idle_current: 0.6,
                ..FailsafeConfig::default()
            },
            landing: LandingConfig { hover_thrust: AIRFRAME.hover_thrust(), ..LandingConfig::default() },
            authority: AuthorityConfig::default(),
            button: ButtonConfig::default(),
            corrections: Corrections::default(),
            accept_unauthenticated: true,
            #[cfg(feature = "simulation")]
            flies_on: false,
        }
    }
}
