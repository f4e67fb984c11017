//! Batteries from new to worn out, from full to empty: no vehicle falls for want of thrust, and one
//! that ends its flight by itself says that the battery is the reason.

use super::*;
use crate::losses::harness::{Lies, instant, run_in, send};
use stampfly_board::VehicleConfig;
use stampfly_sim::SimulationConfig;
use stampfly_types::messages::GuidedKind;
use stampfly_types::{Duration, frame};
use std::cell::Cell;
use std::pin::Pin;
use std::rc::Rc;

/// When the script asked for the end of the flight, if it has.
type Asked = Rc<Cell<Instant>>;
type Script = for<'a, 'b> fn(&'a mut Hands<'b>, Asked) -> Pin<Box<dyn Future<Output = ()> + 'a>>;

/// What ends a flight for want of thrust.
const EMPTY: Alerts = Alerts::LOW_BATTERY.with(Alerts::CRITICAL_BATTERY);
/// And what keeps it on the ground.
const GROUNDED: Alerts = EMPTY.with(Alerts::NO_LIFT).with(Alerts::USB_POWER);
/// What a battery may not make of a sound vehicle.
const FALLS: Alerts = CONVICTS.without(Alerts::NO_LIFT);
/// The same of one that does not get off the ground: it slides, too near for its camera, and its
/// motors draw all that there is.
const SLIDES: Alerts = FALLS.without(Alerts::FLOW_IMPLAUSIBLE.with(Alerts::POWER_IMPLAUSIBLE));
/// Higher than this it has flown, m.
const FLOWN: f32 = 0.3;
/// The reason is there when the flight ends, or was so shortly before.
const BEFORE: Duration = Duration::from_millis(50);
/// A period of the control loop.
const PERIOD: Duration = Duration::from_micros(2_500);
/// Hardest touch-down, m/s, as the judge of every flight has it.
const HARD: f32 = 1.0;
/// Largest tilt, of the largest that the position loop asks for: a landing that is asked for at
/// speed brakes with all of it, and a gust or the attitude loop adds a quarter.
const TILT: f32 = 1.25;

/// Resistances, Ω, and charges of the whole grid.
const RESISTANCES: [f64; 5] = [0.06, 0.09, 0.12, 0.15, 0.2];
const CHARGES: [f64; 5] = [1.0, 0.7, 0.5, 0.3, 0.15];

/// The whole grid.
fn grid() -> Vec<(f64, f64)> {
    RESISTANCES.iter().flat_map(|resistance| CHARGES.map(|charge| (*resistance, charge))).collect()
}

/// Flies a script in each of these cells, for so many seconds at most.
fn fly(what: &str, cells: &[(f64, f64)], seconds: f32, script: Script) {
    let mut wrong = Vec::new();
    for seed in 1..=crate::thorough::flights(2, 4) {
        wrong.extend(cells.iter().filter_map(|cell| complaint(what, *cell, seed, seconds, script)));
    }
    none(&wrong);
}

/// What is wrong about a flight.
fn complaint(what: &str, (resistance, charge): (f64, f64), seed: u64, seconds: f32, script: Script) -> Option<String> {
    let pack = |simulation: &mut SimulationConfig| {
        (simulation.plant.battery_resistance, simulation.plant.battery_charge) = (resistance, charge);
        simulation.wind.gust = 1.0;
    };
    let (write, asked) = instant();
    write.set(Instant::MAX);
    let seen = run_in(pack, Lies::default(), seed, seconds, |mut hands| {
        Box::pin(async move {
            script(&mut hands, write).await;
            send(&mut hands, 1.0, STICKS).await;
            hands.leave();
            hands.sleep(0.1).await;
        })
    });
    let highest = seen.highest(Instant::ZERO);
    let tilt = seen.truths.iter().map(|(_, truth)| frame::tilt(&truth.attitude)).fold(0.0, f32::max);
    let flew = highest > FLOWN;
    let accused =
        if flew { seen.accused(FALLS, seen.touches_after(FLOWN)) } else { seen.accused(SLIDES, Instant::MAX) };
    let ended = ends_by_itself(&seen, asked.get());
    let wrong = [
        ("accused", accused.is_some()),
        ("tilted", tilt > TILT * VehicleConfig::default().cascade.position.tilt_max),
        ("hits the floor", !seen.ends_well(if flew { HARD } else { f32::INFINITY })),
        ("gives no reason", ended.is_some_and(|(.., why)| !why.intersects(if flew { EMPTY } else { GROUNDED }))),
        ("never took off", charge >= 0.5 && resistance < 0.15 && !flew),
    ];
    let wrong: Vec<_> = wrong.into_iter().filter_map(|(what, is)| is.then_some(what)).collect();
    let flown = format!(
        "{what}, {resistance} ohm, charge {charge}, seed {seed}: to {highest:.2} m, tilt {:.0} degrees, {:.2} m/s, {:.0} s, {:?}, {accused:?} {wrong:?}",
        tilt.to_degrees(),
        seen.touch_speed(),
        seen.modes.last().map_or(0.0, |(at, _)| at.since(Instant::ZERO).seconds()),
        ended.map(|(at, phase, why)| (at.since(Instant::ZERO).seconds(), phase, names(why))),
    );
    println!("{flown}");
    (!wrong.is_empty()).then_some(flown)
}

