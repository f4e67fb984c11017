//! Stick files in the program's hands: flown, judged, logged, flown again, and refused by name.

use crate::program::folder;
use serde_json::Value;
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::{Outcome, StampFly};
use stampfly_board::topics::Id;
use stampfly_flight::Observer;
use stampfly_flight::newest::message;
use stampfly_host::campaign::sticks::{cells, files, fly_one, sums};
use stampfly_host::flown::fly;
use stampfly_host::log::info::Info;
use stampfly_host::log::refly::{facts, refly};
use stampfly_sim::Truth;
use stampfly_sim::recorder::Recorder;
use stampfly_sim::sticks::{StickFile, StickOptions};
use stampfly_sim::vehicle::{Options, Vehicle, Verdict as _, Witness};
use stampfly_types::Instant;
use stampfly_types::messages::{FlightMode, FlightPhase, PilotInput};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The StampFly's own set.
fn set() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../stampfly-board/sticks")
}

fn header(rows: &str) -> String {
    format!("t,throttle,roll,pitch,yaw,mode,arm,land\n{rows}\n")
}

fn options(rows: &str) -> Options {
    let sticks = StickOptions { file: header(rows), ..StickOptions::default() };
    Options { sticks: Some(sticks), gust: Some(0.0), ..Options::default() }
}

fn flown(options: &Options) -> Outcome {
    let setup = StampFly::setup(options, 1).expect("options");
    fly::<StampFly>(&setup, &mut (), &mut |_, _| {}).outcome
}

/// Phases of a flight, each with its mode, without repetitions.
fn phases(outcome: &Outcome) -> Vec<(FlightPhase, FlightMode)> {
    outcome.phases.iter().map(|change| (change.phase, change.mode)).collect()
}

