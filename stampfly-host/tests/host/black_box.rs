//! What the firmware's black box tells of an accident, from the arming to the text on the terminal.

use stampfly_board::VehicleConfig;
use stampfly_board::black_box::{BlackBox, RETENTION, WORDS};
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::{Bus, Id};
use stampfly_bus::{Band, PublishWords, Taps};
use stampfly_drivers::blocking::block_on;
use stampfly_flight::Assembled;
use stampfly_flight::black_box::{DumpError, MIN_INTERVAL, Refused, dump, open};
use stampfly_host::flight_log;
use stampfly_host::flown::fly;
use stampfly_host::golden::Event;
use stampfly_host::recorder::Recorder;
use stampfly_param::parameters;
use stampfly_types::messages::{FlightStatus, ImuData, PilotInput};
use stampfly_types::{Duration, Instant, Message};
use std::sync::LazyLock;

/// The accident happens so long after the motors were allowed to turn.
const FLIGHT: Duration = Duration::from_secs(20);

/// A flight that ends with a blow, as the firmware remembers it; and when the motors stopped.
static ACCIDENT: LazyLock<(Box<BlackBox<WORDS>>, Instant)> = LazyLock::new(|| {
    let mut recorder = Recorder::<StampFly>::hash_only().with_inputs();
    fly::<StampFly>(&Setup::reference(7), &mut recorder, &mut |_, _| {});

    let mut black_box = Box::new(BlackBox::new(RETENTION));
    let mut bus = Bus::new();
    let Assembled { mut flight_loop, mut outside, mut taps } =
        Assembled::<Runnables>::new(&mut bus, None, &VehicleConfig::default(), Instant::ZERO);
    let (mut armed_at, mut stopped_at, mut pilot) = (None, None, 0u32);
    for event in recorder.into_inputs() {
        match event {
            Event::Sample { topic, at, mut words } => {
                let crashed = armed_at.is_some_and(|armed_at| at >= armed_at + FLIGHT);
                if topic == Id::sensor_imu as usize && crashed {
                    let mut imu =
                        ImuData::from_words(words.as_slice().try_into().expect("its words")).expect("a sample");
                    imu.accel.x += 90.0;
                    words = imu.to_words().to_vec();
                }
                outside.publish_words(topic, at, &words).expect("a topic from outside");
            }
            Event::Turn(now) => {
                for band in [Band::Flight, Band::Background] {
                    flight_loop.run_band(band, now, &mut ());
                }
                taps.drain(&mut |topic, at, generation, words| {
                    black_box.note(topic, at, generation, words);
                    if topic == Id::flight_status as usize {
                        let mode = FlightStatus::from_words(words.try_into().expect("its words")).expect("a mode");
                        match (mode.armed, armed_at) {
                            (true, None) => armed_at = Some(at),
                            (false, Some(_)) if stopped_at.is_none() => stopped_at = Some(at),
                            _ => {}
                        }
                    }
                });
                // A mission is flown by a program; the transmitter would be heard as well.
                if now >= Instant::from_millis(20 * u64::from(pilot)) {
                    pilot += 1;
                    let sticks = PilotInput { roll: 1e-3 * pilot as f32, ..Default::default() };
                    black_box.note(Id::command_pilot as usize, now, pilot, &sticks.to_words());
                }
                if stopped_at.is_some_and(|stopped| now >= stopped + Duration::from_secs(3)) {
                    break;
                }
            }
        }
    }
    (black_box, stopped_at.expect("a blow stops the motors"))
});

/// The dump of the accident, line by line, to a terminal that takes so many lines.
fn dumped(config: &VehicleConfig, takes: usize) -> (Vec<String>, Result<(), DumpError>) {
    let (black_box, _) = &*ACCIDENT;
    let (mut lines, mut cursor) = (Vec::new(), black_box.begin());
    let show = async |line: &str| {
        if lines.len() == takes {
            return Err(Refused);
        }
        lines.push(line.strip_suffix("\r\n").expect("a whole line").to_owned());
        Ok(())
    };
    let outcome = block_on(dump(
        || black_box.next(&mut cursor),
        |sink, at| open::<Runnables, _>(sink, at, "stampfly", config, "the test"),
        show,
    ));
    (lines, outcome)
}

fn bytes(lines: &[String]) -> Vec<u8> {
    let digits = lines.concat();
    (0..digits.len()).step_by(2).map(|at| u8::from_str_radix(&digits[at..at + 2], 16).expect("digits")).collect()
}

#[test]
fn three_and_a_half_seconds_of_flight_are_kept() {
    let (black_box, stopped) = &*ACCIDENT;
    let oldest = black_box.records().map(|record| record.at).min().expect("records");
    let span = stopped.since(oldest);
    println!("{:.2} s of flight in {} kB", span.seconds_f64(), WORDS * 4 / 1024);
    assert!(span >= Duration::from_millis(3_500), "{span}");
    assert!(span < FLIGHT, "the flight was longer than the memory");
}

