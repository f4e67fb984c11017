//! The vehicle's end: offers sessions, opens what its station seals, seals what it says.
//!
//! Without I/O and without a clock. Hand [`Vehicle::receive`] every frame, send what [`Vehicle::transmit`] returns every 20 ms or
//! so to every station, and what [`Vehicle::seal`] returns to the vehicle's own. One `Vehicle` is for one key; with
//! several stations, one each, told apart by [`key_id`](super::key_id).
//!
//! Checks are in this order: length, version, kind and direction, number of the key, session, counter, the budget for bad
//! frames, tag, content, age, whether the motors may turn. Session and counter are looked at before the tag because that
//! costs nothing; what they refuse would be refused with a right tag as well, and nothing is noted of a frame before its tag is
//! found right. Only what [`Vehicle::receive`] returns is a sign of life.

use super::budget::Budget;
use super::channel::{Channel, answer_secret, handshake_secret};
use super::cipher::Secret;
use super::clock::{MAX_AGE, Tick};
use super::frame::{Header, Kind, MAX_FRAME, Sender};
use super::key::Key;
use super::payload::Payload;
use super::received::Received;
use super::refused::{Refused, SealError, Tally};
use stampfly_types::{Duration, Instant};

/// Time between two announcements.
const ANNOUNCEMENT_PERIOD: Duration = Duration::from_millis(100);
/// Time between two welcomes.
const WELCOME_PERIOD: Duration = Duration::from_millis(50);
/// For this long a welcome is repeated; then the session is offered anew.
const WELCOME_TIME: Duration = Duration::from_secs(1);
/// A station that has been silent for this long may have been switched off: the vehicle offers a session to the next.
const SILENCE: Duration = Duration::from_millis(500);

/// The vehicle's end of the link with one station.
///
/// A kill is taken whatever its age: no newer frame of the station has been taken since, or it would be refused as old, so
/// the motors are off late rather than never.
///
/// ```
/// use stampfly_link::secure::{Key, MAX_FRAME, Payload, Station, Vehicle};
/// use stampfly_types::{Instant, messages::PilotInput};
///
/// # let random = |seed: u8| core::array::from_fn(|place| seed.wrapping_mul(151) ^ place as u8);
/// # fn bytes(frame: &[u8]) -> Vec<u8> { frame.to_vec() }
/// let key = Key::generate(1, core::array::from_fn(|place| place as u8 ^ 0x5A))?;
/// let (mut vehicle, mut station) = (Vehicle::new(key.clone()), Station::new(key));
/// let (now, mut room) = (Instant::from_millis(20), [0; MAX_FRAME]);
///
/// // Announcement, answer, welcome, ready. Each `random` is eight new bytes of a generator.
/// for turn in 0..2 {
///     let mut frame = bytes(vehicle.transmit(now, random(2 * turn), &mut room).expect("an announcement, a welcome"));
///     station.receive(now, &mut frame)?;
///     let mut frame = bytes(station.transmit(now, random(2 * turn + 1), &mut room).expect("an answer, ready"));
///     vehicle.receive(now, &mut frame)?;
/// }
///
/// let sticks = Payload::Sticks(PilotInput { throttle: 0.5, ..Default::default() });
/// let mut frame = bytes(station.seal(now, &sticks, &mut room)?);
/// let mut copy = frame.clone();
/// let received = vehicle.receive(now, &mut frame)?.expect("sticks");
/// assert_eq!(received.payload, sticks);
/// assert!(vehicle.receive(now, &mut copy).is_err(), "a replay");
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Vehicle {
    key: Key,
    handshake: Secret,
    /// The random number of the announcement in force. It is good for one session.
    offer: Option<[u8; 8]>,
    /// The random number that was used last: the next must be another.
    used: [u8; 8],
    announce_at: Instant,
    /// The session that a station has asked for and has not used yet.
    next: Option<Next>,
    current: Option<Channel>,
    /// Is another session wanted, although there is one?
    renew: bool,
    armed: bool,
    /// When the newest frame of the session came.
    heard: Option<Instant>,
    /// When the newest that was for the caller did.
    taken: Option<Instant>,
    /// The number of the newest numbered command that was taken.
    numbered: Option<u32>,
    /// Is it not known yet what became of that one?
    is_held: bool,
    acknowledgement: Option<Acknowledged>,
    budget: Budget,
    tally: Tally,
}

