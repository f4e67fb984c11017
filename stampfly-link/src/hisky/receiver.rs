//! A receiver: what the radio has to listen to, and when it has to listen to something else.
//!
//! After a packet it listens on the next channel, for 9.5 ms. When nothing comes there, it stays in step: it goes on to the next one, as the
//! transmitter does, so that a packet that is lost costs no other. After 21 of them it stays on one channel for a round, in case it was told of a packet
//! so late that it is out of step, and is in step again after it. After a second the transmitter is gone, and it searches, as it does at the
//! beginning: it goes on by as many channels as it has waited periods for: 1, 2, 4, 8, 16, and then 21 at a time. 21 periods are 199.5 ms, longer
//! than the transmitter takes to be everywhere once (180 ms), so on a clear channel it is heard, however far out of step.
//!
//! The public receiver searches from the first packet on that it misses. Where three packets of ten are lost, it hears 65 in a second instead of 78,
//! and where nine are lost, one instead of nine.

use super::bind::{HiskyBinding, HiskyLink};
use super::channels::HiskyChannels;
use super::{BIND_ADDRESS, BIND_CHANNEL, HOPS, PAYLOAD};
use crate::session::PairingRefused;
use stampfly_types::{Duration, Instant};

/// A frame is 9 ms. Half a millisecond more, for clocks that differ.
const PERIOD: Duration = Duration::from_micros(9_500);
/// What the transmitter takes for a frame.
const FRAME: Duration = Duration::from_millis(9);
/// Packets that may be missed in step: as long as the transmitter is not gone.
const IN_STEP: u8 = 111;
/// So many of them are waited for for a period, and the others for a frame. Then a packet comes in the middle of the time that its channel is
/// listened to, and a clock that is off by 0.4 %, as without a quartz, is still in step at the end of the second.
const TO_THE_MIDDLE: u8 = 8;
/// Packets that are missed before it stays on a channel, and before it does so again: one more than there are channels, so that it is another one.
const STEPS: u8 = HOPS as u8 + 1;
/// In these it waits for a packet, and then for a round.
const STAY: u8 = 1 + HOPS as u8;
/// Periods in which the transmitter is on every channel once.
const ROUND: u8 = 21;
/// After so long without a packet the transmitter is gone.
const OFFLINE: Duration = Duration::from_secs(1);

/// What the radio has to listen to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HiskyTuning {
    /// 2400 MHz and so many.
    pub channel: u8,
    /// In the order of the radio's register.
    pub address: [u8; 5],
}

/// What was heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HiskyEvent {
    /// A part of binding, or what is none.
    Nothing,
    /// A transmitter: store it. It is followed from now on.
    Bound(HiskyLink),
    /// Sticks and switches.
    Channels(HiskyChannels),
}

/// A receiver. Ask after every call what the radio has to [listen to](Self::tuning).
///
/// It does not give up its transmitter with motors armed, of which [`set_armed`](Self::set_armed) tells it. See [`hisky`](super) for an example.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HiskyReceiver {
    link: Option<HiskyLink>,
    binding: Option<HiskyBinding>,
    armed: bool,
    /// The channel that is listened to.
    hop: u8,
    /// Packets that were missed in step.
    missed: u8,
    /// Periods that it is listened to; zero after a packet.
    wait: u8,
    /// Until when.
    due: Instant,
    heard: Option<Instant>,
    packets: u32,
}

impl HiskyReceiver {
    /// A receiver at power-on. Without a transmitter it binds.
    #[must_use]
    pub fn new(link: Option<HiskyLink>, now: Instant) -> Self {
        let binding = if link.is_none() { Some(HiskyBinding::default()) } else { None };
        Self { link, binding, armed: false, hop: 0, missed: 0, wait: 0, due: now + PERIOD, heard: None, packets: 0 }
    }

    /// Says whether the motors may turn. Who binds when that begins goes back to the present transmitter.
    pub fn set_armed(&mut self, armed: bool) {
        self.armed = armed;
        if armed {
            self.stop_binding();
        }
    }

