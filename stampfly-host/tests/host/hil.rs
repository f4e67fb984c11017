//! Hardware in the loop over a pipe: the same bits as a flight in one process, whatever the line loses, and no flight with a
//! vehicle that is another one or has gone.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_flight::hil::{Over, Refusal, Served};
use stampfly_host::flown::{self, Flown};
use stampfly_host::hil::emulated::{Pipe, start};
use stampfly_host::hil::fly;
use stampfly_host::recorder::Recorder;
use stampfly_rover::schedule::Runnables as RoverRunnables;
use stampfly_sim::vehicle::{Figures, Options, Port, Remote, RemoteError, Settings, Vehicle, Verdict};
use std::io;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

fn setup(change: impl FnOnce(&mut Options)) -> Setup {
    let mut options = Options { mission: Some("arm; takeoff 0.3; hover 0.5; land".into()), ..Options::default() };
    change(&mut options);
    StampFly::setup(&options, 7).expect("valid options")
}

/// Loses and garbles bytes, from a seed, in both directions.
struct Noisy {
    pipe: Pipe,
    random: ChaCha8Rng,
    /// One byte in so many is lost, and as many are garbled.
    rarity: u32,
    /// A frame in so many is lost altogether.
    frames: u32,
}

impl Noisy {
    fn damage(&mut self, bytes: &[u8]) -> Vec<u8> {
        if self.random.next_u32().is_multiple_of(self.frames) {
            return Vec::new();
        }
        let mut damaged = Vec::new();
        for byte in bytes {
            match self.random.next_u32() % self.rarity {
                0 => {}
                1 => damaged.push(byte ^ (1 << (self.random.next_u32() % 8))),
                _ => damaged.push(*byte),
            }
        }
        damaged
    }
}

impl Port for Noisy {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let damaged = self.damage(bytes);
        self.pipe.send(&damaged)
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        let count = self.pipe.receive(buffer, patience)?;
        let damaged = self.damage(&buffer[..count]);
        buffer[..damaged.len()].copy_from_slice(&damaged);
        Ok(damaged.len())
    }
}

/// A pipe with a vehicle at its other end.
fn vehicle() -> (Pipe, JoinHandle<Served>) {
    let [here, there] = Pipe::pair();
    (here, start::<Runnables>(there))
}

type Outcome = Flown<<StampFly as Vehicle>::Outcome>;

/// A flight over this port: how it went, its hash and its log, what was said.
fn flown(
    setup: &Setup,
    port: &mut dyn Port,
    settings: Settings,
) -> Result<(Outcome, Recorder<StampFly>, Figures), RemoteError> {
    let mut recorder = Recorder::<StampFly>::with_log(setup, &[]);
    let mut remote = Remote::new(port, settings);
    let outcome = fly::<StampFly>(setup, &mut remote, &mut recorder, &mut |_, _| {});
    let figures = remote.figures().clone();
    outcome.map(|outcome| (outcome, recorder, figures))
}

/// The hash of the same flight in one process.
fn natively(setup: &Setup) -> u64 {
    let mut recorder = Recorder::<StampFly>::hash_only();
    assert!(flown::fly::<StampFly>(setup, &mut recorder, &mut |_, _| {}).outcome.succeeded());
    recorder.hash()
}

#[test]
fn a_flight_over_a_line_is_the_same_flight() {
    let setup = setup(|_| {});
    let (mut pipe, vehicle) = vehicle();
    let (flown, recorder, figures) = flown(&setup, &mut pipe, Settings::default()).expect("it flies");
    assert!(flown.outcome.succeeded());
    assert_eq!(recorder.hash(), natively(&setup));
    assert_eq!((figures.again, figures.garbled, figures.lost, flown.log_lost), (0, [0, 0], 0, 0));
    assert_eq!(vehicle.join().expect("no panic"), Served::Over(Over::Ended));
    // The log is one that can be flown again without the vehicle.
    let set = |config: &mut _, name: &str, value| StampFly::set_parameter(config, name, value).is_ok();
    let config = StampFly::default_config();
    let again = stampfly_flight::replay::<Runnables>(recorder.log(), config, set, Default::default()).expect("a log");
    assert_eq!(again.difference, None);
    assert!(again.activations > 5_000, "{again:?}");
}

