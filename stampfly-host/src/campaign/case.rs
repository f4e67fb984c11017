//! Which flight is number N of a campaign: a function of the campaign and of N, and of nothing else.
//!
//! So a campaign is flown in parts, on any machines and in any order, without anybody who hands out work.
//!
//! The first flights walk through every *cell*: first without a fault, then every fault of the
//! vehicle's table, with its usual value, at every moment, under a program's commands and then in
//! every mode of a pilot. A moment that does not come in the shortest mission has a mission of its
//! own. The others draw fault, size, moment, duration, mode, mission and surroundings from the
//! flight's seed, and one in ten of them has no fault; with [`Plan::pairs`], half of those with a
//! fault have two. With [`Plan::drawn`], all flights are of this kind. With [`Plan::only`], the
//! cells are of these faults alone, and all flights walk through them, again and again with other
//! seeds; with both, the faults are drawn from these, with any size.

use crate::vehicles::DEFAULT;
use serde::{Deserialize, Serialize};
use stampfly_sim::Noise;
use stampfly_sim::fault::{Fault, FaultKind, FaultValue, Moment, When};
use stampfly_sim::sticks::StickOptions;
use stampfly_sim::vehicle::{Options, SetupError, Vehicle, WorldKind};
use stampfly_types::Duration;

/// Random number stream of campaigns; those of vehicles, missions and faults are others.
const STREAM: u64 = 1_100;

/// Shortest and longest duration, s.
const LASTS: [f64; 2] = [0.05, 10.0];
/// Strongest gusts, m/s: half more than in the reference mission.
const GUST: f64 = 0.8;
/// Share of drawn flights without a fault.
const NOMINAL: f64 = 0.1;

/// A campaign: everything that decides which flights it has.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Plan {
    /// Seed of the first flight; the others count up.
    pub seed: u64,
    /// How many flights.
    pub flights: u64,
    /// Are there flights with two faults?
    pub pairs: bool,
    /// Are all flights drawn, and none of a cell?
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub drawn: bool,
    /// Faults as `NAME[=VALUE]` to which all flights are confined; empty for a campaign of all faults.
    pub only: Vec<String>,
    /// What all flights have in common. Each has its own fault and pilot, so these two are empty.
    pub options: Options,
}

/// One flight of a campaign.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Its number in the campaign, from zero.
    pub index: u64,
    /// Its seed.
    pub seed: u64,
    /// Everything else that decides it.
    pub options: Options,
}

/// A cell of a campaign's first flights.
#[derive(Clone, Debug, PartialEq)]
struct Cell {
    /// `NAME[=VALUE]@WHEN`; nothing for a flight without a fault.
    fault: Option<String>,
    /// Of a pilot.
    mode: Option<&'static str>,
    /// Nothing is the one of the campaign's options.
    mission: Option<&'static str>,
}

/// Which moments come in flights of this mission and mode.
type Moments = fn(&Options, u64) -> Vec<Moment>;

/// The flights of a campaign.
#[derive(Clone, Debug)]
pub struct Cases {
    vehicle: &'static str,
    plan: Plan,
    faults: &'static [FaultKind],
    /// Those that are drawn.
    drawn: Vec<&'static FaultKind>,
    modes: &'static [&'static str],
    /// Nothing is the one of the campaign's options.
    missions: Vec<Option<&'static str>>,
    moments: Moments,
    times: [u16; 2],
    chips: bool,
    cells: Vec<Cell>,
}

impl Cases {
    /// The flights of this campaign of this vehicle.
    ///
    /// # Errors
    /// When one of [`Plan::only`] is not a fault of the vehicle.
    pub fn new<V: Vehicle>(plan: &Plan) -> Result<Self, SetupError> {
        let variety = V::VARIETY;
        // Every one of the vehicle's, or the one that all flights have.
        let missions = match plan.options.mission {
            Some(_) => vec![None],
            None => variety.missions.iter().chain(variety.occasions).copied().map(Some).collect(),
        };
        let mut kinds = Vec::new();
        for text in &plan.only {
            let fault = Fault::parse(&format!("{text}@0"), V::FAULTS).map_err(|error| format!("--only {error}"))?;
            if plan.drawn && fault.kind.name != text {
                return Err(format!("--only {text}: with --drawn, sizes are drawn, and a fault has its name alone"));
            }
            kinds.push(fault.kind);
        }
        if kinds.is_empty() {
            kinds.extend(V::FAULTS);
        }
        let mut cases = Self {
            vehicle: V::NAME,
            plan: plan.clone(),
            faults: V::FAULTS,
            drawn: kinds,
            modes: variety.modes,
            missions: if missions.is_empty() { vec![None] } else { missions },
            moments: V::moments,
            times: variety.times,
            chips: variety.chips,
            cells: Vec::new(),
        };
        if !plan.drawn {
            cases.walk();
        }
        Ok(cases)
    }

