//! `stampfly hil`: the flight of `stampfly fly`, flown by a vehicle at the other end of a line.

use crate::command_line::arguments::HilOptions;
use crate::command_line::doctor::port_of;
use crate::command_line::failure::{Failure, Unfinished};
use crate::command_line::fly::{self, figures, fly_and_write, print_screen};
use crate::hil::emulated::{Pipe, start};
use crate::hil::program::Program;
use crate::hil::{self, Conversation, quantile};
use crate::vehicles::{self, ForVehicle};
use serde_json::{Value, json};
use stampfly_board::schedule::Runnables;
use stampfly_bus::{Band, Schedule, TopicTable, Trigger};
use stampfly_sim::vehicle::{Figures, Port, Remote, Settings, Vehicle, Verdict};
use std::process::ExitCode;
use std::time::Duration;

pub fn run(options: &HilOptions) -> Result<ExitCode, Failure> {
    if options.fly.from.is_some() {
        return Err("a flight of a campaign is flown again here: stampfly fly --from".into());
    }
    if options.fly.fly_on {
        return Err("--fly-on: a real vehicle's protections stop its motors".into());
    }
    if options.fly.scene.list {
        return fly::run(&options.fly);
    }
    let mut port: Box<dyn Port> = match &options.program {
        Some(command) => Box::new(Program::start(command).map_err(|error| format!("--program {command}: {error}"))?),
        None if options.emulated => {
            let [here, there] = Pipe::pair();
            start::<Runnables>(there);
            Box::new(here)
        }
        None => Box::new(hil::serial::open(&port_of(options.port.as_deref())?)?),
    };
    vehicles::with(&options.fly.scene.vehicle.name, Hil(options, &mut *port))?
}

struct Hil<'o>(&'o HilOptions, &'o mut dyn Port);

impl ForVehicle for Hil<'_> {
    type Output = Result<ExitCode, Failure>;

    fn run<V: Vehicle>(self) -> Self::Output {
        let Self(HilOptions { fly: options, real_time, .. }, port) = self;
        let typed = options.options();
        let setup = V::setup(&typed, options.seed)?;
        let mut said = Figures::default();
        let (flown, recorder) =
            fly_and_write::<V>(options, &typed, options.seed, &setup, |setup, mut recorder, report| {
                let settings = Settings { real_time: *real_time, ..Settings::default() };
                let mut remote = Remote::new(port, settings);
                let flown = hil::fly::<V>(setup, &mut remote, &mut recorder, report)
                    .map_err(|error| Unfinished(error.to_string()))?;
                said = remote.figures().clone();
                Ok((flown, recorder))
            })?;
        let conversation = Conversation { figures: &said, period: period::<V>() };
        if options.scene.json {
            let mut object = figures(&flown, recorder.hash());
            let us = |values: &[Duration], share| quantile(values, share).as_micros() as u64;
            object.insert("steps".into(), json!(said.round_trips.len()));
            object.insert("round_trip_median_us".into(), json!(us(&said.round_trips, 0.5)));
            object.insert("round_trip_most_us".into(), json!(us(&said.round_trips, 1.0)));
            object.insert("step_most_us".into(), json!(said.longest.as_micros() as u64));
            object.insert("asked_again".into(), json!(said.again));
            object.insert("garbled".into(), json!(said.garbled));
            if *real_time {
                object.insert("late_answers".into(), json!(conversation.late()));
                object.insert("latest_answer_us".into(), json!(us(&said.behind, 1.0)));
            }
            outln!("{}", Value::Object(object));
        } else {
            outln!("conversation\n{conversation}");
            print_screen::<V>(&flown, &recorder, &options.out);
        }
        Ok(if flown.outcome.succeeded() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// The period of the fastest topic that activates the flight band; a second when there is none.
fn period<V: Vehicle>() -> Duration {
    let topics = <<V::Runnables as Schedule>::Topics as TopicTable>::TOPICS;
    let lines = V::Runnables::ACTIVATIONS.iter().filter(|line| line.band == Band::Flight);
    let periods = lines.flat_map(|line| match line.trigger {
        Trigger::On(on) => on.iter().filter_map(|topic| topics.get(*topic)?.period).collect(),
        Trigger::Every(period) => vec![period],
        _ => Vec::new(),
    });
    periods.min().map_or(Duration::from_secs(1), |period| Duration::from_micros(period.as_micros()))
}
