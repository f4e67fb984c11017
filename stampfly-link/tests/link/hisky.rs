//! HiSKY: frames of public implementations bit for bit, and a receiver that follows a transmitter through loss, jamming and being out of step.

use crate::hex::hex;
use proptest::prelude::*;
use serde_json::Value;
use stampfly_link::hisky::{
    BIND_ADDRESS, BIND_CHANNEL, HOPS, HiskyBinding, HiskyChannels, HiskyEvent, HiskyLink, HiskyReceiver, HiskyTuning,
};
use stampfly_types::{Duration, Instant};

fn vectors() -> Value {
    serde_json::from_str(include_str!("../vectors/hisky.json")).expect("well-formed")
}

fn list(value: &Value) -> &Vec<Value> {
    value.as_array().expect("a list")
}

fn bytes<const N: usize>(value: &Value) -> [u8; N] {
    hex(value).try_into().expect("so many bytes")
}

fn numbers<const N: usize>(value: &Value) -> [u16; N] {
    let numbers: Vec<u16> = list(value).iter().map(|number| number.as_u64().expect("a number") as u16).collect();
    numbers.try_into().expect("so many numbers")
}

/// A public transmitter's own way from its id to its address and channels; the protocol leaves it open.
fn transmitter(id: u32) -> HiskyLink {
    let [a, b, c, d] = id.to_be_bytes();
    let mut random = id;
    let mut hops: Vec<u8> = Vec::new();
    while hops.len() < HOPS {
        random = random.wrapping_mul(0x19660D).wrapping_add(0x3C6EF35F);
        let next = ((random >> 8) % 73 + 2) as u8;
        let band = |hop: u8| (hop > 26) as u8 + (hop > 50) as u8;
        let near = hops.last().is_some_and(|last| last.abs_diff(next) < 5);
        let crowded = hops.iter().filter(|hop| band(**hop) == band(next)).count() >= 8;
        if !near && !crowded && !hops.contains(&next) {
            hops.push(next);
        }
    }
    HiskyLink { address: [a, b, c, d, c & 0xF0 | d & 0x0F], hops: hops.try_into().expect("twenty") }
}

#[test]
fn bind_packets_are_those_of_public_transmitters() {
    let vectors = vectors();
    assert_eq!(u64::from(BIND_CHANNEL), vectors["radio"]["bind_channel"].as_u64().expect("a channel"));
    assert_eq!(BIND_ADDRESS, bytes(&vectors["radio"]["bind_address"]));
    assert_eq!(list(&vectors["cases"]).len(), 3);
    for case in list(&vectors["cases"]) {
        let hops: [u16; HOPS] = numbers(&case["hops"]);
        let link = HiskyLink { address: bytes(&case["address"]), hops: hops.map(|hop| hop as u8) };
        assert_eq!(transmitter(u32::from_be_bytes(bytes(&case["id"]))), link, "the test's own transmitter");
        let packets = list(&case["bind_packets"]);
        assert_eq!(link.bind_packets().to_vec(), packets.iter().map(bytes).collect::<Vec<[u8; 10]>>());
        let mut binding = HiskyBinding::default();
        let heard: Vec<_> = packets.iter().map(|packet| binding.take(&bytes(packet))).collect();
        assert_eq!(heard, [None, None, None, Some(link)]);
    }
}

#[test]
fn data_packets_are_those_of_public_implementations() {
    let vectors = vectors();
    assert_eq!(list(&vectors["packets"]).len(), 7);
    for packet in list(&vectors["packets"]) {
        let channels = HiskyChannels(numbers(&packet["wire"]));
        assert_eq!(channels.to_bytes(), bytes(&packet["payload"]));
        assert_eq!(HiskyChannels::decode(&bytes(&packet["payload"])), channels);
        let values = list(&packet["reference_receiver_values_rpyt_aux"]);
        let values: Vec<f32> = values.iter().map(|value| value.as_f64().expect("a number") as f32).collect();
        assert_eq!(channels.values().to_vec(), values, "{packet}");
    }
    assert_eq!(HiskyChannels::decode(&[0xFF; 10]).0, [1000; 8]);
    assert_eq!(HiskyChannels([u16::MAX; 8]).to_bytes(), HiskyChannels([1000; 8]).to_bytes());
    assert_eq!(HiskyChannels([u16::MAX; 8]).values()[1], 0.0);
}