/// What is to be acknowledged.
#[derive(Clone, Copy, Debug)]
struct Acknowledged {
    /// The counter of the frame, or the number of its command.
    counter: u32,
    taken: bool,
    is_number: bool,
}

/// A command that was taken, and whose effect is not seen yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Held {
    counter: u32,
    is_number: bool,
}

impl Held {
    /// The counter of the frame, or the number of its command: what an acknowledgement or a refusal
    /// of it names.
    #[must_use]
    pub const fn counter(&self) -> u32 {
        self.counter
    }

    /// Is that the command's own number?
    #[must_use]
    pub const fn is_numbered(&self) -> bool {
        self.is_number
    }
}

#[derive(Clone, Debug)]
struct Next {
    channel: Channel,
    since: Instant,
    welcome_at: Instant,
}

impl Vehicle {
    /// A vehicle at power-on: in no session.
    #[must_use]
    pub fn new(key: Key) -> Self {
        Self {
            handshake: handshake_secret(key.secret()),
            key,
            offer: None,
            used: [0; 8],
            announce_at: Instant::ZERO,
            next: None,
            current: None,
            renew: false,
            armed: false,
            heard: None,
            taken: None,
            numbered: None,
            is_held: false,
            acknowledgement: None,
            budget: Budget::new(),
            tally: Tally::default(),
        }
    }

    /// Says whether the motors may turn; call it at least as often as [`Vehicle::transmit`]. When that begins, another session is
    /// offered; the present one goes on until the station uses it.
    pub fn set_armed(&mut self, armed: bool) {
        if armed && !self.armed {
            (self.renew, self.offer, self.announce_at) = (true, None, Instant::ZERO);
        }
        self.armed = armed;
    }

