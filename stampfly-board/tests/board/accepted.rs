//! Whatever the checks accept takes off, hovers, goes somewhere and lands: drawn values of one to three parameters, the others as they
//! are. All parameters at once are not drawn: a hundred and fifty values anywhere in their ranges are no vehicle that anybody would tune.

use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::mission::{self, Mission};
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::Id;
use stampfly_board::{VehicleConfig, parameters};
use stampfly_flight::Observer;
use stampfly_param::{ParameterInfo, Parameters};
use stampfly_sim::Noise;
use stampfly_sim::vehicle::{Vehicle, Verdict, Witness};
use stampfly_types::messages::{ArmBlocks, FlightStatus};
use stampfly_types::{Duration, Instant, Message};

/// Flights, some 20 ms each. `STAMPFLY_DRAWS` takes more.
const DRAWS: u64 = 200;

/// Was it ever armed, and what kept it from that to the end?
#[derive(Default)]
struct Seen {
    armed: bool,
    blocks: ArmBlocks,
}

impl Observer for Seen {}

impl Witness<Runnables> for Seen {
    fn published(&mut self, topic: usize, _: Instant, _: u32, words: &[u32]) {
        if topic == Id::flight_status as usize {
            let status = FlightStatus::from_words(words.try_into().expect("its words")).expect("a status");
            self.armed |= status.armed;
            self.blocks = status.blocks;
        }
    }
}

/// Why the flight was no good, if it was not. The mission takes off, hovers, flies a metre and lands.
fn trouble(config: VehicleConfig, seed: u64) -> Option<String> {
    let mut setup = Setup::reference(seed);
    setup.mission = Mission::parse(mission::SHORT).expect("a mission");
    let is_anothers = config.corrections != VehicleConfig::default().corrections;
    setup.vehicle = config;
    setup.limit = Duration::from_secs(60);
    let mut seen = Seen::default();
    let outcome = StampFly::fly(&setup, &mut seen, &mut |_, _| {}).outcome;
    let figure =
        |name: &str| outcome.figures().iter().find(|figure| figure.name == name).and_then(|figure| figure.value);
    // It has hovered at all, has not turned over, and has landed where it was sent. A mission counts as finished when it was given up.
    let hovered = figure("hover_drift_m").is_some();
    let landed_there = figure("land_error_m").is_some_and(|error| (error - 1.0).abs() < 0.6);
    let well = outcome.succeeded() && hovered && landed_there && outcome.worst_tilt_deg < 60.0;
    let tilt = outcome.worst_tilt_deg;
    // What a calibration has found belongs to the sensors that it was found with. With others' gravity is not gravity, and the vehicle has to say so.
    if is_anothers && !seen.armed && seen.blocks.contains(ArmBlocks::CALIBRATING) {
        return None;
    }
    (!well).then(|| format!("{}, hovered: {hovered}, there: {landed_there}, tilt {tilt:.0}°", outcome.sentence()))
}

/// A value of the range: an end of it half of the time.
fn draw(noise: &mut Noise, info: &ParameterInfo<'_>) -> f32 {
    match noise.unit() {
        share if share < 0.25 => info.min,
        share if share < 0.5 => info.max,
        _ => info.min + (info.max - info.min) * noise.unit() as f32,
    }
}

#[test]
fn the_ends_of_every_range_fly() {
    let mut troubles = Vec::new();
    for (index, info) in parameters::all().enumerate() {
        for value in [info.min, info.max] {
            let mut config = VehicleConfig::default();
            config.set(index, value).expect("its range");
            if config.check(None).is_ok()
                && let Some(trouble) = trouble(config, 1)
            {
                troubles.push(format!("{} = {value}: {trouble}", info.name));
            }
        }
    }
    assert!(troubles.is_empty(), "{troubles:#?}");
}

#[test]
fn drawn_values_that_are_accepted_fly() {
    let draws = std::env::var("STAMPFLY_DRAWS").ok().and_then(|text| text.parse().ok()).unwrap_or(DRAWS);
    let infos: Vec<_> = parameters::all().collect();
    let (mut noise, mut flown, mut troubles) = (Noise::new(1, 77), 0, Vec::new());
    for number in 0..draws {
        let mut config = VehicleConfig::default();
        let mut what = String::new();
        for _ in 0..=number % 3 {
            let index = (noise.unit() * infos.len() as f64) as usize;
            let value = draw(&mut noise, &infos[index]);
            if config.set(index, value).is_ok() {
                what += &format!("{} = {value}, ", infos[index].name);
            }
        }
        if config.check(None).is_err() {
            continue;
        }
        flown += 1;
        if let Some(trouble) = trouble(config, 1 + number % 5) {
            troubles.push(format!("{what}seed {}: {trouble}", 1 + number % 5));
        }
    }
    assert!(troubles.is_empty(), "{} of {flown}: {troubles:#?}", troubles.len());
    assert!(flown > draws / 2, "{flown} of {draws} were accepted");
}
