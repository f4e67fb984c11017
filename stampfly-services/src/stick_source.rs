//! Whose sticks reach the vehicle: those of one source at a time.
//!
//! Two transmitters, or a transmitter and a page, send frames at the same time, fifty times a second
//! each. If the frames of both reached the mode machine, one arm switch would turn on and off with
//! every frame.
//!
//! | the vehicle | whose sticks are passed on |
//! |---|---|
//! | is disarmed | those of the source that came first, until it is silent, or another's arm switch is turned on |
//! | is armed | those of the requester that has the lease; if none has it, those of a requester whose arm switch is on, which takes it |
//! | is armed, and a program commands | also the paired transmitter's: its pilot takes over by acting, as the mode machine decides, and has the lease then |
//!
//! A kill is passed on from every source. An arm switch that is turned off in a frame that is not
//! passed on is a command to land.

use crate::lease::{Lease, SILENCE};
use crate::refusal::{Refusal, Requester};
use stampfly_types::Instant;
use stampfly_types::messages::{CommandSource, FlightStatus, PilotInput};

/// Other sources whose arm switches are followed.
const OTHERS: usize = 3;
/// A stick that is so far out of its middle is held by a hand, share.
const HELD: f32 = 0.1;

/// What becomes of a frame of sticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Verdict {
    /// It is passed on, and flies the vehicle.
    Flies,
    /// It is passed on, and the mode machine decides.
    Passes,
    /// It is not passed on, because of this requester.
    Refused(Requester),
    /// The same, and it asks for a landing.
    Lands(Requester),
}

/// A source of sticks, and when its newest frame came.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Source {
    requester: Requester,
    heard: Instant,
    arm: bool,
}

/// Whose sticks reach the vehicle.
#[derive(Clone, Debug, Default)]
pub(crate) struct StickSource {
    /// Whose newest frame was passed on.
    source: Option<Source>,
    /// Those whose frames were not.
    others: [Option<Source>; OTHERS],
}

impl StickSource {
    pub const fn new() -> Self {
        Self { source: None, others: [None; OTHERS] }
    }

    /// Looks at a frame, and takes the lease for its requester if it flies the vehicle.
    pub fn judge(
        &mut self,
        now: Instant,
        requester: Requester,
        input: &PilotInput,
        status: &FlightStatus,
        lease: &mut Lease,
    ) -> Verdict {
        let frame = Source { requester, heard: now, arm: input.arm };
        let before = self.others.iter().flatten().find(|other| other.requester == requester).map(|other| other.arm);
        let rival = self.source.filter(|source| source.requester != requester && now.since(source.heard) < SILENCE);
        let (rises, falls) = (before == Some(false) && input.arm, before == Some(true) && !input.arm);
        let refused = match (status.armed, rival) {
            (true, rival) => self.refusal_in_flight(&frame, status, rival, lease),
            // Its arm switch was seen off: one that is on when its frames begin must not arm.
            (false, Some(rival)) if !rises || rival.arm => Some(rival.requester),
            (false, _) => lease.holder(now).filter(|holder| *holder != requester),
        };
        if let Some(holder) = refused {
            self.put_aside(frame);
            return if falls && status.armed { Verdict::Lands(holder) } else { Verdict::Refused(holder) };
        }
        self.forget(requester);
        self.source = Some(frame);
        match requester {
            // What it does is the mode machine's decision. It has the lease as long as a hand holds the sticks, and a
            // program may lead again when it has let go.
            Requester::Transmitter if status.armed => {
                let is_held =
                    [input.roll, input.pitch, input.yaw, input.throttle].iter().any(|stick| stick.abs() > HELD);
                let flies = status.commander == CommandSource::Pilot;
                if flies && (is_held || status.mode.is_manual() || lease.commander().is_none()) {
                    lease.take(now, requester);
                }
                if flies { Verdict::Flies } else { Verdict::Passes }
            }
            _ if status.armed && lease.taker() == Some(requester) => Verdict::Flies,
            _ => Verdict::Passes,
        }
    }

    /// Who keeps these sticks from an armed vehicle.
    fn refusal_in_flight(
        &self,
        frame: &Source,
        status: &FlightStatus,
        rival: Option<Source>,
        lease: &mut Lease,
    ) -> Option<Requester> {
        let Source { requester, heard: now, arm } = *frame;
        match lease.taker() {
            Some(holder) if holder != requester => {
                // While another's sticks fly, or have flown it last, the transmitter's would keep its flight going.
                let is_source = self.source.is_some_and(|source| source.requester == requester);
                let is_heard = is_source || (status.commander != CommandSource::Pilot && rival.is_none());
                (requester != Requester::Transmitter || !is_heard).then_some(holder)
            }
            None if rival.is_some() => rival.map(|rival| rival.requester),
            _ if requester == Requester::Transmitter => None,
            // A program has armed it, and is about to command. Sticks that rest with the arm switch off take no lease.
            None if !arm => None,
            _ => match lease.steer(now, requester) {
                Err(Refusal::Occupied(holder)) => Some(holder),
                _ => None,
            },
        }
    }

    /// Notes a frame that is not passed on, in the place of the requester's last one, a free place, or the oldest frame's.
    fn put_aside(&mut self, frame: Source) {
        let heard = |other: &Option<Source>| match other {
            Some(other) if other.requester == frame.requester => None,
            other => Some(other.map(|other| other.heard)),
        };
        // `None` is less than any instant.
        if let Some(place) = self.others.iter_mut().min_by_key(|other| heard(other)) {
            *place = Some(frame);
        }
    }

    fn forget(&mut self, requester: Requester) {
        for other in &mut self.others {
            other.take_if(|other| other.requester == requester);
        }
    }
}
