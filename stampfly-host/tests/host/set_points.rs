//! Set-points of a station, flown by the simulated vehicle: what its truth does, not its estimate.

use core::net::{Ipv4Addr, SocketAddr};
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_flight::Observer;
use stampfly_host::flown::fly;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_sim::Truth;
use stampfly_sim::vehicle::{Client, Heard, Live, Ports, Vehicle, Witness};
use stampfly_types::{Duration, Instant, Message, Vec3, frame};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// Between two looks at the ports, ms.
const TICK: u64 = 5;
/// It has taken off and hovers, ms.
const HOVERS: u64 = 14_000;
/// A set-point is said so often, ms.
const EVERY: u64 = 50;

/// A station that says set-points from [`HOVERS`] on: each for so long, ms.
#[derive(Debug)]
struct Station {
    says: Vec<(u64, SET_POSITION_TARGET_LOCAL_NED_DATA)>,
    now: AtomicU64,
    texts: Mutex<String>,
}

impl Station {
    fn command(command: MavCmd, param1: f32, param7: f32) -> MavMessage {
        let (target_system, target_component) = (1, 1);
        MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            param1,
            param7,
            command,
            target_system,
            target_component,
            ..Default::default()
        })
    }

    fn set_point(&self, now: u64) -> Option<MavMessage> {
        let mut since = HOVERS;
        for (lasts, set_point) in &self.says {
            if (since..since + lasts).contains(&now) && now.is_multiple_of(EVERY) {
                return Some(MavMessage::SET_POSITION_TARGET_LOCAL_NED(set_point.clone()));
            }
            since += lasts;
        }
        None
    }
}

impl Ports for Station {
    fn receive(&self, _: Option<std::time::Instant>, hear: &mut dyn FnMut(Client, Heard<'_>)) {
        let now = self.now.fetch_add(TICK, Ordering::Relaxed);
        let port = StampFly::PORTS.iter().position(|port| port.name == "mavlink-tcp").expect("a port");
        let client = Client { port, address: SocketAddr::from((Ipv4Addr::LOCALHOST, 9)) };
        if now == 0 {
            return hear(client, Heard::Opened);
        }
        let mut say = |message: &MavMessage| {
            let mut bytes = [0; LONGEST];
            let frame = MavlinkWriter::new(255, 190).write(MavlinkVersion::V2, message, &mut bytes).expect("room");
            hear(client, Heard::Bytes(frame));
        };
        match now {
            _ if now.is_multiple_of(500) => say(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default())),
            8_005 => say(&Self::command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 0.0)),
            8_505 => say(&Self::command(MavCmd::MAV_CMD_NAV_TAKEOFF, 0.0, 1.0)),
            _ => {}
        }
        if let Some(set_point) = self.set_point(now) {
            say(&set_point);
        }
    }

    fn send(&self, _: &Client, bytes: &[u8]) {
        let mut decoder = MavlinkDecoder::<MavMessage>::new();
        for byte in bytes {
            if let Some(Ok(MavMessage::STATUSTEXT(text))) = decoder.feed(*byte).map(|frame| frame.message()) {
                self.texts.lock().expect("not poisoned").push_str(text.text.to_str().expect("UTF-8"));
            }
        }
    }

    fn are_closed(&self) -> bool {
        false
    }
}

#[derive(Default)]
struct Watch(Vec<(Instant, Truth)>);

impl Observer for Watch {}

impl Witness<Runnables> for Watch {
    fn beside(&mut self, _: usize, at: Instant, _: u32, words: &[u32]) {
        self.0.push((at, Truth::from_words(words.try_into().expect("its words")).expect("the truth")));
    }
}

/// What the vehicle does, and what it says.
struct Flown {
    watch: Watch,
    begun: Instant,
    texts: String,
}

impl Flown {
    fn of(seed: u64, seconds: u64, says: Vec<(u64, SET_POSITION_TARGET_LOCAL_NED_DATA)>) -> Self {
        let station = Arc::new(Station { says, now: AtomicU64::new(0), texts: Mutex::default() });
        let live = Live { ports: station.clone(), number: 0, limit: Duration::from_secs(seconds), speed: None };
        let mut watch = Watch::default();
        fly::<StampFly>(&Setup::reference(seed).flown_by(live), &mut watch, &mut |_, _| {});
        let begun = watch.0.first().expect("it was on").0;
        let texts = std::mem::take(&mut *station.texts.lock().expect("not poisoned"));
        Self { watch, begun, texts }
    }

