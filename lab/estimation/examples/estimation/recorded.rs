//! Recorded sensors: a StampFly carried by hand, and BROAD's hand-held trials.

use crate::{draw, range};
use stampfly_lab::chart::{Axis, BLUE, Chart, GREEN, GREY, Mark, ORANGE, Panel, RED, Scale, Shape};
use stampfly_lab::dataset::{self, Recording};
use stampfly_lab::estimate::{self, Estimated, Method};
use stampfly_types::Instant;
use std::error::Error;
use std::path::PathBuf;

/// Set by the build script.
const FOLDER: &str = env!("STAMPFLY_DATA_FOLDER");

/// Loops carried by hand that end where they began.
const LOOPS: [&str; 2] = ["square01", "square_30cm"];

/// A recording and the estimate over it; `None`, and a word about it, where it is not there.
fn estimated(file: &str) -> Result<Option<(Recording, Estimated)>, Box<dyn Error>> {
    let path = PathBuf::from(FOLDER).join(file);
    if !path.exists() {
        println!("  {file} is not there: its picture stays as it is");
        return Ok(None);
    }
    let recording = dataset::load(path)?;
    let estimated = estimate::run(&recording, &estimate::suite(recording.kind));
    Ok(Some((recording, estimated)))
}

fn seconds(at: Instant, start: Instant) -> f64 {
    at.since(start).seconds_f64()
}

/// Innovations and gates over a carried loop.
pub fn innovations() -> Result<(), Box<dyn Error>> {
    println!("innovations of square01:");
    let Some((_, estimated)) = estimated("stampfly_logs/square01.csv")? else { return Ok(()) };
    let start = estimated.start.at;
    let (mut ranges, mut gates, mut flows) = (Vec::new(), Vec::new(), Vec::new());
    let mut last = None;
    for instance in &estimated.drive.instances {
        let (time, status) = (seconds(instance.at, start), &instance.status);
        let [range, flow] = [(status.tof_innovation, status.tof_ratio), (status.flow_innovation[0], status.flow_ratio)]
            .map(|(innovation, ratio)| (f64::from(innovation), f64::from(ratio)));
        let [(before_range, _), (before_flow, _)] = last.replace([range, flow]).unwrap_or_default();
        // The test ratio is the square of the innovation over its gate.
        if range.0 != before_range && range.1 > 0.0 {
            let gate = range.0.abs() / range.1.sqrt();
            ranges.push([time, range.0]);
            gates.push([time, -gate, gate]);
        }
        if flow.0 != before_flow {
            flows.push([time, flow.1.sqrt()]);
        }
    }
    for sensor in ["tof", "flow"] {
        let share = estimated.figures.rejected.get(sensor).copied().unwrap_or_default();
        println!("  {sensor}: {:.1} % beyond the gate", 100.0 * share);
    }
    let end = estimated.figures.duration_s;
    let wide = range(gates.iter().flat_map(|[_, low, high]| [*low, *high]));
    let highest = range(flows.iter().map(|[_, ratio]| *ratio))[1].max(1.2);
    let chart = Chart {
        title: "A StampFly carried round a square: what its sensors said, and what was expected".to_owned(),
        columns: 1,
        size: [640.0, 150.0],
        panels: vec![
            Panel {
                title: "range: measured less expected".to_owned(),
                x: Axis::linear("time, s", [0.0, end]),
                y: Axis::linear("innovation, m", wide),
                marks: vec![
                    Mark { name: "gate", colour: BLUE, shape: Shape::Band(gates) },
                    Mark { name: "sample", colour: BLUE, shape: Shape::Dots(ranges) },
                ],
            },
            Panel {
                title: "flow: distance of both axes from what was expected, in gates".to_owned(),
                x: Axis::linear("time, s", [0.0, end]),
                y: Axis::linear("distance, gates", [0.0, highest]),
                marks: vec![
                    Mark { name: "", colour: BLUE, shape: Shape::Dots(flows) },
                    Mark {
                        name: "beyond it a sample is left out",
                        colour: RED,
                        shape: Shape::Dashes(vec![[0.0, 1.0], [end, 1.0]]),
                    },
                ],
            },
        ],
    };
    draw("estimation_innovations.svg", &chart)
}

