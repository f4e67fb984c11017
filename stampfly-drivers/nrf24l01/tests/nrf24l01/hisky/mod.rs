//! HiSKY end to end: an independent transmitter, the air, an emulated radio, its driver, and the
//! receiver of the protocol.

mod receiver;
mod transmitter;

use receiver::Link;
use serde_json::Value;
use stampfly_link::hisky::HiskyChannels;
use stampfly_types::{Duration, Instant};
use transmitter::{Identity, sticks, sticks_packet};

const ID: u32 = 0x1234_5678;
/// Time after power-on, start and the longest search, ms.
const SETTLED: u64 = 1_000;

fn vectors() -> Value {
    serde_json::from_str(include_str!("../../../../../stampfly-link/tests/vectors/hisky.json")).expect("well-formed")
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn the_transmitter_is_a_public_one_byte_for_byte() {
    let vectors = vectors();
    for case in vectors["cases"].as_array().expect("cases") {
        let id = u32::from_str_radix(case["id"].as_str().expect("hex"), 16).expect("a number");
        let identity = Identity::of(id);
        assert_eq!(hex(&identity.address), case["address"].as_str().expect("hex"));
        let hops: Vec<u64> = identity.hops.iter().map(|hop| u64::from(*hop)).collect();
        let expected: Vec<u64> = case["hops"].as_array().expect("hops").iter().filter_map(Value::as_u64).collect();
        assert_eq!(hops, expected);
        for (number, packet) in case["bind_packets"].as_array().expect("packets").iter().enumerate() {
            assert_eq!(hex(&identity.bind_packet(number)), packet.as_str().expect("hex"));
        }
    }
    for packet in vectors["packets"].as_array().expect("packets") {
        let wire: Vec<u16> =
            packet["wire"].as_array().expect("sticks").iter().filter_map(Value::as_u64).map(|n| n as u16).collect();
        let payload = sticks_packet(wire.try_into().expect("eight"));
        assert_eq!(hex(&payload), packet["payload"].as_str().expect("hex"));
    }
}

#[test]
fn without_loss_every_packet_arrives_as_it_was_sent_111_times_a_second() {
    for wired in [false, true] {
        let mut link = Link::new(ID, true, Instant::from_millis(50), 1, wired);
        link.run(SETTLED);
        let (before, frames) = (link.heard(), link.knobs.frames.get());
        link.run(10_000);
        let packets = link.heard() - before;
        println!("{} packets in 10 s, interrupt wired: {wired}", packets);
        assert!(packets as u32 == link.knobs.frames.get() - frames && (1_110..=1_112).contains(&packets), "{packets}");
        let hisky = link.hisky.borrow();
        for (number, (_, channels)) in hisky.heard[before..].iter().enumerate() {
            assert_eq!(*channels, HiskyChannels(sticks(frames + number as u32)));
        }
        let gaps = hisky.heard[before..].windows(2).map(|pair| pair[1].0.since(pair[0].0).as_micros());
        let (least, most) = gaps.fold((u64::MAX, 0), |(least, most), gap| (least.min(gap), most.max(gap)));
        println!("{least} to {most} µs from one to the next");
        assert!(least >= 8_890 && most <= 9_110, "by the poll, of 100 µs");
        assert_eq!(hisky.errors, 0);
    }
}

/// Freshness of the packets for a control loop at 50 Hz: shares of the 20 ms steps at which the
/// newest packet is younger than a limit.
struct Freshness {
    in_20_ms: f64,
    in_40_ms: f64,
    per_second: f64,
    longest: Duration,
}

fn freshness(link: &mut Link, seconds: u64) -> Freshness {
    let mut fresh = [0_u32; 2];
    let mut longest = Duration::ZERO;
    let before = link.heard();
    let frames = seconds * 50;
    for _ in 0..frames {
        link.run(20);
        let now = link.clock.now();
        let age = link.hisky.borrow().heard.last().map_or(Duration::MAX, |(at, _)| now.since(*at));
        longest = longest.max(age);
        for (count, limit) in fresh.iter_mut().zip([20, 40]) {
            *count += u32::from(age <= Duration::from_millis(limit));
        }
    }
    let [in_20_ms, in_40_ms] = fresh.map(|count| f64::from(count) / frames as f64);
    Freshness { in_20_ms, in_40_ms, per_second: (link.heard() - before) as f64 / seconds as f64, longest }
}

#[test]
fn what_three_of_ten_and_nine_of_ten_lost_cost() {
    for (loss, seconds, strict, wide, packets) in
        [(0.0, 20, 1.0, 1.0, 111.0), (0.3, 120, 0.91, 0.99, 76.0), (0.9, 120, 0.16, 0.30, 9.0)]
    {
        let mut link = Link::new(ID, true, Instant::from_millis(50), 7, false);
        link.run(SETTLED);
        link.air.set_loss(loss);
        let Freshness { in_20_ms, in_40_ms, per_second, longest } = freshness(&mut link, seconds);
        println!("loss {loss}: {per_second:.1}/s, {in_20_ms:.4} of 20 ms, {in_40_ms:.4} of 40 ms, longest {longest}");
        assert!(in_20_ms >= strict && in_40_ms >= wide && per_second >= packets);
        link.air.set_loss(0.0);
        link.run(1_000);
        let back = freshness(&mut link, 2);
        assert_eq!((back.in_20_ms, link.is_offline()), (1.0, false), "nothing of it lasts");
    }
}

#[test]
fn a_jammed_channel_costs_one_packet_of_twenty() {
    for jammed in [0, 7, 19] {
        let mut link = Link::new(ID, true, Instant::from_millis(50), 1, false);
        link.air.jam(link.identity.hops[jammed], true);
        link.run(SETTLED);
        let fresh = freshness(&mut link, 18);
        // 95 % of 111.
        assert!((105.0..106.1).contains(&fresh.per_second), "{}", fresh.per_second);
        assert!(fresh.longest <= Duration::from_millis(19) && fresh.in_20_ms == 1.0, "{}", fresh.longest);
    }
}

/// Time from power-on of the transmitter to its first packet that is received.
#[test]
fn it_is_found_however_far_out_of_phase() {
    let mut slowest = Duration::ZERO;
    for number in 0..60 {
        let from = Instant::from_micros(110_000 + number * 7_919);
        let mut link = Link::new(0xDEAD_BEEF, true, from, 1, false);
        link.run(1_600);
        let first = link.hisky.borrow().heard.first().expect("found").0;
        slowest = slowest.max(first.since(from));
        let before = link.heard();
        link.run(1_000);
        assert!((110..=112).contains(&(link.heard() - before)), "and followed");
    }
    println!("found after {slowest} at most");
    assert!(slowest < Duration::from_millis(600));
}

#[test]
fn a_transmitter_whose_clock_is_off_by_0_4_percent_is_followed_through_an_outage() {
    for drift in [-4_000, -100, 100, 4_000] {
        let mut link = Link::new(ID, true, Instant::from_millis(50), 1, false);
        link.knobs.drift.set(drift);
        link.run(SETTLED);
        link.air.set_loss(1.0);
        link.run(900);
        let before = link.heard();
        link.air.set_loss(0.0);
        link.run(20);
        assert!(link.heard() > before, "{drift}: in step");
    }
}

/// The receiver is offline 1.0 s after the last packet was on the air, within the time of a poll
/// and a read.
#[test]
fn it_is_offline_a_second_after_the_last_packet() {
    for wired in [false, true] {
        let mut link = Link::new(ID, true, Instant::from_millis(50), 1, wired);
        link.run(SETTLED);
        link.knobs.silent.set(true);
        let last = {
            link.run(20);
            link.hisky.borrow().heard.last().expect("some").0
        };
        while !link.is_offline() {
            link.clock_step(10);
        }
        let offline = link.clock.now().since(last).as_micros();
        assert!((1_000_000..=1_000_010).contains(&offline), "{offline}");
        // Error of the stamp: at most the poll period of 100 µs after the end of the packet, or an
        // interrupt.
        let sent = link.knobs.last_sent.get();
        let late = last.since(sent).as_micros();
        println!("known {late} µs after the packet began, of which 144 are the packet, interrupt wired: {wired}");
        assert!((144..=144 + if wired { 5 } else { 110 }).contains(&late), "{late}");
    }
}

#[test]
fn it_binds_in_the_first_four_bind_packets_and_then_follows() {
    let mut link = Link::new(ID, false, Instant::from_millis(200), 1, false);
    link.knobs.binds.set(1_000);
    link.run(200 + 4 * 9);
    let bound = link.hisky.borrow().bound.expect("bound");
    assert_eq!((bound.address, bound.hops), (link.identity.address, link.identity.hops));
    link.run(1_000);
    let before = link.heard();
    link.run(1_000);
    assert!((110..=112).contains(&(link.heard() - before)), "while the other still sends bind packets");
}

#[test]
fn it_binds_through_loss_within_the_nine_seconds() {
    for (loss, seed) in [(0.3, 1), (0.3, 2), (0.6, 3), (0.6, 4)] {
        let mut link = Link::new(ID, false, Instant::from_millis(200), seed, false);
        link.air.set_loss(loss);
        link.knobs.binds.set(1_000);
        link.run(9_200);
        assert!(link.hisky.borrow().bound.is_some(), "{loss}");
    }
}

#[test]
fn packets_in_another_order_are_waited_for_and_another_sum_binds_nobody() {
    let mut link = Link::new(ID, false, Instant::from_millis(200), 1, false);
    // Order 0 3 2 1: after packet 0 only 1 is accepted, in the next round only 2, and in the third
    // 3.
    link.knobs.order.set([0, 3, 2, 1]);
    for (round, bound) in [(1, false), (2, false), (3, true)] {
        link.knobs.binds.set(4);
        link.run(if round == 1 { 300 } else { 100 });
        assert_eq!(link.hisky.borrow().bound.is_some(), bound, "round {round}");
    }
    assert_eq!(link.hisky.borrow().bound.expect("bound").hops, link.identity.hops, "each in its place");
    // Without packet 0, and with a wrong checksum.
    let mut link = Link::new(ID, false, Instant::from_millis(200), 1, false);
    link.knobs.binds.set(10_000);
    link.knobs.order.set([3, 3, 2, 1]);
    link.run(3_000);
    assert_eq!(link.hisky.borrow().bound, None);
    link.knobs.order.set([0, 1, 2, 3]);
    link.knobs.wrong_sum.set(true);
    link.run(3_000);
    assert_eq!(link.hisky.borrow().bound, None);
    link.knobs.wrong_sum.set(false);
    link.run(100);
    assert!(link.hisky.borrow().bound.is_some());
}

#[test]
fn an_armed_vehicle_refuses_to_bind_and_goes_on_with_its_pilot() {
    let mut link = Link::new(ID, true, Instant::from_millis(50), 1, false);
    link.run(SETTLED);
    link.hisky.borrow_mut().receiver.set_armed(true);
    assert!(link.hisky.borrow_mut().receiver.start_binding().is_err());
    let other = link.join(0xDEAD_BEEF);
    other.binds.set(1_000);
    link.run(5_000);
    let before = link.heard();
    link.run(1_000);
    // Two transmitters that share some channels: some packets collide.
    assert!(link.heard() - before > 100 && link.hisky.borrow().bound.is_none());
    // Disarmed and requested to bind, the receiver accepts the other transmitter.
    link.hisky.borrow_mut().receiver.set_armed(false);
    link.hisky.borrow_mut().receiver.start_binding().expect("disarmed");
    link.run(200);
    assert_eq!(link.hisky.borrow().bound.expect("bound").address, Identity::of(0xDEAD_BEEF).address);
}

#[test]
fn a_radio_that_restarts_in_flight_is_set_up_again_within_a_second() {
    let mut link = Link::new(ID, true, Instant::from_millis(50), 1, false);
    link.run(SETTLED);
    link.attached.reset();
    let before = link.heard();
    link.run(500);
    assert!(link.heard() > before + 20, "{}", link.heard() - before);
    let errors = link.hisky.borrow().errors;
    println!("{errors} errors");
    assert!((1..30).contains(&errors));
}

#[test]
fn an_interrupt_that_is_silent_or_stuck_costs_a_few_packets() {
    for stuck_low in [false, true] {
        let mut link = Link::broken_pin(ID, stuck_low);
        link.run(SETTLED);
        let before = link.heard();
        link.run(1_000);
        assert!((110..=112).contains(&(link.heard() - before)), "{stuck_low}: {}", link.heard() - before);
    }
}
