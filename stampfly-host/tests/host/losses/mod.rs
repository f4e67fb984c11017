//! What the vehicle does when something it relies on goes away in flight, and how fast.

pub mod harness;
mod link;

use crate::thorough::thorough;
use harness::{STICKS, Seen, instant, run};
use stampfly_types::messages::{Alerts, ArmBlocks, FlightMode, FlightPhase, GuidedKind, PilotInput};
use stampfly_types::{Duration, Instant};

fn seeds() -> std::ops::RangeInclusive<u64> {
    1..=thorough(2, 4)
}

/// A control period: the vehicle's inertial sensor may be 2 % slow.
const PERIOD: Duration = Duration::from_micros(2_551);

/// It hovers for three seconds after half a second of silence, over its place, then lands there.
fn hovers_then_lands(seed: u64, seen: &Seen, silent_since: Instant) {
    let landing = seen.entered(FlightPhase::Landing, silent_since).expect("it lands");
    let waited = landing.since(silent_since).seconds();
    assert!((3.45..3.6).contains(&waited), "seed {seed}: landing after {waited} s of silence");
    let first = seen.alerts.iter().find(|(at, alerts)| *at >= silent_since && alerts.contains(Alerts::COMM_LOST));
    let noticed = first.expect("silence is noticed").0.since(silent_since).seconds();
    assert!((0.49..0.52).contains(&noticed), "seed {seed}: noticed after {noticed} s");

    let (mode, truth) = seen.end();
    assert_eq!((mode.phase, mode.armed, truth.contact), (FlightPhase::IdleGround, false, true), "seed {seed}");
    let drift = seen.drift(silent_since, landing);
    assert!(drift < 0.25, "seed {seed}: drifted {drift} m while waiting");
    let moved = seen.drift(silent_since, Instant::MAX);
    assert!(moved < 0.4, "seed {seed}: landed {moved} m away");
    for (at, output) in &seen.motors {
        assert!(output.duty.iter().all(|duty| (0.0..=1.0).contains(duty)), "seed {seed}: {output:?} at {at}");
    }
}

#[test]
fn a_silent_ground_station() {
    for seed in seeds() {
        let (since, note) = instant();
        let seen = run(seed, 30.0, |mut hands| {
            Box::pin(async move {
                hands.take_off().await;
                hands.sleep(0.3).await;
                note.set(hands.command(GuidedKind::None));
            })
        });
        hovers_then_lands(seed, &seen, since.get());
    }
}

/// A pilot arms by switch, the vehicle takes off by itself, and frames come at 50 Hz until the pilot is gone while
/// flying forward.
#[test]
fn a_silent_pilot() {
    for seed in seeds() {
        let (since, note) = instant();
        let seen = run(seed, 35.0, |mut hands| {
            Box::pin(async move {
                while hands.telemetry().phase != FlightPhase::IdleGround || !hands.telemetry().blocks.is_empty() {
                    hands.frame(&STICKS);
                    hands.sleep(0.02).await;
                }
                while hands.telemetry().phase != FlightPhase::Flying {
                    hands.frame(&PilotInput { arm: true, ..STICKS });
                    hands.sleep(0.02).await;
                }
                for _ in 0..100 {
                    note.set(hands.frame(&PilotInput { arm: true, pitch: 0.1, ..STICKS }));
                    hands.sleep(0.02).await;
                }
            })
        });
        hovers_then_lands(seed, &seen, since.get());
    }
}

#[test]
fn a_link_that_comes_back_in_time() {
    let (since, note) = instant();
    let seen = run(1, 25.0, |mut hands| {
        Box::pin(async move {
            hands.take_off().await;
            note.set(hands.command(GuidedKind::None));
            hands.sleep(2.5).await;
            hands.wait_for(|_| false).await;
        })
    });
    let lost: Vec<bool> = seen.alerts.iter().map(|(_, alerts)| alerts.contains(Alerts::COMM_LOST)).collect();
    assert!(lost.contains(&true) && lost.last() == Some(&false), "silence was noticed, and its end");
    assert_eq!(seen.entered(FlightPhase::Landing, since.get()), None);
    assert_eq!(seen.end().0.phase, FlightPhase::Flying);
}

#[test]
fn kill_stops_the_motors_within_a_control_period() {
    for seed in seeds() {
        let (since, note) = instant();
        let seen = run(seed, 15.0, |mut hands| {
            Box::pin(async move {
                hands.take_off().await;
                note.set(hands.command(GuidedKind::Kill));
            })
        });
        let took = seen.motors_off_after(since.get());
        assert!(took <= PERIOD, "seed {seed}: by command {took}");
        assert!(!seen.end().0.armed);

        let (since, note) = instant();
        let seen = run(seed, 15.0, |mut hands| {
            Box::pin(async move {
                hands.take_off().await;
                // At any phase of the control period.
                hands.sleep(0.01 + 0.000_37 * seed as f32).await;
                note.set(hands.frame(&PilotInput { kill: true, ..STICKS }));
            })
        });
        let took = seen.motors_off_after(since.get());
        assert!(took <= PERIOD, "seed {seed}: by the pilot {took}");
    }
}

