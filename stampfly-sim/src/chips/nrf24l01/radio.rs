//! State machine of one radio: power, settling, transmission, reception, acknowledgement (nRF24L01+
//! product specification, 6.1 and 7.4).

use super::frame::{AirRate, CONTROL, Content, checksum, number};
use super::registers::{Payload, Registers, flag, register};
use stampfly_types::{Duration, Instant};
use std::collections::VecDeque;

/// Time from power-on to power down (6.1.1, figure 4).
const POWER_ON: Duration = Duration::from_micros(100_000);
/// Time from power down to standby with a crystal of up to 90 mH, the longest of the table (6.1.7,
/// table 16, Tpd2stby).
const POWER_UP: Duration = Duration::from_micros(4_500);
/// Time from standby to listening or sending (Tstby2a).
const SETTLE: Duration = Duration::from_micros(130);
/// Shortest CE pulse that starts a transmission (Thce).
const PULSE: Duration = Duration::from_micros(10);
/// Depth of each FIFO, payloads (8.4).
pub(super) const FIFO: usize = 3;
/// Bit of the control field: no acknowledgement wanted (7.3.3.3).
const NO_ACKNOWLEDGEMENT: u16 = 1;

/// A transmission.
#[derive(Clone, Debug)]
pub(super) struct Emission {
    pub channel: u8,
    pub rate: AirRate,
    pub bits: Vec<bool>,
}

#[derive(Clone, Debug)]
enum State {
    /// Power down or standby.
    Idle,
    /// Receives packets that begin at or after this instant.
    Listening(Instant),
    /// Will send the first payload, or the acknowledgement of this pipe, at this instant.
    Settling(Instant, Option<u8>),
    /// Sends the first payload, or an acknowledgement, until this instant.
    Sending(Option<Instant>, Option<u8>),
    /// Receives an acknowledgement that begins between these instants.
    Awaiting(Instant, Instant),
}

/// A radio: registers, FIFOs and state.
#[derive(Debug)]
pub(super) struct Radio {
    pub registers: Registers,
    pub received: VecDeque<(u8, Vec<u8>)>,
    pub outgoing: VecDeque<Payload>,
    /// The antenna is removed.
    pub broken: bool,
    ready: Instant,
    /// Instant from which standby is reached; `None` in power down.
    crystal: Option<Instant>,
    enabled: bool,
    raised: Instant,
    state: State,
    /// Number of the packet in transmission, and attempts left.
    packet: u16,
    attempts: u8,
    /// Number and checksum of the last packet in each pipe, to detect repetitions.
    heard: [Option<(u16, u16)>; 6],
    carrier: bool,
}

impl Radio {
    pub fn new(is_plus: bool, now: Instant) -> Self {
        let mut radio = Self {
            registers: Registers::new(is_plus),
            received: VecDeque::new(),
            outgoing: VecDeque::new(),
            broken: false,
            ready: now,
            crystal: None,
            enabled: false,
            raised: now,
            state: State::Idle,
            packet: 0,
            attempts: 0,
            heard: [None; 6],
            carrier: false,
        };
        radio.reset(now);
        radio
    }

    /// Power-on, or return of the supply.
    pub fn reset(&mut self, now: Instant) {
        self.registers = Registers::new(self.registers.is_plus);
        self.received.clear();
        self.outgoing.clear();
        (self.ready, self.crystal, self.state) = (now + POWER_ON, None, State::Idle);
        (self.heard, self.carrier) = ([None; 6], false);
    }

    /// True when the power-on reset is over.
    pub fn is_up(&self, now: Instant) -> bool {
        now >= self.ready
    }

    /// True if the configuration may be written (table 20, W_REGISTER).
    pub const fn is_idle(&self) -> bool {
        matches!(self.state, State::Idle)
    }

    pub fn channel(&self) -> u8 {
        self.registers.get(register::RF_CH) & 0x7F
    }

    pub fn rate(&self) -> AirRate {
        match self.registers.get(register::RF_SETUP) & 0x28 {
            0x20 => AirRate::Kbit250,
            0x08 => AirRate::Mbit2,
            _ => AirRate::Mbit1,
        }
    }

    /// True if it receives a packet that begins at this instant.
    pub fn listens(&self, at: Instant) -> bool {
        match self.state {
            State::Listening(from) => at >= from,
            State::Awaiting(from, until) => at >= from && at < until,
            _ => false,
        }
    }

