//! The transmitter, the air, and the vehicle's radio: a chip that is emulated register by register under its driver.
//!
//! The transmitter sends every nine milliseconds on the next of twenty channels, and was there before the vehicle.

use super::pilot::Sticks;
use crate::receiver::Receiver;
use crate::topics::ReceiverEnds;
use core::cell::Cell;
use embedded_hal::spi::MODE_0;
use stampfly_drivers::chip::nrf24l01::{Config, Nrf24l01};
use stampfly_link::hisky::HiskyLink;
use stampfly_sim::Noise;
use stampfly_sim::chips::{self, Air, AirPacket, AirRate, SpiBus};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_types::Duration;

/// Time between two packets.
const FRAME: Duration = Duration::from_millis(9);
/// SPI clock of the radio, Hz.
const SPI: u32 = 8_000_000;
/// Random number streams of the transmitter and the wires.
const STREAM: u64 = 1_201;
/// The transmitter that this vehicle is bound to: one of the reference values.
pub const LINK: HiskyLink = HiskyLink {
    address: [0x12, 0x34, 0x56, 0x78, 0x58],
    hops: [49, 7, 24, 15, 3, 51, 44, 2, 68, 23, 10, 73, 30, 19, 72, 47, 33, 58, 32, 50],
};

/// Starts transmitter and receiver.
pub(super) fn start<'a>(
    tasks: &mut Tasks<'a>,
    clock: &Clock,
    air: &Air,
    seed: u64,
    sticks: &'a Cell<Sticks>,
    ends: ReceiverEnds<'a>,
) {
    let (device, _) = SpiBus::new(clock, seed).attach(SPI, chips::Nrf24l01::new(air));
    let device = device.with_mode(MODE_0);
    let (enable, interrupt) = (device.chip_enable(), device.radio_interrupt());
    let radio = Nrf24l01::<_, _, _, _, 10>::new(device, enable, clock.clone(), Config::default());
    let mut radio = radio.with_interrupt(interrupt);
    let mut receiver = Receiver::new(Some(LINK), clock.now(), ends);
    let now = clock.clone();
    tasks.spawn(async move {
        loop {
            if receiver.step(&mut radio, now.now()).await.is_err() {
                now.sleep_until(now.now() + Duration::from_millis(10)).await;
            }
        }
    });
    tasks.spawn(transmit(clock.clone(), air.clone(), seed, sticks));
}

async fn transmit(clock: Clock, air: Air, seed: u64, sticks: &Cell<Sticks>) {
    let mut noise = Noise::new(seed, STREAM);
    let mut hop = (noise.unit() * 20.0) as usize;
    clock.sleep_until(clock.now() + Duration::from_micros((noise.unit() * 9_000.0) as u64)).await;
    loop {
        let next = clock.now() + FRAME;
        let channel = LINK.hops[hop % LINK.hops.len()];
        hop += 1;
        let payload = sticks.get().channels().to_bytes();
        air.send(&AirPacket { channel, rate: AirRate::Mbit1, address: &LINK.address, payload: &payload, crc: 2 });
        clock.sleep_until(next).await;
    }
}
