//! The rover as people meet it: drives, their logs, and `stampfly serve`, driven by the Python package over UDP.

use super::program::{self, stampfly};
use std::io::{BufRead, BufReader};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration as WallDuration;

use stampfly_link::Datagram;
use stampfly_rover::com::{Body, MAX};
use stampfly_rover::messages::{LogRecord, OperatorCommand, Subscription, SystemState};
use stampfly_types::Instant;

/// What Python's installer calls it.
const PYTHON: &str = if cfg!(windows) { "python" } else { "python3" };

/// An empty folder of the test's own.
fn folder(name: &str) -> PathBuf {
    program::folder("rover", name)
}

#[test]
fn a_drive_is_replayed_from_both_its_logs() {
    let (first, again) = (folder("drive"), folder("drive_again"));
    for options in [&["--seed", "0"][..], &["--seed", "7"], &["--seed", "8", "--jitter", "3"]] {
        stampfly(&first, &[&["fly", "--vehicle", "rover"][..], options].concat());
        assert!(stampfly(&first, &["replay", "flight.ulg"]).contains("identical"));
        assert!(stampfly(&first, &["replay", "flight.ulg", "--from", "5"]).contains("identical"));
        let csv = first.join("flight.csv");
        let mission = ["--mission", csv.to_str().expect("a path")];
        stampfly(&again, &[&["fly", "--vehicle", "rover"][..], options, &mission].concat());
        let read = |folder: &Path| std::fs::read(folder.join("flight.csv")).expect("written");
        assert!(read(&first) == read(&again), "{options:?}: byte for byte");
        assert!(first.join("flight.html").exists());
    }
}

#[test]
fn campaigns_succeed_and_a_check_that_does_not_hold_fails() {
    let folder = folder("campaign");
    for jitter in [&[][..], &["--jitter", "1"]] {
        let printed = stampfly(&folder, &[&["campaign", "--vehicle", "rover", "--flights", "60"][..], jitter].concat());
        assert!(printed.contains("60 of 60 flights succeeded"), "{printed}");
    }
    std::fs::write(folder.join("wrong.txt"), "0 throttle 1\n1 check v > 2.9\n1.5 end\n").expect("written");
    let mut wrong = Command::new(env!("CARGO_BIN_EXE_stampfly"));
    let wrong = wrong.current_dir(&folder).args(["fly", "--vehicle", "rover", "--mission", "wrong.txt"]).output();
    assert_eq!(wrong.expect("it runs").status.code(), Some(1));
}

/// A simulated rover in a process of its own.
struct Rover {
    process: Child,
    address: String,
    folder: PathBuf,
}

impl Rover {
    /// Serves for some of its seconds, in real time with speed 1.
    fn start(name: &str, seconds: u32, speed: f32) -> Self {
        let folder = folder(name);
        // Port 0: the system chooses a free one. Seed 0: the document's vehicle.
        let mut process = Command::new(env!("CARGO_BIN_EXE_stampfly"))
            .args(["serve", "--vehicle", "rover", "--listen", "127.0.0.1:0", "--seed", "0"])
            .args(["--for", &seconds.to_string(), "--speed", &speed.to_string(), "--out"])
            .arg(&folder)
            .stdout(Stdio::piped())
            .spawn()
            .expect("stampfly starts");
        let mut line = String::new();
        BufReader::new(process.stdout.take().expect("a pipe")).read_line(&mut line).expect("it says where it listens");
        let address = line.trim().rsplit(' ').next().expect("an address").to_owned();
        Self { process, address, folder }
    }

    /// Runs the Python package with these arguments.
    fn python(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(PYTHON);
        command.args(["-m", "stampfly_rover", "--rover", &self.address]).args(arguments);
        command.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/python"));
        command
    }

    /// Runs the Python package to its end. What it printed is the error when its exit code is another.
    fn session(&self, arguments: &[&str], code: i32) -> Result<(), String> {
        let output = self.python(arguments).output().expect("python3 runs");
        if output.status.code() == Some(code) { Ok(()) } else { Err(format!("{arguments:?}: {output:?}")) }
    }

    /// Ends it, and repeats the session from its log.
    fn end(mut self) {
        program::interrupt(&self.process);
        assert!(self.process.wait().expect("it ends").success(), "the vehicle did what it must not");
        stampfly(&self.folder, &["replay", "flight.ulg"]);
    }
}

