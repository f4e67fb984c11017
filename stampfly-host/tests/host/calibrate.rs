//! Every calibration from end to end, as somebody does it: `stampfly serve`, its command line over TCP, the vehicle in a hand, what was
//! found taken and saved, the vehicle restarted. What was found is compared with what nature has put into the sensors.

use crate::program::{Program, folder};
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// For an answer, and for everything that has to happen at a vehicle: a busy machine flies no faster than time passes.
const SOON: Duration = Duration::from_secs(150);
const TAKES: &str = "`calibrate accept` takes and saves it";

/// The earth's field in the simulation, world NED, µT, and its strength.
const FIELD: [f64; 3] = [30.8, -4.3, 36.4];

/// A simulated vehicle and a line to it.
struct Typed {
    /// As long as it is looked at.
    _program: Program,
    stream: TcpStream,
    /// What was heard and not looked at.
    heard: String,
    /// All of it, for a test that fails.
    all: String,
}

impl Typed {
    fn new(name: &str, seed: u64) -> Self {
        let folder = folder("calibrate", name);
        let (program, place) = Program::serve(&folder, "console=0", &["--speed", "30", "--seed", &seed.to_string()]);
        let stream = TcpStream::connect(place).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_millis(100))).expect("a timeout");
        let mut typed = Self { _program: program, stream, heard: String::new(), all: String::new() };
        typed.wait("> ");
        typed
    }

    /// What is heard up to this.
    fn wait(&mut self, what: &str) -> String {
        let until = Instant::now() + SOON;
        let mut bytes = [0; 4096];
        while Instant::now() < until {
            if let Some(at) = self.heard.find(what) {
                let rest = self.heard.split_off(at + what.len());
                return std::mem::replace(&mut self.heard, rest);
            }
            if let Ok(count) = self.stream.read(&mut bytes) {
                let text = String::from_utf8_lossy(&bytes[..count]).replace('\r', "");
                self.heard.push_str(&text);
                self.all.push_str(&text);
            }
        }
        panic!("'{what}' is not said: {}", self.all);
    }

    fn say(&mut self, line: &str) {
        self.stream.write_all(format!("{line}\r").as_bytes()).expect("it listens");
    }

    /// Says it and waits for the line that is answered so.
    fn ask(&mut self, line: &str, answer: &str) -> String {
        self.say(line);
        self.wait(&format!("{line}\n"));
        self.wait(answer)
    }

    /// What nature has put into the sensors, by name.
    fn truth(&mut self, name: &str) -> Vec<f64> {
        let all = self.ask("world truth", "> ");
        let line = all.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_else(|| panic!("{name}: {all}"));
        line.split_whitespace().map(|number| number.parse().expect("a number")).collect()
    }

    /// A parameter of the next start.
    fn parameter(&mut self, name: &str) -> f64 {
        let line = self.ask(&format!("param get {name}"), "> ");
        let value = line.lines().find_map(|line| line.strip_prefix(name)?.split_whitespace().next());
        value.expect("a value").parse().expect("a number")
    }

    fn parameters(&mut self, name: &str, ends: &[&str]) -> Vec<f64> {
        ends.iter().map(|end| self.parameter(&format!("calibration.{name}{end}"))).collect()
    }

    /// The mean of a column of a topic, over so many looks, and of how many samples.
    fn mean(&mut self, topic: &str, column: &str, looks: usize) -> Vec<f64> {
        let mut sum = Vec::new();
        for _ in 0..looks {
            let text = self.ask(&format!("topic {topic}"), "> ");
            let line =
                text.lines().find_map(|line| line.trim().strip_prefix(column)).unwrap_or_else(|| panic!("{text}"));
            let numbers: Vec<f64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
            sum.resize(numbers.len(), 0.0);
            sum.iter_mut().zip(&numbers).for_each(|(sum, number)| *sum += number / looks as f64);
        }
        sum
    }

    fn accept(&mut self) {
        self.ask("calibrate accept", "taken; it corrects from the next start on");
        self.wait("saved");
    }

    fn put_down(&mut self) {
        self.ask("world down", "it is put down");
    }

    fn restart(&mut self) {
        self.ask("reboot", "restarting");
        self.wait("type help\n> ");
        self.calibrated();
    }

    /// The still-calibration after power-on is over.
    fn calibrated(&mut self) {
        let until = Instant::now() + SOON;
        while self.ask("status", "awake").contains("Init") {
            assert!(Instant::now() < until, "{}", self.all);
        }
        // The estimate settles.
        self.passes(4.0);
    }

    fn passes(&mut self, seconds: f64) {
        let begun = self.awake();
        let until = Instant::now() + SOON;
        while self.awake() < begun + seconds {
            assert!(Instant::now() < until, "{}", self.all);
        }
    }

    fn awake(&mut self) -> f64 {
        self.ask("status", "awake");
        let line = self.wait(" s\n");
        line.trim().trim_end_matches(" s").parse().expect("a number")
    }

    fn six_positions(&mut self) {
        self.ask("calibrate six", "lay it on each");
        for side in ["nose-down", "level", "tail-down", "right-down", "left-down", "upside-down"] {
            self.ask(&format!("world hold {side}"), "a hand holds it");
            self.wait("taken: turn it to another side");
        }
        self.ask("world hold level", "a hand holds it");
        self.wait(TAKES);
    }

    /// Angle between the estimate's and the true vertical, rad.
    fn tilt_error(&mut self) -> f64 {
        let attitude = self.mean("estimate_state", "attitude", 20);
        let [w, x, y, z] = attitude[..] else { panic!("{attitude:?}") };
        let truth = self.truth("attitude");
        let (roll, pitch) =
            ((2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y)), (2.0 * (w * y - z * x)).asin());
        (roll - truth[0]).hypot(pitch - truth[1])
    }
}

