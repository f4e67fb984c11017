//! A complete vehicle in simulation: its flight stack and its surroundings.
//!
//! | part | purpose |
//! |---|---|
//! | [`Vehicle`] | interface between a vehicle and the programs that fly it: runnables, options, surroundings, verdict |
//! | [`Surroundings`], [`Around`] | world, drivers and pilot of one flight |
//! | [`fly`], [`Flying`] | one flight on virtual time, in one call or turn by turn |
//! | [`Remote`], [`fly_remote`] | the same with the runnables on hardware at the other end of a line |
//! | [`Script`], [`Scripted`] | surroundings without a world, for a vehicle that simulates its own dynamics |
//! | [`Scenario`] | commands and checks as text |
//! | [`Live`], [`Ports`], [`Link`] | connection to other programs in real time |
//! | [`change`] | new parameters for a vehicle in flight |
//! | [`Witness`] | observer of all events of a flight: log, hash, test |
//!
//! Programs that fly vehicles (missions, campaigns, replay, report) use [`Vehicle`] only. A new
//! vehicle is a type that implements it.

pub mod change;
mod executor;
mod jitter;
mod live;
mod page;
mod processor;
mod recording;
mod remote;
mod scenario;
mod scripted;
pub mod table;
mod witness;

pub use executor::{Ended, FlightOptions, Flying, fly, fly_remote};
pub use live::{Client, Guard, Heard, Link, Live, PortSpec, Ports, Put, Signing, Speech, Speed, Transport};
pub use page::{Body, Motion, Observer, Page, PanelSpec, Pick};
pub use remote::{Figures, Port, Remote, RemoteError, Settings};
pub use scenario::Scenario;
pub use scripted::{Following, Script, Scripted};
pub use witness::Witness;

use crate::SimulationConfig;
use crate::ask;
use crate::fault::{Fault, FaultKind, Moment};
use crate::plant::Airframe;
use crate::sticks::StickOptions;
use crate::time::{Clock, Tasks};
use core::fmt;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use stampfly_bus::{Band, Schedule, TopicTable};
use stampfly_flight::compact::Chunks;
use stampfly_flight::{FlightLoop, flight_loop};
use stampfly_log::ulog::{ParameterValue, Topic};
use stampfly_param::parameters;
use stampfly_types::Instant;

/// Bus ends of all participants outside a vehicle's runnables.
pub type Outside<'b, R> = <<R as Schedule>::Topics as TopicTable>::Outside<'b>;

/// Surroundings of a vehicle: owns everything that lives for one flight and that tasks may borrow.
pub trait Surroundings {
    /// The vehicle's runnables.
    type Runnables: Schedule;
    /// Result of a flight.
    type Outcome;
    /// The part that the executor calls during the flight.
    type Around<'a>: Around<Runnables = Self::Runnables, Outcome = Self::Outcome>
    where
        Self: 'a;

    /// The clock shared by everything in these surroundings.
    fn clock(&self) -> Clock;

    /// The vehicle's name in the compact record if a participant here may request that record, as
    /// at a vehicle's port. Called before the flight. If a [witness](Witness::record_of) takes the
    /// record, these surroundings do not receive it.
    fn record_of(&self) -> Option<&'static str> {
        None
    }

    /// Starts the tasks of drivers, links and pilots, and gives each the bus ends that it owns.
    fn start<'a>(&'a mut self, tasks: &mut Tasks<'a>, outside: Outside<'a, Self::Runnables>) -> Self::Around<'a>;
}

/// Surroundings during a flight, as the executor calls them.
pub trait Around {
    /// The vehicle's runnables.
    type Runnables: Schedule;
    /// Result of the flight.
    type Outcome;

    /// Called after the flight band has run: passes its outputs to the actuators.
    fn drive(&mut self, now: Instant);

    /// True while the processor of this band is stalled, so that no runnable of the band runs.
    /// Never by default.
    fn is_held_up(&mut self, _band: Band, _now: Instant) -> bool {
        false
    }