    pub const fn notice_carrier(&mut self) {
        self.carrier = true;
    }

    pub const fn carrier(&self) -> bool {
        self.carrier
    }

    /// True if the interrupt pin is asserted (8.5). A flag in STATUS is masked by the bit at the
    /// same position in CONFIG.
    pub fn interrupts(&self) -> bool {
        self.registers.flags & !self.registers.get(register::CONFIG) & flag::ALL != 0
    }

    /// Changes CE.
    pub fn enable(&mut self, enabled: bool, now: Instant) {
        if enabled && !self.enabled {
            self.raised = now;
        }
        self.enabled = enabled;
        self.settle(now);
    }

    /// Updates the state after a change of settings, payloads or pins.
    pub fn settle(&mut self, now: Instant) {
        let powered = self.registers.get(register::CONFIG) & 2 != 0;
        if !powered {
            (self.crystal, self.state) = (None, State::Idle);
            return;
        }
        let crystal = *self.crystal.get_or_insert(now + POWER_UP);
        if now < crystal {
            return;
        }
        let receives = self.registers.get(register::CONFIG) & 1 != 0;
        match self.state {
            State::Idle if self.enabled && receives => {
                self.carrier = false;
                self.state = State::Listening(now + SETTLE);
            }
            State::Idle if self.enabled && !self.outgoing.is_empty() && self.registers.flags & flag::MAX_RT == 0 => {
                self.attempts = self.registers.get(register::SETUP_RETR) & 0x0F;
                self.packet = (self.packet + 1) & 3;
                self.state = State::Settling(now + SETTLE, None);
            }
            State::Listening(_) if !self.enabled => self.state = State::Idle,
            State::Settling(_, None) if !self.enabled && now.since(self.raised) < PULSE => self.state = State::Idle,
            _ => {}
        }
    }

    /// Instant of the next autonomous action.
    pub fn next_event(&self) -> Option<Instant> {
        match self.state {
            State::Idle => self.crystal.filter(|_| self.enabled && self.is_waiting_for_crystal()),
            State::Listening(_) => None,
            State::Settling(at, _) => Some(at),
            State::Sending(until, _) => until,
            State::Awaiting(_, until) => Some(until),
        }
    }

    /// True if an action is waiting for the crystal to start.
    fn is_waiting_for_crystal(&self) -> bool {
        let receives = self.registers.get(register::CONFIG) & 1 != 0;
        receives || !self.outgoing.is_empty() && self.registers.flags & flag::MAX_RT == 0
    }

    /// Performs the due action. Returns a transmission that begins.
    pub fn act(&mut self, at: Instant) -> Option<Emission> {
        match self.state {
            State::Settling(_, pipe) => self.begin(pipe, at),
            State::Sending(_, Some(_)) => {
                self.state = State::Listening(at + SETTLE);
                self.settle(at);
                None
            }
            State::Sending(_, None) => {
                if self.wants_acknowledgement() {
                    let delay = u64::from(self.registers.get(register::SETUP_RETR) >> 4) + 1;
                    self.state = State::Awaiting(at + SETTLE, at + Duration::from_micros(250) * delay);
                } else {
                    self.sent(at);
                }
                None
            }
            State::Awaiting(..) => match self.attempts.checked_sub(1) {
                Some(left) => {
                    self.attempts = left;
                    self.begin(None, at)
                }
                None => {
                    self.registers.flags |= flag::MAX_RT;
                    self.state = State::Idle;
                    None
                }
            },
            State::Idle | State::Listening(_) => {
                self.settle(at);
                None
            }
        }
    }

    /// Begins to send the first payload, unless it has been removed, or an acknowledgement.
    fn begin(&mut self, pipe: Option<u8>, at: Instant) -> Option<Emission> {
        let emission = self.emission(pipe);
        self.state = if emission.is_some() { State::Sending(None, pipe) } else { State::Idle };
        self.settle(at);
        emission
    }

    /// Sets the end of the transmission that has begun.
    pub fn send_until(&mut self, until: Instant) {
        if let State::Sending(end, _) = &mut self.state {
            *end = Some(until);
        }
    }

    /// The first payload has been sent and, if required, acknowledged.
    fn sent(&mut self, at: Instant) {
        self.outgoing.pop_front();
        self.registers.flags |= flag::TX_DS;
        self.state = State::Idle;
        self.settle(at);
        // The radio stays in transmit mode between two payloads (6.1.5), so it need not settle.
        if let State::Settling(begins, None) = &mut self.state {
            *begins = at;
        }
    }

