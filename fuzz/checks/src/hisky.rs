//! A receiver whose address anybody can know.

use crate::Input;
use stampfly_link::hisky::{BIND_ADDRESS, BIND_CHANNEL, HiskyEvent, HiskyLink, HiskyReceiver, PAYLOAD};
use stampfly_types::{Duration, Instant};

/// What happens: events of a receiver's life, each with a time step. The first byte says whether it knows a transmitter.
pub fn hisky(data: &[u8]) {
    let mut input = Input(data);
    let known = HiskyLink { address: [1, 2, 3, 4, 5], hops: core::array::from_fn(|hop| 2 + 3 * hop as u8) };
    let (mut now, mut armed) = (Instant::ZERO, false);
    let mut receiver = HiskyReceiver::new((input.byte() & 1 == 1).then_some(known), now);
    while !input.is_empty() {
        let (event, step) = (input.byte(), input.byte());
        now += Duration::from_micros(u64::from(step) * 1_000);
        let before = receiver.link();
        match event % 8 {
            0 => armed = true,
            1 => armed = false,
            2 => assert_eq!(receiver.start_binding().is_err(), armed),
            3 => receiver.stop_binding(),
            4 => {
                receiver.poll(now);
                assert!(receiver.due().is_none_or(|due| due > now), "it waits");
            }
            5 => {
                // One of another transmitter's packets.
                let other = HiskyLink { address: [event; 5], hops: [event >> 1; 20] };
                let packet = other.bind_packets()[usize::from(event >> 3) % 4];
                receive(&mut receiver, now, &packet);
            }
            _ => {
                let mut packet = [0; PAYLOAD];
                packet.iter_mut().for_each(|byte| *byte = input.byte());
                receive(&mut receiver, now, &packet);
            }
        }
        receiver.set_armed(armed);
        if armed {
            assert_eq!(receiver.link(), before, "an armed vehicle keeps its transmitter");
            assert!(!receiver.is_binding() || before.is_none());
        }
        let (tuning, link) = (receiver.tuning(), receiver.link());
        match link.filter(|_| !receiver.is_binding()) {
            Some(link) => assert!(link.hops.contains(&tuning.channel) && link.address == tuning.address),
            None => assert_eq!((tuning.channel, tuning.address), (BIND_CHANNEL, BIND_ADDRESS)),
        }
        assert!(tuning.channel <= 125, "a channel that the radio has");
        // One step at a time, so that nobody waits for a second without a word of it.
        assert!(receiver.due().is_none_or(|due| due.since(now) <= Duration::from_micros(199_500)));
    }
}

fn receive(receiver: &mut HiskyReceiver, now: Instant, packet: &[u8; PAYLOAD]) {
    let (binding, packets) = (receiver.is_binding(), receiver.packets());
    match receiver.receive(now, packet) {
        HiskyEvent::Channels(channels) => {
            assert!(!binding && receiver.packets() == packets.wrapping_add(1) && !receiver.is_offline(now));
            assert!(channels.0.iter().all(|channel| *channel <= 1_000));
            assert!(channels.values().iter().all(|value| (0.0..=1.0).contains(value)));
        }
        HiskyEvent::Bound(link) => {
            assert!(binding && !receiver.is_binding() && receiver.is_offline(now));
            assert_eq!(receiver.link(), Some(link));
        }
        _ => assert!(binding),
    }
}