#[test]
fn parameters_and_faults_are_those_of_the_computer() {
    let setup = setup(|options| {
        options.param = vec!["rate.roll.ti=0.7".into()];
        options.fault = vec!["imu-silent@hover+0.02".into()];
    });
    let (mut pipe, _vehicle) = vehicle();
    let (_, recorder, _) = flown(&setup, &mut pipe, Settings::default()).expect("it flies");
    let mut native = Recorder::<StampFly>::hash_only();
    let _ = flown::fly::<StampFly>(&setup, &mut native, &mut |_, _| {});
    assert_eq!(recorder.hash(), native.hash());
    assert_ne!(recorder.hash(), natively(&self::setup(|_| {})), "neither has been heard of");
}

#[test]
fn a_line_that_loses_and_garbles_bytes_changes_no_bit() {
    let setup = setup(|_| {});
    let (pipe, vehicle) = vehicle();
    let mut noisy = Noisy { pipe, random: ChaCha8Rng::seed_from_u64(1), rarity: 40_000, frames: 400 };
    let settings = Settings { patience: Duration::from_millis(20), tries: 8, ..Settings::default() };
    let (_, recorder, figures) = flown(&setup, &mut noisy, settings).expect("it flies");
    assert_eq!(recorder.hash(), natively(&setup));
    assert!(figures.again > 10, "{} asked again", figures.again);
    assert!(figures.garbled.iter().all(|garbled| *garbled > 0), "{:?}", figures.garbled);
    drop(noisy);
    assert!(matches!(vehicle.join().expect("no panic"), Served::Over(_)));
}

#[test]
fn another_vehicle_is_refused() {
    let [mut here, there] = Pipe::pair();
    let _vehicle = start::<Runnables>(there);
    let mut remote = Remote::new(&mut here, Settings::default());
    let refused = remote.greet::<RoverRunnables>();
    assert!(matches!(refused, Err(RemoteError::Refused(Refusal::OtherTables))), "{refused:?}");
    // It is still there for whoever means it.
    assert!(remote.greet::<Runnables>().is_ok());
    let unknown = remote.parameter("no.such", 1.0);
    assert!(matches!(unknown, Err(RemoteError::Parameter(_, Refusal::UnknownParameter))), "{unknown:?}");
    let outside = remote.parameter("eskf.gate", f32::NAN);
    assert!(matches!(outside, Err(RemoteError::Parameter(_, Refusal::OutOfRange))), "{outside:?}");
}

/// A line that goes dead after so many frames, without a word.
struct Dying(Pipe, u32);

impl Port for Dying {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.1 = self.1.saturating_sub(1);
        if self.1 > 0 { self.0.send(bytes) } else { Ok(()) }
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        self.0.receive(buffer, patience)
    }
}

#[test]
fn a_vehicle_that_is_left_alone_ends_the_flight_and_says_so() {
    let setup = setup(|_| {});
    let (pipe, vehicle) = vehicle();
    let mut dying = Dying(pipe, 1_500);
    let settings = Settings { patience: Duration::from_millis(30), tries: 2, ..Settings::default() };
    let lost = flown(&setup, &mut dying, settings).map(|_| ());
    assert!(matches!(lost, Err(RemoteError::NoAnswer)), "{lost:?}");
    let begun = Instant::now();
    // The pipe is held, so nothing tells the vehicle but the silence.
    assert_eq!(vehicle.join().expect("no panic"), Served::Over(Over::Silence));
    assert!(begun.elapsed() > Duration::from_secs(1));
    drop(dying);
}

#[test]
fn a_line_that_is_gone_is_an_error() {
    let [mut here, there] = Pipe::pair();
    drop(there);
    let gone = flown(&setup(|_| {}), &mut here, Settings::default()).map(|_| ());
    assert!(matches!(gone, Err(RemoteError::Port(_))), "{gone:?}");
}

#[test]
fn an_executor_that_is_late_is_not_offered_and_neither_is_another_vehicle() {
    let (mut pipe, _vehicle) = vehicle();
    let late = flown(&setup(|options| options.jitter = Some(1)), &mut pipe, Settings::default()).map(|_| ());
    assert!(matches!(late, Err(RemoteError::NotOffered(_))), "{late:?}");
}

#[test]
fn in_real_time_answers_are_measured_against_the_wall() {
    let setup = setup(|_| {});
    let (mut pipe, _vehicle) = vehicle();
    let settings = Settings { real_time: true, ..Settings::default() };
    let (flown, recorder, figures) = flown(&setup, &mut pipe, settings).expect("it flies");
    assert!((0.3..1.01).contains(&flown.realtime_factor), "{}", flown.realtime_factor);
    assert_eq!(figures.behind.len(), figures.round_trips.len());
    assert_eq!(recorder.hash(), natively(&setup));
}
