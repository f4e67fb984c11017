//! A flip asks for room above, and ends level whatever fails in it.

use super::*;
use crate::losses::harness::{Lies, instant, run_in};
use stampfly_types::messages::{FlowData, GuidedKind, ImuData, TofData};

/// Takes off to this height, turns over to the left, and lands four seconds later. So long after
/// the flip began, s, the sensors begin to lie; range finder and barometer fall silent when `dead`.
fn flip(seed: u64, height: f32, lies: Lies, after: f32, dead: bool) -> (Seen, Option<Instant>) {
    let (since, note) = instant();
    let seen = run_in(
        |_| {},
        lies,
        seed,
        50.0,
        |mut hands| {
            Box::pin(async move {
                hands.wait_for(|frame| frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty()).await;
                hands.command(GuidedKind::Arm);
                hands.wait_for(|frame| frame.armed).await;
                hands.command_at(GuidedKind::TakeOff, height);
                hands.wait_for(|frame| frame.phase == FlightPhase::Flying).await;
                for _ in 0..75 {
                    hands.command(GuidedKind::None);
                    hands.sleep(0.02).await;
                }
                hands.command(GuidedKind::FlipLeft);
                for n in 0..200 {
                    hands.command(GuidedKind::None);
                    if n * 20 >= (1e3 * after) as i32 && hands.lying.get().is_none() {
                        note.set(hands.clock.now());
                        hands.lying.set(Some(hands.clock.now()));
                        hands.height_silent.set(dead);
                    }
                    hands.sleep(0.02).await;
                }
                hands.command(GuidedKind::Land);
                hands.wait_for(|frame| !frame.armed).await;
                hands.sleep(1.0).await;
                hands.leave();
                hands.sleep(0.1).await;
            })
        },
    );
    let began = seen.entered(FlightPhase::Flip, Instant::ZERO);
    (seen, began.filter(|_| since.get() > Instant::ZERO))
}

type ImuLie = (&'static str, fn(f32, &mut ImuData));
type TofLie = (&'static str, fn(f32, &mut TofData));
type FlowLie = (&'static str, fn(f32, &mut FlowData));

// What a gyro is wrong by while it is all that tells the attitude stays in the attitude: a scale that
// changes by a tenth then is 36 degrees. `docs/safety.md` has how those end.
const IMU: [ImuLie; 1] = [("accel z -4", |_, imu| imu.accel.z -= 4.0)];
const TOF: [TofLie; 3] = [
    ("half the range", |_, tof| tof.distance *= 0.5),
    ("no range", |_, tof| (tof.distance, tof.valid) = (0.0, false)),
    ("3 cm", |_, tof| (tof.distance, tof.valid) = (0.03, true)),
];
const FLOW: [FlowLie; 1] = [("a dark floor", |_, flow| {
    (flow.delta_x, flow.delta_y, flow.quality, flow.valid) = (0.0, 0.0, 0, false);
})];

/// It touches the ground as after any landing, and near its place.
fn ends(what: &str, seed: u64, after: f32, lies: Lies, dead: bool, wrong: &mut Vec<String>) {
    let (seen, began) = flip(seed, 1.5, lies, after, dead);
    let what = format!("{what} after {after} s, seed {seed}");
    let began = began.expect("it turns over");
    let highest = seen.highest(Instant::ZERO);
    let drift = seen.drift(began, Instant::MAX);
    let alerts = seen.accused(CONVICTS, Instant::MAX).map(|(all, _)| names(all));
    let speed = seen.touch_speed();
    let well = seen.ends_well(1.0) && drift < 5.0 && highest < 4.0;
    println!(
        "{} {what}: to {highest:.2} m, {drift:.2} m away, touches at {speed:.2} m/s, {alerts:?}",
        if well { "  " } else { "!!" }
    );
    if !well {
        wrong.push(what);
    }
}

#[test]
fn whatever_fails_beside_the_gyro_during_a_flip_it_ends_level() {
    let mut wrong = Vec::new();
    for seed in 1..=crate::thorough::flights(1, 6) {
        for after in thorough(vec![0.1, 0.3, 0.5], vec![0.06, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0]) {
            for (what, lie) in IMU {
                let lies = Lies { imu: Some(Box::new(lie)), ..Lies::default() };
                ends(what, seed, after, lies, false, &mut wrong);
            }
            for (what, lie) in TOF {
                let lies = Lies { tof: Some(Box::new(lie)), ..Lies::default() };
                ends(what, seed, after, lies, false, &mut wrong);
            }
            for (what, lie) in FLOW {
                let lies = Lies { flow: Some(Box::new(lie)), ..Lies::default() };
                ends(what, seed, after, lies, false, &mut wrong);
            }
            ends("a dead bus", seed, after, Lies::default(), true, &mut wrong);
        }
    }
    none(&wrong);
}

/// A flip rises by up to 0.6 m. Where the vehicle may not fly as high it stays as it is, and says
/// why.
#[test]
fn without_room_above_it_stays_as_it_is() {
    let (seen, began) = flip(1, 2.6, Lies::default(), 9.0, false);
    assert_eq!(began, None);
    assert_eq!(seen.entered(FlightPhase::Flip, Instant::ZERO), None, "0.4 m below the highest place");
    assert!(seen.ends_well(0.5));
}
