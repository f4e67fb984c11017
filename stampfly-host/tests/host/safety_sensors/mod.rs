//! What the whole vehicle does when a sensor lies in flight.

use crate::losses::harness::{Lies, Seen, run_in};
use crate::thorough::thorough;
use stampfly_sim::SimulationConfig;
use stampfly_types::messages::{Alerts, FlightPhase, FlowData, GuidedKind, ImuData, TofData, Validity};
use stampfly_types::{Duration, Instant, Vec3};
use std::cell::Cell;
use std::rc::Rc;

mod flows;
mod inertial;
mod nominal;
mod ranges;

fn seeds() -> std::ops::RangeInclusive<u64> {
    1..=thorough(1, 3)
}

/// A vehicle whose motors have stopped is watched for so long, s.
const WATCHED: f32 = 3.0;

/// When a flight's sensors begin to lie.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Onset {
    /// At power-on.
    PowerOn,
    /// This long after the phase was entered.
    After(FlightPhase, f32),
}

/// Takes off, hovers, lands; the sensors lie from `onset` on. Returns that instant.
fn fly(seed: u64, seconds: f32, onset: Onset, lies: Lies) -> (Seen, Instant) {
    fly_in(|_| {}, seed, seconds, onset, lies)
}

/// The same in other surroundings.
fn fly_in(
    surroundings: impl FnOnce(&mut SimulationConfig),
    seed: u64,
    seconds: f32,
    onset: Onset,
    lies: Lies,
) -> (Seen, Instant) {
    let since = Rc::new(Cell::new(Instant::ZERO));
    let note = since.clone();
    let seen = run_in(surroundings, lies, seed, seconds, |mut hands| {
        Box::pin(async move {
            if onset == Onset::PowerOn {
                hands.lying.set(Some(hands.clock.now()));
            }
            hands.wait_for(|frame| frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty()).await;
            hands.command(GuidedKind::Arm);
            let mut wait = 400.0;
            let mut phase = FlightPhase::IdleGround;
            let (mut asked, mut stands) = (0, 0.0);
            loop {
                hands.sleep(0.02).await;
                wait += 0.02;
                let frame = hands.telemetry();
                if frame.phase != phase {
                    (phase, wait) = (frame.phase, 0.0);
                }
                if let Onset::After(of, delay) = onset
                    && of == phase
                    && wait >= delay
                    && hands.lying.get().is_none()
                {
                    hands.lying.set(Some(hands.clock.now()));
                    note.set(hands.clock.now());
                }
                let kind = match phase {
                    FlightPhase::Armed if asked == 0 && wait > 0.6 => GuidedKind::TakeOff,
                    FlightPhase::Flying if asked == 1 && wait > 14.0 => GuidedKind::Land,
                    _ => GuidedKind::None,
                };
                asked += u32::from(kind != GuidedKind::None);
                hands.command(kind);
                stands = if asked > 0 && !frame.armed { stands + 0.02 } else { 0.0 };
                if stands > WATCHED {
                    hands.leave();
                }
            }
        })
    });
    (seen, since.get())
}

impl Seen {
    /// Seconds from `since` until this alert.
    fn alert_after(&self, alert: Alerts, since: Instant) -> Option<f32> {
        self.alerts
            .iter()
            .find(|(at, active)| *at >= since && active.contains(alert))
            .map(|(at, _)| at.since(since).seconds())
    }
}
