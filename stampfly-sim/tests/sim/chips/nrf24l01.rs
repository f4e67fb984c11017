//! nRF24L01+ after Nordic's product specification, command by command.

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::spi::{MODE_0, SpiDevice};
use stampfly_sim::chips::{Air, AirPacket, AirRate, Attached, ChipEnable, Nrf24l01, RadioInterrupt, SpiBus, SpiPort};
use stampfly_sim::time::Clock;
use stampfly_types::{Duration, Instant};

const ADDRESS: [u8; 5] = [1, 2, 3, 4, 5];
const PAYLOAD: [u8; 10] = [10, 11, 12, 13, 14, 15, 16, 17, 18, 19];

struct Radio {
    clock: Clock,
    port: SpiPort<Nrf24l01>,
    enable: ChipEnable,
    interrupt: RadioInterrupt,
    attached: Attached,
}

impl Radio {
    fn of(clock: &Clock, chip: Nrf24l01) -> Self {
        let (port, attached) = SpiBus::new(clock, 1).attach(8_000_000, chip);
        let port = port.with_mode(MODE_0);
        let (enable, interrupt) = (port.chip_enable(), port.radio_interrupt());
        Self { clock: clock.clone(), port, enable, interrupt, attached }
    }

    fn wait(&self, micros: u64) {
        self.clock.advance_to(self.clock.now() + Duration::from_micros(micros));
    }

    /// Sends a command with data; returns the status and the bytes read.
    fn ask<const N: usize>(&mut self, command: u8, data: [u8; N]) -> (u8, [u8; N]) {
        let mut bytes = vec![command];
        bytes.extend(data);
        self.port.transfer_in_place(&mut bytes).expect("a transfer");
        (bytes[0], bytes[1..].try_into().expect("as many"))
    }

    fn write(&mut self, register: u8, value: u8) {
        self.ask(0x20 | register, [value]);
    }

    fn read(&mut self, register: u8) -> u8 {
        self.ask(register, [0]).1[0]
    }

    /// A receiver of ten bytes of plain ShockBurst on this channel, in standby.
    fn set_up(&mut self, channel: u8, config: u8) {
        for (register, value) in [(0x01, 0), (0x02, 1), (0x04, 0), (0x05, channel), (0x06, 0x06), (0x11, 10)] {
            self.write(register, value);
        }
        self.ask(0x2A, ADDRESS);
        self.ask(0x30, ADDRESS);
        self.write(0x00, config);
        self.wait(5_000);
    }

    fn high(&mut self) {
        self.enable.set_high().expect("a pin");
    }

    fn low(&mut self) {
        self.enable.set_low().expect("a pin");
    }

    fn is_interrupting(&mut self) -> bool {
        self.interrupt.is_low().expect("a pin")
    }
}

fn bench() -> (Clock, Air, Radio) {
    let clock = Clock::new(Instant::ZERO);
    let air = Air::new(&clock, 1);
    let radio = Radio::of(&clock, Nrf24l01::new(&air));
    clock.advance_to(Instant::from_millis(100));
    (clock, air, radio)
}

/// A settled receiver on channel 40.
fn listening() -> (Clock, Air, Radio) {
    let (clock, air, mut radio) = bench();
    radio.set_up(40, 0x0F);
    radio.high();
    radio.wait(130);
    (clock, air, radio)
}

const PACKET: AirPacket<'_> =
    AirPacket { channel: 40, rate: AirRate::Mbit1, address: &ADDRESS, payload: &PAYLOAD, crc: 2 };

