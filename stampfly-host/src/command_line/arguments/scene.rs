//! What decides a simulated flight: `fly`, and what others take from it.

use super::{StickArguments, VehicleOption};
use crate::command_line::failure::Failure;
use clap::Args;
use stampfly_sim::vehicle::{Live, Options, Vehicle, WorldKind};
use std::path::PathBuf;

/// What decides a simulated flight.
#[derive(Clone, Debug, Default, Args)]
pub struct SceneOptions {
    /// Which vehicle.
    #[command(flatten)]
    pub vehicle: VehicleOption,
    /// Mission to fly: a file, its text with `;` between steps (StampFly: `arm; takeoff 0.5; land`), or one that the vehicle
    /// knows by name (StampFly: `square`, `hover`, `random`; rover: `course`, and its CSV logs).
    #[arg(long, value_name = "FILE")]
    pub mission: Option<String>,
    /// Change a number of the simulated vehicle or its surroundings (see `--list`).
    #[arg(long, value_name = "NAME=VALUE")]
    pub plant: Vec<String>,
    /// How kind the world is: `harsh` draws from the seed how worn and cold the battery is, the light, the floor, the room, and how far this
    /// specimen lies from others, as far apart as recordings and data sheets are.
    #[arg(long, value_name = "gentle|harsh", default_value_t)]
    pub world: WorldKind,
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
    /// Let something go wrong; may be repeated. WHEN is calibration, ground, spool, takeoff, hover,
    /// move, flip, mode, chop, parameter, landing, touch, or a number of seconds; +SECONDS is how
    /// long it lasts (see `stampfly faults`).
    #[arg(long, value_name = "NAME[=VALUE]@WHEN[+SECONDS]")]
    pub fault: Vec<String>,
    /// Fly the mission with the sticks of a simulated pilot.
    #[arg(long, group = "by_sticks")]
    pub pilot: bool,
    /// The pilot's flight mode (StampFly: stabilize, acro, althold, poshold), or the one in place
    /// of a stick file's.
    #[arg(long, value_name = "MODE", requires = "by_sticks")]
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
    /// Fly what is in a stick file: CSV with the columns t, throttle, roll, pitch, yaw, mode, arm,
    /// and maybe flip, kill, land.
    #[arg(long, value_name = "FILE", group = "by_sticks", conflicts_with = "mission")]
    pub sticks: Option<PathBuf>,
    #[command(flatten)]
    pub with_sticks: StickArguments,
    /// Fly on where a protection stops the motors in the air, to see whether that was right: its
    /// alert comes, and the motors turn on.
    #[arg(long)]
    pub fly_on: bool,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for `flight.ulg` and `flight.html`.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
    /// Fly a flight of a campaign again, and compare its hash: exit code 1 when it is another.
    #[arg(long, value_name = "FILE", requires = "row", conflicts_with_all = ["mission", "plant", "world", "param", "vibration", "gust", "wind", "chips", "cameras", "fault", "pilot", "sticks", "jitter", "seed", "fly_on"])]
    pub from: Option<PathBuf>,
    /// Which one: its row in the file, from 0.
    #[arg(long, value_name = "N", requires = "from")]
    pub row: Option<usize>,
}

impl Default for FlyOptions {
    fn default() -> Self {
        let (scene, with_sticks) = (SceneOptions::default(), StickArguments::default());
        Self { scene, sticks: None, with_sticks, fly_on: false, seed: 1, out: ".".into(), from: None, row: None }
    }
}

impl FlyOptions {
    /// The flight these options describe, as a vehicle takes them.
    pub fn options(&self) -> Options {
        let sticks = |file: &PathBuf| self.with_sticks.options(file, self.scene.mode.clone());
        let flown = self.scene.options(self.scene.jitter);
        Options { sticks: self.sticks.as_ref().map(sticks), flies_on: self.fly_on, ..flown }
    }
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
        let Self { mission, plant, world, param, vibration, gust, wind, chips, cameras, fault, pilot, mode, .. } =
            self.clone();
        let pilot = pilot.then(|| mode.unwrap_or_default());
        Options {
            mission,
            plant,
            world,
            param,
            vibration,
            gust,
            wind,
            chips,
            cameras,
            jitter,
            fault,
            pilot,
            sticks: None,
            flies_on: false,
            live: None,
        }
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
