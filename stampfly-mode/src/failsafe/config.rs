//! Thresholds, times and filter weights of the [failsafe](super).

use stampfly_types::{Duration, GRAVITY};

/// A motor is weak when this share of its thrust is missing. Of half a propeller 0.5 is, and a step of the demand has to exceed
/// the limit for a while.
pub const WEAK_SHARE: f32 = 0.3;

/// Thresholds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FailsafeConfig {
    /// Impact, m/s².
    pub impact: f32,
    /// Impact while landing, m/s²: a firm touchdown reaches 4 g.
    pub landing_impact: f32,
    /// Nearer to the ground than this, m, and at less than `touch_speed`, a push from below is a touchdown.
    pub touch_height: f32,
    /// Sink rate of a fall, m/s: the hardest touchdown, 1 m/s, and what the estimate may be wrong by.
    pub touch_speed: f32,
    /// Impact, in standard deviations of the vibration.
    pub impact_sigmas: f32,
    /// Peak of the chip's own samples in a sharp blow, m/s², where no contact is expected. Infinite
    /// where a lift of that size is flown.
    pub sharp: f32,
    /// Angular rate, rad/s.
    pub rate: f32,
    /// The same of a vehicle that turns over on purpose, rad/s.
    pub flip_rate: f32,
    /// Tilt of a vehicle that tumbles, rad.
    pub tumble_tilt: f32,
    /// For how long it is tilted so far.
    pub tumble_time: Duration,
    /// Tilt of a vehicle that tips over while it takes off, rad.
    pub tip_tilt: f32,
    /// For how long it is tilted so far.
    pub tip_time: Duration,
    /// Tilt of one that tips on a leg, rad: from how it stood, below `lift_height`, while it takes off in a mode that holds its
    /// height, or takes off or lands against a torque as of `weak_roll` and `weak_pitch`.
    pub lift_tilt: f32,
    /// That tilt is the one in so many seconds, if it goes on turning as it does: three lags of its motors.
    pub lift_lead: f32,
    /// Below this height a leg may still touch the ground, m.
    pub lift_height: f32,
    /// Torques about roll and pitch, N·m, that together betray a weak motor: [`WEAK_SHARE`] of what one rotor's share of the
    /// weight makes. Infinite where nothing is known of the airframe: then no motor is found weak.
    pub weak_roll: f32,
    /// The same about pitch.
    pub weak_pitch: f32,
    /// For how long they are asked for.
    pub weak_motor_time: Duration,
    /// Silence of the inertial sensor after which it is degraded.
    pub imu_degraded: Duration,
    /// Silence of the inertial sensor after which it is lost.
    pub imu_lost: Duration,
    /// Silence of the command link.
    pub link_silence: Duration,
    /// Voltage of a low battery, V.
    pub battery_low: f32,
    /// Voltage of a battery with which the vehicle lands, V.
    pub battery_critical: f32,
    /// Below this a disarmed vehicle has no battery, V.
    pub usb: f32,
    /// Below this no meter is fitted, V.
    pub no_meter: f32,
    /// Largest current of a disarmed vehicle's electronics, A: more takes a motor. Infinite where it is not known.
    pub idle_current: f32,
    /// Hysteresis of the battery thresholds, V.
    pub battery_hysteresis: f32,
    /// Time constant of the battery low-pass, s.
    pub battery_time: f32,
    /// Silence of the battery monitor.
    pub power_silence: Duration,
    /// Silence of range and flow in the air.
    pub aiding_silence: Duration,
    /// Disagreement of gravity and tilt on the ground, rad.
    pub tilt_mismatch: f32,
    /// For how long they disagree.
    pub tilt_mismatch_time: Duration,
    /// Weight of an inertial sample in the specific force that is compared with the impact thresholds. A blow lasts some
    /// 10 ms, a propeller's shaking averages out.
    pub blow_weight: f32,
    /// Weight of an inertial sample in mean and variance of the vibration.
    pub vibration_weight: f32,
    /// Weight of an inertial sample in the gravity that is compared with the tilt on the ground.
    pub gravity_weight: f32,
    /// Samples running above a threshold of force or rate that are an alert: one alone is a glitch.
    pub motion_samples: u32,
    /// Largest angular acceleration of the body, rad/s². A sample that asks for more is suspect.
    pub angular_acceleration: f32,
    /// So many suspect samples running that follow from each other are left out; one more, and all
    /// of them count.
    pub garbled_samples: u32,
    /// Full scale of the gyro, rad/s.
    pub gyro_full_scale: f32,
    /// Full scale of the accelerometer, m/s².
    pub accel_full_scale: f32,
    /// So many equal samples running of one axis, or so many at full scale, are a sensor that does not measure.
    pub stuck_samples: u32,
    /// Thrust that carries the weight, N. Infinite where nothing is known of the airframe: then no
    /// force in the air is implausible.
    pub hover_thrust: f32,
    /// Largest share of its velocity through the air that the vehicle loses each second, along
    /// whichever axis, 1/s. Infinite where it is not known: then drag may be anything.
    pub drag: f32,
    /// What each metre a second adds to that share, 1/m.
    pub drag_square: f32,
    /// Tilt of a vehicle that tumbles while armed on the ground, rad.
    pub armed_tilt: f32,
    /// Tilt of a vehicle that tumbles in ACRO, rad.
    pub acro_tilt: f32,
    /// For how long it is tilted so far in ACRO: a loop passes it in a fraction of a second.
    pub acro_time: Duration,
    /// An alert that switches the motors off stays for at least this long.
    pub shown: Duration,
    /// Voltages of a battery in flight lie between these, V.
    pub voltage_range: [f32; 2],
    /// Largest change of the voltage from one reading to the next that the current does not explain, V.
    pub voltage_step: f32,
    /// How much farther than that it changes in a second, V/s.
    pub voltage_rate: f32,
    /// Largest resistance of battery and leads, Ω: a rise of the current explains so much of a fall.
    pub resistance: f32,
}