#[test]
fn every_file_of_the_set_is_one_and_is_named_in_its_readme() {
    let readme = std::fs::read_to_string(set().join("README.md")).expect("a README");
    let globs: Vec<_> = readme
        .lines()
        .filter(|line| line.starts_with("| `"))
        .flat_map(|line| {
            let names = line.split('|').nth(1).unwrap_or_default();
            names.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>()
        })
        .collect();
    let files = files(&[set()]).expect("a folder");
    assert!(files.len() > 100, "{}", files.len());
    for file in files {
        StickFile::read(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let name = file.file_stem().expect("a name").to_string_lossy().into_owned();
        let named = |glob: &String| glob.strip_suffix('*').map_or(*glob == name, |start| name.starts_with(start));
        assert!(globs.iter().any(named), "{name} is not in the README");
    }
}

#[test]
fn a_file_that_begins_in_the_air_begins_at_its_height_and_in_its_mode() {
    let mut options = options("0,0.6,0,0,0,stabilize,1,0\n1,0.6,0,0,0,stabilize,1,0");
    options.sticks.as_mut().expect("sticks").from_height = Some(2.0);
    let outcome = flown(&options);
    assert!(outcome.succeeded(), "{}", outcome.sentence());
    assert!((1.7..2.6).contains(&outcome.judgement.max_height_m), "{}", outcome.judgement.max_height_m);
    let modes: Vec<_> = phases(&outcome).into_iter().filter(|(phase, _)| *phase == FlightPhase::Flying).collect();
    // The sticks are let go in ALT_HOLD, and the arm switch lands it.
    assert_eq!(modes.iter().map(|(_, mode)| *mode).collect::<Vec<_>>(), [FlightMode::Stabilize, FlightMode::AltHold]);
    assert_eq!(phases(&outcome).last().map(|(phase, _)| *phase), Some(FlightPhase::IdleGround));
    assert!(outcome.judgement.interventions.is_empty(), "{:?}", outcome.judgement.interventions);
}

#[test]
fn one_that_begins_disarmed_has_the_vehicles_time_or_waits_for_it() {
    let rows = "0,0,0,0,0,althold,0,0\n1,0,0,0,0,althold,1,0\n4,0,0,0,0,althold,1,0";
    let early = flown(&options(rows));
    assert_eq!(early.judgement.outcome, "refused", "a second after power-on it calibrates");
    assert!(early.succeeded(), "to be refused is right: {}", early.sentence());
    let mut waits = options(rows);
    waits.sticks.as_mut().expect("sticks").when_ready = true;
    let outcome = flown(&waits);
    assert!(outcome.succeeded() && outcome.judgement.max_height_m > 0.3, "{}", outcome.sentence());
}

#[test]
fn a_file_lands_when_its_column_asks_for_it_and_that_is_no_intervention() {
    let outcome = flown(&options("0,0,0,0,0,poshold,1,0\n1,0,0,0,0,poshold,1,1\n20,0,0,0,0,poshold,1,1"));
    assert!(phases(&outcome).iter().any(|(phase, _)| *phase == FlightPhase::Landing));
    assert!(outcome.succeeded() && outcome.judgement.interventions.is_empty(), "{:?}", outcome.judgement);
}

#[test]
fn sticks_that_fly_it_into_the_floor_are_not_the_vehicles_fault() {
    let outcome = flown(&options("0,0.6,0,0,0,stabilize,1,0\n0.2,-1,0,0,0,stabilize,1,0\n3,-1,0,0,0,stabilize,1,0"));
    let judgement = &outcome.judgement;
    assert_eq!(judgement.outcome, "crashed", "{judgement:?}");
    assert!(outcome.succeeded(), "{}: {:?}", outcome.sentence(), judgement.interventions);
}

#[test]
fn a_fault_that_cuts_the_motors_is_an_intervention_of_a_vehicle_that_is_not_sound() {
    let hover = "0,0,0,0,0,poshold,1,0\n6,0,0,0,0,poshold,1,0";
    let outcome = flown(&Options { fault: vec!["imu-silent@hover+1".into()], ..options(hover) });
    let judgement = &outcome.judgement;
    let [one] = judgement.interventions.as_slice() else { panic!("{judgement:?}") };
    assert_eq!((one.alert.as_str(), one.action, one.sound), ("IMU_LOST", "cut", false));
    assert!(one.height_m > 0.3 && one.t_s > 5.0, "{one:?}");
    assert!(outcome.succeeded(), "{}", outcome.sentence());
}

#[test]
fn a_log_has_the_rows_and_is_flown_again_without_the_file() {
    let folder = folder("sticks", "again");
    let file = folder.join("sticks.csv");
    // Too much for one message of a log.
    let shake = |n: usize| format!("{},0,0.{:02},-0.{:02},0,althold,1,0\n", n as f32 * 0.02, n % 50, n % 33);
    std::fs::write(&file, header(&(0..150).map(shake).collect::<String>())).expect("written");
    let sticks = StickOptions { file: file.display().to_string(), ..StickOptions::default() };
    let options = Options { sticks: Some(sticks), ..Options::default() };
    let (setup, facts) = (StampFly::setup(&options, 3), facts::<StampFly>(&options, 3).expect("options"));
    let setup = setup.expect("options");
    let mut recorder = Recorder::<StampFly>::with_log(&setup, &facts);
    fly::<StampFly>(&setup, &mut recorder, &mut |_, _| {});
    std::fs::remove_file(&file).expect("removed");
    let info = Info::of(&stampfly_host::flight_log::parse(recorder.log()).expect("a log"));
    assert!(info.facts["flight_options"].len() > 2_048 && info.facts.keys().all(|name| !name.contains('/')));
    assert!(info.to_string().lines().all(|line| line.chars().count() < 500), "{info}");
    let replayed = crate::replay::replay(recorder.log()).expect("a log");
    assert!(replayed.difference.is_none(), "another flight");
    let same = StampFly::parameters(StampFly::config(&setup));
    let same = same.iter().find(|setting| setting.name == "position.pos.kp").expect("a parameter").value as f32;
    let reflown = refly::<StampFly>(recorder.log(), Instant::from_secs(9), &[format!("position.pos.kp={same}")]);
    assert!(reflown.expect("flies").log == recorder.log(), "other bits");
}

#[test]
fn a_campaign_flies_a_file_with_one_mode_in_every_mode_and_others_as_they_are() {
    let folder = folder("sticks", "modes");
    let one = folder.join("one.csv");
    let two = folder.join("two.csv");
    std::fs::write(&one, header("0,0,0,0,0,poshold,1,0\n0.5,0,0,0,0,poshold,1,0")).expect("written");
    std::fs::write(&two, header("0,0,0,0,0,poshold,1,0\n0.5,0,0,0,0,althold,1,0")).expect("written");
    std::fs::write(folder.join("README.md"), "no sticks").expect("written");
    let found = files(std::slice::from_ref(&folder)).expect("a folder");
    assert_eq!(found, [one.clone(), two.clone()]);
    let of = |file: &Path| {
        let sticks = StickOptions { file: file.display().to_string(), ..StickOptions::default() };
        cells::<StampFly>(file, &sticks, &Options::default()).expect("cells")
    };
    let modes: Vec<_> = of(&one).into_iter().map(|cell| cell.mode.unwrap_or_default()).collect();
    assert_eq!(modes, ["", "stabilize", "acro", "althold"]);
    let cell = of(&two);
    assert_eq!(cell.len(), 1);
    let flights: Vec<_> = (1..=2).map(|seed| fly_one::<StampFly>(&cell[0], seed).expect("flies")).collect();
    assert!(flights.iter().all(|flight| flight.ended_well), "{flights:?}");
    assert_eq!(flights[0].line, format!("stampfly fly --seed 1 --sticks {}", two.display()));
    let sums = sums(&flights);
    assert_eq!((sums.len(), sums[0].flights, sums[0].ended_well), (1, 2, 2));
    assert!(sums[0].while_sound.is_empty());
}

/// What is true from when the vehicle hears these sticks on: throttle, roll, pitch, yaw.
#[derive(Default)]
struct Heard {
    sticks: [f32; 4],
    /// For so long, s.
    seconds: f32,
    since: Option<Instant>,
    truths: Vec<Truth>,
}

impl Observer for Heard {}

impl Witness<Runnables> for Heard {
    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        if Id::ALL.get(topic) != Some(&Id::command_pilot) {
            return;
        }
        let Some(PilotInput { throttle, roll, pitch, yaw, .. }) = message(words) else { return };
        let near = [throttle, roll, pitch, yaw].iter().zip(self.sticks).all(|(is, wanted)| (is - wanted).abs() < 0.01);
        self.since = self.since.or(near.then_some(at));
    }

    fn beside(&mut self, _: usize, at: Instant, _: u32, words: &[u32]) {
        if self.since.is_some_and(|since| at.since(since).seconds() < self.seconds) {
            self.truths.extend(message::<Truth>(words));
        }
    }
}

