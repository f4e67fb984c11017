//! Who may do what, on the whole vehicle: a pilot who falls silent, transmitters that are only heard, switches that bounce,
//! sources that speak for each other. Every test is named after the defect that it keeps out.

use crate::losses::harness::{STICKS, Seen, climb, instant, run, send};
use crate::thorough::thorough;
use stampfly_types::messages::{ArmBlocks, CommandSource, FlightMode, FlightPhase, GuidedKind, PilotInput};
use stampfly_types::{Duration, Instant};

fn seeds() -> std::ops::RangeInclusive<u64> {
    1..=thorough(1, 3)
}

/// Speed with which the vehicle first touches the ground after this instant, m/s; it has to end there, disarmed.
fn touches(what: &str, seen: &Seen, since: Instant) -> f32 {
    let (mode, truth) = seen.end();
    assert!(!mode.armed && truth.contact, "{what}: ends {mode:?} at {} m", -truth.position.z);
    let mut before = 0.0f32;
    for (_, truth) in seen.truths.iter().filter(|(at, _)| *at >= since) {
        if truth.contact {
            return before;
        }
        before = truth.velocity.z;
    }
    panic!("{what}: never touched the ground");
}

/// The mode in force at an instant.
fn at(seen: &Seen, instant: Instant) -> (FlightPhase, FlightMode, CommandSource) {
    let (_, status) = seen.modes.iter().rfind(|(at, _)| *at <= instant).expect("it ran");
    (status.phase, status.mode, status.commander)
}

#[test]
fn d4_a_pilot_lost_in_stabilize_or_acro_is_levelled_and_landed() {
    for mode in [FlightMode::Stabilize, FlightMode::Acro] {
        for seed in seeds() {
            let (since, note) = instant();
            let seen = run(seed, 40.0, |mut hands| {
                Box::pin(async move {
                    climb(&mut hands, 2.0).await;
                    // About the throttle that carries it, and a little lean.
                    let flown = PilotInput { mode, arm: true, throttle: 0.55, pitch: 0.1, ..STICKS };
                    // The mode begins when the stick has passed it.
                    send(&mut hands, 0.15, PilotInput { throttle: 0.65, ..flown }).await;
                    send(&mut hands, 0.1, flown).await;
                    note.set(hands.frame(&flown));
                })
            });
            let what = format!("{mode:?}, seed {seed}");
            let since = since.get();
            assert_eq!(at(&seen, since).1, mode, "{what}");
            assert_eq!(at(&seen, since + Duration::from_millis(600)).1, FlightMode::PosHold, "{what}");
            let landing = seen.entered(FlightPhase::Landing, since).expect("it lands").since(since).seconds();
            assert!((3.4..3.7).contains(&landing), "{what}: after {landing} s");
            let speed = touches(&what, &seen, since);
            assert!(speed < 0.6, "{what}: {speed} m/s");
        }
    }
}

/// Height that is lost between these instants, m.
fn lost_height(seen: &Seen, since: Instant, until: Instant) -> f32 {
    let meanwhile = seen.truths.iter().filter(|(at, _)| (since..=until).contains(at));
    let heights = meanwhile.map(|(_, truth)| -truth.position.z);
    let (mut first, mut lowest) = (None, f32::INFINITY);
    for height in heights {
        first.get_or_insert(height);
        lowest = lowest.min(height);
    }
    first.expect("it flew on") - lowest
}

