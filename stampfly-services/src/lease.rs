//! One program at a time commands a vehicle.
//!
//! Several may be connected: a ground station that watches, a script that flies. The first that
//! asks for anything has the lease as long as it is heard; the others are told who has it. A kill
//! is everybody's at any time, and so is landing. When the holder falls silent or its connection
//! ends, the vehicle's own failsafe acts, and another program may take the lease with a command.
//! Sticks of a program or of a station with the key obey the same rule, but do not take the lease of
//! a flight: some are sent as long as a page is open. Whose sticks reach the vehicle is decided in
//! `stick_source.rs`.

use crate::refusal::{Refusal, Requester};
use stampfly_types::messages::{GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Instant};

/// A holder who was not heard for this long has lost it. Ground stations send a heartbeat a second,
/// and the protocol's custom is to allow three to five to be lost.
pub const SILENCE: Duration = Duration::from_secs(3);
/// A vehicle without a pilot takes a link for lost after half a second: signs of life are passed on
/// so often.
pub const LIFE: Duration = Duration::from_millis(100);
/// Largest number in a command: metres, metres a second, radians, seconds. A vehicle of this kind
/// does not go farther.
const LARGEST: f32 = 1_000.0;

/// Are all its numbers such that a vehicle can mean something by them?
pub(crate) fn is_sane(command: &GuidedCommand) -> bool {
    let GuidedCommand { position, yaw, speed, dwell, .. } = command;
    let mut numbers = position.iter().chain([yaw, speed, dwell]);
    numbers.all(|number| number.is_finite() && number.abs() <= LARGEST)
}

/// Who commands.
///
/// ```
/// use stampfly_services::{Lease, Refusal, Requester};
/// use stampfly_types::{Instant, messages::{GuidedCommand, GuidedKind}};
/// let command = |kind| GuidedCommand { kind, ..Default::default() };
/// let mut lease = Lease::new();
/// let (one, two) = (Requester::Page(1), Requester::Page(2));
/// assert_eq!(lease.ask(Instant::ZERO, one, &command(GuidedKind::Arm)), Ok(()));
/// let refused = lease.ask(Instant::ZERO, two, &command(GuidedKind::WayPoint));
/// assert_eq!(refused, Err(Refusal::Occupied(one)));
/// assert_eq!(lease.ask(Instant::ZERO, two, &command(GuidedKind::Kill)), Ok(()));
/// // Silent for three seconds: another's turn.
/// assert_eq!(lease.ask(Instant::from_secs(3), two, &command(GuidedKind::WayPoint)), Ok(()));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lease {
    holder: Option<Requester>,
    /// Its connection has ended.
    has_left: bool,
    /// When the holder was heard last; without a holder, any program.
    heard: Option<Instant>,
    /// When a sign of life was passed on.
    passed: Option<Instant>,
}

impl Lease {
    /// No program commands.
    #[must_use]
    pub const fn new() -> Self {
        Self { holder: None, has_left: false, heard: None, passed: None }
    }

    /// Who commands.
    #[must_use]
    pub fn holder(&self, now: Instant) -> Option<Requester> {
        self.holder.filter(|_| !self.has_left && self.is_heard(now))
    }

    /// Who has taken the lease of this flight and has not left, heard or not.
    #[must_use]
    pub fn commander(&self) -> Option<Requester> {
        self.holder.filter(|_| !self.has_left)
    }

    /// Who has taken the lease of this flight, heard or not, there or not.
    pub(crate) const fn taker(&self) -> Option<Requester> {
        self.holder
    }

    /// Do this one's signs of life count?
    #[must_use]
    pub fn is_holders(&self, requester: Requester) -> bool {
        self.holder.is_none_or(|holder| holder == requester)
    }

