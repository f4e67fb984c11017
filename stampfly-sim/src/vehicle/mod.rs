//! A whole vehicle in simulation: its flight stack, and what is around it.
//!
//! | part | what it is |
//! |---|---|
//! | [`Vehicle`] | what a vehicle tells the programs that fly it: its runnables, options, surroundings, verdict |
//! | [`Surroundings`], [`Around`] | the world, the drivers and the pilot of one flight |
//! | [`fly`], [`Flying`] | one flight on virtual time, at once or turn by turn |
//! | [`Remote`], [`fly_remote`] | the same with the runnables on a vehicle at the other end of a line |
//! | [`Script`], [`Scripted`] | surroundings without a world: only who drives, and a judge |
//! | [`Scenario`] | what to command and what must be true, as text |
//! | [`Live`], [`Ports`], [`Link`] | other programs fly it, in real time |
//! | [`change`] | other parameters for a vehicle in flight |
//! | [`Witness`] | is told everything that happens: a log, a hash, a test |
//!
//! A program that flies vehicles (missions, campaigns, replay, report) knows them through [`Vehicle`] alone, so a new
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

/// The ends of everybody outside a vehicle's runnables.
pub type Outside<'b, R> = <<R as Schedule>::Topics as TopicTable>::Outside<'b>;

/// What is around a vehicle: everything that lives for one flight and that tasks may borrow.
pub trait Surroundings {
    /// The vehicle's runnables.
    type Runnables: Schedule;
    /// How a flight went.
    type Outcome;
    /// What the executor calls while it flies.
    type Around<'a>: Around<Runnables = Self::Runnables, Outcome = Self::Outcome>
    where
        Self: 'a;

    /// The clock that everything here shares.
    fn clock(&self) -> Clock;

    /// May somebody there want the compact record of the flight, as at a vehicle's port, and what is the vehicle's name in it? Asked before the flight. A
    /// [witness](Witness::record_of) that wants it has it alone.
    fn record_of(&self) -> Option<&'static str> {
        None
    }

    /// Starts the tasks of drivers, links and pilots, and hands each the ends it owns.
    fn start<'a>(&'a mut self, tasks: &mut Tasks<'a>, outside: Outside<'a, Self::Runnables>) -> Self::Around<'a>;
}

/// What is around a vehicle, as the executor sees it during a flight.
pub trait Around {
    /// The vehicle's runnables.
    type Runnables: Schedule;
    /// How the flight went.
    type Outcome;

    /// The flight band has run: hands its outputs to the actuators.
    fn drive(&mut self, now: Instant);

    /// Is this band's processor held up, so that nothing of the band runs now? Never by default.
    fn is_held_up(&mut self, _band: Band, _now: Instant) -> bool {
        false
    }

    /// A turn of the executor has ended: hands slower outputs on (lights, sound). Nothing by default.
    fn show(&mut self, _now: Instant) {}

    /// A sample was published, by whomever.
    fn published(&mut self, _topic: usize, _at: Instant, _words: &[u32]) {}

    /// A moment of rest: puts into the vehicle what somebody has changed of it, and tells the observer. Was there something? A log says so. Nothing by default.
    fn tend(
        &mut self,
        _flight_loop: &mut FlightLoop<'_, Self::Runnables>,
        _observer: &mut dyn flight_loop::Observer,
    ) -> bool {
        false
    }

    /// The compact record, at the end of every turn, if it [may be wanted](Surroundings::record_of): whoever takes it says so there.
    fn stream(&mut self, _now: Instant, _chunks: &mut dyn Chunks) {}

    /// Everything published so far has been passed on. Hands samples that belong into the log but are on no topic (the
    /// truth) to `record`: place in [`Vehicle::BESIDE`], instant, generation, words.
    fn beside(&mut self, _record: &mut dyn FnMut(usize, Instant, u32, &[u32])) {}

