//! The station's end: joins the sessions that its vehicle offers, seals what the pilot does, opens what the vehicle says.
//!
//! For a transmitter, a ground station or a program. It is used as the [vehicle's end](super::Vehicle) is: every frame
//! into [`Station::receive`], and what [`Station::transmit`] returns is sent, every 20 ms or so.

use super::budget::Budget;
use super::channel::{Channel, answer_secret, handshake_secret};
use super::cipher::Secret;
use super::clock::{Tick, VehicleClock};
use super::frame::{Header, Kind, MAX_FRAME, Sender};
use super::key::Key;
use super::payload::Payload;
use super::received::Received;
use super::refused::{Refused, SealError, Tally};
use stampfly_types::{Duration, Instant};

/// Announcements that are answered at a time. Old ones that someone repeats take places, too.
const OFFERS: usize = 4;
/// Time between two answers.
const ANSWER_PERIOD: Duration = Duration::from_millis(100);
/// For this long an answer is repeated after its announcement was heard.
const ANSWER_TIME: Duration = Duration::from_secs(1);

/// An announcement that was heard.
#[derive(Clone, Debug)]
struct Offer {
    of_vehicle: [u8; 8],
    /// Once it is answered: the session that comes of it, and our random number in it.
    answer: Option<(Channel, [u8; 8])>,
    /// When it was heard last.
    heard: Instant,
    /// When to answer next.
    answer_at: Instant,
}

/// The station's end of the link with one vehicle. See [`Vehicle`](super::Vehicle) for an example.
#[derive(Clone, Debug)]
pub struct Station {
    key: Key,
    handshake: Secret,
    /// The newest first.
    offers: [Option<Offer>; OFFERS],
    /// The random number that was used last: the next must be another.
    used: [u8; 8],
    current: Option<Channel>,
    /// The session before: the vehicle speaks in it until it knows that we are in the new one.
    previous: Option<Channel>,
    /// Is the vehicle to be told that we are in the new one?
    ready: bool,
    clock: VehicleClock,
    taken: Option<Instant>,
    budget: Budget,
    tally: Tally,
}

impl Station {
    /// A station that has heard nothing yet.
    #[must_use]
    pub fn new(key: Key) -> Self {
        Self {
            handshake: handshake_secret(key.secret()),
            key,
            offers: [const { None }; OFFERS],
            used: [0; 8],
            current: None,
            previous: None,
            ready: false,
            clock: VehicleClock::new(Instant::ZERO, Tick(0)),
            taken: None,
            budget: Budget::new(),
            tally: Tally::default(),
        }
    }

