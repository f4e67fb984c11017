//! A flight of a campaign as one row of a table: what decides it, how it ended, its figures, its hash.
//!
//! The table of columns below makes [`Row`], and what is known of its columns: files of rows are written and read by it,
//! and `docs/guide/campaigns.md` is held to it.

use super::case::{Case, rest};
use stampfly_sim::fault::FAULT_ACTED;
use stampfly_sim::vehicle::Options;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number from 0 to 2⁶⁴ − 1.
    Integer,
    /// A double.
    Number,
    /// Yes or no.
    Flag,
    /// UTF-8.
    Text,
}

/// One value of a row.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "as in Kind")]
pub enum Value {
    Integer(u64),
    Number(f64),
    Flag(bool),
    Text(String),
    /// Nothing, in a column that may be empty.
    Nothing,
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
    /// May it be empty?
    pub is_optional: bool,
    /// What it says.
    pub meaning: &'static str,
}

/// A type that a column can have.
trait Stored: Default {
    const KIND: Kind;
    const IS_OPTIONAL: bool = false;
    fn value(&self) -> Value;
    fn from_value(value: Value) -> Option<Self>;
}

macro_rules! stored {
    ($($type:ty: $Kind:ident),*) => {$(
        impl Stored for $type {
            const KIND: Kind = Kind::$Kind;
            fn value(&self) -> Value {
                Value::$Kind(self.clone())
            }
            fn from_value(value: Value) -> Option<Self> {
                if let Value::$Kind(value) = value { Some(value) } else { None }
            }
        }
    )*};
}
stored!(u64: Integer, f64: Number, bool: Flag, String: Text);

impl<T: Stored> Stored for Option<T> {
    const KIND: Kind = T::KIND;
    const IS_OPTIONAL: bool = true;
    fn value(&self) -> Value {
        self.as_ref().map_or(Value::Nothing, T::value)
    }
    fn from_value(value: Value) -> Option<Self> {
        if value == Value::Nothing { Some(None) } else { T::from_value(value).map(Some) }
    }
}

macro_rules! row {
    ($($name:ident: $type:ty = $meaning:literal;)*) => {
        /// A flight of a campaign.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct Row {
            $(#[doc = $meaning] pub $name: $type,)*
            /// The vehicle's own figures, the same names in the same order in every row.
            pub figures: Vec<(String, Option<f64>)>,
        }

        impl Row {
            /// The columns of every vehicle; its figures come after them.
            #[must_use]
            pub fn common() -> Vec<Column> {
                vec![$(Column {
                    name: stringify!($name).into(),
                    kind: <$type as Stored>::KIND,
                    is_optional: <$type as Stored>::IS_OPTIONAL,
                    meaning: $meaning,
                }),*]
            }

            /// Its values, in the order of [`columns`](Self::columns).
            #[must_use]
            pub fn values(&self) -> Vec<Value> {
                let mut values = vec![$(self.$name.value()),*];
                values.extend(self.figures.iter().map(|(_, value)| value.value()));
                values
            }

            /// A row of these values. Columns that are not common are figures.
            ///
            /// # Errors
            /// Names the column that is missing or holds something else.
            pub fn from_values(values: impl IntoIterator<Item = (String, Value)>) -> Result<Self, String> {
                let mut row = Self::default();
                let mut missing = vec![$(stringify!($name)),*];
                for (name, value) in values {
                    missing.retain(|other| *other != name);
                    match name.as_str() {
                        $(stringify!($name) => {
                            row.$name = Stored::from_value(value).ok_or_else(|| format!("column {name}: another type"))?;
                        })*
                        _ => {
                            let value = Stored::from_value(value).ok_or_else(|| format!("column {name}: no number"))?;
                            row.figures.push((name, value));
                        }
                    }
                }
                // Files of an earlier version do not have all of those that may be empty.
                missing.retain(|name| [$((stringify!($name), <$type as Stored>::IS_OPTIONAL)),*].contains(&(*name, false)));
                missing.first().map_or(Ok(row), |name| Err(format!("there is no column {name}")))
            }
        }
    };
}

