//! The BMI270 driver against a chip of closures: registers, a FIFO that fills with virtual time, and faults.

mod common;

use common::{Access, Clock, Fault, I2cBus, SpiBus, cancel};
use embedded_hal_async::digital::Wait;
use stampfly_drivers::blocking::block_on;
use stampfly_drivers::chip::bmi270::{Bmi270, Config};
use stampfly_drivers::chip::{AxisMap, ChipError};
use stampfly_drivers::{Imu, SensorError, SensorErrorKind, Timebase};
use stampfly_types::{Duration, Instant};
use std::cell::RefCell;
use std::rc::Rc;

const BLOB: [u8; 600] = [0xC8; 600];
/// Nominal chip period in nanoseconds, of 16 ticks.
const PERIOD: u64 = 625_000;

struct Chip {
    clock: Clock,
    registers: [u8; 128],
    writes: Vec<(u8, Vec<u8>)>,
    /// Chip samples taken out of the FIFO so far.
    consumed: u64,
    /// The next FIFO read begins with this header.
    header: Option<u8>,
    /// Faults of the next reads of a register.
    faults: Vec<(u8, Fault)>,
    /// A bit of the next read of a register arrives the other way round.
    flip: Option<(u8, usize)>,
    starts: bool,
    frozen: bool,
    /// Chip period in nanoseconds.
    period: u64,
    /// Counts of one sample: accelerometer, gyroscope.
    sample: fn(u64) -> [i16; 6],
}

impl Chip {
    fn new(clock: &Clock) -> Self {
        let mut registers = [0; 128];
        registers[0x00] = 0x24;
        Self {
            clock: clock.clone(),
            registers,
            writes: Vec::new(),
            consumed: 0,
            header: None,
            faults: Vec::new(),
            flip: None,
            starts: true,
            frozen: false,
            period: PERIOD,
            sample: |_| [100, 200, -4096, 164, -328, 16],
        }
    }

    fn nanos(&self) -> u64 {
        self.clock.now().as_micros() * 1_000
    }

    /// Chip samples taken until now.
    fn produced(&self) -> u64 {
        if self.frozen { self.consumed } else { self.nanos() / self.period }
    }

    fn access(&mut self, access: Access<'_>) -> Result<(), Fault> {
        match access {
            Access::Write(register, data) => {
                self.writes.push((register, data.to_vec()));
                match (register, data) {
                    (0x7E, [0xB6]) => self.registers[0x21] = 0,
                    (0x7E, [0xB0]) => self.consumed = self.produced(),
                    (0x59, [1]) => self.registers[0x21] = if self.starts { 1 } else { 2 },
                    (0x5E, _) => {}
                    // Deflections of ±9 g on every axis with the data sheet's signs.
                    (0x6D, [command]) => {
                        let sign: i16 = if command & 4 != 0 { 18_432 } else { -18_432 };
                        for (axis, value) in [sign, -sign, sign].into_iter().enumerate() {
                            self.registers[0x0C + 2 * axis..][..2].copy_from_slice(&value.to_le_bytes());
                        }
                    }
                    _ => self.registers[usize::from(register)..][..data.len()].copy_from_slice(data),
                }
            }
            Access::Read(register, into) => {
                if let Some(position) = self.faults.iter().position(|(at, _)| *at == register) {
                    return Err(self.faults.remove(position).1);
                }
                let nanos = self.nanos();
                self.registers[0x18..0x1B]
                    .copy_from_slice(&(nanos % self.period * 16 / self.period).to_le_bytes()[..3]);
                let bytes = ((self.produced() - self.consumed).min(157) * 13) as u16;
                self.registers[0x24..0x26].copy_from_slice(&bytes.to_le_bytes());
                if register == 0x26 {
                    for frame in into.chunks_mut(13) {
                        self.consumed += 1;
                        let [accel @ .., gx, gy, gz] = (self.sample)(self.consumed);
                        frame[0] = self.header.take().unwrap_or(0x8C);
                        let words = [gx, gy, gz].into_iter().chain(accel);
                        for (bytes, word) in frame[1..].chunks_mut(2).zip(words) {
                            bytes.copy_from_slice(&word.to_le_bytes());
                        }
                    }
                } else {
                    into.copy_from_slice(&self.registers[usize::from(register)..][..into.len()]);
                }
                if let Some((_, bit)) = self.flip.take_if(|(at, _)| *at == register) {
                    into[bit / 8] ^= 1 << (bit % 8);
                }
            }
        }
        Ok(())
    }
}