#[test]
fn a_receiver_that_hears_nothing_waits_longer_and_longer() {
    let link = HiskyLink { address: [7; 5], hops: core::array::from_fn(|hop| 40 + hop as u8) };
    let mut receiver = HiskyReceiver::new(Some(link), Instant::ZERO);
    assert_eq!(receiver.tuning(), HiskyTuning { channel: 40, address: [7; 5] });
    for step in list(&vectors()["rx_backoff_from_hop0"]) {
        let due = receiver.due().expect("it follows");
        receiver.poll(due - Duration::from_micros(1));
        assert_eq!(receiver.due(), Some(due));
        receiver.poll(due);
        let hop = u64::from(receiver.tuning().channel - 40);
        let dwell = receiver.due().expect("it follows").since(due).as_micros() as f64 / 1e3;
        assert_eq!((Some(hop), Some(dwell)), (step["hop"].as_u64(), step["dwell_ms"].as_f64()), "{step}");
    }
    // Nobody asked for an hour: it does not catch up.
    receiver.poll(Instant::from_secs(3_600));
    assert!(receiver.due() > Some(Instant::from_secs(3_600)));
}

#[test]
fn binding_wants_the_right_order_and_sum() {
    let (link, other) = (transmitter(0x1234_5678), transmitter(0xDEAD_BEEF));
    let [first, second, third, fourth] = link.bind_packets();
    let bound = |packets: &[[u8; 10]]| {
        let mut binding = HiskyBinding::default();
        packets.iter().find_map(|packet| binding.take(packet))
    };
    let right = [first, second, third, fourth];
    for order in 0..256 {
        let order = [order & 3, order >> 2 & 3, order >> 4 & 3, order >> 6].map(|index| right[index]);
        assert_eq!(bound(&order).is_some(), order == right);
    }
    // What is lost comes again; the first packet, too.
    assert_eq!(bound(&[first, second, fourth, first, second, third, first, second, fourth]), Some(link));
    for bit in 0..24 {
        for place in 1..4 {
            let mut packets = right;
            packets[place][bit / 8] ^= 1 << (bit % 8);
            assert_eq!(bound(&packets), None, "bit {bit} of packet {place}");
        }
    }
    let mut impossible = third;
    impossible[5] = 126;
    assert_eq!(bound(&[first, second, impossible, fourth]), None, "a channel that the radio has not");
    assert_eq!(bound(&[first, second, impossible, third, fourth]), Some(link));
    // Two at once: the one that began last.
    let [a, b, c, d] = other.bind_packets();
    assert_eq!(bound(&[first, a, second, b, third, c, fourth, d]), Some(other));
    // One that has gone away in the middle does not keep others out.
    assert_eq!(bound(&[first, second, a, b, third, c, d]), Some(other));
}

#[test]
fn an_armed_vehicle_keeps_its_transmitter() {
    let (link, other) = (transmitter(1), transmitter(2));
    let mut receiver = HiskyReceiver::new(Some(link), Instant::ZERO);
    receiver.set_armed(true);
    assert!(receiver.start_binding().is_err() && !receiver.is_binding());
    receiver.set_armed(false);
    receiver.start_binding().expect("disarmed");
    assert_eq!((receiver.tuning().channel, receiver.due()), (BIND_CHANNEL, None));
    for packet in &other.bind_packets()[..3] {
        assert_eq!(receiver.receive(Instant::ZERO, packet), HiskyEvent::Nothing);
    }
    receiver.set_armed(true);
    assert_eq!((receiver.is_binding(), receiver.tuning().address), (false, link.address), "back to the present one");
    // Without a transmitter, an armed vehicle does not take one.
    let mut receiver = HiskyReceiver::new(None, Instant::ZERO);
    receiver.set_armed(true);
    let heard = other.bind_packets().map(|packet| receiver.receive(Instant::ZERO, &packet));
    assert_eq!((heard, receiver.link()), ([HiskyEvent::Nothing; 4], None));
    receiver.set_armed(false);
    let heard = other.bind_packets().map(|packet| receiver.receive(Instant::ZERO, &packet));
    assert_eq!(heard[3], HiskyEvent::Bound(other));
}