/// A throttle with a spring rests in its centre. In STABILIZE and ACRO that is no thrust.
#[test]
fn a_switch_to_a_manual_mode_with_the_stick_in_its_centre_costs_no_height() {
    for seed in 1..=thorough(2, 40) {
        for (from, to) in [
            (FlightMode::PosHold, FlightMode::Stabilize),
            (FlightMode::AltHold, FlightMode::Acro),
            (FlightMode::AltHold, FlightMode::Stabilize),
            (FlightMode::PosHold, FlightMode::Acro),
        ] {
            // At 0.5 m/s: 0.5 m of the take-off, to 2.9 m.
            let climbs = (seed % 7) as f32 * 0.8;
            let chatters = seed % 2 == 0;
            let (since, note) = instant();
            let seen = run(seed, 40.0, |mut hands| {
                Box::pin(async move {
                    climb(&mut hands, climbs).await;
                    let flown = PilotInput { mode: from, arm: true, ..STICKS };
                    send(&mut hands, 1.0, flown).await;
                    note.set(hands.clock.now());
                    for _ in 0..if chatters { 10 } else { 0 } {
                        send(&mut hands, 0.1, PilotInput { mode: to, ..flown }).await;
                        send(&mut hands, 0.1, flown).await;
                    }
                    send(&mut hands, 3.0, PilotInput { mode: to, ..flown }).await;
                    hands.leave();
                })
            });
            let until = since.get() + Duration::from_seconds(if chatters { 4.9 } else { 2.9 });
            let lost = lost_height(&seen, since.get(), until);
            assert!(lost <= 0.3, "{from:?} to {to:?}, seed {seed}: {lost} m");
            let (phase, mode, _) = at(&seen, until);
            assert_eq!((phase, mode), (FlightPhase::Flying, FlightMode::AltHold), "{from:?} to {to:?}, seed {seed}");
        }
    }
}

/// The switch is turned so many seconds after the take-off began, and stays there.
fn chosen_on_the_way_up(seed: u64, mode: FlightMode, after: f32, throttle: f32) -> (Seen, Instant) {
    let (since, note) = instant();
    let seen = run(seed, 20.0, |mut hands| {
        Box::pin(async move {
            let rest = PilotInput { throttle, ..STICKS };
            let flown = PilotInput { arm: true, ..rest };
            while hands.telemetry().phase != FlightPhase::IdleGround || !hands.telemetry().blocks.is_empty() {
                send(&mut hands, 0.1, rest).await;
            }
            while hands.telemetry().phase != FlightPhase::TakeOff {
                send(&mut hands, 0.02, flown).await;
            }
            send(&mut hands, after, flown).await;
            note.set(hands.clock.now());
            send(&mut hands, 5.0, PilotInput { mode, ..flown }).await;
            hands.leave();
        })
    });
    (seen, since.get())
}

/// With the stick in its centre, and with one that stayed at its lowest.
#[test]
fn a_manual_mode_that_is_chosen_on_the_way_up_does_not_drop_the_vehicle() {
    for seed in 1..=thorough(2, 40) {
        for mode in [FlightMode::Stabilize, FlightMode::Acro] {
            for after in [0.0, 0.4, 0.8, 1.5] {
                for throttle in [0.0, -1.0] {
                    let (seen, since) = chosen_on_the_way_up(seed, mode, after, throttle);
                    let until = since + Duration::from_seconds(4.9);
                    let what = format!("{mode:?} after {after} s, throttle {throttle}, seed {seed}");
                    let (mut highest, mut lost) = (0.0f32, 0.0f32);
                    for (_, truth) in seen.truths.iter().filter(|(at, _)| (since..=until).contains(at)) {
                        highest = highest.max(-truth.position.z);
                        lost = lost.max(highest + truth.position.z);
                    }
                    println!("{what}: to {highest:.2} m, {lost:.2} m lost");
                    assert!(highest > 0.4, "{what}: to {highest} m");
                    assert!(lost <= 0.3, "{what}: {lost} m");
                    let (phase, mode, _) = at(&seen, until);
                    assert_eq!((phase, mode), (FlightPhase::Flying, FlightMode::AltHold), "{what}");
                }
            }
        }
    }
}