type Shared = Rc<RefCell<Chip>>;

fn bench() -> (Clock, Shared) {
    let clock = Clock::new();
    let chip = Rc::new(RefCell::new(Chip::new(&clock)));
    (clock, chip)
}

fn driver(
    clock: &Clock,
    chip: &Shared,
    config: Config,
) -> Bmi270<'static, impl stampfly_drivers::chip::Registers<Error = Fault>, Clock> {
    let chip = chip.clone();
    let bus = SpiBus { clock: clock.clone(), chip: move |access: Access<'_>| chip.borrow_mut().access(access) };
    Bmi270::spi(bus, clock.clone(), &BLOB, AxisMap::STAMPFLY_IMU, config)
}

#[test]
fn it_starts_as_the_data_sheet_says_and_uploads_every_byte_where_it_belongs() {
    let (clock, chip) = bench();
    block_on(driver(&clock, &chip, Config::default()).start()).expect("starts");
    let chip = chip.borrow();
    let registers: Vec<u8> = chip.writes.iter().map(|(register, _)| *register).collect();
    assert_eq!(
        registers,
        [0x7E, 0x7C, 0x59, 0x5B, 0x5E, 0x5B, 0x5E, 0x5B, 0x5E, 0x59, 0x40, 0x45, 0x48, 0x7D, 0x7C, 0x7E]
    );
    let addresses: Vec<&[u8]> = chip.writes.iter().filter(|w| w.0 == 0x5B).map(|w| &w.1[..]).collect();
    assert_eq!(addresses, [[0, 0], [0, 8], [0, 16]]);
    let uploaded: Vec<u8> = chip.writes.iter().filter(|w| w.0 == 0x5E).flat_map(|w| w.1.clone()).collect();
    assert_eq!(uploaded, BLOB);
    assert_eq!(chip.registers[0x40..0x44], [0xAC, 0x02, 0xEC, 0x00]);
    assert_eq!(chip.registers[0x48..0x4A], [0x00, 0xD0]);
}

#[test]
fn samples_come_at_400_hz_in_si_units_and_body_axes_with_the_cross_axis_correction() {
    let (clock, chip) = bench();
    // −64/512 of the rate about z belongs to x.
    chip.borrow_mut().registers[0x3C] = 0x40;
    chip.borrow_mut().registers[0x22..0x24].copy_from_slice(&[0x00, 0x02]);
    let mut imu = driver(&clock, &chip, Config::default());
    let first = block_on(imu.next()).expect("a sample");
    let mut before = first.at;
    for _ in 0..400 {
        let sample = block_on(imu.next()).expect("a sample");
        let step = sample.at.since(before).as_micros();
        assert!((2_450..=2_550).contains(&step), "one tick of the chip's clock: {step}");
        before = sample.at;
        let latency = clock.now().since(sample.at).as_micros();
        assert!((1_875..2_150).contains(&latency), "three chip samples, the aim and two transfers: {latency}");
    }
    let g = stampfly_types::GRAVITY / 4096.0;
    assert!((first.data.accel - stampfly_types::Vec3::new(200.0 * g, 100.0 * g, 4096.0 * g)).norm() < 1e-5);
    let degrees = first.data.gyro.map(f32::to_degrees);
    assert!((degrees - stampfly_types::Vec3::new(-20.0, 10.0 + 2.0 / 16.4, -16.0 / 16.4)).norm() < 1e-4, "{degrees}");
    assert_eq!(first.data.temperature, 24.0);
    assert!((before.since(first.at).seconds() - 1.0).abs() < 1e-3);
}

#[test]
fn the_stamp_is_the_middle_of_the_filter() {
    let (clock, chip) = bench();
    // A ramp: the value of chip sample n, taken at n periods, is n modulo a large number.
    chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
    let mut imu = driver(&clock, &chip, Config::default());
    for _ in 0..20 {
        let sample = block_on(imu.next()).expect("a sample");
        let counts = sample.data.accel.x / stampfly_types::GRAVITY * 4096.0;
        let instant = Instant::from_micros((counts.round() as u64) * PERIOD / 1_000);
        assert!(sample.at.as_micros().abs_diff(instant.as_micros()) <= 60, "{} {}", sample.at, instant);
    }
}