    /// Called at the end of each executor turn: passes on slower outputs (lights, sound). Does
    /// nothing by default.
    fn show(&mut self, _now: Instant) {}

    /// Called for every published sample, whether a runnable or an outside participant published
    /// it.
    fn published(&mut self, _topic: usize, _at: Instant, _words: &[u32]) {}

    /// Called when no activation is pending: applies changes made from outside to the vehicle and
    /// reports them to the observer. Returns true if anything was changed, which the log then
    /// records. Does nothing by default.
    fn tend(
        &mut self,
        _flight_loop: &mut FlightLoop<'_, Self::Runnables>,
        _observer: &mut dyn flight_loop::Observer,
    ) -> bool {
        false
    }

    /// Called at the end of every turn with the compact record, if
    /// [requested](Surroundings::record_of). The receiver says through `chunks` whether it wants
    /// the record.
    fn stream(&mut self, _now: Instant, _chunks: &mut dyn Chunks) {}

    /// Called after all samples published so far have been passed on. Hands samples that are logged
    /// but are not on a topic (the truth) to `record`: index in [`Vehicle::BESIDE`], instant,
    /// generation, words.
    fn beside(&mut self, _record: &mut dyn FnMut(usize, Instant, u32, &[u32])) {}

    /// Progress for a progress bar: the share done, 0 to 1, and a word for the current activity.
    fn progress(&self) -> (f32, &'static str);

    /// True when there is nothing more to fly.
    fn is_over(&mut self, now: Instant) -> bool;

    /// Result of the flight.
    fn finish(self) -> Self::Outcome;
}

/// One figure of a flight. The value is `None` if the flight had no such phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Unit, for display.
    pub name: &'static str,
    /// Value in that unit.
    pub unit: &'static str,
    /// The value.
    pub value: Option<f64>,
}

impl Figure {
    /// The name for display: words without the unit.
    ///
    /// ```
    /// use stampfly_sim::vehicle::Figure;
    /// assert_eq!(Figure { name: "touchdown_speed_mps", unit: "m/s", value: None }.title(), "touchdown speed");
    /// assert_eq!(Figure { name: "laps", unit: "", value: None }.title(), "laps");
    /// ```
    #[must_use]
    pub fn title(&self) -> String {
        let without_unit =
            self.name.rsplit_once('_').filter(|_| !self.unit.is_empty()).map_or(self.name, |(name, _)| name);
        without_unit.replace('_', " ")
    }
}

/// Verdict on a flight, as programs report it.
pub trait Verdict {
    /// True if the vehicle fulfilled its task and violated no rule. By default all
    /// [facts](Self::facts) have to hold.
    fn succeeded(&self) -> bool {
        self.facts().iter().all(|(_, holds)| *holds)
    }

    /// Boolean results by name, for scripts: `landed`, `disarmed`. All hold in a successful flight.
    fn facts(&self) -> Vec<(&'static str, bool)>;

    /// The figures: the same names in the same order for every flight of the vehicle.
    fn figures(&self) -> Vec<Figure>;

    /// Further fields of the JSON object that describes the flight, such as the effect of faults.
    /// None by default.
    fn findings(&self) -> impl Serialize {
        NoFindings {}
    }

    /// Further lines for display after a flight: phases, extremes.
    fn story(&self) -> Vec<String>;

    /// The verdict in one sentence.
    fn sentence(&self) -> String;

    /// Additional files of the flight next to its log and report: name and contents. None by
    /// default.
    fn files(&self) -> Vec<(&'static str, String)> {
        Vec::new()
    }
}

/// [`Verdict::findings`] of a vehicle without findings.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NoFindings {}

/// Why a flight cannot be set up: a sentence for the user who gave the options.
pub type SetupError = String;

/// Kind of world in which a flight takes place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WorldKind {
    /// [`Conditions::GENTLE`](crate::Conditions::GENTLE): neutral conditions.
    #[default]
    Gentle,
    /// [`Conditions::harsh`](crate::Conditions::harsh), drawn from each flight's seed.
    Harsh,
}