    /// May this be passed on to the vehicle? A program that asks for more than a kill has the lease
    /// then.
    ///
    /// # Errors
    /// When another program has it, or a number is none.
    pub fn ask(&mut self, now: Instant, requester: Requester, command: &GuidedCommand) -> Result<(), Refusal> {
        if matches!(command.kind, GuidedKind::Kill) {
            return Ok(());
        }
        if !is_sane(command) {
            return Err(Refusal::Range);
        }
        match self.holder(now).filter(|holder| *holder != requester) {
            // The holder goes on commanding, to a vehicle that lands.
            Some(_) if matches!(command.kind, GuidedKind::Land | GuidedKind::Disarm) => Ok(()),
            Some(holder) => Err(Refusal::Occupied(holder)),
            None => {
                (self.holder, self.heard, self.has_left) = (Some(requester), Some(now), false);
                Ok(())
            }
        }
    }

    /// May these sticks be passed on? The holder's are a sign of life.
    ///
    /// # Errors
    /// When another program has the lease, or had it last in this flight.
    pub fn steer(&mut self, now: Instant, requester: Requester) -> Result<(), Refusal> {
        match self.holder {
            Some(holder) if holder != requester => Err(Refusal::Occupied(holder)),
            _ => {
                (self.holder, self.heard, self.has_left) = (Some(requester), Some(now), false);
                Ok(())
            }
        }
    }

    /// It commands from now on, whoever did before: the mode machine has let it take over.
    pub fn take(&mut self, now: Instant, requester: Requester) {
        (self.holder, self.heard, self.has_left) = (Some(requester), Some(now), false);
    }

    /// Its connection has ended. Another may take the lease at once; until one does, the vehicle's
    /// failsafe hears nothing.
    pub fn leave(&mut self, has_left: impl Fn(Requester) -> bool) {
        self.has_left |= self.holder.is_some_and(has_left);
    }

    /// A program is there. While a vehicle is commanded, only its commander's signs of life count,
    /// also after a silence: the vehicle's failsafe has to notice that the commander is gone,
    /// however many watch. Before there is one, every program's count.
    pub fn alive(&mut self, now: Instant, requester: Requester) {
        if self.is_holders(requester) {
            // A page whose connection broke has come again.
            (self.heard, self.has_left) = (Some(now), false);
        }
    }

    /// The vehicle stands with its motors off: there is nothing to hold.
    pub fn release(&mut self) {
        (self.holder, self.has_left) = (None, false);
    }

    /// Must a sign of life be passed on to the vehicle now? Ask at least every [`LIFE`].
    pub fn is_sign_due(&mut self, now: Instant) -> bool {
        // A transmitter's frames are what the failsafe hears of it.
        let is_there = self.is_heard(now) && self.holder != Some(Requester::Transmitter);
        let due = is_there && self.passed.is_none_or(|passed| now.since(passed) >= LIFE);
        if due {
            self.passed = Some(now);
        }
        due
    }

