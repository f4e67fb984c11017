//! Parameters that change while the vehicle is on: on the ground at once, in flight the gains at once and the others after the landing; told as a topic, and the
//! log replays.

use crate::replay::replay as again;
use core::net::{Ipv4Addr, SocketAddr};
use stampfly_board::parameters;
use stampfly_board::schedule::{ACTIVATIONS, Runnables};
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::Id;
use stampfly_board::{VehicleConfig, messages::ParameterChange};
use stampfly_flight::Observer;
use stampfly_flight::compact::Samples;
use stampfly_flight::replay::{ReplayOptions, replay};
use stampfly_host::flown::fly;
use stampfly_host::log::record::run_again;
use stampfly_host::recorder::Recorder;
use stampfly_host::serve::RecordOut;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_param::Parameters;
use stampfly_services::mavlink::short_name;
use stampfly_sim::vehicle::{Client, Heard, Live, Ports, Vehicle, Witness};
use stampfly_types::messages::{ControlOutput, FlightStatus, StateEstimate};
use stampfly_types::{Duration, Instant, Message, frame};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

/// Between two looks at the ports.
const TICKS_A_SECOND: u32 = 200;

/// Programs that say something at an instant.
#[derive(Debug)]
struct Played {
    says: Vec<Says>,
    tick: AtomicU32,
    heard: Mutex<Answers>,
}