/// Carried loops: the estimate beside flow alone.
pub fn paths() -> Result<(), Box<dyn Error>> {
    println!("carried loops: distance of the end from the start");
    let mut panels = Vec::new();
    for name in LOOPS {
        let Some((recording, estimated)) = estimated(&format!("stampfly_logs/{name}.csv"))? else { return Ok(()) };
        let place = |north: f32, east: f32| [f64::from(east), f64::from(north)];
        let ours: Vec<[f64; 2]> = estimated
            .drive
            .instances
            .iter()
            .step_by(2)
            .map(|instance| place(instance.state.position.x, instance.state.position.y))
            .collect();
        let flow: Vec<[f64; 2]> = estimate::path(&recording, &estimated.start)
            .into_iter()
            .step_by(2)
            .map(|(_, [n, e])| place(n, e))
            .collect();
        let figures = &estimated.figures;
        let alone = figures.flow_dead_reckoning_end_xy_m.unwrap_or_default();
        println!("  {name:<12} estimate {:.3} m, flow alone {alone:.3} m", figures.end_xy_m.unwrap_or_default());
        // The same scale both ways.
        let points = || ours.iter().chain(&flow);
        let (x, y) = (range(points().map(|p| p[0])), range(points().map(|p| p[1])));
        let half = 0.5 * (x[1] - x[0]).max(y[1] - y[0]);
        let around = |[low, high]: [f64; 2]| [0.5 * (low + high) - half, 0.5 * (low + high) + half];
        let ends = |path: &[[f64; 2]]| path.last().map(|end| vec![*end]).unwrap_or_default();
        panels.push(Panel {
            title: name.to_owned(),
            x: Axis::linear("right of the start, m", around(x)),
            y: Axis::linear("ahead of the start, m", around(y)),
            marks: vec![
                Mark { name: "flow, gyro and range summed up", colour: ORANGE, shape: Shape::Line(flow.clone()) },
                Mark { name: "", colour: ORANGE, shape: Shape::Rings(ends(&flow)) },
                Mark { name: "estimate", colour: BLUE, shape: Shape::Line(ours.clone()) },
                Mark { name: "the end of each", colour: BLUE, shape: Shape::Rings(ends(&ours)) },
                Mark { name: "start", colour: RED, shape: Shape::Rings(vec![[0.0, 0.0]]) },
            ],
        });
    }
    let chart = Chart {
        title: "A StampFly carried round a square by hand, back to the start".to_owned(),
        columns: 2,
        size: [300.0, 300.0],
        panels,
    };
    draw("estimation_paths.svg", &chart)
}

/// BROAD: the attitude filter and the Kalman filter beside the errors of others in the data's own table.
pub fn attitude() -> Result<(), Box<dyn Error>> {
    println!("BROAD trials, degrees RMS: tilt, total");
    let Ok(table) = std::fs::read_to_string(PathBuf::from(FOLDER).join("broad/rmse_table.csv")) else {
        println!("  broad/rmse_table.csv is not there: its picture stays as it is");
        return Ok(());
    };
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().ok_or("an empty table")?;
    let column = |name: &str| header.iter().position(|cell| *cell == name).ok_or(format!("no column {name}"));
    let vqf = [column("vqf9d_incl")?, column("vqf9d_total")?];
    let mahony = [column("mahony_incl")?, column("mahony_total")?];
    // Filter by filter: tilt and total, trial by trial.
    let mut errors: [Vec<[f64; 2]>; 4] = Default::default();
    let mut trials = Vec::new();
    for cells in lines {
        let path = PathBuf::from(FOLDER).join(format!("broad/{}.npz", cells[0]));
        if !path.exists() {
            continue;
        }
        let recording = dataset::load(path)?;
        let suite = estimate::suite(recording.kind);
        let mut kalman = suite.clone();
        kalman.method = Method::Vehicle;
        let [ours, kalman] = [suite, kalman].map(|suite| {
            let figures = estimate::run(&recording, &suite).figures;
            [figures.tilt_rmse_deg, figures.total_rmse_deg].map(Option::unwrap_or_default)
        });
        let known = |columns: [usize; 2]| columns.map(|column| cells[column].parse().unwrap_or(f64::NAN));
        let (vqf, mahony) = (known(vqf), known(mahony));
        println!(
            "  {:<36} attitude filter {ours:.2?}, Kalman filter {kalman:.2?}, VQF {vqf:.2?}, Mahony {mahony:.2?}",
            cells[0]
        );
        trials.push(cells[0].split('_').next().unwrap_or_default().to_owned());
        for (list, values) in errors.iter_mut().zip([ours, kalman, vqf, mahony]) {
            list.push(values);
        }
    }
    let filters = [
        ("AttitudeFilter", BLUE),
        ("Eskf on the same samples", GREY),
        ("VQF, its defaults", ORANGE),
        ("Mahony, published by BROAD", GREEN),
    ];
    let panels = ["tilt", "whole attitude"].iter().enumerate().map(|(part, title)| {
        let bars = |filter: usize| -> Vec<[f64; 2]> {
            let beside = 0.2 * (filter as f64 - 1.5);
            errors[filter].iter().enumerate().map(|(trial, values)| [trial as f64 + beside, values[part]]).collect()
        };
        let marks = filters.iter().enumerate().map(|(filter, (name, colour))| Mark {
            name,
            colour,
            shape: Shape::Bars(0.18, bars(filter)),
        });
        let names = trials.iter().enumerate().map(|(place, trial)| (place as f64, trial.clone())).collect();
        let most = range(errors.iter().flatten().map(|values| values[part]))[1];
        Panel {
            title: (*title).to_owned(),
            x: Axis { scale: Scale::Named(names), ..Axis::linear("trial", [-0.6, trials.len() as f64 - 0.4]) },
            y: Axis::linear("RMS error, degrees", [0.0, most]),
            marks: marks.collect(),
        }
    });
    let chart = Chart {
        title: "Attitude of a hand-held sensor against motion capture (BROAD)".to_owned(),
        columns: 2,
        size: [320.0, 200.0],
        panels: panels.collect(),
    };
    draw("estimation_attitude.svg", &chart)
}