/// North and east, m, clockwise, rad, and up, m: how far it has gone when the sticks were so for so
/// many seconds, and at rest for half a second.
fn moved(mode: &str, hover: f32, sticks: [f32; 4], seconds: f32) -> [f32; 4] {
    let row =
        |t: f32, [throttle, roll, pitch, yaw]: [f32; 4]| format!("{t},{throttle},{roll},{pitch},{yaw},{mode},1,0");
    let rest = [hover, 0.0, 0.0, 0.0];
    let rows = [row(0.0, rest), row(0.5, sticks), row(0.5 + seconds, rest), row(1.1 + seconds, rest)];
    let mut options = options(&rows.join("\n"));
    options.sticks.as_mut().expect("sticks").from_height = Some(1.5);
    let setup = StampFly::setup(&options, 1).expect("options");
    let mut heard = Heard { sticks, seconds: seconds + 0.5, ..Heard::default() };
    fly::<StampFly>(&setup, &mut heard, &mut |_, _| {});
    let (first, last) = heard.truths.first().zip(heard.truths.last()).expect("it hears them");
    let [north, east, down] = (last.position - first.position).into();
    let turned = heard.truths.iter().map(|truth| truth.angular_rate.z * 0.0025).sum();
    [north, east, turned, -down]
}

/// The signs that `docs/guide/sticks.md` promises, from the file to what the vehicle does while it looks
/// north.
#[test]
fn sticks_move_the_vehicle_the_way_the_page_says() {
    // The throttle with which it stays at its height; in a manual mode about that. How far the
    // others go there, and for how long: a lean that is kept carries it farther, and in ACRO the
    // stick turns it further and further.
    for (mode, hover, stick, seconds) in [
        ("poshold", 0.0, 0.5, 1.5),
        ("althold", 0.0, 0.5, 0.5),
        ("stabilize", 0.58, 0.5, 0.5),
        ("acro", 0.58, 0.15, 0.5),
    ] {
        for sign in [1.0f32, -1.0] {
            let stick = sign * stick;
            let up = moved(mode, hover, [hover + 0.3 * sign, 0.0, 0.0, 0.0], seconds);
            let right = moved(mode, hover, [hover, stick, 0.0, 0.0], seconds);
            let forward = moved(mode, hover, [hover, 0.0, stick, 0.0], seconds);
            let clockwise = moved(mode, hover, [hover, 0.0, 0.0, 0.5 * sign], seconds);
            println!("{mode} {sign}: pitch {forward:.2?}, roll {right:.2?}, yaw {clockwise:.2?}, throttle {up:.2?}");
            let what = |stick: &str, moved: [f32; 4]| format!("{mode}, {stick} to {sign}: {moved:?}");
            let straight = |along: f32, aside: f32| sign * along > 0.15 && aside.abs() < 0.5 * along.abs();
            assert!(straight(forward[0], forward[1]), "{}", what("pitch", forward));
            assert!(straight(right[1], right[0]), "{}", what("roll", right));
            assert!(sign * clockwise[2] > 0.1, "{}", what("yaw", clockwise));
            assert!(sign * up[3] > 0.04, "{}", what("throttle", up));
        }
    }
}

