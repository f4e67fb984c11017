//! Three hundred random missions: routes, wind, vehicles, clocks and executors. The small size flies
//! a fifth of them. All have to end with a vehicle that stands where it was sent and is disarmed.
//!
//! Every mission follows from its number. To fly one alone, with its log written to the target folder's `tmp`:
//! `MISSION=17 cargo test -p stampfly-host --test host missions -- --nocapture`.

use crate::thorough::thorough;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use stampfly_board::simulation::mission::{Mission, Step};
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_host::campaign::{Flight, run};
use stampfly_host::flown::fly;
use stampfly_host::recorder::Recorder;
use stampfly_mode::transitions::{Event, next};
use stampfly_param::{Parameters, parameters};
use stampfly_sim::plant::Pose;
use stampfly_types::Instant;
use stampfly_types::messages::FlightPhase;

/// Numbers from a seed.
struct Draw(ChaCha8Rng);

impl Draw {
    /// Between these, all equally likely.
    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.0.next_u32()) / f64::from(u32::MAX)
    }

    /// True in one of `n` cases.
    fn one_in(&mut self, n: u32) -> bool {
        self.0.next_u32().is_multiple_of(n)
    }
}

/// What the plant is made of that a workshop gets wrong by a tenth.
const VARIED: [&str; 14] = [
    "mass",
    "inertia_x",
    "inertia_y",
    "inertia_z",
    "rotor_offset",
    "thrust_coefficient",
    "torque_coefficient",
    "motor_voltage_b",
    "motor_resistance",
    "rotor_inertia",
    "drag_horizontal",
    "drag_vertical",
    "battery_resistance",
    "ground_effect_gain",
];

fn random_route(draw: &mut Draw) -> Mission {
    let height = draw.within(0.3, 1.2) as f32;
    let mut steps = vec![Step::Arm, Step::TakeOff { height }];
    for _ in 0..1 + draw.0.next_u32() % 4 {
        let place = [draw.within(-1.5, 1.5), draw.within(-1.5, 1.5), draw.within(0.3, 1.2)].map(|m| m as f32);
        let yaw = if draw.one_in(3) { None } else { Some(draw.within(-180.0, 180.0) as f32) };
        let speed = if draw.one_in(2) { 0.0 } else { draw.within(0.2, 0.8) as f32 };
        steps.push(Step::GoTo { place, yaw, speed, dwell: draw.within(0.0, 1.0) as f32 });
    }
    steps.push(Step::Land);
    Mission { steps }
}

/// Mission `number`, and everything it is flown with.
fn random_mission(number: u64) -> Setup {
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(number));
    let mut setup = Setup { mission: random_route(&mut draw), ..Setup::reference(number) };
    let scene = &mut setup.simulation;
    scene.wind.gust = draw.within(0.0, 0.8) as f32;
    let (speed, towards) = (draw.within(0.0, 0.5), draw.within(0.0, core::f64::consts::TAU));
    scene.wind.mean = [(speed * libm::cos(towards)) as f32, (speed * libm::sin(towards)) as f32, 0.0].into();
    scene.vibration = draw.within(0.5, 1.5);
    for name in VARIED {
        let index = parameters::find(&scene.plant, name).expect("a plant parameter");
        let value = scene.plant.get(index).expect("its value") * draw.within(0.9, 1.1);
        parameters::set_at(&mut scene.plant, index, value).expect("a tenth more or less is in range");
    }
    scene.plant.battery_charge = draw.within(0.6, 1.0);
    scene.pose = Some(Pose::standing(&scene.plant, draw.within(-core::f64::consts::PI, core::f64::consts::PI)));
    scene.start = match number % 4 {
        // 32 bits of microseconds end in flight.
        0 => Instant::from_micros((1 << 32) - 10_000_000),
        1 => Instant::from_micros(draw.within(0.0, 1e13) as u64),
        _ => Instant::ZERO,
    };
    setup.jitter = number.is_multiple_of(6).then_some(number);
    setup
}

/// How much farther or nearer than the last way-point a vehicle stands that is this far from where it took off.
fn how_far_off(mission: &Mission, from_take_off: Option<f64>) -> Option<f64> {
    let last = mission.steps.iter().rev().find_map(|step| match step {
        Step::GoTo { place: [north, east, _], .. } => Some(f64::from(*north).hypot(f64::from(*east))),
        _ => None,
    });
    Some((from_take_off? - last?).abs())
}