impl Drop for Rover {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Drives, changes of parameters and a refusal, the last drive in the other encoding.
fn python_session(rover: &Rover) -> Result<(), String> {
    rover.session(&["drive", "scenarios/emergency_stop.txt", "--plot", "terminal"], 0)?;
    rover.session(&["set", "engine.max_accel=1.5", "steering.time_constant=0.3"], 0)?;
    rover.session(&["set"], 0)?;
    rover.session(&["set", "engine.max_accel=99"], 2)?;
    rover.session(&["--json", "drive", "scenarios/slalom.txt", "--plot", "page"], 0)
}

#[test]
fn a_session_from_python_drives_changes_parameters_and_is_replayed() {
    // In real time, if the machine can. One with more to do makes the operator late; then it is repeated in slow motion.
    let mut failures = Vec::new();
    for speed in [1.0, 0.5, 0.25, 0.125] {
        let rover = Rover::start(&format!("session_{speed}"), 14, speed);
        match python_session(&rover) {
            Ok(()) => return rover.end(),
            Err(failure) => failures.push(failure),
        }
    }
    panic!("{failures:#?}");
}

/// The button, the log, and time in between: an operator in this process.
struct Operator {
    socket: UdpSocket,
    sequence: u32,
}

impl Operator {
    fn new(rover: &Rover) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
        socket.connect(&rover.address).expect("an address");
        socket.set_read_timeout(Some(WallDuration::from_millis(20))).expect("a time");
        Self { socket, sequence: 0 }
    }

    fn send(&mut self, body: Body) {
        self.sequence += 1;
        let datagram = Datagram { sequence: self.sequence, time: Instant::ZERO, body };
        self.socket.send(datagram.write(&mut [0; MAX]).expect("valid")).expect("sent");
    }

    /// Full throttle until `is_enough`, at most so many seconds of the vehicle. Returns the last line of the log.
    fn drive(&mut self, seconds: f32, mut is_enough: impl FnMut(&LogRecord) -> bool) -> Option<LogRecord> {
        let (mut first, mut buffer) = (None, [0; MAX]);
        for turn in 0..10_000_u32 {
            if turn % 25 == 0 {
                self.send(Subscription { every: 1 }.into());
            }
            if turn % 2 == 0 {
                self.send(OperatorCommand { throttle: 1.0, ..OperatorCommand::default() }.into());
            }
            let Ok(length) = self.socket.recv(&mut buffer) else { continue };
            let Ok(Datagram { body: Body::LogRecord(line), .. }) = Datagram::read(&buffer[..length]) else { continue };
            if is_enough(&line) {
                return Some(line);
            }
            if line.t - *first.get_or_insert(line.t) > seconds {
                return None;
            }
        }
        None
    }
}

#[test]
fn a_killed_engine_process_is_an_emergency_stop_within_the_heartbeat_limit() {
    // On a machine with more to do the engine may be late by itself, which stops the vehicle before it is killed. Then
    // slow motion gives it time.
    let tried = [1.0, 0.5, 0.25, 0.125].into_iter().any(|speed| {
        let rover = Rover::start(&format!("killed_{speed}"), 14, speed);
        let mut engine =
            rover.python(&["engine", "--max-accel", "1"]).stdout(Stdio::null()).spawn().expect("python3 runs");
        let mut operator = Operator::new(&rover);
        // The vehicle's own engine does 2 m/s^2 at full throttle.
        let by_process = |line: &LogRecord| line.drive_accel_cmd == 1.0 && line.v > 0.5;
        let moving = operator.drive(6.0, by_process).filter(|line| line.system_state == SystemState::Normal);
        engine.kill().expect("it can be killed");
        engine.wait().expect("it is dead");
        let Some(killed) = moving else { return false };
        let stop = operator.drive(2.0, |line| line.system_state == SystemState::EStop).expect("an emergency stop");
        let after = stop.t - killed.t;
        assert!((0.0..=0.3 + 0.02).contains(&after), "{after} s after the process was killed");
        assert_eq!((stop.drive_accel_cmd, stop.brake_decel_cmd), (0.0, 4.0));
        operator.drive(2.0, |line| line.v == 0.0).expect("it stands");
        // Latched: the operator still asks for full throttle.
        assert!(operator.drive(1.0, |line| line.v > 0.0).is_none());
        rover.end();
        after > 0.1
    });
    assert!(tried, "the engine never drove for long enough to be killed");
}
