//! A specific force that differs from the thrust that was asked for.

use super::*;
use crate::losses::harness::{Lies, run_in};
use stampfly_sim::SimulationConfig;
use std::pin::Pin;

type Script = for<'a, 'b> fn(&'a mut Hands<'b>, [f32; 3]) -> Pin<Box<dyn Future<Output = ()> + 'a>>;

const STABILIZE: PilotInput = PilotInput { mode: FlightMode::Stabilize, arm: true, ..STICKS };
const ACRO: PilotInput = PilotInput { mode: FlightMode::Acro, arm: true, ..STICKS };

/// A vehicle that was this high has flown, m, and its next touch of the ground ends the flight.
const FLOWN: f32 = 1.0;

/// The alerts of a flight before it touches the ground, if there are any, or that it has not flown.
fn complaint(
    what: &str,
    surroundings: impl FnOnce(&mut SimulationConfig),
    seed: u64,
    script: Script,
    how: [f32; 3],
) -> Option<String> {
    let seen = run_in(surroundings, Lies::default(), seed, 60.0, |mut hands| {
        Box::pin(async move {
            script(&mut hands, how).await;
            hands.leave();
            hands.sleep(0.1).await;
        })
    });
    let accused = seen.accused(CONVICTS, seen.touches_after(FLOWN)).map(|(all, height)| (names(all), height));
    let flown = format!("{what} {how:?}, seed {seed}: to {:.1} m, {accused:?}", seen.highest(Instant::ZERO));
    println!("{flown}");
    (accused.is_some() || seen.highest(Instant::ZERO) < FLOWN).then_some(flown)
}

/// From 5 or 8 m, in STABILIZE: little throttle for so long, and then all of it.
#[test]
fn little_throttle_from_high_up() {
    let mut wrong = Vec::new();
    for seed in seeds() {
        for height in [5.0, 8.0] {
            for (throttle, seconds) in
                [(-1.0, 0.3), (-1.0, 1.0), (-1.0, 3.0), (0.1, 3.0), (0.2, 1.0), (0.2, 3.0), (0.35, 3.0)]
            {
                let script: Script = |hands, [throttle, height, seconds]| {
                    Box::pin(async move {
                        rise(hands, height).await;
                        until(hands, seconds, PilotInput { throttle, ..STABILIZE }, |height, _| height < 1.5).await;
                        until(hands, 1.5, PilotInput { throttle: 1.0, ..STABILIZE }, |_, climb| climb > 1.0).await;
                    })
                };
                wrong.extend(complaint("little throttle", |_| {}, seed, script, [throttle, height, seconds]));
            }
        }
    }
    none(&wrong);
}

/// In ACRO: up, nearly upside down with hardly any throttle, and all of it again in STABILIZE.
#[test]
fn a_flip_by_hand() {
    let mut wrong = Vec::new();
    for seed in seeds() {
        for stick in [1.0, -1.0] {
            let script: Script = |hands, [roll, height, _]| {
                Box::pin(async move {
                    rise(hands, height).await;
                    until(hands, 0.25, PilotInput { throttle: 0.9, ..ACRO }, |_, _| false).await;
                    until(hands, 0.62, PilotInput { throttle: 0.05, roll, ..ACRO }, |height, _| height < 1.0).await;
                    until(hands, 1.5, PilotInput { throttle: 1.0, ..STABILIZE }, |_, climb| climb > 1.0).await;
                })
            };
            for height in [6.0, 8.0] {
                wrong.extend(complaint("flip by hand", |_| {}, seed, script, [stick, height, 0.0]));
            }
        }
    }
    none(&wrong);
}

#[test]
fn all_the_throttle_and_then_none() {
    let mut wrong = Vec::new();
    for seed in seeds() {
        let script: Script = |hands, [seconds, ..]| {
            Box::pin(async move {
                arm(hands, FlightMode::Stabilize).await;
                until(hands, seconds, PilotInput { throttle: 1.0, ..STABILIZE }, |height, _| height > 8.0).await;
                until(hands, 3.0, PilotInput { throttle: -1.0, ..STABILIZE }, |height, climb| {
                    height < 2.0 && climb < 0.0
                })
                .await;
                until(hands, 1.5, PilotInput { throttle: 1.0, ..STABILIZE }, |_, climb| climb > 1.0).await;
            })
        };
        for seconds in [1.0, 1.5, 2.0] {
            wrong.extend(complaint("full and none", |_| {}, seed, script, [seconds, 0.0, 0.0]));
        }
        let climbs: Script = |hands, [mode, ..]| {
            Box::pin(async move {
                let flown = if mode > 0.0 { STABILIZE } else { ACRO };
                arm(hands, flown.mode).await;
                until(hands, 4.0, PilotInput { throttle: 1.0, ..flown }, |height, _| height > 10.0).await;
            })
        };
        for mode in [0.0, 1.0] {
            wrong.extend(complaint("climb at full stick", |_| {}, seed, climbs, [mode, 0.0, 0.0]));
            let windy = |simulation: &mut SimulationConfig| simulation.wind.gust = 4.0;
            wrong.extend(complaint("climb in gusts", windy, seed, climbs, [mode, 0.0, 0.0]));
        }
    }
    none(&wrong);
}

/// A hover at 3 m and throttles that change, in gusts whose standard deviation is 4 m/s.
#[test]
fn gusts() {
    let mut wrong = Vec::new();
    for seed in 1..=2 * crate::thorough::flights(1, 4) {
        let script: Script = |hands, [height, ..]| {
            Box::pin(async move {
                rise(hands, height).await;
                for _ in 0..4 {
                    hold(hands, 1.5, height + 2.0, STABILIZE).await;
                    hold(hands, 1.5, height, STABILIZE).await;
                }
            })
        };
        let windy = |simulation: &mut SimulationConfig| simulation.wind.gust = 4.0;
        wrong.extend(complaint("gusts", windy, seed, script, [3.0, 0.0, 0.0]));
    }
    none(&wrong);
}

/// A tired battery by hand, with its throttle at both ends: its resistance, Ω, and its charge.
#[test]
fn tired_batteries_by_hand() {
    let mut wrong = Vec::new();
    let batteries = if thorough(false, true) {
        vec![(0.06, 0.2), (0.09, 0.3), (0.12, 0.3), (0.12, 0.5), (0.2, 0.8), (0.2, 1.0)]
    } else {
        vec![(0.12, 0.3), (0.2, 0.8)]
    };
    for seed in seeds() {
        for &(resistance, charge) in &batteries {
            let script: Script = |hands, _| {
                Box::pin(async move {
                    rise(hands, 4.0).await;
                    for _ in 0..3 {
                        let low = PilotInput { throttle: 0.2, ..STABILIZE };
                        until(hands, 0.6, low, |height, _| height < 1.5).await;
                        let high = PilotInput { throttle: 1.0, ..STABILIZE };
                        until(hands, 1.0, high, |height, _| height > 5.0).await;
                    }
                })
            };
            let tired = |simulation: &mut SimulationConfig| {
                simulation.plant.battery_resistance = resistance;
                simulation.plant.battery_charge = charge;
            };
            wrong.extend(complaint(
                "a tired battery by hand",
                tired,
                seed,
                script,
                [resistance as f32, charge as f32, 0.0],
            ));
        }
    }
    none(&wrong);
}
