//! The air between radios: who is heard where, what is lost, and what two at once make of each other.
//!
//! Everything that radios do by themselves happens here, in the order of time: [`Air`] goes from one event to the next whenever anybody looks at it.

use super::frame::{AirRate, Content};
use super::radio::{Emission, Radio};
use crate::noise::Noise;
use crate::time::Clock;
use core::cell::RefCell;
use core::task::Waker;
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

/// Stream of what is lost; no sensor has this number.
const STREAM: u64 = 103;
/// Bits of the preamble (7.3.1).
const PREAMBLE: u64 = 8;
/// No packet is as long: 32 bytes at 250 kbit/s and everything around them are 1.4 ms.
const LONGEST: Duration = Duration::from_micros(2_000);

/// A packet of somebody who is no emulated chip: plain ShockBurst, without control field and acknowledgement.
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
    /// 2400 MHz and so many.
    pub channel: u8,
    /// Its speed.
    pub rate: AirRate,
    /// 3 to 5 bytes in the order of the chip's register: the first one is the least significant.
    pub address: &'a [u8],
    /// Up to 32 bytes.
    pub payload: &'a [u8],
    /// Bytes of the CRC, 0 to 2.
    pub crc: u8,
}

/// What somebody sends.
#[derive(Debug)]
struct Transmission {
    sender: Option<usize>,
    emission: Emission,
    from: Instant,
    until: Instant,
    /// The bit that arrives wrongly, everywhere.
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

/// The air that radios share. Clones are the same air.
///
/// A packet that is lost arrives with a wrong bit, so that it is the receiver's CRC that refuses it; without one it is taken for
/// good. On a jammed channel, and where two packets overlap, nothing arrives. Everybody is in range of everybody.
#[derive(Clone, Debug)]
pub struct Air(Rc<RefCell<State>>);

impl Air {
    /// Clear air. The seed decides what is lost.
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

    /// From now on this share of packets is lost, 0 to 1.
    pub fn set_loss(&self, share: f64) {
        self.0.borrow_mut().loss = share;
    }

    /// From now on somebody else fills this channel, or no longer.
    pub fn jam(&self, channel: u8, jammed: bool) {
        let mut state = self.0.borrow_mut();
        let now = state.clock.now();
        state.advance(now);
        if let Some(place) = state.jammed.get_mut(usize::from(channel)) {
            *place = jammed;
        }
    }

    /// Sends a packet, whose preamble begins now. Returns how long it is on the air.
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

    /// Another radio, and its number.
    pub(super) fn join(&self, radio: Radio) -> usize {
        let mut state = self.0.borrow_mut();
        state.radios.push(radio);
        state.radios.len() - 1
    }

    pub(super) fn clock(&self) -> Clock {
        self.0.borrow().clock.clone()
    }

    /// Lets everything happen that is due, then something with one radio.
    pub(super) fn with<T>(&self, number: usize, now: Instant, act: impl FnOnce(&mut Radio) -> T) -> T {
        let mut state = self.0.borrow_mut();
        state.advance(now);
        let outcome = act(&mut state.radios[number]);
        // What begins at this instant.
        state.advance(now);
        let (radio, channel) = (&state.radios[number], state.radios[number].channel());
        if radio.listens(now) && state.jammed[usize::from(channel)] {
            state.radios[number].notice_carrier();
        }
        state.wake();
        outcome
    }

    /// Is the interrupt of this radio asserted? Otherwise, the waker is called when that can have changed.
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

/// What happens next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    /// The end of the transmission of this number. Before what radios do, whose patience may end at the same time.
    Arrives(usize),
    /// This radio does something.
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
        self.sent.retain(|sent| !sent.delivered || sent.until + LONGEST > now);
    }

    fn emit(&mut self, sender: Option<usize>, emission: Emission, from: Instant) -> Duration {
        let span = emission.rate.of(PREAMBLE + emission.bits.len() as u64);
        let (lost, place) = (self.noise.chance(self.loss), self.noise.unit());
        let wrong = lost.then_some((place * emission.bits.len() as f64) as usize);
        self.sent.push(Transmission { sender, emission, from, until: from + span, wrong, delivered: false });
        span
    }

    /// A transmission is over: whoever listened to all of it has it.
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