impl WorldKind {
    /// Its name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gentle => "gentle",
            Self::Harsh => "harsh",
        }
    }

    fn is_gentle(&self) -> bool {
        *self == Self::Gentle
    }
}

impl fmt::Display for WorldKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl core::str::FromStr for WorldKind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let kinds = [Self::Gentle, Self::Harsh];
        kinds
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| format!("'{name}' is neither gentle nor harsh"))
    }
}

/// Options of a flight, as given on the command line. A vehicle refuses options that it does not
/// support.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Options {
    /// A mission: the name of a built-in one, or a file.
    pub mission: Option<String>,
    /// `NAME=VALUE` of the simulated vehicle or its conditions.
    pub plant: Vec<String>,
    /// Kind of world. Values given in [`plant`](Self::plant) take precedence.
    #[serde(skip_serializing_if = "WorldKind::is_gentle")]
    pub world: WorldKind,
    /// `NAME=VALUE` of the flight stack's parameters.
    pub param: Vec<String>,
    /// Amplitude of vibration relative to the recorded flights.
    pub vibration: Option<f64>,
    /// Standard deviation of gusts, m/s.
    pub gust: Option<f32>,
    /// Mean wind towards north and east, m/s.
    pub wind: Option<[f32; 2]>,
    /// Run the real drivers on emulated chips.
    pub chips: bool,
    /// Add a motion capture system.
    pub cameras: bool,
    /// Seed of the executor's delays; without it the executor is never late.
    pub jitter: Option<u64>,
    /// Faults in the syntax of [`Fault::parse`](crate::fault::Fault::parse).
    pub fault: Vec<String>,
    /// Fly with a model pilot on the sticks, in this flight mode; empty selects the vehicle's
    /// default.
    pub pilot: Option<String>,
    /// Fly a stick file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sticks: Option<StickOptions>,
    /// Continue to fly where a protection would stop the motors in the air, to find out whether
    /// stopping was right. Exists in simulation only.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    pub flies_on: bool,
    /// Fly what other programs request. Not serialised, because such a flight is not repeatable.
    #[serde(skip)]
    pub live: Option<Live>,
}

impl Options {
    /// The faults, parsed with this vehicle's table.
    ///
    /// # Errors
    /// If a fault is not in the table, or its value or moment is not allowed there.
    pub fn faults(&self, table: &'static [FaultKind]) -> Result<Vec<Fault>, SetupError> {
        let faults = self.fault.iter().map(|text| Fault::parse(text, table));
        faults.collect::<Result<_, _>>().map_err(|error| format!("--fault {error}"))
    }

    /// Applies these options to the simulation: kind of world, vibration, wind, gusts, parameters
    /// of the simulated vehicle. The seed remains that of the simulation.
    ///
    /// # Errors
    /// If a value is out of range, a name is unknown, or the parameters together do not describe a
    /// vehicle that can be simulated.
    pub fn change<A: Airframe>(&self, simulation: &mut SimulationConfig<A>) -> Result<(), SetupError> {
        if self.world == WorldKind::Harsh {
            *simulation = simulation.clone().in_harsh_world();
        }
        if let Some(vibration) = self.vibration {
            simulation.vibration = within("--vibration", vibration, 0.0, 20.0)?;
        }
        if let Some(gust) = self.gust {
            simulation.wind.gust = within("--gust", gust, 0.0, 20.0)?;
        }
        if let Some([north, east]) = self.wind {
            within("--wind north", north, -20.0, 20.0)?;
            within("--wind east", east, -20.0, 20.0)?;
            simulation.wind.mean = [north, east, 0.0].into();
        }
        for text in &self.plant {
            let (name, value) = assignment(text)?;
            parameters::set(simulation, name, value).map_err(|error| format!("--plant {text}: {error}"))?;
        }
        // Parameters come in any order, so combinations are checked after the last one.
        simulation.check().map_err(|error| format!("--plant {error}"))
    }

