//! Runs the driver on register-level emulations of two nRF24L01+ on this PC. One sends over the
//! air, which loses three of ten packets, and the other receives.
//!
//! `cargo run -p stampfly-nrf24l01 --example emulated-nrf24l01`, in the repository.

use embedded_hal::spi::MODE_0;
use stampfly_nrf24l01::{Config, Duration, Instant, Nrf24l01, Tuning};
use stampfly_sim::chips::{self, Air, SpiBus};
use stampfly_sim::time::{Clock, block_on};

const TUNING: Tuning = Tuning { channel: 40, address: [1, 2, 3, 4, 5] };

fn main() {
    let clock = Clock::new(Instant::ZERO);
    let air = Air::new(&clock, 1);
    air.set_loss(0.3);
    let [mut transmitter, mut receiver] = [(); 2].map(|()| {
        let (device, _) = SpiBus::new(&clock, 1).attach(8_000_000, chips::Nrf24l01::new(&air));
        let device = device.with_mode(MODE_0);
        let enable = device.chip_enable();
        Nrf24l01::<_, _, _, _, 10>::new(device, enable, clock.clone(), Config::default())
    });
    let mut heard = 0;
    block_on(&clock, async {
        transmitter.self_test().await.expect("it sends");
        for number in 0..100_u8 {
            receiver.listen(TUNING).await.expect("it answers");
            transmitter.send(TUNING, &[number; 10]).await.expect("it sends");
            let until = clock.now() + Duration::from_millis(1);
            if let Some(packet) = receiver.wait(until).await.expect("it answers") {
                assert_eq!(packet.payload, [number; 10]);
                println!("{}: packet {number}", packet.at);
                heard += 1;
            }
        }
    });
    println!("{heard} of 100");
    assert!((60..=80).contains(&heard));
}