#[test]
fn registers_read_after_power_on_as_the_table_says() {
    let clock = Clock::new(Instant::ZERO);
    let air = Air::new(&clock, 1);
    let mut radio = Radio::of(&clock, Nrf24l01::new(&air));
    clock.advance_to(Instant::from_micros(99_000));
    assert_eq!(radio.read(0x00), 0, "power-on reset");
    clock.advance_to(Instant::from_millis(100));
    let table = [(0, 0x08), (1, 0x3F), (2, 3), (3, 3), (4, 3), (5, 2), (6, 0x0E), (7, 0x0E), (9, 0), (0x17, 0x11)];
    for (register, value) in table {
        assert_eq!(radio.read(register), value, "{register:#04x}");
    }
    assert_eq!(radio.ask(0x0A, [0; 5]), (0x0E, [0xE7; 5]));
    assert_eq!(radio.ask(0x0B, [0; 5]).1, [0xC2; 5]);
    assert_eq!(radio.ask(0x10, [0; 5]).1, [0xE7; 5]);
    assert_eq!([0x0C, 0x0D, 0x0E, 0x0F].map(|register| radio.read(register)), [0xC3, 0xC4, 0xC5, 0xC6]);
    // Written from the least significant byte on; bytes not written are kept.
    radio.ask(0x2A, [9, 8]);
    assert_eq!(radio.ask(0x0A, [0; 5]).1, [9, 8, 0xE7, 0xE7, 0xE7]);
    radio.write(0x03, 0xFF);
    radio.write(0x01, 0xFF);
    assert_eq!((radio.read(3), radio.read(1)), (0x03, 0x3F), "bits that are not defined are zero");
}

#[test]
fn what_begins_130_us_after_ce_is_heard_and_what_begins_before_is_not() {
    for (micros, heard) in [(0, false), (129, false), (130, true)] {
        let (_, air, mut radio) = bench();
        radio.set_up(40, 0x0F);
        radio.high();
        radio.wait(micros);
        let span = air.send(&PACKET).as_micros();
        assert_eq!(span, 144, "preamble 8, address 40, payload 80, CRC 16");
        radio.wait(span - 1);
        assert!(!radio.is_interrupting());
        radio.wait(1);
        assert_eq!(radio.is_interrupting(), heard, "{micros} µs");
    }
}

#[test]
fn the_crystal_has_to_run_first() {
    for (micros, heard) in [(4_000, false), (4_500 + 130, true)] {
        let (_, air, mut radio) = bench();
        radio.set_up(40, 0x0D);
        radio.write(0x00, 0x0F);
        radio.high();
        radio.wait(micros);
        radio.wait(air.send(&PACKET).as_micros());
        assert_eq!(radio.is_interrupting(), heard);
    }
}

#[test]
fn a_payload_is_read_once_and_flags_are_cleared_by_ones() {
    let (_, air, mut radio) = listening();
    radio.wait(air.send(&PACKET).as_micros());
    assert_eq!((radio.read(0x07), radio.read(0x17)), (0x40, 0x10));
    assert_eq!(radio.ask(0x60, [0]).1, [10], "its length");
    assert_eq!(radio.ask(0x61, [0; 10]), (0x40, PAYLOAD));
    assert_eq!((radio.read(0x07), radio.read(0x17)), (0x4E, 0x11), "the flag stays");
    radio.write(0x07, 0x20);
    assert!(radio.is_interrupting(), "another flag");
    radio.write(0x07, 0x40);
    assert_eq!((radio.read(0x07), radio.is_interrupting()), (0x0E, false));
    assert_eq!(radio.ask(0x61, [0; 10]).1, [0; 10], "nothing");
}

#[test]
fn the_fourth_packet_is_lost_and_the_first_three_come_in_their_order() {
    let (_, air, mut radio) = listening();
    for number in 0..4 {
        let payload = [number; 10];
        radio.wait(air.send(&AirPacket { payload: &payload, ..PACKET }).as_micros());
    }
    assert_eq!(radio.read(0x17), 0x12, "full");
    let read: Vec<u8> = (0..4).map(|_| radio.ask(0x61, [0; 10]).1[9]).collect();
    assert_eq!(read, [0, 1, 2, 0]);
    radio.wait(air.send(&PACKET).as_micros());
    radio.ask(0xE2, []);
    assert_eq!(radio.read(0x17), 0x11, "emptied");
}

