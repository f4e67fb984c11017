//! Flights in simulation. With `FLIGHTS=100` as many of each kind.

use stampfly_sim::plant::{Plant, PlantParameters, Pose, WindConfig};
use stampfly_sim::sticks::StickOptions;
use stampfly_sim::vehicle::{Options, Variety, Vehicle, Verdict};
use stampfly_stm32_quad::simulation::plant::{HOVER, PLANT};
use stampfly_stm32_quad::simulation::{Outcome, Stm32Quad};

/// A flight with these options.
fn fly(options: &Options, seed: u64) -> Outcome {
    let setup = Stm32Quad::setup(options, seed).expect("options");
    Stm32Quad::fly(&setup, &mut (), &mut |_, _| {}).outcome
}

/// So many flights with these options, on two threads.
fn fly_all(options: &Options) -> Vec<(u64, Outcome)> {
    let flights = std::env::var("FLIGHTS").map_or(4, |text| text.parse().expect("FLIGHTS is a number"));
    let half = |first: u64| {
        let options = options.clone();
        move || (first..=flights).step_by(2).map(|seed| (seed, fly(&options, seed))).collect::<Vec<_>>()
    };
    std::thread::scope(|scope| {
        let halves = [1, 2].map(|first| scope.spawn(half(first)));
        let mut outcomes: Vec<_> = halves.into_iter().flat_map(|half| half.join().expect("it flies")).collect();
        outcomes.sort_by_key(|(seed, _)| *seed);
        outcomes
    })
}

fn fault(text: &str) -> Options {
    Options { fault: vec![text.into()], ..Options::default() }
}

