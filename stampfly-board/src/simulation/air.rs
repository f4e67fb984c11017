//! The secure session between a simulated station and the simulated vehicle, as real bytes, and somebody who floods it.
//!
//! The vehicle's end is the firmware's, [`Link`]; pilots and programs are stations with its key. For flights that show what the
//! session does while a vehicle flies. Not for other flights: without it the radio hands messages over, which is faster and keeps
//! their recorded hashes.

use crate::VehicleConfig;
use crate::link::{Link, Outgoing, PERIOD};
use crate::messages::TelemetryFrame;
use crate::topics::{Id, LinkEnds};
use core::cell::Cell;
use stampfly_flight::compact::{Chunks, MAGIC};
use stampfly_link::secure::{
    Guarded, Key, KeyError, MAX_BODY, MAX_FRAME, NotTaken, Payload, Policy, Refused, Station, Tally, Vehicle,
};
use stampfly_link::{Address, ControlPacket, Session};
use stampfly_services::subscription::{RADIO_CHUNK, RADIO_CHUNKS};
use stampfly_services::{CommandArbiter, RecordSubscription, StationRequests};
use stampfly_sim::Noise;
use stampfly_sim::time::Clock;
use stampfly_types::messages::PilotInput;
use stampfly_types::{Duration, Instant, Message};
use std::cell::RefCell;
use std::rc::Rc;
use std::vec::Vec;

pub(super) const VEHICLE: Address = Address([0x34, 0x85, 0x18, 1, 2, 3]);
const TRANSMITTER: Address = Address([2, 0, 0, 0, 0, 1]);
/// Stream of the random numbers on the air; no model has this number.
const STREAM: u64 = 105;
/// The period of the flight band, in which the session's budget for bad frames counts.
const TICK: u64 = 2_500;
/// What it takes to look at a frame's tag, and what at anything that is refused before. *Unverified*: 450 bytes of two ciphers at 60 cycles
/// of 240 MHz each, and a few comparisons; neither has been measured on the chip.
const OPENING: Duration = Duration::from_micros(112);
const LOOK: Duration = Duration::from_micros(5);
/// Between two questions for the flight record.
const ASKS: Duration = Duration::from_secs(1);

/// What is on the air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Air {
    /// Frames of a stranger a second: random bytes, replays, wrong tags, and packets of the right form that authenticate nobody.
    pub flood: u32,
    /// The station wants the flight record.
    pub record: bool,
    /// So many frames of a thousand are lost, of both ends.
    pub loss: u16,
}

/// What came of it.
#[derive(Clone, Copy, Debug, Default)]
pub struct AirReport {
    /// The station's frames that were sealed and that no fault of the radio has swallowed.
    pub sent: u32,
    /// Those that were taken.
    pub taken: u32,
    /// A stranger's frames.
    pub strange: u32,
    /// Those of them that were taken for the station's.
    pub forged: u32,
    /// Telemetry that the station has opened.
    pub telemetry: u32,
    /// Commands that the vehicle has acknowledged.
    pub acknowledged: u32,
    /// Packets that authenticate nobody and were refused.
    pub forbidden: u32,
    /// Most wrong tags that were computed in 2.5 ms.
    pub worst_tags: u32,
    /// Longest time for which frames kept the processor at a stretch.
    pub busiest: Duration,
    /// Chunks of the flight record that were sealed, and those that the station has opened.
    pub chunks: [u32; 2],
    /// What the session has counted.
    pub tally: Tally,
}

/// Both ends, and what is between them.
pub(super) struct Ends<'b> {
    link: Link<'b>,
    /// One station and a stranger: no program is at any port.
    arbiter: CommandArbiter,
    station: Station,
    noise: Noise,
    /// The newest of the station's frames, which a stranger has recorded.
    recorded: Vec<u8>,
    number: u32,
    /// The tick at hand, and wrong tags before it.
    tick: (u64, u32),
    /// For how long frames keep the processor, and since when without a pause.
    busy: (Instant, Instant),
    frame: TelemetryFrame,
    report: AirReport,
    /// Share of the frames that are lost.
    loss: f64,
    /// What the station asks for, as the firmware keeps it.
    requests: StationRequests,
    /// Who has the flight record: the station, if it has asked.
    subscription: RecordSubscription<()>,
    /// When chunks are sent again, and when the station asks again.
    recording: [Instant; 2],
    record: Vec<u8>,
}

