//! Two stations that call themselves the same: what one says is no sign of life of the other.

use core::net::{Ipv4Addr, SocketAddr};
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_flight::Observer;
use stampfly_host::flown::fly;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_sim::Truth;
use stampfly_sim::vehicle::{Client, Heard, Live, Ports, Vehicle, Witness};
use stampfly_types::{Duration, Instant, Message};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// Between two looks at the ports, ms.
const TICK: u64 = 5;
/// The commander's connection ends, ms.
const GONE: u64 = 14_000;

/// A commander, and another at this port with the same system and component, which only sends
/// heartbeats.
#[derive(Debug)]
struct Stations {
    other: &'static str,
    now: AtomicU64,
    /// What the other is told, and when, ms.
    texts: Mutex<Vec<(u64, String)>>,
}

impl Stations {
    fn client(port: &str, number: u16) -> Client {
        let port = StampFly::PORTS.iter().position(|other| other.name == port).expect("a port");
        Client { port, address: SocketAddr::from((Ipv4Addr::LOCALHOST, number)) }
    }

    fn commander() -> Client {
        Self::client("mavlink-tcp", 9)
    }
}

impl Ports for Stations {
    fn receive(&self, _: Option<std::time::Instant>, hear: &mut dyn FnMut(Client, Heard<'_>)) {
        let now = self.now.fetch_add(TICK, Ordering::Relaxed);
        let (commander, other) = (Self::commander(), Self::client(self.other, 10));
        if now == 0 {
            hear(commander, Heard::Opened);
            return hear(other, Heard::Opened);
        }
        if now == GONE {
            return hear(commander, Heard::Closed);
        }
        let mut say = |client, message: &MavMessage| {
            let mut bytes = [0; LONGEST];
            let frame = MavlinkWriter::new(255, 190).write(MavlinkVersion::V2, message, &mut bytes).expect("room");
            hear(client, Heard::Bytes(frame));
        };
        let command = |command, param1, param7| {
            let (target_system, target_component) = (1, 1);
            MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
                param1,
                param7,
                command,
                target_system,
                target_component,
                ..Default::default()
            })
        };
        let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
        match now {
            _ if now.is_multiple_of(500) => {
                say(other, &heartbeat);
                if now < GONE {
                    say(commander, &heartbeat);
                }
            }
            8_005 => say(commander, &command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 0.0)),
            8_505 => say(commander, &command(MavCmd::MAV_CMD_NAV_TAKEOFF, 0.0, 1.0)),
            _ => {}
        }
    }

    fn send(&self, to: &Client, bytes: &[u8]) {
        if *to == Self::commander() {
            return;
        }
        let mut decoder = MavlinkDecoder::<MavMessage>::new();
        for byte in bytes {
            if let Some(Ok(MavMessage::STATUSTEXT(text))) = decoder.feed(*byte).map(|frame| frame.message()) {
                let text = text.text.to_str().expect("UTF-8").to_owned();
                self.texts.lock().expect("not poisoned").push((self.now.load(Ordering::Relaxed), text));
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

#[test]
fn heartbeats_of_another_with_the_same_number_do_not_hide_that_the_commander_is_gone() {
    for other in ["mavlink-tcp", "mavlink-udp"] {
        let stations = Arc::new(Stations { other, now: AtomicU64::new(0), texts: Mutex::default() });
        let live = Live { ports: stations.clone(), number: 0, limit: Duration::from_secs(30), speed: None };
        let mut watch = Watch::default();
        fly::<StampFly>(&Setup::reference(1).flown_by(live), &mut watch, &mut |_, _| {});
        let begun = watch.0.first().expect("it was on").0;
        let height = |ms: u64| {
            let at = watch.0.iter().find(|(at, _)| at.since(begun).as_millis() >= ms);
            -at.unwrap_or(watch.0.last().expect("it was on")).1.position.z
        };
        assert!(height(GONE) > 0.8, "{other}: {}", height(GONE));
        assert!(height(29_500) < 0.1, "{other}: it has not landed, but is {} m high", height(29_500));
        let texts = stations.texts.lock().expect("not poisoned").clone();
        let lost = texts.iter().find(|(at, text)| *at > GONE && text.contains("COMM_LOST")).map(|(at, _)| *at);
        println!("{other}: COMM_LOST {:?} ms after the end of the connection", lost.map(|at| at as i64 - GONE as i64));
        assert!(lost.is_some_and(|at| at < GONE + 4_000), "{other}: {texts:?}");
    }
}