    fn is_heard(&self, now: Instant) -> bool {
        self.heard.is_some_and(|heard| now.since(heard) < SILENCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::Vec3;

    const ONE: Requester = Requester::Mavlink { connection: 1, system: 255, component: 190 };
    /// Of the same numbers, at another connection.
    const TWO: Requester = Requester::Mavlink { connection: 2, system: 255, component: 190 };

    fn command(kind: GuidedKind) -> GuidedCommand {
        GuidedCommand { kind, ..Default::default() }
    }

    #[test]
    fn a_watcher_does_not_keep_the_lease_of_a_silent_commander() {
        for watcher in [
            TWO,
            Requester::Mavlink { connection: 1, system: 255, component: 191 },
            Requester::Page(1),
            Requester::Link(1),
        ] {
            let mut lease = Lease::new();
            assert_eq!(lease.ask(Instant::ZERO, ONE, &command(GuidedKind::TakeOff)), Ok(()));
            for ms in (0..3_000).step_by(500) {
                let now = Instant::from_millis(ms);
                lease.alive(now, watcher);
                assert_eq!(lease.steer(now, watcher), Err(Refusal::Occupied(ONE)));
                assert_eq!(lease.holder(now), Some(ONE));
            }
            for ms in (3_000..10_000).step_by(500) {
                let now = Instant::from_millis(ms);
                lease.alive(now, watcher);
                assert_eq!(lease.steer(now, watcher), Err(Refusal::Occupied(ONE)), "its sticks may lie on a table");
                assert_eq!(lease.holder(now), None);
                assert!(!lease.is_sign_due(now), "the link is lost although another watches");
            }
            let now = Instant::from_secs(10);
            assert_eq!(lease.ask(now, watcher, &command(GuidedKind::Hold)), Ok(()), "who watched may take over");
            assert_eq!(lease.steer(now, watcher), Ok(()));
            assert!(lease.is_sign_due(now));
        }
    }

    #[test]
    fn a_commander_whose_connection_ends_makes_room_and_is_not_heard_any_more() {
        let mut lease = Lease::new();
        assert_eq!(lease.ask(Instant::ZERO, ONE, &command(GuidedKind::TakeOff)), Ok(()));
        lease.leave(|requester| requester.is_at(2));
        assert_eq!(lease.holder(Instant::ZERO), Some(ONE), "another has left");
        lease.leave(|requester| requester.is_at(1));
        for ms in (100..10_000).step_by(100) {
            let now = Instant::from_millis(ms);
            lease.alive(now, TWO);
            assert!(ms < 3_000 || !lease.is_sign_due(now), "{ms} ms");
        }
        let now = Instant::from_millis(10_000);
        assert_eq!(lease.ask(now, TWO, &command(GuidedKind::Hold)), Ok(()));
        assert_eq!(lease.holder(now), Some(TWO));

        let mut lease = Lease::new();
        assert_eq!(lease.ask(Instant::ZERO, ONE, &command(GuidedKind::TakeOff)), Ok(()));
        lease.leave(|requester| requester.is_at(1));
        assert_eq!(lease.ask(Instant::ZERO, TWO, &command(GuidedKind::Hold)), Ok(()), "at once");
    }

    #[test]
    fn signs_of_life_are_passed_on_ten_times_a_second_while_a_program_is_there() {
        let mut lease = Lease::new();
        assert!(!lease.is_sign_due(Instant::ZERO), "none was ever heard");
        lease.alive(Instant::ZERO, ONE);
        let due = (0..4_000).step_by(20).filter(|ms| lease.is_sign_due(Instant::from_millis(*ms))).count();
        assert_eq!(due, 30, "three seconds");
    }

    #[test]
    fn numbers_that_are_none_do_not_pass_but_a_kill_does() {
        let mut lease = Lease::new();
        for wrong in [f32::NAN, f32::INFINITY, 1_001.0] {
            let position = Vec3::new(0.0, wrong, 0.0);
            let asked = lease.ask(Instant::ZERO, ONE, &GuidedCommand { position, ..command(GuidedKind::WayPoint) });
            assert_eq!(asked, Err(Refusal::Range));
            let asked = lease.ask(Instant::ZERO, ONE, &GuidedCommand { speed: wrong, ..command(GuidedKind::Hold) });
            assert_eq!(asked, Err(Refusal::Range));
        }
        assert_eq!(lease, Lease::new());
        let kill = GuidedCommand { yaw: f32::NAN, ..command(GuidedKind::Kill) };
        assert_eq!(lease.ask(Instant::ZERO, ONE, &kill), Ok(()), "whatever else it says");
    }

    #[test]
    fn every_program_may_land_and_the_holder_stays() {
        let mut lease = Lease::new();
        assert_eq!(lease.ask(Instant::ZERO, ONE, &command(GuidedKind::TakeOff)), Ok(()));
        for kind in [GuidedKind::Land, GuidedKind::Disarm, GuidedKind::Kill] {
            assert_eq!(lease.ask(Instant::ZERO, Requester::Console, &command(kind)), Ok(()));
        }
        assert_eq!(lease.holder(Instant::ZERO), Some(ONE));
        lease.release();
        assert_eq!(lease.holder(Instant::ZERO), None);
    }
}
