//! Everything that is spoken on a vehicle's serial line: a person's text, MAVLink for any ground
//! station, and this family's own ground station in tunnels of MAVLink.
//!
//! | file | what it does |
//! |---|---|
//! | `split.rs` | which bytes are text, and which are frames |
//! | `envelope.rs` | payloads of the secure link in `TUNNEL` |
//!
//! The vehicle says nothing in MAVLink until it has heard a frame, and no more [30
//! s](crate::mavlink) after the last: a terminal shows text alone. For lines whose other end is in
//! reach, such as USB: nobody is authenticated.

mod envelope;
mod split;

pub use crate::watches::Watches;
pub use envelope::{Assembly, BODY, Envelope, PART, TUNNEL, TYPE, fingerprint};
pub use split::{PAUSE, Part, Split};

use crate::access::VehicleAccess;
use crate::goal::{CommandGoal, OVERTAKEN, TOO_MANY, Waited};
use crate::mavlink::{Identity, Mavlink};
use crate::refusal::Requester;
use crate::requests::{Answer, Room, StationRequests};
use crate::view::Samples;
use stampfly_flight::console::{Request, Vehicle};
use stampfly_link::mavlink::Tunnel;
use stampfly_link::secure::{Payload, Sample};
use stampfly_types::messages::{GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Instant};

/// A station that was not heard for this long is sent no topics any more.
const SILENCE: Duration = Duration::from_secs(5);
/// Answers that are made at once.
const AT_ONCE: usize = 4;
/// Words of the longest message that is sent.
const WORDS: usize = 64;

/// Most commands whose acknowledgement waits until the vehicle's state shows their effect. Further
/// ones are refused, but for those that end a flight: they take the place of the oldest.
const WAITS: usize = 8;
/// Greatest age of a command, ms. An older one was held up on the line, and is refused.
const FRESH_MS: i32 = 1_000;
const LATE: &str = "expired: it came more than a second late, and was not done";

/// Is this time, ms of the vehicle's clock, more than [`FRESH_MS`] ago? A time in the future is not:
/// a station's clock runs ahead of a simulated vehicle on a slow machine.
const fn is_late(now: Instant, said: u32) -> bool {
    ((now.as_micros() / 1_000) as u32).wrapping_sub(said) as i32 > FRESH_MS
}

/// Landing and motors off are carried out whatever their age.
fn is_never_late(payload: &Payload<'_>) -> bool {
    payload.is_kill() || payload.command().is_some_and(|command| command.kind == GuidedKind::Land)
}

/// Where frames go. Each is handed over whole.
pub type Put<'p> = &'p mut dyn FnMut(&[u8]);

/// One serial line, at which a station may watch up to `WATCHED` topics and upload a mission of up
/// to `ITEMS` items.
///
/// Give it what is heard with [`hear`](Self::hear), which actions what a person types to a terminal;
/// call [`poll`](Self::poll) and [`answer`](Self::answer) about a hundred times a second.
#[derive(Clone, Debug)]
pub struct Cable<const WATCHED: usize, const ITEMS: usize = { crate::mavlink::ITEMS }> {
    split: Split,
    mavlink: Mavlink<(), 1, ITEMS>,
    requests: StationRequests,
    watches: Watches<WATCHED>,
    table: u16,
    /// When the station was heard.
    station: Option<Instant>,
    foreign: u32,
    /// Numbers of commands that are not seen to have happened yet.
    waits: heapless::Vec<(u16, Waited), WAITS>,
    /// Chunks of the flight record that were sent.
    chunks: u16,
    /// What was asked of the vehicle, and told to the station.
    told: u32,
}

impl<const WATCHED: usize, const ITEMS: usize> Cable<WATCHED, ITEMS> {
    /// A line of a vehicle with this identity and [fingerprint].
    #[must_use]
    pub const fn new(identity: Identity, table: u16) -> Self {
        Self {
            split: Split::new(),
            mavlink: Mavlink::for_clients(identity),
            requests: StationRequests::new(),
            watches: Watches::new(),
            table,
            station: None,
            foreign: 0,
            waits: heapless::Vec::new(),
            chunks: 0,
            told: 0,
        }
    }

    /// Envelopes of a station with other tables, which did nothing but kill. Wraps around.
    #[must_use]
    pub const fn foreign(&self) -> u32 {
        self.foreign
    }

    /// Does a program speak in frames here?
    #[must_use]
    pub fn is_spoken(&self, now: Instant) -> bool {
        self.station.is_some_and(|at| now.since(at) < SILENCE)
    }