#[test]
fn the_dump_is_a_log_that_shows_the_last_second() {
    let mut config = VehicleConfig::default();
    parameters::set(&mut config, "eskf.gate", 4.5).expect("in range");
    let (lines, outcome) = dumped(&config, usize::MAX);
    assert_eq!(outcome, Ok(()));
    let (last, log) = lines.split_last().expect("lines");
    let log_bytes = bytes(log);
    assert_eq!(*last, format!("end of log: {} lines, {} bytes", log.len(), log_bytes.len()));

    let parsed = flight_log::parse(&log_bytes).expect("a log");
    assert_eq!(parsed.omissions, []);
    let flight = parsed.flight;
    assert_eq!(flight.parameters["eskf.gate"][0].1, 4.5, "what flew");
    assert_eq!(flight.events[0].text, "the test");
    let stopped = ACCIDENT.1;
    for (topic, least, gap) in [
        ("sensor_imu", 24, 45),
        ("estimate_state", 19, 55),
        ("actuator_motor", 19, 55),
        ("setpoint", 9, 105),
        ("control_output", 9, 105),
        ("command_pilot", 9, 125),
        ("sensor_tof", 9, 135),
        ("sensor_flow", 9, 115),
        ("sensor_power", 4, 300),
        ("flight_status", 1, 1_005),
    ] {
        let series = &flight.topics[topic];
        let last_second: Vec<Instant> = series
            .at
            .iter()
            .copied()
            .filter(|at| *at <= stopped && stopped.since(*at) <= Duration::from_secs(1))
            .collect();
        assert!(last_second.len() >= least, "{topic}: {} samples", last_second.len());
        let longest = last_second.windows(2).map(|pair| pair[1].since(pair[0])).max().unwrap_or_default();
        assert!(longest <= Duration::from_millis(gap), "{topic}: nothing for {longest}");
    }
    let modes = &flight.topics["flight_status"];
    let armed = modes.column("armed").expect("a column");
    let ended = armed.iter().position(|armed| *armed == 0.0).expect("how it ended");
    assert!(modes.at[ended].since(stopped) <= MIN_INTERVAL, "kept at {}, was at {stopped}", modes.at[ended]);
    let accel = flight.topics["sensor_imu"].columns_of::<3>("accel").expect("three")[0];
    assert!(accel.iter().any(|x| *x > 80.0), "the blow itself");
    for nobody_needs in ["sensor_tof_front", "telemetry", "signal", "button_contact"] {
        assert!(flight.topics.get(nobody_needs).is_none_or(|series| series.at.is_empty()), "{nobody_needs}");
    }
}

#[test]
fn a_dump_that_is_cut_off_says_so() {
    let config = VehicleConfig::default();
    let (whole, _) = dumped(&config, usize::MAX);
    for takes in [0, 1, 17, whole.len() / 2, whole.len() - 2, whole.len() - 1] {
        let (lines, outcome) = dumped(&config, takes);
        assert_eq!(lines, whole[..takes], "what was sent is the beginning");
        let Err(DumpError::Refused(sent)) = outcome else { panic!("{takes} lines: {outcome:?}") };
        assert_eq!((sent.lines as usize, sent.bytes), (takes, bytes(&lines).len()));
        assert!(outcome.unwrap_err().to_string().starts_with("INCOMPLETE log"));
        assert!(!lines.iter().any(|line| line.starts_with("end of log")));
    }
}

#[test]
fn a_flight_that_begins_while_the_last_is_told_ends_it() {
    let mut black_box = BlackBox::<256>::new(RETENTION);
    let armed = FlightStatus { armed: true, ..Default::default() }.to_words();
    let config = VehicleConfig::default();
    let nothing = block_on(dump(
        || Ok(black_box.records().next()),
        |sink, at| open::<Runnables, _>(sink, at, "stampfly", &config, ""),
        async |_| Ok(()),
    ));
    assert_eq!(nothing, Err(DumpError::Empty));
    black_box.note(Id::flight_status as usize, Instant::from_micros(1), 1, &armed);
    let (mut cursor, mut asked) = (black_box.begin(), 0);
    let next = || {
        asked += 1;
        if asked == 2 {
            black_box.note(Id::flight_status as usize, Instant::from_secs(9), 2, &armed);
        }
        black_box.next(&mut cursor)
    };
    let outcome =
        block_on(dump(next, |sink, at| open::<Runnables, _>(sink, at, "stampfly", &config, ""), async |_| Ok(())));
    assert!(matches!(outcome, Err(DumpError::Changed(_))), "{outcome:?}");
}
