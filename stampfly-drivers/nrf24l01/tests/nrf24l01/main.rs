//! Tests of the nRF24L01+ driver on the emulated chip: start, packets, bus faults, restarts,
//! dropped calls.

mod another_driver;
mod hisky;

use core::convert::Infallible;
use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use embedded_hal::spi::MODE_0;
use stampfly_nrf24l01::blocking::{self, Blocking, BlockingClock};
use stampfly_nrf24l01::{
    AddressBytes, Checksum, ChipError, Config, Nrf24l01, Power, Rate, SensorError, SensorErrorKind, Tuning,
};
use stampfly_sim::chips::{self, Air, AirPacket, AirRate, Attached, BusError, ChipEnable, Faults, SpiBus, SpiPort};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::{Duration, Instant};

const TUNING: Tuning = Tuning { channel: 40, address: [1, 2, 3, 4, 5] };
const PAYLOAD: [u8; 10] = [9, 8, 7, 6, 5, 4, 3, 2, 1, 0];
const PACKET: AirPacket<'_> =
    AirPacket { channel: 40, rate: AirRate::Mbit1, address: &[1, 2, 3, 4, 5], payload: &PAYLOAD, crc: 2 };

type Radio = Nrf24l01<SpiPort<chips::Nrf24l01>, ChipEnable, Clock>;

struct Bench {
    clock: Clock,
    air: Air,
    bus: SpiBus,
    attached: Attached,
    radio: Radio,
}

fn bench_of(config: Config, chip: impl FnOnce(&Air) -> chips::Nrf24l01) -> Bench {
    let clock = Clock::new(Instant::ZERO);
    let air = Air::new(&clock, 1);
    let bus = SpiBus::new(&clock, 1);
    let (device, attached) = bus.attach(8_000_000, chip(&air));
    let device = device.with_mode(MODE_0);
    let enable = device.chip_enable();
    let radio = Nrf24l01::new(device, enable, clock.clone(), config);
    Bench { clock, air, bus, attached, radio }
}

fn bench() -> Bench {
    bench_of(Config::default(), chips::Nrf24l01::new)
}

impl Bench {
    fn run<T>(&mut self, call: impl AsyncFnOnce(&mut Radio) -> T) -> T {
        block_on(&self.clock, call(&mut self.radio))
    }

    fn wait(&self, micros: u64) {
        self.clock.advance_to(self.clock.now() + Duration::from_micros(micros));
    }

    /// A receiver whose radio has settled.
    fn listening() -> Self {
        let mut bench = bench();
        bench.run(async |radio| radio.listen(TUNING).await).expect("it starts");
        bench.wait(130);
        bench
    }

    fn receive(&mut self) -> Result<Option<[u8; 10]>, ChipError<BusError>> {
        self.run(async |radio| radio.receive().await).map(|packet| packet.map(|packet| packet.payload))
    }
}

#[test]
fn it_starts_after_the_power_on_reset_and_tells_the_chip_what_a_receiver_needs() {
    let mut bench = bench();
    bench.run(async |radio| radio.start().await).expect("it starts");
    let took = bench.clock.now().as_micros();
    assert!((105_000..105_200).contains(&took), "{took}");
    for (register, value) in
        [(0x00, 0x0F), (0x01, 0), (0x02, 1), (0x03, 3), (0x04, 0), (0x11, 10), (0x1C, 0), (0x1D, 0)]
    {
        assert_eq!(bench.attached.peek(register), value, "{register:#04x}");
    }
    bench.run(async |radio| radio.listen(TUNING).await).expect("it listens");
    assert_eq!((bench.attached.peek(0x05), bench.attached.peek(0x0A)), (40, 1));
}