    /// Opens a frame in place. `None`: it was a part of the handshake, and there is nothing in it for the caller.
    ///
    /// # Errors
    /// When it is not the vehicle's newest word; nothing of it may be used then.
    pub fn receive<'f>(&mut self, now: Instant, frame: &'f mut [u8]) -> Result<Option<Received<'f>>, Refused> {
        let outcome = self.judge(now, frame);
        self.tally.count(&outcome);
        outcome
    }

    fn judge<'f>(&mut self, now: Instant, frame: &'f mut [u8]) -> Result<Option<Received<'f>>, Refused> {
        let header = Header::read(frame, Sender::Vehicle, self.key.id())?;
        match header.kind {
            Kind::Announcement => self.hear_offer(now, &header, frame).map(|()| None),
            Kind::Welcome if !self.is_current(&header) => self.enter(now, &header, frame).map(|()| None),
            _ => self.open(now, &header, frame),
        }
    }

    fn is_current(&self, header: &Header) -> bool {
        self.current.as_ref().is_some_and(|current| current.session() == header.session)
    }

    /// An announcement. It may be an old one: then the vehicle refuses the answer, and nothing comes of it.
    fn hear_offer(&mut self, now: Instant, header: &Header, frame: &mut [u8]) -> Result<(), Refused> {
        if self.is_current(header) {
            return Err(Refused::Old);
        }
        if !self.budget.admits(now, false) {
            return Err(Refused::Flood);
        }
        match header.open(&self.handshake, Sender::Vehicle, frame) {
            Ok((_, [])) => {}
            Ok(_) => return Err(Refused::Content),
            Err(error) => {
                self.budget.charge(now);
                return Err(error);
            }
        }
        let of_vehicle = header.number();
        if let Some(known) = self.offers.iter_mut().flatten().find(|offer| offer.of_vehicle == of_vehicle) {
            known.heard = now;
        } else {
            self.offers.rotate_right(1);
            let [newest, ..] = &mut self.offers;
            *newest = Some(Offer { of_vehicle, answer: None, heard: now, answer_at: now });
        }
        Ok(())
    }

    /// A welcome to a session that was asked for. Nobody can have sealed it but the vehicle, after our answer: its key comes of
    /// the random number in that.
    fn enter(&mut self, now: Instant, header: &Header, frame: &mut [u8]) -> Result<(), Refused> {
        let answered = self.offers.iter_mut().flatten().filter_map(|offer| offer.answer.as_mut());
        let channel = answered.map(|(channel, _)| channel).find(|channel| channel.session() == header.session);
        let channel = channel.ok_or(Refused::Session)?;
        channel.admits(header)?;
        if !self.budget.admits(now, false) {
            return Err(Refused::Flood);
        }
        let tick = match channel.open(header, frame) {
            Ok((tick, [])) => tick,
            Ok(_) => return Err(Refused::Content),
            Err(error) => {
                self.budget.charge(now);
                return Err(error);
            }
        };
        self.previous = self.current.replace(channel.clone());
        self.clock = VehicleClock::new(now, tick);
        self.ready = true;
        self.offers = [const { None }; OFFERS];
        Ok(())
    }

    /// A frame of a session.
    fn open<'f>(
        &mut self,
        now: Instant,
        header: &Header,
        frame: &'f mut [u8],
    ) -> Result<Option<Received<'f>>, Refused> {
        let is_current = self.is_current(header);
        let channel = if is_current { &mut self.current } else { &mut self.previous };
        let channel = channel.as_mut().ok_or(Refused::Session)?;
        channel.admits(header)?;
        if !self.budget.admits(now, false) {
            return Err(Refused::Flood);
        }
        let (tick, body) = match channel.open(header, frame) {
            Ok(opened) => opened,
            Err(error) => {
                self.budget.charge(now);
                return Err(error);
            }
        };
        self.clock.hear(now, tick);
        if header.kind == Kind::Welcome {
            self.ready = true;
            return if body.is_empty() { Ok(None) } else { Err(Refused::Content) };
        }
        if is_current {
            self.previous = None;
        }
        let payload = Payload::decode(header.kind, body).ok_or(Refused::Content)?;
        let age = Duration::from_millis(u64::from(self.clock.read(now).after(tick).max(0).unsigned_abs()));
        self.taken = Some(now);
        Ok(Some(Received { payload, counter: header.counter, age }))
    }

    /// What is to be sent to the vehicle now, if anything: an answer to an announcement, or that its welcome was heard. `random`
    /// are eight bytes of a generator of random numbers, new ones at every call. If they are those that were used last, nothing
    /// is answered.
    pub fn transmit<'r>(&mut self, now: Instant, random: [u8; 8], room: &'r mut [u8; MAX_FRAME]) -> Option<&'r [u8]> {
        if core::mem::take(&mut self.ready) {
            let tick = self.clock.read(now);
            let length = self.current.as_mut()?.seal(Kind::Ready, tick, room, |_| Ok(0)).ok()?;
            return room.get(..length);
        }
        let is_due = |offer: &&mut Offer| now >= offer.answer_at && now.since(offer.heard) <= ANSWER_TIME;
        let offer = self.offers.iter_mut().flatten().find(is_due)?;
        if offer.answer.is_none() {
            if random == self.used {
                return None;
            }
            self.used = random;
            let id = self.key.id();
            offer.answer =
                Some((Channel::new(self.key.secret(), Sender::Station, id, offer.of_vehicle, random), random));
        }
        offer.answer_at = now + ANSWER_PERIOD;
        let (_, of_station) = offer.answer.as_ref()?;
        let header = Header::of_number(Kind::Join, self.key.id(), *of_station);
        // The same bytes whenever it is the same answer: one nonce never seals two texts.
        let secret = answer_secret(&self.handshake, offer.of_vehicle);
        let length = header.seal(&secret, Sender::Station, Tick(0), room, |_| Ok(0)).ok()?;
        room.get(..length)
    }

    /// Seals what the station says to its vehicle.
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
        if !kind.is_from(Sender::Station) {
            return Err(SealError::Direction);
        }
        let channel = self.current.as_mut().ok_or(SealError::NoSession)?;
        let length = channel.seal(kind, self.clock.read(now), room, |place| payload.encode(place))?;
        room.get(..length).ok_or(SealError::Length)
    }

    /// The counter of the frame that was sealed last, which an acknowledgement of it names.
    #[must_use]
    pub fn counter(&self) -> u32 {
        self.current.as_ref().map_or(0, Channel::sent)
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

    /// What came in since the start.
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