    /// Names and values in [`param`](Self::param).
    ///
    /// # Errors
    /// If an entry is not `NAME=VALUE`.
    pub fn parameters(&self) -> Result<Vec<(&str, f32)>, SetupError> {
        let pairs = self.param.iter().map(|text| {
            let pair = text.split_once('=').and_then(|(name, value)| Some((name.trim(), value.trim().parse().ok()?)));
            pair.ok_or_else(|| format!("--param '{text}' is not NAME=VALUE"))
        });
        pairs.collect()
    }
}

/// Returns the value if it is within its range; NaN is not.
fn within<T: PartialOrd + fmt::Display>(name: &str, value: T, low: T, high: T) -> Result<T, SetupError> {
    if low <= value && value <= high { Ok(value) } else { Err(format!("{name} {value} is not from {low} to {high}")) }
}

/// Splits `name=value`.
fn assignment(text: &str) -> Result<(&str, f64), SetupError> {
    let (name, value) = text.split_once('=').ok_or_else(|| format!("'{text}' is not NAME=VALUE"))?;
    let value = value.trim().parse().map_err(|_| format!("'{text}': '{value}' is no number"))?;
    Ok((name.trim(), value))
}

/// A parameter that options can change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Name, as `--plant` or `--param` takes it.
    pub name: &'static str,
    /// Present value.
    pub value: f64,
    /// SI unit.
    pub unit: &'static str,
    /// Its effect.
    pub meaning: &'static str,
}

/// Dimensions along which the flights of a campaign vary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Variety {
    /// Flight modes of the model pilot, as for [`Options::pilot`].
    pub modes: &'static [&'static str],
    /// Missions, as for [`Options::mission`]. The first is short and contains every usual moment at
    /// which a fault can begin.
    pub missions: &'static [&'static str],
    /// Missions for the other moments, searched in this order for the one that contains the moment.
    pub occasions: &'static [&'static str],
    /// Range of begin times of faults that begin at a time, s since power-on: from before arming
    /// until just before the shortest mission lands.
    pub times: [u16; 2],
    /// The real drivers can run on emulated chips.
    pub chips: bool,
}

impl Variety {
    /// No variation.
    pub const NONE: Self = Self { modes: &[], missions: &[], occasions: &[], times: [3, 12], chips: false };
}

/// A vehicle's golden flight: its setup and the limits for comparison with its record.
pub struct Golden<V: Vehicle + ?Sized> {
    /// The flight, as short as possible.
    pub setup: V::Setup,
    /// The record embedded in the program.
    pub record: &'static [u8],
    /// The topic whose values are compared.
    pub output: usize,
    /// Largest deviation of a value that rounding may cause.
    pub tolerance: f32,
    /// The sensor topic that activates the flight band. From time to time all other `sensor_…`
    /// topics have new samples in the same pass, which is the most expensive case.
    pub leading: usize,
    /// Instant of the vehicle's last state change.
    pub settled: fn(&V::Outcome) -> Option<Instant>,
}

