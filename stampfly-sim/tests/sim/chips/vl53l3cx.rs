//! VL53L3CX after ST DS13204 and the register names of the VL53L1 family.

use super::wait;
use crate::standing;
use embedded_hal::digital::OutputPin;
use embedded_hal::i2c::I2c;
use stampfly_sim::Simulation;
use stampfly_sim::chips::{Attached, BusError, I2cBus, ShutdownPin, Vl53l3cx};
use stampfly_sim::sensors::Mount;

const FIRST: u8 = 0x29;

struct Bench {
    simulation: Simulation,
    bus: I2cBus,
    chip: Attached,
    shutdown: ShutdownPin,
}

impl Bench {
    /// A chip 2 ms after power-on.
    fn new() -> Self {
        let simulation = standing();
        let bus = I2cBus::new(&simulation.clock, 1);
        let (chip, shutdown) = Vl53l3cx::new(&simulation.world, &simulation.clock, 1, Mount::Bottom);
        let chip = bus.attach(FIRST, chip);
        wait(&simulation, 2_000);
        Self { simulation, bus, chip, shutdown }
    }

    fn try_read<const N: usize>(&mut self, address: u8, register: u16) -> Result<[u8; N], BusError> {
        let mut bytes = [0; N];
        self.bus.write_read(address, &register.to_be_bytes(), &mut bytes)?;
        Ok(bytes)
    }

    fn read<const N: usize>(&mut self, register: u16) -> [u8; N] {
        self.try_read(FIRST, register).unwrap()
    }

    fn write(&mut self, register: u16, bytes: &[u8]) {
        let message = [&register.to_be_bytes(), bytes].concat();
        self.bus.write(FIRST, &message).unwrap();
    }

    /// Long distance, 33 ms, one measurement every 40 ms of the chip's oscillator.
    fn start(&mut self) {
        let missing = i16::from_be_bytes(self.read(0x0022));
        self.write(0x001E, &missing.wrapping_mul(4).to_be_bytes());
        self.write(0x0046, &[0x20]);
        self.write(0x005E, &[0x00, 0x60, 0x0F, 0x00, 0x6E, 0x0D]);
        let [high, low] = self.read(0x00DE);
        let ticks = f64::from(u16::from_be_bytes([high, low])) * 40.0 * 1.075;
        self.write(0x006C, &(ticks as u32).to_be_bytes());
        self.write(0x0087, &[0x40]);
    }

    /// True if the interrupt line is asserted, which is active low after a reset.
    fn is_ready(&mut self) -> bool {
        let ([polarity], [line]): ([u8; 1], [u8; 1]) = (self.read(0x0030), self.read(0x0031));
        (line & 1 == 0) == (polarity & 0x10 != 0)
    }
}

#[test]
fn it_answers_when_it_has_started_and_says_what_it_is() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x010F), [0xEA, 0xAA]);
    assert_eq!((bench.read(0x0010), bench.read(0x00E5)), ([1], [3]));
    bench.chip.reset();
    wait(&bench.simulation, 1_000);
    assert!(bench.try_read::<1>(FIRST, 0x010F).is_err(), "1.2 ms have not passed");
    wait(&bench.simulation, 500);
    assert_eq!(bench.read(0x010F), [0xEA]);
}

#[test]
fn a_new_address_lasts_until_the_next_reset() {
    let mut bench = Bench::new();
    bench.write(0x0001, &[0x30]);
    assert!(bench.try_read::<1>(FIRST, 0x010F).is_err());
    assert_eq!(bench.try_read(0x30, 0x010F), Ok([0xEA]));
    bench.shutdown.set_low().unwrap();
    wait(&bench.simulation, 5_000);
    assert!(bench.try_read::<1>(FIRST, 0x010F).is_err() && bench.try_read::<1>(0x30, 0x010F).is_err(), "held");
    bench.shutdown.set_high().unwrap();
    wait(&bench.simulation, 1_300);
    assert_eq!(bench.read(0x010F), [0xEA]);
}

#[test]
fn it_measures_the_floor_again_when_the_interrupt_has_been_cleared() {
    let mut bench = Bench::new();
    assert!(!bench.is_ready());
    bench.start();
    wait(&bench.simulation, 25_000);
    assert!(!bench.is_ready(), "33 ms have not passed");
    wait(&bench.simulation, 11_000);
    assert!(bench.is_ready());
    let [_, status, _, number]: [u8; 4] = bench.read(0x0088);
    let distance = u16::from_be_bytes(bench.read(0x0096));
    assert_eq!((status & 0x1F, number), (9, 1));
    assert!((24..=36).contains(&distance), "{distance} mm to the floor, standing");

    wait(&bench.simulation, 200_000);
    assert_eq!(bench.read(0x008B), [1], "nobody took note of the first one");
    bench.write(0x0086, &[1]);
    assert!(!bench.is_ready());
    wait(&bench.simulation, 36_000);
    assert!(bench.is_ready());
    assert_eq!(bench.read(0x008B), [2]);

    bench.write(0x0086, &[1]);
    bench.write(0x0087, &[0x80]);
    wait(&bench.simulation, 100_000);
    assert!(!bench.is_ready(), "stopped");
}

