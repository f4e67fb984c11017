//! The command line: what the program can do, and what several commands share. The options of a command are in the file of its kind.

mod campaign;
mod live;
mod log;
mod scene;
mod sticks;

pub use campaign::{CampaignOptions, Engine};
pub use live::{ConnectOptions, DemoOptions, HilOptions, ServeOptions, VehiclePlace};
pub use log::{GoldenOptions, LogCommand, ReplayOptions};
pub use scene::{FlyOptions, SceneOptions};
pub use sticks::StickArguments;

use crate::vehicles;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Flies the StampFly flight stack: in simulation, again from a log, over recorded data.
#[derive(Debug, Parser)]
#[command(
    name = "stampfly",
    version,
    after_help = "Exit code: 0 when the flight or the comparison ended as it should, 1 when it did not, 2 when the command line, a value or a file was wrong."
)]
pub struct Arguments {
    /// What to do; without it, a mission is flown.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// What the program can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Fly a mission in simulation and write its log and report.
    Fly(FlyOptions),
    /// Simulate a vehicle in real time for other programs, which fly it over UDP.
    Serve(ServeOptions),
    /// Serve the ground station's page, and MAVLink, for a vehicle at a serial port or behind TCP.
    Connect(ConnectOptions),
    /// Write a page that has a vehicle and its world inside: one file, no server (`cargo xtask demo` does all of it).
    Demo(DemoOptions),
    /// Fly a log again, bit for bit, from what came from outside.
    Replay(ReplayOptions),
    /// Look into a log, cut it, write it in other formats.
    #[command(subcommand)]
    Log(LogCommand),
    /// List the topics: type, policy, rate, publisher, readers.
    Topics(TopicsOptions),
    /// List the runnables: what activates them, budget, response time.
    Schedule(TopicsOptions),
    /// List what can go wrong in a flight: value, the worst end that is acceptable, meaning.
    Faults(TopicsOptions),
    /// Examine a vehicle before its first flight, step by step, and name what is wrong with it.
    Doctor(DoctorOptions),
    /// Print the mode machine: phases, transitions, guards, checks before arming.
    Modes(ModesOptions),
    /// Fly many missions with different seeds and summarise them.
    Campaign(CampaignOptions),
    /// Hardware in the loop: fly a vehicle at the other end of a serial port through the simulated world.
    Hil(HilOptions),
    /// List the ports of a vehicle: what programs may do there, and what stops others.
    Doors(TopicsOptions),
    /// Make the key of a vehicle, or show what stations need of it.
    #[command(subcommand)]
    Key(KeyCommand),
    /// Play the golden flight: does this machine compute what it should?
    Golden(GoldenOptions),
}

/// What `key` does.
#[derive(Debug, Subcommand)]
pub enum KeyCommand {
    /// Make a new key and a file for it that no other account can read.
    New {
        /// The file, which must not be there yet.
        file: PathBuf,
    },
    /// Print the pass-phrase of ground stations and programs that speak MAVLink. It is made of the key, and does not give it away.
    Mavlink {
        /// A file with the key.
        file: PathBuf,
    },
}

impl Default for Command {
    fn default() -> Self {
        Self::Fly(FlyOptions::default())
    }
}

/// Which vehicle.
#[derive(Clone, Debug, Args)]
pub struct VehicleOption {
    /// The vehicle: one of those that `stampfly --help` lists.
    #[arg(long = "vehicle", value_name = "NAME", default_value = vehicles::DEFAULT, value_parser = clap::builder::PossibleValuesParser::new(vehicles::NAMES))]
    pub name: String,
}

impl Default for VehicleOption {
    fn default() -> Self {
        Self { name: vehicles::DEFAULT.into() }
    }
}

/// How the mode machine is printed.
#[derive(Debug, Args)]
pub struct ModesOptions {
    /// As Markdown, which is the only form there is.
    #[arg(long)]
    pub markdown: bool,
}

/// Options of `doctor`.
#[derive(Clone, Debug, Args)]
pub struct DoctorOptions {
    /// The vehicle's serial port. Without this: the only one that looks like a vehicle's.
    #[arg(long, value_name = "PORT", conflicts_with = "emulated")]
    pub port: Option<String>,
    /// Examine a vehicle that is emulated on this computer instead, with this fault if one is named (see `--list-faults`).
    #[arg(long, value_name = "FAULT", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    pub emulated: Option<String>,
    /// Seed of the emulated vehicle: another specimen.
    #[arg(long, default_value_t = 1, requires = "emulated")]
    pub seed: u64,
    /// Where everything that was found and said is written, to be sent with a report.
    #[arg(long, value_name = "FILE", default_value = "doctor.txt")]
    pub out: PathBuf,
    /// Do not ask whether the propellers are off: they are.
    #[arg(long)]
    pub yes: bool,
    /// List the faults of emulated vehicles.
    #[arg(long)]
    pub list_faults: bool,
}

/// Options of `topics`, `schedule`, `faults` and `doors`.
#[derive(Clone, Debug, Args)]
pub struct TopicsOptions {
    #[command(flatten)]
    pub vehicle: VehicleOption,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
    /// Print Markdown, as in `docs`.
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,
}

/// Reads a time up to a day.
fn seconds(text: &str) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| format!("'{text}' is no number"))?;
    if (0.0..=86_400.0).contains(&value) { Ok(value) } else { Err("0 to 86400 seconds".into()) }
}