    /// Opens a frame in place. `None`: it was a part of the handshake, or a command that was taken before, and there is nothing in it for the caller.
    ///
    /// # Errors
    /// When it is not the station's newest word; nothing of it may be used then.
    pub fn receive<'f>(&mut self, now: Instant, frame: &'f mut [u8]) -> Result<Option<Received<'f>>, Refused> {
        let outcome = self.judge(now, frame);
        self.tally.count(&outcome);
        outcome
    }

    fn judge<'f>(&mut self, now: Instant, frame: &'f mut [u8]) -> Result<Option<Received<'f>>, Refused> {
        let header = Header::read(frame, Sender::Station, self.key.id())?;
        if header.kind == Kind::Join {
            self.join(now, &header, frame).map(|()| None)
        } else {
            self.open(now, &header, frame)
        }
    }

    /// A station answers an announcement: there is a session that it may use.
    fn join(&mut self, now: Instant, header: &Header, frame: &mut [u8]) -> Result<(), Refused> {
        let offer = self.offer.ok_or(Refused::Session)?;
        if !self.budget.admits(now, false) {
            return Err(Refused::Flood);
        }
        // An answer to any other announcement is sealed with another key.
        let answered = match header.open(&answer_secret(&self.handshake, offer), Sender::Station, frame) {
            Ok((_, [])) => Ok(()),
            Ok(_) => Err(Refused::Content),
            Err(error) => Err(error),
        };
        answered.inspect_err(|_| self.budget.charge(now))?;
        let channel = Channel::new(self.key.secret(), Sender::Vehicle, self.key.id(), offer, header.number());
        self.next = Some(Next { channel, since: now, welcome_at: now });
        // One announcement is good for one session, or an old answer to it would bring back a session that is over.
        self.offer = None;
        Ok(())
    }

    /// A frame of a session.
    fn open<'f>(
        &mut self,
        now: Instant,
        header: &Header,
        frame: &'f mut [u8],
    ) -> Result<Option<Received<'f>>, Refused> {
        let of_next = self.next.as_mut().map(|next| &mut next.channel);
        let of_next = of_next.filter(|channel| channel.session() == header.session);
        let is_next = of_next.is_some();
        let channel = of_next.or(self.current.as_mut()).ok_or(Refused::Session)?;
        channel.admits(header)?;
        if !self.budget.admits(now, header.kind == Kind::Kill) {
            return Err(Refused::Flood);
        }
        let (tick, body) = match channel.open(header, frame) {
            Ok(opened) => opened,
            Err(error) => {
                self.budget.charge(now);
                return Err(error);
            }
        };
        self.heard = Some(now);
        if is_next {
            // The station has heard the welcome: whatever was sealed in the session before is old from now on.
            self.current = self.next.take().map(|next| next.channel);
            self.renew = false;
        }
        if header.kind == Kind::Ready {
            return if body.is_empty() { Ok(None) } else { Err(Refused::Content) };
        }
        let payload = Payload::decode(header.kind, body).ok_or(Refused::Content)?;
        let age = tick.age(now);
        // This clock has lost time against the station's, as a simulator's does that was held up.
        // The next handshake tells the station the time anew; without one it would stay ahead.
        self.renew |= age.is_none();
        if !payload.is_kill() {
            if age.ok_or(Refused::Future)? > MAX_AGE {
                return Err(Refused::Stale);
            }
            let is_for_the_ground =
                matches!(payload, Payload::WriteParameter { .. } | Payload::Line(_) | Payload::Question { .. });
            if self.armed && is_for_the_ground {
                self.note(Acknowledged { counter: header.counter, taken: false, is_number: false });
                return Err(Refused::Armed);
            }
        }
        self.taken = Some(now);
        if let Payload::Numbered { number, .. } = payload
            && self.numbered == Some(number)
        {
            // The acknowledgement was lost, or is on its way, or it is not known yet what to say.
            if !self.is_held {
                self.note(Acknowledged { counter: number, taken: true, is_number: true });
            }
            return Ok(None);
        }
        Ok(Some(Received { payload, counter: header.counter, age: age.unwrap_or_default() }))
    }

    /// What is to be sent to every station now, if anything: an announcement or a welcome. `random` are eight bytes of the
    /// hardware's generator of random numbers (an ESP32's is one only while its radio is on), new ones at every call. If they are those that were used last, no session is
    /// offered.
    pub fn transmit<'r>(&mut self, now: Instant, random: [u8; 8], room: &'r mut [u8; MAX_FRAME]) -> Option<&'r [u8]> {
        self.next.take_if(|next| now.since(next.since) > WELCOME_TIME);
        if let Some(Next { channel, welcome_at, .. }) = &mut self.next {
            if now < *welcome_at {
                return None;
            }
            *welcome_at = now + WELCOME_PERIOD;
            let length = channel.seal(Kind::Welcome, Tick::of(now), room, |_| Ok(0)).ok()?;
            return room.get(..length);
        }
        if !self.wants_session(now) {
            self.offer = None;
            return None;
        }
        if now < self.announce_at {
            return None;
        }
        if self.offer.is_none() {
            self.offer = Some(self.fresh(random)?);
        }
        self.announce_at = now + ANNOUNCEMENT_PERIOD;
        self.announcement(room)
    }

    /// The announcement in force, for a sender that has just asked for it over a network: the same bytes for all, and nothing is noted of who asks. `None` while no session is
    /// offered.
    pub fn announcement<'r>(&self, room: &'r mut [u8; MAX_FRAME]) -> Option<&'r [u8]> {
        let header = Header::of_number(Kind::Announcement, self.key.id(), self.offer?);
        // The same bytes whenever it is the same offer: one nonce never seals two texts.
        let length = header.seal(&self.handshake, Sender::Vehicle, Tick(0), room, |_| Ok(0)).ok()?;
        room.get(..length)
    }

    /// Is a session to be offered?
    fn wants_session(&self, now: Instant) -> bool {
        let ends = self.current.as_ref().is_none_or(Channel::nears_end);
        ends || self.renew || self.heard.is_none_or(|heard| now.since(heard) > SILENCE)
    }

    /// A random number that may be used for an offer.
    fn fresh(&mut self, random: [u8; 8]) -> Option<[u8; 8]> {
        let [a, b, c, d, ..] = random;
        let session = u32::from_le_bytes([a, b, c, d]);
        if random == self.used || self.current.as_ref().is_some_and(|current| current.session() == session) {
            return None;
        }
        self.used = random;
        Some(random)
    }

    /// Seals what the vehicle says to its station.
    ///
    /// # Errors
    /// Without a session, at the end of one, or when it must not be sent.
    pub fn seal<'r>(
        &mut self,
        now: Instant,
        payload: &Payload<'_>,
        room: &'r mut [u8; MAX_FRAME],
    ) -> Result<&'r [u8], SealError> {
        let kind = payload.kind();
        if !kind.is_from(Sender::Vehicle) {
            return Err(SealError::Direction);
        }
        let channel = self.current.as_mut().ok_or(SealError::NoSession)?;
        let length = channel.seal(kind, Tick::of(now), room, |place| payload.encode(place))?;
        room.get(..length).ok_or(SealError::Length)
    }

    /// Notes what became of a command that [`Vehicle::receive`] has returned: whether there was room for it. A
    /// [numbered](Payload::Numbered) one that was taken is not returned again, however often it is said.
    pub fn acknowledge(&mut self, received: &Received<'_>, taken: bool) {
        let acknowledged = match received.payload {
            Payload::Numbered { number, .. } => {
                if taken {
                    (self.numbered, self.is_held) = (Some(number), false);
                }
                Acknowledged { counter: number, taken, is_number: true }
            }
            _ => Acknowledged { counter: received.counter, taken, is_number: false },
        };
        self.note(acknowledged);
    }

    /// Notes that a command was taken whose effect is not seen yet. A [numbered](Payload::Numbered)
    /// one is not returned again and not acknowledged, until [`Vehicle::settle`] says what became
    /// of it. Returns what to call it there.
    pub fn hold(&mut self, received: &Received<'_>) -> Held {
        let Payload::Numbered { number, .. } = received.payload else {
            return Held { counter: received.counter, is_number: false };
        };
        (self.numbered, self.is_held) = (Some(number), true);
        Held { counter: number, is_number: true }
    }

    /// Ends the hold of a command. A command that was done will be acknowledged. One that was not
    /// done is returned again when the station repeats it: the caller then repeats the refusal.
    pub fn settle(&mut self, held: Held, is_done: bool) {
        let Held { counter, is_number } = held;
        if is_number && self.numbered == Some(counter) {
            self.is_held = false;
            self.numbered = self.numbered.filter(|_| is_done);
        }
        if is_done {
            self.note(Acknowledged { counter, taken: true, is_number });
        }
    }

    /// Somebody waits for a number: what came in the same turn without one does not take its place.
    fn note(&mut self, acknowledged: Acknowledged) {
        if acknowledged.is_number || self.acknowledgement.is_none_or(|waiting| !waiting.is_number) {
            self.acknowledgement = Some(acknowledged);
        }
    }

    /// What the station is to be told of its newest command, or of what was [refused with motors armed](Refused::Armed); once. [Seal](Vehicle::seal) it.
    pub fn acknowledgement(&mut self) -> Option<Payload<'static>> {
        let Acknowledged { counter, taken, .. } = self.acknowledgement.take()?;
        Some(Payload::Acknowledgement { counter, taken })
    }

    /// Is there a session, and has its station not been silent?
    #[must_use]
    pub fn is_joined(&self, now: Instant) -> bool {
        self.current.is_some() && self.heard.is_some_and(|heard| now.since(heard) <= SILENCE)
    }

    /// The number of the session that is in use.
    #[must_use]
    pub fn session(&self) -> Option<u32> {
        self.current.as_ref().map(Channel::session)
    }

    /// How long ago the newest frame was taken that had something in it for the caller.
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        self.taken.map(|at| now.since(at))
    }

    /// What came in since power-on.
    #[must_use]
    pub const fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Gives up the counters below this one, to come to the end of a session sooner. There is no way back.
    pub fn skip_counters(&mut self, to: u32) {
        if let Some(channel) = &mut self.current {
            channel.skip(to);
        }
    }
}
