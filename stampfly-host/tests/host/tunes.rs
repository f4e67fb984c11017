//! Tuning the rate loops of a StampFly in flight, as built and with an inertia and motors that nobody told it of.
//!
//! `cargo test --release -p stampfly-host --test host tunes -- --nocapture` prints the figures of `docs/explain/controllers.md`.

use crate::thorough::thorough;
use stampfly_board::airframe::INERTIA;
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_control::autotune::{AutotuneStage, AutotuneStatus, AutotuneStop};
use stampfly_flight::Observer;
use stampfly_host::campaign;
use stampfly_param::parameters;
use stampfly_sim::vehicle::Witness;

/// Nothing but what the outcome says.
struct Nobody;

impl Observer for Nobody {}
impl Witness<Runnables> for Nobody {}

const MISSION: &str = "arm; takeoff 1; hover 2; autotune roll; autotune pitch; autotune yaw; land";

fn setup(seed: u64, mission: &str, change: fn(&mut Setup)) -> (u64, Setup) {
    let mission = Mission::parse(mission).expect("a mission");
    let mut setup = Setup { mission, ..Setup::reference(seed) };
    change(&mut setup);
    (seed, setup)
}

/// How each tuning of each flight ended. Every flight has to be flown to its end.
fn tuned(setups: &[(u64, Setup)]) -> Vec<Vec<AutotuneStatus>> {
    let flights = campaign::run::<StampFly, Nobody>(setups, &|_, _| Nobody, &|_| {});
    let ends = |status: &AutotuneStatus| matches!(status.stage, AutotuneStage::Done | AutotuneStage::Stopped);
    flights
        .iter()
        .map(|flight| {
            assert!(flight.succeeded(), "seed {}: {:?}", flight.seed, flight.flown.outcome.judgement);
            flight.flown.outcome.tuned.iter().map(|(_, status)| *status).filter(ends).collect()
        })
        .collect()
}

fn inertia(setup: &mut Setup, factor: f64) {
    let plant = &mut setup.simulation.plant;
    (plant.inertia_x, plant.inertia_y, plant.inertia_z) =
        (plant.inertia_x * factor, plant.inertia_y * factor, plant.inertia_z * factor);
}

type Case = (&'static str, f64, fn(&mut Setup));
const CASES: [Case; 4] = [
    ("as built", 1.0, |_| {}),
    ("inertia -30 %", 0.7, |setup| inertia(setup, 0.7)),
    ("inertia +50 %", 1.5, |setup| inertia(setup, 1.5)),
    ("motor lag x1.5", 1.0, |setup| setup.simulation.plant.rotor_inertia *= 1.5),
];

#[test]
fn every_axis_of_a_vehicle_that_is_not_as_it_is_said_to_be() {
    println!(
        "| the vehicle | axis | inertia found, of the true one | motors, ms | delay, ms | before | after | Kp becomes |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (name, factor, change) in CASES {
        let seeds = 1..=thorough(1, 2);
        let flights = tuned(&seeds.map(|seed| setup(seed, MISSION, change)).collect::<Vec<_>>());
        let config = stampfly_board::VehicleConfig::default().cascade.rate;
        for (of_flight, statuses) in flights.iter().enumerate() {
            assert_eq!(statuses.len(), 3, "{name}: {statuses:?}");
            for status in statuses {
                assert_eq!(status.stage, AutotuneStage::Done, "{name}: {status}");
                let place = status.axis as usize;
                let found = f64::from(status.inertia) / (INERTIA[place] * factor);
                let decibels = |factor: f32| 20.0 * factor.log10();
                let margins = |of: usize| {
                    (status.phase_margin[of].to_degrees(), decibels(status.gain_margin[of]), status.crossover[of])
                };
                let ((p0, g0, w0), (p1, g1, w1)) = (margins(0), margins(1));
                if of_flight == 0 {
                    println!(
                        "| {name} | {} | {found:.2} | {:.1} | {:.1} | {p0:.0}°, {g0:.1} dB at {w0:.0} rad/s | {p1:.0}°, {g1:.1} dB at {w1:.0} rad/s | {:.2} of it |",
                        status.axis.name(),
                        1e3 * status.lag,
                        1e3 * status.delay,
                        status.kp / status.axis.gains(&config).kp
                    );
                }
                assert!((0.85..1.15).contains(&found), "{name}: {status}");
                assert!(p1 >= 54.0 && g1 >= 7.9, "{name}: {status}");
            }
        }
    }
}

/// Gains that were found and accepted fly the reference mission.
#[test]
fn the_gains_that_were_found_fly() {
    let (_, change) = (CASES[1].0, CASES[1].2);
    let found = tuned(&[setup(1, MISSION, change)]).remove(0);
    let (_, mut setup) = setup(3, include_str!("../../../stampfly-board/missions/square.mission"), change);
    for status in found {
        let axis = ["roll", "pitch", "yaw"][status.axis as usize];
        for (name, value) in [("kp", status.kp), ("ti", status.ti), ("td", status.td)] {
            parameters::set(&mut setup.vehicle, &format!("rate.{axis}.{name}"), value).expect("within its range");
        }
    }
    let flights = campaign::run::<StampFly, Nobody>(&[(3, setup)], &|_, _| Nobody, &|_| {});
    let metrics = &flights[0].flown.outcome.metrics;
    println!("position error {:.3} m", metrics.pos_rms_m.expect("it flew"));
    assert!(flights[0].succeeded() && metrics.pos_rms_m.is_some_and(|error| error < 0.06));
}

#[test]
fn what_speaks_against_it_is_said_and_the_flight_goes_on() {
    let low = "arm; takeoff 0.4; hover 1; autotune roll; land";
    let other =
        |setup: &mut Setup| parameters::set(&mut setup.vehicle, "controller.type", 1.0).map(drop).expect("known");
    let none = |_: &mut Setup| {};
    for (mission, change, reason) in [
        (low, none as fn(&mut Setup), AutotuneStop::NotHovering),
        ("arm; takeoff 1; hover 1; autotune pitch; land", other, AutotuneStop::Bounds),
    ] {
        let ended = tuned(&[setup(1, mission, change)]).remove(0);
        assert!(
            matches!(ended[..], [AutotuneStatus { stop, stage: AutotuneStage::Stopped, .. }] if stop == reason),
            "{ended:?}"
        );
    }
}