    /// Lists the cells. Each round has every fault once, and the moments in turn: a campaign that
    /// is cut short has seen some of all.
    fn walk(&mut self) {
        let modes = std::iter::once(None).chain(self.modes.iter().copied().map(Some));
        let of_modes: Vec<_> = modes.map(|mode| (mode, self.occasions(mode))).collect();
        let mut cells = Vec::new();
        if self.plan.only.is_empty() {
            for (mode, occasions) in &of_modes {
                let mut flown = Vec::new();
                for (_, mission) in occasions.iter().filter(|(_, mission)| {
                    let is_new = !flown.contains(mission);
                    flown.push(*mission);
                    is_new
                }) {
                    cells.push(Cell { fault: None, mode: *mode, mission: *mission });
                }
            }
        }
        let all = || self.faults.iter().map(|kind| kind.name.to_owned()).collect();
        let walked: Vec<String> = if self.plan.only.is_empty() { all() } else { self.plan.only.clone() };
        for (mode, occasions) in &of_modes {
            for round in 0..occasions.len() {
                cells.extend(walked.iter().enumerate().filter_map(|(place, fault)| {
                    let (moment, mission) = *occasions.get((round + place) % occasions.len())?;
                    Some(Cell { fault: Some(format!("{fault}@{}", moment.name())), mode: *mode, mission })
                }));
            }
        }
        self.cells = cells;
    }

    /// Every moment that comes in some mission in this mode, with the first mission in which it
    /// does.
    fn occasions(&self, mode: Option<&'static str>) -> Vec<(Moment, Option<&'static str>)> {
        let of_missions: Vec<_> =
            self.missions.iter().map(|mission| (*mission, self.comes(mode, *mission, 1))).collect();
        let first = |moment: Moment| {
            let found = of_missions.iter().find(|(_, comes)| comes.contains(&moment));
            found.map(|(mission, _)| (moment, *mission))
        };
        Moment::ALL.into_iter().filter_map(first).collect()
    }

    /// The moments of this mission in this mode.
    fn comes(&self, mode: Option<&'static str>, mission: Option<&'static str>, seed: u64) -> Vec<Moment> {
        let mut options = self.plan.options.clone();
        options.pilot = mode.map(Into::into);
        options.mission = mission.map(Into::into).or(options.mission);
        (self.moments)(&options, seed)
    }

    /// How many flights walk through the cells: every cell is flown in a campaign that has as many.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// Flight number `index`.
    #[must_use]
    pub fn case(&self, index: u64) -> Case {
        let seed = self.plan.seed.wrapping_add(index);
        let mut options = self.plan.options.clone();
        // Every flight has its own delays, too.
        options.jitter = options.jitter.map(|seed| seed.wrapping_add(index));
        let round = if self.plan.only.is_empty() { index } else { index % (self.cells.len() as u64).max(1) };
        match usize::try_from(round).ok().and_then(|place| self.cells.get(place)) {
            Some(Cell { fault, mode, mission }) => {
                options.fault = fault.iter().cloned().collect();
                options.pilot = mode.map(Into::into);
                options.mission = mission.map(Into::into).or(options.mission);
            }
            None => self.draw(&mut options, seed),
        }
        Case { vehicle: self.vehicle.to_owned(), index, seed, options }
    }

    /// Anything at all.
    fn draw(&self, options: &mut Options, seed: u64) {
        let mut dice = Dice(Noise::new(seed, STREAM));
        // As often under a program's commands as in any one mode.
        let mode = dice.below(self.modes.len() + 1);
        let mode = self.modes.get(mode).copied();
        let mission = dice.one(&self.missions).copied().flatten();
        let moments = self.comes(mode, mission, seed);
        options.pilot = mode.map(Into::into);
        options.mission = mission.map(Into::into).or_else(|| options.mission.take());
        if !dice.0.chance(NOMINAL)
            && let Some(&first) = dice.one(&self.drawn)
        {
            options.fault = vec![dice.fault(first, &moments, self.times).to_string()];
            if self.plan.pairs && dice.0.chance(0.5) {
                // Two of a kind would be one.
                let others: Vec<_> = self.drawn.iter().copied().filter(|kind| kind.name != first.name).collect();
                let second = dice.one(&others).map(|kind| dice.fault(kind, &moments, self.times).to_string());
                options.fault.extend(second);
            }
        }
        options.gust = options.gust.or(Some(dice.round(0.0, GUST) as f32));
        options.chips |= dice.0.chance(0.1) && self.chips;
        options.jitter = options.jitter.or(dice.0.chance(0.25).then_some(seed));
    }
}

