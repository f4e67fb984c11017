<<<<<<< HEAD
//! Whose sticks count.
//!
//! A pilot who moves a stick has the vehicle, at once, and keeps it: guidance does not take it back by itself but has
//! to be given a new command. Without a fresh frame from anybody the set-point is the failsafe's: level, no climb.

use stampfly_types::Micros;
use stampfly_types::messages::{CommandSetpoint, CommandSource, PilotInput};
=======
//! Who commands: the pilot, a program, the failsafe, nobody.
//!
//! Authority goes to whoever asks first and stays there until it is taken or given back:
//!
//! * a guided command takes it, unless a pilot took it before;
//! * a pilot takes it by moving a stick clearly; from then on guided way-points do not take it back. An explicit
//!   [`GuidedKind::Hold`] does ("I take over here"), and so does [`GuidedKind::TakeOff`] after the next landing;
//! * when the one who holds it falls silent, the failsafe has it: sticks at rest, until the link is back.
//!
//! Sticks leave here clamped, with the dead band cut out and the rest stretched back to the full range.

use stampfly_types::Micros;
use stampfly_types::messages::{CommandSetpoint, CommandSource, GuidedCommand, GuidedKind, PilotInput, SystemMode};

use crate::Dated;
>>>>>>> control

/// Limits of the arbitration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuthorityConfig {
<<<<<<< HEAD
    /// Sticks closer to their centre than this are centred, share.
    pub dead_band: f32,
    /// Deflection with which a pilot takes over from guidance, share.
    pub take_over: f32,
    /// A pilot's frame older than this is no frame.
    pub stale: Micros,
=======
    /// Stick travel around the centre that counts as none.
    pub dead_band: f32,
    /// Stick travel that takes authority from a program.
    pub take_over: f32,
    /// A link that has been silent for this long no longer commands.
    pub timeout: Micros,
>>>>>>> control
}

impl Default for AuthorityConfig {
    fn default() -> Self {
<<<<<<< HEAD
        Self { dead_band: 0.05, take_over: 0.15, stale: Micros::from_millis(500) }
    }
}

/// The arbitration.
///
/// ```
/// use stampfly_mode::Authority;
/// use stampfly_types::{Micros, messages::{CommandSource, PilotInput}};
/// let mut authority = Authority::default();
/// authority.guided(Micros(0));
/// assert_eq!(authority.step(Micros(1_000)).source, CommandSource::Guided);
/// authority.pilot(Micros(2_000), &PilotInput { pitch: 0.5, ..Default::default() });
/// assert_eq!(authority.step(Micros(3_000)).source, CommandSource::Pilot);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Authority {
    config: AuthorityConfig,
    pilot: Option<(Micros, PilotInput)>,
    guided: Option<Micros>,
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
    pub fn pilot(&mut self, at: Micros, input: &PilotInput) {
        let clean = |stick: f32| if stick.is_finite() { stick.clamp(-1.0, 1.0) } else { 0.0 };
        let input = PilotInput {
            roll: clean(input.roll),
            pitch: clean(input.pitch),
            yaw: clean(input.yaw),
            throttle: clean(input.throttle),
            ..*input
        };
        let deflected =
            [input.roll, input.pitch, input.yaw, input.throttle].iter().any(|s| s.abs() > self.config.take_over);
        self.pilot_holds |= deflected;
        self.pilot = Some((at, input));
    }

    /// A command from a program, other than a sign of life.
    pub fn guided(&mut self, at: Micros) {
        self.guided = Some(at);
        self.pilot_holds = false;
    }

    /// A sign of life from a program.
    pub fn guided_alive(&mut self, at: Micros) {
        if self.guided.is_some() {
            self.guided = Some(at);
        }
    }

    /// The set-point now.
    #[must_use]
    pub fn step(&self, now: Micros) -> CommandSetpoint {
        let fresh = |at: Micros| now.since(at) < self.config.stale;
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
=======
        Self { dead_band: 0.05, take_over: 0.15, timeout: Micros::from_millis(500) }
    }
}

/// All the arbitration looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuthorityInput<'a> {
    /// The pilot's newest frame.
    pub pilot: Option<Dated<PilotInput>>,
    /// Guided commands that arrived since the previous step, in order.
    pub guided: &'a [GuidedCommand],
    /// When the newest guided frame arrived; [`GuidedKind::None`] serves as a heartbeat.
    pub guided_at: Option<Micros>,
    /// The vehicle's state.
    pub mode: &'a SystemMode,
}

