//! All the throttle on a battery that is half empty: the thrust runs out, roll and pitch do not.

use super::*;
use crate::losses::harness::{Lies, instant, run_in};
use stampfly_board::VehicleConfig;
use stampfly_board::airframe::THRUST_COEFFICIENT;
use stampfly_sim::{SimulationConfig, Truth};
use stampfly_types::{Duration, frame};
use std::ops::Range;

/// Resistance, Ω, and charge of a battery that is new, used, and worn out. The last one carries the
/// vehicle only while it is nearly full.
const PACKS: [(f64, f64); 3] = [(0.08, 0.5), (0.12, 0.5), (0.2, 1.0)];
/// For so long the stick is held, s.
const HELD: f32 = 3.8;
/// After so long the lean is steady, s: three time constants of the attitude loop, whose gain is 6
/// 1/s.
const LEANS: f32 = 0.5;
/// After so long the voltage in use is the battery's, s: it falls by up to 1.3 V, which 0.4 V/s
/// follows in 3.3 s, the first of them before the stick. Until then less is said to be missing than
/// is.
const FOLLOWED: f32 = 3.4;
/// So far the lean may be from what the stick asks for, rad, a quarter of it: a specimen's
/// accelerometer is off by up to 0.04, and a tenth of a lean is lost to it as long as the vehicle
/// accelerates.
const OFF: f32 = 0.065;
/// So far it may lean with the stick centred, rad.
const LEVEL: f32 = 0.05;
/// What lands itself brakes with so much, rad: the largest lean that the position loop asks for.
const BRAKES: f32 = 0.35;
/// So far what the log says is missing may be from what is, as a share of the demand: the battery's
/// slow part falls by some 25 mV/s, of which a reading each 0.1 s and a low-pass of 0.5 s are 15 mV
/// behind, 1 % of the thrust; the pushing of a motor is known to as much.
const TOLD: f32 = 0.02;

/// What cannot lift itself rises no higher than this on what its battery gives in the first second,
/// m.
const LOW: f32 = 0.6;
/// It is accused of none of these. Where it slides and tips over its feet, TUMBLED may stop it: how
/// far it tilts is looked at.
const STOPS: Alerts = CONVICTS.without(Alerts::NO_LIFT.with(Alerts::TUMBLED).with(Alerts::POWER_IMPLAUSIBLE));
/// And it says one of these.
const WHY: Alerts = Alerts::NO_LIFT.with(Alerts::LOW_BATTERY).with(Alerts::CRITICAL_BATTERY);

/// Attitude and thrust while a stick is held.
#[derive(Debug)]
struct Held {
    /// Least, mean and largest roll, rad, and the largest tilt, rad, once it leans.
    roll: [f32; 3],
    tilt: f32,
    /// Mean shares of the thrust that is missing, once the voltage is followed: as the log says,
    /// and in truth.
    unmet: f32,
    missing: f32,
    /// Largest share of roll and pitch that was unmet.
    unmet_tilt: f32,
}

/// From the floor with all the throttle, in STABILIZE, and this roll stick from 0.3 m on, with this
/// much between the rotors.
fn punch((resistance, charge): (f64, f64), roll: f32, seed: u64, spread: f64) -> (Seen, Instant) {
    let worn = |simulation: &mut SimulationConfig| {
        (simulation.plant.battery_charge, simulation.plant.battery_resistance) = (charge, resistance);
        simulation.conditions.rotor_spread = spread;
    };
    let (write, read) = instant();
    let seen = run_in(worn, Lies::default(), seed, 30.0, |mut hands| {
        Box::pin(async move {
            arm(&mut hands, FlightMode::Stabilize).await;
            let full = PilotInput { mode: FlightMode::Stabilize, throttle: 1.0, ..STICKS };
            until(&mut hands, 3.0, full, |height, _| height > 0.3).await;
            write.set(hands.clock.now());
            until(&mut hands, HELD, PilotInput { roll, ..full }, |_, _| false).await;
            hands.leave();
            hands.sleep(0.1).await;
        })
    });
    (seen, read.get())
}