#[test]
fn a_chip_clock_that_is_off_costs_no_sample() {
    for period in [PERIOD * 97 / 100, PERIOD * 103 / 100] {
        let (clock, chip) = bench();
        chip.borrow_mut().period = period;
        chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
        let mut imu = driver(&clock, &chip, Config::default());
        let mut before = block_on(imu.next()).expect("a sample");
        for _ in 0..500 {
            let sample = block_on(imu.next()).expect("a sample");
            let step = (sample.data.accel.x - before.data.accel.x) / stampfly_types::GRAVITY * 4096.0;
            assert!((step - 4.0).abs() < 1e-2, "{step}");
            // One tick, and three nominal periods that the chip makes in another time.
            assert!((sample.at.since(before.at).as_micros() * 1_000).abs_diff(4 * period) <= 60_000);
            assert!(clock.now().since(sample.at) < Duration::from_micros(2_300));
            before = sample;
        }
    }
}

#[test]
fn a_late_reader_gets_every_sample() {
    let (clock, chip) = bench();
    chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
    let mut imu = driver(&clock, &chip, Config::default());
    let mut before = block_on(imu.next()).expect("a sample").data.accel.x;
    for round in 0..50 {
        if round == 10 {
            clock.advance(60_000);
        }
        let now = block_on(imu.next()).expect("a sample").data.accel.x;
        let step = (now - before) / stampfly_types::GRAVITY * 4096.0;
        assert!((step - 4.0).abs() < 1e-2, "four chip samples on: {step}");
        before = now;
    }
}

#[test]
fn an_overrun_starts_anew_instead_of_mixing_old_samples_with_new() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    clock.advance(300_000);
    chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
    let sample = block_on(imu.next()).expect("a sample");
    let counts = sample.data.accel.x / stampfly_types::GRAVITY * 4096.0;
    assert!(sample.at.as_micros().abs_diff(counts.round() as u64 * PERIOD / 1_000) <= 60);
    assert!(clock.now().since(sample.at) < Duration::from_micros(2_150));
}

#[test]
fn lost_samples_restart_the_filter_and_cost_two_periods() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    let before = block_on(imu.next()).expect("a sample").at;
    chip.borrow_mut().header = Some(0x40);
    let after = block_on(imu.next()).expect("a sample").at;
    assert!((7_000..=8_000).contains(&after.since(before).as_micros()), "{}", after.since(before));
    assert_eq!(chip.borrow().writes.iter().filter(|w| w.0 == 0x7E && w.1 == [0xB0]).count(), 2);
}

#[test]
fn another_chip_is_told_apart_from_one_that_does_not_start() {
    let (clock, chip) = bench();
    chip.borrow_mut().registers[0] = 0xD1;
    let error = block_on(driver(&clock, &chip, Config::default()).next()).expect_err("a BMI160");
    assert_eq!(error, ChipError::Identification { found: 0xD1 });
    assert_eq!(error.kind(), SensorErrorKind::Identification);
    let (clock, chip) = bench();
    chip.borrow_mut().starts = false;
    let error = block_on(driver(&clock, &chip, Config::default()).next()).expect_err("a broken file");
    assert_eq!(error, ChipError::Configuration { status: 2 });
}

#[test]
fn a_chip_that_forever_initialises_is_given_up() {
    let (clock, chip) = bench();
    let shared = chip.clone();
    let bus = SpiBus {
        clock: clock.clone(),
        chip: move |access: Access<'_>| {
            let outcome = shared.borrow_mut().access(access);
            shared.borrow_mut().registers[0x21] = 0;
            outcome
        },
    };
    let before = clock.now();
    let outcome = block_on(Bmi270::spi(bus, clock.clone(), &BLOB, AxisMap::IDENTITY, Config::default()).start());
    assert_eq!(outcome, Err(ChipError::Configuration { status: 0 }));
    assert!(clock.now().since(before) < Duration::from_millis(170));
}