#[test]
fn a_packet_comes_once_and_three_wait() {
    let mut bench = Bench::listening();
    assert_eq!(bench.receive(), Ok(None));
    for number in 0..4_u8 {
        let span = bench.air.send(&AirPacket { payload: &[number; 10], ..PACKET });
        bench.wait(span.as_micros());
    }
    let read: Vec<_> = (0..4).map(|_| bench.receive().expect("an answer").map(|payload| payload[0])).collect();
    assert_eq!(read, [Some(0), Some(1), Some(2), None]);
    assert_eq!(bench.attached.peek(0x07), 0x0E, "no flag is left");
}

#[test]
fn another_channel_keeps_what_was_received_and_another_address_does_not() {
    for (address, kept) in [(TUNING.address, true), ([5; 5], false)] {
        let mut bench = Bench::listening();
        let span = bench.air.send(&PACKET);
        bench.wait(span.as_micros());
        bench.run(async |radio| radio.listen(Tuning { channel: 50, address }).await).expect("it hops");
        assert_eq!(bench.receive(), Ok(kept.then_some(PAYLOAD)));
    }
}

#[test]
fn it_is_deaf_for_130_us_after_a_hop_and_hears_then() {
    for (micros, heard) in [(120, false), (131, true)] {
        let mut bench = Bench::listening();
        bench.run(async |radio| radio.listen(Tuning { channel: 41, ..TUNING }).await).expect("it hops");
        // The driver has already waited for 4 µs after CE.
        bench.wait(micros - 4);
        let span = bench.air.send(&AirPacket { channel: 41, ..PACKET });
        bench.wait(span.as_micros());
        assert_eq!(bench.receive().expect("an answer").is_some(), heard, "{micros}");
    }
}

#[test]
fn what_it_sends_is_heard_at_every_rate_width_and_sum() {
    for rate in [Rate::Kbit250, Rate::Mbit1, Rate::Mbit2] {
        for (checksum, address_bytes) in [
            (Checksum::One, AddressBytes::Three),
            (Checksum::Two, AddressBytes::Four),
            (Checksum::None, AddressBytes::Five),
        ] {
            let config = Config { rate, checksum, address_bytes, power: Power::Minus6, ..Config::default() };
            let mut bench = bench_of(config, chips::Nrf24l01::new);
            let (device, _) = SpiBus::new(&bench.clock, 2).attach(8_000_000, chips::Nrf24l01::new(&bench.air));
            let device = device.with_mode(MODE_0);
            let enable = device.chip_enable();
            let mut sender: Radio = Nrf24l01::new(device, enable, bench.clock.clone(), config);
            let until = Instant::from_secs(1);
            let heard = bench.run(async |radio| {
                radio.listen(TUNING).await?;
                sender.send(TUNING, &PAYLOAD).await?;
                radio.wait(until).await
            });
            assert_eq!(heard.expect("both work").map(|packet| packet.payload), Some(PAYLOAD), "{config:?}");
        }
    }
}

#[test]
fn a_part_without_the_plus_does_all_but_the_slowest_rate() {
    let mut bench = bench_of(Config::default(), chips::Nrf24l01::original);
    bench.run(async |radio| radio.self_test().await).expect("it works");
    let slow = Config { rate: Rate::Kbit250, ..Config::default() };
    let mut bench = bench_of(slow, chips::Nrf24l01::original);
    let refused = bench.run(async |radio| radio.start().await);
    assert_eq!(refused, Err(ChipError::Configuration { status: 0x07 }));
    assert_eq!(bench_of(slow, chips::Nrf24l01::new).run(async |radio| radio.start().await), Ok(()));
}

#[test]
fn nobody_there_is_absent_and_so_is_a_line_that_is_stuck() {
    let mut bench = bench();
    bench.attached.set_faults(Faults { dead: true, ..Faults::default() });
    let absent = bench.run(async |radio| radio.start().await).expect_err("nobody");
    assert_eq!(absent.kind(), SensorErrorKind::Absent);
    bench.attached.set_faults(Faults::default());
    bench.bus.hold_miso(Some(false));
    let absent = bench.run(async |radio| radio.listen(TUNING).await).expect_err("nobody");
    assert_eq!(absent.kind(), SensorErrorKind::Absent);
    bench.bus.hold_miso(None);
    bench.run(async |radio| radio.listen(TUNING).await).expect("it is back");
}

