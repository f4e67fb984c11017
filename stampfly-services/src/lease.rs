//! One program at a time commands a vehicle.
//!
//! Several may be connected: a ground station that watches, a script that flies. The first that asks for anything has the lease
//! as long as it is heard; the others are told who has it. A kill is everybody's at any time, and so is landing. When the holder falls
//! silent, the lease is over: the vehicle's own failsafe does the rest, and another program may take it up again.
//! What a pilot's sticks do to a program's commands is the mode machine's business (`stampfly-mode`): they win.

use crate::refusal::{Refusal, Seat};
use stampfly_types::messages::{GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Instant};

/// A holder who was not heard for this long has lost it. Ground stations send a heartbeat a second, and the protocol's custom is
/// to allow three to five to be lost.
pub const SILENCE: Duration = Duration::from_secs(3);
/// A vehicle without a pilot takes a link for lost after half a second: signs of life are passed on so often.
pub const LIFE: Duration = Duration::from_millis(100);
/// Largest number in a command: metres, metres a second, radians, seconds. A vehicle of this kind does not go farther.
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
/// use stampfly_services::{Lease, Refusal, Seat};
/// use stampfly_types::{Instant, messages::{GuidedCommand, GuidedKind}};
/// let command = |kind| GuidedCommand { kind, ..Default::default() };
/// let mut lease = Lease::new();
/// assert_eq!(lease.ask(Instant::ZERO, Seat::Tello, &command(GuidedKind::Arm)), Ok(()));
/// let refused = lease.ask(Instant::ZERO, Seat::Page, &command(GuidedKind::WayPoint));
/// assert_eq!(refused, Err(Refusal::Occupied(Seat::Tello)));
/// assert_eq!(lease.ask(Instant::ZERO, Seat::Page, &command(GuidedKind::Kill)), Ok(()));
/// // Silent for three seconds: somebody else's turn.
/// assert_eq!(lease.ask(Instant::from_secs(3), Seat::Page, &command(GuidedKind::WayPoint)), Ok(()));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lease {
    holder: Option<Seat>,
    /// Of the holder; without one, of anybody.
    heard: Option<Instant>,
    /// When a sign of life was passed on.
    passed: Option<Instant>,
}

impl Lease {
    /// Nobody commands.
    #[must_use]
    pub const fn new() -> Self {
        Self { holder: None, heard: None, passed: None }
    }

    /// Who commands.
    #[must_use]
    pub fn holder(&self, now: Instant) -> Option<Seat> {
        self.holder.filter(|_| self.is_heard(now))
    }

    /// May this be passed on to the vehicle? Whoever asks for more than a kill has the lease then.
    ///
    /// # Errors
    /// When another program has it, or a number is none.
    pub fn ask(&mut self, now: Instant, seat: Seat, command: &GuidedCommand) -> Result<(), Refusal> {
        if matches!(command.kind, GuidedKind::Kill) {
            return Ok(());
        }
        if !is_sane(command) {
            return Err(Refusal::Range);
        }
        match self.holder(now).filter(|holder| *holder != seat) {
            // Whoever has it goes on commanding, to a vehicle that lands.
            Some(_) if matches!(command.kind, GuidedKind::Land | GuidedKind::Disarm) => Ok(()),
            Some(holder) => Err(Refusal::Occupied(holder)),
            None => {
                (self.holder, self.heard) = (Some(seat), Some(now));
                Ok(())
            }
        }
    }

    /// Somebody is there. While a vehicle is commanded, only its commander's signs of life count, also after a silence: the
    /// vehicle's failsafe has to notice that nobody does, however many watch. Of one that nobody commands, anybody's count.
    pub fn alive(&mut self, now: Instant, seat: Seat) {
        if self.holder.is_none_or(|holder| holder == seat) {
            self.heard = Some(now);
        }
    }

    /// The vehicle stands with its motors off: nobody has anything to hold.
    pub fn release(&mut self) {
        self.holder = None;
    }

    /// Is a sign of life to be passed on to the vehicle now? Ask at least every [`LIFE`].
    pub fn is_sign_due(&mut self, now: Instant) -> bool {
        let due = self.is_heard(now) && self.passed.is_none_or(|passed| now.since(passed) >= LIFE);
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

    fn command(kind: GuidedKind) -> GuidedCommand {
        GuidedCommand { kind, ..Default::default() }
    }

    #[test]
    fn a_watcher_does_not_keep_the_lease_of_a_silent_commander() {
        let mut lease = Lease::new();
        assert_eq!(lease.ask(Instant::ZERO, Seat::Tello, &command(GuidedKind::TakeOff)), Ok(()));
        for ms in (0..3_000).step_by(500) {
            let now = Instant::from_millis(ms);
            lease.alive(now, Seat::Mavlink(255));
            assert_eq!(lease.holder(now), Some(Seat::Tello));
        }
        for ms in (3_000..10_000).step_by(500) {
            let now = Instant::from_millis(ms);
            lease.alive(now, Seat::Mavlink(255));
            assert_eq!(lease.holder(now), None);
            assert!(!lease.is_sign_due(now), "the link is lost although somebody watches");
        }
        let now = Instant::from_secs(10);
        assert_eq!(lease.ask(now, Seat::Mavlink(255), &command(GuidedKind::Hold)), Ok(()), "who watched may take over");
        assert!(lease.is_sign_due(now));
    }

    #[test]
    fn signs_of_life_are_passed_on_ten_times_a_second_while_somebody_is_there() {
        let mut lease = Lease::new();
        assert!(!lease.is_sign_due(Instant::ZERO), "nobody was ever heard");
        lease.alive(Instant::ZERO, Seat::Page);
        let due = (0..4_000).step_by(20).filter(|ms| lease.is_sign_due(Instant::from_millis(*ms))).count();
        assert_eq!(due, 30, "three seconds");
    }

    #[test]
    fn numbers_that_are_none_do_not_pass_but_a_kill_does() {
        let mut lease = Lease::new();
        for wrong in [f32::NAN, f32::INFINITY, 1_001.0] {
            let position = Vec3::new(0.0, wrong, 0.0);
            let asked =
                lease.ask(Instant::ZERO, Seat::Page, &GuidedCommand { position, ..command(GuidedKind::WayPoint) });
            assert_eq!(asked, Err(Refusal::Range));
            let asked =
                lease.ask(Instant::ZERO, Seat::Page, &GuidedCommand { speed: wrong, ..command(GuidedKind::Hold) });
            assert_eq!(asked, Err(Refusal::Range));
        }
        assert_eq!(lease, Lease::new());
        let kill = GuidedCommand { yaw: f32::NAN, ..command(GuidedKind::Kill) };
        assert_eq!(lease.ask(Instant::ZERO, Seat::Page, &kill), Ok(()), "whatever else it says");
    }

    #[test]
    fn anybody_may_land_and_the_holder_stays() {
        let mut lease = Lease::new();
        assert_eq!(lease.ask(Instant::ZERO, Seat::Page, &command(GuidedKind::TakeOff)), Ok(()));
        for kind in [GuidedKind::Land, GuidedKind::Disarm, GuidedKind::Kill] {
            assert_eq!(lease.ask(Instant::ZERO, Seat::Console, &command(kind)), Ok(()));
        }
        assert_eq!(lease.holder(Instant::ZERO), Some(Seat::Page));
        lease.release();
        assert_eq!(lease.holder(Instant::ZERO), None);
    }
}