/// What there is to see from when the stick is held on, or what it is accused of.
fn held((seen, from): &(Seen, Instant)) -> Result<Held, String> {
    let after = |seconds: f32| *from + Duration::from_seconds(seconds);
    let (leans, followed) = (after(LEANS)..after(HELD), after(FOLLOWED)..after(HELD));
    if let Some((alerts, height)) = seen.accused(CONVICTS, leans.end) {
        return Err(format!("{:?} at {height:.1} m", names(alerts)));
    }
    let truths = |span: &Range<Instant>| -> Vec<_> {
        seen.truths.iter().filter(|(at, _)| span.contains(at)).map(|(_, truth)| *truth).collect()
    };
    let motors = |span: &Range<Instant>| -> Vec<_> {
        seen.motors.iter().filter(|(at, _)| span.contains(at)).map(|(_, output)| *output).collect()
    };
    let demands = seen.demands.iter().filter(|(at, _)| followed.contains(at)).map(|(_, demand)| demand.thrust);
    let rolls: Vec<_> = truths(&leans).iter().map(|truth| frame::roll_pitch_yaw(&truth.attitude)[0]).collect();
    let [least, largest] = [f32::min, f32::max].map(|of| rolls.iter().copied().reduce(of).unwrap_or(f32::NAN));
    Ok(Held {
        roll: [least, mean(rolls.iter().copied()), largest],
        tilt: truths(&leans).iter().map(|truth| frame::tilt(&truth.attitude)).fold(0.0, f32::max),
        unmet: mean(motors(&followed).iter().map(|output| output.unmet[3])),
        missing: 1.0 - mean(truths(&followed).iter().map(pushed)) / mean(demands),
        unmet_tilt: motors(&leans).iter().flat_map(|output| [output.unmet[0], output.unmet[1]]).fold(0.0, f32::max),
    })
}

/// What four rotors of the airframe push with at these speeds, N.
fn pushed(truth: &Truth) -> f32 {
    truth.rotor_speed.iter().map(|speed| THRUST_COEFFICIENT as f32 * speed * speed).sum()
}

fn mean(values: impl Iterator<Item = f32>) -> f32 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    sum / count
}

/// Flies every pack with each of these sticks; what may the lean be?
fn each(sticks: &[f32], spread: f64, leans_well: impl Fn(f32, &Held) -> bool) {
    let mut wrong = Vec::new();
    for seed in 1..=crate::thorough::flights(2, 20) {
        for pack in PACKS {
            for &stick in sticks {
                let held = held(&punch(pack, stick, seed, spread));
                let what = format!("{pack:?}, stick {stick}, seed {seed}: {held:.3?}");
                println!("{what}");
                let told = |held: &Held| (held.unmet - held.missing).abs() < TOLD && held.unmet_tilt == 0.0;
                let well = held.is_ok_and(|held| leans_well(stick, &held) && told(&held) && held.unmet > 0.1);
                wrong.extend((!well).then_some(what));
            }
        }
    }
    none(&wrong);
}

/// Half of the stick to either side leans to either side, and `unmet` says how much thrust is
/// missing.
#[test]
fn it_leans_both_ways_and_says_what_is_missing() {
    let full = VehicleConfig::default().cascade.sticks.lean_max;
    each(&[-0.5, 0.5], 0.02, |stick, held| held.roll.iter().all(|roll| (roll - stick * full).abs() < OFF));
}

/// With rotors 5 % apart and the stick centred it stays level.
#[test]
fn it_stays_level_with_rotors_that_differ() {
    each(&[0.0], 0.05, |_, held| held.tilt < LEVEL);
}

/// A worn-out battery that is half empty hardly carries the vehicle: it comes down upright and says
/// why.
#[test]
fn what_cannot_lift_itself_comes_down_and_says_so() {
    let mut wrong = Vec::new();
    for seed in 1..=crate::thorough::flights(2, 20) {
        let (seen, _) = punch((0.2, 0.5), 0.0, seed, 0.02);
        let highest = seen.highest(Instant::ZERO);
        let tilt = seen.truths.iter().map(|(_, truth)| frame::tilt(&truth.attitude)).fold(0.0, f32::max);
        let all = seen.alerts.iter().fold(Alerts::NONE, |all, (_, alerts)| all | *alerts);
        let (status, truth) = seen.end();
        let what = format!("seed {seed}: {highest:.2} m, {tilt:.3} rad, {:?}, {:?}", status.phase, names(all));
        println!("{what}");
        let well = all.intersects(WHY) && !all.intersects(STOPS);
        wrong.extend((!well || highest > LOW || tilt > BRAKES || status.armed || !truth.contact).then_some(what));
    }
    none(&wrong);
}