#[test]
fn a_line_that_is_stuck_while_it_listens_makes_no_packet_of_zeros() {
    for high in [false, true] {
        let mut bench = Bench::listening();
        bench.bus.hold_miso(Some(high));
        let error = bench.receive().expect_err("no packet");
        assert_eq!(error, if high { ChipError::Data } else { ChipError::Restarted });
        bench.bus.hold_miso(None);
        bench.run(async |radio| radio.listen(TUNING).await).expect("it is back");
        bench.wait(130);
        let span = bench.air.send(&PACKET);
        bench.wait(span.as_micros());
        assert_eq!(bench.receive(), Ok(Some(PAYLOAD)));
    }
}

#[test]
fn a_chip_that_restarted_says_so_once_whether_it_hops_or_waits() {
    let mut bench = Bench::listening();
    bench.attached.reset();
    bench.wait(100_000);
    let until = bench.clock.now() + Duration::from_millis(10);
    let waited = bench.run(async |radio| radio.wait(until).await);
    assert_eq!(waited, Err(ChipError::Restarted));
    bench.run(async |radio| radio.listen(TUNING).await).expect("set up again");
    bench.attached.reset();
    bench.wait(100_000);
    let hopped = bench.run(async |radio| radio.listen(Tuning { channel: 50, ..TUNING }).await);
    assert_eq!(hopped, Err(ChipError::Restarted));
    bench.run(async |radio| radio.listen(TUNING).await).expect("set up again");
    bench.wait(130);
    let span = bench.air.send(&PACKET);
    bench.wait(span.as_micros());
    assert_eq!(bench.receive(), Ok(Some(PAYLOAD)));
}

#[test]
fn transfers_that_fail_are_errors_of_the_bus_and_nothing_stays_of_them() {
    let mut bench = Bench::listening();
    bench.attached.set_faults(Faults { refusals: 1.0, ..Faults::default() });
    assert_eq!(bench.receive(), Err(ChipError::Bus(BusError::Overrun)));
    let sent = bench.run(async |radio| radio.send(TUNING, &PAYLOAD).await);
    assert_eq!(sent, Err(ChipError::Bus(BusError::Overrun)));
    bench.attached.set_faults(Faults::default());
    bench.run(async |radio| radio.listen(TUNING).await).expect("it listens");
    bench.wait(130);
    let span = bench.air.send(&PACKET);
    bench.wait(span.as_micros());
    assert_eq!(bench.receive(), Ok(Some(PAYLOAD)));
}

#[test]
fn a_self_test_passes_and_fails_with_a_wire_at_ce_that_is_broken() {
    let mut bench = bench();
    bench.run(async |radio| radio.self_test().await).expect("it works");
    assert_eq!(bench.attached.peek(0x06), 0x06, "at its power again");

    struct Loose;
    impl embedded_hal::digital::ErrorType for Loose {
        type Error = Infallible;
    }
    impl embedded_hal::digital::OutputPin for Loose {
        fn set_low(&mut self) -> Result<(), Infallible> {
            Ok(())
        }
        fn set_high(&mut self) -> Result<(), Infallible> {
            Ok(())
        }
    }
    let clock = Clock::new(Instant::ZERO);
    let (device, _) = SpiBus::new(&clock, 1).attach(8_000_000, chips::Nrf24l01::new(&Air::new(&clock, 1)));
    let mut radio = Nrf24l01::<_, _, _, _, 10>::new(device.with_mode(MODE_0), Loose, clock.clone(), Config::default());
    assert_eq!(block_on(&clock, radio.self_test()), Err(ChipError::SelfTest));
}

