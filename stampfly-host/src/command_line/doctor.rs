//! `stampfly doctor`: a newcomer and his vehicle, or an emulated one.

use crate::command_line::arguments::DoctorOptions;
use crate::command_line::failure::Failure;
use crate::command_line::terminal::Screen;
use crate::doctor::console::Serial;
use crate::doctor::newcomer::Newcomer;
use crate::doctor::{Chart, emulated, examine};
use stampfly_board::simulation::bench::fault;
use std::io::{BufRead, stdin};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// A vehicle that was plugged in has its port by then.
const PLUGGED_IN: Duration = Duration::from_secs(15);

pub fn run(options: &DoctorOptions) -> Result<ExitCode, Failure> {
    if options.list_faults {
        fault::all().iter().for_each(|fault| outln!("{}", fault.name));
        return Ok(ExitCode::SUCCESS);
    }
    let chart = match &options.emulated {
        Some(name) => {
            let all = fault::all();
            let fault = all.iter().find(|fault| fault.name == *name);
            if fault.is_none() && !name.is_empty() {
                return Err(format!("there is no fault '{name}'; --list-faults lists them").into());
            }
            emulated::examine(fault.map(|fault| &fault.defect), options.seed)
        }
        None => vehicle(options)?,
    };
    std::fs::write(&options.out, chart.file()).map_err(|error| format!("{}: {error}", options.out.display()))?;
    outln!("\n{chart}Everything is in {}; send it with a report.", options.out.display());
    Ok(if chart.findings().next().is_none() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The vehicle's serial port: the one that was typed, or the only one that looks like it.
pub fn port_of(typed: Option<&str>) -> Result<String, Failure> {
    match (typed, Serial::candidates().as_slice()) {
        (Some(path), _) => Ok(path.into()),
        (None, [only]) => Ok(only.clone()),
        (None, found) => {
            let found = if found.is_empty() { "none is there".into() } else { found.join(", ") };
            Err(format!("which port is the vehicle's? --port PORT; {found}").into())
        }
    }
}

/// Examines the vehicle at a serial port, once its propellers are off.
fn vehicle(options: &DoctorOptions) -> Result<Chart, Failure> {
    if !options.yes {
        outln!("Take all four propellers off. Type off when they are.");
        let mut typed = String::new();
        stdin().lock().read_line(&mut typed)?;
        if typed.trim() != "off" {
            return Err("with propellers on it is not examined".into());
        }
    }
    let path = port_of(options.port.as_deref())?;
    let mut newcomer = Newcomer {
        connect: |path| Serial::open(path, PLUGGED_IN),
        path,
        port: None,
        keys: stdin().lock(),
        screen: Screen,
        begun: Instant::now(),
        transcript: String::new(),
    };
    let mut chart = examine(&mut newcomer);
    chart.transcript = newcomer.transcript;
    Ok(chart)
}