/// The largest distance between two lists.
fn apart(found: &[f64], truth: &[f64]) -> f64 {
    assert_eq!(found.len(), truth.len());
    found.iter().zip(truth).map(|(found, truth)| (found - truth).abs()).fold(0.0, f64::max)
}

/// A gyro's look has a noise of 2 mrad/s, an axis, and the mean of so many a twentieth of what the worst drift is taken for. A magnetometer's has half a microtesla,
/// and two looks that follow each other may be at one sample.
const LOOKS: usize = 600;

const XYZ: [&str; 3] = ["_x", "_y", "_z"];

#[test]
fn six_positions_and_level_make_the_attitude_right() {
    let mut typed = Typed::new("six", 1);
    typed.calibrated();
    let before = typed.tilt_error();
    typed.six_positions();
    typed.accept();
    let (bias, gain) = (typed.truth("accel_bias"), typed.truth("accel_gain"));
    let scale: Vec<f64> = gain.iter().map(|gain| 1.0 / gain).collect();
    let found = (typed.parameters("accel.bias", &XYZ), typed.parameters("accel.scale", &XYZ));
    // What drift, walk and misalignment of half a per cent leave of 0.25 m/s² and half a per cent.
    assert!(apart(&found.0, &bias) < 0.02, "{found:?} {bias:?}");
    assert!(apart(&found.1, &scale) < 0.0015, "{found:?} {scale:?}");
    typed.put_down();
    typed.ask("calibrate level", "stand it on a table");
    typed.wait(TAKES);
    typed.accept();
    let level = typed.parameters("level", &[".roll", ".pitch"]);
    typed.restart();
    // It survives the restart, and is applied.
    assert_eq!(typed.parameters("accel.bias", &XYZ), found.0);
    assert_eq!(typed.parameters("level", &[".roll", ".pitch"]), level);
    let after = typed.tilt_error();
    println!("tilt error {before:.5} rad before, {after:.5} after");
    assert!(before > 0.004 && after < before / 5.0, "{before} {after}");
    // Another calibration of the corrected sensor finds the same, and a new level.
    typed.six_positions();
    typed.accept();
    assert!(apart(&typed.parameters("accel.bias", &XYZ), &found.0) < 0.01);
}