#[test]
fn a_channel_that_is_none_is_refused_before_anything_is_sent() {
    let mut bench = bench();
    let tuning = Tuning { channel: 126, ..TUNING };
    assert_eq!(bench.run(async |radio| radio.listen(tuning).await), Err(ChipError::InvalidConfiguration));
    assert_eq!(bench.run(async |radio| radio.send(tuning, &PAYLOAD).await), Err(ChipError::InvalidConfiguration));
    assert_eq!(bench.clock.now(), Instant::ZERO);
}

#[test]
fn a_power_down_and_a_carrier() {
    let mut bench = Bench::listening();
    assert_eq!(bench.run(async |radio| radio.carrier().await), Ok(false));
    bench.air.jam(40, true);
    bench.wait(170);
    assert_eq!(bench.run(async |radio| radio.carrier().await), Ok(true));
    bench.run(async |radio| radio.power_down().await).expect("off");
    assert_eq!(bench.attached.peek(0x00), 0x0D);
    bench.air.jam(40, false);
    bench.run(async |radio| radio.listen(TUNING).await).expect("on again");
    bench.wait(130);
    let span = bench.air.send(&PACKET);
    bench.wait(span.as_micros());
    assert_eq!(bench.receive(), Ok(Some(PAYLOAD)));
}

/// Polls a future this number of times and drops it.
fn drop_after<F: Future>(clock: &Clock, polls: usize, future: F) -> bool {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    for _ in 0..polls {
        if future.as_mut().poll(&mut context).is_ready() {
            return true;
        }
        clock.advance_to(clock.now() + Duration::from_micros(50));
    }
    false
}

#[test]
fn a_start_a_hop_and_a_send_may_be_dropped_anywhere() {
    for polls in 1..400 {
        let mut bench = bench();
        bench.clock.advance_to(Instant::from_millis(100));
        let clock = bench.clock.clone();
        let started = drop_after(&clock, polls, bench.radio.listen(TUNING));
        let sent = drop_after(&clock, polls % 40, bench.radio.send(TUNING, &PAYLOAD));
        bench.run(async |radio| radio.listen(TUNING).await).expect("it listens");
        bench.wait(500);
        bench.run(async |radio| radio.listen(TUNING).await).expect("it still does");
        let span = bench.air.send(&PACKET);
        bench.wait(span.as_micros());
        assert_eq!(bench.receive(), Ok(Some(PAYLOAD)), "{polls} {started} {sent}");
    }
}

#[test]
fn it_works_on_a_blocking_bus() {
    let clock = Clock::new(Instant::ZERO);
    let air = Air::new(&clock, 1);
    let (device, _) = SpiBus::new(&clock, 1).attach(8_000_000, chips::Nrf24l01::new(&air));
    let device = device.with_mode(MODE_0);
    let enable = device.chip_enable();
    let time = clock.clone();
    let timebase = BlockingClock::new(clock.clone(), move || stampfly_nrf24l01::Timebase::now(&time));
    let mut radio = Nrf24l01::<_, _, _, _, 10>::new(Blocking(device), enable, timebase, Config::default());
    blocking::block_on(radio.listen(TUNING)).expect("it listens");
    clock.advance_to(clock.now() + Duration::from_micros(130));
    air.send(&PACKET);
    let heard = blocking::block_on(radio.wait(clock.now() + Duration::from_millis(1))).expect("an answer");
    assert_eq!(heard.map(|packet| packet.payload), Some(PAYLOAD));
    let before = clock.now();
    assert_eq!(blocking::block_on(radio.wait(before + Duration::from_millis(5))), Ok(None));
    assert!(clock.now() >= before + Duration::from_millis(5));
}

#[test]
fn a_call_that_waits_for_a_poll_is_ready_only_when_it_is_over() {
    let mut bench = Bench::listening();
    let until = bench.clock.now() + Duration::from_millis(1);
    let mut future = pin!(bench.radio.wait(until));
    assert!(matches!(future.as_mut().poll(&mut Context::from_waker(Waker::noop())), Poll::Pending));
}
