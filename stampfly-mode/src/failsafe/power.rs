//! The battery: its level, its monitor's silence, and readings that no battery gives.
//!
//! While armed, a reading is implausible when it is not finite, outside `voltage_range`, or farther
//! from the last plausible one than `voltage_step`, `voltage_rate` times the time since, and what the
//! change of the current makes of `resistance` explain together. It then counts for nothing else.
//! One that is merely too far is told by the next one: a monitor gives the mean of the current, which
//! comes a reading later than the voltage that it lets fall. Disarmed everything is plausible:
//! batteries are changed, and a board runs on USB. But what draws more than `idle_current` then is a
//! motor.

use super::config::FailsafeConfig;
use stampfly_types::Instant;
use stampfly_types::messages::{Alerts, PowerData};

/// Time constant of the mean current, s: a radio draws its power in bursts of milliseconds.
const IDLE_TIME: f32 = 0.3;

/// What is remembered of the battery.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct PowerMonitor {
    /// Low-passed, V.
    voltage: Option<f32>,
    /// Stamp of the newest reading, of the newest finite one, and the newest plausible one, V and A.
    newest: Option<Instant>,
    finite: Option<Instant>,
    plausible: Option<(Instant, f32, f32)>,
    /// The newest reading was too far from that one.
    far: bool,
    /// Low-passed, A, while disarmed.
    current: Option<(Instant, f32)>,
}

impl PowerMonitor {
    /// The alerts of the battery, in place of those in `active`.
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        active: Alerts,
        now: Instant,
        power: Option<(Instant, &PowerData)>,
        armed: bool,
    ) -> Alerts {
        let fresh = power.filter(|(at, _)| self.newest != Some(*at));
        self.newest = fresh.map_or(self.newest, |(at, _)| Some(at));
        let active = active.set(Alerts::POWER_IMPLAUSIBLE, armed && active.contains(Alerts::POWER_IMPLAUSIBLE));
        let active = match fresh {
            Some((at, power)) if power.voltage.is_finite() => {
                self.finite = Some(at.min(now));
                self.reading(config, active, at, power, armed)
            }
            Some(_) => active.set(Alerts::POWER_IMPLAUSIBLE, armed),
            None => active,
        };
        // At power-on the monitor gets as long for its first sample.
        let silence = now.since(self.finite.unwrap_or(Instant::ZERO));
        active.set(Alerts::POWER_LOST, silence >= config.power_silence)
    }

    fn reading(
        &mut self,
        config: &FailsafeConfig,
        active: Alerts,
        at: Instant,
        power: &PowerData,
        armed: bool,
    ) -> Alerts {
        // A vehicle that never had a meter may fly without one.
        let no_meter = power.voltage < config.no_meter;
        if no_meter && (!armed || self.voltage.is_none()) {
            return active;
        }
        let [low, high] = config.voltage_range;
        let none = armed && !(low..=high).contains(&power.voltage);
        let far = armed && !none && !self.is_explained(config, at, power);
        let again = core::mem::replace(&mut self.far, far) && far;
        let plausible = !none && !far;
        let known = active.contains(Alerts::POWER_IMPLAUSIBLE);
        let active = active
            .set(Alerts::POWER_IMPLAUSIBLE, none || again || (far && known))
            .set(Alerts::MOTOR_RUNS, self.draws(config, at, power, armed));
        if !plausible {
            return active;
        }
        let last = self.plausible.replace((at, power.voltage, power.current));
        let dt = last.map_or(0.0, |(last, ..)| at.since(last).seconds());
        let before = self.voltage.unwrap_or(power.voltage);
        let voltage = before + (power.voltage - before) * (dt / (config.battery_time + dt));
        self.voltage = Some(voltage);
        let below = |alert: Alerts, limit: f32| {
            let hysteresis = if active.contains(alert) { config.battery_hysteresis } else { 0.0 };
            voltage <= limit + hysteresis
        };
        active
            .set(Alerts::USB_POWER, below(Alerts::USB_POWER, config.usb) && !armed)
            .set(Alerts::LOW_BATTERY, below(Alerts::LOW_BATTERY, config.battery_low))
            .set(Alerts::CRITICAL_BATTERY, below(Alerts::CRITICAL_BATTERY, config.battery_critical))
    }

    /// Does it draw more than a disarmed vehicle's electronics?
    fn draws(&mut self, config: &FailsafeConfig, at: Instant, power: &PowerData, armed: bool) -> bool {
        if armed || !power.current.is_finite() {
            self.current = None;
            return false;
        }
        let (last, before) = self.current.unwrap_or((at, 0.0));
        let dt = at.since(last).seconds();
        let current = before + (power.current - before) * (dt / (IDLE_TIME + dt));
        self.current = Some((at, current));
        current > config.idle_current
    }

    /// Is it as far from the last plausible reading as a battery goes?
    fn is_explained(&self, config: &FailsafeConfig, at: Instant, power: &PowerData) -> bool {
        let Some((last, voltage, current)) = self.plausible else { return true };
        let free = config.voltage_step + config.voltage_rate * at.since(last).seconds();
        // A current that is no number explains nothing.
        let drop = config.resistance * Some(power.current - current).filter(|rise| rise.is_finite()).unwrap_or(0.0);
        (voltage - free - drop.max(0.0)..=voltage + free - drop.min(0.0)).contains(&power.voltage)
    }
}
