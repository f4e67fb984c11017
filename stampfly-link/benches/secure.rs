//! What a secured frame costs beside the cipher alone: sticks, sealed and opened, and the same bytes through the crate
//! `chacha20poly1305`.

use chacha20poly1305::aead::AeadInOut;
use chacha20poly1305::{ChaCha20Poly1305, KeyInit, Nonce};
use criterion::{Criterion, criterion_group, criterion_main};
use stampfly_link::secure::{Key, MAX_FRAME, Payload, Station, Vehicle};
use stampfly_types::Instant;
use stampfly_types::messages::PilotInput;
use std::hint::black_box;

const NOW: Instant = Instant::from_millis(20);

/// Two ends in a session.
fn joined() -> (Vehicle, Station) {
    let key = Key::generate(1, core::array::from_fn(|place| place as u8)).expect("a key");
    let (mut vehicle, mut station, mut room) = (Vehicle::new(key.clone()), Station::new(key), [0; MAX_FRAME]);
    for turn in 0..2 {
        let mut frame = vehicle.transmit(NOW, [turn + 1; 8], &mut room).expect("a frame").to_vec();
        station.receive(NOW, &mut frame).expect("taken");
        let mut frame = station.transmit(NOW, [turn + 3; 8], &mut room).expect("a frame").to_vec();
        vehicle.receive(NOW, &mut frame).expect("taken");
    }
    (vehicle, station)
}

fn frames(criterion: &mut Criterion) {
    let (mut vehicle, mut station) = joined();
    let sticks = Payload::Sticks(PilotInput { roll: 0.5, throttle: 0.25, arm: true, ..Default::default() });
    let mut room = [0; MAX_FRAME];
    let mut group = criterion.benchmark_group("a frame of sticks");
    group.bench_function("seal", |bench| {
        bench.iter(|| station.seal(NOW, black_box(&sticks), &mut room).expect("sealed").len());
    });
    group.bench_function("seal and open", |bench| {
        bench.iter(|| {
            let length = station.seal(NOW, black_box(&sticks), &mut room).expect("sealed").len();
            vehicle.receive(NOW, &mut room[..length]).expect("taken").expect("sticks").counter
        });
    });
    let cipher = ChaCha20Poly1305::new(&[7; 32].into());
    // What is encrypted of such a frame: when it was sealed, and 18 bytes of sticks.
    let (nonce, head, mut text) = (Nonce::from([1; 12]), [2; 11], [3; 22]);
    group.bench_function("cipher alone, seal", |bench| {
        bench.iter(|| {
            cipher.encrypt_inout_detached(black_box(&nonce), &head, text.as_mut_slice().into()).expect("sealed")
        });
    });
    group.bench_function("cipher alone, seal and open", |bench| {
        bench.iter(|| {
            let tag = cipher.encrypt_inout_detached(black_box(&nonce), &head, text.as_mut_slice().into());
            let tag = tag.expect("sealed");
            cipher.decrypt_inout_detached(&nonce, &head, text.as_mut_slice().into(), &tag).expect("opened");
        });
    });
    // What a flood costs: a frame that looks right but for its tag. One a tick, so that each is worked on.
    let length = station.seal(NOW, &sticks, &mut room).expect("sealed").len();
    room[length - 1] ^= 1;
    let (bad, mut now) = (room, NOW);
    group.bench_function("a bad tag", |bench| {
        bench.iter(|| {
            now += stampfly_types::Duration::from_micros(2_500);
            let mut frame = bad;
            vehicle.receive(now, black_box(&mut frame[..length])).is_err()
        });
    });
    group.finish();
}

criterion_group!(benches, frames);
criterion_main!(benches);