    /// Listens for a transmitter that binds, and no more to the present one.
    ///
    /// # Errors
    /// With motors armed; nothing has changed then.
    pub fn start_binding(&mut self) -> Result<(), PairingRefused> {
        if self.armed {
            return Err(PairingRefused);
        }
        self.binding = Some(HiskyBinding::default());
        Ok(())
    }

    /// Goes back to the present transmitter. Without one, it goes on binding.
    pub fn stop_binding(&mut self) {
        if self.link.is_some() {
            self.binding = None;
        }
    }

    /// Is it listening for a transmitter that binds?
    #[must_use]
    pub const fn is_binding(&self) -> bool {
        self.binding.is_some()
    }

    /// The transmitter that it follows.
    #[must_use]
    pub const fn link(&self) -> Option<HiskyLink> {
        self.link
    }

    /// What the radio has to listen to now.
    #[must_use]
    pub fn tuning(&self) -> HiskyTuning {
        let followed = self.link.as_ref().filter(|_| self.binding.is_none());
        followed.map_or(HiskyTuning { channel: BIND_CHANNEL, address: BIND_ADDRESS }, |link| HiskyTuning {
            channel: link.hops.get(usize::from(self.hop)).copied().unwrap_or_default(),
            address: link.address,
        })
    }

    /// When to [`poll`](Self::poll) next. Never while it binds.
    #[must_use]
    pub fn due(&self) -> Option<Instant> {
        if self.binding.is_some() { None } else { Some(self.due) }
    }

    /// Goes on to another channel when it is time.
    pub fn poll(&mut self, now: Instant) {
        if self.binding.is_some() {
            return;
        }
        while now >= self.due && self.missed < IN_STEP && self.heard.is_some() {
            self.turn(1);
            let frames = if self.missed % (HOPS as u8 + STEPS) == STEPS - 1 { STAY } else { 1 };
            self.due += if self.missed < TO_THE_MIDDLE { PERIOD } else { FRAME * u64::from(frames) };
            self.missed += frames;
        }
        if now < self.due {
            return;
        }
        self.wait = self.wait.saturating_mul(2).clamp(1, ROUND);
        self.turn(self.wait);
        let stay = PERIOD * u64::from(self.wait);
        let planned = self.due + stay;
        // From the plan, unless that is over as well.
        self.due = if planned > now { planned } else { now + stay };
    }

    const fn turn(&mut self, hops: u8) {
        self.hop = (self.hop + hops) % HOPS as u8;
    }

    /// Takes what the radio has heard, `at` the instant it came in.
    pub fn receive(&mut self, at: Instant, packet: &[u8; PAYLOAD]) -> HiskyEvent {
        if let Some(binding) = &mut self.binding {
            // Armed, and without a transmitter: it is too late for one.
            let bound = if self.armed { None } else { binding.take(packet) };
            let Some(link) = bound else { return HiskyEvent::Nothing };
            let (armed, packets) = (self.armed, self.packets);
            *self = Self { armed, packets, ..Self::new(Some(link), at) };
            return HiskyEvent::Bound(link);
        }
        (self.heard, self.missed, self.wait, self.due) = (Some(at), 0, 0, at + PERIOD);
        self.packets = self.packets.wrapping_add(1);
        self.turn(1);
        HiskyEvent::Channels(HiskyChannels::decode(packet))
    }

    /// Has the transmitter been silent for a second, or was it never heard? Then the last channels are not what the pilot wants. A channel that
    /// is made zero is full deflection, and no substitute.
    #[must_use]
    pub fn is_offline(&self, now: Instant) -> bool {
        self.heard.is_none_or(|heard| now.since(heard) >= OFFLINE)
    }

    /// Packets of sticks so far; 111 in a second when none is lost. Wraps around.
    #[must_use]
    pub const fn packets(&self) -> u32 {
        self.packets
    }
}
