//! Broadcast telemetry and the data stream: rates, what is in the packets, and what becomes of those who do not ask any more.

use crate::common::{Id, Vehicle};
use stampfly_link::BroadcastPacket;
use stampfly_link::stream::{StreamEntry, StreamPacket, StreamStatus};
use stampfly_services::{DataStream, Telemetry, VehicleAccess as _};
use stampfly_types::messages::{FlowData, ImuData, MotorOutput, PowerData, StateEstimate};
use stampfly_types::{Instant, Vec3};

const COUNT: f32 = 0.002;

#[test]
fn flow_is_counted_up_with_what_is_less_than_a_count() {
    let (mut telemetry, mut vehicle) = (Telemetry::new(COUNT), Vehicle::flying());
    for _ in 0..1_000 {
        telemetry.flow(&FlowData { delta_x: 0.0003, delta_y: -0.0009, ..Default::default() });
    }
    telemetry.flow(&FlowData { delta_x: f32::NAN, ..Default::default() });
    vehicle.publish(Id::sensor_power, &PowerData { voltage: 3.9, ..Default::default() });
    let mut packets = Vec::new();
    for ms in 0..1_000 {
        telemetry.poll(Instant::from_millis(ms), &vehicle.view(), &mut |bytes| packets.push(bytes.to_vec()));
    }
    assert_eq!(packets.len(), 50);
    let packet = BroadcastPacket::decode(&packets[49]).expect("a packet");
    let sensors = packet.sensors.expect("version 2");
    let [x, y] = sensors.flow.map(u16::cast_signed);
    assert!((149..=150).contains(&x) && (-450..=-449).contains(&y), "{x} {y}");
    assert_eq!((packet.time, sensors.voltage), (980_000, 3.9));
}

/// Flies so many control cycles with a stream to whoever has asked, and returns the packets.
fn cycles(stream: &mut DataStream<u8>, vehicle: &mut Vehicle, from: u64, count: u64, poll: bool) -> Vec<Vec<u8>> {
    let mut sent = Vec::new();
    for cycle in from..from + count {
        let now = Instant::from_micros(2_500 * cycle);
        vehicle.publish_at(
            now,
            Id::sensor_imu,
            &ImuData { gyro: Vec3::new(cycle as f32, 0.0, 0.0), ..Default::default() },
        );
        vehicle.publish_at(now, Id::estimate_state, &StateEstimate::default());
        if cycle.is_multiple_of(4) {
            vehicle.publish_at(now, Id::sensor_flow, &FlowData { delta_x: 10.0 * COUNT, ..Default::default() });
        }
        let mut duty = [0.0; 8];
        duty[0] = 0.5;
        vehicle.publish_at(now, Id::actuator_motor, &MotorOutput { duty, ..Default::default() });
        stream.cycle(now, &vehicle.view());
        if poll {
            stream.poll(now, &vehicle.view(), &mut |to, packet| {
                assert_eq!(*to, 1);
                sent.push(packet.to_vec());
            });
        }
    }
    sent
}

#[test]
fn every_cycle_and_every_sample_is_in_the_stream_once() {
    let (mut stream, mut vehicle) = (DataStream::new(COUNT), Vehicle::flying());
    assert!(cycles(&mut stream, &mut vehicle, 0, 80, true).is_empty(), "nobody has asked");
    stream.hear(Instant::from_micros(2_500 * 80), 1, &[0xF0]);
    let sent = cycles(&mut stream, &mut vehicle, 80, 800, true);
    let packets: Vec<_> = sent.iter().filter_map(|bytes| StreamPacket::decode(bytes).ok()).collect();
    let statuses = sent.iter().filter(|bytes| StreamStatus::decode(bytes).is_ok()).count();
    assert_eq!((packets.len(), statuses, sent.len()), (100, 2, 102));
    let times: Vec<u32> = packets.iter().flat_map(|packet| packet.cycles().map(|cycle| cycle.time)).collect();
    assert_eq!(times, (80..880).map(|cycle| 2_500 * cycle).collect::<Vec<u32>>());
    let flows = packets
        .iter()
        .flat_map(StreamPacket::entries)
        .filter(|entry| matches!(entry, StreamEntry::Flow { counts: [10, 0], .. }));
    assert_eq!(flows.count(), 200);
    let duties = packets.iter().flat_map(StreamPacket::entries).filter_map(|entry| match entry {
        StreamEntry::Duty(duties) => Some(duties[7][0]),
        _ => None,
    });
    assert!(duties.count() == 100);
    assert_eq!(stream.missed(), 0);
}

#[test]
fn packets_that_nobody_fetches_are_counted_and_whoever_is_silent_is_sent_nothing() {
    let (mut stream, mut vehicle) = (DataStream::new(COUNT), Vehicle::flying());
    stream.hear(Instant::ZERO, 1, &[0xF0]);
    cycles(&mut stream, &mut vehicle, 0, 80, false);
    assert_eq!(stream.missed(), 9, "the tenth waits");
    // Five seconds after it was heard last.
    let sent = cycles(&mut stream, &mut vehicle, 80, 2_400, true);
    assert!(sent.len() < 250, "{}", sent.len());
    stream.hear(Instant::from_secs(7), 1, &[0xF0]);
    stream.hear(Instant::from_secs(7), 1, &[0xF1]);
    assert!(cycles(&mut stream, &mut vehicle, 2_800, 100, true).is_empty(), "it has asked for no more");
}
