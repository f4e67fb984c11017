//! Inertial samples that are garbage for a while.

use super::*;
use crate::losses::harness::{Lies, run_in};
use stampfly_types::math;
use stampfly_types::messages::{GuidedKind, ImuData};

/// Garbage: a register of `0x8000`, spikes to both ends, and bits at random.
const KINDS: [&str; 3] = ["the end of the range", "spikes", "bits at random"];

/// Garbage of this kind for so many samples, from when it begins on.
fn garbage(kind: usize, samples: u32) -> Lies {
    let (mut left, mut state) = (samples, 1u32);
    let mut random = move |size: f32| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (state as f32 / u32::MAX as f32 - 0.5) * 2.0 * size
    };
    let lie = move |_: f32, imu: &mut ImuData| {
        if left == 0 {
            return;
        }
        left -= 1;
        (imu.accel, imu.gyro) = match kind {
            0 => (Vec3::repeat(-78.45), Vec3::repeat(-34.9)),
            // The axes of the one in the place of the other's, in counts.
            1 => (imu.accel, imu.gyro + Vec3::new(0.0, if left % 2 == 0 { 30.0 } else { -30.0 }, 0.0)),
            _ => (Vec3::from_fn(|_| random(78.4)), Vec3::from_fn(|_| random(34.9))),
        };
    };
    Lies { imu: Some(Box::new(lie)), ..Lies::default() }
}

/// Hovers at 0.5 m, is given garbage for so many samples two seconds later, or as it lands, and
/// lands.
fn fly(kind: usize, samples: u32, seed: u64, landing: bool) -> (Seen, Instant) {
    let (since, note) = crate::losses::harness::instant();
    let seen = run_in(
        |_| {},
        garbage(kind, samples),
        seed,
        40.0,
        |mut hands| {
            Box::pin(async move {
                hands.take_off().await;
                for _ in 0..100 {
                    hands.command(GuidedKind::None);
                    hands.sleep(0.02).await;
                }
                if landing {
                    hands.command(GuidedKind::Land);
                    hands.sleep(0.3).await;
                }
                note.set(hands.clock.now());
                hands.lying.set(Some(hands.clock.now()));
                for _ in 0..100 {
                    hands.command(GuidedKind::None);
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
    (seen, since.get())
}

#[test]
fn a_twentieth_of_a_second_is_bridged() {
    let cuts = stampfly_mode::decision::CUT;
    for seed in seeds() {
        for (kind, name) in KINDS.into_iter().enumerate() {
            for samples in thorough(vec![4, 20], vec![3, 4, 6, 10, 14, 20]) {
                for landing in [false, true] {
                    let (seen, _) = fly(kind, samples, seed, landing);
                    let what = format!("{samples} samples, {name}, landing {landing}, seed {seed}");
                    let accused = seen.accused(cuts, Instant::MAX);
                    println!("{what}: {:?}, touches at {:.2} m/s", accused.map(|(all, _)| all), seen.touch_speed());
                    assert!(accused.is_none(), "{what}: {accused:?}");
                    assert!(seen.ends_well(0.6), "{what}");
                }
            }
        }
    }
}

/// What lasts longer than a twentieth of a second stops the motors, in a tenth of one.
#[test]
fn a_tenth_of_a_second_stops_the_motors() {
    for seed in seeds() {
        for (kind, name) in KINDS.into_iter().enumerate() {
            let (seen, since) = fly(kind, 400, seed, false);
            let took = seen.motors_off_after(since).seconds();
            println!("{name}, seed {seed}: {took} s");
            // Twenty samples, less what the first of them was late.
            assert!((0.045..0.1).contains(&took), "{name}, seed {seed}: {took} s");
        }
    }
}

/// While it leans at the end of its stick, in STABILIZE.
#[test]
fn a_twentieth_of_a_second_in_brisk_flight() {
    for seed in seeds() {
        for (kind, name) in KINDS.into_iter().enumerate() {
            let seen = run_in(
                |_| {},
                garbage(kind, 20),
                seed,
                40.0,
                |mut hands| {
                    Box::pin(async move {
                        rise(&mut hands, 3.0).await;
                        let sticks = PilotInput { mode: FlightMode::Stabilize, roll: 0.8, ..STICKS };
                        hold(&mut hands, 0.06, 3.0, sticks).await;
                        hands.lying.set(Some(hands.clock.now()));
                        hold(&mut hands, 0.3, 3.0, sticks).await;
                        hold(&mut hands, 0.4, 3.0, PilotInput { roll: -0.8, ..sticks }).await;
                        hold(&mut hands, 1.5, 3.0, PilotInput { roll: 0.0, ..sticks }).await;
                        hands.leave();
                        hands.sleep(0.1).await;
                    })
                },
            );
            let what = format!("{name}, seed {seed}");
            let accused = seen.accused(stampfly_mode::decision::CUT, seen.touches_after(1.0));
            assert!(accused.is_none(), "{what}: {accused:?}");
            let tilted = seen.truths.iter().map(|(_, truth)| (truth.attitude * Vec3::z()).z).fold(1.0, f32::min);
            let leans = math::acos(tilted).to_degrees();
            println!("{what}: leans by {leans:.0} degrees");
            assert!(tilted > 0.7, "{what}: leans by {leans} degrees");
        }
    }
}