#[test]
fn a_configuration_that_cannot_be_is_not_sent() {
    for blob in [&[][..], &[0; 7], &[0; 8_194]] {
        let (clock, chip) = bench();
        let shared = chip.clone();
        let bus = SpiBus { clock: clock.clone(), chip: move |access: Access<'_>| shared.borrow_mut().access(access) };
        let outcome = block_on(Bmi270::spi(bus, clock, blob, AxisMap::IDENTITY, Config::default()).start());
        assert_eq!(outcome, Err(ChipError::InvalidConfiguration));
        assert!(chip.borrow().writes.is_empty());
    }
}

#[test]
fn a_chip_that_stops_sampling_times_out_and_is_set_up_again() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    chip.borrow_mut().frozen = true;
    let before = clock.now();
    let error = block_on(imu.next()).expect_err("nothing new");
    assert_eq!((error, error.kind()), (ChipError::NoSample, SensorErrorKind::Timeout));
    assert!(clock.now().since(before) < Duration::from_millis(15), "{}", clock.now().since(before));
    chip.borrow_mut().frozen = false;
    chip.borrow_mut().writes.clear();
    block_on(imu.next()).expect("a sample");
    assert!(chip.borrow().writes.iter().any(|w| w.0 == 0x5E), "uploaded again");
}

#[test]
fn a_brown_out_is_noticed_at_the_next_read_and_healed_by_the_one_after() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    chip.borrow_mut().registers[0x21] = 0;
    assert_eq!(block_on(imu.next()), Err(ChipError::Restarted));
    block_on(imu.next()).expect("a sample");
}

#[test]
fn one_wrong_bit_anywhere_in_flight_costs_no_more_than_a_sample() {
    for (register, bytes) in [(0x18, 14), (0x26, 52)] {
        for bit in 0..8 * bytes {
            let (clock, chip) = bench();
            let mut imu = driver(&clock, &chip, Config::default());
            let mut sample = block_on(imu.next()).expect("a sample");
            let mut came = clock.now();
            chip.borrow_mut().flip = Some((register, bit));
            for _ in 0..5 {
                let before = core::mem::replace(&mut sample, block_on(imu.next()).expect("a sample"));
                let (gap, step) = (clock.now().since(came), sample.at.since(before.at));
                came = clock.now();
                let place = format!("bit {bit} of {register:#04x}");
                assert!(gap <= Duration::from_millis(5), "{place}: {gap} without a sample");
                assert!(
                    (Duration::from_micros(1_800)..=Duration::from_micros(3_200)).contains(&step),
                    "{place}: the next one is {step} later"
                );
            }
            assert_eq!(chip.borrow().flip, None, "it was read");
        }
    }
}

#[test]
fn after_refused_transfers_the_samples_made_meanwhile_come_at_once() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    for register in [0x18, 0x26] {
        block_on(imu.next()).expect("a sample");
        chip.borrow_mut().faults.push((register, Fault::Nack));
        assert_eq!(block_on(imu.next()), Err(ChipError::Bus(Fault::Nack)));
        clock.advance(18_000);
        let begun = clock.now();
        let sample = block_on(imu.next()).expect("a sample");
        assert!(clock.now().since(begun) < Duration::from_micros(1_000), "{}", clock.now().since(begun));
        assert!(begun.since(sample.at) > Duration::from_micros(10_000), "from the time of the refusals");
    }
}

#[test]
fn bus_faults_cost_one_call_each_and_bounded_time() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    for (register, fault, expected) in [
        (0x18, Fault::Nack, ChipError::Bus(Fault::Nack)),
        (0x26, Fault::Nack, ChipError::Bus(Fault::Nack)),
        (0x18, Fault::Hang, ChipError::BusTimeout),
        (0x26, Fault::Hang, ChipError::BusTimeout),
    ] {
        chip.borrow_mut().faults.push((register, fault));
        let before = clock.now();
        assert_eq!(block_on(imu.next()), Err(expected));
        assert!(clock.now().since(before) <= Duration::from_millis(13));
        block_on(imu.next()).expect("a sample");
    }
}