/// A transmitter and a receiver, each with a clock of its own, and what is between them.
struct Air {
    link: HiskyLink,
    receiver: HiskyReceiver,
    /// When the transmitter's frames began, µs.
    phase: u64,
    /// Its hop in its first frame.
    start: usize,
    random: u64,
    /// Lost of a thousand.
    lost: u64,
    jammed: Option<u8>,
    now: u64,
    /// Data packets that were sent and not lost, and those that were heard.
    sent: u32,
    heard: Vec<u64>,
}

impl Air {
    fn new(id: u32, receiver: HiskyReceiver, phase: u64, start: usize, seed: u64) -> Self {
        let link = transmitter(id);
        Self {
            link,
            receiver,
            phase,
            start,
            random: seed | 1,
            lost: 0,
            jammed: None,
            now: 0,
            sent: 0,
            heard: Vec::new(),
        }
    }

    fn is_lost(&mut self) -> bool {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 20) % 1_000 < self.lost
    }

    /// Time passes in steps of 0.1 ms, in which one packet is sent at most. A transmitter that binds sends in both places of its frame.
    fn run(&mut self, millis: u64, binds: bool) {
        for _ in 0..millis * 10 {
            self.now += 100;
            let now = Instant::from_micros(self.now);
            self.receiver.poll(now);
            let Some(since) = self.now.checked_sub(self.phase) else { continue };
            let (frame, within) = ((since / 9_000) as usize, since % 9_000);
            let hop = self.link.hops[(self.start + frame) % HOPS];
            let channels = HiskyChannels(core::array::from_fn(|place| (frame * 37 + place * 101) as u16 % 1_001));
            let (tuning, packet) = match within {
                2_000 if binds => {
                    let tuning = HiskyTuning { channel: BIND_CHANNEL, address: BIND_ADDRESS };
                    (tuning, self.link.bind_packets()[frame % 4])
                }
                8_000 => (HiskyTuning { channel: hop, address: self.link.address }, channels.to_bytes()),
                _ => continue,
            };
            if self.is_lost() || self.jammed == Some(tuning.channel) {
                continue;
            }
            self.sent += u32::from(within == 8_000);
            if self.receiver.tuning() != tuning {
                continue;
            }
            match self.receiver.receive(now, &packet) {
                HiskyEvent::Channels(heard) => {
                    assert_eq!(heard, channels, "what was sent");
                    self.heard.push(self.now);
                }
                HiskyEvent::Bound(link) => assert_eq!(link, self.link),
                HiskyEvent::Nothing => {}
                other => panic!("{other:?}"),
            }
        }
    }

    /// Share of packets that were in the air and were heard, from now for some time.
    fn share(&mut self, millis: u64) -> f64 {
        (self.sent, self.heard) = (0, Vec::new());
        self.run(millis, false);
        self.heard.len() as f64 / f64::from(self.sent)
    }

    fn is_offline(&self) -> bool {
        self.receiver.is_offline(Instant::from_micros(self.now))
    }
}

#[test]
fn without_loss_every_packet_is_heard() {
    let link = transmitter(0x1234_5678);
    let mut air = Air::new(0x1234_5678, HiskyReceiver::new(Some(link), Instant::ZERO), 0, 0, 1);
    assert!(air.is_offline());
    air.run(1_000, false);
    let packets = air.receiver.packets();
    assert_eq!(air.share(1_000), 1.0);
    assert!((110..=112).contains(&(air.receiver.packets() - packets)), "{}", air.receiver.packets() - packets);
    assert!(!air.is_offline());
    // Silence: offline after a second, and no sooner.
    let last = *air.heard.last().expect("some");
    air.lost = 1_000;
    air.run(990 - (air.now - last) / 1_000, false);
    assert!(!air.is_offline());
    air.run(11, false);
    assert!(air.is_offline());
}

#[test]
fn a_jammed_channel_costs_its_own_packets() {
    let link = transmitter(0xDEAD_BEEF);
    for jammed in link.hops {
        let mut air = Air::new(0xDEAD_BEEF, HiskyReceiver::new(Some(link), Instant::ZERO), 0, 0, 1);
        air.jammed = Some(jammed);
        air.run(1_000, false);
        assert_eq!(air.share(1_800), 1.0, "all that was not jammed");
        assert_eq!(air.heard.len(), 190, "19 of 20");
    }
}

