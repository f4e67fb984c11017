//! Worlds selected by options, and the resulting parameters of a flight.

use stampfly_param::parameters;
use stampfly_sim::vehicle::{Options, WorldKind};
use stampfly_sim::{Conditions, SimulationConfig};

fn changed(options: &Options, seed: u64) -> Result<SimulationConfig, String> {
    let mut simulation = SimulationConfig { seed, ..SimulationConfig::example() };
    options.change(&mut simulation).map(|()| simulation)
}

fn harsh(plant: &[&str]) -> Options {
    let plant = plant.iter().map(|text| (*text).into()).collect();
    Options { world: WorldKind::Harsh, plant, ..Options::default() }
}

#[test]
fn the_gentle_world_is_the_default_and_a_harsh_one_is_the_seeds() {
    assert_eq!(changed(&Options::default(), 3).expect("gentle").conditions, Conditions::GENTLE);
    let [three, again, four] = [3, 3, 4].map(|seed| changed(&harsh(&[]), seed).expect("harsh").conditions);
    assert_eq!(three, again);
    assert!(three != four && three != Conditions::GENTLE);
}

#[test]
fn a_number_that_is_named_is_not_drawn() {
    let simulation = changed(&harsh(&["battery_temperature=12.5", "mass=0.051"]), 3).expect("both are known");
    assert_eq!((simulation.conditions.battery_temperature, simulation.plant.mass), (12.5, 0.051));
    let error = changed(&harsh(&["colour=1"]), 3).expect_err("unknown");
    assert!(error.contains("colour"), "{error}");
    for (index, (info, _)) in parameters::iter(&simulation).enumerate() {
        let mut simulation = simulation.clone();
        // The first of this name, so a name is a number of the vehicle or of the conditions.
        assert_eq!(parameters::set(&mut simulation, info.name, info.min), Ok(index), "{}", info.name);
    }
}

#[test]
fn a_world_is_typed_and_written_by_its_name() {
    assert_eq!("harsh".parse(), Ok(WorldKind::Harsh));
    assert!("mild".parse::<WorldKind>().is_err());
    let written = serde_json::to_string(&harsh(&[])).expect("options can be written");
    assert!(written.contains(r#""world":"harsh""#), "{written}");
    let read: Options = serde_json::from_str("{}").expect("options of an older log");
    assert_eq!(read.world, WorldKind::Gentle);
    assert!(!serde_json::to_string(&read).expect("written").contains("world"), "as older programs wrote it");
}

#[test]
fn what_is_no_vehicle_together_is_refused_and_a_cold_old_battery_counts() {
    let weak = |more: &[&str]| {
        let plant = [&["battery_resistance=0.3"], more].concat().iter().map(|text| (*text).into()).collect();
        changed(&Options { plant, ..Options::default() }, 1)
    };
    assert!(weak(&[]).is_ok());
    let error = weak(&["battery_temperature=-20", "battery_age=1"]).expect_err("8 times the resistance");
    assert!(error.starts_with("--plant battery_resistance") && error.contains("do not spin up"), "{error}");
}

#[test]
fn everybody_flies_with_a_battery_that_lifts_the_vehicle() {
    let batteries: Vec<_> = (0..100)
        .map(|seed| {
            let simulation = changed(&harsh(&[]), seed).expect("harsh");
            let plant = simulation.plant.under(&simulation.conditions, seed);
            assert!(plant.full_throttle().lift >= 1.2, "seed {seed}: {:?}", plant.full_throttle());
            plant.battery_resistance / simulation.plant.battery_resistance
        })
        .collect();
    let (least, most) = batteries.iter().fold((f64::MAX, 0.0f64), |(low, high), r| (low.min(*r), high.max(*r)));
    assert!(least < 1.0 && most > 2.0, "resistances are {least} to {most} times the new one's");
}