#[test]
fn it_hovers_in_a_crosswind_and_lands() {
    let outcomes = fly_all(&Options { wind: Some([0.0, 2.0]), ..Options::default() });
    let mut worst = 0.0f64;
    let mut failed = Vec::new();
    for (seed, outcome) in &outcomes {
        let attitude = outcome.measured.attitude.value().unwrap_or(f64::INFINITY).to_degrees();
        worst = worst.max(attitude);
        if !outcome.succeeded() || attitude > 3.0 {
            let figures = outcome.figures().into_iter().map(|figure| (figure.name, figure.value));
            failed.push((*seed, outcome.sentence(), figures.collect::<Vec<_>>()));
        }
    }
    println!("{} flights, attitude within {worst:.2}° RMS", outcomes.len());
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn every_mission_is_flown_in_both_modes() {
    let Variety { modes, missions, .. } = Stm32Quad::VARIETY;
    for mode in modes {
        for mission in missions {
            let text = Some((*mode).into());
            let outcome = fly(&Options { mission: Some((*mission).into()), pilot: text, ..Options::default() }, 1);
            assert!(outcome.succeeded(), "{mode} {mission}: {} {:?}", outcome.sentence(), outcome.figures());
        }
    }
}

#[test]
fn packets_that_are_lost_do_not_matter_and_a_transmitter_that_is_gone_stops_the_motors() {
    let outcome = fly(&fault("link-loss=0.3@spool"), 2);
    assert!(outcome.succeeded() && outcome.finished, "{}", outcome.sentence());
    let packets = outcome.measured.packets.expect("it was armed");
    assert!((60.0..85.0).contains(&packets), "{packets} a second");
    let outcome = fly(&fault("link-lost@hover"), 2);
    assert!(outcome.succeeded() && outcome.cut, "{}", outcome.sentence());
    // A gap of less than a second is none.
    let outcome = fly(&fault("link-lost@hover+0.7"), 2);
    assert!(outcome.succeeded() && outcome.finished && !outcome.cut, "{}", outcome.sentence());
}

#[test]
fn a_gesture_that_is_lost_with_its_packets_is_made_again() {
    // The first to calibrate, the second to arm.
    for text in ["link-lost@0.9+0.6", "link-lost@3.4+0.6"] {
        let outcome = fly(&fault(text), 3);
        assert!(outcome.succeeded() && outcome.finished && !outcome.cut, "{text}: {}", outcome.sentence());
        assert!(outcome.legs[0] == outcome.legs[1] && outcome.legs[1] > 0, "{text}: {:?}", outcome.legs);
        // Uncalibrated it is off by more.
        let off = outcome.measured.estimate.value().expect("it was armed").to_degrees();
        assert!(off < 1.5, "{text}: {off} degrees");
    }
}

#[test]
fn what_a_pilot_can_fly_with_is_flown_home_and_what_not_is_cut() {
    for text in ["gyro-bias@hover", "accel-bias@hover", "motor-weak=0.2@hover", "imu-silent@hover"] {
        for seed in 1..=2 {
            let outcome = fly(&fault(text), seed);
            assert!(outcome.succeeded(), "{text}, seed {seed}: {} {:?}", outcome.sentence(), outcome.figures());
            assert!(outcome.faults.iter().all(|(_, changes)| *changes > 0), "{text} did nothing");
        }
    }
}

#[test]
fn gains_that_cannot_fly_do_not() {
    // Ten times as much shakes; the tests above would not be worth much if that flew as well.
    let param = ["roll.p", "pitch.p"].map(|name| format!("{name}=2.0")).to_vec();
    assert!(!fly(&Options { param, ..Options::default() }, 1).succeeded());
}

#[test]
fn every_number_is_in_its_range_and_the_throttle_carries_it() {
    assert_eq!(stampfly_param::parameters::validate(&PLANT), Ok(()));
    let ideal = PlantParameters { manufacturing_spread: 0.0, ..PLANT };
    let mut plant = Plant::new(&ideal, &WindConfig::CALM, Some(&Pose::hovering(100.0)), 1);
    plant.set_duty([f64::from(HOVER); 4]);
    (0..1600).for_each(|_| plant.step());
    assert!(plant.motion().velocity.z.abs() < 0.5, "{} m/s after a second", plant.motion().velocity.z);
}

#[test]
fn with_the_real_drivers_it_flies_as_well() {
    let outcome = fly(&Options { chips: true, mission: Some("0,0,1,3".into()), ..Options::default() }, 1);
    assert!(outcome.succeeded(), "{}: {:?}", outcome.sentence(), outcome.figures());
}

fn sticks(rows: &str) -> Options {
    let file = format!("t,throttle,roll,pitch,yaw,mode,arm,land\n{rows}\n");
    Options { sticks: Some(StickOptions { file, ..StickOptions::default() }), ..Options::default() }
}

#[test]
fn a_stick_file_is_flown_from_a_hover_and_landed() {
    // The whole travel of the throttle is thrust, and 0.2 is the hover.
    let hover = "0,0.2,0,0,0,stabilize,1,0\n1,0.2,0.2,0,0,stabilize,1,0\n2,0.2,0,0,0,acro,1,0\n2.5,0.2,0,0,0,stabilize,1,0\n3,0.2,0,0,0,stabilize,1,0";
    let outcome = fly(&sticks(hover), 1);
    assert!(outcome.succeeded() && outcome.touchdown < 2.5, "{} {:?}", outcome.sentence(), outcome.figures());
    let ground =
        "0,-1,0,0,0,stabilize,0,0\n5,-1,0,0,0,stabilize,1,0\n6,0.3,0,0,0,stabilize,1,0\n7.5,0.2,0,0,0,stabilize,1,0";
    let outcome = fly(&sticks(ground), 1);
    assert!(outcome.succeeded() && outcome.has_flown(), "{} {:?}", outcome.sentence(), outcome.figures());
}

#[test]
fn sticks_that_let_it_fall_are_no_failure_and_what_the_transmitter_has_not_is_refused() {
    let outcome = fly(&sticks("0,0.2,0,0,0,stabilize,1,0\n0.5,-1,0,0,0,stabilize,1,0\n3,-1,0,0,0,stabilize,1,0"), 1);
    assert!(outcome.touchdown > 2.5 && outcome.succeeded(), "{} {:?}", outcome.sentence(), outcome.figures());
    let refused = |rows: &str| Stm32Quad::setup(&sticks(rows), 1).expect_err("refused");
    assert!(refused("0,0,0,0,0,acro,1,0\n2.5,0,0,0,0,althold,1,0").starts_with("--sticks: mode althold at 2.5 s"));
    assert!(refused("0,0,0,0,0,acro,1,1").starts_with("--sticks: land at 0 s"));
}
