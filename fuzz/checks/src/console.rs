//! Bytes typed at the console.

use crate::Input;
use stampfly_board::console::{Command, Console, Newest, Profile};
use stampfly_board::topics::{Id, TOPICS};
use stampfly_board::{VehicleConfig, schedule};
use stampfly_flight::console::{LineEditor, Request, SensorLine, answer};
use stampfly_param::Parameters;
use stampfly_types::messages::{FlightMode, FlightPhase, FlightStatus};
use stampfly_types::{Instant, Message};

/// Longest line, as in the firmware.
const LINE: usize = 80;
/// More than any reply: the longest lists every parameter.
const REPLY: usize = 32_768;

/// The first byte says what the vehicle is known to be: armed, disarmed, or nothing. The second fills a sample of every topic.
/// The rest is typed.
pub fn console_line(data: &[u8]) {
    let mut input = Input(data);
    let (state, fill) = (input.byte() % 3, input.byte());
    let (newest, profile) = (known(state, fill), Profile::new(&schedule::ACTIVATIONS));
    let sensors = [SensorLine { name: "imu", samples: 3, errors: 1, last_error: Some(&"bus") }];
    let (mut config, mut editor) = (VehicleConfig::default(), LineEditor::<LINE>::new());
    let mut echo = String::new();
    while !input.is_empty() {
        let Some(line) = editor.feed(input.byte(), &mut echo) else { continue };
        assert!(line.len() <= LINE && line.bytes().all(|byte| (b' '..=b'~').contains(&byte)), "{line:?}");
        let mut reply = String::new();
        let mut console = Console {
            version: "stampfly 9.9",
            newest: &newest,
            sensors: &sensors,
            profile: &profile,
            config: &mut config,
            facts: &[],
        };
        let request = answer(line, Instant::from_secs(5), &mut console, &mut reply).expect("a String takes everything");
        assert!(reply.len() <= REPLY, "{line:?} is answered with {} bytes", reply.len());
        assert!(reply.is_empty() || reply.ends_with("\r\n"), "{line:?}: {reply:?}");
        let is_harmless = matches!(request, Request::Nothing | Request::Vehicle(Command::StopMotor));
        assert!(is_harmless || state == DISARMED, "{line:?}: {request:?}");
        if let Request::Vehicle(Command::TestMotor { motor, duty }) = request {
            assert!((1..=4).contains(&motor) && (0.0..=0.3).contains(&duty), "{line:?}: {request:?}");
        }
        for (index, parameter) in (0..).map_while(|index| Some((index, config.describe(index)?))) {
            let value = config.get(index).expect("it has a value");
            assert!((parameter.min..=parameter.max).contains(&value), "{line:?}: {} is {value}", parameter.name);
        }
    }
}

const DISARMED: u8 = 1;
const ARMED: u8 = 2;

/// What the console has heard of: the state, and unless the byte is zero, a sample of every other topic.
fn known(state: u8, fill: u8) -> Newest {
    let mut newest = Newest::new();
    let word = u32::from_le_bytes([fill; 4]);
    for (index, topic) in TOPICS.iter().enumerate().filter(|_| fill != 0) {
        newest.note(index, Instant::from_secs(u64::from(fill)), &vec![word; topic.words]);
    }
    if matches!(state, DISARMED | ARMED) {
        let armed = state == ARMED;
        let phase = if armed { FlightPhase::Flying } else { FlightPhase::IdleGround };
        let mode = FlightStatus { phase, armed, mode: FlightMode::AltHold, ..FlightStatus::default() };
        newest.note(Id::flight_status as usize, Instant::ZERO, &mode.to_words());
    } else {
        // Words that are no state: what is not known to be disarmed counts as armed.
        newest.note(Id::flight_status as usize, Instant::ZERO, &[!0; FlightStatus::WORDS]);
    }
    newest
}
