//! Inertial and flow sensor on one SPI in all modes and on all controllers: which combinations
//! start and measure.

use crate::mounting;
use core::cell::{Cell, RefCell};
use embedded_hal::spi::{MODE_0, MODE_1, MODE_2};
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::slot::{Rhythm, Slots};
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{Imu, OpticalFlow, SensorErrorKind};
use stampfly_sim::chips::{Board, Controller, SpiSetup, stand_in_image};
use stampfly_sim::time::Tasks;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::{Duration, Instant};

/// Results of both sensors in three seconds.
struct Done {
    imu: SensorHealth,
    flow: SensorHealth,
    /// Samples of the flow sensor that contain a picture.
    pictures: u32,
    /// All samples of both with their instants of delivery.
    samples: Vec<(Instant, String)>,
}

fn three_seconds(setup: &SpiSetup, edge_by_edge: bool) -> Done {
    let config = SimulationConfig::example();
    let Simulation { clock, world, .. } = Simulation::new(&config);
    let image = stand_in_image();
    let Board { imu, flow, .. } = Board::on(setup, &world, &clock, &config, &image);
    if edge_by_edge {
        imu.bus().go_edge_by_edge();
    }
    let pin = imu.interrupt_pin();
    let mut slots = Slots::new(clock.clone(), Rhythm::HZ_400);
    let (lead, guest, _) = slots.split(imu, flow, Duration::from_micros(200));
    let config = bmi270::Config::default();
    let mut imu = Bmi270::spi(lead, clock.clone(), &image, mounting::IMU, config).with_interrupt(pin);
    let mut flow = Pmw3901::new(guest, clock.clone(), mounting::FLOW, pmw3901::Config::default());
    let [imu_health, flow_health] = [const { SensorHealth::new() }; 2];
    let (pictures, samples) = (Cell::new(0), RefCell::new(Vec::new()));
    let note = |data: &dyn core::fmt::Debug| samples.borrow_mut().push((clock.now(), format!("{data:?}")));
    let mut tasks = Tasks::new(clock.clone());
    tasks.spawn(async {
        match run_sensor(async || imu.next().await, |_, data| note(data), clock.clone(), Backoff::CRITICAL, &imu_health)
            .await {}
    });
    tasks.spawn(async {
        let see = |_, data: &pmw3901::FlowData| {
            pictures.set(pictures.get() + u32::from(data.quality > 0));
            note(data);
        };
        match run_sensor(async || flow.next().await, see, clock.clone(), Backoff::SHARED, &flow_health).await {}
    });
    tasks.run_until(Instant::from_secs(3));
    drop(tasks);
    Done { imu: imu_health, flow: flow_health, pictures: pictures.get(), samples: samples.into_inner() }
}

impl core::fmt::Debug for Done {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "inertial sensor: {}; flow sensor: {}; {} pictures", self.imu, self.flow, self.pictures)
    }
}

/// As the firmware once was: the inertial sensor in mode 0.
const TWO_MODES: fn(Controller) -> SpiSetup =
    |controller| SpiSetup { controller, imu: (MODE_0, 10_000_000), ..SpiSetup::default() };

#[test]
fn two_modes_on_an_esp32_s3_leave_the_flow_sensor_without_a_picture() {
    let done = three_seconds(&TWO_MODES(Controller::LevelWithTransfer), false);
    assert!(done.pictures == 0 && done.flow.errors() > 5, "{done:?}");
    // It is not noticed at the sensor whose clock idles low.
    assert!(done.imu.samples() > 1_000 && done.imu.errors() == 0, "{done:?}");
}

#[test]
fn one_mode_on_an_esp32_s3_as_the_firmware_has_it_measures_without_an_error() {
    let done = three_seconds(&SpiSetup::default(), false);
    assert!(done.pictures > 270 && done.flow.errors() == 0, "{done:?}");
    assert!(done.imu.samples() > 1_000 && done.imu.errors() == 0, "{done:?}");
}

#[test]
fn two_modes_on_a_controller_that_sets_the_level_first_measure_without_an_error() {
    let done = three_seconds(&TWO_MODES(Controller::LevelFirst), false);
    assert!(done.pictures > 270 && done.flow.errors() == 0, "{done:?}");
    assert!(done.imu.samples() > 1_000 && done.imu.errors() == 0, "{done:?}");
}

#[test]
fn both_in_mode_0_measure_as_well() {
    // PX4 has the flow sensor in mode 0 (its driver's `SPIDEV_MODE0`).
    let setup = SpiSetup { flow: (MODE_0, 2_000_000), ..TWO_MODES(Controller::LevelWithTransfer) };
    let done = three_seconds(&setup, false);
    assert!(done.pictures > 270 && done.flow.errors() == 0 && done.imu.errors() == 0, "{done:?}");
}

#[test]
fn without_a_byte_to_nobody_the_first_transfer_is_wrong_which_the_inertial_sensor_throws_away_anyway() {
    let setup = SpiSetup { begins_with_nobody: false, ..SpiSetup::default() };
    let done = three_seconds(&setup, false);
    assert!(done.pictures > 270 && done.flow.errors() == 0 && done.imu.errors() == 0, "{done:?}");
    // With the flow sensor first, another identity would be read:
    // `the_first_transfer_after_reset_is_wrong_on_an_esp32_s3` in `chips/wire.rs`.
}

#[test]
fn in_modes_1_and_2_neither_starts() {
    for mode in [MODE_1, MODE_2] {
        let setup = SpiSetup { imu: (mode, 10_000_000), flow: (mode, 2_000_000), ..SpiSetup::default() };
        let done = three_seconds(&setup, false);
        assert_eq!([done.imu.samples(), done.flow.samples()], [0; 2], "{mode:?}: {done:?}");
        let named = [Some(SensorErrorKind::Identification), Some(SensorErrorKind::Absent)];
        assert!(named.contains(&done.imu.last_error()) && named.contains(&done.flow.last_error()), "{done:?}");
    }
}

#[test]
fn edge_by_edge_the_drivers_get_every_sample_that_they_get_byte_by_byte() {
    let [bytes, edges] = [false, true].map(|edge_by_edge| three_seconds(&SpiSetup::default(), edge_by_edge).samples);
    assert!(bytes.len() > 1_300 && bytes == edges, "{} samples", bytes.len());
}
