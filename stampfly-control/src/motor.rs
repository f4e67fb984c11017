//! Thrust to duty cycle: the propeller's square law, the motor's voltage curve, the battery.
//!
//! Thrust T = Ct ω² gives the speed, V(ω) = Am ω² + Bm ω + Cm the voltage at which a brushed motor turns its propeller
//! at that speed, and duty is that voltage over the battery's. The constants belong together: a curve measured on the
//! bench without airflow promises 11 to 13 % more thrust than the vehicle has in flight.
//!
//! Battery voltage arrives slowly and with noise, and duty that follows every flicker of it puts the flicker into the
//! thrust, so it is low-passed. A reading that no cell can have is replaced by the nominal voltage.

use stampfly_types::messages::{MAX_MOTORS, MotorOutput};
use stampfly_types::{Instant, math};

use crate::bound::{symmetric, within};
use crate::mixer::Mixed;
use crate::timing::StepTimer;

/// How a motor with its propeller turns voltage into thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotorCurve {
    /// Thrust per squared speed, N/(rad/s)².
    pub ct: f32,
    /// Voltage per squared speed, V/(rad/s)².
    pub am: f32,
    /// Voltage per speed, V/(rad/s).
    pub bm: f32,
    /// Voltage to overcome friction, V.
    pub cm: f32,
}

impl Default for MotorCurve {
    /// The StampFly, anchored to its hover in flight.
    fn default() -> Self {
        Self { ct: 1.0e-8, am: 6.0368e-8, bm: 6.699_042e-4, cm: 1.53e-2 }
    }
}

impl MotorCurve {
    /// Voltage at which the motor pushes with `thrust` N. Zero for no thrust: a motor that need not turn gets nothing.
    #[must_use]
    #[inline]
    pub fn voltage(&self, thrust: f32) -> f32 {
        // False for NaN as well.
        if thrust > 0.0 {
            let squared = thrust / self.ct;
            self.am * squared + self.bm * math::sqrt(squared) + self.cm
        } else {
            0.0
        }
    }

    /// Thrust, N, at a voltage: the inverse of [`Self::voltage`].
    #[must_use]
    pub fn thrust(&self, voltage: f32) -> f32 {
        let above = voltage - self.cm;
        if above <= 0.0 {
            return 0.0;
        }
        let speed = (math::sqrt(self.bm * self.bm + 4.0 * self.am * above) - self.bm) / (2.0 * self.am);
        self.ct * speed * speed
    }
}

/// Curve, battery and limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotorConfig {
    /// The motors' curve.
    pub curve: MotorCurve,
    /// Battery voltage to assume when none is known, V.
    pub nominal_voltage: f32,
    /// A reading below this is no battery, V.
    pub lowest_voltage: f32,
    /// A reading above this is no battery either, V.
    pub highest_voltage: f32,
    /// Time constant of the battery low-pass, s.
    pub voltage_time: f32,
    /// Largest duty.
    pub duty_max: f32,
    /// Largest change of duty, 1/s.
    pub slew_max: f32,
}

impl Default for MotorConfig {
    /// The StampFly: one LiHV cell. The slew limit crosses the whole range in 25 ms, about one motor time constant:
    /// it takes the edge off current peaks and off nothing the motor could follow.
    fn default() -> Self {
        Self {
            curve: MotorCurve::default(),
            nominal_voltage: 3.7,
            lowest_voltage: 2.5,
            highest_voltage: 5.0,
            voltage_time: 0.5,
            duty_max: 0.95,
            slew_max: 40.0,
        }
    }
}

/// The motors' output stage.
///
/// ```
/// use stampfly_control::{Mixed, MotorStage};
/// use stampfly_types::Instant;
/// let mut motors = MotorStage::default();
/// let hover = Mixed { thrust: [0.09, 0.09, 0.09, 0.09, 0.0, 0.0, 0.0, 0.0], count: 4, unmet: [0.0; 4] };
/// let mut output = Default::default();
/// for n in 0..20 {
///     output = motors.step(Instant::from_micros(2_500 * n), &hover, Some(3.7), true);
/// }
/// assert!((output.duty[0] - 0.69).abs() < 0.01);
/// assert_eq!(motors.step(Instant::from_micros(60_000), &hover, Some(3.7), false).duty, [0.0; 8], "not armed, not turning");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotorStage {
    config: MotorConfig,
    voltage: Option<f32>,
    duty: [f32; MAX_MOTORS],
    timer: StepTimer,
}

impl Default for MotorStage {
    fn default() -> Self {
        Self::new(&MotorConfig::default())
    }
}

impl MotorStage {
    /// Motors at rest, battery unknown.
    #[must_use]
    pub fn new(config: &MotorConfig) -> Self {
        Self { config: *config, voltage: None, duty: [0.0; MAX_MOTORS], timer: StepTimer::default() }
    }