    /// Takes what has come. `typed` is given what a person has typed.
    pub fn hear(
        &mut self,
        now: Instant,
        bytes: &[u8],
        access: &mut dyn VehicleAccess,
        put: Put<'_>,
        typed: &mut dyn FnMut(u8),
    ) {
        self.hear_any(now, false, bytes, access, put, typed);
    }

    /// The same of what lay in the caller's queue for more than a second: frames of MAVLink are
    /// [late](Mavlink::hear_late), a station has said itself when it has spoken, and what a person
    /// has typed is dropped. Returns whether anything was.
    pub fn hear_late(&mut self, now: Instant, bytes: &[u8], access: &mut dyn VehicleAccess, put: Put<'_>) -> bool {
        let mut is_dropped = false;
        self.hear_any(now, true, bytes, access, put, &mut |_| is_dropped = true);
        is_dropped
    }

    fn hear_any(
        &mut self,
        now: Instant,
        is_late: bool,
        bytes: &[u8],
        access: &mut dyn VehicleAccess,
        put: Put<'_>,
        typed: &mut dyn FnMut(u8),
    ) {
        // Its frames come byte by byte.
        self.mavlink.open_local(now, (), false);
        for byte in bytes {
            if self.split.feed(now, *byte) == Part::Text {
                typed(*byte);
                continue;
            }
            // A byte ends one frame at most.
            let mut tunnel = None;
            let mut keep = |requester: Requester, heard: Tunnel| tunnel = Some((requester, heard));
            let answer = &mut |(): &(), frame: &[u8]| put(frame);
            self.mavlink.hear_tunnels(now, (), (&[*byte], is_late), access, answer, &mut keep);
            if let Some((requester, tunnel)) = tunnel.filter(|(_, tunnel)| tunnel.kind == TYPE) {
                self.open(now, requester, &tunnel.bytes, access, put);
            }
        }
    }

    /// Opens an envelope.
    fn open(&mut self, now: Instant, requester: Requester, bytes: &[u8], access: &mut dyn VehicleAccess, put: Put<'_>) {
        // What a station says is short: one part.
        let Some((envelope, body)) = Envelope::read(bytes) else { return };
        let Some(payload) = Payload::decode(envelope.kind, body) else { return };
        self.station = Some(now);
        let number = envelope.number;
        // MAVLink's own words behind it have no room for a time.
        self.mavlink.mark(now, (), envelope.said.is_some_and(|said| is_late(now, said)));
        if envelope.table != self.table && !payload.is_kill() {
            self.foreign = self.foreign.wrapping_add(1);
            return self.say(
                number,
                &Payload::Reply { text: "station and vehicle are of different versions", last: true },
                put,
            );
        }
        if envelope.said.is_some_and(|said| is_late(now, said)) && !is_never_late(&payload) {
            // What comes again and again is not answered.
            let is_repeated = matches!(payload, Payload::Sticks(_) | Payload::Watch { .. } | Payload::Record { .. })
                || payload.command().is_some_and(|command| command.kind == GuidedKind::None);
            if !is_repeated {
                self.say(number, &Payload::Reply { text: LATE, last: true }, put);
            }
            return;
        }
        let command = match payload {
            Payload::Guided(GuidedCommand { kind: GuidedKind::None, .. }) => return access.alive(now, requester),
            // They come again and again, and are not answered.
            Payload::Sticks(input) => {
                _ = access.steer(now, requester, &input);
                return;
            }
            Payload::Watch { topic, period } => {
                let taken = self.watches.watch(now, topic, period);
                return self.say(number, &Payload::Acknowledgement { counter: number.into(), taken }, put);
            }
            payload => match payload.command() {
                Some(command) => command,
                None => {
                    if !self.requests.ask(number, &payload) {
                        self.say(number, &Payload::Reply { text: "one question after the other", last: true }, put);
                    }
                    return;
                }
            },
        };
        let goal = CommandGoal::of(command.kind);
        let mut words = heapless::String::<96>::new();
        if goal.is_some_and(|goal| goal.refuse(&access.view().state(), &mut words)) {
            return self.say(number, &Payload::Reply { text: &words, last: true }, put);
        }
        if self.waits.is_full() && goal.is_some_and(|goal| !goal.ends_a_flight()) {
            return self.say(number, &Payload::Reply { text: TOO_MANY, last: true }, put);
        }
        let waited = goal.map(|goal| Waited::new(now, goal, access));
        match access.guide(now, requester, command) {
            // Acknowledged when it is seen to have happened.
            Ok(()) if let Some(waited) = waited => {
                let Err(new) = self.waits.push((number, waited)) else { return };
                let oldest = self.waits.iter_mut().min_by_key(|(_, waited)| waited.since());
                if let Some((overtaken, _)) = oldest.map(|oldest| core::mem::replace(oldest, new)) {
                    self.say(overtaken, &Payload::Reply { text: OVERTAKEN, last: true }, put);
                }
            }
            Ok(()) => self.say(number, &Payload::Acknowledgement { counter: number.into(), taken: true }, put),
            Err(refusal) => {
                _ = core::fmt::Write::write_fmt(&mut words, format_args!("{refusal}"));
                self.say(number, &Payload::Reply { text: &words, last: true }, put);
            }
        }
    }

