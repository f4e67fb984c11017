//! A HiSKY transmitter, implemented from public transmitters and independent of the code of this
//! project: 9 phases of 1 ms, a mapping from an id to address and channels, bind packets, sticks.

use stampfly_sim::chips::{Air, AirPacket, AirRate};
use stampfly_sim::time::Clock;
use stampfly_types::{Duration, Instant};
use std::cell::Cell;
use std::rc::Rc;

const PHASE: Duration = Duration::from_millis(1);
const BIND: [u8; 5] = [0x12, 0x23, 0x23, 0x45, 0x78];

/// Identity of a transmitter: address and channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    pub address: [u8; 5],
    pub hops: [u8; 20],
}

impl Identity {
    /// The identity that one public transmitter derives from its id.
    pub fn of(id: u32) -> Self {
        let [a, b, c, d] = id.to_be_bytes();
        let mut hops = Vec::<u8>::new();
        let mut random = id;
        while hops.len() < 20 {
            random = random.wrapping_mul(0x0019_660D).wrapping_add(0x3C6E_F35F);
            let next = u8::try_from((random >> 8) % 73 + 2).expect("small");
            let band = |hop: u8| match hop {
                ..=26 => 0,
                27..=50 => 1,
                _ => 2,
            };
            let far = hops.last().is_none_or(|last| last.abs_diff(next) >= 5);
            let room = hops.iter().filter(|hop| band(**hop) == band(next)).count() < 8;
            if far && room && !hops.contains(&next) {
                hops.push(next);
            }
        }
        Self { address: [a, b, c, d, c & 0xF0 | d & 0x0F], hops: hops.try_into().expect("twenty") }
    }

    /// One of the four packets with which it binds.
    pub fn bind_packet(&self, number: usize) -> [u8; 10] {
        let sum = self.address.iter().map(|byte| u16::from(*byte)).sum::<u16>();
        let mut packet = [0; 10];
        if number == 0 {
            packet[..3].copy_from_slice(&[0xFF, 0xAA, 0x55]);
            packet[3..8].copy_from_slice(&self.address);
        } else {
            packet[..2].copy_from_slice(&sum.to_le_bytes());
            packet[2] = number as u8 - 1;
            let from = 7 * (number - 1);
            let hops = &self.hops[from..(from + 7).min(20)];
            packet[3..3 + hops.len()].copy_from_slice(hops);
        }
        packet
    }
}

/// A stick packet in the format of the air link.
pub fn sticks_packet(sticks: [u16; 8]) -> [u8; 10] {
    let mut packet = [0; 10];
    for (place, stick) in sticks.into_iter().enumerate() {
        packet[place] = (stick & 0xFF) as u8;
        packet[8 + place / 4] |= ((stick >> 8) as u8) << (2 * (place % 4));
    }
    packet
}

/// Stick positions of a frame, different from those of the adjacent frames.
pub fn sticks(frame: u32) -> [u16; 8] {
    core::array::from_fn(|place| ((u64::from(frame) * 37 + place as u64 * 101) % 1_001) as u16)
}

/// State that a test changes during a run. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct Knobs {
    /// Number of remaining bind packets.
    pub binds: Rc<Cell<u32>>,
    /// The transmitter is switched off.
    pub silent: Rc<Cell<bool>>,
    /// Order of the bind packets.
    pub order: Rc<Cell<[usize; 4]>>,
    /// Corrupts a byte of the checksum in the bind packets.
    pub wrong_sum: Rc<Cell<bool>>,
    /// Number of frames so far.
    pub frames: Rc<Cell<u32>>,
    /// Start of the last stick packet.
    pub last_sent: Rc<Cell<Instant>>,
    /// Error of its clock, parts per million.
    pub drift: Rc<Cell<i64>>,
}

/// Runs the transmitter from an instant on. Phase 3: a bind packet, while it binds. Phase 6: change
/// to the channel and address of the sticks. Phase 9: a stick packet.
pub async fn transmit(clock: Clock, air: Air, identity: Identity, from: Instant, knobs: Knobs) {
    if knobs.order.get() == [0; 4] {
        knobs.order.set([0, 1, 2, 3]);
    }
    clock.sleep_until(from).await;
    let mut hop = 0;
    let mut bind = 0;
    let mut frame_begins = from;
    loop {
        let frame = knobs.frames.get();
        let long = |phases: u64| {
            let micros = PHASE.as_micros() * phases;
            let off = (micros as i64 * knobs.drift.get()) / 1_000_000;
            Duration::from_micros(micros.wrapping_add_signed(off))
        };
        clock.sleep_until(frame_begins + long(3)).await;
        if knobs.binds.get() > 0 && !knobs.silent.get() {
            knobs.binds.set(knobs.binds.get() - 1);
            let mut payload = identity.bind_packet(knobs.order.get()[bind % 4]);
            if knobs.wrong_sum.get() && payload[0] != 0xFF {
                payload[0] ^= 1;
            }
            bind += 1;
            air.send(&AirPacket { channel: 81, rate: AirRate::Mbit1, address: &BIND, payload: &payload, crc: 2 });
        }
        frame_begins += long(9);
        clock.sleep_until(frame_begins).await;
        if !knobs.silent.get() {
            let payload = sticks_packet(sticks(frame));
            knobs.last_sent.set(clock.now());
            let channel = identity.hops[hop];
            air.send(&AirPacket {
                channel,
                rate: AirRate::Mbit1,
                address: &identity.address,
                payload: &payload,
                crc: 2,
            });
        }
        hop = (hop + 1) % 20;
        knobs.frames.set(frame + 1);
    }
}
