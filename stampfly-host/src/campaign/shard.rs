//! A shard: every N-th flight of a campaign, what one task of a cluster flies.
//!
//! Written `I/N`, with I from zero. `auto/N` takes I from the environment, where the engine has put the task's number.
//! The number of shards is always written, because no engine tells a task that was started again alone how many there were.

use super::case::Plan;
use std::fmt;
use std::str::FromStr;

/// Where engines put the number of an array's task, the innermost first: HyperQueue's workers may run inside a Slurm job.
pub const VARIABLES: [(&str, &str); 3] = [
    ("HQ_TASK_ID", "HyperQueue"),
    ("SLURM_ARRAY_TASK_ID", "Slurm"),
    ("JOB_COMPLETION_INDEX", "Kubernetes, a Job with completionMode: Indexed"),
];

/// Most shards of a campaign: one file each.
const MOST: u64 = 100_000;

/// Every N-th flight of a campaign, from flight I on.
///
/// ```
/// use stampfly_host::campaign::shard::Shard;
/// let shard: Shard = "1/4".parse()?;
/// assert_eq!(shard.flights(10).collect::<Vec<_>>(), [1, 5, 9]);
/// assert_eq!(shard.file_name(), "shard-1-of-4.parquet");
/// assert!("4/4".parse::<Shard>().is_err());
/// # Ok::<(), stampfly_host::campaign::shard::ShardError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Shard {
    index: u64,
    count: u64,
}

impl Shard {
    /// Shard `index` of `count`.
    ///
    /// # Errors
    /// When there is no such shard.
    pub fn new(index: u64, count: u64) -> Result<Self, ShardError> {
        if index < count && count <= MOST { Ok(Self { index, count }) } else { Err(ShardError::None { index, count }) }
    }

    /// Every shard of so many.
    pub fn all(count: u64) -> impl Iterator<Item = Self> {
        (0..count.min(MOST)).map(move |index| Self { index, count })
    }

    /// Reads `I/N` or `auto/N`; `variable` looks up the environment.
    ///
    /// # Errors
    /// Names what is wrong with it.
    pub fn parse(text: &str, variable: &dyn Fn(&str) -> Option<String>) -> Result<Self, ShardError> {
        let wrong = || ShardError::Syntax(text.into());
        let (index, count) = text.split_once('/').ok_or_else(wrong)?;
        let count = count.trim().parse().map_err(|_| wrong())?;
        if index.trim() != "auto" {
            return Self::new(index.trim().parse().map_err(|_| wrong())?, count);
        }
        let found = VARIABLES.iter().find_map(|(name, _)| Some((*name, variable(name)?)));
        let (name, value) = found.ok_or(ShardError::NoVariable)?;
        let index = value.trim().parse().map_err(|_| ShardError::Variable { name, value })?;
        Self::new(index, count)
    }

    /// Its number, from zero.
    #[must_use]
    pub const fn index(self) -> u64 {
        self.index
    }

    /// How many shards there are.
    #[must_use]
    pub const fn count(self) -> u64 {
        self.count
    }

    /// Numbers of its flights in a campaign of so many.
    pub fn flights(self, of: u64) -> impl Iterator<Item = u64> {
        (self.index..of).step_by(usize::try_from(self.count).unwrap_or(usize::MAX))
    }

    /// The name of its file.
    #[must_use]
    pub fn file_name(self) -> String {
        let Self { index, count } = self;
        let digits = (count - 1).to_string().len();
        format!("shard-{index:0digits$}-of-{count}.parquet")
    }

    /// What a file of this shard is a part of: a file with another text is of another campaign, or of another program.
    #[must_use]
    pub fn identity(self, vehicle: &str, plan: &Plan, program: &str) -> String {
        let Self { index, count } = self;
        serde_json::json!({
            "vehicle": vehicle, "plan": plan, "shard": index, "shards": count,
            "version": env!("CARGO_PKG_VERSION"), "program": program,
        })
        .to_string()
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        Self::parse(text, &|name| std::env::var(name).ok())
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// Why a text is no shard.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ShardError {
    /// Another form.
    Syntax(String),
    /// There is no shard of this number.
    None {
        /// The number.
        index: u64,
        /// How many there are.
        count: u64,
    },
    /// `auto`, and no engine has said anything.
    NoVariable,
    /// `auto`, and what the engine has said is no number.
    Variable {
        /// The variable.
        name: &'static str,
        /// Its value.
        value: String,
    },
}

impl fmt::Display for ShardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Syntax(text) => {
                write!(f, "'{text}' is no shard: I/N, with I from 0 to N - 1, or auto/N; for example 17/1000")
            }
            Self::None { index, count } => {
                write!(f, "there is no shard {index} of {count}: they count from 0, and {MOST} are the most")
            }
            Self::NoVariable => {
                let names: Vec<_> = VARIABLES.iter().map(|(name, _)| *name).collect();
                write!(f, "auto: none of {} is set; this is no task of an array", names.join(", "))
            }
            Self::Variable { name, value } => write!(f, "auto: {name} is '{value}', which is no number"),
        }
    }
}

impl std::error::Error for ShardError {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn shards_share_the_flights_without_a_rest() {
        for count in 1..20 {
            let mut seen = BTreeSet::new();
            for shard in Shard::all(count) {
                assert!(shard.flights(50).all(|flight| seen.insert(flight)), "flown twice");
            }
            assert_eq!(seen.len(), 50);
        }
        assert_eq!(Shard::new(7, 10).map(|shard| shard.flights(3).count()), Ok(0));
    }

    #[test]
    fn the_environment_says_which() {
        let parse = |set: &[(&str, &str)]| {
            let value = |name: &str| set.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned());
            Shard::parse("auto/8", &value).map(Shard::index)
        };
        for (name, _) in VARIABLES {
            assert_eq!(parse(&[(name, "5")]), Ok(5));
        }
        assert_eq!(parse(&[("SLURM_ARRAY_TASK_ID", "1"), ("HQ_TASK_ID", "2")]), Ok(2), "the innermost");
        assert_eq!(parse(&[]), Err(ShardError::NoVariable));
        assert_eq!(parse(&[("HQ_TASK_ID", "8")]), Err(ShardError::None { index: 8, count: 8 }));
        assert!(parse(&[("HQ_TASK_ID", "x")]).is_err_and(|error| error.to_string().contains("HQ_TASK_ID is 'x'")));
    }

    #[test]
    fn mistakes_are_named() {
        for text in ["", "3", "3/", "/3", "a/b", "-1/3", "1/2/3", "0.5/2"] {
            let error = text.parse::<Shard>().expect_err(text).to_string();
            assert!(error.contains("is no shard: I/N"), "{error}");
        }
        for text in ["0/0", "3/3", "0/100001"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