row! {
    vehicle: String = "Name of the vehicle.";
    index: u64 = "Number of the flight in its campaign, from 0.";
    seed: u64 = "Seed of everything random in the flight.";
    mission: Option<String> = "The mission, as `--mission` takes it; nothing is the vehicle's usual one.";
    mode: Option<String> = "The pilot's flight mode; nothing where a program commands.";
    faults: String = "The faults, as `--fault` takes them, with a space between two.";
    fault: String = "Their names, with `+` between two.";
    phase: String = "When they begin: a moment of a flight, or `time` for a number of seconds; with `+` between two.";
    gust: Option<f64> = "Standard deviation of gusts, m/s; nothing is the vehicle's usual one.";
    vibration: Option<f64> = "Strength of vibration; nothing is the usual one.";
    chips: bool = "Did the real drivers run over emulated chips?";
    jitter: Option<u64> = "Seed of the executor's delays; nothing where it is never late.";
    settings: String = "Other options of the flight, as on the command line.";
    parameter_digest: String = "Hash over every parameter of the flight stack and of the simulated vehicle.";
    version: String = "Version of the program.";
    verdict: String = "`passed`; `idle`: the fault changed nothing, so the flight says nothing; else what is wrong: an end that is not acceptable, invariants, `needless-cut` where flying on would have ended acceptably, `panicked`, `unjudged` where the vehicle does not say how its flights end.";
    outcome: String = "How the flight ended.";
    expected: String = "The worst end that is acceptable.";
    as_expected: bool = "Is the end no worse than that?";
    violations: String = "Invariants that did not hold, with a space between two.";
    max_height_m: Option<f64> = "Highest above the place where the vehicle stood, m.";
    max_distance_m: Option<f64> = "Farthest beside the commanded path, m.";
    touch_speed_mps: Option<f64> = "Sink rate at the first touch after the fault, or of the landing, m/s.";
    cut_after_s: Option<f64> = "From the fault until the motors stayed off, s.";
    cut_height_m: Option<f64> = "Height above the ground there, m.";
    alerts: String = "Alerts, in the order in which they began, with a space between two.";
    duration_s: f64 = "Simulated time, s.";
    log_hash: String = "Hash over everything that was published.";
    reason: Option<String> = "Why the end is no better.";
    never_began: Option<String> = "Moments that never came, so that their faults never began, with `+` between two; nothing when all came.";
    cut_by: Option<String> = "Protections that stopped the motors in the air, with `+` between two; nothing when none did.";
    flown_on: Option<String> = "How the same flight ended when it flew on where they stopped the motors; nothing where they did not.";
}

/// The verdict of a flight that did what it should.
pub const PASSED: &str = "passed";
/// The verdict of a flight whose fault changed nothing.
pub const IDLE: &str = "idle";
/// The word in the verdict of a flight whose motors were stopped in the air, and that would have
/// ended acceptably without.
pub const NEEDLESS_CUT: &str = "needless-cut";
/// The verdict of a flight of a vehicle that does not say how its flights end.
pub const UNJUDGED: &str = "unjudged";
/// The verdict and outcome of a flight that was not flown to its end because the program had a defect.
pub const PANICKED: &str = "panicked";

impl Row {
    /// All columns of a file of such rows.
    #[must_use]
    pub fn columns(&self) -> Vec<Column> {
        let figures = self.figures.iter().map(|(name, _)| Column {
            name: name.clone(),
            kind: Kind::Number,
            is_optional: true,
            meaning: "A figure of the flight.",
        });
        Self::common().into_iter().chain(figures).collect()
    }

    /// Did the flight fail? One that says nothing did not.
    #[must_use]
    pub fn failed(&self) -> bool {
        ![PASSED, IDLE].contains(&self.verdict.as_str())
    }

    /// Was the flight flown without a fault?
    #[must_use]
    pub fn is_nominal(&self) -> bool {
        self.faults.is_empty()
    }

