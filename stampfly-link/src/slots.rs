//! Slots: several transmitters share a channel by sending in turn. For a transmitter; a vehicle takes what comes.
//!
//! A frame is 20 ms: ten slots of 2 ms, one for each transmitter, which sends one packet in it. Number 0 is the master. It sends a beacon, two
//! bytes to everybody, 0.5 ms before its own slot; the others count from when they hear it. The beacon of the next frame lies in the last
//! half millisecond of slot 9.
//!
//! Who has not heard a beacon for 200 ms goes on in the slot that it had by its own clock, and says so: a collision costs a packet, silence a
//! flight. From the ecosystem's transmitter (`firmware/controller/components/espnow_tdma`), whose beacon authenticates nobody either: that a
//! stranger's beacons silence a transmitter is prevented here.

use stampfly_types::{Duration, Instant};

const BEACON: [u8; 2] = [0xBE, 0xAC];
const SLOTS: u8 = 10;
const SLOT: Duration = Duration::from_millis(2);
const FRAME: Duration = Duration::from_millis(20);
/// From the beacon to the first slot.
const ADVANCE: Duration = Duration::from_micros(500);
/// A beacon that was heard longer ago is lost.
const LOST: Duration = Duration::from_millis(200);

/// The master's beacon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotBeacon;

impl SlotBeacon {
    /// Length on the air.
    pub const LENGTH: usize = BEACON.len();

    /// Reads it: `None` when it is none.
    ///
    /// ```
    /// use stampfly_link::SlotBeacon;
    /// assert_eq!(SlotBeacon::decode(&[0xBE, 0xAC]), Some(SlotBeacon));
    /// assert_eq!(SlotBeacon::decode(&[0xBE, 0xAC, 0]), None);
    /// ```
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        (bytes == BEACON).then_some(Self)
    }

    /// Writes it.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; Self::LENGTH] {
        BEACON
    }
}

/// What is to be sent now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SlotTurn {
    /// The [`SlotBeacon`], to everybody.
    Beacon,
    /// The packet of this transmitter, to its vehicle.
    Packet,
}

/// When a transmitter sends.
///
/// ```
/// use stampfly_link::{SlotBeacon, SlotTurn, Slots};
/// use stampfly_types::{Duration, Instant};
/// let mut slots = Slots::new(3, Instant::ZERO).expect("one of ten");
/// let heard = Instant::from_millis(35);
/// slots.heard(heard, SlotBeacon);
/// // Half a millisecond, and three slots.
/// assert_eq!(slots.due(), heard + Duration::from_micros(6_500));
/// assert_eq!(slots.poll(Instant::from_millis(41)), None);
/// assert_eq!(slots.poll(slots.due()), Some(SlotTurn::Packet));
/// assert!(!slots.is_lost(Instant::from_millis(200)) && slots.is_lost(Instant::from_millis(235)));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slots {
    number: u8,
    /// When the packet is due.
    packet: Instant,
    /// When the packet was last due and the slot was used.
    used: Instant,
    /// The master's: when the beacon is due.
    beacon: Instant,
    /// When a beacon was heard last.
    heard: Option<Instant>,
}

impl Slots {
    /// How many transmitters fit.
    pub const COUNT: u8 = SLOTS;

    /// The transmitter with this slot, 0 to 9, begins a frame now. `None` for a slot there is none of.
    #[must_use]
    pub fn new(number: u8, now: Instant) -> Option<Self> {
        let slots = Self { number, packet: now, used: now, beacon: now, heard: None };
        (number < SLOTS).then(|| Self { packet: slots.begins(now), ..slots })
    }

    /// When the slot begins in the frame of this beacon.
    fn begins(&self, beacon: Instant) -> Instant {
        beacon + ADVANCE + SLOT * u64::from(self.number)
    }

    /// Does this transmitter send the beacon?
    #[must_use]
    pub const fn is_master(&self) -> bool {
        self.number == 0
    }

    /// A beacon was heard. The master, which sends its own, does nothing about it.
    ///
    /// However many come, at least one packet is due in two frames, and no two in half of one.
    pub fn heard(&mut self, at: Instant, _: SlotBeacon) {
        if self.is_master() {
            return;
        }
        self.heard = Some(at);
        let this = self.begins(at);
        // The slot of this frame may have been used already, by what was known before.
        let next = if this.since(self.used) < FRAME / 2 { this + FRAME } else { this };
        if self.packet <= at || next.since(self.used) <= FRAME * 2 {
            self.packet = next;
        }
    }

    /// What is to be sent now; ask again until there is nothing. A slot that was missed is not made up for.
    pub fn poll(&mut self, now: Instant) -> Option<SlotTurn> {
        if self.is_master() && now >= self.beacon {
            // From now, because the others count from when they hear it.
            (self.packet, self.beacon) = (self.begins(now), now + FRAME);
            return Some(SlotTurn::Beacon);
        }
        if now < self.packet {
            return None;
        }
        let late = now.since(self.packet).as_micros();
        let begun = self.packet + FRAME * (late / FRAME.as_micros());
        self.packet = begun + FRAME;
        self.used = begun;
        (now.since(begun) < SLOT).then_some(SlotTurn::Packet)
    }

    /// When there is something to be sent next.
    #[must_use]
    pub fn due(&self) -> Instant {
        if self.is_master() { self.packet.min(self.beacon) } else { self.packet }
    }

    /// Has the beacon been silent for 200 ms, or was it never heard? Then nobody knows whose slot this is. The master is never lost.
    #[must_use]
    pub fn is_lost(&self, now: Instant) -> bool {
        !self.is_master() && self.heard.is_none_or(|heard| now.since(heard) >= LOST)
    }
}
