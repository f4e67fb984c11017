//! Whose sticks count.
//!
//! A pilot who moves a stick has the vehicle, at once, and keeps it: guidance does not take it back by itself but has
//! to be given a new command. Without a fresh frame from anybody the set-point is the failsafe's: level, no climb.

use stampfly_types::messages::{CommandSetpoint, CommandSource, PilotInput, stick};
use stampfly_types::{Duration, Instant};

/// Limits of the arbitration.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AuthorityConfig {
    /// Sticks closer to their centre than this are centred, share.
    pub dead_band: f32,
    /// Deflection with which a pilot takes over from guidance, share.
    pub take_over: f32,
    /// A pilot's frame older than this is no frame.
    pub stale: Duration,
}

impl Default for AuthorityConfig {
    fn default() -> Self {
        Self { dead_band: 0.05, take_over: 0.15, stale: Duration::from_millis(500) }
    }
}

/// The arbitration.
///
/// ```
/// use stampfly_mode::Authority;
/// use stampfly_types::{Instant, messages::{CommandSource, PilotInput}};
/// let mut authority = Authority::default();
/// authority.guided(Instant::ZERO);
/// assert_eq!(authority.step(Instant::from_micros(1_000)).source, CommandSource::Guided);
/// authority.pilot(Instant::from_micros(2_000), &PilotInput { pitch: 0.5, ..Default::default() });
/// assert_eq!(authority.step(Instant::from_micros(3_000)).source, CommandSource::Pilot);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Authority {
    config: AuthorityConfig,
    pilot: Option<(Instant, PilotInput)>,
    guided: Option<Instant>,
    /// The pilot has taken over and no command has come since.
    pilot_holds: bool,
}

impl Authority {
    /// Nobody has commanded anything yet.
    #[must_use]
    pub fn new(config: AuthorityConfig) -> Self {
        Self { config, ..Self::default() }
    }

    /// A frame from the pilot. Sticks that are not finite count as centred; others are clamped to ±1.
    pub fn pilot(&mut self, at: Instant, input: &PilotInput) {
        let input = PilotInput {
            roll: stick(input.roll),
            pitch: stick(input.pitch),
            yaw: stick(input.yaw),
            throttle: stick(input.throttle),
            ..*input
        };
        let deflected =
            [input.roll, input.pitch, input.yaw, input.throttle].iter().any(|s| s.abs() > self.config.take_over);
        self.pilot_holds |= deflected;
        self.pilot = Some((at, input));
    }

    /// A command from a program, other than a sign of life.
    pub fn guided(&mut self, at: Instant) {
        self.guided = Some(at);
        self.pilot_holds = false;
    }

    /// A sign of life from a program.
    pub fn guided_alive(&mut self, at: Instant) {
        if self.guided.is_some() {
            self.guided = Some(at);
        }
    }

    /// The set-point now.
    #[must_use]
    pub fn step(&self, now: Instant) -> CommandSetpoint {
        let fresh = |at: Instant| now.since(at) < self.config.stale;
        let pilot = self.pilot.filter(|(at, _)| fresh(*at)).map(|(_, input)| input);
        let guided = self.guided.is_some_and(fresh) && !self.pilot_holds;
        match pilot {
            _ if guided => CommandSetpoint { source: CommandSource::Guided, ..Default::default() },
            Some(input) => CommandSetpoint {
                throttle: self.centred(input.throttle),
                roll: self.centred(input.roll),
                pitch: self.centred(input.pitch),
                yaw: self.centred(input.yaw),
                source: CommandSource::Pilot,
            },
            None if self.pilot.is_some() || self.guided.is_some() => {
                CommandSetpoint { source: CommandSource::Failsafe, ..Default::default() }
            }
            None => CommandSetpoint::default(),
        }
    }

    /// Removes the dead band without a jump at its edge.
    fn centred(&self, stick: f32) -> f32 {
        let band = self.config.dead_band;
        if stick.abs() <= band { 0.0 } else { (stick.abs() - band) / (1.0 - band) * stick.signum() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guidance_does_not_retake_by_being_alive() {
        let mut authority = Authority::default();
        authority.guided(Instant::ZERO);
        authority.pilot(Instant::from_micros(10), &PilotInput { roll: 0.5, ..Default::default() });
        authority.guided_alive(Instant::from_micros(20));
        assert_eq!(authority.step(Instant::from_micros(30)).source, CommandSource::Pilot);
        authority.guided(Instant::from_micros(40));
        assert_eq!(authority.step(Instant::from_micros(50)).source, CommandSource::Guided, "a new command does");
    }

    #[test]
    fn silence_is_the_failsafe_and_nan_is_centre() {
        let mut authority = Authority::default();
        assert_eq!(authority.step(Instant::ZERO).source, CommandSource::None);
        authority.pilot(Instant::ZERO, &PilotInput { roll: f32::NAN, pitch: 9.0, ..Default::default() });
        let setpoint = authority.step(Instant::from_micros(1));
        assert_eq!((setpoint.roll, setpoint.pitch), (0.0, 1.0));
        assert_eq!(authority.step(Instant::from_millis(500)).source, CommandSource::Failsafe);
    }
}