    /// Were the motors stopped in the air, and would the flight have ended acceptably if they had
    /// not been? `None` where they were not, or where the vehicle does not fly on to find out.
    #[must_use]
    pub fn cut_was_needless(&self) -> Option<bool> {
        self.flown_on.as_ref()?;
        Some(self.verdict.split_whitespace().any(|word| word == NEEDLESS_CUT))
    }

    /// Invariants that the vehicle did not hold.
    pub fn broken(&self) -> impl Iterator<Item = &str> {
        self.violations.split_whitespace().filter(|name| *name != FAULT_ACTED)
    }

    /// Did it fail as this one did: with the same end if that was wrong, with one of its violations
    /// if it had any, with a needless cut if it had one?
    #[must_use]
    pub fn failed_like(&self, other: &Self) -> bool {
        let same_end = other.as_expected || (!self.as_expected && self.outcome == other.outcome);
        let same_violation =
            other.broken().next().is_none() || other.broken().any(|name| self.broken().any(|broken| broken == name));
        let same_cut = other.cut_was_needless() != Some(true) || self.cut_was_needless() == Some(true);
        self.failed() && same_end && same_violation && same_cut
    }

    /// The columns that say what was flown.
    #[must_use]
    pub fn of(case: &Case) -> Self {
        let Case { vehicle, index, seed, options } = case;
        let joined =
            |part: &dyn Fn(&str) -> String| options.fault.iter().map(|text| part(text)).collect::<Vec<_>>().join("+");
        Self {
            vehicle: vehicle.clone(),
            index: *index,
            seed: *seed,
            mission: options.mission.clone(),
            mode: options.pilot.clone(),
            faults: options.fault.join(" "),
            fault: joined(&|text| text.split(['=', '@']).next().unwrap_or_default().into()),
            phase: joined(&moment_of),
            gust: options.gust.map(shown),
            vibration: options.vibration,
            chips: options.chips,
            jitter: options.jitter,
            settings: rest(options).join(" "),
            ..Self::default()
        }
    }

    /// What was flown.
    ///
    /// # Errors
    /// When the settings cannot be read.
    pub fn case(&self) -> Result<Case, String> {
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect();
        let mut options = Options {
            mission: self.mission.clone(),
            pilot: self.mode.clone(),
            fault: words(&self.faults),
            gust: self.gust.map(|gust| gust as f32),
            vibration: self.vibration,
            chips: self.chips,
            jitter: self.jitter,
            ..Options::default()
        };
        let mut settings = self.settings.split_whitespace();
        while let Some(name) = settings.next() {
            let mut value = || settings.next().ok_or_else(|| format!("settings: {name} has no value"));
            match name {
                "--plant" => options.plant.push(value()?.into()),
                "--world" => options.world = value()?.parse().map_err(|error| format!("settings: --world {error}"))?,
                "--param" => options.param.push(value()?.into()),
                "--wind" => options.wind = Some(wind(value()?).ok_or("settings: --wind is no pair of numbers")?),
                "--cameras" => options.cameras = true,
                other => {
                    return Err(format!("settings: {other} is none of --plant, --world, --param, --wind, --cameras"));
                }
            }
        }
        Ok(Case { vehicle: self.vehicle.clone(), index: self.index, seed: self.seed, options })
    }
}

/// The moment of a fault's text; `time` when it begins at one.
pub(super) fn moment_of(fault: &str) -> String {
    let when = fault.split('@').nth(1).and_then(|rest| rest.split('+').next()).unwrap_or_default();
    if when.starts_with(|letter: char| letter.is_ascii_digit()) { "time".into() } else { when.into() }
}

/// A single as the double that is written the same.
fn shown(value: f32) -> f64 {
    value.to_string().parse().unwrap_or_else(|_| value.into())
}

fn wind(text: &str) -> Option<[f32; 2]> {
    let (north, east) = text.split_once(',')?;
    Some([north.parse().ok()?, east.parse().ok()?])
}