/// When, s, at which port of the vehicle, what.
type Says = (f32, &'static str, Vec<u8>);

/// What the vehicle says: at any port as text, and at the port for MAVLink.
#[derive(Debug, Default)]
struct Answers {
    text: String,
    frames: Vec<u8>,
}

fn port(name: &str) -> usize {
    StampFly::PORTS.iter().position(|port| port.name == name).expect("a port")
}

impl Ports for Played {
    fn receive(&self, _: Option<std::time::Instant>, hear: &mut dyn FnMut(Client, Heard<'_>)) {
        let tick = self.tick.fetch_add(1, Ordering::Relaxed);
        let client = |name| Client { port: port(name), address: SocketAddr::from((Ipv4Addr::LOCALHOST, 9)) };
        if tick == 0 {
            hear(client("console"), Heard::Opened);
            hear(client("http"), Heard::Opened);
            hear(client("mavlink-tcp"), Heard::Opened);
        }
        for (_, port, bytes) in self.says.iter().filter(|(at, ..)| (at * TICKS_A_SECOND as f32) as u32 == tick) {
            hear(client(port), Heard::Bytes(bytes));
        }
    }

    fn send(&self, client: &Client, bytes: &[u8]) {
        let mut heard = self.heard.lock().expect("nobody panics");
        if client.port == port("mavlink-tcp") {
            heard.frames.extend(bytes);
        } else {
            heard.text.push_str(&String::from_utf8_lossy(bytes));
        }
    }

    fn are_closed(&self) -> bool {
        false
    }
}

#[derive(Default)]
struct Watch {
    changes: Vec<(Instant, ParameterChange)>,
    replaced: Vec<Instant>,
    armed: Vec<(Instant, bool)>,
    /// Largest height above the ground of each stretch in the air.
    highest: Vec<f32>,
    /// What control has asked for.
    asked: Vec<(Instant, ControlOutput)>,
    /// Largest tilt of each stretch in the air, rad.
    tilted: Vec<f32>,
}

impl Observer for Watch {}

impl Witness<Runnables> for Watch {
    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        fn read<M: Message<Words: for<'w> TryFrom<&'w [u32]>>>(words: &[u32]) -> M {
            M::from_words(&words.try_into().ok().expect("its words")).expect("a message")
        }
        match Id::ALL[topic] {
            Id::parameter_change => self.changes.push((at, read(words))),
            Id::flight_status => {
                let armed = read::<FlightStatus>(words).armed;
                if self.armed.last().is_none_or(|(_, last)| *last != armed) {
                    self.armed.push((at, armed));
                    self.highest.extend(armed.then_some(0.0));
                    self.tilted.extend(armed.then_some(0.0));
                }
            }
            Id::estimate_state => {
                let StateEstimate { height, attitude, .. } = read(words);
                if let Some((highest, tilted)) = self.highest.last_mut().zip(self.tilted.last_mut()) {
                    *highest = highest.max(height);
                    *tilted = tilted.max(frame::tilt(&attitude));
                }
            }
            Id::control_output => self.asked.push((at, read(words))),
            _ => {}
        }
    }

    fn replaced(&mut self, clock: Instant) {
        self.replaced.push(clock);
    }
}

fn live(says: &'static [(f32, &'static str, &'static str)], seconds: u64) -> (Watch, Vec<u8>, String) {
    let says = says.iter().map(|(at, port, text)| (*at, *port, text.as_bytes().to_vec())).collect();
    let (watch, log, answers) = live_with(says, seconds);
    (watch, log, answers.text)
}

fn live_with(says: Vec<Says>, seconds: u64) -> (Watch, Vec<u8>, Answers) {
    let played = std::sync::Arc::new(Played { says, tick: AtomicU32::new(0), heard: Mutex::default() });
    let live = Live { ports: played.clone(), number: 0, limit: Duration::from_secs(seconds), speed: None };
    let setup = Setup::reference(1).flown_by(live);
    let outs = (Recorder::<StampFly>::with_log(&setup, &[]), RecordOut::memory(StampFly::NAME));
    let mut witness = (outs, Watch::default());
    fly::<StampFly>(&setup, &mut witness, &mut |_, _| {});
    let heard = std::mem::take(&mut *played.heard.lock().expect("nobody panics"));
    let ((log, record), watch) = witness;
    // The compact record goes on from a key frame wherever runnables began again.
    let (again, contents) = run_again(record.file(), None, Samples::Recorded).expect("reads");
    assert_eq!((contents.gaps, contents.idle_since), (watch.replaced.len() as u64, None));
    let options = ReplayOptions { from: Some(Instant::ZERO), is_thinned: true };
    let replayed = replay::<Runnables>(&again, VehicleConfig::default(), |_, _, _| true, options).expect("replays");
    assert_eq!(replayed.difference, None);
    assert!(replayed.activations > 1_000 * seconds, "{replayed:?}");
    (watch, log.log().to_vec(), heard)
}

/// Arms, climbs to a height, lands.
macro_rules! hop {
    ($from:literal, $height:literal) => {
        [
            ($from, "http", r#"{"vehicle":0,"id":1,"do":"guided","kind":"arm"}"#),
            (
                $from + 0.5,
                "http",
                concat!(r#"{"vehicle":0,"id":2,"do":"guided","kind":"take_off","height":"#, $height, "}"),
            ),
            ($from + 9.0, "http", r#"{"vehicle":0,"id":3,"do":"guided","kind":"land"}"#),
        ]
    };
}

const FIRST: [(f32, &str, &str); 3] = hop!(8.0, "1.2");
const SECOND: [(f32, &str, &str); 3] = hop!(28.0, "1.2");

#[test]
fn a_change_on_the_ground_is_flown_at_once_and_one_in_flight_after_the_landing() {
    static SAYS: &[(f32, &str, &str)] = &[
        (6.0, "console", "param set navigator.height.max 0.7\r"),
        FIRST[0],
        FIRST[1],
        (14.0, "console", "param set navigator.height.max 2\r"),
        FIRST[2],
        SECOND[0],
        SECOND[1],
        SECOND[2],
    ];
    let (watch, log, heard) = live(SAYS, 48);
    let index = parameters::all().position(|info| info.name == "navigator.height.max").expect("a parameter");
    let told: Vec<_> = watch.changes.iter().map(|(_, change)| (change.index as usize, change.value)).collect();
    assert_eq!(told, [(index, 0.7), (index, 2.0)], "{heard}");
    let landings: Vec<Instant> = watch.armed.iter().filter(|(_, armed)| !armed).map(|(at, _)| *at).collect();
    assert_eq!((watch.highest.len(), landings.len()), (2, 3), "{heard} {:?}", watch.armed);
    // The new value counts at the first moment of rest, or when the vehicle has landed.
    let [first, second] = watch.replaced[..] else { panic!("{:?}", watch.replaced) };
    assert!(first.since(watch.changes[0].0) < Duration::from_millis(10));
    assert!(second >= landings[1] && second.since(landings[1]) < Duration::from_millis(10), "{second}");
    assert!(watch.highest[0] < 0.8, "{:?}", watch.highest);
    assert!(watch.highest[1] > 1.1, "{:?}", watch.highest);
    // The log says that the state was replaced, and goes on from a key frame: nothing else differs.
    let again = again(&log).expect("a log of ours");
    assert_eq!((again.difference, again.gaps), (None, 2));
    assert!(again.skipped < 10, "{}", again.skipped);
}

/// A ground station's frame that sets a parameter.
fn param_set(writer: &mut MavlinkWriter, name: &str, value: f32) -> Vec<u8> {
    let mut param_id = [0; 16];
    param_id.iter_mut().zip(short_name(name).bytes()).for_each(|(to, from)| *to = from);
    let set = PARAM_SET_DATA {
        param_value: value,
        target_system: 1,
        target_component: 1,
        param_id: param_id.into(),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    };
    let mut bytes = [0; LONGEST];
    writer.write(MavlinkVersion::V2, &MavMessage::PARAM_SET(set), &mut bytes).expect("room").to_vec()
}

/// Gains are changed in hover, at the command line and over MAVLink.
#[test]
fn a_gain_that_changes_in_flight_is_flown_at_once_and_nothing_else_is() {
    let (name, waits) = ("rate.roll.kp", "navigator.height.max");
    let kp = VehicleConfig::default().cascade.rate.roll.kp;
    let mut writer = MavlinkWriter::new(255, 190);
    let mut says: Vec<Says> = FIRST.iter().map(|(at, port, text)| (*at, *port, text.as_bytes().to_vec())).collect();
    let undisturbed = live_with(says.clone(), 26).0;
    says.extend([
        (13.0, "console", format!("param set {name} {}\r", 1.5 * kp).into_bytes()),
        (13.5, "console", b"param set landing.descent.speed 0.35\r".to_vec()),
        (14.0, "mavlink-tcp", param_set(&mut writer, name, 0.7 * kp)),
        (14.5, "mavlink-tcp", param_set(&mut writer, waits, 2.0)),
        // Ten times what the range allows.
        (15.0, "mavlink-tcp", param_set(&mut writer, name, 0.1)),
        (15.5, "http", br#"{"vehicle":0,"id":9,"do":"param_set","name":"rate.pitch.kp","value":0.001}"#.to_vec()),
        (15.6, "http", br#"{"vehicle":0,"id":10,"do":"param_set","name":"eskf.gate","value":4}"#.to_vec()),
    ]);
    let (watch, log, answers) = live_with(says, 26);
    let place = |name| parameters::all().position(|info| info.name == name).expect("a parameter");
    let told: Vec<_> = watch.changes.iter().map(|(_, change)| (change.index as usize, change.value)).collect();
    let descent = (place("landing.descent.speed"), 0.35);
    let pitch = (place("rate.pitch.kp"), 0.001);
    let expected = [(place(name), 1.5 * kp), descent, (place(name), 0.7 * kp), (place(waits), 2.0), pitch];
    assert_eq!(told, expected, "{}", answers.text);

    // Each gain is flown within two periods of the loop; the others after the landing.
    let [_, on, off] = watch.armed[..] else { panic!("{:?}", watch.armed) };
    assert!(on.1 && !off.1);
    let [first, second, third, landed] = watch.replaced[..] else { panic!("{:?}", watch.replaced) };
    for (replaced, change) in [(first, 0), (second, 2), (third, 4)] {
        let told = watch.changes[change].0;
        assert!(
            replaced >= told && replaced.since(told) <= Duration::from_millis(5) && replaced < off.0,
            "{replaced} {told}"
        );
    }
    assert!(landed >= off.0 && landed.since(off.0) < Duration::from_millis(10), "{landed}");
    // The very flight of before until then, and another one from then on.
    let same = watch.asked.iter().zip(&undisturbed.asked).take_while(|(now, before)| now == before).count();
    let parted = watch.asked[same].0;
    // Its instant is that of the inertial sample, which was there a moment before the change.
    let told = watch.changes[0].0;
    assert!(parted + Duration::from_micros(2_500) > told, "{parted} {told}");
    assert!(parted.since(told) < Duration::from_millis(20), "{parted} {told}");
    // It hovers on: as upright as before, without a blow when the gain changes.
    let worst = watch.tilted[0].to_degrees();
    assert!(worst < undisturbed.tilted[0].to_degrees() + 1.0, "{worst} {}", undisturbed.tilted[0].to_degrees());
    for at in [first, second, third] {
        let after = watch.asked.iter().position(|(asked, _)| *asked > at).expect("it flies on");
        let torques = &watch.asked[after - 20..after + 20];
        let largest = torques.iter().fold(0.0f32, |largest, (_, output)| largest.max(output.torque.x.abs()));
        let limit = VehicleConfig::default().cascade.rate.torque_max.x;
        assert!(largest < 0.2 * limit, "{largest} of {limit}");
    }

    let waiting = "not in flight: waits until the vehicle is disarmed";
    assert_eq!(answers.text.matches(waiting).count(), 1, "{}", answers.text);
    assert!(answers.text.contains(&format!("{name:<30}{}", 1.5 * kp)), "{}", answers.text);
    let mut decoder = MavlinkDecoder::<MavMessage>::new();
    let (mut values, mut texts) = (Vec::new(), String::new());
    for byte in &answers.frames {
        match decoder.feed(*byte).map(|frame| frame.message::<MavMessage>()) {
            Some(Ok(MavMessage::PARAM_VALUE(value))) => values.push(value.param_value),
            Some(Ok(MavMessage::STATUSTEXT(text))) => texts.push_str(text.text.to_str().expect("text")),
            _ => {}
        }
    }
    assert_eq!(values, [0.7 * kp, 2.0, 0.7 * kp]);
    assert!(texts.contains(&format!("{waits}: {waiting}")), "{texts}");
    assert!(texts.contains(&format!("{name}: the value must be from")), "{texts}");

    // The log says that the state was replaced, and goes on from a key frame: nothing else differs.
    let again = again(&log).expect("a log of ours");
    assert_eq!((again.difference, again.gaps), (None, 4));
    assert!(again.skipped < 20, "{}", again.skipped);
}

/// Only what may be: none of a limit, of a state, of what protects the vehicle. And it is the runnable that adjusts that holds them.
#[test]
fn what_changes_in_flight_is_a_gain_of_control() {
    for info in parameters::all().filter(|info| info.in_flight) {
        assert_eq!(parameters::holders(info.name), [stampfly_board::schedule::Id::control], "{}", info.name);
        let [group, .., what] = info.name.split('.').collect::<Vec<_>>()[..] else { panic!("{}", info.name) };
        assert!(["rate", "indi", "attitude", "position", "altitude"].contains(&group), "{}", info.name);
        assert!(["kp", "ti", "td", "bandwidth", "smoothing"].contains(&what), "{}", info.name);
    }
}

/// From rest, runnables that took a parameter are those that were made with it: every one that may change in flight arrives, and none other does.
#[test]
fn every_parameter_that_may_change_in_flight_is_taken_and_no_other() {
    use stampfly_flight::live::Adjust;
    let state = |runnables: &Runnables| format!("{:?}", ciborium::Value::serialized(runnables).expect("serialisable"));
    for controller in [stampfly_board::ControllerKind::Cascade, stampfly_board::ControllerKind::Indi] {
        for (index, info) in parameters::all().enumerate() {
            let mut config = VehicleConfig { controller, ..VehicleConfig::default() };
            let mut runnables = Runnables::new(&config);
            let before = state(&runnables);
            let changed = if config.get(index) == Some(info.min) { info.max } else { info.min };
            config.set(index, changed).expect("its range");
            runnables.adjust(&config);
            let made = if info.in_flight { state(&Runnables::new(&config)) } else { before };
            assert_eq!(state(&runnables), made, "{}", info.name);
        }
    }
}

#[test]
fn a_combination_that_cannot_fly_is_refused_at_every_port() {
    static SAYS: &[(f32, &str, &str)] = &[
        (1.0, "console", "param set position.tilt.max 0.7\r"),
        (2.0, "http", r#"{"vehicle":0,"id":7,"do":"param_set","name":"position.tilt.max","value":0.7}"#),
    ];
    let (watch, _, heard) = live(SAYS, 3);
    let reason =
        "position.tilt.max with failsafe.tip.tilt: a tilt that the position loop asks for counts as tipping over";
    assert_eq!((heard.matches(reason).count(), watch.changes.len()), (2, 0), "{heard}");
}

/// What makes it enough to begin again with the runnables that the table names: they are those in which something changes.
#[test]
fn the_holders_of_a_parameter_are_the_runnables_that_it_changes() {
    let fields = |config: &VehicleConfig| {
        let value = ciborium::Value::serialized(&Runnables::new(config)).expect("serialisable");
        value.into_map().expect("a struct")
    };
    let default = fields(&VehicleConfig::default());
    for (index, info) in parameters::all().enumerate() {
        // The sensors' tasks apply what calibrations have found, from the next start on. The runnable that calibrates knows what they
        // apply, and must not begin again before they do.
        if info.name.starts_with("calibration.") {
            assert_eq!(parameters::holders(info.name), []);
            continue;
        }
        let mut config = VehicleConfig::default();
        // Components that are not chosen are not there.
        if info.name.starts_with("indi.") {
            config.controller = stampfly_board::ControllerKind::Indi;
        }
        let default = if info.name.starts_with("indi.") { fields(&config) } else { default.clone() };
        let changed = if config.get(index) == Some(info.min) { info.max } else { info.min };
        config.set(index, changed).expect("its range");
        let differing =
            default.iter().zip(fields(&config)).filter(|(old, new)| format!("{:?}", old.1) != format!("{:?}", new.1));
        let differing: Vec<String> = differing.map(|(old, _)| old.0.as_text().expect("a name").to_owned()).collect();
        let holders: Vec<_> = parameters::holders(info.name).iter().map(|id| ACTIVATIONS[*id as usize].name).collect();
        assert_eq!(differing, holders, "{}", info.name);
    }
}
