//! The command line.

use crate::failure::Failure;
use clap::{Args, Parser, Subcommand, ValueEnum};
use stampfly_board::simulation::StampFly;
use stampfly_board::{EstimatorKind, VehicleConfig};
use stampfly_host::campaign::shard::Shard;
use stampfly_host::connect::Place;
use stampfly_host::serve::PortOption;
use stampfly_host::vehicles;
use stampfly_lab::dataset::Kind;
use stampfly_lab::estimate::{Method, Suite, suite};
use stampfly_sim::vehicle::{Live, Options, Vehicle};
use std::net::SocketAddr;
use std::num::NonZero;
use std::path::PathBuf;

/// Flies the StampFly flight stack: in simulation, again from a log, over recorded data.
#[derive(Debug, Parser)]
#[command(
    name = "stampfly",
    version,
    after_help = "Exit code: 0 when all went well, 1 when a flight or a comparison did not, 2 when the command line was wrong."
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
    /// Run the estimator over recorded sensor data and say how good it is.
    Estimate(EstimateOptions),
    /// Hardware in the loop: fly a vehicle at the other end of a serial port through the simulated world.
    Hil(HilOptions),
    /// Play the golden flight: does this machine compute what it should?
    Golden(GoldenOptions),
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

/// What decides a simulated flight.
#[derive(Clone, Debug, Default, Args)]
pub struct SceneOptions {
    #[command(flatten)]
    pub vehicle: VehicleOption,
    /// Mission to fly: a file, its text with `;` between steps (StampFly: `arm; takeoff 0.5; land`), or one that the vehicle
    /// knows by name (StampFly: `square`, `hover`, `random`; rover: `course`, and its CSV logs).
    #[arg(long, value_name = "FILE")]
    pub mission: Option<String>,
    /// Change a number of the simulated vehicle or its surroundings (see `--list`).
    #[arg(long, value_name = "NAME=VALUE")]
    pub plant: Vec<String>,
    /// Change a parameter of the flight stack (see `--list`).
    #[arg(long, value_name = "NAME=VALUE")]
    pub param: Vec<String>,
    /// Strength of propeller vibration; 1 is what was recorded, 0 is none.
    #[arg(long, value_name = "K")]
    pub vibration: Option<f64>,
    /// Standard deviation of gusts, m/s.
    #[arg(long, value_name = "M/S")]
    pub gust: Option<f32>,
    /// Mean wind towards north and east, m/s.
    #[arg(long, value_name = "N,E", value_parser = north_and_east, allow_hyphen_values = true)]
    pub wind: Option<[f32; 2]>,
    /// Run the real drivers over emulated chips instead of sensor models.
    #[arg(long)]
    pub chips: bool,
    /// Let a motion capture system watch: poses at 100 Hz, 30 ms late.
    #[arg(long)]
    pub cameras: bool,
    /// Let something go wrong; may be repeated. WHEN is ground, spool, takeoff, hover, move, landing, touch, or a number of
    /// seconds; +SECONDS is how long it lasts (see `stampfly faults`).
    #[arg(long, value_name = "NAME[=VALUE]@WHEN[+SECONDS]")]
    pub fault: Vec<String>,
    /// Fly the mission with the sticks of a simulated pilot.
    #[arg(long)]
    pub pilot: bool,
    /// The pilot's flight mode (StampFly: stabilize, acro, althold, poshold).
    #[arg(long, value_name = "MODE", requires = "pilot")]
    pub mode: Option<String>,
    /// Delay and interrupt the executor, by this seed.
    #[arg(long, value_name = "SEED")]
    pub jitter: Option<u64>,
    /// Show what `--plant` and `--param` can change, and their values.
    #[arg(long)]
    pub list: bool,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Options of `fly`.
#[derive(Clone, Debug, Args)]
pub struct FlyOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for `flight.ulg` and `flight.html`.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
    /// Fly a flight of a campaign again, and compare its hash: exit code 1 when it is another.
    #[arg(long, value_name = "FILE", requires = "row", conflicts_with_all = ["mission", "plant", "param", "vibration", "gust", "wind", "chips", "cameras", "fault", "pilot", "jitter", "seed"])]
    pub from: Option<PathBuf>,
    /// Which one: its row in the file, from 0.
    #[arg(long, value_name = "N", requires = "from")]
    pub row: Option<usize>,
}

impl Default for FlyOptions {
    fn default() -> Self {
        Self { scene: SceneOptions::default(), seed: 1, out: ".".into(), from: None, row: None }
    }
}

