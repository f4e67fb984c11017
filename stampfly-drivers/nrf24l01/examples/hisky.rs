//! A HiSKY receiver on this driver, with the code that a vehicle needs to combine the two, and a
//! transmitter on a second emulated radio.
//!
//! `cargo run -p stampfly-nrf24l01 --example emulated-hisky`, in the repository.

use embedded_hal::spi::MODE_0;
use stampfly_link::hisky::{
    BIND_ADDRESS, BIND_CHANNEL, HOPS, HiskyChannels, HiskyEvent, HiskyLink, HiskyReceiver, PAYLOAD,
};
use stampfly_nrf24l01::{Config, Duration, Hopper, Instant, Nrf24l01, Tuning};
use stampfly_sim::chips::{self, Air, ChipEnable, SpiBus, SpiPort};
use stampfly_sim::time::{Clock, Tasks};
use std::cell::Cell;

/// The protocol, and the sticks that the vehicle takes from it.
struct Receiver {
    hisky: HiskyReceiver,
    sticks: Option<HiskyChannels>,
}

impl Hopper<PAYLOAD> for Receiver {
    fn tuning(&self) -> Tuning {
        let tuning = self.hisky.tuning();
        Tuning { channel: tuning.channel, address: tuning.address }
    }

    fn due(&self) -> Option<Instant> {
        self.hisky.due()
    }

    fn poll(&mut self, now: Instant) {
        self.hisky.poll(now);
    }

    fn receive(&mut self, at: Instant, packet: &[u8; PAYLOAD]) {
        match self.hisky.receive(at, packet) {
            HiskyEvent::Channels(sticks) => self.sticks = Some(sticks),
            HiskyEvent::Bound(link) => println!("{at}: bound to {:02x?}, which is stored now", link.address),
            _ => {}
        }
    }
}

type Radio = Nrf24l01<SpiPort<chips::Nrf24l01>, ChipEnable, Clock>;

/// Task of the receiver, with a chance for other work every 20 ms.
async fn receive(mut radio: Radio, clock: Clock, packets: &Cell<u32>) {
    let mut receiver = Receiver { hisky: HiskyReceiver::new(None, clock.now()), sticks: None };
    loop {
        if let Err(error) = radio.follow(&mut receiver, clock.now() + Duration::from_millis(20)).await {
            println!("{error}");
            clock.sleep_until(clock.now() + Duration::from_millis(20)).await;
        }
        packets.set(receiver.hisky.packets());
        if receiver.hisky.is_offline(clock.now()) {
            // Stick positions of a lost link must not be used.
            receiver.sticks = None;
        } else if let Some(sticks) = receiver.sticks
            && receiver.hisky.packets().is_multiple_of(100)
        {
            println!("{}: {:.2?}", clock.now(), sticks.values());
        }
    }
}

/// A transmitter that has just been switched on: it binds for a second, with a bind packet in the
/// middle of each frame.
async fn transmit(mut radio: Radio, clock: Clock) {
    let link = HiskyLink { address: [1, 2, 3, 4, 5], hops: core::array::from_fn(|hop| 2 + 3 * hop as u8) };
    radio.start().await.expect("it starts");
    let begin = clock.now();
    for frame in 0..500 {
        let at = begin + Duration::from_millis(9) * frame;
        if frame < 110 {
            clock.sleep_until(at + Duration::from_millis(3)).await;
            let packet = link.bind_packets()[frame as usize % 4];
            radio.send(Tuning { channel: BIND_CHANNEL, address: BIND_ADDRESS }, &packet).await.expect("it sends");
        }
        clock.sleep_until(at + Duration::from_millis(9)).await;
        let sticks = HiskyChannels([500, 500, 1_000 - frame as u16, 500, 0, 0, 0, 0]);
        let tuning = Tuning { channel: link.hops[frame as usize % HOPS], address: link.address };
        radio.send(tuning, &sticks.to_bytes()).await.expect("it sends");
    }
}

fn main() {
    let clock = Clock::new(Instant::ZERO);
    let air = Air::new(&clock, 1);
    let [receiver, transmitter] = [(); 2].map(|()| {
        let (device, _) = SpiBus::new(&clock, 1).attach(8_000_000, chips::Nrf24l01::new(&air));
        let device = device.with_mode(MODE_0);
        let enable = device.chip_enable();
        Radio::new(device, enable, clock.clone(), Config::default())
    });
    let packets = Cell::new(0);
    let mut tasks = Tasks::new(clock.clone());
    tasks.spawn(receive(receiver, clock.clone(), &packets));
    tasks.spawn(transmit(transmitter, clock.clone()));
    tasks.run_until(Instant::from_millis(4_700));
    drop(tasks);
    println!("{} of 500 packets; the first ones while it searched", packets.get());
    assert!(packets.get() > 450);
}
