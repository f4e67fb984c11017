//! What has been recorded: `replay`, `log`, `golden`.

use super::VehicleOption;
use clap::{Args, Subcommand};
use std::net::SocketAddr;
use std::path::PathBuf;

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