/// Once the stick has passed the hover the vehicle is the pilot's.
#[test]
fn the_pilot_has_the_throttle_when_the_stick_has_passed_the_hover() {
    for seed in 1..=thorough(1, 10) {
        let (since, note) = instant();
        let seen = run(seed, 20.0, |mut hands| {
            Box::pin(async move {
                climb(&mut hands, 1.0).await;
                let flown = PilotInput { mode: FlightMode::Stabilize, arm: true, ..STICKS };
                send(&mut hands, 0.5, flown).await;
                send(&mut hands, 0.2, PilotInput { throttle: 0.8, ..flown }).await;
                note.set(hands.clock.now());
                send(&mut hands, 0.8, PilotInput { throttle: 0.8, ..flown }).await;
                hands.leave();
            })
        });
        assert_eq!(at(&seen, since.get()).1, FlightMode::Stabilize, "seed {seed}");
        let climbs = seen.truths.iter().filter(|(at, _)| *at >= since.get()).map(|(_, truth)| -truth.velocity.z);
        let fastest = climbs.fold(0.0f32, f32::max);
        assert!(fastest > 1.0, "seed {seed}: a third more thrust than its weight climbs at {fastest} m/s");
    }
}

/// The mode stays and the motors go on: how the vehicle comes down without a height is the landing's concern.
#[test]
fn d2_a_height_that_is_lost_is_no_reason_to_stop_the_motors() {
    for mode in [FlightMode::AltHold, FlightMode::PosHold] {
        for seed in seeds() {
            let (since, note) = instant();
            let seen = run(seed, 25.0, |mut hands| {
                Box::pin(async move {
                    climb(&mut hands, 2.0).await;
                    let flown = PilotInput { mode, arm: true, ..STICKS };
                    send(&mut hands, 1.0, flown).await;
                    note.set(hands.clock.now());
                    hands.height_silent.set(true);
                    send(&mut hands, 8.0, flown).await;
                })
            });
            let what = format!("{mode:?}, seed {seed}");
            let since = since.get();
            assert_eq!(at(&seen, since).1, mode, "{what}");
            let landing = seen.entered(FlightPhase::Landing, since).expect("it lands");
            assert!(landing.since(since) < Duration::from_secs(4), "{what}: {}", landing.since(since));
            let blind = || seen.modes.iter().filter(|(at, _)| (since..landing).contains(at));
            assert!(blind().all(|(_, status)| !status.mode.is_manual()), "{what}");
            let duties = seen.motors.iter().filter(|(at, _)| (since..landing).contains(at));
            let weakest = duties.map(|(_, motors)| motors.duty.iter().sum::<f32>() / 4.0).fold(1.0, f32::min);
            assert!(weakest > 0.3, "{what}: duty {weakest}");
        }
    }
}

#[test]
fn d5_a_transmitter_switched_on_while_a_program_flies_changes_nothing() {
    for mode in [FlightMode::Stabilize, FlightMode::Acro, FlightMode::AltHold] {
        for arm in [false, true] {
            let (since, note) = instant();
            let seen = run(1, 30.0, |mut hands| {
                Box::pin(async move {
                    hands.take_off().await;
                    note.set(hands.clock.now());
                    for _ in 0..40 {
                        hands.command(GuidedKind::None);
                        send(&mut hands, 0.1, PilotInput { mode, arm, throttle: -1.0, ..STICKS }).await;
                    }
                    hands.command(GuidedKind::Land);
                    for _ in 0..100 {
                        hands.command(GuidedKind::None);
                        send(&mut hands, 0.1, PilotInput { mode, arm, throttle: -1.0, ..STICKS }).await;
                    }
                })
            });
            let what = format!("{mode:?}, {arm}");
            let flown = at(&seen, since.get() + Duration::from_secs(3));
            assert_eq!(flown, (FlightPhase::Flying, FlightMode::PosHold, CommandSource::Guided), "{what}");
            assert!(seen.drift(since.get(), since.get() + Duration::from_secs(4)) < 0.25, "{what}");
            assert!(touches(&what, &seen, since.get()) < 0.4, "{what}");
        }
    }
}

