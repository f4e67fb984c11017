//! MPU-6000 after InvenSense's register map and product specification.

use super::wait;
use crate::standing;
use embedded_hal::spi::SpiDevice;
use stampfly_sim::Simulation;
use stampfly_sim::chips::{Attached, Flaw, Mpu6000, SpiBus, SpiPort};

struct Chip {
    simulation: Simulation,
    port: SpiPort<Mpu6000>,
    attached: Attached,
}

impl Chip {
    /// 100 ms after power-on.
    fn cold() -> Self {
        let simulation = standing();
        let chip = Mpu6000::new(&simulation.world, &simulation.clock, 1, 0.0);
        let (port, attached) = SpiBus::new(&simulation.clock, 1).attach(1_000_000, chip);
        wait(&simulation, 100_000);
        Self { simulation, port, attached }
    }

    /// Awake for this duration, at ±16 g and ±2000 °/s.
    fn awake(micros: u64) -> Self {
        let mut chip = Self::cold();
        chip.write(0x6B, 0x03);
        chip.write(0x1B, 0x18);
        chip.write(0x1C, 0x18);
        wait(&chip.simulation, micros);
        chip
    }

    fn write(&mut self, register: u8, value: u8) {
        self.port.write(&[register, value]).expect("a transfer");
    }

    fn read<const N: usize>(&mut self, register: u8) -> [u8; N] {
        let mut bytes = vec![0; N + 1];
        bytes[0] = register | 0x80;
        self.port.transfer_in_place(&mut bytes).expect("a transfer");
        bytes[1..].try_into().expect("as many")
    }

    fn byte(&mut self, register: u8) -> u8 {
        let [byte] = self.read(register);
        byte
    }

    /// Accelerometer, temperature, gyroscope.
    fn burst(&mut self) -> [i16; 7] {
        let bytes: [u8; 14] = self.read(0x3B);
        core::array::from_fn(|place| i16::from_be_bytes([bytes[2 * place], bytes[2 * place + 1]]))
    }
}

#[test]
fn after_a_reset_it_sleeps_and_its_data_are_zero() {
    let mut chip = Chip::awake(100_000);
    assert_ne!(chip.burst(), [0; 7]);
    chip.write(0x6B, 0x80);
    wait(&chip.simulation, 99_000);
    assert_eq!(chip.byte(0x75), 0, "deaf");
    wait(&chip.simulation, 2_000);
    assert_eq!([0x6B, 0x75, 0x1B, 0x1C].map(|register| chip.byte(register)), [0x40, 0x68, 0, 0]);
    assert_eq!(chip.burst(), [0; 7]);
}

#[test]
fn what_a_known_program_calls_a_reset_resets_nothing() {
    let mut chip = Chip::awake(100_000);
    chip.write(0x1A, 0x02);
    chip.write(0x6B, 0x08);
    assert_eq!([0x6B, 0x1A, 0x1B, 0x1C].map(|register| chip.byte(register)), [0x08, 0x02, 0x18, 0x18]);
    // It switches the temperature sensor off.
    wait(&chip.simulation, 10_000);
    let [.., before, _, _, _] = chip.burst();
    wait(&chip.simulation, 1_000_000);
    let [.., after, _, _, _] = chip.burst();
    assert_eq!(before, after);
    // It also wakes a sleeping chip.
    let mut chip = Chip::cold();
    chip.write(0x6B, 0x08);
    wait(&chip.simulation, 50_000);
    assert_ne!(chip.burst(), [0; 7]);
}

#[test]
fn ranges_scale_the_counts() {
    let mut chip = Chip::awake(200_000);
    for (range, g) in [(0x00, 16_384.0), (0x08, 8_192.0), (0x10, 4_096.0), (0x18, 2_048.0)] {
        chip.write(0x1C, range);
        wait(&chip.simulation, 20_000);
        let [.., z, _, _, _, _] = chip.burst();
        let share = f64::from(z) / g;
        assert!((share - 1.0).abs() < 0.13, "level and still, but for offset and scale: {share}");
    }
    // The gyroscope's offset plus the noise of one sample.
    let mut rates = [0.0; 2];
    for (rate, (range, counts)) in rates.iter_mut().zip([(0x00, 131.0), (0x18, 16.4)]) {
        chip.write(0x1B, range);
        wait(&chip.simulation, 20_000);
        let [.., x, _, _] = chip.burst();
        *rate = f64::from(x) / counts;
    }
    assert!((rates[0] - rates[1]).abs() < 1.0 && rates[0].abs() < 20.5, "{rates:?}");
    let [_, _, _, temperature, ..] = chip.burst();
    assert!((f64::from(temperature) / 340.0 + 36.53 - 25.0).abs() < 1.0);
}

/// Number of changes of accelerometer and gyroscope in one second of reads at 8 kHz.
fn changes(chip: &mut Chip) -> [u32; 2] {
    chip.port.set_frequency(20_000_000);
    let mut changes = [0; 2];
    let mut before = chip.burst();
    let begin = chip.simulation.clock.now();
    for number in 1..=16_000 {
        let now = begin + stampfly_types::Duration::from_micros(number * 125 / 2);
        chip.simulation.clock.advance_to(now);
        let burst = chip.burst();
        changes[0] += u32::from(burst[..3] != before[..3]);
        changes[1] += u32::from(burst[4..] != before[4..]);
        before = burst;
    }
    chip.port.set_frequency(1_000_000);
    changes
}