    /// What is going on, for a progress bar: the share that is done, and a word.
    fn progress(&self) -> (f32, &'static str);

    /// Is there nothing more to fly?
    fn is_over(&mut self, now: Instant) -> bool;

    /// How the flight went.
    fn finish(self) -> Self::Outcome;
}

/// One figure of a flight: name, unit, value; `None` where the flight had no such phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Name with its unit, as scripts use it: `pos_rms_m`.
    pub name: &'static str,
    /// Unit, for people.
    pub unit: &'static str,
    /// The value.
    pub value: Option<f64>,
}

impl Figure {
    /// The name for people: words, and no unit, which stands beside it.
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

/// How a flight of a vehicle went, as programs report it.
pub trait Verdict {
    /// Did the vehicle do what it was to do, without ever doing what it must not?
    fn succeeded(&self) -> bool {
        self.facts().iter().all(|(_, holds)| *holds)
    }

    /// Yes-or-no results by name, for scripts: `landed`, `disarmed`. All hold in a flight that succeeded.
    fn facts(&self) -> Vec<(&'static str, bool)>;

    /// The figures, the same names in the same order for every flight of the vehicle.
    fn figures(&self) -> Vec<Figure>;

    /// What came of faults, or whatever else scripts want to know: fields of the JSON object that describes the flight.
    /// None by default.
    fn findings(&self) -> impl Serialize {
        NoFindings {}
    }

    /// What else people want to read after a flight, one line each: phases, extremes.
    fn story(&self) -> Vec<String>;

    /// One sentence.
    fn sentence(&self) -> String;

    /// Files that belong to the flight beside its log and report: name and contents. None by default.
    fn files(&self) -> Vec<(&'static str, String)> {
        Vec::new()
    }
}

/// [`Verdict::findings`] of a vehicle that has none.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NoFindings {}

/// Why a flight cannot be set up: a sentence for whoever typed the options.
pub type SetupError = String;

/// How kind the world is to a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WorldKind {
    /// [`Conditions::GENTLE`](crate::Conditions::GENTLE).
    #[default]
    Gentle,
    /// [`Conditions::harsh`](crate::Conditions::harsh), of each flight's seed.
    Harsh,
}

impl WorldKind {
    /// Its name, as it is typed.
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

/// Options of a flight as they are typed. A vehicle refuses what it has no use for.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Options {
    /// A mission: a built-in name or a file.
    pub mission: Option<String>,
    /// `NAME=VALUE` of the simulated vehicle or its surroundings.
    pub plant: Vec<String>,
    /// How kind the world is. What [`plant`](Self::plant) names it does not decide.
    #[serde(skip_serializing_if = "WorldKind::is_gentle")]
    pub world: WorldKind,
    /// `NAME=VALUE` of the flight stack's parameters.
    pub param: Vec<String>,
    /// Strength of vibration; 1 is what was recorded.
    pub vibration: Option<f64>,
    /// Standard deviation of gusts, m/s.
    pub gust: Option<f32>,
    /// Mean wind towards north and east, m/s.
    pub wind: Option<[f32; 2]>,
    /// Run the real drivers over emulated chips.
    pub chips: bool,
    /// Let a motion capture system watch.
    pub cameras: bool,
    /// Seed of the executor's delays.
    pub jitter: Option<u64>,
    /// Faults, as [`Fault::parse`](crate::fault::Fault::parse) reads them.
    pub fault: Vec<String>,
    /// Fly with a pilot's sticks, in this flight mode; empty is the vehicle's own choice.
    pub pilot: Option<String>,
    /// Fly what is in a stick file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sticks: Option<StickOptions>,
    /// Fly on where a protection stops the motors in the air: to find out whether that was right. A
    /// simulator's option alone.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    pub flies_on: bool,
    /// Fly what other programs ask for; not written down, because it is not repeatable.
    #[serde(skip)]
    pub live: Option<Live>,
}

impl Options {
    /// The faults, as this vehicle's table has them.
    ///
    /// # Errors
    /// When one is not in the table, or not as the table says.
    pub fn faults(&self, table: &'static [FaultKind]) -> Result<Vec<Fault>, SetupError> {
        let faults = self.fault.iter().map(|text| Fault::parse(text, table));
        faults.collect::<Result<_, _>>().map_err(|error| format!("--fault {error}"))
    }