#[test]
fn channel_address_rate_length_and_sum_have_to_match_bit_for_bit() {
    let heard = |packet: AirPacket<'_>| {
        let (_, air, mut radio) = listening();
        radio.wait(air.send(&packet).as_micros());
        radio.is_interrupting()
    };
    assert!(heard(PACKET));
    assert!(!heard(AirPacket { channel: 41, ..PACKET }));
    assert!(!heard(AirPacket { rate: AirRate::Mbit2, ..PACKET }));
    assert!(!heard(AirPacket { payload: &PAYLOAD[..9], ..PACKET }));
    assert!(!heard(AirPacket { crc: 1, ..PACKET }));
    assert!(!heard(AirPacket { crc: 0, ..PACKET }));
    assert!(!heard(AirPacket { address: &ADDRESS[1..], ..PACKET }));
    for bit in 0..40 {
        let mut address = ADDRESS;
        address[bit / 8] ^= 1 << (bit % 8);
        assert!(!heard(AirPacket { address: &address, ..PACKET }), "bit {bit}");
    }
}

#[test]
fn a_wrong_bit_is_refused_by_the_sum_and_by_nothing_else() {
    let (_, air, mut radio) = listening();
    air.set_loss(1.0);
    for _ in 0..50 {
        radio.wait(air.send(&PACKET).as_micros());
    }
    assert!(!radio.is_interrupting());
    // Without a CRC all packets with a matching address are accepted.
    let (_, air, mut radio) = bench();
    radio.set_up(40, 0x03);
    radio.high();
    radio.wait(130);
    air.set_loss(1.0);
    let (mut wrong, mut heard) = (0, 0);
    for _ in 0..50 {
        radio.wait(air.send(&AirPacket { crc: 0, ..PACKET }).as_micros());
        if radio.read(0x17) & 1 == 0 {
            heard += 1;
            wrong += u32::from(radio.ask(0x61, [0; 10]).1 != PAYLOAD);
        }
    }
    assert!(heard == wrong && (20..50).contains(&heard), "{heard} {wrong}");
}

#[test]
fn jammed_channels_and_packets_at_the_same_time_are_not_heard() {
    let (_, air, mut radio) = listening();
    air.jam(40, true);
    radio.wait(air.send(&PACKET).as_micros());
    assert_eq!((radio.is_interrupting(), radio.read(0x09)), (false, 1), "a carrier");
    air.jam(40, false);
    air.send(&PACKET);
    radio.wait(100);
    radio.wait(air.send(&PACKET).as_micros());
    assert!(!radio.is_interrupting());
    // On another channel it has no effect.
    air.send(&AirPacket { channel: 41, ..PACKET });
    radio.wait(air.send(&PACKET).as_micros());
    assert!(radio.is_interrupting());
}

#[test]
fn registers_are_not_written_while_it_listens_but_for_flags_and_power() {
    let (_, _, mut radio) = listening();
    radio.write(0x05, 50);
    assert_eq!(radio.read(0x05), 40, "lost");
    radio.low();
    radio.write(0x05, 50);
    assert_eq!(radio.read(0x05), 50);
    radio.high();
    radio.write(0x00, 0x0D);
    assert_eq!(radio.read(0x00), 0x0D, "power down from anywhere");
}

#[test]
fn a_masked_interrupt_is_not_seen_at_the_pin() {
    let (_, air, mut radio) = bench();
    radio.set_up(40, 0x4F);
    radio.high();
    radio.wait(130);
    radio.wait(air.send(&PACKET).as_micros());
    assert_eq!((radio.read(0x07), radio.is_interrupting()), (0x40, false));
}

#[test]
fn a_pulse_of_10_us_sends_and_one_that_is_shorter_does_not() {
    for (pulse, sends) in [(9, false), (10, true)] {
        let (clock, air, mut receiver) = listening();
        let mut sender = Radio::of(&clock, Nrf24l01::new(&air));
        sender.wait(100_000);
        sender.set_up(40, 0x0E);
        sender.ask(0xA0, PAYLOAD);
        assert_eq!(sender.read(0x17), 0x01);
        sender.high();
        sender.wait(pulse);
        sender.low();
        sender.wait(130 + 144 - pulse - 1);
        assert!(!receiver.is_interrupting());
        sender.wait(1);
        assert_eq!((receiver.is_interrupting(), sender.is_interrupting()), (sends, sends));
        assert_eq!(sender.read(0x07), if sends { 0x2E } else { 0x0E });
    }
}