#[test]
fn measurements_keep_their_period() {
    let mut bench = Bench::new();
    bench.start();
    let mut instants = Vec::new();
    for _ in 0..20 {
        while !bench.is_ready() {
            wait(&bench.simulation, 200);
        }
        instants.push(bench.simulation.clock.now());
        bench.write(0x0086, &[1]);
    }
    let mean = instants[19].since(instants[0]).seconds() / 19.0;
    assert!((mean / 0.040 - 1.0).abs() < 0.025, "{mean} s");
}

#[test]
fn results_cannot_be_written() {
    let mut bench = Bench::new();
    bench.write(0x0096, &[0x12, 0x34]);
    bench.write(0x010F, &[0x00]);
    assert_eq!(bench.read(0x0096), [0, 0]);
    assert_eq!(bench.read(0x010F), [0xEA]);
}

#[test]
fn a_read_during_a_measurement_gives_the_one_before() {
    let mut bench = Bench::new();
    bench.start();
    wait(&bench.simulation, 20_000);
    assert_eq!((bench.read(0x008B), bench.read(0x0096)), ([0], [0, 0]), "none yet");
    wait(&bench.simulation, 20_000);
    let first: [u8; 15] = bench.read(0x0089);
    bench.write(0x0086, &[1]);
    wait(&bench.simulation, 20_000);
    assert_eq!(bench.read(0x0089), first, "the second one runs");
    wait(&bench.simulation, 30_000);
    assert_ne!(bench.read(0x0089), first);
}

#[test]
fn two_that_are_awake_at_once_move_together() {
    let mut bench = Bench::new();
    let (front, mut shutdown) = Vl53l3cx::new(&bench.simulation.world, &bench.simulation.clock, 2, Mount::Front);
    let front = bench.bus.attach(FIRST, front);
    wait(&bench.simulation, 2_000);
    bench.write(0x0001, &[0x30]);
    assert_eq!([&bench.chip, &front].map(|chip| chip.peek(0x0001)), [0x30; 2]);
    assert!(bench.try_read::<1>(FIRST, 0x010F).is_err(), "nobody stayed");
    // In reset it ignores bus traffic.
    let Ok(()) = shutdown.set_low();
    bench.bus.write(0x30, &[0x00, 0x01, 0x31]).unwrap();
    let Ok(()) = shutdown.set_high();
    wait(&bench.simulation, 2_000);
    assert_eq!([&bench.chip, &front].map(|chip| chip.peek(0x0001)), [0x31, 0x29]);
}

#[test]
fn a_specimen_measures_short_by_what_its_factory_register_says_until_that_is_added() {
    let mut bench = Bench::new();
    let missing = i16::from_be_bytes(bench.read(0x0022));
    assert_ne!(missing, 0);
    bench.start();
    let distance = |bench: &mut Bench| {
        bench.write(0x0086, &[1]);
        wait(&bench.simulation, 90_000);
        i16::from_be_bytes(bench.read(0x0096))
    };
    let after = distance(&mut bench);
    bench.write(0x001E, &[0, 0]);
    distance(&mut bench);
    let before = distance(&mut bench);
    assert!((after - before - missing).abs() <= 5, "{before} + {missing} is not {after}");
}

#[test]
fn an_xshut_that_rises_in_the_middle_of_a_transfer_leaves_the_chip_mute_until_it_rises_again() {
    let mut bench = Bench::new();
    bench.shutdown.set_low().unwrap();
    let (mut bus, mut byte) = (bench.bus.clone(), [0]);
    {
        let mut transfer = std::pin::pin!(embedded_hal_async::i2c::I2c::read(&mut bus, 0x50, &mut byte));
        let mut context = std::task::Context::from_waker(std::task::Waker::noop());
        assert!(transfer.as_mut().poll(&mut context).is_pending());
        bench.shutdown.set_high().unwrap();
    }
    wait(&bench.simulation, 1_000_000);
    assert!(bench.try_read::<1>(FIRST, 0x010F).is_err());
    bench.shutdown.set_low().unwrap();
    bench.shutdown.set_high().unwrap();
    wait(&bench.simulation, 1_200);
    assert_eq!(bench.read(0x010F), [0xEA]);
}