/// Exit code, standard output and standard error.
fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_stampfly")).current_dir(folder).args(arguments).output();
    let output = output.expect("it runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn the_program_refuses_by_name_and_with_the_line() {
    let folder = folder("sticks", "refused");
    std::fs::write(folder.join("good.csv"), header("0,0,0,0,0,poshold,1,0")).expect("written");
    std::fs::write(folder.join("bad.csv"), header("0,0,0,0,0,poshold,1,0\n1,2,0,0,0,poshold,1,0")).expect("written");
    let refused = |arguments: &str, said: &str| {
        let words: Vec<_> = arguments.split(' ').collect();
        let (code, out, error) = run(&folder, &words);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{arguments}: {error}");
        assert!(error.contains(said), "{arguments}: {error}");
    };
    refused("fly --sticks bad.csv", "--sticks bad.csv: line 3: throttle: '2' is no number from -1 to 1");
    refused("campaign --sticks good.csv bad.csv", "bad.csv: line 3");
    refused("fly --sticks none.csv", "none.csv: ");
    refused("fly --sticks good.csv --mission hover", "cannot be used with");
    refused("fly --sticks good.csv --pilot", "cannot be used with");
    refused("fly --sticks good.csv --mode loiter", "--mode 'loiter' is none of stabilize, acro, althold, poshold");
    refused("fly --mode acro", "--pilot|--sticks");
    refused("fly --from-height 3", "--sticks");
    refused("campaign --sticks good.csv --faults", "cannot be used with");
    refused("fly --vehicle rover --sticks good.csv", "the rover has no sticks");
    refused("fly --vehicle plane --sticks good.csv", "this vehicle has no sticks");
    let stm32 = "--sticks: mode poshold at 0 s: this vehicle has stabilize, which is its ANGLE, and acro";
    refused("fly --vehicle stm32-quad --sticks good.csv", stm32);
}

#[test]
fn the_program_flies_one_and_says_what_came_of_it() {
    let folder = folder("sticks", "flown");
    std::fs::write(folder.join("sticks.csv"), header("0,0,0,0,0,poshold,1,0\n1,0,0.5,0,0,poshold,1,0"))
        .expect("written");
    let (code, out, error) = run(&folder, &["fly", "--sticks", "sticks.csv", "--mode", "althold", "--json"]);
    assert_eq!(code, Some(0), "{error}");
    let value: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((&value["unhindered"], &value["interventions"]), (&Value::Bool(true), &Value::Array(Vec::new())));
    let (code, out, error) = run(&folder, &["campaign", "--sticks", ".", "--flights", "1", "--json"]);
    assert_eq!(code, Some(0), "{error}");
    let value: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((&value["flights"], &value["ended_well"]), (&4.into(), &4.into()), "{value}");
    assert_eq!(value["cells"].as_array().map(Vec::len), Some(4));
}
