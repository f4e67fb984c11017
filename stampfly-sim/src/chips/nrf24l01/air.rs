//! Radio channel between nRF24L01s: propagation, loss, collisions.
//!
//! All autonomous actions of radios happen here in the order of time: [`Air`] advances event by
//! event on every access.

use super::frame::{AirRate, Content};
use super::radio::{Emission, Radio};
use crate::noise::Noise;
use crate::time::Clock;
use core::cell::RefCell;
use core::task::Waker;
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

/// Random stream of losses; no sensor uses this number.
const STREAM: u64 = 103;
/// Bits of the preamble (7.3.1).
const PREAMBLE: u64 = 8;
/// Longer than any packet: 32 bytes at 250 kbit/s with overhead take 1.4 ms.
const LONGEST: Duration = Duration::from_micros(2_000);

/// A packet from a sender that is not an emulated chip: plain ShockBurst, without control field and
/// acknowledgement.
///
/// ```
/// use stampfly_sim::chips::{Air, AirPacket, AirRate};
/// use stampfly_sim::time::Clock;
/// use stampfly_types::{Duration, Instant};
///
/// let air = Air::new(&Clock::new(Instant::ZERO), 1);
/// let packet = AirPacket { channel: 81, rate: AirRate::Mbit1, address: &[0x12, 0x23, 0x23, 0x45, 0x78], payload: &[0; 10], crc: 2 };
/// assert_eq!(air.send(&packet), Duration::from_micros(144), "preamble, address, payload, CRC");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AirPacket<'a> {
    /// Channel: frequency in MHz above 2400.
    pub channel: u8,
    /// Data rate.
    pub rate: AirRate,
    /// 3 to 5 bytes in the order of the chip's register: least significant byte first.
    pub address: &'a [u8],
    /// Payload, up to 32 bytes.
    pub payload: &'a [u8],
    /// Length of the CRC, 0 to 2 bytes.
    pub crc: u8,
}

/// A transmission on the air.
#[derive(Debug)]
struct Transmission {
    sender: Option<usize>,
    emission: Emission,
    from: Instant,
    until: Instant,
    /// The bit that is received wrongly by all receivers.
    wrong: Option<usize>,
    delivered: bool,
}

#[derive(Debug)]
struct State {
    clock: Clock,
    radios: Vec<Radio>,
    sent: Vec<Transmission>,
    noise: Noise,
    loss: f64,
    jammed: [bool; 128],
    waiting: Vec<Waker>,
}

/// The radio channel shared by radios. Clones are the same channel.
///
/// A lost packet arrives with a wrong bit, so that the receiver's CRC rejects it; without a CRC it
/// is accepted. On a jammed channel, and where two packets overlap, nothing is received. All radios
/// are in range of each other.
#[derive(Clone, Debug)]
pub struct Air(Rc<RefCell<State>>);

impl Air {
    /// A clear channel. `seed` draws the losses.
    #[must_use]
    pub fn new(clock: &Clock, seed: u64) -> Self {
        Self(Rc::new(RefCell::new(State {
            clock: clock.clone(),
            radios: Vec::new(),
            sent: Vec::new(),
            noise: Noise::new(seed, STREAM),
            loss: 0.0,
            jammed: [false; 128],
            waiting: Vec::new(),
        })))
    }

    /// Sets the share of lost packets, 0 to 1.
    pub fn set_loss(&self, share: f64) {
        self.0.borrow_mut().loss = share;
    }

    /// Jams a channel, or stops jamming it.
    pub fn jam(&self, channel: u8, jammed: bool) {
        let mut state = self.0.borrow_mut();
        let now = state.clock.now();
        state.advance(now);
        if let Some(place) = state.jammed.get_mut(usize::from(channel)) {
            *place = jammed;
        }
    }

    /// Sends a packet whose preamble begins now. Returns its duration on the air.
    pub fn send(&self, packet: &AirPacket<'_>) -> Duration {
        let mut state = self.0.borrow_mut();
        let now = state.clock.now();
        state.advance(now);
        let AirPacket { channel, rate, address, payload, crc } = *packet;
        let bits = Content { address, control: None, payload, crc }.bits();
        let span = state.emit(None, Emission { channel, rate, bits }, now);
        state.wake();
        span
    }

    /// Adds a radio and returns its number.
    pub(super) fn join(&self, radio: Radio) -> usize {
        let mut state = self.0.borrow_mut();
        state.radios.push(radio);
        state.radios.len() - 1
    }

