//! The emulated chip under an independent driver, [`nrf24-rs`](https://docs.rs/nrf24-rs): a link
//! between two of them, and one with a driver of this project.

use embedded_hal::spi::MODE_0;
use nrf24_rs::Nrf24l01 as Theirs;
use nrf24_rs::config::{DataRate, EncodingScheme, NrfConfig, PALevel};
use stampfly_sim::chips::{Air, ChipEnable, Nrf24l01, SpiBus, SpiPort};
use stampfly_sim::time::Clock;
use stampfly_types::{Duration, Instant};

const ADDRESS: &[u8] = b"Node1";

fn chip(clock: &Clock, air: &Air) -> (SpiPort<Nrf24l01>, ChipEnable) {
    let (port, _) = SpiBus::new(clock, 1).attach(8_000_000, Nrf24l01::new(air));
    let port = port.with_mode(MODE_0);
    let enable = port.chip_enable();
    (port, enable)
}

fn theirs(clock: &Clock, air: &Air) -> Theirs<SpiPort<Nrf24l01>, ChipEnable> {
    let (port, enable) = chip(clock, air);
    wait(clock, 100_000);
    let config = NrfConfig::default()
        .channel(40)
        .payload_size(10)
        .data_rate(DataRate::R1Mbps)
        .pa_level(PALevel::Max)
        .crc_encoding_scheme(EncodingScheme::R2Bytes);
    // The driver reads CONFIG back.
    Theirs::new(port, enable, &mut clock.clone(), config).expect("it starts")
}

fn wait(clock: &Clock, micros: u64) {
    clock.advance_to(clock.now() + Duration::from_micros(micros));
}

#[test]
fn two_of_another_driver_talk_over_the_air_with_acknowledgements() {
    let clock = Clock::new(Instant::ZERO);
    let air = Air::new(&clock, 1);
    let (mut sender, mut receiver) = (theirs(&clock, &air), theirs(&clock, &air));
    assert!(sender.is_connected().expect("an answer") && receiver.is_connected().expect("an answer"));
    assert_eq!(sender.channel().expect("an answer"), 40);
    sender.open_writing_pipe(ADDRESS).expect("a write");
    receiver.open_reading_pipe(0, ADDRESS).expect("a write");
    receiver.start_listening().expect("a write");
    wait(&clock, 130);
    for number in 0..20_u8 {
        sender.write(&mut clock.clone(), &[number; 10]).expect("it is acknowledged");
        wait(&clock, 1_000);
        assert!(receiver.data_available().expect("an answer"));
        let mut payload = [0; 10];
        assert_eq!(receiver.read(&mut payload).expect("a payload"), 10);
        assert_eq!(payload, [number; 10]);
        assert!(!receiver.data_available().expect("an answer"));
        assert!(sender.status().expect("an answer").raw() & 0x10 == 0, "not given up");
    }
}

#[test]
fn through_lossy_air_acknowledgements_bring_most_of_it() {
    let clock = Clock::new(Instant::ZERO);
    let air = Air::new(&clock, 3);
    let (mut sender, mut receiver) = (theirs(&clock, &air), theirs(&clock, &air));
    sender.open_writing_pipe(ADDRESS).expect("a write");
    receiver.open_reading_pipe(0, ADDRESS).expect("a write");
    receiver.start_listening().expect("a write");
    wait(&clock, 130);
    air.set_loss(0.3);
    let mut heard = 0;
    for number in 0..100_u8 {
        // After a packet it gave up, it reports that once and empties its FIFO.
        let _ = sender.write(&mut clock.clone(), &[number; 10]);
        wait(&clock, 30_000);
        let mut payload = [0; 10];
        while receiver.data_available().expect("an answer") {
            receiver.read(&mut payload).expect("a payload");
            assert!(payload[0] == payload[9]);
            heard += 1;
        }
    }
    println!("{heard} of 100");
    assert!(heard > 85, "{heard}");
}