/// When it landed or stayed on the ground without being asked to, the phase that it left, and the
/// alerts that there were by then.
fn ends_by_itself(seen: &Seen, asked: Instant) -> Option<(Instant, FlightPhase, Alerts)> {
    let phases = seen.phases();
    let armed = |phase: FlightPhase| matches!(phase, FlightPhase::Armed | FlightPhase::TakeOff | FlightPhase::Flying);
    let left = phases.windows(2).find(|pair| armed(pair[0].1) && !armed(pair[1].1));
    let (at, phase) = match left {
        Some([(_, phase), (at, _)]) => (*at, *phase),
        // It never armed.
        _ => (seen.modes.last()?.0, phases.last()?.1),
    };
    let by_then = seen
        .alerts
        .iter()
        .take_while(|(alert, _)| *alert <= at)
        .skip_while(|(alert, _)| alert.since(Instant::ZERO) + BEFORE < at.since(Instant::ZERO));
    let why = by_then.fold(Alerts::NONE, |all, (_, alerts)| all | *alerts);
    // A command acts in the activation that its instant belongs to, whose sample is a little older.
    (at + PERIOD < asked).then_some((at, phase, why))
}

/// Waits until it may arm, for so many seconds at most, with signs of life.
async fn ready(hands: &mut Hands<'_>, sticks: PilotInput) -> bool {
    for _ in 0..500 {
        if is_ready(hands) {
            return true;
        }
        hands.frame(&sticks);
        hands.sleep(0.02).await;
    }
    false
}

/// Says that it is there for so long, or until this becomes true.
async fn wait(hands: &mut Hands<'_>, seconds: f32, done: impl Fn(&mut Hands<'_>) -> bool) {
    for _ in 0..(seconds / 0.02) as u32 {
        if done(hands) {
            return;
        }
        hands.command(GuidedKind::None);
        hands.sleep(0.02).await;
    }
}

fn is_ready(hands: &mut Hands<'_>) -> bool {
    hands.telemetry().phase == FlightPhase::IdleGround && hands.telemetry().blocks.is_empty()
}

fn flies(hands: &mut Hands<'_>) -> bool {
    hands.telemetry().phase == FlightPhase::Flying
}

/// By a program: takes off, climbs by a metre, goes aside, lands.
#[test]
fn a_mission() {
    fly("mission", &grid(), 60.0, |hands, asked| {
        Box::pin(async move {
            wait(hands, 10.0, is_ready).await;
            if !is_ready(hands) {
                return;
            }
            hands.command(GuidedKind::Arm);
            wait(hands, 1.0, |hands| hands.telemetry().armed).await;
            hands.command(GuidedKind::TakeOff);
            wait(hands, 15.0, |hands| flies(hands) || !hands.telemetry().armed).await;
            for position in [Vec3::new(0.0, 0.0, -1.5), Vec3::new(1.0, 0.5, -1.5)] {
                if flies(hands) {
                    hands.way_point(position);
                    wait(hands, 8.0, |hands| !flies(hands)).await;
                }
            }
            if flies(hands) {
                asked.set(hands.command(GuidedKind::Land));
            }
            wait(hands, 60.0, |hands| !hands.telemetry().armed).await;
        })
    });
}

/// Hovers in POS_HOLD until it ends by itself.
#[test]
fn a_hover_to_the_end() {
    let few = vec![(0.06, 0.15), (0.12, 0.3), (0.12, 0.5), (0.2, 0.5)];
    fly("hover", &thorough(few, grid()), 280.0, |hands, _| {
        Box::pin(async move {
            let hold = PilotInput { arm: true, ..STICKS };
            if !ready(hands, STICKS).await {
                return;
            }
            until(hands, 10.0, hold, |_, _| false).await;
            send(hands, 2.2, PilotInput { throttle: 1.0, ..hold }).await;
            while hands.telemetry().armed {
                send(hands, 0.1, hold).await;
            }
        })
    });
}

/// Climbs at full stick in ALT_HOLD for six seconds, and is landed by the switch.
#[test]
fn a_climb_at_full_stick() {
    let few = vec![(0.06, 0.15), (0.09, 0.3), (0.12, 0.5), (0.12, 0.3), (0.15, 0.5), (0.2, 1.0), (0.2, 0.5)];
    fly("climb", &thorough(few, grid()), 60.0, |hands, asked| {
        Box::pin(async move {
            let rest = PilotInput { mode: FlightMode::AltHold, ..STICKS };
            let hold = PilotInput { arm: true, ..rest };
            if !ready(hands, rest).await {
                return;
            }
            send(hands, 5.0, hold).await;
            send(hands, 6.0, PilotInput { throttle: 1.0, ..hold }).await;
            if flies(hands) {
                asked.set(hands.clock.now());
            }
            while hands.telemetry().armed {
                send(hands, 0.1, rest).await;
            }
        })
    });
}