    /// Enhanced ShockBurst is off when no pipe acknowledges and retransmission is off (7.10).
    fn is_enhanced(&self) -> bool {
        self.registers.get(register::EN_AA) != 0 || self.registers.get(register::SETUP_RETR) & 0x0F != 0
    }

    fn wants_acknowledgement(&self) -> bool {
        let first = self.outgoing.front();
        self.registers.get(register::EN_AA) & 1 != 0 && first.is_some_and(|payload| payload.wants_acknowledgement)
    }

    fn emission(&self, pipe: Option<u8>) -> Option<Emission> {
        let silent = Payload::default();
        let (address, payload) = match pipe {
            None => (self.registers.sends_to(), self.outgoing.front()?),
            Some(pipe) => (self.registers.address(pipe), &silent),
        };
        let length = payload.bytes.len() as u16;
        let plain = u16::from(!payload.wants_acknowledgement);
        let control = self.is_enhanced().then_some(length << 3 | self.packet << 1 | plain);
        let bits = Content { address: &address, control, payload: &payload.bytes, crc: self.crc() }.bits();
        let bits = if self.broken { Vec::new() } else { bits };
        Some(Emission { channel: self.channel(), rate: self.rate(), bits })
    }

    /// Length of the CRC, bytes. It cannot be switched off while a pipe acknowledges (9.1, CONFIG).
    fn crc(&self) -> u8 {
        let config = self.registers.get(register::CONFIG);
        let on = config & 8 != 0 || self.registers.get(register::EN_AA) != 0;
        u8::from(on) + u8::from(on && config & 4 != 0)
    }

    /// Receives a complete packet on its channel.
    pub fn hear(&mut self, bits: &[bool], at: Instant) {
        if self.broken {
            return;
        }
        let Some((pipe, width)) = self.pipe(bits) else { return };
        let enhanced = self.is_enhanced();
        let control = if enhanced { number(bits, width, CONTROL) } else { NO_ACKNOWLEDGEMENT };
        let body = width + if enhanced { CONTROL } else { 0 };
        let waits = matches!(self.state, State::Awaiting(..));
        let length = match self.registers.payload_width(pipe) {
            _ if waits => 0,
            None => usize::from(control >> 3),
            Some(0) => return,
            Some(width) => usize::from(width),
        };
        let (end, crc) = (body + 8 * length, self.crc());
        let Some(covered) = bits.get(..end) else { return };
        let sum = checksum(covered, crc);
        // After a packet that is too short, noise follows instead of the checksum.
        if bits.len() < end + 8 * usize::from(crc) || sum != number(bits, end, 8 * usize::from(crc)) || length > 32 {
            return;
        }
        if waits {
            self.sent(at);
            return;
        }
        let acknowledges = enhanced && self.registers.get(register::EN_AA) >> pipe & 1 != 0;
        // A repetition has the same packet number and checksum.
        let seen = (control >> 1 & 3, sum);
        let again = acknowledges && self.heard[usize::from(pipe)] == Some(seen);
        if !again {
            // No acknowledgement either: the sender repeats the packet.
            if self.received.len() == FIFO {
                return;
            }
            let payload = (0..length).map(|byte| number(bits, body + 8 * byte, 8) as u8).collect();
            self.received.push_back((pipe, payload));
            self.registers.flags |= flag::RX_DR;
            self.heard[usize::from(pipe)] = Some(seen);
        }
        if acknowledges && control & NO_ACKNOWLEDGEMENT == 0 {
            // The acknowledgement carries the number of the packet.
            self.packet = control >> 1 & 3;
            self.state = State::Settling(at + SETTLE, Some(pipe));
        }
    }

    /// The first enabled pipe with this address, and the length of the address in bits.
    fn pipe(&self, bits: &[bool]) -> Option<(u8, usize)> {
        let enabled = self.registers.get(register::EN_RXADDR);
        (0..6).filter(|pipe| enabled >> pipe & 1 != 0).find_map(|pipe| {
            let address = self.registers.address(pipe);
            let matches =
                address.iter().rev().enumerate().all(|(place, byte)| {
                    bits.len() >= 8 * (place + 1) && number(bits, 8 * place, 8) == u16::from(*byte)
                });
            (matches && !address.is_empty()).then_some((pipe, 8 * address.len()))
        })
    }
}