/// A vehicle that programs can fly.
pub trait Vehicle: 'static {
    /// Its name on the command line, and as `sys_name` in its logs.
    const NAME: &'static str;
    /// Topics that its surroundings add to the log. None by default.
    const BESIDE: &'static [Topic] = &[];
    /// Faults that can be injected into its flights. None by default.
    const FAULTS: &'static [FaultKind] = &[];
    /// Variation in campaigns. None by default.
    const VARIETY: Variety = Variety::NONE;
    /// Ports at which other programs reach it while it is live. None by default.
    const PORTS: &'static [PortSpec] = &[];
    /// Requests that a page may make while it is live, from [`ask::NAMES`]. All by default.
    const ASKS: &'static [&'static str] = ask::NAMES;
    /// Layout of the page about a flight. By default a plot per topic and unit.
    const PAGE: Page = Page::EMPTY;
    /// Its runnables. Serialisable, so that a log can contain key frames.
    type Runnables: Schedule + Serialize + DeserializeOwned;
    /// Everything that determines a flight.
    type Setup: Clone + Send + Sync;
    /// Result of a flight.
    type Outcome: Verdict + Send;

    /// The flight that these options and this seed describe.
    ///
    /// # Errors
    /// If an option is invalid or not supported by this vehicle.
    fn setup(options: &Options, seed: u64) -> Result<Self::Setup, SetupError>;

    /// The next flight, if the vehicle was asked to restart. None by default.
    #[must_use]
    fn again(_setup: &Self::Setup, _outcome: &Self::Outcome) -> Option<Self::Setup> {
        None
    }

    /// The same flight in options without references to files, for a log, so that the log alone
    /// suffices to repeat it. By default the options unchanged.
    ///
    /// # Errors
    /// As [`setup`](Self::setup).
    fn settled(options: &Options, _seed: u64) -> Result<Options, SetupError> {
        Ok(options.clone())
    }

    /// Executor options of the flight.
    fn options(setup: &Self::Setup) -> FlightOptions;

    /// Configuration of its flight stack.
    fn config(setup: &Self::Setup) -> &<Self::Runnables as Schedule>::Config;

    /// Flies it in its surroundings with [`fly`]. Each vehicle implements it, so that its whole
    /// flight is compiled once, in its own crate, instead of in every program and test.
    fn fly(
        setup: &Self::Setup,
        witness: &mut dyn Witness<Self::Runnables>,
        report: &mut dyn FnMut(f32, &'static str),
    ) -> Ended<Self::Outcome>;

    /// Flies it in its surroundings with its runnables at the other end of a line, with
    /// [`fly_remote`].
    ///
    /// # Errors
    /// As [`fly_remote`]. By default [`RemoteError::NotOffered`].
    fn fly_remote(
        _setup: &Self::Setup,
        _remote: &mut Remote<'_>,
        _witness: &mut dyn Witness<Self::Runnables>,
        _report: &mut dyn FnMut(f32, &'static str),
    ) -> Result<Ended<Self::Outcome>, RemoteError> {
        Err(RemoteError::NotOffered("hardware in the loop for this vehicle"))
    }

    /// Default configuration of the flight stack.
    fn default_config() -> <Self::Runnables as Schedule>::Config;

    /// All parameters of a configuration.
    fn parameters(config: &<Self::Runnables as Schedule>::Config) -> Vec<Setting>;

    /// Sets a parameter, as a log or an option gives it.
    ///
    /// # Errors
    /// If no parameter has this name or the value is out of range.
    fn set_parameter(
        config: &mut <Self::Runnables as Schedule>::Config,
        name: &str,
        value: ParameterValue,
    ) -> Result<(), SetupError>;

    /// Range of a parameter for display; `None` if the vehicle does not define it.
    fn parameter_range(_name: &str) -> Option<[f64; 2]> {
        None
    }

    /// True if both configurations use the same components. A component that is started in flight
    /// has no state and cannot take over. True by default; differences visible in the structure of
    /// the serialised runnables need not be reported here.
    fn has_same_components(
        _one: &<Self::Runnables as Schedule>::Config,
        _other: &<Self::Runnables as Schedule>::Config,
    ) -> bool {
        true
    }

    /// Its golden flight. None by default.
    fn golden() -> Option<Golden<Self>> {
        None
    }

    /// The moments that occur in a fault-free flight of these options, in order. By default the
    /// usual ones.
    fn moments(_options: &Options, _seed: u64) -> Vec<Moment> {
        Moment::USUAL.to_vec()
    }

    /// Missions shorter than the one of these options, as for [`Options::mission`], shortest first:
    /// for shrinking a failing flight. None by default.
    fn shorter_missions(_options: &Options, _seed: u64) -> Vec<String> {
        Vec::new()
    }

    /// All parameters of the simulated vehicle and its conditions that options can change. None by
    /// default.
    fn plant(_setup: &Self::Setup) -> Vec<Setting> {
        Vec::new()
    }
}
