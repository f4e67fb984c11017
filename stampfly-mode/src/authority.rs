//! The sticks of the commander, as the controllers get them.
//!
//! The [mode machine](crate::machine) decides who has authority; this keeps what each source sent last. A commander who falls
//! silent is replaced by the failsafe: level, no climb. After a silence, the pilot's sticks count again when they have been
//! heard for [`AuthorityConfig::back`]: a link that lets single frames through would throw the vehicle about.

use stampfly_types::messages::{CommandSetpoint, CommandSource, PilotInput};
use stampfly_types::{Duration, Instant};

/// Limits of the arbitration.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AuthorityConfig {
    /// Sticks closer to their centre than this are centred, share.
    pub dead_band: f32,
    /// A frame or sign of life older than this is none.
    pub stale: Duration,
    /// After a silence, the pilot's sticks count when frames have come for this long.
    pub back: Duration,
}

impl Default for AuthorityConfig {
    fn default() -> Self {
        Self { dead_band: 0.05, stale: Duration::from_millis(500), back: Duration::from_secs(1) }
    }
}

/// The sticks of the commander.
///
/// ```
/// use stampfly_mode::Authority;
/// use stampfly_types::{Instant, messages::{CommandSource, PilotInput}};
/// let mut authority = Authority::default();
/// authority.pilot(Instant::ZERO, &PilotInput { pitch: 1.0, ..Default::default() });
/// let sticks = authority.step(Instant::from_millis(100), CommandSource::Pilot, true);
/// assert_eq!((sticks.source, sticks.pitch), (CommandSource::Pilot, 1.0));
/// let sticks = authority.step(Instant::from_millis(500), CommandSource::Pilot, true);
/// assert_eq!((sticks.source, sticks.pitch), (CommandSource::Failsafe, 0.0));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Authority {
    config: AuthorityConfig,
    pilot: Option<(Instant, PilotInput)>,
    /// When the first frame after a silence came; `None` before the first silence.
    pilot_back: Option<Instant>,
}

impl Authority {
    /// No source has been heard yet.
    #[must_use]
    pub fn new(config: AuthorityConfig) -> Self {
        Self { config, ..Self::default() }
    }

    /// A frame from the pilot. Sticks are clamped to ±1; a frame with one that is no number is not heard.
    pub fn pilot(&mut self, at: Instant, input: &PilotInput) {
        if !input.is_readable() {
            return;
        }
        let input = input.cleaned();
        if self.pilot.is_some_and(|(last, _)| at.since(last) >= self.config.stale) {
            self.pilot_back = Some(at);
        }
        self.pilot = Some((at, input));
    }

