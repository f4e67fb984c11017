//! Buses: transfer times, sharing, and all faults.

use crate::standing;
use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource, Operation};
use embedded_hal::spi::Operation as SpiOperation;
use stampfly_sim::chips::{Bmp280, BusError, Chip, Faults, I2cBus, Pmw3901, SpiBus, SpiChip};
use stampfly_sim::time::{Clock, Tasks, block_on};
use stampfly_types::{Duration, Instant};
use std::cell::RefCell;

const ADDRESS: u8 = 0x76;
const NACK: BusError = BusError::NoAcknowledge(NoAcknowledgeSource::Address);

fn bus(seed: u64) -> (Clock, I2cBus, stampfly_sim::chips::Attached) {
    let simulation = standing();
    let bus = I2cBus::new(&simulation.clock, seed);
    let chip = bus.attach(ADDRESS, Bmp280::new(&simulation.world, &simulation.clock, 1));
    (simulation.clock, bus, chip)
}

/// Reads the identity with the blocking trait.
fn id(bus: &mut I2cBus) -> Result<u8, BusError> {
    let mut id = [0];
    embedded_hal::i2c::I2c::write_read(bus, ADDRESS, &[0xD0], &mut id)?;
    Ok(id[0])
}

#[test]
fn both_traits_cost_the_bits_of_the_transfer() {
    let (clock, mut bus, _) = bus(1);
    let mut data = [0; 24];
    // Start, address, register, start, address, 24 bytes, stop: 246 bits of 2.5 µs.
    block_on(&clock, embedded_hal_async::i2c::I2c::write_read(&mut bus, ADDRESS, &[0x88], &mut data)).unwrap();
    assert_eq!(clock.now(), Instant::from_micros(615));
    embedded_hal::i2c::I2c::write_read(&mut bus, ADDRESS, &[0x88], &mut data).unwrap();
    assert_eq!(clock.now(), Instant::from_micros(1_230));
    // Consecutive writes are joined without a second start.
    let mut operations = [Operation::Write(&[0xF5]), Operation::Write(&[0])];
    embedded_hal::i2c::I2c::transaction(&mut bus, ADDRESS, &mut operations).unwrap();
    assert_eq!(clock.now(), Instant::from_micros(1_230 + 73));
}

#[test]
fn tasks_share_the_bus_one_after_the_other() {
    let (clock, bus, _) = bus(1);
    let ends = RefCell::new(Vec::new());
    let mut tasks = Tasks::new(clock.clone());
    for _ in 0..3 {
        let (mut bus, clock, ends) = (bus.clone(), clock.clone(), &ends);
        tasks.spawn(async move {
            let mut id = [0];
            embedded_hal_async::i2c::I2c::write_read(&mut bus, ADDRESS, &[0xD0], &mut id).await.unwrap();
            assert_eq!(id, [0x58]);
            ends.borrow_mut().push(clock.now().as_micros());
        });
    }
    tasks.run_until(Instant::from_millis(1));
    drop(tasks);
    assert_eq!(ends.into_inner(), [98, 196, 294]);
}

