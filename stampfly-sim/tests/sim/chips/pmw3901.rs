//! PMW3901 after PixArt's data sheet.

use super::wait;
use embedded_hal::spi::{Operation, SpiDevice};
use nalgebra::Vector3;
use stampfly_sim::chips::{Attached, Pmw3901, SpiBus, SpiPort};
use stampfly_sim::plant::{PlantParameters, Pose, WindConfig};
use stampfly_sim::{Simulation, SimulationConfig};

/// Performance settings: register and value in order, beginning with those derived from the chip's
/// calibration.
#[rustfmt::skip]
const LIST: &[u16] = &[
    0x7F00, 0x61AD, 0x5170, 0x7F0E, 0x7028, 0x712B,
    0x7F00, 0x61AD, 0x7F03, 0x4000, 0x7F05, 0x41B3, 0x43F1, 0x4514, 0x5B32, 0x5F34, 0x7B08, 0x7F06, 0x441B, 0x40BF,
    0x4E3F, 0x7F08, 0x6520, 0x6A18, 0x7F09, 0x4FAF, 0x5F40, 0x4880, 0x4980, 0x5777, 0x6078, 0x6178, 0x6208,
    0x6350, 0x7F0A, 0x4560, 0x7F00, 0x4D11, 0x5580, 0x741F, 0x751F, 0x4A78, 0x4B78, 0x4408, 0x4550, 0x64FF,
    0x651F, 0x7F14, 0x6567, 0x6608, 0x6370, 0x7F15, 0x4848, 0x7F07, 0x410D, 0x4314, 0x4B0E, 0x450F, 0x4442, 0x4C80,
    0x7F10, 0x5B02, 0x7F07, 0x4041, 0x7000, 0x3244, 0x7F07, 0x4040, 0x7F06, 0x62F0, 0x6300, 0x7F0D, 0x48C0, 0x6FD5,
    0x7F00, 0x5BA0, 0x4EA8, 0x5A50, 0x4080,
];

struct Chip {
    simulation: Simulation,
    port: SpiPort<Pmw3901>,
    attached: Attached,
}

impl Chip {
    /// After power-on, weightless, moving over the floor at this velocity.
    fn cold(height: f64, velocity: [f64; 3]) -> Self {
        let plant = PlantParameters { gravity: 0.0, drag_quadratic: 0.0, ..PlantParameters::EXAMPLE };
        let mut pose = Pose { rotors: 0.0, ..Pose::hovering(height) };
        pose.velocity = Vector3::from(velocity);
        let simulation = Simulation::new(&SimulationConfig {
            plant,
            wind: WindConfig::CALM,
            pose: Some(pose),
            ..SimulationConfig::example()
        });
        let chip = Pmw3901::new(&simulation.world, &simulation.clock, 1);
        let (port, attached) = SpiBus::new(&simulation.clock, 1).attach(2_000_000, chip);
        Self { simulation, port, attached }
    }

    fn tuned(height: f64, velocity: [f64; 3]) -> Self {
        let mut chip = Self::cold(height, velocity);
        wait(&chip.simulation, 45_000);
        chip.tune(LIST);
        chip
    }

    /// Writes the list with its pause.
    fn tune(&mut self, list: &[u16]) {
        for entry in list {
            if *entry == 0x3244 {
                wait(&self.simulation, 10_000);
            }
            self.write(*entry);
        }
    }

    /// Writes register and value, and waits as prescribed.
    fn write(&mut self, entry: u16) {
        self.write_holding(entry, 35_000);
    }

    /// As above, with the chip select low for `hold` ns after the last clock.
    fn write_holding(&mut self, entry: u16, hold: u32) {
        let [register, value] = entry.to_be_bytes();
        let mut operations = [Operation::Write(&[register | 0x80, value]), Operation::DelayNs(hold)];
        self.port.transaction(&mut operations).unwrap();
        wait(&self.simulation, 45);
    }

    fn read_after(&mut self, register: u8, pause: u32, bytes: &mut [u8]) {
        self.port
            .transaction(&mut [Operation::Write(&[register]), Operation::DelayNs(pause), Operation::Read(bytes)])
            .unwrap();
        wait(&self.simulation, 20);
    }

    fn read(&mut self, register: u8) -> u8 {
        let mut byte = [0];
        self.read_after(register, 35_000, &mut byte);
        byte[0]
    }

    fn burst(&mut self) -> [u8; 12] {
        let mut bytes = [0; 12];
        self.read_after(0x16, 35_000, &mut bytes);
        bytes
    }
}

#[test]
fn identity_after_the_start_up_with_the_pause() {
    let mut chip = Chip::cold(1.0, [0.0; 3]);
    assert_eq!(chip.read(0x00), 0, "too early");
    wait(&chip.simulation, 45_000);
    assert_eq!((chip.read(0x00), chip.read(0x5F)), (0x49, 0xB6));
    let mut byte = [9];
    chip.read_after(0x00, 0, &mut byte);
    assert_eq!(byte, [0], "without its pause");
    chip.attached.set_id(0x50);
    assert_eq!((chip.read(0x00), chip.read(0x5F)), (0x50, 0xAF));
}