/// Everything that is wrong with a flight of this mission.
fn complaints(mission: &Mission, flight: &Flight<StampFly, ()>) -> Vec<String> {
    let mut found = Vec::new();
    let outcome = &flight.flown.outcome;
    let mut check = |holds: bool, what: String| {
        if !holds {
            found.push(what);
        }
    };
    check(outcome.finished, "the mission was not flown to its end".into());
    check(outcome.metrics.landed, "did not land".into());
    check(outcome.metrics.disarmed, "did not disarm".into());
    let violations = &outcome.judgement.violations;
    check(violations.is_empty(), format!("violated {violations:?}"));
    check(flight.flown.log_lost == 0, format!("the log missed {} samples", flight.flown.log_lost));
    let bounds = [
        ("estimate to truth", outcome.metrics.est_pos_rms_m, 0.2),
        ("truth to set-point", outcome.metrics.pos_rms_m, 0.2),
        ("height to set-point", outcome.metrics.alt_rms_m, 0.07),
        ("take-off overshoot", outcome.metrics.takeoff_overshoot_m, 0.16),
        ("touchdown", outcome.metrics.touchdown_speed_mps, 0.4),
        ("tilt", Some(outcome.worst_tilt_deg), 30.0),
        ("where it stands", how_far_off(mission, outcome.metrics.land_error_m), 0.4),
    ];
    for (what, value, bound) in bounds {
        check(value.is_some_and(|value| value <= bound), format!("{what}: {value:?}, may be {bound}"));
    }
    let phases: Vec<FlightPhase> = outcome.phases.iter().map(|change| change.phase).collect();
    check(phases.first() == Some(&FlightPhase::Init), "does not begin in INIT".into());
    for pair in phases.windows(2).filter(|pair| pair[0] != pair[1]) {
        let possible = Event::ALL.iter().any(|event| next(pair[0], *event) == Some(pair[1]));
        check(possible, format!("{:?} to {:?} is not in the table", pair[0], pair[1]));
    }
    found
}

/// Flies mission `number` again, with a log.
fn investigate(number: u64) {
    let setup = random_mission(number);
    let mut recorder = Recorder::<StampFly>::with_log(&setup, &[("mission".to_owned(), number.to_string())]);
    let flown = fly::<StampFly>(&setup, &mut recorder, &mut |_, _| {});
    let log = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("mission_{number}.ulg"));
    std::fs::write(&log, recorder.log()).expect("the target folder can be written");
    println!("{setup:#?}\n{flown:#?}\nlog: {}", log.display());
}

#[test]
fn every_random_mission_ends_on_the_ground_and_disarmed() {
    let alone: Option<u64> = std::env::var("MISSION").ok().map(|text| text.parse().expect("MISSION is a number"));
    // A fifth of them has every kind of clock and executor. Mission 78 found flow that was doubted
    // without a reason.
    let few = || (1..=60).chain([78]).collect();
    let numbers: Vec<u64> = alone.map_or_else(|| thorough(few(), (1..=300).collect()), |number| vec![number]);
    alone.into_iter().for_each(investigate);

    let setups: Vec<(u64, Setup)> = numbers.into_iter().map(|number| (number, random_mission(number))).collect();
    let flights = run::<StampFly, ()>(&setups, &|_, _| (), &|_| {});
    assert_eq!(flights.len(), setups.len());
    let failed: Vec<String> = flights
        .iter()
        .zip(&setups)
        .filter_map(|(flight, (_, setup))| {
            let complaints = complaints(&setup.mission, flight);
            (!complaints.is_empty()).then(|| format!("MISSION={}: {}", flight.seed, complaints.join("; ")))
        })
        .collect();
    assert!(failed.is_empty(), "{} of {} missions failed:\n{}", failed.len(), flights.len(), failed.join("\n"));
}

#[test]
fn the_missions_differ_in_what_they_should_differ_in() {
    let setups: Vec<Setup> = (1..=300).map(random_mission).collect();
    let count = |what: &dyn Fn(&Setup) -> bool| setups.iter().filter(|setup| what(setup)).count();
    assert!(count(&|setup| setup.jitter.is_some()) >= 40, "executors that are late");
    assert!(count(&|setup| setup.simulation.start.as_micros() == (1 << 32) - 10_000_000) >= 60, "32 bits overflow");
    for steps in 4..=7 {
        assert!(count(&|setup| setup.mission.steps.len() == steps) >= 40, "{steps} steps");
    }
    assert!(count(&|setup| setup.simulation.plant.mass > 0.0386) >= 40, "heavy vehicles");
    assert!(count(&|setup| setup.simulation.wind.mean.norm() > 0.3) >= 60, "wind");
}