#[test]
fn the_magnetometer_shows_the_heading() {
    let mut typed = Typed::new("mag", 2);
    typed.calibrated();
    // Standing, nose north: the horizontal field is that of the earth.
    let error = |typed: &mut Typed| {
        let field = typed.mean("sensor_mag", "field", LOOKS);
        let yaw = typed.truth("attitude")[2];
        let off = FIELD[1].atan2(FIELD[0]) - field[1].atan2(field[0]) - yaw;
        let strength = field.iter().map(|axis| axis * axis).sum::<f64>().sqrt();
        (off.sin().atan2(off.cos()).abs(), strength)
    };
    let (before, _) = error(&mut typed);
    typed.ask("calibrate mag", "away from iron");
    typed.ask("world turn 30", "a hand turns it");
    typed.wait(TAKES);
    typed.accept();
    let iron = typed.truth("hard_iron");
    let found = typed.parameters("mag.offset", &XYZ);
    assert!(apart(&found, &iron) < 0.8, "{found:?} {iron:?}");
    typed.restart();
    let (after, strength) = error(&mut typed);
    println!("heading error {before:.4} rad before, {after:.4} after; {strength:.2} uT");
    assert!(before > 0.1 && after < before / 4.0, "{before} {after}");
    let earth = FIELD.iter().map(|axis| axis * axis).sum::<f64>().sqrt();
    assert!((strength - earth).abs() < 1.0, "{strength} {earth}");
}

#[test]
fn the_gyro_does_not_drift_with_its_temperature() {
    let mut typed = Typed::new("temperature", 3);
    typed.calibrated();
    typed.ask("calibrate temperature", "let it lie still");
    typed.ask("world warm 20 25", "it is 20 K warmer");
    typed.wait(TAKES);
    typed.accept();
    let (gyro, accel) = (typed.truth("gyro_drift"), typed.truth("accel_drift"));
    let found = (typed.parameters("drift.gyro", &XYZ), typed.parameters("drift.accel", &XYZ));
    // The biases walk meanwhile, as those of the sensor do.
    assert!(apart(&found.0, &gyro) < 4e-5, "{found:?} {gyro:?}");
    assert!(apart(&found.1, &accel) < 8e-4, "{found:?} {accel:?}");
    let drifts = |typed: &mut Typed| {
        typed.calibrated();
        let cold = typed.mean("sensor_imu", "gyro", LOOKS);
        typed.ask("world warm 20 2", "it is 20 K warmer");
        typed.passes(4.0);
        apart(&typed.mean("sensor_imu", "gyro", LOOKS), &cold)
    };
    typed.restart();
    let after = drifts(&mut typed);
    typed.ask("param reset", "erased");
    typed.restart();
    let before = drifts(&mut typed);
    println!("gyro drift {before:.5} rad/s before, {after:.5} after");
    assert!(before > 0.002 && after < before / 3.0, "{before} {after}");
}

#[test]
fn it_is_refused_cancelled_and_explained() {
    let mut typed = Typed::new("refused", 4);
    typed.ask("calibrate status", "nothing was calibrated since power-on");
    typed.ask("calibrate accept", "nothing found, or armed");
    typed.ask("calibrate seven", "usage: calibrate level | six");
    typed.calibrated();
    typed.ask("calibrate six", "lay it on each");
    typed.ask("world hold nose-down", "a hand holds it");
    typed.wait("taken: turn it to another side");
    // It stood on its feet before: they may have been measured, too.
    typed.ask("calibrate status", "still to lie on its tail, right side, left side");
    typed.ask("calibrate cancel", "cancelled");
    typed.wait("cancelled, nothing has changed");
    typed.ask("calibrate accept", "nothing found, or armed");
    assert_eq!(typed.parameters("accel.scale", &XYZ), [1.0; 3]);
    typed.ask("world dance", "usage: world hold");
}