/// The arbitration.
///
/// ```
/// use stampfly_mode::{Authority, AuthorityInput, Dated};
/// use stampfly_types::Micros;
/// use stampfly_types::messages::*;
///
/// let mut authority = Authority::default();
/// let mode = SystemMode { armed: true, ..Default::default() };
/// let way_point = [GuidedCommand { kind: GuidedKind::WayPoint, ..Default::default() }];
/// let mut step = |millis, roll, guided: &[GuidedCommand]| {
///     let now = Micros::from_millis(millis);
///     let pilot = Some(Dated { at: now, data: PilotInput { roll, ..Default::default() } });
///     authority.step(now, &AuthorityInput { pilot, guided, guided_at: Some(now), mode: &mode }).source
/// };
/// assert_eq!(step(0, 0.0, &way_point), CommandSource::Guided);
/// assert_eq!(step(10, 0.1, &[]), CommandSource::Guided, "an unsteady thumb is no take-over");
/// assert_eq!(step(20, 0.3, &[]), CommandSource::Pilot);
/// assert_eq!(step(30, 0.0, &way_point), CommandSource::Pilot, "and way-points do not take it back");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Authority {
    config: AuthorityConfig,
    /// Who holds authority, the failsafe aside.
    holder: CommandSource,
    /// A pilot took it from a program in this flight.
    overridden: bool,
}

impl Default for Authority {
    fn default() -> Self {
        Self::new(&AuthorityConfig::default())
    }
}

impl Authority {
    /// Nobody commands yet.
    #[must_use]
    pub fn new(config: &AuthorityConfig) -> Self {
        Self { config: *config, holder: CommandSource::None, overridden: false }
    }

    /// One step: the arbitrated command.
    pub fn step(&mut self, now: Micros, input: &AuthorityInput<'_>) -> CommandSetpoint {
        let fresh = |at: Micros| now.since(at) < self.config.timeout;
        let pilot = input.pilot.filter(|pilot| fresh(pilot.at)).map(|pilot| pilot.data);
        let guided_alive = input.guided_at.is_some_and(fresh);

        if !input.mode.armed {
            self.overridden = false;
        }
        for command in input.guided {
            if self.lets_in(command.kind) {
                self.holder = CommandSource::Guided;
                self.overridden = false;
            }
        }
        if let Some(sticks) = &pilot {
            match self.holder {
                CommandSource::None | CommandSource::Failsafe => self.holder = CommandSource::Pilot,
                CommandSource::Guided if self.moved(sticks) => {
                    self.holder = CommandSource::Pilot;
                    self.overridden = true;
                }
                // On the ground, a program that has left makes room without a stick being moved.
                CommandSource::Guided if !guided_alive && !input.mode.armed => self.holder = CommandSource::Pilot,
                CommandSource::Guided | CommandSource::Pilot => {}
            }
        }

        match (self.holder, pilot) {
            (CommandSource::None | CommandSource::Failsafe, _) => CommandSetpoint::default(),
            (CommandSource::Pilot, Some(sticks)) => self.sticks(&sticks),
            (CommandSource::Guided, _) if guided_alive => source(CommandSource::Guided),
            (CommandSource::Pilot, None) | (CommandSource::Guided, _) => source(CommandSource::Failsafe),
        }
    }

    fn lets_in(&self, kind: GuidedKind) -> bool {
        match kind {
            GuidedKind::Arm | GuidedKind::TakeOff | GuidedKind::WayPoint => !self.overridden,
            GuidedKind::Hold => true,
            // Landing and stopping need no authority over the set-point.
            GuidedKind::None | GuidedKind::Disarm | GuidedKind::Land | GuidedKind::Kill => false,
        }
    }

    fn moved(&self, sticks: &PilotInput) -> bool {
        [sticks.roll, sticks.pitch, sticks.yaw, sticks.throttle].iter().any(|s| s.abs() > self.config.take_over)
    }

    fn sticks(&self, pilot: &PilotInput) -> CommandSetpoint {
        CommandSetpoint {
            throttle: self.shape(pilot.throttle),
            roll: self.shape(pilot.roll),
            pitch: self.shape(pilot.pitch),
            yaw: self.shape(pilot.yaw),
            source: CommandSource::Pilot,
        }
    }

    /// Dead band, the rest stretched to the full range. A stick that is no number is at rest.
    fn shape(&self, stick: f32) -> f32 {
        let beyond = stick.abs().min(1.0) - self.config.dead_band;
        // False for NaN as well.
        if beyond > 0.0 && !stick.is_nan() { stick.signum() * beyond / (1.0 - self.config.dead_band) } else { 0.0 }
    }
}

fn source(source: CommandSource) -> CommandSetpoint {
    CommandSetpoint { source, ..CommandSetpoint::default() }
>>>>>>> control
}

#[cfg(test)]
mod tests {
    use super::*;
<<<<<<< HEAD

    #[test]
    fn guidance_does_not_retake_by_being_alive() {
        let mut authority = Authority::default();
        authority.guided(Micros(0));
        authority.pilot(Micros(10), &PilotInput { roll: 0.5, ..Default::default() });
        authority.guided_alive(Micros(20));
        assert_eq!(authority.step(Micros(30)).source, CommandSource::Pilot);
        authority.guided(Micros(40));
        assert_eq!(authority.step(Micros(50)).source, CommandSource::Guided, "a new command does");
    }