    pub(super) fn clock(&self) -> Clock {
        self.0.borrow().clock.clone()
    }

    /// Processes all due events, then applies `act` to one radio.
    pub(super) fn with<T>(&self, number: usize, now: Instant, act: impl FnOnce(&mut Radio) -> T) -> T {
        let mut state = self.0.borrow_mut();
        state.advance(now);
        let outcome = act(&mut state.radios[number]);
        // Events that `act` causes at this instant.
        state.advance(now);
        let (radio, channel) = (&state.radios[number], state.radios[number].channel());
        if radio.listens(now) && state.jammed[usize::from(channel)] {
            state.radios[number].notice_carrier();
        }
        state.wake();
        outcome
    }

    /// State of this radio's interrupt, and the instant of the next event. `waker` is called when
    /// the state may have changed.
    pub(super) fn interrupts(&self, number: usize, waker: Option<&Waker>) -> (bool, Option<Instant>) {
        let mut state = self.0.borrow_mut();
        let now = state.clock.now();
        state.advance(now);
        if let Some(waker) = waker.filter(|waker| !state.waiting.iter().any(|known| known.will_wake(waker))) {
            state.waiting.push(waker.clone());
        }
        (state.radios[number].interrupts(), state.next_event().map(|(at, _)| at))
    }
}

/// The next event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    /// End of the transmission with this number. Ordered before actions of radios, whose timeout
    /// may end at the same instant.
    Arrives(usize),
    /// Action of a radio.
    Acts(usize),
}

impl State {
    fn next_event(&self) -> Option<(Instant, Event)> {
        let sent = self.sent.iter().enumerate().filter(|(_, sent)| !sent.delivered);
        let ends = sent.map(|(place, sent)| (sent.until, Event::Arrives(place)));
        let radios = self.radios.iter().enumerate();
        ends.chain(radios.filter_map(|(number, radio)| Some((radio.next_event()?, Event::Acts(number))))).min()
    }

    fn advance(&mut self, now: Instant) {
        while let Some((at, event)) = self.next_event().filter(|(at, _)| *at <= now) {
            match event {
                Event::Arrives(place) => self.deliver(place),
                Event::Acts(number) => {
                    if let Some(emission) = self.radios[number].act(at) {
                        let span = self.emit(Some(number), emission, at);
                        self.radios[number].send_until(at + span);
                    }
                }
            }
        }
        // Ended transmissions are kept for a while, because a later one may have overlapped them.
        self.sent.retain(|sent| !sent.delivered || sent.until + LONGEST > now);
    }

    fn emit(&mut self, sender: Option<usize>, emission: Emission, from: Instant) -> Duration {
        let span = emission.rate.of(PREAMBLE + emission.bits.len() as u64);
        // Both are drawn for every packet, so that the sequence does not depend on the loss rate.
        let (lost, place) = (self.noise.chance(self.loss), self.noise.unit());
        let wrong = lost.then_some((place * emission.bits.len() as f64) as usize);
        self.sent.push(Transmission { sender, emission, from, until: from + span, wrong, delivered: false });
        span
    }

    /// End of a transmission: radios that listened from its beginning receive it.
    fn deliver(&mut self, place: usize) {
        let sent = &self.sent[place];
        let Emission { channel, rate, .. } = sent.emission;
        let overlapped = self.sent.iter().enumerate().any(|(other, another)| {
            other != place
                && another.emission.channel == channel
                && another.from < sent.until
                && sent.from < another.until
        });
        let noisy = overlapped || self.jammed.get(usize::from(channel)).is_some_and(|jammed| *jammed);
        let mut bits = sent.emission.bits.clone();
        if let Some(bit) = sent.wrong.and_then(|wrong| bits.get_mut(wrong)) {
            *bit = !*bit;
        }
        let (sender, from, until) = (sent.sender, sent.from, sent.until);
        for (number, radio) in self.radios.iter_mut().enumerate() {
            if sender != Some(number) && radio.channel() == channel && radio.listens(from) {
                radio.notice_carrier();
                if radio.rate() == rate && !noisy {
                    radio.hear(&bits, until);
                }
            }
        }
        self.sent[place].delivered = true;
    }

    fn wake(&mut self) {
        self.waiting.drain(..).for_each(Waker::wake);
    }
}
