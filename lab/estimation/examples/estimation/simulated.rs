//! Simulated flights, where the truth is known.

use crate::flown::Flown;
use crate::{draw, range};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use stampfly_board::VehicleConfig;
use stampfly_board::simulation::{Setup, mission::Mission};
use stampfly_eskf::filter::{ATTITUDE, POSITION, VELOCITY};
use stampfly_eskf::{Eskf, Estimator};
use stampfly_lab::chart::{Axis, BLUE, Chart, Mark, ORANGE, Panel, Shape};
use stampfly_sim::Truth;
use stampfly_types::{Duration, Instant, Vec3};
use std::collections::BTreeMap;
use std::error::Error;

/// Every so many activations become a point.
const THIN: usize = 20;
/// Fast enough that a tenth of a second matters.
const FAST: &str =
    "arm\ntakeoff 1\ngoto 3 0 1 speed 2\ngoto 3 3 1 speed 2\ngoto 0 3 1 speed 2\ngoto 0 0 1 speed 2\nland";
/// A camera system: how often, and how well, m.
const CAMERA_PERIOD: Duration = Duration::from_millis(20);
const CAMERA_SIGMA: f32 = 0.005;

/// Errors beside what the filter believes of them: the reference mission.
pub fn consistency() -> Result<(), Box<dyn Error>> {
    println!("the reference mission, seed 1: errors and the filter's own three standard deviations");
    let flown = Flown::new(&Setup::reference(1))?;
    let mut eskf = Eskf::new(VehicleConfig::default().eskf);
    let mut started = false;
    // Per panel: time, error, three standard deviations.
    let mut errors: [Vec<[f64; 3]>; 4] = Default::default();
    for given in &flown.given {
        given.predict(&mut eskf, &mut started);
        given.fuse(&mut eskf);
        if flown.published.get(&given.now).is_some_and(|published| *published != eskf.estimate()) {
            return Err(format!("at {}: not what the vehicle estimated in flight", given.now).into());
        }
        let Some(truth) = flown.truth.get(&given.now).filter(|_| started) else { continue };
        let state = eskf.nominal();
        let turned = (state.quat().inverse() * truth.attitude).scaled_axis();
        let rows = [
            (POSITION + 2, state.position.z - truth.position.z, 1.0),
            (VELOCITY, state.velocity.x - truth.velocity.x, 1.0),
            (ATTITUDE, turned.x, 1f64.to_degrees()),
            (ATTITUDE + 2, turned.z, 1f64.to_degrees()),
        ];
        for (errors, (index, error, factor)) in errors.iter_mut().zip(rows) {
            let doubt = 3.0 * f64::from(eskf.covariance().get(index, index)).sqrt();
            errors.push([given.now.seconds_f64(), factor * f64::from(error), factor * doubt]);
        }
    }
    let names = [("height", "m"), ("velocity north", "m/s"), ("roll", "degrees"), ("heading", "degrees")];
    let panels = names.iter().zip(&errors).map(|((name, unit), errors)| {
        let inside = errors.iter().filter(|[_, error, doubt]| error.abs() <= *doubt).count();
        println!("  {name:<15} {:5.1} % inside", 100.0 * inside as f64 / errors.len() as f64);
        let shown: Vec<[f64; 3]> = errors.iter().step_by(THIN).copied().collect();
        // The doubt before take-off and after a reset would flatten the rest.
        let mut doubts: Vec<f64> = shown.iter().map(|[_, _, doubt]| *doubt).collect();
        doubts.sort_by(f64::total_cmp);
        let most = 1.3 * doubts[doubts.len() * 98 / 100];
        let end = shown.last().map_or(1.0, |[time, ..]| *time);
        let begin = shown.first().map_or(0.0, |[time, ..]| *time);
        let band = shown.iter().map(|[time, _, doubt]| [*time, -doubt, *doubt]).collect();
        let line = shown.iter().map(|[time, error, _]| [*time, *error]).collect();
        Panel {
            title: (*name).to_owned(),
            x: Axis::linear("time, s", [begin, end]),
            y: Axis::linear(format!("error, {unit}"), [-most, most]),
            marks: vec![
                Mark {
                    name: "three standard deviations, as the filter sees them",
                    colour: BLUE,
                    shape: Shape::Band(band),
                },
                Mark { name: "error", colour: BLUE, shape: Shape::Line(line) },
            ],
        }
    });
    let chart = Chart {
        title: "A simulated flight: error and doubt".to_owned(),
        columns: 2,
        size: [380.0, 170.0],
        panels: panels.collect(),
    };
    draw("estimation_errors.svg", &chart)
}