    /// The set-point now, of the source that has authority. `heard` says whether the failsafe hears it: a program has no sticks
    /// whose age this could know.
    #[must_use]
    pub fn step(&self, now: Instant, commander: CommandSource, heard: bool) -> CommandSetpoint {
        let fresh = |at: Instant| now.since(at) < self.config.stale;
        let pilot = self.pilot.filter(|(at, _)| fresh(*at)).map(|(_, input)| input);
        let settled = self.pilot_back.is_none_or(|back| now.since(back) >= self.config.back);
        match (commander, pilot.filter(|_| settled)) {
            (CommandSource::Pilot, Some(input)) => CommandSetpoint {
                throttle: self.centred(input.throttle),
                roll: self.centred(input.roll),
                pitch: self.centred(input.pitch),
                yaw: self.centred(input.yaw),
                source: CommandSource::Pilot,
            },
            (CommandSource::Guided, _) if heard => {
                CommandSetpoint { source: CommandSource::Guided, ..Default::default() }
            }
            (CommandSource::None, _) => CommandSetpoint::default(),
            _ => CommandSetpoint { source: CommandSource::Failsafe, ..Default::default() },
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

    const HALF: PilotInput = PilotInput {
        roll: 0.5,
        pitch: 0.0,
        yaw: 0.0,
        throttle: 0.0,
        mode: stampfly_types::messages::FlightMode::PosHold,
        arm: true,
        kill: false,
    };

    #[test]
    fn a_new_one_has_heard_nobody() {
        let authority = Authority::new(AuthorityConfig::default());
        assert_eq!(authority, Authority::default());
        assert_eq!(authority.step(Instant::ZERO, CommandSource::Pilot, false).source, CommandSource::Failsafe);
    }

    #[test]
    fn only_the_commander_is_followed() {
        let mut authority = Authority::default();
        let now = Instant::from_millis(10);
        for commander in [CommandSource::Pilot, CommandSource::Guided, CommandSource::Failsafe] {
            assert_eq!(authority.step(now, commander, false).source, CommandSource::Failsafe, "never heard");
        }
        authority.pilot(Instant::ZERO, &HALF);
        for commander in [CommandSource::None, CommandSource::Pilot, CommandSource::Guided] {
            let sticks = authority.step(now, commander, true);
            assert_eq!(sticks.source, commander);
            assert_eq!(sticks.roll > 0.0, commander == CommandSource::Pilot);
        }
    }

    /// Half throttle, which a centred stick is in STABILIZE, would let it fall.
    #[test]
    fn sticks_that_are_no_numbers_are_silence() {
        let mut authority = Authority::default();
        authority.pilot(Instant::ZERO, &HALF);
        for ms in (20..1_000u64).step_by(20) {
            let now = Instant::from_millis(ms);
            authority.pilot(now, &PilotInput { throttle: f32::NAN, ..HALF });
            let sticks = authority.step(now, CommandSource::Pilot, true);
            assert_eq!(sticks.source == CommandSource::Pilot, ms < 500, "{ms}");
            assert!(sticks.throttle == 0.0 && sticks.roll.is_finite());
        }
    }

    #[test]
    fn d13_one_source_does_not_speak_for_another() {
        let mut authority = Authority::default();
        authority.pilot(Instant::ZERO, &HALF);
        let now = Instant::from_secs(1);
        assert_eq!(authority.step(now, CommandSource::Pilot, true).source, CommandSource::Failsafe);
        assert_eq!(authority.step(now, CommandSource::Guided, true).source, CommandSource::Guided);
    }

    #[test]
    fn d13_sticks_count_a_second_after_a_silence() {
        let mut authority = Authority::default();
        let mut first = None;
        for ms in (0..4_000u64).step_by(20).filter(|ms| !(1_000..1_600).contains(ms)) {
            let now = Instant::from_millis(ms);
            authority.pilot(now, &HALF);
            let piloted = authority.step(now, CommandSource::Pilot, true).source == CommandSource::Pilot;
            assert!(piloted || ms >= 1_600, "a short gap is none: {ms}");
            if ms >= 1_600 && piloted {
                first.get_or_insert(ms);
            }
        }
        assert_eq!(first, Some(2_600));
    }

    #[test]
    fn sticks_beyond_their_ends_are_at_their_ends() {
        let mut authority = Authority::default();
        authority.pilot(Instant::ZERO, &PilotInput { pitch: 9.0, ..Default::default() });
        let setpoint = authority.step(Instant::from_micros(1), CommandSource::Pilot, true);
        assert_eq!((setpoint.roll, setpoint.pitch), (0.0, 1.0));
    }

    #[test]
    fn sticks_leave_the_dead_band_without_a_jump_and_reach_their_ends() {
        let mut authority = Authority::default();
        let sticks = |authority: &mut Authority, throttle, roll, pitch, yaw| {
            authority.pilot(Instant::ZERO, &PilotInput { throttle, roll, pitch, yaw, ..HALF });
            let sticks = authority.step(Instant::ZERO, CommandSource::Pilot, true);
            [sticks.throttle, sticks.roll, sticks.pitch, sticks.yaw]
        };
        assert_eq!(sticks(&mut authority, 0.05, -0.05, 0.04, 0.0), [0.0; 4]);
        let near = sticks(&mut authority, 0.05095, -0.05095, 0.525, -0.24);
        for (stick, expected) in near.into_iter().zip([0.001, -0.001, 0.5, -0.2]) {
            assert!((stick - expected).abs() < 1e-6, "{near:?}");
        }
        assert_eq!(sticks(&mut authority, -1.0, 1.0, -1.0, 1.0), [-1.0, 1.0, -1.0, 1.0]);
    }
}