#[test]
fn a_call_dropped_in_the_middle_of_a_fifo_read_never_mixes_old_samples_with_new() {
    let (clock, chip) = bench();
    chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
    let mut imu = driver(&clock, &chip, Config::default());
    block_on(imu.next()).expect("a sample");
    chip.borrow_mut().faults.push((0x26, Fault::Hang));
    // The bus hangs in the FIFO read, and whoever asked loses patience before the driver does.
    clock.advance(2_500);
    clock.stop(true);
    cancel(imu.next());
    clock.stop(false);
    assert!(chip.borrow().faults.is_empty(), "it was the FIFO read that hung");
    let sample = block_on(imu.next()).expect("a sample");
    let counts = sample.data.accel.x / stampfly_types::GRAVITY * 4096.0;
    assert!(sample.at.as_micros().abs_diff(counts.round() as u64 * PERIOD / 1_000) <= 60);
}

#[test]
fn the_self_test_tells_masses_that_move_from_masses_that_do_not() {
    let (clock, chip) = bench();
    let mut imu = driver(&clock, &chip, Config::default());
    assert_eq!(block_on(imu.self_test()), Ok(()));
    block_on(imu.next()).expect("set up again");
    let shared = chip.clone();
    let stuck = SpiBus {
        clock: clock.clone(),
        chip: move |access: Access<'_>| match access {
            Access::Write(0x6D, _) => Ok(()),
            other => shared.borrow_mut().access(other),
        },
    };
    let outcome = {
        chip.borrow_mut().registers[0x0C..0x12].fill(0);
        block_on(Bmi270::spi(stuck, clock.clone(), &BLOB, AxisMap::IDENTITY, Config::default()).self_test())
    };
    assert_eq!(outcome, Err(ChipError::SelfTest));
}

#[test]
fn it_works_on_i2c_too() {
    let (clock, chip) = bench();
    let shared = chip.clone();
    let bus = I2cBus {
        address: 0x68,
        clock: clock.clone(),
        chip: move |access: Access<'_>| shared.borrow_mut().access(access),
    };
    let mut imu = Bmi270::i2c(bus, 0x68, clock, &BLOB, AxisMap::STAMPFLY_IMU, Config::default());
    let sample = block_on(imu.next()).expect("a sample");
    assert!((sample.data.accel.z - stampfly_types::GRAVITY).abs() < 1e-5);
}

/// INT1: high while four frames are in the FIFO. Whoever waits moves time on to when they are.
struct Pin {
    clock: Clock,
    chip: Shared,
    behaviour: Behaviour,
    waits: Rc<RefCell<u32>>,
}

#[derive(Clone, Copy)]
enum Behaviour {
    Works,
    Silent,
    Stuck,
    Refuses,
}

impl embedded_hal::digital::ErrorType for Pin {
    type Error = embedded_hal::digital::ErrorKind;
}

impl Wait for Pin {
    async fn wait_for_high(&mut self) -> Result<(), Self::Error> {
        *self.waits.borrow_mut() += 1;
        match self.behaviour {
            Behaviour::Works => {
                let chip = self.chip.borrow();
                assert_eq!(chip.registers[0x46..0x48], [52, 0], "four frames");
                assert_eq!([chip.registers[0x53], chip.registers[0x55], chip.registers[0x58]], [0x0A, 0, 0x02]);
                let high = ((chip.consumed + 4) * chip.period).div_ceil(1_000);
                self.clock.advance(high.saturating_sub(self.clock.now().as_micros()));
                Ok(())
            }
            Behaviour::Silent => std::future::pending().await,
            Behaviour::Stuck => Ok(()),
            Behaviour::Refuses => Err(embedded_hal::digital::ErrorKind::Other),
        }
    }
    async fn wait_for_low(&mut self) -> Result<(), Self::Error> {
        unreachable!()
    }
    async fn wait_for_rising_edge(&mut self) -> Result<(), Self::Error> {
        unreachable!()
    }
    async fn wait_for_falling_edge(&mut self) -> Result<(), Self::Error> {
        unreachable!()
    }
    async fn wait_for_any_edge(&mut self) -> Result<(), Self::Error> {
        unreachable!()
    }
}

