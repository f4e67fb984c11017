//! Thrust to duty cycle: the motor's [curve](crate::curve) gives a voltage, and duty is that voltage over the battery's.
//!
//! Battery voltage arrives slowly and with noise, and duty that follows every flicker of it puts the flicker into the
//! thrust, so it is low-passed and its rate is bounded. A reading that no cell in flight has counts for nothing: the last
//! voltage stays, and drifts slowly to the nominal one. A wrong reading is a factor on every gain of the controller.

use stampfly_types::Instant;
use stampfly_types::messages::{MAX_MOTORS, MotorOutput};

use crate::airframe::Airframe;
use crate::bound::{symmetric, within};
use crate::curve::MotorCurve;
use crate::mixer::Mixed;
use crate::timing::StepTimer;

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
    /// Largest change of the voltage in use, V/s.
    pub voltage_rate: f32,
    /// How fast it goes to nominal without a plausible reading, V/s.
    pub voltage_drift: f32,
    /// Least duty of an armed motor. Zero, the default: it may stop. Above zero it idles, for controllers of brushless motors that do not
    /// start again in the air; give the mixer [`Self::idle_thrust`]. Below zero, to −1, it reverses: a thrust below zero is as many
    /// volts the other way, as for a wheel or a propeller that is symmetric.
    pub duty_min: f32,
    /// Largest duty.
    pub duty_max: f32,
    /// Largest change of duty, 1/s.
    pub slew_max: f32,
}

impl MotorConfig {
    /// Voltage of a lithium cell to assume when none is known, V.
    const CELL_NOMINAL: f32 = 3.7;
    /// A cell below this is none, V: at 3.0 V the vehicle lands, and from there it is minutes to this.
    const CELL_LOWEST: f32 = 2.8;
    /// A cell above this is none either, V: the kinds charged highest have 4.35 V.
    const CELL_HIGHEST: f32 = 5.0;

    /// The airframe's curve and cells. The slew limit crosses the whole range in 25 ms, about one time constant of a small
    /// motor: it takes the edge off current peaks and off nothing the motor could follow.
    #[must_use]
    pub fn for_airframe(airframe: &Airframe) -> Self {
        let cells = f32::from(airframe.cells);
        Self {
            curve: airframe.motor,
            nominal_voltage: Self::CELL_NOMINAL * cells,
            lowest_voltage: Self::CELL_LOWEST * cells,
            highest_voltage: Self::CELL_HIGHEST * cells,
            voltage_time: 0.5,
            // The step of a take-off, 0.3 V, is followed in a second; a wrong reading takes as long for 10 % of thrust.
            voltage_rate: 0.4 * cells,
            // A cell under load falls by 0.6 V in four minutes.
            voltage_drift: 0.003 * cells,
            duty_min: 0.0,
            duty_max: 0.95,
            slew_max: 40.0,
        }
    }

    /// Thrust of a motor at the least duty on a nominal battery, N, as
    /// [`MultirotorMixer::with_thrust_min`](crate::MultirotorMixer::with_thrust_min) takes it; negative where it reverses.
    #[must_use]
    pub fn idle_thrust(&self) -> f32 {
        let thrust = self.curve.thrust(self.duty_min.abs() * self.nominal_voltage);
        if self.duty_min < 0.0 { -thrust } else { thrust }
    }

    /// The voltage for a thrust, negative for one below zero where the motor reverses.
    fn voltage(&self, thrust: f32) -> f32 {
        if thrust < 0.0 && self.duty_min < 0.0 { -self.curve.voltage(-thrust) } else { self.curve.voltage(thrust) }
    }

    /// A duty moved towards what a voltage needs, by `step` at most.
    #[inline]
    fn moved(&self, duty: f32, voltage: f32, per_volt: f32, step: f32) -> f32 {
        // A motor that begins to idle starts from rest, no quicker than any other change.
        let lowest = if self.duty_min < 0.0 { self.duty_min } else { 0.0 };
        let wanted = within(voltage * per_volt, self.duty_min, self.duty_max);
        // The last clamp is for the rounding of the sum.
        within(duty + symmetric(wanted - duty, step), lowest, self.duty_max)
    }
}