/// Options of `serve`.
#[derive(Clone, Debug, Args)]
pub struct ServeOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    /// Seed of everything random. The second vehicle has the next one, and so on.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for the log and the report.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
    /// How many vehicles. The ports of each are ten numbers above those of the one before it.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=32))]
    pub count: u8,
    /// Where a port is to be, or not at all: `mavlink-tcp=5760`, `console=0.0.0.0:2323`, `mavlink-udp=off`; may be repeated. Number
    /// 0 is any that is free. Who is heard there is not authenticated, but at MAVLink's ports, see `--key`: leave the others on this
    /// machine, or in a network of your own.
    #[arg(long, value_name = "NAME=ADDRESS")]
    pub port: Vec<PortOption>,
    /// A file with a key of 64 hexadecimal digits, as `openssl rand -hex 32` makes one. MAVLink's ports that others than programs on this
    /// machine reach sign with it and believe nothing that is not signed with it; without it they are not opened.
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,
    /// Ask for the key at ports that only programs on this machine reach, too: others may have an account there.
    #[arg(long, requires = "key")]
    pub sign_all: bool,
    /// The same as `--port listen=ADDRESS`.
    #[arg(long, value_name = "ADDRESS")]
    pub listen: Option<SocketAddr>,
    /// Send the compact record of the flight there, a datagram a chunk, while it is flown: `127.0.0.1:5006`. Of the n-th vehicle ten
    /// numbers higher each. `stampfly log receive` writes it to a file.
    #[arg(long, value_name = "ADDRESS")]
    pub record: Option<SocketAddr>,
    /// For how long, in the vehicle's seconds. Without this: until Ctrl-C.
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    pub seconds: Option<f32>,
    /// How fast its time passes, 0.1 to 100; 1 is real time. Slower gives busy machines and debuggers time.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed)]
    pub speed: f32,
}

/// Options of `connect`.
#[derive(Clone, Debug, Args)]
pub struct ConnectOptions {
    /// The vehicle's serial port, such as /dev/ttyACM0, or tcp:HOST:PORT. Without this: the only one that looks like a vehicle's. One
    /// that is not there, or not any more, is waited for.
    #[arg(value_name = "PATH|tcp:HOST:PORT")]
    pub place: Option<Place>,
    #[command(flatten)]
    pub vehicle: VehicleOption,
    /// Where a port is to be, or not at all: `http=8081`, `mavlink-tcp=off`; may be repeated. Number 0 is any that is free. Whoever
    /// reaches the page can fly the vehicle: leave it on this machine, or in a network of your own.
    #[arg(long, value_name = "NAME=ADDRESS")]
    pub port: Vec<PortOption>,
    /// Speed of the serial port, baud. USB has none.
    #[arg(long, value_name = "BAUD", default_value_t = 115_200, value_parser = clap::value_parser!(u32).range(1200..=10_000_000))]
    pub baud: u32,
    /// Asks the vehicle for its compact flight record, and writes it into this file: everything that a replay needs. `stampfly replay` and `stampfly log` read it.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Folder for the logs of what has come over the line.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
    /// For how long. Without this: until Ctrl-C.
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    pub seconds: Option<f32>,
}

/// Options of `demo`.
#[derive(Clone, Debug, Args)]
pub struct DemoOptions {
    /// The flight stack as WebAssembly: `stampfly-board/browser`, built.
    pub module: PathBuf,
    /// The file to write.
    #[arg(long, value_name = "FILE", default_value = "demo.html")]
    pub out: PathBuf,
}