impl Default for FailsafeConfig {
    /// For one lithium cell and an inertial sensor at 400 Hz: voltages grow with the number of cells, and weights of samples
    /// shrink with their rate.
    fn default() -> Self {
        Self {
            impact: 3.0 * GRAVITY,
            landing_impact: 6.0 * GRAVITY,
            touch_height: 0.2,
            touch_speed: 1.2,
            impact_sigmas: 6.0,
            // In 3,000 flights in gusts at twice the recorded vibration the largest of the peaks
            // that passed it were 6.8 and 8.2 deviations, see `motion`.
            sharp: 4.0 * GRAVITY,
            rate: 13.96,
            flip_rate: 31.4,
            tumble_tilt: 1.05,
            tumble_time: Duration::from_millis(300),
            tip_tilt: 0.7,
            tip_time: Duration::from_millis(20),
            // Half the tilt that a stick may ask for; from there a vehicle still falls back on its legs.
            lift_tilt: 0.25,
            lift_lead: 0.05,
            lift_height: 0.08,
            weak_roll: f32::INFINITY,
            weak_pitch: f32::INFINITY,
            weak_motor_time: Duration::from_millis(100),
            imu_degraded: Duration::from_millis(10),
            // On its last rates a palm-sized vehicle flies for 50 ms: see `imu`.
            imu_lost: Duration::from_millis(50),
            link_silence: Duration::from_millis(500),
            battery_low: 3.4,
            battery_critical: 3.0,
            usb: 3.3,
            no_meter: 0.1,
            idle_current: f32::INFINITY,
            battery_hysteresis: 0.1,
            battery_time: 2.0,
            power_silence: Duration::from_secs(1),
            aiding_silence: Duration::from_secs(1),
            tilt_mismatch: 0.1745,
            tilt_mismatch_time: Duration::from_millis(500),
            // Time constants of about 10 ms, 100 ms and a second at 400 Hz.
            blow_weight: 0.3,
            vibration_weight: 0.02,
            gravity_weight: 0.0025,
            motion_samples: 2,
            // Rotors of a vehicle of a palm's size do 1000.
            angular_acceleration: 3_000.0,
            garbled_samples: 3,
            // A BMI270 at ±2000 °/s and ±8 g.
            gyro_full_scale: 34.9,
            accel_full_scale: 8.0 * GRAVITY,
            // 50 ms. One axis repeats a sample by chance with a probability below 0.3: twenty times, 10⁻¹⁰.
            stuck_samples: 20,
            hover_thrust: f32::INFINITY,
            drag: f32::INFINITY,
            drag_square: 0.0,
            armed_tilt: 1.31,
            acro_tilt: 2.1,
            acro_time: Duration::from_secs(1),
            shown: Duration::from_secs(2),
            voltage_range: [2.4, 4.5],
            voltage_step: 0.35,
            voltage_rate: 0.2,
            resistance: 0.3,
        }
    }
}