#[test]
fn with_ce_high_everything_goes_out_at_once() {
    let (clock, air, mut receiver) = listening();
    let mut sender = Radio::of(&clock, Nrf24l01::new(&air));
    sender.wait(100_000);
    sender.set_up(40, 0x0E);
    for number in 0..4 {
        sender.ask(0xA0, [number; 10]);
    }
    assert_eq!(sender.read(0x17), 0x21, "full, and the fourth one was not taken");
    sender.high();
    sender.wait(130 + 3 * 144);
    assert_eq!((sender.read(0x17) & 0x30, receiver.read(0x17)), (0x10, 0x12));
}

/// Two radios with acknowledgement, as after a reset except for the rate.
fn acknowledging() -> (Air, Radio, Radio) {
    let (clock, air, mut receiver) = bench();
    let mut sender = Radio::of(&clock, Nrf24l01::new(&air));
    sender.wait(100_000);
    for (radio, config) in [(&mut receiver, 0x0F), (&mut sender, 0x0E)] {
        radio.write(0x11, 10);
        radio.write(0x06, 0x06);
        radio.write(0x00, config);
        radio.wait(5_000);
    }
    receiver.high();
    receiver.wait(130);
    (air, receiver, sender)
}

#[test]
fn what_is_acknowledged_is_sent_once_and_what_is_not_three_times_more() {
    let (air, mut receiver, mut sender) = acknowledging();
    sender.ask(0xA0, PAYLOAD);
    sender.high();
    sender.wait(20);
    sender.low();
    // Packet 153 bits, 130 µs turnaround, acknowledgement 73 bits.
    sender.wait(130 + 153 + 130 + 73 - 20);
    assert_eq!((sender.read(0x07), receiver.ask(0x61, [0; 10]).1), (0x2E, PAYLOAD));
    // No receiver: 1 + 3 attempts, 250 µs from the end of one to the next.
    receiver.low();
    sender.write(0x07, 0x70);
    sender.ask(0xA0, PAYLOAD);
    sender.high();
    sender.wait(130 + 4 * (153 + 250) - 10);
    assert_eq!(sender.read(0x07), 0x0E);
    sender.wait(10);
    assert_eq!((sender.read(0x07), sender.read(0x17)), (0x1E, 0x01), "given up; the payload stays");
    // A packet whose acknowledgement was lost is repeated and not stored twice.
    sender.low();
    sender.ask(0xE1, []);
    sender.write(0x07, 0x70);
    receiver.write(0x07, 0x70);
    receiver.high();
    receiver.wait(130);
    sender.ask(0xA0, [7; 10]);
    sender.high();
    sender.wait(130 + 153 + 50);
    air.jam(2, true);
    sender.wait(200);
    air.jam(2, false);
    sender.wait(1_000);
    assert_eq!((sender.read(0x07), receiver.ask(0x61, [0; 10]).1, receiver.read(0x17)), (0x2E, [7; 10], 0x11));
}

#[test]
fn the_part_without_the_plus_has_other_features_behind_a_lock() {
    let clock = Clock::new(Instant::ZERO);
    let air = Air::new(&clock, 1);
    let mut radio = Radio::of(&clock, Nrf24l01::original(&air));
    clock.advance_to(Instant::from_millis(100));
    assert_eq!(radio.read(0x06), 0x0F);
    radio.write(0x06, 0x27);
    assert_eq!(radio.read(0x06), 0x07, "no 250 kbit/s");
    radio.write(0x1D, 0x04);
    assert_eq!(radio.read(0x1D), 0);
    radio.ask(0x50, [0x73]);
    radio.write(0x1D, 0x04);
    assert_eq!(radio.read(0x1D), 0x04);
}

#[test]
fn a_supply_that_dips_costs_everything_and_a_lost_antenna_only_packets() {
    let (_, air, mut radio) = listening();
    radio.attached.set_broken(true);
    radio.wait(air.send(&PACKET).as_micros());
    assert_eq!((radio.is_interrupting(), radio.read(0x00)), (false, 0x0F));
    radio.attached.set_broken(false);
    radio.attached.reset();
    radio.wait(100_000);
    radio.wait(air.send(&PACKET).as_micros());
    assert_eq!((radio.is_interrupting(), radio.read(0x00)), (false, 0x08));
}