    /// Acknowledges commands that are seen to have happened, and says of others why they did not.
    fn settle(&mut self, now: Instant, access: &dyn VehicleAccess, put: Put<'_>) {
        let Self { waits, mavlink, table, .. } = self;
        waits.retain(|(number, waited)| {
            let Some(result) = waited.look(now, access) else { return true };
            let payload = match result {
                Ok(()) => Payload::Acknowledgement { counter: (*number).into(), taken: true },
                Err(text) => Payload::Reply { text, last: true },
            };
            send(mavlink, *table, *number, &payload, put);
            false
        });
    }

    /// The line is gone, with all who command over it.
    pub fn close(&mut self, access: &mut dyn VehicleAccess) {
        self.mavlink.close((), access);
        self.forget();
    }

    /// Forgets what the station has asked for: another may come and use the same numbers.
    fn forget(&mut self) {
        self.waits.clear();
        self.watches.clear();
        self.requests.clear();
    }

    /// Sends what is due: MAVLink's streams fifty times a second at most, and the station's topics.
    pub fn poll(&mut self, now: Instant, access: &mut dyn VehicleAccess, samples: &dyn Samples, put: Put<'_>) {
        self.mavlink.poll(now, access, &mut |(), frame| put(frame));
        self.settle(now, access, put);
        let is_spoken = self.is_spoken(now);
        while let Some((number, what)) = access.told(self.told) {
            self.told = number;
            if is_spoken {
                let mut text = heapless::String::<96>::new();
                // What is too long is cut.
                _ = core::fmt::Write::write_fmt(&mut text, format_args!("{what}"));
                self.say(0, &Payload::Notice { number, text: &text }, put);
            }
        }
        if !is_spoken {
            return self.forget();
        }
        let Self { watches, mavlink, table, .. } = self;
        watches.poll(now, samples, &mut |topic, number, at, words| {
            let mut bytes = [[0; 4]; WORDS];
            bytes.iter_mut().zip(words).for_each(|(to, word)| *to = word.to_le_bytes());
            let words = bytes.get(..words.len()).unwrap_or_default();
            send(mavlink, *table, number, &Payload::Sample(Sample::new(topic, at, words)), put);
        });
    }

    /// Makes the next answers. Returns what only the board can do, which then
    /// [reports](Self::report).
    pub fn answer<V: Vehicle>(&mut self, now: Instant, vehicle: &mut V, put: Put<'_>) -> Request<V::Request> {
        let mut room = Room::default();
        for _ in 0..AT_ONCE {
            let Some(Answer { number, payload, request }) = self.requests.answer(now, vehicle, &mut room) else {
                break;
            };
            send(&mut self.mavlink, self.table, number, &payload, put);
            if !matches!(request, Request::Nothing) {
                return request;
            }
        }
        Request::Nothing
    }

    /// What the station has said last of the flight record: that it is wanted, or is not; once. See
    /// [`RecordSubscription`](crate::RecordSubscription).
    pub const fn record(&mut self) -> Option<bool> {
        self.requests.record()
    }

    /// Sends a chunk of the flight record, of at most [`BODY`] bytes.
    pub fn send_chunk(&mut self, chunk: &[u8], put: Put<'_>) {
        self.chunks = self.chunks.wrapping_add(1);
        self.say(self.chunks, &Payload::Chunk(chunk), put);
    }

    /// The board has done what it was asked for, or not.
    pub fn report(&mut self, what: &dyn core::fmt::Display) {
        self.requests.report(what);
    }

    fn say(&mut self, number: u16, payload: &Payload<'_>, put: Put<'_>) {
        send(&mut self.mavlink, self.table, number, payload, put);
    }
}

fn send<const ITEMS: usize>(
    mavlink: &mut Mavlink<(), 1, ITEMS>,
    table: u16,
    number: u16,
    payload: &Payload<'_>,
    put: Put<'_>,
) {
    Envelope::write(table, number, None, payload, &mut |part| {
        if let Some(tunnel) = Tunnel::new(TYPE, [0; 2], part) {
            mavlink.send_payload((), Tunnel::ID, &tunnel.payload(), &mut |(), frame| put(frame));
        }
    });
}