/// The last duty must not be held: 20 ms without a sample and the motors are off, by deadline, for nothing wakes the
/// flight band any more.
#[test]
fn a_silent_inertial_sensor() {
    for seed in seeds() {
        let (since, note) = instant();
        let seen = run(seed, 20.0, |mut hands| {
            Box::pin(async move {
                hands.take_off().await;
                note.set(hands.clock.now());
                hands.imu_silent.set(true);
            })
        });
        let took = seen.motors_off_after(since.get());
        assert!((Duration::from_millis(47)..=Duration::from_millis(56)).contains(&took), "seed {seed}: {took}");
        let degraded = seen.alerts.iter().find(|(_, alerts)| alerts.contains(Alerts::IMU_DEGRADED)).expect("noticed").0;
        assert!(degraded.since(since.get()) <= Duration::from_millis(15), "seed {seed}: {degraded}");
    }
}

/// Less than 50 ms is noticed and flown through.
#[test]
fn a_hiccup_of_the_inertial_sensor() {
    let (since, note) = instant();
    let seen = run(1, 20.0, |mut hands| {
        Box::pin(async move {
            hands.take_off().await;
            note.set(hands.clock.now());
            hands.imu_silent.set(true);
            hands.sleep(0.045).await;
            hands.imu_silent.set(false);
            hands.sleep(2.0).await;
            hands.command(GuidedKind::Land);
            hands.wait_for(|frame| !frame.armed).await;
        })
    });
    assert!(seen.alerts.iter().any(|(_, alerts)| alerts.contains(Alerts::IMU_DEGRADED)));
    assert!(seen.alerts.iter().all(|(_, alerts)| !alerts.contains(Alerts::IMU_LOST)));
    assert!(
        seen.entered(FlightPhase::Landing, since.get())
            .is_some_and(|at| at.since(since.get()) > Duration::from_secs(2))
    );
    assert_eq!((seen.end().0.phase, seen.end().1.contact), (FlightPhase::IdleGround, true));
    assert!(seen.drift(since.get(), Instant::MAX) < 0.3);
}

/// A finger, and somebody who is heard: a click takes off and holds the place, a press stops the motors, and what follows
/// of this press means nothing.
#[test]
fn a_button_takes_off_and_stops_the_motors() {
    for seed in seeds() {
        let (since, note) = instant();
        let seen = run(seed, 30.0, |mut hands| {
            Box::pin(async move {
                hands.wait_for(|frame| frame.phase == FlightPhase::IdleGround && frame.blocks.is_empty()).await;
                hands.click().await;
                hands.wait_for(|frame| frame.phase == FlightPhase::Flying).await;
                // At any phase of the button's period.
                hands.sleep(0.1 + 0.007 * seed as f32).await;
                note.set(hands.clock.now());
                hands.click().await;
                hands.wait_for(|_| false).await;
            })
        });
        let phases: Vec<FlightPhase> = seen.phases().into_iter().map(|(_, phase)| phase).collect();
        use FlightPhase as S;
        // While it falls it looks as if somebody held it.
        let expected =
            [S::Init, S::IdleGround, S::Armed, S::TakeOff, S::Flying, S::IdleGround, S::IdleHeld, S::IdleGround];
        assert_eq!(phases, expected, "seed {seed}");
        let flying = |mode: &&(Instant, stampfly_types::messages::FlightStatus)| mode.1.phase == S::Flying;
        assert!(seen.modes.iter().filter(flying).all(|(_, mode)| mode.mode == FlightMode::PosHold), "seed {seed}");
        let took = seen.motors_off_after(since.get());
        assert!((Duration::from_millis(50)..Duration::from_millis(110)).contains(&took), "seed {seed}: {took}");
    }
}

/// However often the finger clicks: who hears nobody does not arm.
#[test]
fn a_button_alone_does_not_fly_the_vehicle() {
    let seen = run(1, 30.0, |hands| {
        Box::pin(async move {
            loop {
                hands.sleep(2.0).await;
                hands.click().await;
            }
        })
    });
    let phases: Vec<FlightPhase> = seen.phases().into_iter().map(|(_, phase)| phase).collect();
    assert_eq!(phases, [FlightPhase::Init, FlightPhase::IdleGround]);
    let (_, last) = seen.modes.last().expect("it ran");
    assert_eq!(last.blocks, ArmBlocks::NO_LINK);
}