#[test]
fn with_the_pin_it_follows_the_chips_clock() {
    for period in [PERIOD * 97 / 100, PERIOD, PERIOD * 103 / 100] {
        let (clock, chip) = bench();
        chip.borrow_mut().period = period;
        chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
        let waits = Rc::default();
        let pin =
            Pin { clock: clock.clone(), chip: chip.clone(), behaviour: Behaviour::Works, waits: Rc::clone(&waits) };
        let mut imu = driver(&clock, &chip, Config::default()).with_interrupt(pin);
        let mut before = block_on(imu.next()).expect("a sample");
        let first = *waits.borrow();
        for _ in 0..500 {
            let sample = block_on(imu.next()).expect("a sample");
            let step = (sample.data.accel.x - before.data.accel.x) / stampfly_types::GRAVITY * 4096.0;
            assert!((step - 4.0).abs() < 1e-2, "{step}");
            let latency = clock.now().since(sample.at).as_micros();
            assert!(latency < 2_150, "no later than without: {latency}");
            before = sample;
        }
        assert_eq!(*waits.borrow() - first, 500, "one wait a sample");
    }
}

#[test]
fn a_pin_that_cannot_be_trusted_is_ignored() {
    for behaviour in [Behaviour::Silent, Behaviour::Stuck, Behaviour::Refuses] {
        let (clock, chip) = bench();
        let waits = Rc::default();
        let pin = Pin { clock: clock.clone(), chip: chip.clone(), behaviour, waits: Rc::clone(&waits) };
        let mut imu = driver(&clock, &chip, Config::default()).with_interrupt(pin);
        let mut before = block_on(imu.next()).expect("a sample").at;
        for round in 0..100 {
            let sample = block_on(imu.next()).expect("a sample");
            assert!((2_450..=2_550).contains(&sample.at.since(before).as_micros()));
            let latency = clock.now().since(sample.at).as_micros();
            assert!(latency < if round < 8 { 2_150 + 312 } else { 2_150 }, "{latency} in round {round}");
            before = sample.at;
        }
        assert_eq!(*waits.borrow(), 4, "and never again");
        chip.borrow_mut().registers[0x21] = 0;
        assert_eq!(block_on(imu.next()), Err(ChipError::Restarted));
        block_on(imu.next()).expect("a sample");
        assert!(*waits.borrow() > 4, "until the chip is set up again");
    }
}

#[test]
fn the_gyroscopes_self_test_is_started_awaited_and_given_up() {
    for (axes, status, ends, outcome) in [
        (0x0F, 0x00, true, Ok(())),
        (0x0F, 0x07, true, Ok(())),
        (0x0D, 0x00, true, Err(ChipError::SelfTest)),
        (0x01, 0x00, true, Err(ChipError::SelfTest)),
        (0x00, 0x00, true, Err(ChipError::SelfTest)),
        (0x0F, 0x08, true, Err(ChipError::SelfTest)),
        (0x0F, 0x00, false, Err(ChipError::SelfTest)),
    ] {
        let (clock, chip) = bench();
        chip.borrow_mut().registers[0x6E] = axes;
        chip.borrow_mut().registers[0x38] = status;
        let (shared, time, mut asked) = (chip.clone(), clock.clone(), None);
        let bus = SpiBus {
            clock: clock.clone(),
            chip: move |access: Access<'_>| {
                let mut chip = shared.borrow_mut();
                if let Access::Read(0x69, _) = access {
                    let command = chip.writes.last().expect("writes");
                    assert_eq!((command.0, &command.1[..]), (0x7E, &[0x02][..]));
                    // A third of a second.
                    let begun = *asked.get_or_insert(time.now());
                    if ends && time.now().since(begun) > Duration::from_millis(333) {
                        chip.registers[0x69] = 0;
                    }
                }
                chip.access(access)
            },
        };
        let mut imu = Bmi270::spi(bus, clock.clone(), &BLOB, AxisMap::STAMPFLY_IMU, Config::default());
        let begun = clock.now();
        assert_eq!(block_on(imu.gyro_self_test()), outcome, "{axes:#04x} {status:#04x}");
        let took = clock.now().since(begun);
        assert!(took < Duration::from_millis(2_200) && took > Duration::from_millis(333), "{took}");
        let writes = chip.borrow().writes.clone();
        let test: Vec<(u8, &[u8])> = writes.iter().map(|write| (write.0, &write.1[..])).collect();
        let expected: [(u8, &[u8]); 5] =
            [(0x69, &[0x04]), (0x7D, &[0x04]), (0x2F, &[1]), (0x32, &[0, 0]), (0x7E, &[0x02])];
        assert!(test.windows(5).any(|five| five == expected), "{test:02x?}");
        chip.borrow_mut().registers[0x69] = 0;
        block_on(imu.next()).expect("set up again");
    }
}