    /// Changes of the world what these options say of it: how kind it is, vibration, wind, gusts, the simulated vehicle. The seed is the
    /// simulation's.
    ///
    /// # Errors
    /// When a number makes no sense, or has no name, or when the numbers are no vehicle together.
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
        // In any order, so what they are together is looked at when all are there.
        simulation.check().map_err(|error| format!("--plant {error}"))
    }

    /// Names and values of [`param`](Self::param).
    ///
    /// # Errors
    /// When one is not `NAME=VALUE`.
    pub fn parameters(&self) -> Result<Vec<(&str, f32)>, SetupError> {
        let pairs = self.param.iter().map(|text| {
            let pair = text.split_once('=').and_then(|(name, value)| Some((name.trim(), value.trim().parse().ok()?)));
            pair.ok_or_else(|| format!("--param '{text}' is not NAME=VALUE"))
        });
        pairs.collect()
    }
}

/// The value, if it is a number in its range.
fn within<T: PartialOrd + fmt::Display>(name: &str, value: T, low: T, high: T) -> Result<T, SetupError> {
    if low <= value && value <= high { Ok(value) } else { Err(format!("{name} {value} is not from {low} to {high}")) }
}

/// Splits `name=value`.
fn assignment(text: &str) -> Result<(&str, f64), SetupError> {
    let (name, value) = text.split_once('=').ok_or_else(|| format!("'{text}' is not NAME=VALUE"))?;
    let value = value.trim().parse().map_err(|_| format!("'{text}': '{value}' is no number"))?;
    Ok((name.trim(), value))
}

/// One number that options can change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Name, as `--plant` or `--param` takes it.
    pub name: &'static str,
    /// Value now.
    pub value: f64,
    /// SI unit.
    pub unit: &'static str,
    /// What it does.
    pub meaning: &'static str,
}

/// What the flights of a campaign vary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Variety {
    /// Flight modes of a pilot, as [`Options::pilot`] takes them.
    pub modes: &'static [&'static str],
    /// Missions, as [`Options::mission`] takes them; the first is short and has every usual moment
    /// at which a fault can begin.
    pub missions: &'static [&'static str],
    /// Missions for the moments that do not come in those, in the order in which they are looked
    /// through for one.
    pub occasions: &'static [&'static str],
    /// Faults that begin at a time begin within these, s since power-on: from before the vehicle is armed until the shortest mission is about to land.
    pub times: [u16; 2],
    /// Can the real drivers run over emulated chips?
    pub chips: bool,
}

impl Variety {
    /// Nothing is varied.
    pub const NONE: Self = Self { modes: &[], missions: &[], occasions: &[], times: [3, 12], chips: false };
}

/// A vehicle's golden flight: how it is flown, and how its record is judged.
pub struct Golden<V: Vehicle + ?Sized> {
    /// The flight, as short as can be.
    pub setup: V::Setup,
    /// The record that the program carries.
    pub record: &'static [u8],
    /// The topic whose numbers are compared.
    pub output: usize,
    /// Largest deviation of a number that may still be rounding.
    pub tolerance: f32,
    /// The sensor that activates the flight band. Now and then all other topics `sensor_…` are new at once, which is what a
    /// step costs most.
    pub leading: usize,
    /// When the vehicle last changed its state.
    pub settled: fn(&V::Outcome) -> Option<Instant>,
}