/// One flight's air, for the radio and for the stranger.
pub(super) type Shared<'b> = Rc<RefCell<Ends<'b>>>;

impl<'b> Ends<'b> {
    pub(super) fn new(seed: u64, what: Air, config: &VehicleConfig, ends: LinkEnds<'b>) -> Result<Self, KeyError> {
        let mut noise = Noise::new(seed, STREAM);
        let key = Key::generate(1, random(&mut noise))?;
        let session = Session::new(VEHICLE, 1, Some(TRANSMITTER));
        let policy = Policy { accept_unauthenticated: config.accept_unauthenticated };
        Ok(Self {
            link: Link::new(Guarded::new(Vehicle::new(key.clone()), session, policy), ends),
            arbiter: CommandArbiter::new(),
            station: Station::new(key),
            noise,
            recorded: Vec::new(),
            number: 0,
            tick: (0, 0),
            busy: (Instant::ZERO, Instant::ZERO),
            frame: TelemetryFrame::default(),
            report: AirReport::default(),
            loss: f64::from(what.loss) / 1_000.0,
            requests: StationRequests::new(),
            subscription: RecordSubscription::new(),
            recording: [Instant::ZERO; 2],
            record: MAGIC.to_vec(),
        })
    }

    /// Does a frame arrive? Of air that loses nothing no random number is taken.
    fn arrives(&mut self) -> bool {
        self.loss == 0.0 || self.noise.unit() >= self.loss
    }

    /// The flight record, as the firmware's radio sends it: the station asks again and again, and each chunk is a sealed frame. Call it after every turn.
    pub(super) fn pass_on(&mut self, now: Instant, chunks: &mut dyn Chunks) {
        let [send, ask] = self.recording;
        if now < send {
            return;
        }
        self.recording = [now + PERIOD, if now < ask { ask } else { now + ASKS }];
        if now >= ask {
            self.say(now, &Payload::Record { wanted: true }, true);
        }
        if let Some(wanted) = self.requests.record() {
            self.subscription.ask(now, (), wanted);
        }
        self.subscription.poll(now, chunks);
        for _ in 0..RADIO_CHUNKS {
            let (mut body, mut room) = ([0; MAX_BODY], [0; MAX_FRAME]);
            let Some(chunk) = self.subscription.chunk((), chunks, &mut body, RADIO_CHUNK) else { break };
            // Without a session it is gone, as on the air.
            let Some((_, frame)) = self.link.guarded.seal(now, &Payload::Chunk(chunk), &mut room) else { continue };
            let mut frame = frame.to_vec();
            self.report.chunks[0] += 1;
            if self.arrives() {
                self.answer(now, &mut frame);
            }
        }
    }

    /// The file of what has arrived of the flight record.
    pub(super) fn record(&mut self) -> Vec<u8> {
        core::mem::take(&mut self.record)
    }

    /// The station says something. `is_open` says whether frames arrive at all. Could it be sealed?
    pub(super) fn say(&mut self, now: Instant, payload: &Payload<'_>, is_open: bool) -> bool {
        let mut room = [0; MAX_FRAME];
        let Ok(mut frame) = self.station.seal(now, payload, &mut room).map(<[u8]>::to_vec) else { return false };
        if is_open && self.arrives() {
            self.recorded.clone_from(&frame);
            self.report.sent += 1;
            let is_taken = self.hear(now, &mut frame);
            self.report.taken += u32::from(is_taken);
        }
        true
    }

    /// Both ends send what is due. Call it every 20 ms. Returns the newest telemetry that the station has opened.
    pub(super) fn exchange(&mut self, now: Instant, is_open: bool) -> TelemetryFrame {
        let mut room = [0; MAX_FRAME];
        for what in Outgoing::ALL {
            let fresh = random(&mut self.noise);
            let sent = self.link.transmit(now, what, fresh, &mut room).map(|(_, bytes)| bytes.to_vec());
            if let Some(mut bytes) = sent.filter(|_| is_open && self.arrives()) {
                self.answer(now, &mut bytes);
            }
        }
        let fresh = random(&mut self.noise);
        let sent = self.station.transmit(now, fresh, &mut room).map(<[u8]>::to_vec);
        if let Some(mut bytes) = sent.filter(|_| is_open && self.arrives()) {
            self.hear(now, &mut bytes);
        }
        self.frame
    }

