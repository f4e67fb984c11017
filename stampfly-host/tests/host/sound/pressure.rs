//! Pressure that is not the height's, beside range, flow and inertial data that agree.

use super::*;
use crate::losses::harness::{Lies, instant, run_in};
use stampfly_types::math;
use stampfly_types::messages::{BaroData, GuidedKind};

/// What the barometer reads too high by, m, so many seconds after it began.
type Error = fn(f32, f32) -> f32;

/// A door opens: within a second, and stays so.
const OPENS: Error = |size, time| size * (time / 0.8).min(1.0);
/// A door opens and closes.
const SWINGS: Error = |size, time| size * (1.0 - (2.0 * time - 1.0).abs()).max(0.0);
/// The same, slower: open for a second.
const STAYS_A_SECOND: Error = |size, time| size * ((time / 0.3).min((1.6 - time) / 0.3)).clamp(0.0, 1.0);
/// A fan, whose flow of air is unsteady.
const FAN: Error = |size, time| size * (math::sin(2.1 * time) + 0.5 * math::sin(5.3 * time));
/// Propellers press or suck as soon as they turn.
const PROPELLERS: Error = |size, time| size * (1.0 - math::exp(-time / 0.1));

/// When it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Onset {
    PowerOn,
    Spool,
    TakeOff,
    Climbs,
    Hover,
    Landing,
}

fn fly(seed: u64, onset: Onset, error: Error, size: f32) -> (Seen, Instant) {
    let lie = move |time: f32, baro: &mut BaroData| {
        let off = error(size, time);
        baro.altitude += off;
        baro.pressure -= 12.0 * off;
    };
    let (since, note) = instant();
    let lies = Lies { baro: Some(Box::new(lie)), ..Lies::default() };
    let seen = run_in(
        |_| {},
        lies,
        seed,
        60.0,
        |mut hands| {
            Box::pin(async move {
                let begin = |hands: &Hands<'_>, now: Onset| {
                    if onset == now {
                        note.set(hands.clock.now());
                        hands.lying.set(Some(hands.clock.now()));
                    }
                };
                begin(&hands, Onset::PowerOn);
                hands.wait_for(|frame| frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty()).await;
                hands.command(GuidedKind::Arm);
                hands.wait_for(|frame| frame.armed).await;
                hands.command(GuidedKind::TakeOff);
                begin(&hands, Onset::Spool);
                hands.wait_for(|frame| frame.phase == FlightPhase::TakeOff).await;
                hands.sleep(0.25).await;
                begin(&hands, Onset::TakeOff);
                while -hands.truth().position.z < 0.25 {
                    hands.command(GuidedKind::None);
                    hands.sleep(0.02).await;
                }
                begin(&hands, Onset::Climbs);
                hands.wait_for(|frame| frame.phase == FlightPhase::Flying).await;
                for n in 0..400 {
                    if n == 200 {
                        begin(&hands, Onset::Hover);
                    }
                    hands.command(GuidedKind::None);
                    hands.sleep(0.02).await;
                }
                hands.command(GuidedKind::Land);
                hands.sleep(0.3).await;
                begin(&hands, Onset::Landing);
                hands.wait_for(|frame| !frame.armed).await;
                hands.sleep(1.0).await;
                hands.leave();
                hands.sleep(0.1).await;
            })
        },
    );
    (seen, since.get())
}

/// What is wrong about a flight: an alert, or a height that is not the range's.
fn complaint(what: &str, seed: u64, onset: Onset, error: Error, size: f32) -> Option<String> {
    let (seen, since) = fly(seed, onset, error, size);
    let accused = seen.accused(CONVICTS, Instant::MAX).map(|(all, height)| (names(all), height));
    let highest = seen.highest(Instant::ZERO);
    let drift = seen.drift(since, Instant::MAX);
    let landing = seen.entered(FlightPhase::Landing, Instant::ZERO).expect("it lands");
    let lasts = seen.entered(FlightPhase::IdleGround, landing).map(|stands| stands.since(landing).seconds());
    let ends = format!(
        "{what} {size} m, {onset:?}, seed {seed}: {accused:?}, to {highest:.2} m, drift {drift:.2} m, lands within {lasts:?}"
    );
    println!("{ends}");
    let quiet = accused.is_none() && highest < 0.75 && drift < 1.0;
    let lands = seen.ends_well(0.5) && lasts.is_some_and(|seconds| seconds < 7.0);
    (!(quiet && lands)).then_some(ends)
}

const MOMENTS: [Onset; 5] = [Onset::Spool, Onset::TakeOff, Onset::Climbs, Onset::Hover, Onset::Landing];

#[test]
fn doors() {
    let mut wrong = Vec::new();
    for seed in seeds() {
        for onset in MOMENTS {
            for size in [1.5, -1.5] {
                wrong.extend(complaint("a door that opens", seed, onset, OPENS, size));
                wrong.extend(complaint("a door that swings", seed, onset, SWINGS, size));
                wrong.extend(complaint("a door that is open for a second", seed, onset, STAYS_A_SECOND, size));
            }
        }
    }
    none(&wrong);
}

#[test]
fn fans() {
    let mut wrong = Vec::new();
    for seed in seeds() {
        for onset in [Onset::PowerOn, Onset::TakeOff, Onset::Hover, Onset::Landing] {
            for size in [0.4, 0.7] {
                wrong.extend(complaint("a fan", seed, onset, FAN, size));
            }
        }
    }
    none(&wrong);
}

#[test]
fn propellers_that_press_or_suck() {
    let mut wrong = Vec::new();
    for seed in 1..=2 * crate::thorough::flights(2, 4) {
        for size in [0.3, -0.3, 0.6, -0.6] {
            wrong.extend(complaint("propellers", seed, Onset::Spool, PROPELLERS, size));
        }
    }
    none(&wrong);
}