/// Share of packets that are heard of those that are not lost, the worst of fifty flights, and that nothing of it lasts.
fn worst_share(lost: u64, millis: u64) -> f64 {
    let flights = (1..=50_u64).map(|seed| {
        let id = (seed as u32).wrapping_mul(0x9E37_79B9);
        let receiver = HiskyReceiver::new(Some(transmitter(id)), Instant::ZERO);
        let mut air = Air::new(id, receiver, 0, seed as usize % HOPS, seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        air.run(1_000, false);
        air.lost = lost;
        let share = air.share(millis);
        air.lost = 0;
        air.run(500, false);
        assert!(!air.is_offline(), "seed {seed}");
        assert_eq!(air.share(1_000), 1.0, "seed {seed}");
        share
    });
    flights.fold(1.0, f64::min)
}

#[test]
fn what_three_of_ten_or_nine_of_ten_lost_cost_and_that_it_is_over_with_them() {
    let (three, nine) = (worst_share(300, 10_000), worst_share(900, 60_000));
    // It stays in step, but for a round after 21 in a row: 1.0 and 0.74 were measured.
    assert!(three > 0.99 && nine > 0.65, "{three} {nine}");
}

#[test]
fn a_receiver_that_was_told_too_late_is_in_step_again_in_half_a_second() {
    let link = transmitter(0x1234_5678);
    for late in [1, 5, 9, 12, 40, 300] {
        let mut air = Air::new(0x1234_5678, HiskyReceiver::new(Some(link), Instant::ZERO), 0, 0, 1);
        air.run(1_000, false);
        // Nobody looked after it for a while, and then a packet is handed over that came at the beginning.
        let packet = HiskyChannels([500; 8]).to_bytes();
        let at = Instant::from_micros(air.now + late * 1_000);
        assert_eq!(air.receiver.receive(at, &packet), HiskyEvent::Channels(HiskyChannels([500; 8])));
        air.run(late, false);
        let before = air.heard.len();
        air.run(500, false);
        assert!(air.heard.len() > before, "{late} ms late");
        air.run(50, false);
        assert_eq!(air.share(1_000), 1.0, "{late} ms late");
    }
}

proptest! {
    /// However far out of step both were switched on.
    #[test]
    fn out_of_step_it_is_found_in_less_than_a_second(id: u32, phase in 0u64..500_000, start in 0..HOPS) {
        let phase = phase / 100 * 100;
        let mut air = Air::new(id, HiskyReceiver::new(Some(transmitter(id)), Instant::ZERO), phase, start, 1);
        air.run(phase / 1_000 + 800, false);
        prop_assert!(!air.heard.is_empty(), "found");
        prop_assert_eq!(air.share(1_000), 1.0);
    }

    /// A transmitter binds for 9 s.
    #[test]
    fn it_binds_through_loss(id: u32, phase in 0u64..36_000, seed: u64, lost in prop::sample::select(&[0, 300, 900][..])) {
        let mut air = Air::new(id, HiskyReceiver::new(None, Instant::ZERO), phase / 100 * 100, 0, seed);
        air.lost = lost;
        air.run(9_000, true);
        prop_assert_eq!(air.receiver.link(), Some(transmitter(id)));
    }

    #[test]
    fn channels_round_trip(channels in prop::array::uniform8(0u16..=1_000)) {
        prop_assert_eq!(HiskyChannels::decode(&HiskyChannels(channels).to_bytes()), HiskyChannels(channels));
    }

    #[test]
    fn links_round_trip(address: [u8; 5], hops in prop::array::uniform20(0u8..=125)) {
        let link = HiskyLink { address, hops };
        let mut binding = HiskyBinding::default();
        let heard = link.bind_packets().map(|packet| binding.take(&packet));
        prop_assert_eq!(heard, [None, None, None, Some(link)]);
    }

    #[test]
    fn garbage_binds_nobody(packets in prop::collection::vec(prop::array::uniform10(any::<u8>()), 0..200)) {
        let mut binding = HiskyBinding::default();
        for packet in packets {
            prop_assert_eq!(binding.take(&packet), None);
        }
    }
}
