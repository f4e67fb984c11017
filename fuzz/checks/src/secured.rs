//! Frames of the secure session, from strangers and from a station with the key that says whatever it likes.

use crate::Input;
use stampfly_link::secure::{Guarded, Heard, Key, Kind, MAX_FRAME, Payload, Policy, Refused, Station, Vehicle};
use stampfly_link::{Address, Session};
use stampfly_types::{Duration, Instant};

/// The two ends, what is on the air between them, and what has to hold.
struct Scene {
    key: Key,
    vehicle: Guarded,
    station: Station,
    now: Instant,
    /// The frames that were on the air last.
    air: Vec<Vec<u8>>,
    /// Random numbers: no two are the same.
    random: u64,
    armed: bool,
    /// The number of the newest command that was taken.
    taken: Option<u32>,
}

/// What happens: events, each with a time step. The first byte says what the vehicle accepts.
pub fn secure_session(data: &[u8]) {
    let mut input = Input(data);
    let Ok(key) = Key::generate(1, core::array::from_fn(|place| place as u8)) else { return };
    let policy = Policy { accept_unauthenticated: input.byte() & 1 == 1 };
    let session = Session::new(Address([2; 6]), 1, None);
    let vehicle = Guarded::new(Vehicle::new(key.clone()), session, policy);
    let station = Station::new(key.clone());
    let now = Instant::ZERO;
    let mut scene = Scene { key, vehicle, station, now, air: Vec::new(), random: 0, armed: false, taken: None };
    while !input.is_empty() {
        let (event, step) = (input.byte(), input.byte());
        scene.now += Duration::from_micros(u64::from(step) * 2_500);
        scene.happens(event, &mut input);
    }
}

impl Scene {
    fn happens(&mut self, event: u8, input: &mut Input<'_>) {
        let mut room = [0; MAX_FRAME];
        self.random += 1;
        // No byte of it is that of the last, as good as never is so.
        let random = self.random.wrapping_mul(0x9E37_79B9_7F4A_7C15).to_le_bytes();
        match event % 10 {
            0 => {
                let sent = self.vehicle.transmit(self.now, random, &mut room).map(<[u8]>::to_vec);
                self.send(sent, event, false);
            }
            1 => {
                let sent = self.station.transmit(self.now, random, &mut room).map(<[u8]>::to_vec);
                self.send(sent, event, true);
            }
            // Sealed by a genuine station, whose payload is any that its bytes are.
            2 | 3 => {
                let (kind, length) =
                    (Kind::ALL[usize::from(input.byte()) % Kind::ALL.len()], usize::from(input.byte()));
                let Some(payload) = Payload::decode(kind, input.bytes(length)) else { return };
                let from_vehicle = kind.is_from_vehicle();
                let sealed = match from_vehicle {
                    true => self.vehicle.vehicle_mut().expect("it has a key").seal(self.now, &payload, &mut room),
                    false => self.station.seal(self.now, &payload, &mut room),
                };
                let sealed = sealed.ok().map(<[u8]>::to_vec);
                self.send(sealed, event, !from_vehicle);
            }
            // A frame of before, with a change.
            4 => {
                let place = usize::from(input.byte());
                let Some(mut frame) = self.air.iter().rev().nth(place % 16).cloned() else { return };
                let (place, change) = (usize::from(input.byte()), input.byte());
                let length = frame.len();
                if let Some(byte) = frame.get_mut(place % length) {
                    *byte ^= change;
                }
                self.deliver(&frame, event & 0x80 != 0, change != 0);
            }
            5 => {
                let length = usize::from(input.byte());
                self.deliver(input.bytes(length), event & 0x80 != 0, false);
            }
            6 => {
                self.armed = event & 0x80 != 0;
                self.vehicle.set_armed(self.armed);
            }
            7 => {
                let to = u32::from_le_bytes([input.byte(), input.byte(), input.byte(), input.byte()]);
                if event & 0x80 != 0 {
                    self.vehicle.vehicle_mut().expect("it has a key").skip_counters(to)
                } else {
                    self.station.skip_counters(to)
                }
            }
            8 => self.station = Station::new(self.key.clone()),
            _ => {
                let text = String::from_utf8_lossy(input.bytes(usize::from(event))).into_owned();
                if let Ok(key) = Key::from_uri(&text) {
                    assert_eq!(key.uri().to_string(), text.trim());
                }
            }
        }
    }

