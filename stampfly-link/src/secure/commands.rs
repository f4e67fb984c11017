//! Commands that are said until the vehicle acknowledges them: a station's way over a link that loses frames.
//!
//! One after the other, in the order they were given. The vehicle takes each once, however often it
//! hears it, so a second way-point is never the first one said again. A kill goes before all others
//! and ends them; a landing and a disarming go before all but a kill, and end what flies on. For
//! commands; sticks are newer every time, and to write a parameter twice is to write it once. No
//! radio and no clock: seal what [`Commands::next`] returns with the [`Station`](super::Station),
//! and hand back what is acknowledged. A vehicle remembers the newest number alone: it may take a
//! command twice that is said again after it has restarted, or after another station with its key
//! has commanded.

use super::payload::Payload;
use stampfly_types::messages::{GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Instant};

/// Commands that wait, besides a kill.
const WAITING: usize = 4;
/// A command that is older is not said any more: who asked for it has seen by then that nothing
/// happened.
pub const FRESH: Duration = Duration::from_secs(1);
/// A kill and a landing are right at any time, and are said for longer.
const PATIENCE: Duration = Duration::from_secs(2);
/// Between two frames of a command. An acknowledgement takes a turn of the vehicle's, 20 ms, and twice the way.
const AGAIN: Duration = Duration::from_millis(60);
/// Between two frames of a kill.
const KILL_AGAIN: Duration = Duration::from_millis(20);

#[derive(Clone, Copy, Debug)]
struct Said {
    number: u32,
    command: GuidedCommand,
    until: Instant,
    again_at: Instant,
}

impl Said {
    const fn is_kill(&self) -> bool {
        matches!(self.command.kind, GuidedKind::Kill)
    }

    /// Does it end a flight? It waits for no command before it: one that the vehicle does not do is
    /// said for a second.
    const fn ends_a_flight(&self) -> bool {
        matches!(self.command.kind, GuidedKind::Kill | GuidedKind::Land | GuidedKind::Disarm)
    }
}

/// Commands on their way to one vehicle.
///
/// ```
/// use stampfly_link::secure::{Commands, Payload};
/// use stampfly_types::{Duration, Instant, messages::{GuidedCommand, GuidedKind}};
/// let (mut commands, now) = (Commands::new(), Instant::ZERO);
/// let command = |kind| GuidedCommand { kind, ..GuidedCommand::default() };
/// assert!(commands.say(now, 41, command(GuidedKind::Arm)) && commands.say(now, 42, command(GuidedKind::TakeOff)));
///
/// let arm = Payload::Numbered { number: 41, command: command(GuidedKind::Arm) };
/// assert_eq!(commands.next(now), Some(arm));
/// assert_eq!(commands.next(now), None);
/// let later = now + Duration::from_millis(60);
/// assert_eq!(commands.next(later), Some(arm), "nothing was heard of it");
/// assert!(commands.acknowledge(41, true));
/// assert!(matches!(commands.next(later), Some(Payload::Numbered { number: 42, .. })));
/// assert_eq!(commands.over(now + Duration::from_secs(1)), Some(42));
/// ```
#[derive(Clone, Debug)]
pub struct Commands {
    /// The one that is being said, and those behind it.
    /// There is always room for a kill and for another one that ends a flight.
    waiting: [Option<Said>; WAITING + 2],
    /// Was the frame of a kill before this one without a number?
    was_plain: bool,
}

impl Default for Commands {
    fn default() -> Self {
        Self::new()
    }
}

impl Commands {
    /// None.
    #[must_use]
    pub const fn new() -> Self {
        Self { waiting: [None; WAITING + 2], was_plain: false }
    }

    /// Takes a command. `number` is one that no command to this vehicle had lately: count on from a random one, or after a
    /// restart a vehicle could think that it has taken it. `false` when four wait. For a kill there is always room; a kill takes the place of a kill.
    /// A landing and a disarming go before all but a kill and each other.
    pub fn say(&mut self, now: Instant, number: u32, command: GuidedCommand) -> bool {
        self.say_since(now, now, number, command)
    }