/// Sends the settings of a histogram, which also clears the interrupt of the previous one.
fn shoot(bench: &mut Bench, group: u8) {
    bench.write(0x0024, &[0x14, 0x00]);
    bench.write(0x0034, &[0x08]);
    bench.write(0x0046, &[0x20, 0x09, 0x00, 0x00, 0x02]);
    bench.write(0x005E, &[0x00, 0x54, 0x09, 0x00, 0x23, 0x0B, 0x07, 0x21, 0x43, 0x10, 0x32, 0x54]);
    bench.write(0x0082, &[group, 0x01, 0x00, 0x01, 0x01, 0x26]);
}

#[test]
fn a_histogram_is_measured_for_each_start_and_tells_which() {
    let mut bench = Bench::new();
    let mut told = Vec::new();
    for shot in 0..260u32 {
        let begun = bench.simulation.clock.now();
        shoot(&mut bench, [2, 0][shot as usize % 2]);
        assert!(!bench.is_ready());
        while !bench.is_ready() {
            wait(&bench.simulation, 500);
        }
        let took = bench.simulation.clock.now().since(begun).seconds();
        let [interrupt, status, _, number]: [u8; 4] = bench.read(0x0088);
        told.push((interrupt >> 4, status & 0x1F, number));
        // Six times 85 or 36 macro periods of 61 and 73 µs, plus 1.7 ms and the time to send the
        // settings.
        let expected = if number & 1 == 0 { 0.0328 } else { 0.0175 };
        assert!((took - expected).abs() < 0.0035, "{took} s for number {number}");
        wait(&bench.simulation, 100_000);
        assert_eq!(bench.read(0x008B), [number], "no other without a start");
    }
    // By the settings sent before the last, except for the first.
    assert_eq!(told[..4], [(2, 18, 0), (2, 9, 0), (0, 9, 1), (2, 9, 2)]);
    assert_eq!((told[256].2, told[257].2, told[258].2), (255, 128, 129));
    bench.write(0x0087, &[0]);
    shoot(&mut bench, 2);
    wait(&bench.simulation, 50_000);
    assert_eq!((bench.read(0x0089), bench.read(0x008B)), ([18], [0]), "begun anew");
}

#[test]
fn a_histogram_has_ambient_light_first_and_a_pulse_where_the_reference_says() {
    let mut bench = Bench::new();
    let mut bins = [0u32; 24];
    for shot in 0..42 {
        shoot(&mut bench, 0);
        wait(&bench.simulation, 40_000);
        let block: [u8; 83] = bench.read(0x0088);
        if shot < 2 || block[3] & 1 == 1 {
            continue;
        }
        for (bin, bytes) in bins.iter_mut().zip(block[6..].chunks_exact(3)) {
            *bin += bytes.iter().fold(0, |sum, byte| sum << 8 | u32::from(*byte));
        }
        assert_eq!(block[0x00D5 - 0x0088], 0, "the last byte is elsewhere");
        bins[23] += u32::from(block[81] << 2 | block[82]);
    }
    let [p1, p0, start]: [u8; 3] = bench.read(0x00D6);
    let zero = f64::from(u16::from_be_bytes([p1, p0])) / 2048.0 + f64::from(start) - 9.0;
    let ambient = bins[..4].iter().sum::<u32>() / 4;
    let pulse: Vec<_> = bins[4..].iter().map(|bin| f64::from(bin.saturating_sub(ambient + ambient / 2))).collect();
    let total: f64 = pulse.iter().sum();
    let centre = pulse.iter().enumerate().map(|(place, bin)| (place as f64 + 0.5) * bin).sum::<f64>() / total;
    // Standing 30 mm above the floor: 0.15 bins, plus the specimen's offset.
    assert!((centre - zero - 0.15).abs() < 0.12, "{centre} {zero}");
    let wide = pulse.iter().filter(|bin| **bin > total / 100.0).count();
    assert!((3..=5).contains(&wide), "a pulse of 2.5 bins: {pulse:?}");
}

#[test]
fn without_firmware_there_is_no_histogram_and_the_patch_is_kept() {
    let mut bench = Bench::new();
    bench.write(0x0476, &[0x29, 0xC9]);
    assert_eq!(bench.read(0x0476), [0x29, 0xC9]);
    shoot(&mut bench, 0);
    wait(&bench.simulation, 50_000);
    bench.write(0x0085, &[0, 1, 0x26]);
    wait(&bench.simulation, 100_000);
    assert!(!bench.is_ready());
    bench.chip.reset();
    wait(&bench.simulation, 2_000);
    assert_eq!(bench.read(0x0476), [0, 0]);
}