/// Position error, RMS and largest, m, of a flight on a camera system that is late.
fn on_cameras(flown: &Flown, delay: Duration, tell: bool) -> [f64; 2] {
    let mut noise = ChaCha8Rng::seed_from_u64(7);
    let mut normal = || {
        let sum: f64 = (0..12).map(|_| f64::from(noise.next_u32()) / 2f64.powi(32)).sum();
        (sum - 6.0) as f32
    };
    let mut pictures: Vec<(Instant, Vec3)> = Vec::new();
    for (at, truth) in &flown.truth {
        if pictures.last().is_none_or(|(last, _)| at.since(*last) >= CAMERA_PERIOD) {
            pictures.push((*at, truth.position + Vec3::from_fn(|_| normal() * CAMERA_SIGMA)));
        }
    }
    let mut pictures = pictures.into_iter().peekable();
    let mut eskf = Eskf::new(VehicleConfig::default().eskf);
    let mut started = false;
    let (mut sum, mut count, mut largest) = (0.0, 0.0, 0.0f64);
    for given in &flown.given {
        given.predict(&mut eskf, &mut started);
        while let Some((at, position)) = pictures.next_if(|(at, _)| *at + delay <= given.now) {
            _ = eskf.fuse_position(
                if tell { at } else { given.now },
                &position,
                &Vec3::new(CAMERA_SIGMA, CAMERA_SIGMA, CAMERA_SIGMA),
            );
        }
        let flying = |truth: &&Truth| !truth.contact && truth.position.z < -0.3;
        if let Some(truth) = flown.truth.get(&given.now).filter(flying) {
            let apart = f64::from((eskf.nominal().position - truth.position).norm());
            sum += apart * apart;
            largest = largest.max(apart);
            count += 1.0;
        }
    }
    [(sum / count).sqrt(), largest]
}

/// What a late measurement costs, with its time and without.
pub fn late() -> Result<(), Box<dyn Error>> {
    println!("a simulated flight of 2 m/s on camera positions alone, 50 a second, late: RMS, largest error, m");
    let mut setup = Setup::reference(1);
    setup.mission = Mission::parse(FAST)?;
    let flown = Flown::new(&setup)?;
    println!("  {:>5}  {:>18}  {:>18}", "", "with true stamps", "stamped on arrival");
    let mut lines: BTreeMap<bool, [Vec<[f64; 2]>; 2]> = BTreeMap::new();
    for millis in (0..=90).step_by(10) {
        let errors = [true, false].map(|tell| {
            let errors = on_cameras(&flown, Duration::from_millis(millis), tell);
            let lines = lines.entry(tell).or_default();
            for (line, error) in lines.iter_mut().zip(errors) {
                line.push([millis as f64, error]);
            }
            errors
        });
        let [[placed, placed_most], [current, current_most]] = errors;
        println!("  {millis:>2} ms  {placed:>9.3} {placed_most:>8.3}  {current:>9.3} {current_most:>8.3}");
    }
    let panels = ["root mean square", "largest"].iter().enumerate().map(|(index, name)| {
        let line = |tell: bool| lines.get(&tell).map(|lines| lines[index].clone()).unwrap_or_default();
        let most = range(line(true).into_iter().chain(line(false)).map(|[_, error]| error))[1];
        Panel {
            title: (*name).to_owned(),
            x: Axis::linear("delay, ms", [0.0, 95.0]),
            y: Axis::linear("position error, m", [0.0, most]),
            marks: vec![
                Mark { name: "compared with the state of its own time", colour: BLUE, shape: Shape::Line(line(true)) },
                Mark { name: "", colour: BLUE, shape: Shape::Dots(line(true)) },
                Mark { name: "taken as current", colour: ORANGE, shape: Shape::Line(line(false)) },
                Mark { name: "", colour: ORANGE, shape: Shape::Dots(line(false)) },
            ],
        }
    });
    let chart = Chart {
        title: "Late positions from a camera system, in a flight of up to 2 m/s".to_owned(),
        columns: 2,
        size: [300.0, 200.0],
        panels: panels.collect(),
    };
    draw("estimation_late.svg", &chart)
}