    /// The mean velocity around this time after the first set-point, over 0.1 s.
    fn velocity(&self, ms: u64) -> Vec3 {
        let around = (HOVERS + ms - 50)..(HOVERS + ms + 50);
        let truths = self.watch.0.iter().filter(|(at, _)| around.contains(&at.since(self.begun).as_millis()));
        let (sum, count) =
            truths.fold((Vec3::zeros(), 0), |(sum, count), (_, truth)| (sum + truth.velocity, count + 1));
        assert!(count > 5, "{count}");
        sum / count as f32
    }

    /// The largest tilt from the first set-point on, degrees.
    fn tilt(&self) -> f32 {
        let tilts = self.watch.0.iter().filter(|(at, _)| at.since(self.begun).as_millis() > HOVERS);
        tilts.map(|(_, truth)| frame::tilt(&truth.attitude).to_degrees()).fold(0.0, f32::max)
    }
}

/// An acceleration alone, with what it has of heading and height.
fn acceleration([afx, afy, afz]: [f32; 3]) -> SET_POSITION_TARGET_LOCAL_NED_DATA {
    SET_POSITION_TARGET_LOCAL_NED_DATA {
        afx,
        afy,
        afz,
        type_mask: PositionTargetTypemask::from_bits_truncate(0b1100_0011_1111),
        coordinate_frame: MavFrame::MAV_FRAME_LOCAL_NED,
        target_system: 1,
        target_component: 1,
        ..Default::default()
    }
}

#[test]
fn an_acceleration_of_half_a_metre_per_second_squared_for_a_second_changes_the_velocity_by_half_a_metre_per_second() {
    for (seed, wanted) in [(1, [0.5, 0.0, 0.0]), (2, [0.0, -0.5, 0.0]), (3, [0.3, 0.3, -0.2])] {
        let says = vec![(1_000, acceleration(wanted)), (1_000, acceleration([0.0; 3]))];
        let flown = Flown::of(seed, 20, says);
        let wanted = Vec3::from(wanted);
        println!(
            "seed {seed}, {wanted:?}: {:?} before, {:?} after 1 s, {:?} after 1.8 s, {:?} after 4 s, tilt {:.1} deg",
            flown.velocity(0).to_array(),
            flown.velocity(1_000).to_array(),
            flown.velocity(1_800).to_array(),
            flown.velocity(4_000).to_array(),
            flown.tilt()
        );
        // It hovers within 0.15 m/s.
        assert!(flown.velocity(0).norm() < 0.15);
        assert!((flown.velocity(1_000) - wanted).norm() < 0.2);
        assert!((flown.velocity(1_800) - wanted).norm() < 0.15);
        // Half a second after the last one it holds.
        assert!(flown.velocity(4_000).norm() < 0.15);
        assert!(flown.tilt() < 20.0);
        assert!(!flown.texts.contains("not flown"), "{}", flown.texts);
    }
}

#[test]
fn a_stream_of_accelerations_that_stops_leads_to_hover_and_what_no_vehicle_can_is_refused() {
    // It stops while it accelerates, as hard as the path may.
    let flown = Flown::of(1, 19, vec![(1_500, acceleration([15.0, 0.0, 0.0]))]);
    let [at_the_end, after] = [1_500, 4_500].map(|ms| flown.velocity(ms));
    println!("{:?} at the end, {:?} three seconds later, tilt {:.1} deg", at_the_end.x, after.norm(), flown.tilt());
    assert!((0.8..1.15).contains(&at_the_end.x) && after.norm() < 0.15);
    assert!(flown.tilt() < 20.0);
    for wanted in [[f32::NAN; 3], [0.0, f32::INFINITY, 0.0], [0.0, 0.0, -1e9]] {
        let flown = Flown::of(1, 16, vec![(1_000, acceleration(wanted))]);
        let fastest = [300, 600, 900, 1_200, 1_500].map(|ms| flown.velocity(ms).norm()).into_iter().fold(0.0, f32::max);
        assert!(fastest < 0.15, "{wanted:?}: {fastest}");
        assert!(flown.texts.contains("set-point not flown: a number is out of range"), "{}", flown.texts);
    }
}