#[test]
fn a_write_whose_chip_select_rises_before_35_us_is_lost() {
    let mut chip = Chip::cold(1.0, [0.0; 3]);
    wait(&chip.simulation, 45_000);
    for (hold, kept) in [(0, 0xEE), (20_000, 0xEE), (35_000, 0x07)] {
        chip.write_holding(0x5007, hold);
        assert_eq!(chip.read(0x50), kept, "{hold} ns");
    }
}

#[test]
fn a_write_too_soon_after_another_is_lost() {
    let mut chip = Chip::cold(1.0, [0.0; 3]);
    wait(&chip.simulation, 45_000);
    for bytes in [[0xD5, 0x01], [0xD0, 0x07]] {
        chip.port.transaction(&mut [Operation::Write(&bytes), Operation::DelayNs(35_000)]).unwrap();
    }
    wait(&chip.simulation, 45);
    assert_eq!(chip.read(0x55), 0x01);
    assert_ne!(chip.read(0x50), 0x07);
}

#[test]
fn the_list_begins_with_a_check_and_works_in_banks() {
    let mut chip = Chip::cold(1.0, [0.0; 3]);
    wait(&chip.simulation, 45_000);
    chip.write(0x7F0E);
    assert_ne!(chip.read(0x47), 0x08);
    chip.write(0x4310);
    assert_eq!(chip.read(0x47), 0x08);
    chip.write(0x7F05);
    chip.write(0x41B3);
    chip.write(0x7F00);
    assert_ne!(chip.read(0x41), 0xB3, "another bank");
    chip.write(0x7F05);
    assert_eq!(chip.read(0x41), 0xB3);
}

#[test]
fn without_the_list_it_is_blind() {
    let mut chip = Chip::cold(1.0, [1.0, 0.0, 0.0]);
    wait(&chip.simulation, 145_000);
    let burst = chip.burst();
    assert_eq!((burst[0], &burst[2..7], burst[10]), (0, &[0; 5][..], 0x1F));
}

#[test]
fn the_burst_counts_motion_in_the_chips_axes() {
    // Per second and axis: velocity divided by height, in counts of 2.22 mrad.
    for (velocity, expected) in [([0.5, 0.0, 0.0], [0.0, -225.2]), ([0.0, 0.5, 0.0], [225.2, 0.0])] {
        let mut chip = Chip::tuned(1.0, velocity);
        chip.burst();
        let mut sum = [0.0; 2];
        for _ in 0..100 {
            wait(&chip.simulation, 9_869);
            let burst = chip.burst();
            assert!(burst[6] > 60 && burst[10] < 0x1F, "{burst:?}");
            sum[0] += f64::from(i16::from_le_bytes([burst[2], burst[3]]));
            sum[1] += f64::from(i16::from_le_bytes([burst[4], burst[5]]));
        }
        for axis in 0..2 {
            assert!((sum[axis] - expected[axis]).abs() < 20.0, "{sum:?} {expected:?}");
        }
    }
}

#[test]
fn the_motion_register_latches_and_clears() {
    let mut chip = Chip::tuned(1.0, [1.0, 0.0, 0.0]);
    chip.read(0x02);
    wait(&chip.simulation, 100_000);
    assert_eq!([chip.read(0x05), chip.read(0x06)].map(|byte| byte == 0), [false, false], "the old counts, negative");
    assert_eq!(chip.read(0x02), 0x80);
    let first = i16::from_le_bytes([chip.read(0x05), chip.read(0x06)]);
    let again = i16::from_le_bytes([chip.read(0x05), chip.read(0x06)]);
    assert!((-55..=-35).contains(&first), "{first}");
    assert_eq!(first, again);
    chip.read(0x02);
    let rest = i16::from_le_bytes([chip.read(0x05), chip.read(0x06)]);
    assert!((-8..=2).contains(&rest), "what has come since: {rest}");
}

#[test]
fn reset_forgets_the_list() {
    let mut chip = Chip::tuned(1.0, [1.0, 0.0, 0.0]);
    chip.write(0x3A5A);
    assert_eq!(chip.read(0x00), 0);
    wait(&chip.simulation, 5_000);
    assert_eq!(chip.read(0x00), 0x49);
    wait(&chip.simulation, 50_000);
    assert_eq!(chip.burst()[6], 0);
}

#[test]
fn the_list_counts_in_its_order_only() {
    let sees = |list: &[u16]| {
        let mut chip = Chip::cold(1.0, [0.0; 3]);
        wait(&chip.simulation, 45_000);
        chip.tune(list);
        chip.burst()[6] > 0
    };
    assert!(sees(LIST));
    // Two sets of values exist for these entries.
    let disputed = |entry: &u16| [0x6567, 0x6370, 0x4848].contains(entry);
    for place in (0..LIST.len()).filter(|place| !disputed(&LIST[*place])) {
        let mut missing = LIST.to_vec();
        let entry = missing.remove(place);
        // Writes that select the bank already selected.
        let repeats = place == 0 || LIST[place - 1] == 0x3244;
        assert_eq!(sees(&missing), repeats, "without {entry:#06x}");
        // After 0x3244 the list selects the present bank.
        if entry >> 8 != 0x7F && entry != 0x3244 && LIST.get(place + 1).is_some_and(|next| !disputed(next)) {
            let mut late = LIST.to_vec();
            late.swap(place, place + 1);
            assert!(!sees(&late), "{entry:#06x} after its successor");
        }
    }
}