    /// The same for a command that was asked for then: it is not said when it is older than a second, unless it kills or lands.
    pub fn say_since(&mut self, now: Instant, asked: Instant, number: u32, command: GuidedCommand) -> bool {
        let until = match command.kind {
            GuidedKind::Kill | GuidedKind::Land => now + PATIENCE,
            _ => asked + FRESH,
        };
        let said = Said { number, command, until, again_at: now };
        if !said.is_kill() {
            let free = |place: &&mut Option<Said>| place.is_none();
            let place = if said.ends_a_flight() {
                self.make_way(now)
            } else {
                self.waiting.iter_mut().take(WAITING).find(free)
            };
            return place.map(|place| *place = Some(said)).is_some();
        }
        self.end(now);
        if self.waiting.first().is_some_and(|first| first.is_none_or(|first| !first.is_kill())) {
            // Its last place is free: commands leave it so.
            self.waiting.rotate_right(1);
        }
        self.waiting.first_mut().into_iter().for_each(|first| *first = Some(said));
        self.was_plain = false;
        true
    }

    /// Ends the commands that fly on, and frees the place behind those that end a flight. `None`
    /// when these have every place.
    fn make_way(&mut self, now: Instant) -> Option<&mut Option<Said>> {
        self.waiting.iter_mut().flatten().filter(|said| !said.ends_a_flight()).for_each(|said| said.until = now);
        let before = self.waiting.iter().take_while(|place| place.is_some_and(|said| said.ends_a_flight())).count();
        let rest = self.waiting.get_mut(before..).filter(|rest| rest.last().is_some_and(Option::is_none))?;
        rest.rotate_right(1);
        rest.first_mut()
    }

    /// Ends the commands that wait: the motors are to be off, and somebody has said so otherwise than with a command.
    pub fn end(&mut self, now: Instant) {
        self.waiting.iter_mut().flatten().filter(|said| !said.is_kill()).for_each(|said| said.until = now);
    }

    /// What is to be sealed and sent now. Ask every 20 ms or so.
    pub fn next(&mut self, now: Instant) -> Option<Payload<'static>> {
        let said = self.waiting.first_mut()?.as_mut().filter(|said| now >= said.again_at && now < said.until)?;
        let numbered = Payload::Numbered { number: said.number, command: said.command };
        if !said.is_kill() {
            said.again_at = now + AGAIN;
            return Some(numbered);
        }
        said.again_at = now + KILL_AGAIN;
        // By turns: a flood does not keep this kind from being heard, and the other is acknowledged by its number.
        self.was_plain = !self.was_plain;
        Some(if self.was_plain { Payload::Kill } else { numbered })
    }

    /// Takes an [acknowledgement](Payload::Acknowledgement). Was the command with this number taken, and is that news? One that was not, because the
    /// vehicle had no room for it, is said again.
    pub fn acknowledge(&mut self, number: u32, taken: bool) -> bool {
        let is_first = self.waiting.first().is_some_and(|first| first.is_some_and(|said| said.number == number));
        let is_done = taken && is_first;
        if is_done {
            self.remove(0);
        }
        is_done
    }

    /// Takes a [refusal](Payload::Refusal). Was it the command that is being said? It is not said again: the vehicle would refuse
    /// it again, or do it when the sender no longer expects it. A kill is never refused, and goes on.
    pub fn refuse(&mut self, number: u32) -> bool {
        let is_it = |said: &Said| said.number == number && !said.is_kill();
        let is_first = self.waiting.first().is_some_and(|first| first.as_ref().is_some_and(is_it));
        if is_first {
            self.remove(0);
        }
        is_first
    }

    /// The number of a command that was not acknowledged in time, or that a kill has ended. Nobody knows whether it was taken. Ask until there is
    /// none, before anything is [said](Self::say): until then it takes its room.
    pub fn over(&mut self, now: Instant) -> Option<u32> {
        let is_over = |said: &Option<Said>| said.is_some_and(|said| now >= said.until);
        let place = self.waiting.iter().position(is_over)?;
        self.remove(place).map(|said| said.number)
    }

    fn remove(&mut self, place: usize) -> Option<Said> {
        let rest = self.waiting.get_mut(place..)?;
        let removed = rest.first_mut()?.take();
        rest.rotate_left(1);
        removed
    }
}