#[test]
fn the_gyroscope_has_8_khz_and_the_accelerometer_1_khz_which_the_registers_repeat() {
    let mut chip = Chip::awake(100_000);
    let [accel, gyro] = changes(&mut chip);
    // The clock has a tolerance of 1 %, and occasionally two samples are equal.
    assert!((950..=1_010).contains(&accel), "{accel}");
    assert!((6_000..=8_080).contains(&gyro), "{gyro}");
    // With any other filter both have 1 kHz; with a divider less.
    chip.write(0x1A, 0x01);
    let [accel, gyro] = changes(&mut chip);
    assert!(accel <= 1_010 && (900..=1_010).contains(&gyro), "{accel} {gyro}");
    chip.write(0x19, 9);
    let [accel, gyro] = changes(&mut chip);
    assert!(accel <= 101 && (95..=101).contains(&gyro), "{accel} {gyro}");
}

#[test]
fn the_filter_takes_noise_away() {
    let spread = |filter| {
        let mut chip = Chip::awake(100_000);
        chip.write(0x1B, 0x00);
        chip.write(0x1A, filter);
        wait(&chip.simulation, 500_000);
        let values: Vec<f64> = (0..400)
            .map(|_| {
                wait(&chip.simulation, 2_000);
                f64::from(chip.burst()[4])
            })
            .collect();
        let mean = values.iter().sum::<f64>() / 400.0;
        (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 400.0).sqrt()
    };
    let (open, narrow) = (spread(0), spread(6));
    // 0.005 °/s/√Hz over 256 Hz with a first-order slope is 0.1 °/s, 13 counts.
    assert!((9.0..18.0).contains(&open) && narrow < open / 4.0, "{open} {narrow}");
}

#[test]
fn settings_on_a_fast_clock_are_lost_and_data_are_not() {
    let mut chip = Chip::awake(100_000);
    chip.port.set_frequency(20_000_000);
    let [_, _, z, ..] = chip.burst();
    assert!(z > 1_700, "1 g: {z}");
    chip.write(0x1C, 0x00);
    assert_eq!(chip.byte(0x75), 0xFF);
    chip.port.set_frequency(1_000_000);
    assert_eq!((chip.byte(0x1C), chip.byte(0x75)), (0x18, 0x68));
}

#[test]
fn the_gyroscope_takes_30_ms_and_data_ready_is_cleared_by_reading() {
    let mut chip = Chip::awake(20_000);
    assert_eq!(chip.burst()[4..], [0; 3]);
    assert_ne!(chip.burst()[2], 0);
    wait(&chip.simulation, 15_000);
    assert_ne!(chip.burst()[4..], [0; 3]);
    assert_eq!((chip.byte(0x3A), chip.byte(0x19)), (1, 0));
    let mut chip = Chip::cold();
    assert_eq!(chip.byte(0x3A), 0, "asleep");
}

#[test]
fn the_self_test_answers_as_the_factory_has_measured_unless_it_is_broken() {
    for broken in [false, true] {
        let mut chip = Chip::awake(100_000);
        chip.attached.set_broken(broken);
        for (register, range) in [(0x1B, 0x00), (0x1C, 0x10)] {
            chip.write(register, range);
        }
        wait(&chip.simulation, 50_000);
        let without = chip.burst();
        for (register, range) in [(0x1B, 0xE0), (0x1C, 0xF0)] {
            chip.write(register, range);
        }
        wait(&chip.simulation, 50_000);
        let with = chip.burst();
        // Trim codes of the specimen: 14 for the accelerometer's x, 12 for the gyroscope's.
        let [accel, gyro] = [0, 4].map(|place| f64::from(with[place]) - f64::from(without[place]));
        let expected = [4096.0 * 0.34 * (0.92_f64 / 0.34).powf(13.0 / 30.0), 25.0 * 131.0 * 1.046_f64.powi(11)];
        let near = |value: f64, expected: f64| (value / expected - 1.03).abs() < 0.05;
        assert_eq!([near(accel, expected[0]), near(gyro, expected[1])], [!broken; 2], "{accel} {gyro} {expected:?}");
        let registers: [u8; 4] = chip.read(0x0D);
        assert_eq!((registers[0] >> 5 << 2 | registers[3] >> 4 & 3, registers[0] & 0x1F), (14, 12));
    }
}

#[test]
fn a_chip_that_repeats_itself_and_one_that_is_soldered_otherwise() {
    let mut chip = Chip::awake(100_000);
    chip.attached.set_flaw(Some(Flaw::Stuck));
    let burst = chip.burst();
    wait(&chip.simulation, 100_000);
    assert_eq!(chip.burst(), burst);
    chip.attached.set_flaw(Some(Flaw::Mounting([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])));
    wait(&chip.simulation, 100_000);
    let [_, y, z, ..] = chip.burst();
    assert!(y < -1_700 && z.abs() < 300, "{y} {z}");
}
