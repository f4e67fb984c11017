//! A vehicle in real time, and one that is not simulated: `serve`, `connect`, `hil`, `demo`.

use super::{FlyOptions, SceneOptions, VehicleOption, seconds};
use crate::connect::{Place, RadioPlace};
use crate::serve::PortOption;
use clap::Args;
use std::error::Error;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

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

/// Where a real vehicle is.
#[derive(Clone, Debug)]
pub enum VehiclePlace {
    Line(Place),
    Radio(RadioPlace),
}

impl FromStr for VehiclePlace {
    type Err = Box<dyn Error + Send + Sync>;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(if text.starts_with("udp:") { Self::Radio(text.parse()?) } else { Self::Line(text.parse()?) })
    }
}

/// Options of `connect`.
#[derive(Clone, Debug, Args)]
pub struct ConnectOptions {
    /// The vehicle's serial port, such as /dev/ttyACM0, or tcp:HOST:PORT, or udp:HOST for a vehicle in a Wi-Fi network, which wants its `--key`. Without this: the only
    /// serial port that looks like a vehicle's. One that is not there, or not any more, is waited for.
    #[arg(value_name = "PATH|tcp:HOST:PORT|udp:HOST")]
    pub place: Option<VehiclePlace>,
    /// A file with the vehicle's key, as its console's `key` shows it, or as 64 hexadecimal digits. For udp:HOST.
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,
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

/// Reads how fast time passes. At a hundredth other programs take the vehicle's silence between two answers for its end.
fn speed(text: &str) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| format!("'{text}' is no number"))?;
    if (0.1..=100.0).contains(&value) { Ok(value) } else { Err("0.1 to 100".into()) }
}