#[test]
fn d6_a_transmitter_that_restarts_while_landing_does_not_stop_the_motors() {
    for seed in seeds() {
        let (since, note) = instant();
        let seen = run(seed, 45.0, |mut hands| {
            Box::pin(async move {
                climb(&mut hands, 2.0).await;
                note.set(hands.clock.now());
                // Silent until it has begun to land.
                hands.sleep(4.0).await;
                send(&mut hands, 20.0, STICKS).await;
            })
        });
        let what = format!("seed {seed}");
        assert!(seen.entered(FlightPhase::Landing, since.get()).is_some(), "{what}");
        assert!(touches(&what, &seen, since.get()) < 0.4, "{what}");
    }
}

#[test]
fn d6_a_switch_turned_off_lands_and_bad_frames_do_nothing() {
    let (since, note) = instant();
    let seen = run(1, 45.0, |mut hands| {
        Box::pin(async move {
            climb(&mut hands, 2.0).await;
            let on = PilotInput { arm: true, ..STICKS };
            for _ in 0..10 {
                send(&mut hands, 0.05, STICKS).await;
                send(&mut hands, 0.1, on).await;
            }
            note.set(hands.clock.now());
            send(&mut hands, 20.0, STICKS).await;
        })
    });
    let landing = seen.entered(FlightPhase::Landing, Instant::ZERO).expect("it lands");
    assert!(landing > since.get() && landing.since(since.get()) < Duration::from_millis(120), "{landing}");
    assert!(touches("switched off", &seen, since.get()) < 0.4);
}

#[test]
fn d13_the_one_who_flies_is_missed_however_others_chatter() {
    for program_flies in [false, true] {
        let (since, note) = instant();
        let seen = run(2, 45.0, |mut hands| {
            Box::pin(async move {
                if program_flies {
                    hands.take_off().await;
                    note.set(hands.command(GuidedKind::None));
                    send(&mut hands, 25.0, PilotInput { mode: FlightMode::AltHold, ..STICKS }).await;
                } else {
                    climb(&mut hands, 1.0).await;
                    note.set(hands.clock.now());
                    for _ in 0..250 {
                        hands.command(GuidedKind::None);
                        hands.sleep(0.1).await;
                    }
                }
            })
        });
        let what = format!("program {program_flies}");
        let landing = seen.entered(FlightPhase::Landing, since.get()).expect("it lands").since(since.get());
        assert!((3.4..3.7).contains(&landing.seconds()), "{what}: {landing}");
        assert!(touches(&what, &seen, since.get()) < 0.4, "{what}");
        assert!(seen.drift(since.get(), Instant::MAX) < 0.5, "{what}");
    }
}

#[test]
fn d13_a_link_that_flaps_ends_in_a_landing() {
    let (since, note) = instant();
    let seen = run(3, 45.0, |mut hands| {
        Box::pin(async move {
            climb(&mut hands, 1.0).await;
            note.set(hands.clock.now());
            for _ in 0..8 {
                hands.sleep(2.9).await;
                send(&mut hands, 0.2, PilotInput { arm: true, ..STICKS }).await;
            }
        })
    });
    let landing = seen.entered(FlightPhase::Landing, since.get()).expect("it lands").since(since.get());
    assert!(landing < Duration::from_secs(4), "{landing}");
    assert!(touches("flapping", &seen, since.get()) < 0.4);
}

#[test]
fn d11_a_kill_beside_an_arm_wins() {
    for [first, second] in [[GuidedKind::Arm, GuidedKind::Kill], [GuidedKind::Kill, GuidedKind::Arm]] {
        let seen = run(1, 12.0, |mut hands| {
            Box::pin(async move {
                hands.wait_for(|frame| frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty()).await;
                hands.command(first);
                hands.command(second);
                hands.wait_for(|_| false).await;
            })
        });
        assert!(seen.modes.iter().all(|(_, mode)| !mode.armed));
        assert_eq!(seen.end().0.blocks, ArmBlocks::NONE);
    }
}