#[test]
fn an_absent_or_dead_chip_does_not_acknowledge_and_costs_one_byte() {
    let (clock, mut bus, chip) = bus(1);
    assert_eq!(embedded_hal::i2c::I2c::write(&mut bus, 0x77, &[0; 100]), Err(NACK));
    assert_eq!(clock.now(), Instant::from_micros(28), "eleven bits");
    chip.set_faults(Faults { dead: true, ..Default::default() });
    assert_eq!(id(&mut bus), Err(NACK));
    chip.set_faults(Faults::default());
    assert_eq!(id(&mut bus), Ok(0x58));
    assert_eq!(embedded_hal::i2c::Error::kind(&NACK), ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
}

#[test]
fn a_held_data_line_blocks_everybody_until_nine_pulses() {
    let (clock, mut bus, _) = bus(1);
    bus.hold_sda();
    for _ in 0..3 {
        let before = clock.now();
        assert_eq!(id(&mut bus), Err(BusError::ArbitrationLost));
        assert!(clock.now().since(before) < Duration::from_micros(10), "no endless wait");
    }
    (0..8).for_each(|_| bus.pulse_scl());
    assert!(!bus.sda_is_high());
    bus.pulse_scl();
    assert!(bus.sda_is_high());
    assert_eq!(id(&mut bus), Ok(0x58));
}

#[test]
fn a_shorted_data_line_stays_low_whatever_is_clocked() {
    let (_, mut bus, _) = bus(1);
    bus.short_sda(true);
    (0..20).for_each(|_| bus.pulse_scl());
    assert!(!bus.sda_is_high() && id(&mut bus) == Err(BusError::ArbitrationLost));
    bus.short_sda(false);
    assert_eq!(id(&mut bus), Ok(0x58));
}

#[test]
fn a_stuck_line_from_the_chips_reads_the_same_of_all() {
    let simulation = standing();
    let (mut port, _) =
        SpiBus::new(&simulation.clock, 1).attach(2_000_000, Bmp280::new(&simulation.world, &simulation.clock, 1));
    simulation.clock.advance_to(Instant::from_millis(2));
    let mut read = || {
        let mut id = [0x11; 2];
        embedded_hal::spi::SpiDevice::transfer(&mut port, &mut id, &[0xD0]).unwrap();
        port.bus().hold_miso(Some(false));
        id[1]
    };
    assert_eq!([read(), read()], [0x58, 0]);
    port.bus().hold_miso(None);
    let mut id = [0; 2];
    embedded_hal::spi::SpiDevice::transfer(&mut port, &mut id, &[0xD0]).unwrap();
    assert_eq!(id[1], 0x58);
}

#[test]
fn refusals_and_bit_errors_come_at_their_rate_and_repeat_with_the_seed() {
    let run = |seed| {
        let (_, mut bus, chip) = bus(seed);
        chip.set_faults(Faults { refusals: 0.25, bit_errors: 0.01, ..Default::default() });
        (0..2_000).map(|_| id(&mut bus)).collect::<Vec<_>>()
    };
    let answers = run(5);
    let refused = answers.iter().filter(|answer| answer.is_err()).count();
    assert!((420..580).contains(&refused), "{refused}");
    // Sixteen bits matter: an error in about 15 of 100 transfers.
    let wrong = answers.iter().flatten().filter(|id| **id != 0x58).count();
    assert!((160..290).contains(&wrong), "{wrong}");
    assert_eq!(answers, run(5));
    assert_ne!(answers, run(6));
}

#[test]
fn a_chip_may_stretch_the_clock() {
    let (clock, mut bus, chip) = bus(1);
    chip.set_faults(Faults { stretch: Duration::from_micros(700), ..Default::default() });
    assert_eq!(id(&mut bus), Ok(0x58));
    assert_eq!(clock.now(), Instant::from_micros(798));
}

#[test]
fn another_part_shows_in_the_identity_and_a_reset_in_the_settings() {
    let (clock, mut bus, chip) = bus(1);
    clock.advance_to(Instant::from_millis(3));
    chip.set_id(0x60);
    assert_eq!(id(&mut bus), Ok(0x60));
    embedded_hal::i2c::I2c::write(&mut bus, ADDRESS, &[0xF5, 0x48]).unwrap();
    let mut config = [0];
    embedded_hal::i2c::I2c::write_read(&mut bus, ADDRESS, &[0xF5], &mut config).unwrap();
    assert_eq!(config, [0x48]);
    chip.reset();
    embedded_hal::i2c::I2c::write_read(&mut bus, ADDRESS, &[0xF5], &mut config).unwrap();
    assert_eq!(config, [0]);
}

#[test]
fn a_dropped_transfer_occupies_the_line_and_changes_nothing() {
    let (clock, bus, _) = bus(1);
    clock.advance_to(Instant::from_millis(3));
    let start = clock.now();
    let mut dropped = bus.clone();
    {
        let mut future = std::pin::pin!(embedded_hal_async::i2c::I2c::write(&mut dropped, ADDRESS, &[0xF5, 0x48]));
        let mut context = std::task::Context::from_waker(std::task::Waker::noop());
        assert!(future.as_mut().poll(&mut context).is_pending());
    }
    let mut bus = bus;
    let mut config = [9];
    block_on(&clock, embedded_hal_async::i2c::I2c::write_read(&mut bus, ADDRESS, &[0xF5], &mut config)).unwrap();
    assert_eq!((config, clock.now().since(start)), ([0], Duration::from_micros(73 + 98)));
}

/// A chip that answers the previous byte and records the instant.
#[derive(Debug, Default)]
struct Echo {
    last: u8,
    times: Vec<(usize, u64)>,
    releases: u8,
}

impl Chip for Echo {
    fn read(&mut self, _: u16, _: Instant) -> u16 {
        u16::from(self.releases)
    }
    fn write(&mut self, _: u16, _: u16, _: Instant) {}
    fn reset(&mut self, _: Instant) {
        *self = Self::default();
    }
    fn set_id(&mut self, _: u16) {}
}

impl SpiChip for Echo {
    const HIGHEST_CLOCK: u32 = 10_000_000;

    fn answer(&mut self, _: usize, _: Instant) -> u8 {
        self.last
    }
    fn take(&mut self, index: usize, byte: u8, now: Instant) {
        self.times.push((index, now.as_micros()));
        self.last = byte;
    }
    fn release(&mut self, _: Instant) {
        self.releases += 1;
        self.times.clear();
    }
}

#[test]
fn spi_transfers_cost_their_bits_and_delays() {
    use embedded_hal::spi::Operation;
    let clock = Clock::new(Instant::ZERO);
    let bus = SpiBus::new(&clock, 1);
    let (mut fast, attached) = bus.attach(8_000_000, Echo::default());
    let (mut slow, _) = bus.attach(2_000_000, Echo::default());
    let mut read = [0; 3];
    embedded_hal::spi::SpiDevice::transfer(&mut fast, &mut read, &[1, 2, 3]).unwrap();
    assert_eq!((read, clock.now()), ([0, 1, 2], Instant::from_micros(3)));
    let mut answer = [0; 2];
    let mut operations = [Operation::Write(&[7]), Operation::DelayNs(35_000), Operation::Read(&mut answer)];
    block_on(&clock, embedded_hal_async::spi::SpiDevice::transaction(&mut slow, &mut operations)).unwrap();
    assert_eq!((answer, clock.now()), ([7, 0], Instant::from_micros(3 + 4 + 35 + 8)));

    attached.set_faults(Faults { dead: true, ..Default::default() });
    embedded_hal::spi::SpiDevice::transfer_in_place(&mut fast, &mut read).unwrap();
    assert_eq!(read, [0xFF; 3], "nobody drives the line");
    attached.set_faults(Faults { refusals: 1.0, ..Default::default() });
    assert_eq!(embedded_hal::spi::SpiDevice::read(&mut fast, &mut read), Err(BusError::Overrun));
}

#[test]
fn a_fault_of_one_chip_leaves_its_neighbours_alone() {
    use stampfly_sim::chips::{Bmm150, Ina3221};
    let simulation = standing();
    let clock = simulation.clock.clone();
    let mut bus = I2cBus::new(&clock, 1);
    let barometer = bus.attach(ADDRESS, Bmp280::new(&simulation.world, &clock, 1));
    let compass = bus.attach(0x10, Bmm150::new(&simulation.world, &clock, 1));
    bus.attach(0x40, Ina3221::new(&simulation.world, &clock, 1));
    barometer.set_faults(Faults { dead: true, ..Default::default() });
    compass.set_faults(Faults { refusals: 1.0, ..Default::default() });
    let mut word = [0; 2];
    for _ in 0..100 {
        assert_eq!(id(&mut bus), Err(NACK));
        assert_eq!(embedded_hal::i2c::I2c::write(&mut bus, 0x10, &[0x4B, 1]), Err(NACK));
        embedded_hal::i2c::I2c::write_read(&mut bus, 0x40, &[0xFF], &mut word).unwrap();
        assert_eq!(word, [0x32, 0x20]);
    }
    compass.set_faults(Faults::default());
    assert_eq!(embedded_hal::i2c::I2c::write(&mut bus, 0x10, &[0x4B, 1]), Ok(()));
}

#[test]
fn two_chips_share_the_spi_wires_one_after_the_other() {
    use stampfly_sim::chips::{Bmi270, Pmw3901};
    let simulation = standing();
    let clock = simulation.clock.clone();
    let bus = SpiBus::new(&clock, 1);
    let (imu, _) = bus.attach(8_000_000, Bmi270::new(&simulation.world, &clock, 1, 1.0, &[1]));
    let (flow, _) = bus.attach(2_000_000, Pmw3901::new(&simulation.world, &clock, 1));
    clock.advance_to(Instant::from_millis(50));
    let ends = RefCell::new(Vec::new());
    let mut tasks = Tasks::new(clock.clone());
    let (watch, log) = (&clock, &ends);
    tasks.spawn(async move {
        use embedded_hal::spi::Operation;
        let (mut flow, mut id) = (flow, [0]);
        let mut operations = [Operation::Write(&[0]), Operation::DelayNs(35_000), Operation::Read(&mut id)];
        embedded_hal_async::spi::SpiDevice::transaction(&mut flow, &mut operations).await.unwrap();
        log.borrow_mut().push((watch.now().as_micros() - 50_000, id[0]));
    });
    tasks.spawn(async move {
        let mut imu = imu;
        for _ in 0..2 {
            let mut bytes = [0x80, 0, 0];
            embedded_hal_async::spi::SpiDevice::transfer_in_place(&mut imu, &mut bytes).await.unwrap();
            log.borrow_mut().push((watch.now().as_micros() - 50_000, bytes[2]));
        }
    });
    tasks.run_until(Instant::from_millis(51));
    drop(tasks);
    // The slow chip occupies the wires for 43 µs; the other chip's first transfer selects SPI.
    assert_eq!(ends.into_inner(), [(43, 0x49), (46, 0xFF), (49, 0x24)]);
}

#[test]
fn chips_at_one_address_all_listen_and_pull_each_others_ones_down() {
    use embedded_hal::i2c::I2c;
    let simulation = standing();
    let mut bus = I2cBus::new(&simulation.clock, 1);
    let chips = [1, 2].map(|seed| bus.attach(ADDRESS, Bmp280::new(&simulation.world, &simulation.clock, seed)));
    simulation.clock.advance_to(Instant::from_millis(2));
    bus.write(ADDRESS, &[0xF5, 0x08]).unwrap();
    assert_eq!(chips.each_ref().map(|chip| chip.peek(0xF5)), [0x08; 2], "both took it");
    chips[1].set_id(0x61);
    assert_eq!(id(&mut bus), Ok(0x58 & 0x61));
    chips[0].set_faults(Faults { dead: true, ..Faults::default() });
    assert_eq!(id(&mut bus), Ok(0x61), "the other one still acknowledges");
    bus.write(ADDRESS, &[0xF5, 0x10]).unwrap();
    assert_eq!(chips.each_ref().map(|chip| chip.peek(0xF5)), [0x08, 0x10]);
}

#[test]
fn a_clock_that_is_too_fast_garbles() {
    use embedded_hal::spi::SpiDevice;
    let simulation = standing();
    simulation.clock.advance_to(Instant::from_millis(45));
    for (frequency, garbles) in [(2_000_000, false), (2_100_000, true)] {
        let chip = Pmw3901::new(&simulation.world, &simulation.clock, 1);
        let (mut port, _) = SpiBus::new(&simulation.clock, 1).attach(frequency, chip);
        simulation.clock.advance_to(simulation.clock.now() + Duration::from_millis(45));
        let wrong = (0..100).filter(|_| {
            let mut id = [0];
            let mut read = [SpiOperation::Write(&[0]), SpiOperation::DelayNs(35_000), SpiOperation::Read(&mut id)];
            port.transaction(&mut read).unwrap();
            simulation.clock.advance_to(simulation.clock.now() + Duration::from_micros(20));
            id != [0x49]
        });
        let wrong = wrong.count();
        assert!(if garbles { wrong > 20 } else { wrong == 0 }, "{wrong} of 100 at {frequency} Hz");
    }
}
