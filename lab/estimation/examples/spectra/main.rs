//! Does the simulated inertial sensor shake like the real one?
//!
//! `cargo run --release --manifest-path lab/Cargo.toml --example spectra` reads recordings of a real StampFly, simulates the same
//! situations, prints the power in bands side by side, draws `docs/images/spectra.svg`, and fails when a band is off
//! by more than the stated factor. `STAMPFLY_DATA` names the folder of the recordings (default `../shared/data`).
//!
//! The recordings were made by firmware with filters of its own, so the simulated chip samples pass the same chain:
//! an average over five samples at 1600 Hz, which stands for the chip's filter at its 400 Hz setting, then the
//! firmware's first-order low-pass of 100 Hz (gyroscope) or 50 Hz (accelerometer). The average was read off the static
//! record, where white noise goes in and the chain's own shape comes out. The flight holds manoeuvres, so it is
//! compared above 10 Hz for the accelerometer and above 30 Hz for the gyroscope.

#[path = "../../../../stampfly-sim/tests/sim/pilot.rs"]
mod pilot;
mod plot;
mod recording;
mod spectrum;

use recording::Recording;
use spectrum::{Spectrum, welch};
use stampfly_drivers::MotorOutputs;
use stampfly_sim::plant::{Pose, WindConfig};
use stampfly_sim::sensors::imu::counts_to_si;
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};
use std::collections::VecDeque;
use std::path::Path;
use std::process::ExitCode;

/// Axes in the order of the recordings' columns.
pub const AXES: [&str; 6] = ["gyro x", "gyro y", "gyro z", "accel x", "accel y", "accel z"];
/// Rate of recordings and of the control loop.
const RATE: f64 = 400.0;
/// Edges of the bands compared, Hz.
const BANDS: [f64; 9] = [10.0, 20.0, 30.0, 50.0, 75.0, 100.0, 130.0, 160.0, 190.0];
/// How far the amplitude in a band may be off, as a factor.
const STATIC_FACTOR: f64 = 1.25;
const FLIGHT_FACTOR: f64 = 1.5;

/// One situation, recorded and simulated.
struct Case {
    name: &'static str,
    factor: f64,
    /// Lowest frequency compared: gyroscope, accelerometer.
    lowest: [f64; 2],
    recorded: [Vec<f64>; 6],
    simulated: [Vec<f64>; 6],
}

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<bool, String> {
    // Set by the build script.
    let flights = Path::new(env!("STAMPFLY_DATA_FOLDER")).join("stampfly_flights");
    let standing = Recording::read(&flights.join("stampfly_fft_20260114T115628.csv"))?;
    let flying = Recording::read(&flights.join("stampfly_fft_20260113T231806.csv"))?;
    let cases = [
        Case {
            name: "standing",
            factor: STATIC_FACTOR,
            lowest: [10.0, 10.0],
            simulated: simulate(None, standing.len()),
            recorded: standing.axes(0.0, RATE),
        },
        Case {
            name: "flying",
            factor: FLIGHT_FACTOR,
            lowest: [30.0, 10.0],
            // The first seconds stand on the floor and climb.
            simulated: simulate(Some(1.0), flying.len()),
            recorded: flying.axes(7.5, RATE),
        },
    ];
    let spectra: Vec<_> = cases.iter().map(|case| [&case.recorded, &case.simulated].map(spectra_of)).collect();
    let mut good = true;
    for (case, [recorded, simulated]) in cases.iter().zip(&spectra) {
        good &= compare(case, recorded, simulated);
    }
    // The folder is committed: where it is missing, this is not the repository.
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs/images/spectra.svg");
    std::fs::write(&path, plot::draw(&cases.each_ref().map(|case| case.name), &spectra))
        .map_err(|e| format!("{}: {e}", path.display()))?;
    println!("\ndrawn: docs/images/spectra.svg");
    Ok(good)
}

fn spectra_of(axes: &[Vec<f64>; 6]) -> [Spectrum; 6] {
    axes.each_ref().map(|samples| welch(samples, RATE))
}

/// Prints the table of one case; false when a band is off.
fn compare(case: &Case, recorded: &[Spectrum; 6], simulated: &[Spectrum; 6]) -> bool {
    println!("\n{}: amplitude density, recorded / simulated, rad/s/√Hz and m/s²/√Hz", case.name);
    print!("{:>11}", "Hz");
    AXES.iter().for_each(|axis| print!("{axis:>24}"));
    println!();
    let mut good = true;
    for band in BANDS.windows(2) {
        print!("{:>4.0} to{:>4.0}", band[0], band[1]);
        for axis in 0..6 {
            let (real, model) = (recorded[axis].level(band[0], band[1]), simulated[axis].level(band[0], band[1]));
            let ratio = model / real;
            let counts = band[0] >= case.lowest[axis / 3];
            let off = counts && !(1.0 / case.factor..=case.factor).contains(&ratio);
            good &= !off;
            let mark = if off {
                '!'
            } else if counts {
                ' '
            } else {
                '-'
            };
            print!("  {real:.5} {model:.5} {ratio:>4.2}{mark}");
        }
        println!();
    }
    print!("{:>11}", "std");
    for axis in 0..6 {
        let (real, model) = (deviation(&case.recorded[axis]), deviation(&case.simulated[axis]));
        print!("  {real:.5} {model:.5} {:>4.2} ", model / real);
        if case.name == "standing" && !(0.8..=1.2).contains(&(model / real)) {
            good = false;
            print!("!");
        }
    }
    println!("\n  allowed: a factor of {} ('!' is off, '-' does not count)", case.factor);
    good
}

fn deviation(samples: &[f64]) -> f64 {
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    (samples.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt()
}

/// What the recording firmware would have recorded: standing, or hovering at a height in metres.
fn simulate(height: Option<f64>, samples: usize) -> [Vec<f64>; 6] {
    let config = SimulationConfig {
        pose: height.map(Pose::hovering),
        wind: WindConfig { gust: 0.7, ..Default::default() },
        ..SimulationConfig::new(stampfly_board::simulation::PLANT)
    };
    let mut simulation = Simulation::new(&config);
    let clock = simulation.clock.clone();
    let mut axes: [Vec<f64>; 6] = Default::default();
    let mut low_pass = [None; 6];
    let mut recent: VecDeque<[f64; 6]> = VecDeque::new();
    block_on(&clock, async {
        for _ in 0..samples {
            let (_, group) = simulation.sensors.imu.next_group().await;
            recent.extend(group.map(|sample| sample.map(f64::from)));
            recent.drain(..recent.len().saturating_sub(5));
            let mean = core::array::from_fn(|channel| {
                recent.iter().map(|sample| sample[channel]).sum::<f64>() / recent.len() as f64
            });
            let (accel, gyro) = counts_to_si(mean);
            let values = [gyro.x, gyro.y, gyro.z, accel.x, accel.y, accel.z].map(f64::from);
            for (axis, value) in values.into_iter().enumerate() {
                let cut = if axis < 3 { 100.0 } else { 50.0 };
                let weight = 1.0 / (1.0 + RATE / (core::f64::consts::TAU * cut));
                let past = low_pass[axis].get_or_insert(value);
                *past += weight * (value - *past);
                axes[axis].push(*past);
            }
            if let Some(height) = height {
                let Ok(()) = simulation.sensors.motors.write(&pilot::fly(&simulation.truth(), -height as f32));
            }
        }
    });
    axes
}
