//! The secure session between a simulated transmitter and the simulated vehicle, as real bytes, and somebody who floods it.
//!
//! For flights that show what the session does while a vehicle flies. Not for other flights: without it the radio hands messages
//! over, which is faster and keeps their recorded hashes.

use crate::link::packet;
use crate::messages::TelemetryFrame;
use core::cell::Cell;
use stampfly_link::secure::{Guarded, Heard, Key, KeyError, MAX_FRAME, Payload, Policy, Station, Tally, Vehicle};
use stampfly_link::{Address, ControlPacket, Session};
use stampfly_sim::time::Clock;
use stampfly_types::messages::PilotInput;
use stampfly_types::{Duration, Instant};
use std::cell::RefCell;
use std::rc::Rc;
use std::vec::Vec;

const VEHICLE: Address = Address([0x34, 0x85, 0x18, 1, 2, 3]);
const TRANSMITTER: Address = Address([2, 0, 0, 0, 0, 1]);
/// The period of the flight band, in which the session's budget for bad frames counts.
const TICK: u64 = 2_500;

/// What is on the air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Air {
    /// Frames of a stranger a second: random bytes, replays, wrong tags, and packets of the right form that authenticate nobody.
    pub flood: u32,
}

/// What came of it.
#[derive(Clone, Copy, Debug, Default)]
pub struct AirReport {
    /// The pilot's frames that were sealed and that no fault of the radio has swallowed.
    pub sent: u32,
    /// Those that were taken.
    pub taken: u32,
    /// A stranger's frames.
    pub strange: u32,
    /// Those of them that were taken for the pilot's.
    pub forged: u32,
    /// Telemetry that the station has opened.
    pub telemetry: u32,
    /// Packets that authenticate nobody and were refused.
    pub forbidden: u32,
    /// Most wrong tags that were computed in 2.5 ms.
    pub worst_tags: u32,
    /// What the session has counted.
    pub tally: Tally,
}

/// Both ends, and what is between them.
pub(super) struct Ends {
    link: Guarded,
    station: Station,
    noise: u64,
    /// The newest of the pilot's frames, which a stranger has recorded.
    recorded: Vec<u8>,
    number: u32,
    /// The tick at hand, and wrong tags before it.
    tick: (u64, u32),
    report: AirReport,
}

/// One flight's air, for the radio and for the stranger.
pub(super) type Shared = Rc<RefCell<Ends>>;

impl Ends {
    pub(super) fn new(seed: u64) -> Result<Self, KeyError> {
        let mut noise = seed ^ 0x5EED_0A17;
        let key = Key::generate(1, core::array::from_fn(|_| random(&mut noise) as u8))?;
        let session = Session::new(VEHICLE, 1, Some(TRANSMITTER));
        Ok(Self {
            link: Guarded::new(Vehicle::new(key.clone()), session, Policy::default()),
            station: Station::new(key),
            noise,
            recorded: Vec::new(),
            number: 0,
            tick: (0, 0),
            report: AirReport::default(),
        })
    }

    /// A frame of the transmitter, and whatever of the handshake is due. `is_open` says whether frames arrive at all.
    pub(super) fn sticks(
        &mut self,
        now: Instant,
        input: &PilotInput,
        armed: bool,
        is_open: bool,
    ) -> Option<PilotInput> {
        let mut room = [0; MAX_FRAME];
        self.link.set_armed(armed);
        let fresh = random(&mut self.noise).to_le_bytes();
        if let Some(frame) = self.link.transmit(now, fresh, &mut room).map(<[u8]>::to_vec).filter(|_| is_open) {
            let _ = self.station.receive(now, &mut frame.clone());
        }
        let fresh = random(&mut self.noise).to_le_bytes();
        if let Some(frame) = self.station.transmit(now, fresh, &mut room).map(<[u8]>::to_vec).filter(|_| is_open) {
            let _ = self.hear(now, &mut frame.clone());
        }
        let mut frame = self.station.seal(now, &Payload::Sticks(*input), &mut room).ok()?.to_vec();
        if !is_open {
            return None;
        }
        self.recorded.clone_from(&frame);
        self.report.sent += 1;
        let taken = self.hear(now, &mut frame)?;
        self.report.taken += 1;
        Some(taken)
    }

    /// Does the vehicle's telemetry arrive?
    pub(super) fn telemetry(&mut self, now: Instant, frame: &TelemetryFrame) -> bool {
        let mut room = [0; MAX_FRAME];
        let sealed = self.link.vehicle().seal(now, &Payload::Telemetry(packet(0, frame)), &mut room);
        let Ok(mut bytes) = sealed.map(<[u8]>::to_vec) else { return false };
        let opened = matches!(self.station.receive(now, &mut bytes), Ok(Some(_)));
        self.report.telemetry += u32::from(opened);
        opened
    }

    /// A frame of a stranger who has heard everything.
    fn garbage(&mut self, now: Instant) {
        self.number = self.number.wrapping_add(1);
        let mut bytes = match self.number % 4 {
            0 => {
                let length = random(&mut self.noise) as usize % (MAX_FRAME + 1);
                (0..length).map(|_| random(&mut self.noise) as u8).collect()
            }
            1 => self.recorded.clone(),
            2 => {
                // The session's own header with a counter that is new: only the tag tells.
                let mut bytes = self.recorded.clone();
                if let Some(counter) = bytes.get_mut(7..11) {
                    counter.copy_from_slice(&(1_000_000 + self.number).to_le_bytes());
                }
                bytes
            }
            _ => {
                let arm = PilotInput { arm: true, throttle: 1.0, ..PilotInput::default() };
                ControlPacket::from_pilot(VEHICLE, &arm).to_bytes().to_vec()
            }
        };
        self.report.strange += 1;
        if self.hear(now, &mut bytes).is_some() {
            self.report.forged += 1;
        }
    }

    /// What the vehicle takes of a frame.
    fn hear(&mut self, now: Instant, bytes: &mut [u8]) -> Option<PilotInput> {
        let tick = now.as_micros() / TICK;
        if self.tick.0 != tick {
            self.tick = (tick, self.link.vehicle().tally().tag);
        }
        let heard = match self.link.receive(now, TRANSMITTER, bytes) {
            Ok(Heard::Authentic(received)) => match received.payload {
                Payload::Sticks(input) => Some(input),
                _ => None,
            },
            Ok(Heard::Unauthenticated(input)) => Some(input),
            Ok(Heard::Handshake) | Err(_) => None,
        };
        let tags = self.link.vehicle().tally().tag - self.tick.1;
        self.report.worst_tags = self.report.worst_tags.max(tags);
        heard
    }

    fn report(&mut self) -> AirReport {
        AirReport { forbidden: self.link.forbidden(), tally: *self.link.vehicle().tally(), ..self.report }
    }
}

/// Sends so many frames a second, evenly, and keeps the report up to date.
pub(super) async fn flood(clock: Clock, air: Shared, rate: u32, report: &Cell<AirReport>) {
    let period = Duration::from_micros(1_000_000 / u64::from(rate.max(1)));
    loop {
        {
            let mut ends = air.borrow_mut();
            if rate > 0 {
                ends.garbage(clock.now());
            }
            report.set(ends.report());
        }
        let pause = if rate > 0 { period } else { Duration::from_millis(20) };
        clock.sleep_until(clock.now() + pause).await;
    }
}

/// The next number of a sequence that is the same in every flight with the same seed (splitmix64).
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