    /// What the station makes of a frame of the vehicle.
    fn answer(&mut self, now: Instant, bytes: &mut [u8]) {
        let Ok(Some(received)) = self.station.receive(now, bytes) else { return };
        match received.payload {
            Payload::Acknowledgement { taken, .. } => self.report.acknowledged += u32::from(taken),
            Payload::Telemetry(_) => self.report.telemetry += 1,
            Payload::Chunk(chunk) => {
                self.report.chunks[1] += 1;
                // In a file, a chunk's length goes before it.
                self.record.extend((chunk.len() as u16).to_le_bytes());
                self.record.extend(chunk);
            }
            Payload::Sample(sample) if sample.topic == Id::telemetry as u16 => {
                let mut words = TelemetryFrame::ZERO;
                words.iter_mut().zip(sample.words()).for_each(|(to, from)| *to = from);
                self.frame = TelemetryFrame::from_words(&words).unwrap_or(self.frame);
                self.report.telemetry += 1;
            }
            _ => {}
        }
    }

    /// A frame of a stranger who has heard everything.
    fn garbage(&mut self, now: Instant) {
        self.number = self.number.wrapping_add(1);
        let mut bytes = match self.number % 4 {
            0 => {
                let length = (self.noise.unit() * (MAX_FRAME + 1) as f64) as usize;
                (0..length).map(|_| byte(&mut self.noise)).collect()
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
        if self.hear(now, &mut bytes) {
            self.report.forged += 1;
        }
    }

    fn tally(&self) -> Tally {
        self.link.guarded.vehicle().map(|vehicle| *vehicle.tally()).unwrap_or_default()
    }

    /// Does the vehicle take a frame?
    fn hear(&mut self, now: Instant, bytes: &mut [u8]) -> bool {
        let tick = now.as_micros() / TICK;
        if self.tick.0 != tick {
            self.tick = (tick, self.tally().tag);
        }
        let heard = self.link.receive(&mut self.arbiter, now, TRANSMITTER, bytes).map(|received| {
            received.map(|received| self.requests.ask(0, &received.payload));
        });
        self.report.worst_tags = self.report.worst_tags.max(self.tally().tag - self.tick.1);
        let is_opened = !matches!(heard, Err(error) if error != NotTaken::Secure(Refused::Tag));
        if now >= self.busy.0 {
            self.busy = (now, now);
        }
        self.busy.0 += if is_opened { OPENING } else { LOOK };
        self.report.busiest = self.report.busiest.max(self.busy.0.since(self.busy.1));
        heard.is_ok()
    }

    fn report(&self) -> AirReport {
        AirReport { forbidden: self.link.guarded.forbidden(), tally: self.tally(), ..self.report }
    }
}

/// Sends so many frames a second, evenly, and keeps the report up to date, and until when frames keep the processor.
pub(super) async fn flood(clock: Clock, air: Shared<'_>, rate: u32, report: &Cell<AirReport>, busy: &Cell<Instant>) {
    let period = Duration::from_micros(1_000_000 / u64::from(rate.max(50)));
    let mut next = clock.now();
    loop {
        let now = clock.now();
        if now >= next {
            next += period;
            if rate > 0 {
                air.borrow_mut().garbage(now);
            }
        }
        report.set(air.borrow().report());
        busy.set(air.borrow().busy.0);
        // The executor looks again when the processor is free.
        clock.sleep_until(if busy.get() > now { next.min(busy.get()) } else { next }).await;
    }
}

/// So many random bytes.
fn random<const N: usize>(noise: &mut Noise) -> [u8; N] {
    core::array::from_fn(|_| byte(noise))
}

fn byte(noise: &mut Noise) -> u8 {
    (noise.unit() * 256.0) as u8
}