/// A vehicle that programs can fly.
pub trait Vehicle: 'static {
    /// Its name on the command line, and as `sys_name` in its logs.
    const NAME: &'static str;
    /// Topics that its surroundings add to the log. None by default.
    const BESIDE: &'static [Topic] = &[];
    /// What can go wrong in its flights. None by default.
    const FAULTS: &'static [FaultKind] = &[];
    /// What the flights of a campaign vary. Nothing by default.
    const VARIETY: Variety = Variety::NONE;
    /// Where other programs reach it while it is live. Nowhere by default.
    const PORTS: &'static [PortSpec] = &[];
    /// What a page may ask of it while it is live, of [`ask::NAMES`]. Everything by default.
    const ASKS: &'static [&'static str] = ask::NAMES;
    /// What a page about a flight shows of it. By default a plot per topic and unit.
    const PAGE: Page = Page::EMPTY;
    /// Its runnables. Serialisable, so that a log can hold key frames.
    type Runnables: Schedule + Serialize + DeserializeOwned;
    /// All that decides a flight.
    type Setup: Clone + Send + Sync;
    /// How a flight went.
    type Outcome: Verdict + Send;

    /// The flight that options and a seed describe.
    ///
    /// # Errors
    /// When an option is wrong, or of no use to this vehicle.
    fn setup(options: &Options, seed: u64) -> Result<Self::Setup, SetupError>;

    /// The flight after this one, when somebody has asked the vehicle to restart. Never by default.
    #[must_use]
    fn again(_setup: &Self::Setup, _outcome: &Self::Outcome) -> Option<Self::Setup> {
        None
    }

    /// The same flight in options that do not depend on files, for a log: whoever has the log can fly it again. By default the
    /// options as they are.
    ///
    /// # Errors
    /// As [`setup`](Self::setup).
    fn settled(options: &Options, _seed: u64) -> Result<Options, SetupError> {
        Ok(options.clone())
    }

    /// How the executor flies it.
    fn options(setup: &Self::Setup) -> FlightOptions;

    /// The configuration of its flight stack.
    fn config(setup: &Self::Setup) -> &<Self::Runnables as Schedule>::Config;

    /// Flies it in its surroundings, with [`fly`]. Written out for each vehicle, so that its whole flight is
    /// compiled once, in its own crate, and not again in every program and test.
    fn fly(
        setup: &Self::Setup,
        witness: &mut dyn Witness<Self::Runnables>,
        report: &mut dyn FnMut(f32, &'static str),
    ) -> Ended<Self::Outcome>;

    /// Flies it in its surroundings with its runnables at the other end of a line, with [`fly_remote`].
    ///
    /// # Errors
    /// As [`fly_remote`]; by default, that this vehicle does not offer it.
    fn fly_remote(
        _setup: &Self::Setup,
        _remote: &mut Remote<'_>,
        _witness: &mut dyn Witness<Self::Runnables>,
        _report: &mut dyn FnMut(f32, &'static str),
    ) -> Result<Ended<Self::Outcome>, RemoteError> {
        Err(RemoteError::NotOffered("hardware in the loop for this vehicle"))
    }

    /// The flight stack's configuration when nothing is changed.
    fn default_config() -> <Self::Runnables as Schedule>::Config;

    /// Every parameter of a configuration.
    fn parameters(config: &<Self::Runnables as Schedule>::Config) -> Vec<Setting>;

    /// Changes a parameter, as a log or an option says.
    ///
    /// # Errors
    /// When there is no such parameter, or the value is out of range.
    fn set_parameter(
        config: &mut <Self::Runnables as Schedule>::Config,
        name: &str,
        value: ParameterValue,
    ) -> Result<(), SetupError>;

    /// Lowest and highest value of a parameter, for people who choose one; `None` where the vehicle does not say.
    fn parameter_range(_name: &str) -> Option<[f64; 2]> {
        None
    }

    /// Do both configurations fly with the same components? One that begins has no state, so it cannot take over in flight. They do by default;
    /// components that the runnables' structure shows need no word here.
    fn has_same_components(
        _one: &<Self::Runnables as Schedule>::Config,
        _other: &<Self::Runnables as Schedule>::Config,
    ) -> bool {
        true
    }

    /// Its golden flight, if it has one.
    fn golden() -> Option<Golden<Self>> {
        None
    }

    /// The moments that come in a flight of these options when nothing goes wrong, in their order.
    /// By default the usual ones.
    fn moments(_options: &Options, _seed: u64) -> Vec<Moment> {
        Moment::USUAL.to_vec()
    }

    /// Missions that are over earlier than the one of these options, as [`Options::mission`] takes them, shortest first: for
    /// looking for the smallest flight in which something happens. None by default.
    fn shorter_missions(_options: &Options, _seed: u64) -> Vec<String> {
        Vec::new()
    }

    /// Every number of the simulated vehicle and its surroundings that options can change. None by default.
    fn plant(_setup: &Self::Setup) -> Vec<Setting> {
        Vec::new()
    }
}