    /// One control period. `voltage` is the newest battery reading, V; `None` when there is none.
    #[inline]
    pub fn step(&mut self, now: Instant, mixed: &Mixed, voltage: Option<f32>, armed: bool) -> MotorOutput {
        let dt = self.timer.step(now);
        let battery = self.battery(voltage, dt);
        if !armed {
            self.duty = [0.0; MAX_MOTORS];
            return MotorOutput { duty: self.duty, count: mixed.count, armed: false, unmet: mixed.unmet };
        }
        let step = self.config.slew_max * dt;
        let per_volt = 1.0 / battery;
        for (duty, thrust) in self.duty.iter_mut().zip(mixed.thrust).take(usize::from(mixed.count)) {
            let wanted = (self.config.curve.voltage(thrust) * per_volt).min(self.config.duty_max);
            // The last clamp is for the rounding of the sum.
            *duty = within(*duty + symmetric(wanted - *duty, step), 0.0, self.config.duty_max);
        }
        MotorOutput { duty: self.duty, count: mixed.count, armed: true, unmet: mixed.unmet }
    }

    /// The battery voltage in use, V.
    #[must_use]
    pub fn battery_voltage(&self) -> f32 {
        self.voltage.unwrap_or(self.config.nominal_voltage)
    }

    fn battery(&mut self, reading: Option<f32>, dt: f32) -> f32 {
        let plausible = reading.filter(|v| (self.config.lowest_voltage..=self.config.highest_voltage).contains(v));
        // Without a plausible reading the filter drifts to nominal: a sensor that dies must not freeze a sag.
        let target = plausible.unwrap_or(self.config.nominal_voltage);
        let before = self.voltage.unwrap_or(target);
        let now = before + (target - before) * (dt / (self.config.voltage_time + dt));
        self.voltage = Some(now);
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_types::Duration;

    fn mixed(thrust: f32) -> Mixed {
        let mut mixed = Mixed { count: 4, ..Mixed::default() };
        mixed.thrust[..4].fill(thrust);
        mixed
    }

    #[test]
    fn hover_needs_the_duty_flown() {
        let curve = MotorCurve::default();
        let hover = curve.voltage(0.0902);
        assert!((hover - 2.57).abs() < 0.01, "{hover} V");
        assert!((curve.voltage(0.168) - 3.77).abs() < 0.01);
    }

    #[test]
    fn implausible_batteries_count_as_nominal() {
        for reading in [None, Some(0.0), Some(2.4), Some(f32::NAN), Some(f32::INFINITY), Some(-4.0), Some(12.0)] {
            let mut motors = MotorStage::default();
            motors.step(Instant::ZERO, &mixed(0.09), reading, true);
            assert_eq!(motors.battery_voltage(), 3.7, "{reading:?}");
        }
    }

    #[test]
    fn a_flicker_of_the_battery_hardly_reaches_the_duty() {
        let mut motors = MotorStage::default();
        let mut duty = [0.0f32; 2];
        for n in 0..4000u64 {
            let voltage = if n % 2 == 0 { 3.6 } else { 3.8 };
            duty[n as usize % 2] =
                motors.step(Instant::from_micros(n * 2_500), &mixed(0.09), Some(voltage), true).duty[0];
        }
        assert!((duty[0] - duty[1]).abs() < 1e-3);
    }

    proptest! {
        #[test]
        fn the_curve_and_its_inverse_agree(thrust in 1e-4f32..0.2) {
            let curve = MotorCurve::default();
            prop_assert!((curve.thrust(curve.voltage(thrust)) / thrust - 1.0).abs() < 1e-2);
        }

        #[test]
        fn duties_are_possible_slow_and_dead_when_disarmed(
            steps in prop::collection::vec((any::<f32>(), prop::option::of(any::<f32>()), any::<bool>(), 0u64..30_000), 1..50),
        ) {
            let mut motors = MotorStage::default();
            let (mut now, mut before) = (Instant::ZERO, [0.0f32; 8]);
            for (thrust, voltage, armed, span) in steps {
                now += Duration::from_micros(span);
                let out = motors.step(now, &mixed(thrust), voltage, armed);
                for (duty, before) in out.duty.iter().zip(before) {
                    prop_assert!((0.0..=0.95).contains(duty));
                    let slew = MotorConfig::default().slew_max * StepTimer::LONGEST.seconds();
                    prop_assert!(!armed || (duty - before).abs() <= slew + 1e-6);
                    prop_assert!(armed || *duty == 0.0);
                }
                prop_assert_eq!(out.armed, armed);
                before = out.duty;
            }
        }
    }
}
