//! Bytes typed at the console.

use crate::Input;
use stampfly_board::console::{Context, LineEditor, Newest, Request, SensorLine, answer};
use stampfly_board::parameters::PARAMETERS;
use stampfly_board::profile::Profile;
use stampfly_board::tasks::Health;
use stampfly_board::{VehicleConfig, wiring};
use stampfly_types::messages::{FlightMode, FlightState, SystemMode};
use stampfly_types::{Message, Micros};

/// Longest line, as in the firmware.
const LINE: usize = 80;
/// More than any reply: the longest lists every parameter.
const REPLY: usize = 32_768;

/// The first byte says what the vehicle is known to be: armed, disarmed, or nothing. The second fills a sample of every topic.
/// The rest is typed.
pub fn console_line(data: &[u8]) {
    let mut input = Input(data);
    let (state, fill) = (input.byte() % 3, input.byte());
    let (newest, profile, health) = (known(state, fill), Profile::new(), Health::new());
    let (mut config, mut editor) = (VehicleConfig::default(), LineEditor::<LINE>::new());
    let mut echo = String::new();
    while !input.is_empty() {
        let Some(line) = editor.feed(input.byte(), &mut echo) else { continue };
        assert!(line.len() <= LINE && line.bytes().all(|byte| (b' '..=b'~').contains(&byte)), "{line:?}");
        let mut reply = String::new();
        let mut context = Context {
            now: Micros::from_secs(5),
            version: "stampfly 9.9",
            newest: &newest,
            sensors: &[SensorLine { name: "imu", health: &health }],
            profile: &profile,
            config: &mut config,
        };
        let request = answer(line, &mut context, &mut reply).expect("a String takes everything");
        assert!(reply.len() <= REPLY, "{line:?} is answered with {} bytes", reply.len());
        assert!(reply.is_empty() || reply.ends_with("\r\n"), "{line:?}: {reply:?}");
        let is_disarmed = state == DISARMED;
        assert!(is_disarmed || matches!(request, Request::Nothing | Request::StopMotor), "{line:?}: {request:?}");
        for parameter in PARAMETERS {
            let value = parameter.get(&config);
            assert!((parameter.min..=parameter.max).contains(&value), "{line:?}: {} is {value}", parameter.name);
        }
    }
}

const DISARMED: u8 = 1;
const ARMED: u8 = 2;

/// Topics whose samples the console shows or reads, with fields of every kind.
const TOPICS: [wiring::Id; 10] = [
    wiring::Id::sensor_imu,
    wiring::Id::sensor_tof,
    wiring::Id::sensor_flow,
    wiring::Id::sensor_power,
    wiring::Id::command_pilot,
    wiring::Id::command_guided,
    wiring::Id::estimate_state,
    wiring::Id::estimate_status,
    wiring::Id::system_alert,
    wiring::Id::signal,
];

/// What the console has heard of: the state, and unless the byte is zero, a sample of every other topic.
fn known(state: u8, fill: u8) -> Newest {
    let mut newest = Newest::new();
    if fill != 0 {
        let words = [u32::from_le_bytes([fill; 4]); 64];
        for id in TOPICS {
            newest.note(id, Micros::from_secs(u64::from(fill)), &words);
        }
    }
    if matches!(state, DISARMED | ARMED) {
        let armed = state == ARMED;
        let state = if armed { FlightState::Flying } else { FlightState::IdleGround };
        let mode = SystemMode { state, armed, mode: FlightMode::AltHold, ..SystemMode::default() };
        newest.note(wiring::Id::system_mode, Micros::ZERO, &mode.to_words());
    } else {
        // Words that are no state: what is not known to be disarmed counts as armed.
        newest.note(wiring::Id::system_mode, Micros::ZERO, &[!0; 8]);
    }
    newest
}