/// What to do with a log.
#[derive(Clone, Debug, Subcommand)]
pub enum LogCommand {
    /// Vehicle, length, topics with their rates, gaps.
    Info {
        /// A ULog file, or a compact flight record.
        file: PathBuf,
        /// Print one JSON object on standard output.
        #[arg(long)]
        json: bool,
    },
    /// A table a topic.
    Csv {
        /// A ULog file, or a compact flight record.
        file: PathBuf,
        /// Only this topic; may be repeated.
        #[arg(long, value_name = "NAME")]
        topic: Vec<String>,
        /// Folder for the tables.
        #[arg(long, value_name = "DIR", default_value = ".")]
        out: PathBuf,
    },
    /// MCAP, for Foxglove and PlotJuggler.
    Mcap {
        /// A ULog file, or a compact flight record.
        file: PathBuf,
        /// Only this topic; may be repeated.
        #[arg(long, value_name = "NAME")]
        topic: Vec<String>,
        /// The file to write. Without this: beside the log.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Write a compact flight record to a file as it arrives, in datagrams, until none has come for three seconds.
    Receive {
        /// Where it arrives: `127.0.0.1:5006`.
        address: SocketAddr,
        /// The file to write.
        out: PathBuf,
        /// Not longer than this many seconds.
        #[arg(long = "for", value_name = "SECONDS", default_value_t = 86_400)]
        seconds: u32,
    },
    /// A compact flight record as a ULog, with everything that is published when it is run again.
    Ulog {
        /// A compact flight record.
        file: PathBuf,
        /// The file to write.
        out: PathBuf,
    },
    /// A part of a flight, which replays from its first key frame on.
    Cut {
        /// A ULog file, or a compact flight record.
        file: PathBuf,
        /// From when on, seconds since power-on.
        #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
        from: f64,
        /// Up to when.
        #[arg(long, value_name = "SECONDS", default_value_t = 1e9)]
        to: f64,
        /// The file to write.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// A simulated flight again, with other parameters from an instant on, and both courses beside one another.
    Refly {
        /// The log of a flight of `stampfly fly`.
        file: PathBuf,
        /// From when on, seconds since power-on.
        #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
        from: f64,
        /// Change a parameter; may be repeated.
        #[arg(long, value_name = "NAME=VALUE", required = true)]
        param: Vec<String>,
        /// The report to write; the new flight's log is written beside it. Without this: beside the log.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Print one JSON object on standard output.
        #[arg(long)]
        json: bool,
    },
}

/// Options of `hil`.
#[derive(Clone, Debug, Args)]
pub struct HilOptions {
    #[command(flatten)]
    pub fly: FlyOptions,
    /// The vehicle's serial port. Without this: the only one that looks like a vehicle's.
    #[arg(long, value_name = "PORT")]
    pub port: Option<String>,
    /// Fly a vehicle in this program instead: the same conversation, without a line.
    #[arg(long, conflicts_with_all = ["port", "program"])]
    pub emulated: bool,
    /// Fly one in a program that speaks over its standard input and output, such as an emulator.
    #[arg(long, value_name = "COMMAND", conflicts_with = "port")]
    pub program: Option<String>,
    /// Ask for each step when its time has come, and say how late the answers were. Without this the vehicle's time passes as
    /// fast as the line allows.
    #[arg(long)]
    pub real_time: bool,
}

/// Options of `golden`.
#[derive(Clone, Debug, Args)]
pub struct GoldenOptions {
    #[command(flatten)]
    pub vehicle: VehicleOption,
    /// Fly and record it again, into this file.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Options of `campaign`.
#[derive(Clone, Debug, Args)]
pub struct CampaignOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    /// Compare the estimator's errors and innovations with its covariance (NEES, NIS), and judge by that. Meant for
    /// `--mission random --flights 500`.
    #[arg(long)]
    pub consistency: bool,
    /// How many flights; 2000 with `--faults`.
    #[arg(long, value_name = "N", default_value_t = 100, default_value_if("faults", "true", "2000"), value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub flights: u64,
    /// Seed of the first flight; the others count up from there.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Fly through what can go wrong: every fault at every moment in every mode, then faults, values, moments, missions and
    /// surroundings at random. Every flight must end as its fault allows (`stampfly faults`).
    #[arg(long, conflicts_with_all = ["consistency", "fault", "pilot"])]
    pub faults: bool,
    #[command(flatten)]
    pub of_faults: FaultCampaignOptions,
}

/// Options of `campaign --faults`.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Campaign of faults")]
pub struct FaultCampaignOptions {
    /// Let half of the random flights have two faults.
    #[arg(long, requires = "faults")]
    pub pairs: bool,
    /// Confine all flights to these faults: each at every moment in every mode, again and again with other seeds.
    #[arg(long, value_name = "NAME[=VALUE],…", value_delimiter = ',', requires = "faults", conflicts_with = "pairs")]
    pub only: Vec<String>,
    /// Folder for the flights (Parquet) and the tables (HTML, CSV). Flights that are already there are not flown again.
    #[arg(long, value_name = "DIR", default_value = "campaign", requires = "faults")]
    pub out: PathBuf,
    /// Fly every flight again, whatever is in the folder.
    #[arg(long, requires = "faults")]
    pub again: bool,
    /// Divide the campaign into so many files.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "faults", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub shards: u64,
    /// Fly only shard I of N, with I from 0 to N - 1, and write its file. `auto/N` takes I from HQ_TASK_ID (HyperQueue),
    /// SLURM_ARRAY_TASK_ID (Slurm) or JOB_COMPLETION_INDEX (Kubernetes). Exit code 0 when the file is written, whatever
    /// became of the flights; the same command with `--shards N` sums up.
    #[arg(long, value_name = "I/N", requires = "faults", conflicts_with = "shards")]
    pub shard: Option<Shard>,
    /// What flies: this program; HyperQueue's server, one task a shard; or Slurm, by a script that is written into DIR.
    #[arg(long, value_enum, default_value_t = Engine::Local, requires = "faults", conflicts_with = "shard")]
    pub engine: Engine,
    /// Fly on so many cores instead of all.
    #[arg(long, value_name = "N", requires = "faults")]
    pub threads: Option<NonZero<usize>>,
}

/// What flies a campaign of faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// This program.
    #[default]
    Local,
    /// HyperQueue.
    Hq,
    /// Slurm.
    Slurm,
}

/// Options of `replay`.
#[derive(Clone, Debug, Args)]
pub struct ReplayOptions {
    /// The log, or a compact flight record.
    pub file: PathBuf,
    /// The vehicle, for a log that does not name its own.
    #[arg(long, value_name = "NAME")]
    pub vehicle: Option<String>,
    /// Start at the first key frame after this many seconds on the vehicle's clock, instead of at power-on.
    #[arg(long, value_name = "SECONDS")]
    pub from: Option<f64>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Options of `topics`, `schedule` and `faults`.
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

/// The estimators of the family.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EstimatorChoice {
    /// Error-state Kalman filter.
    Eskf,
    /// Complementary filter.
    Complementary,
    /// Attitude filter: neither position nor velocity.
    Attitude,
}

/// Options of `estimate`.
#[derive(Clone, Debug, Args)]
pub struct EstimateOptions {
    /// StampFly logs and captures (CSV), NanoBench and BROAD (NPZ), PX4 replays (CSV).
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Which estimator. Without this: the attitude filter where nothing measures a position (BROAD), elsewhere the
    /// error-state Kalman filter.
    #[arg(long, value_enum)]
    pub estimator: Option<EstimatorChoice>,
    /// Change a parameter of the flight stack (`stampfly fly --list` shows them).
    #[arg(long, value_name = "NAME=VALUE")]
    pub param: Vec<String>,
    /// Folder for a report per recording, `estimate_NAME.html`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

impl EstimateOptions {
    /// The tuning for one kind of recording, with what the options change.
    pub fn suite(&self, kind: Kind) -> Result<Suite, Failure> {
        let mut suite = suite(kind);
        let mut flown = |kind| (suite.method, suite.vehicle.estimator) = (Method::Vehicle, kind);
        match self.estimator {
            Some(EstimatorChoice::Eskf) => flown(EstimatorKind::Eskf),
            Some(EstimatorChoice::Complementary) => flown(EstimatorKind::Complementary),
            Some(EstimatorChoice::Attitude) => suite.method = Method::Attitude,
            None => {}
        }
        set_parameters(&mut suite.vehicle, &self.param)?;
        Ok(suite)
    }
}

/// Applies `--param`.
fn set_parameters(config: &mut VehicleConfig, texts: &[String]) -> Result<(), Failure> {
    for text in texts {
        let (name, value) = text.split_once('=').ok_or_else(|| format!("'{text}' is not NAME=VALUE"))?;
        let value: f32 = value.trim().parse().map_err(|_| format!("'{text}': '{value}' is no number"))?;
        StampFly::set_parameter(config, name.trim(), value.into())
            .map_err(|error| format!("--param {text}: {error}"))?;
    }
    Ok(())
}

/// Reads a time up to a day.
fn seconds(text: &str) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| format!("'{text}' is no number"))?;
    if (0.0..=86_400.0).contains(&value) { Ok(value) } else { Err("0 to 86400 seconds".into()) }
}

