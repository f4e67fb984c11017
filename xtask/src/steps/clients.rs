//! `clients`: programs that others have written fly a simulated StampFly.
//!
//! Each script of `examples/clients` runs against a vehicle of its own, at ports that the system chooses. It has to succeed, the
//! vehicle must not have done what it never may, and the log of the flight has to replay bit for bit without the program. Control: against
//! a vehicle that is not there, every script has to fail.

use super::program::{built, example};
use crate::arguments::Arguments;
use crate::parallel;
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

const FOLDER: &str = "examples/clients";
const PACKAGES: [&str; 4] = ["pymavlink==2.4.50", "djitellopy==2.5.0", "mavsdk==4.1.0", "yamspy==0.3.3"];
/// A script that takes longer hangs.
const SECONDS: &str = "120";
/// djitellopy cannot be told to take any port that is free: these are asked for first.
const FREE: usize = 3;

/// Scripts that run at the same time: they mostly wait for a vehicle that flies in real time.
const AT_ONCE: usize = 3;

/// A script, its arguments with the names of ports in braces, and options of `serve`. With `--vehicle` first it is another vehicle.
type Script = (&'static str, &'static [&'static str], &'static [&'static str]);
/// The longest first.
const SCRIPTS: [Script; 15] = [
    // Two flights of five minutes each. There is no fix for the first 15 s of real time, in which a
    // client on a busy machine connects and is refused.
    (
        "mavlink_plane.py",
        &["tcp:{mavlink-tcp}"],
        &["--vehicle", "plane", "--speed", "10", "--fault", "gnss-lost@0+150"],
    ),
    ("mavsdk_mission.py", &["udpin://{mavlink-udp}"], &[]),
    ("tello_square.py", &["{tello}", "{free}", "{tello-state#}"], &[]),
    ("mavlink_square.py", &["tcp:{mavlink-tcp}"], &[]),
    ("mavlink_square.py", &["udpin:{mavlink-udp}"], &[]),
    ("mavlink_square.py", &["{usb}"], &[]),
    ("mavlink_calibrate.py", &["tcp:{mavlink-tcp}"], &[]),
    ("mavlink_signed.py", &["tcp:{mavlink-tcp}", "{phrase}"], &["--key", "{key}", "--sign-all", "--port", "sealed=0"]),
    ("yamspy_tune.py", &["{msp-serial}"], &[]),
    ("read_streams.py", &["{telemetry#}", "{stream}"], &[]),
    ("console.py", &["{console}"], &[]),
    ("yamspy_quad.py", &["{msp-serial}"], &["--vehicle", "stm32-quad"]),
    ("mavlink_quad.py", &["tcp:{mavlink-tcp}"], &["--vehicle", "stm32-quad"]),
    ("mavlink_quad.py", &["udpin:{mavlink-udp}"], &["--vehicle", "stm32-quad"]),
    (
        "mavlink_signed.py",
        &["tcp:{mavlink-tcp}", "{phrase}", "roll.p"],
        &["--vehicle", "stm32-quad", "--key", "{key}", "--sign-all"],
    ),
];
/// Ports that are asked for at any number, those that every vehicle has first, and then that of all but the aircraft.
const PORTS: [&str; 7] = ["http", "mavlink-tcp", "msp", "tello", "stream", "console", "usb-tcp"];
const EVERYBODYS: usize = 2;
/// The one that is said last.
const LAST: &str = "http";
/// As `openssl rand -hex 32` makes one. Not a secret: it is good for the vehicle of a test.
const KEY: &str = "5f1d2c8e90b34a67f8e0c1b2a39485760718293a4b5c6d7e8f90a1b2c3d4e5f6\n";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let python = environment(repository)?;
    let program = built(repository)?;
    refuses_strangers(&program)?;
    let outcomes = parallel::each(SCRIPTS.iter().enumerate(), AT_ONCE, |(place, script)| {
        let begun = Instant::now();
        let said = flown(repository, &python, &program, place, script).map_err(|e| format!("{}: {e}", script.0))?;
        // In one call, because another script prints at the same time.
        print!("{}, {:.0} s\n{}", script.0, begun.elapsed().as_secs_f64(), indented(&said));
        Ok(())
    });
    let mut failures: Vec<Failure> = outcomes.into_iter().filter_map(Result::err).collect();
    failures.extend(the_firmwares_ports(repository, &python).err());
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n")) }
}

/// Runs a script against a vehicle of its own, replays the logs, and runs it without the vehicle. Returns what it said.
fn flown(
    repository: &Repository,
    python: &Path,
    program: &Path,
    place: usize,
    (script, arguments, options): &Script,
) -> Result<String, Failure> {
    let out = repository.target("clients").join(place.to_string());
    _ = std::fs::remove_dir_all(&out);
    let mut vehicle = Vehicle::start(program, &out, options)?;
    let said = script_with(repository, python, script, arguments, &vehicle)?;
    vehicle.end()?;
    for log in logs(&out)? {
        let (replayed, _) = capture(Command::new(program).arg("replay").arg(log))?;
        if !replayed.contains("identical") {
            return Err(format!("the flight does not replay:\n{replayed}"));
        }
    }
    match script_with(repository, python, script, arguments, &vehicle) {
        Ok(_) => Err("the script succeeds without a vehicle".to_owned()),
        Err(_) => Ok(said),
    }
}

/// What the firmware has at its ports, on this computer's sockets: only the sockets are others.
fn the_firmwares_ports(repository: &Repository, python: &Path) -> Result<(), Failure> {
    let script = "mavlink_ports.py";
    let program = example(repository, "ports")?;
    let process = Command::new(&program).arg(SECONDS).stdout(Stdio::piped()).spawn();
    let mut process = process.map_err(|error| format!("{program:?}: {error}"))?;
    let stdout = process.stdout.take().ok_or("no standard output")?;
    let mut vehicle = Vehicle { process, ports: Vec::new() };
    for line in BufReader::new(stdout).lines() {
        let line = line.map_err(|error| error.to_string())?;
        let (name, place) = line.split_once(' ').ok_or("no port")?;
        vehicle.ports.push((name.to_owned(), place.to_owned()));
        if name == "mavlink-tcp" {
            break;
        }
    }
    let arguments = ["udpout:{mavlink-udp}", "tcp:{mavlink-tcp}", "{phrase}"];
    let said = script_with(repository, python, script, &arguments, &vehicle)?;
    print!("{script}\n{}", indented(&said));
    drop(vehicle.process.kill());
    _ = vehicle.process.wait();
    match script_with(repository, python, script, &arguments, &vehicle) {
        Ok(_) => Err(format!("{script} succeeds without a vehicle")),
        Err(_) => Ok(()),
    }
}

/// Where others can reach it, MAVLink is not opened without a key.
fn refuses_strangers(program: &Path) -> Result<(), Failure> {
    let output = Command::new(program).args(["serve", "--for", "1", "--port", "mavlink-tcp=0.0.0.0:0"]).output();
    let output = output.map_err(|error| format!("{program:?}: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    print!("serve --port mavlink-tcp=0.0.0.0:0\n{}", indented(&said));
    match !output.status.success() && said.contains("--key") {
        true => Ok(()),
        false => Err("MAVLink is open to everybody without a key".into()),
    }
}

/// A key that other accounts can read is refused.
fn closed_to_others(file: &Path) -> Result<(), Failure> {
    #[cfg(unix)]
    std::fs::set_permissions(file, std::os::unix::fs::PermissionsExt::from_mode(0o600))
        .map_err(|error| format!("{}: {error}", file.display()))?;
    _ = file;
    Ok(())
}

/// One for each time the vehicle was switched on.
fn logs(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let files = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let logs: Vec<_> = files
        .flatten()
        .map(|file| file.path())
        .filter(|path| path.extension().is_some_and(|kind| kind == "ulg"))
        .collect();
    if logs.is_empty() { Err(format!("no log in {}", folder.display())) } else { Ok(logs) }
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("    {line}\n")).collect()
}

/// A Python with the packages. Made once, and again when their versions are others.
fn environment(repository: &Repository) -> Result<PathBuf, Failure> {
    let folder = repository.target("python").join(format!("clients-{}", PACKAGES.join("-").replace(['=', '.'], "")));
    let python = folder.join("bin/python");
    let made = folder.join("made");
    if !made.exists() {
        run_program(repository.command("python3").args(["-m", "venv"]).arg(&folder))?;
        let mut pip = Command::new(&python);
        run_program(pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(PACKAGES))?;
        std::fs::write(&made, "").map_err(|error| error.to_string())?;
    }
    Ok(python)
}

fn script_with(
    repository: &Repository,
    python: &Path,
    script: &str,
    arguments: &[&str],
    vehicle: &Vehicle,
) -> Result<String, Failure> {
    let mut command = Command::new("timeout");
    command.arg(SECONDS).arg(python).arg("-u").arg(repository.root.join(FOLDER).join(script));
    command.args(arguments.iter().map(|argument| vehicle.fill_in(argument)));
    capture(&mut command).map(|(said, _)| said)
}

/// A simulated vehicle in a process of its own.
struct Vehicle {
    process: Child,
    /// Names and places of its ports, and one that is free.
    ports: Vec<(String, String)>,
}

impl Vehicle {
    fn start(program: &Path, out: &Path, options: &[&str]) -> Result<Self, Failure> {
        std::fs::create_dir_all(out).map_err(|error| format!("{}: {error}", out.display()))?;
        let key = out.join("key");
        std::fs::write(&key, KEY).map_err(|error| format!("{}: {error}", key.display()))?;
        closed_to_others(&key)?;
        let key = key.to_string_lossy().into_owned();
        let (phrase, _) = capture(Command::new(program).args(["key", "mavlink", &key]))?;
        let free = free_ports()?;
        let [state, telemetry, mavlink] = free;
        let mut command = Command::new(program);
        // In the vehicle's seconds, which pass faster for some.
        let speed = options.iter().skip_while(|option| **option != "--speed").nth(1);
        let seconds = speed.and_then(|speed| Some(speed.parse::<u32>().ok()? * SECONDS.parse::<u32>().ok()?));
        let seconds = seconds.map_or(SECONDS.to_owned(), |seconds| seconds.to_string());
        command.args(["serve", "--for", &seconds, "--out"]).arg(out);
        let (most, sends) = match options {
            ["--vehicle", "plane", ..] => (EVERYBODYS, 1),
            ["--vehicle", ..] => (EVERYBODYS + 1, 1),
            _ => (usize::MAX, usize::MAX),
        };
        for name in PORTS.iter().take(most) {
            command.args(["--port", &format!("{name}=0")]);
        }
        let sent_to = [("mavlink-udp", mavlink), ("tello-state", state), ("telemetry", telemetry)];
        for (name, number) in sent_to.iter().take(sends) {
            command.args(["--port", &format!("{name}={number}")]);
        }
        command.args(options.iter().map(|option| option.replace("{key}", &key)));
        let mut process = command.stdout(Stdio::piped()).spawn().map_err(|error| format!("{program:?}: {error}"))?;
        let stdout = process.stdout.take().ok_or("no standard output")?;
        let mut vehicle = Self {
            process,
            ports: vec![
                ("free".into(), free_ports()?[0].to_string()),
                ("key".into(), key),
                ("phrase".into(), phrase.trim().into()),
            ],
        };
        for line in BufReader::new(stdout).lines() {
            let line = line.map_err(|error| error.to_string())?;
            let mut words = line.split_whitespace();
            let name = words.next().unwrap_or_default().to_owned();
            let is_last = name == LAST;
            vehicle.ports.push((name, words.next_back().unwrap_or_default().to_owned()));
            if is_last {
                return Ok(vehicle);
            }
        }
        Err("stampfly serve ended".into())
    }

    /// `{name}` is where the port is, `{name#}` its number.
    fn fill_in(&self, argument: &str) -> String {
        self.ports.iter().fold(argument.to_owned(), |text, (name, place)| {
            let number = place.rsplit(':').next().unwrap_or(place);
            text.replace(&format!("{{{name}#}}"), number).replace(&format!("{{{name}}}"), place)
        })
    }

    /// Ends it as Ctrl-C does, and hears whether all was well.
    fn end(&mut self) -> Result<(), Failure> {
        run_program(Command::new("kill").args(["-INT", &self.process.id().to_string()]))?;
        let ended = self.process.wait().map_err(|error| error.to_string())?;
        if ended.success() { Ok(()) } else { Err(format!("stampfly serve: {ended}")) }
    }
}

impl Drop for Vehicle {
    fn drop(&mut self) {
        _ = self.process.kill();
        _ = self.process.wait();
    }
}

fn free_ports() -> Result<[u16; FREE], Failure> {
    let sockets: Vec<_> = (0..FREE).map(|_| std::net::UdpSocket::bind("127.0.0.1:0")).collect();
    let mut ports = [0; FREE];
    for (port, socket) in ports.iter_mut().zip(sockets) {
        *port = socket.and_then(|socket| socket.local_addr()).map_err(|error| error.to_string())?.port();
    }
    Ok(ports)
}