    #[test]
    fn silence_is_the_failsafe_and_nan_is_centre() {
        let mut authority = Authority::default();
        assert_eq!(authority.step(Micros(0)).source, CommandSource::None);
        authority.pilot(Micros(0), &PilotInput { roll: f32::NAN, pitch: 9.0, ..Default::default() });
        let setpoint = authority.step(Micros(1));
        assert_eq!((setpoint.roll, setpoint.pitch), (0.0, 1.0));
        assert_eq!(authority.step(Micros::from_millis(500)).source, CommandSource::Failsafe);
=======
    use proptest::prelude::*;

    const ARMED: SystemMode = SystemMode {
        state: stampfly_types::messages::FlightState::Flying,
        mode: stampfly_types::messages::FlightMode::PosHold,
        armed: true,
        pairing: false,
        blocks: stampfly_types::messages::ArmBlocks::NONE,
        transitions: 0,
        control_resets: 0,
    };

    fn guided(kind: GuidedKind) -> GuidedCommand {
        GuidedCommand { kind, ..GuidedCommand::default() }
    }

    struct Bench {
        authority: Authority,
        now: Micros,
    }

    impl Bench {
        fn step(&mut self, roll: Option<f32>, commands: &[GuidedKind], guided_alive: bool) -> CommandSetpoint {
            self.now += Micros(20_000);
            let commands: std::vec::Vec<_> = commands.iter().map(|kind| guided(*kind)).collect();
            let pilot = roll.map(|roll| Dated { at: self.now, data: PilotInput { roll, ..PilotInput::default() } });
            let guided_at = guided_alive.then_some(self.now);
            self.authority.step(self.now, &AuthorityInput { pilot, guided: &commands, guided_at, mode: &ARMED })
        }
    }

    fn bench() -> Bench {
        Bench { authority: Authority::default(), now: Micros::from_secs(1) }
    }

    #[test]
    fn an_explicit_hold_gives_authority_back_to_the_program() {
        let mut bench = bench();
        assert_eq!(bench.step(None, &[], false).source, CommandSource::None);
        assert_eq!(bench.step(Some(0.0), &[GuidedKind::TakeOff], true).source, CommandSource::Guided);
        assert_eq!(bench.step(Some(-0.9), &[], true).source, CommandSource::Pilot);
        for kind in [GuidedKind::WayPoint, GuidedKind::TakeOff, GuidedKind::Arm, GuidedKind::Land, GuidedKind::None] {
            assert_eq!(bench.step(Some(0.0), &[kind], true).source, CommandSource::Pilot, "{kind:?}");
        }
        assert_eq!(bench.step(Some(0.0), &[GuidedKind::Hold], true).source, CommandSource::Guided);
    }

    #[test]
    fn whoever_commands_and_falls_silent_leaves_it_to_the_failsafe() {
        let mut bench = bench();
        assert_eq!(bench.step(Some(0.5), &[], false).source, CommandSource::Pilot);
        let old = Dated { at: bench.now, data: PilotInput { roll: 0.5, ..PilotInput::default() } };
        let mut at = |millis| {
            let now = bench.now + Micros::from_millis(millis);
            let input = AuthorityInput { pilot: Some(old), guided: &[], guided_at: None, mode: &ARMED };
            bench.authority.step(now, &input)
        };
        assert_eq!(at(499).source, CommandSource::Pilot);
        let lost = at(500);
        assert_eq!((lost.source, lost.roll), (CommandSource::Failsafe, 0.0), "sticks at rest");
        assert_eq!(bench.step(Some(0.2), &[], false).source, CommandSource::Pilot, "the link is back");
        let mut bench = self::bench();
        bench.step(None, &[GuidedKind::TakeOff], true);
        assert_eq!(bench.step(None, &[], false).source, CommandSource::Failsafe);
    }

    proptest! {
        #[test]
        fn sticks_leave_within_their_range(roll: f32, pitch in -2f32..2.0, throttle: f32) {
            let mut authority = Authority::default();
            let data = PilotInput { roll, pitch, throttle, ..PilotInput::default() };
            let pilot = Some(Dated { at: Micros::ZERO, data });
            let input = AuthorityInput { pilot, guided: &[], guided_at: None, mode: &ARMED };
            let out = authority.step(Micros::ZERO, &input);
            for (stick, from) in [(out.roll, roll), (out.pitch, pitch), (out.throttle, throttle)] {
                prop_assert!((-1.0..=1.0).contains(&stick));
                prop_assert!(stick == 0.0 || stick.signum() == from.signum());
                prop_assert!(from.is_nan() || from.abs() > 0.05 || stick == 0.0);
            }
        }
>>>>>>> control
    }
}