/// Draws from a flight's seed.
pub(super) struct Dice(pub Noise);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        ((self.0.unit() * count as f64) as usize).min(count.saturating_sub(1))
    }

    pub fn one<'t, T>(&mut self, of: &'t [T]) -> Option<&'t T> {
        let place = self.below(of.len());
        of.get(place)
    }

    /// A number between two, with three digits.
    pub fn round(&mut self, low: f64, high: f64) -> f64 {
        let value = low + (high - low) * self.0.unit();
        // Reading what is written gives the nearest number, as it will be read from the command line.
        format!("{value:.2e}").parse().unwrap_or(value)
    }

    /// This fault, at one of these moments or at some time.
    fn fault(&mut self, kind: &'static FaultKind, moments: &[Moment], times: [u16; 2]) -> Fault {
        let last = matches!(kind.value, FaultValue::OrLast { .. }) && self.0.chance(0.5);
        let value = match kind.sizes.filter(|_| !last) {
            Some(sizes) => Some(sizes.draw(&mut self.0)),
            None => kind.value.default(),
        };
        let moment = self.one(moments).copied().filter(|_| self.0.chance(0.8));
        let when = moment.map_or_else(
            || {
                let [first, last] = times.map(f64::from);
                When::After(seconds(self.round(first, last)))
            },
            When::Moment,
        );
        // Evenly over orders of magnitude.
        let lasts = self.0.chance(0.5).then(|| seconds(LASTS[0] * (LASTS[1] / LASTS[0]).powf(self.0.unit())));
        Fault { kind, value, when, lasts }
    }
}

/// With whole milliseconds.
fn seconds(seconds: f64) -> Duration {
    Duration::from_millis((1e3 * seconds).round() as u64)
}

impl Case {
    /// The arguments of `stampfly` that fly it.
    #[must_use]
    pub fn arguments(&self) -> Vec<String> {
        let Self { vehicle, seed, options, .. } = self;
        let Options { mission, pilot, sticks, fault, gust, chips, jitter, vibration, flies_on, .. } = options;
        let mut arguments: Vec<String> = vec!["fly".into(), "--seed".into(), seed.to_string()];
        let mut add = |name: &str, value: Option<String>| {
            if let Some(value) = value {
                arguments.extend([format!("--{name}"), value]);
            }
        };
        add("vehicle", Some(vehicle.clone()).filter(|name| name != DEFAULT));
        add("mission", mission.clone());
        fault.iter().for_each(|fault| add("fault", Some(fault.clone())));
        add("gust", gust.map(|gust| gust.to_string()));
        add("vibration", vibration.map(|vibration| vibration.to_string()));
        add("jitter", jitter.map(|jitter| jitter.to_string()));
        add("mode", pilot.clone().filter(|mode| !mode.is_empty()));
        arguments.extend(pilot.as_ref().map(|_| "--pilot".into()));
        arguments.extend(sticks.iter().flat_map(of_sticks));
        arguments.extend(chips.then(|| "--chips".into()));
        arguments.extend(flies_on.then(|| "--fly-on".into()));
        arguments.extend(rest(options));
        arguments
    }

    /// The line that repeats it.
    #[must_use]
    pub fn line(&self) -> String {
        format!("stampfly {}", shell_line(&self.arguments()))
    }
}

/// The arguments that play a stick file.
fn of_sticks(sticks: &StickOptions) -> Vec<String> {
    let StickOptions { file, mode, from_height, hover_throttle, when_ready } = sticks;
    let mut words = vec!["--sticks".into(), file.clone()];
    let height = from_height.map(|height| height.to_string());
    for (name, value) in [("--mode", mode), ("--from-height", &height), ("--hover-throttle", hover_throttle)] {
        words.extend(value.iter().flat_map(|value| [name.into(), value.clone()]));
    }
    words.extend(when_ready.then(|| "--when-ready".into()));
    words
}

/// Words as a shell reads them.
///
/// ```
/// use stampfly_host::campaign::case::shell_line;
/// let words = ["--mission", "arm; land"].map(String::from);
/// assert_eq!(shell_line(&words), "--mission 'arm; land'");
/// ```
#[must_use]
pub fn shell_line(words: &[String]) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_=@+.,/:".contains(letter);
    let quoted = words.iter().map(|word| {
        let plain = !word.is_empty() && word.chars().all(is_plain);
        if plain { word.clone() } else { format!("'{}'", word.replace('\'', r"'\''")) }
    });
    quoted.collect::<Vec<_>>().join(" ")
}

/// Options that a campaign does not vary.
#[must_use]
pub fn rest(options: &Options) -> Vec<String> {
    let Options { plant, world, param, wind, cameras, .. } = options;
    let named = |name: &str, values: &[String]| -> Vec<String> {
        // Without the spaces that may stand around `=`: they part the words of a row.
        values.iter().flat_map(|value| [format!("--{name}"), value.split_whitespace().collect()]).collect()
    };
    let mut words = named("plant", plant);
    if *world != WorldKind::default() {
        words.extend(["--world".into(), world.to_string()]);
    }
    words.extend(named("param", param));
    words.extend(wind.iter().flat_map(|[north, east]| ["--wind".into(), format!("{north},{east}")]));
    words.extend(cameras.then(|| "--cameras".into()));
    words
}