/// Reads how fast time passes. At a hundredth other programs take the vehicle's silence between two answers for its end.
fn speed(text: &str) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| format!("'{text}' is no number"))?;
    if (0.1..=100.0).contains(&value) { Ok(value) } else { Err("0.1 to 100".into()) }
}

/// Reads `N,E`.
fn north_and_east(text: &str) -> Result<[f32; 2], String> {
    let parse = |part: &str| part.trim().parse().map_err(|_| format!("'{part}' is no number"));
    let (north, east) = text.split_once(',').ok_or("a wind has a part towards north and one towards east")?;
    Ok([parse(north)?, parse(east)?])
}

impl SceneOptions {
    /// The flight these options describe.
    pub fn setup<V: Vehicle>(&self, seed: u64, jitter: Option<u64>, live: Option<Live>) -> Result<V::Setup, Failure> {
        let options = Options { live, ..self.options(jitter) };
        Ok(V::setup(&options, seed)?)
    }

    /// The same as a vehicle takes them.
    pub fn options(&self, jitter: Option<u64>) -> Options {
        let Self { mission, plant, param, vibration, gust, wind, chips, cameras, fault, pilot, mode, .. } =
            self.clone();
        let pilot = pilot.then(|| mode.unwrap_or_default());
        Options { mission, plant, param, vibration, gust, wind, chips, cameras, jitter, fault, pilot, live: None }
    }

    /// Prints what can be changed.
    pub fn print_list<V: Vehicle>(&self, seed: u64) -> Result<(), Failure> {
        let setup = self.setup::<V>(seed, self.jitter, None)?;
        for (title, settings) in [("--param", V::parameters(V::config(&setup))), ("\n--plant", V::plant(&setup))] {
            outln!("{title}");
            for row in settings {
                outln!("  {:<30} {:>12} {:<18} {}", row.name, row.value, row.unit, row.meaning);
            }
        }
        Ok(())
    }
}