    /// Puts a frame on the air, and delivers it at once if the event says so.
    fn send(&mut self, frame: Option<Vec<u8>>, event: u8, to_vehicle: bool) {
        let Some(frame) = frame else { return };
        assert!(!self.air.contains(&frame) || frame[1] == Kind::Announcement as u8 || frame[1] == Kind::Join as u8);
        if event & 0x80 == 0 {
            self.deliver(&frame, to_vehicle, false);
        }
        self.air.push(frame);
        if self.air.len() > 64 {
            self.air.remove(0);
        }
    }

    /// Hands bytes to an end. A frame that was changed is refused.
    fn deliver(&mut self, frame: &[u8], to_vehicle: bool, changed: bool) {
        let mut again = frame.to_vec();
        let mut frame = frame.to_vec();
        if !to_vehicle {
            let before = *self.station.tally();
            let outcome = self.station.receive(self.now, &mut frame);
            let _ = outcome.map(|received| check(&received.map(|received| received.payload), changed));
            let after = self.station.tally();
            let counted = (after.accepted + after.handshakes + after.refused())
                - (before.accepted + before.handshakes + before.refused());
            assert_eq!(counted, 1);
            return;
        }
        let (before, age) = (*self.vehicle.vehicle_mut().expect("it has a key").tally(), self.vehicle.age(self.now));
        match self.vehicle.receive(self.now, Address([2; 6]), &mut frame) {
            Ok(Heard::Authentic(received)) => {
                check(&Some(received.payload), changed);
                let changes = match received.payload {
                    Payload::WriteParameter { .. } | Payload::Line(_) | Payload::Question { .. } => true,
                    Payload::Numbered { number, .. } => {
                        assert_ne!(self.taken, Some(number), "a command is taken once");
                        // A vehicle has no room for some.
                        if number.is_multiple_of(2) {
                            self.taken = Some(number);
                        }
                        self.vehicle.acknowledge(&received, number.is_multiple_of(2));
                        false
                    }
                    _ => false,
                };
                assert!(!self.armed || !changes, "an armed vehicle takes no such thing");
                assert!(received.age <= stampfly_link::secure::MAX_AGE || received.payload.is_kill());
                assert_eq!(self.vehicle.age(self.now), Some(Duration::ZERO));
                let old = self.vehicle.vehicle_mut().expect("it has a key").receive(self.now, &mut again);
                assert_eq!(old, Err(Refused::Old), "once and never again");
            }
            Ok(Heard::Handshake) => {
                // A command that is said again is a sign of life.
                let again = self.taken.is_some() && self.vehicle.age(self.now) == Some(Duration::ZERO);
                assert!(!changed && (again || self.vehicle.age(self.now) == age));
            }
            Ok(Heard::Unauthenticated(_)) => assert!(frame.len() < stampfly_link::secure::MIN_FRAME),
            Err(_) => {
                assert_eq!(self.vehicle.age(self.now), age, "no sign of life");
                let after = self.vehicle.vehicle_mut().expect("it has a key").tally();
                assert_eq!((after.accepted, after.handshakes), (before.accepted, before.handshakes));
            }
        }
    }
}

/// What was taken was not changed on its way, and can be said again.
fn check(payload: &Option<Payload<'_>>, changed: bool) {
    assert!(!changed, "taken although it was changed");
    if let Some(payload) = payload {
        assert!(payload.encode(&mut [0; MAX_FRAME]).is_ok());
    }
}