/// The motors' output stage.
///
/// ```
/// use stampfly_control::{Airframe, Mixed, MotorConfig, MotorStage};
/// use stampfly_types::Instant;
/// let mut motors = MotorStage::new(&MotorConfig::for_airframe(&Airframe::EXAMPLE));
/// let hover = Mixed { thrust: [1.226, 1.226, 1.226, 1.226, 0.0, 0.0, 0.0, 0.0], count: 4, unmet: [0.0; 4] };
/// let mut output = Default::default();
/// for n in 0..20 {
///     output = motors.step(Instant::from_micros(2_500 * n), &hover, Some(7.4), true);
/// }
/// assert!((output.duty[0] - 0.66).abs() < 0.01);
/// assert_eq!(motors.step(Instant::from_micros(60_000), &hover, Some(7.4), false).duty, [0.0; 8], "not armed, not turning");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotorStage {
    config: MotorConfig,
    voltage: Option<f32>,
    duty: [f32; MAX_MOTORS],
    timer: StepTimer,
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
        let (step, per_volt) = (self.config.slew_max * dt, 1.0 / battery);
        // A battery of no volts, which only a wrong configuration has, turns nothing.
        let per_volt = if per_volt.is_finite() { per_volt } else { 0.0 };
        let (config, count) = (self.config, usize::from(mixed.count));
        // The usual vehicle side by side, any other motor by motor.
        if let (4, true, Some(thrust)) = (count, config.duty_min >= 0.0, mixed.thrust.first_chunk::<4>()) {
            for (duty, voltage) in self.duty.iter_mut().zip(config.curve.voltages(*thrust)) {
                *duty = config.moved(*duty, voltage, per_volt, step);
            }
        } else {
            for (duty, thrust) in self.duty.iter_mut().zip(mixed.thrust).take(count) {
                *duty = config.moved(*duty, config.voltage(thrust), per_volt, step);
            }
        }
        MotorOutput { duty: self.duty, count: mixed.count, armed: true, unmet: mixed.unmet }
    }

    /// The battery voltage in use, V.
    #[must_use]
    pub fn battery_voltage(&self) -> f32 {
        self.voltage.unwrap_or(self.config.nominal_voltage)
    }

    /// Thrust of a motor at its largest duty and the voltage in use, N: the limit for
    /// [`MultirotorMixer::mix_within`](crate::MultirotorMixer::mix_within) in the next step.
    #[inline]
    #[must_use]
    pub fn thrust_max(&self) -> f32 {
        self.config.curve.thrust(self.config.duty_max * self.battery_voltage())
    }

    fn battery(&mut self, reading: Option<f32>, dt: f32) -> f32 {
        let plausible = reading.filter(|v| (self.config.lowest_voltage..=self.config.highest_voltage).contains(v));
        let before = self.voltage.or(plausible).unwrap_or(self.config.nominal_voltage);
        let change = match plausible {
            Some(reading) => {
                symmetric((reading - before) * (dt / (self.config.voltage_time + dt)), self.config.voltage_rate * dt)
            }
            None => symmetric(self.config.nominal_voltage - before, self.config.voltage_drift * dt),
        };
        let now = before + change;
        self.voltage = Some(now);
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_types::Duration;

    fn stage() -> MotorStage {
        MotorStage::new(&MotorConfig::for_airframe(&Airframe::EXAMPLE))
    }

    fn mixed(thrust: f32) -> Mixed {
        let mut mixed = Mixed { count: 4, ..Mixed::default() };
        mixed.thrust[..4].fill(thrust);
        mixed
    }

    #[test]
    fn implausible_batteries_count_as_nominal() {
        for reading in [None, Some(0.0), Some(4.8), Some(f32::NAN), Some(f32::INFINITY), Some(-4.0), Some(12.0)] {
            let mut motors = stage();
            motors.step(Instant::ZERO, &mixed(1.2), reading, true);
            assert_eq!(motors.battery_voltage(), 7.4, "{reading:?}");
        }
    }

    /// The last duty of a motor that has been asked for this thrust for half a second.
    fn settled(duty_min: f32, thrust: f32) -> f32 {
        let config = MotorConfig { duty_min, ..MotorConfig::for_airframe(&Airframe::EXAMPLE) };
        let mut motors = MotorStage::new(&config);
        let step = |n: u64| motors.step(Instant::from_micros(n * 2_500), &mixed(thrust), None, true).duty[0];
        (0..200).map(step).last().unwrap_or_default()
    }

    #[test]
    fn an_armed_motor_idles_and_starts_gently() {
        assert_eq!([0.0, -1.0, f32::NAN].map(|thrust| settled(0.08, thrust)), [0.08; 3]);
        assert_eq!(settled(0.0, 0.0), 0.0, "and stops where it may");
        let config = MotorConfig { duty_min: 0.3, ..MotorConfig::for_airframe(&Airframe::EXAMPLE) };
        let mut motors = MotorStage::new(&config);
        let first = motors.step(Instant::ZERO, &mixed(0.0), None, true).duty[0];
        assert!((first - 0.1).abs() < 1e-6, "40 1/s for 2.5 ms: {first}");
        assert_eq!(motors.step(Instant::from_micros(2_500), &mixed(0.0), None, false).duty, [0.0; 8]);
        // What idling pushes is what the mixer may ask for.
        let idle = settled(0.08, MotorConfig { duty_min: 0.08, ..config }.idle_thrust());
        assert!((idle - 0.08).abs() < 1e-4, "{idle}");
    }

    #[test]
    fn a_motor_that_reverses_is_as_strong_the_other_way() {
        let (ahead, back) = (settled(-1.0, 1.2), settled(-1.0, -1.2));
        assert!(ahead > 0.5 && ahead == -back, "{ahead} {back}");
        assert_eq!(settled(-0.3, -1.2), -0.3, "no further than it may");
        let config = MotorConfig { duty_min: -0.5, ..MotorConfig::for_airframe(&Airframe::EXAMPLE) };
        assert!(config.idle_thrust() < 0.0);
    }

    #[test]
    fn a_battery_of_no_volts_turns_nothing() {
        for nominal_voltage in [0.0, -0.0, f32::NAN, 1e-45] {
            let config = MotorConfig { nominal_voltage, ..MotorConfig::for_airframe(&Airframe::EXAMPLE) };
            let out = [0.0, 1.2].map(|thrust| MotorStage::new(&config).step(Instant::ZERO, &mixed(thrust), None, true));
            assert_eq!(out.map(|out| out.duty), [[0.0; 8]; 2], "{nominal_voltage}");
        }
    }

    #[test]
    fn a_flicker_of_the_battery_hardly_reaches_the_duty() {
        let mut motors = stage();
        let mut duty = [0.0f32; 2];
        for n in 0..4000u64 {
            let voltage = if n % 2 == 0 { 7.2 } else { 7.6 };
            duty[n as usize % 2] =
                motors.step(Instant::from_micros(n * 2_500), &mixed(1.2), Some(voltage), true).duty[0];
        }
        assert!((duty[0] - duty[1]).abs() < 1e-3);
    }

    #[test]
    fn d10_a_wrong_reading_in_flight_hardly_moves_the_voltage_in_use() {
        for (lie, after_two_seconds) in [(5.1, 7.9), (0.0, 7.9), (f32::NAN, 7.9), (20.0, 7.9), (6.0, 6.2)] {
            let mut motors = stage();
            let mut step = |n: u64, voltage| {
                motors.step(Instant::from_micros(n * 2_500), &mixed(1.2), Some(voltage), true);
                motors.battery_voltage()
            };
            assert!((0..800).all(|n| (step(n, 7.9) - 7.9).abs() < 1e-3));
            let first = step(800, lie);
            assert!((first - 7.9).abs() < 3e-3, "{lie}: {first}");
            let later = (801..1_600).map(|n| step(n, lie)).last().unwrap_or_default();
            assert!((later - after_two_seconds).abs() < 0.2, "{lie}: {later} V after two seconds");
        }
    }

    proptest! {
        #[test]
        fn duties_are_possible_slow_and_dead_when_disarmed(
            steps in prop::collection::vec((any::<f32>(), prop::option::of(any::<f32>()), any::<bool>(), 0u64..30_000), 1..50),
        ) {
            let mut motors = stage();
            let (mut now, mut before) = (Instant::ZERO, [0.0f32; 8]);
            for (thrust, voltage, armed, span) in steps {
                now += Duration::from_micros(span);
                let out = motors.step(now, &mixed(thrust), voltage, armed);
                for (duty, before) in out.duty.iter().zip(before) {
                    prop_assert!((0.0..=0.95).contains(duty));
                    let slew = motors.config.slew_max * StepTimer::LONGEST.seconds();
                    prop_assert!(!armed || (duty - before).abs() <= slew + 1e-6);
                    prop_assert!(armed || *duty == 0.0);
                }
                prop_assert_eq!(out.armed, armed);
                before = out.duty;
            }
        }
    }
}
