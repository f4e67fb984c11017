//! Many flights: `campaign`.

use super::{SceneOptions, StickArguments};
use crate::campaign::shard::Shard;
use clap::builder::ArgPredicate;
use clap::{Args, ValueEnum};
use std::num::NonZero;
use std::path::PathBuf;

/// Options of `campaign`.
#[derive(Clone, Debug, Args)]
pub struct CampaignOptions {
    #[command(flatten)]
    pub scene: SceneOptions,
    /// How many flights; 3000 with `--faults`, 1000 with `--envelope`. With `--sticks`, how many of
    /// each file in each mode; 3.
    #[arg(long, value_name = "N", default_value_t = 100, default_value_ifs([("faults", "true".into(), "3000"), ("envelope", "true".into(), "1000"), ("sticks", ArgPredicate::IsPresent, "3")]), value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub flights: u64,
    /// Seed of the first flight; the others count up from there.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Fly through what can go wrong: every fault at every moment in every mode, then faults,
    /// sizes, moments, missions and surroundings at random, one in ten without a fault. Every
    /// flight must end as its fault allows (`stampfly faults`), and motors that were stopped in the
    /// air must have been stopped rightly: flown on, the same flight must have ended badly.
    #[arg(long, conflicts_with_all = ["fault", "pilot"])]
    pub faults: bool,
    /// Fly sound vehicles through everything that may be flown and met: missions by a program and by
    /// a pilot, sticks anywhere in any mode, in the harsh world, with gusts of up to 5 m/s. With
    /// `--sticks`, those files as well. Exit code 1 when a flight did not end well, or a sound
    /// vehicle stopped its motors, landed or took another mode by itself.
    #[arg(long, conflicts_with_all = ["fault", "pilot", "faults", "mission", "mode"])]
    pub envelope: bool,
    #[command(flatten)]
    pub of_faults: FaultCampaignOptions,
    /// Fly stick files, and the `.csv` files of folders: each as it is, and one with a single mode
    /// in every other mode of the vehicle, too. Exit code 1 when a flight did not end well, or a
    /// sound vehicle stopped its motors, landed or took another mode by itself.
    #[arg(long, value_name = "PATH", num_args = 1.., group = "by_sticks", conflicts_with_all = ["mission", "faults"])]
    pub sticks: Vec<PathBuf>,
    #[command(flatten)]
    pub with_sticks: StickArguments,
}

/// Options of `campaign --faults`.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Campaign of faults")]
pub struct FaultCampaignOptions {
    /// Let half of the random flights with a fault have two.
    #[arg(long, requires = "faults")]
    pub pairs: bool,
    /// Let all flights be random ones: leave out those with the usual values at every moment in
    /// every mode.
    #[arg(long, requires = "faults")]
    pub drawn: bool,
    /// Confine all flights to these faults: each at every moment in every mode, again and again with
    /// other seeds; with `--drawn` at random.
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
