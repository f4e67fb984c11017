//! A flow sensor with failing starts: its task resets and restarts it until it works, without
//! affecting the inertial sensor on the same bus.

use crate::mounting;
use core::cell::{Cell, RefCell};
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::slot::{Rhythm, Slots};
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{Imu, OpticalFlow, SensorErrorKind};
use stampfly_sim::chips::{Attached, Board, Faults, stand_in_image};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::{Duration, Instant};

/// A wrong answer of the chip: register and value.
type Change = fn(u8, &mut [u8], u32);

/// A device whose chip answers wrongly until a number of resets.
struct Stubborn<'s, S> {
    device: S,
    resets: &'s Cell<u32>,
    wrong_until: u32,
    change: Change,
    transfers: u32,
}

impl<S: SpiDevice> ErrorType for Stubborn<'_, S> {
    type Error = S::Error;
}

impl<S: SpiDevice> SpiDevice for Stubborn<'_, S> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), S::Error> {
        self.device.transaction(operations).await?;
        self.transfers += 1;
        match operations {
            [Operation::Write([0xBA, 0x5A]), ..] => self.resets.set(self.resets.get() + 1),
            [Operation::Write([register]), .., Operation::Read(answer)] if self.resets.get() <= self.wrong_until => {
                (self.change)(*register, answer, self.transfers);
            }
            _ => {}
        }
        Ok(())
    }
}

/// Results of both sensors.
#[derive(Debug)]
struct Done {
    flow: SensorHealth,
    imu: SensorHealth,
    resets: u32,
    /// Instant of the first picture.
    first: Option<Instant>,
    /// Instants of validity and of delivery of each inertial sample.
    samples: Vec<(Instant, Instant)>,
    delays: u32,
}

/// Runs such a flow sensor next to an inertial sensor; `act` is called every 10 ms.
fn beside(wrong_until: u32, change: Change, long: Duration, act: fn(&Attached, Instant)) -> Done {
    let config = SimulationConfig::example();
    let Simulation { clock, world, .. } = Simulation::new(&config);
    let image = stand_in_image();
    let Board { imu, flow, attached, .. } = Board::new(&world, &clock, &config, &image);
    let pin = imu.interrupt_pin();
    let mut slots = Slots::new(clock.clone(), Rhythm::HZ_400);
    let (lead, guest, bus) = slots.split(imu, flow, Duration::from_micros(200));
    let config = bmi270::Config::default();
    let mut imu = Bmi270::spi(lead, clock.clone(), &image, mounting::IMU, config).with_interrupt(pin);
    let resets = Cell::new(0);
    let guest = Stubborn { device: guest, resets: &resets, wrong_until, change, transfers: 0 };
    let mut flow = Pmw3901::new(guest, clock.clone(), mounting::FLOW, pmw3901::Config::default());
    let (imu_health, flow_health) = (SensorHealth::new(), SensorHealth::new());
    let (samples, first) = (RefCell::new(Vec::new()), Cell::new(None));
    let mut tasks = Tasks::new(clock.clone());
    let time: &Clock = &clock;
    tasks.spawn(async {
        let note = |at, _: &_| samples.borrow_mut().push((at, time.now()));
        match run_sensor(async || imu.next().await, note, time.clone(), Backoff::CRITICAL, &imu_health).await {}
    });
    tasks.spawn(async {
        let see = |at, data: &pmw3901::FlowData| {
            if data.quality > 0 && first.get().is_none() {
                first.set(Some(at));
            }
        };
        match run_sensor(async || flow.next().await, see, time.clone(), Backoff::SHARED, &flow_health).await {}
    });
    let end = Instant::ZERO + long;
    while time.now() < end {
        act(&attached.flow, time.now());
        tasks.run_until(time.now() + Duration::from_millis(10));
    }
    drop(tasks);
    let (resets, first, samples) = (resets.get(), first.get(), samples.into_inner());
    Done { flow: flow_health, imu: imu_health, resets, first, samples, delays: bus.delays() }
}

/// Failures of a start, and the errors that they cause.
const WRONG: [(&str, Change, SensorErrorKind); 5] = [
    (
        "identity",
        |register, answer, _| {
            if register == 0x00 {
                answer.fill(0x42)
            }
        },
        SensorErrorKind::Identification,
    ),
    (
        "inverse identity",
        |register, answer, _| {
            if register == 0x5F {
                answer.fill(0x49)
            }
        },
        SensorErrorKind::Identification,
    ),
    (
        "calibration",
        |register, answer, _| {
            if register == 0x47 {
                answer.fill(0)
            }
        },
        SensorErrorKind::Configuration,
    ),
    // A different value each time: a constant one counts as a register that cannot be read back.
    (
        "setting",
        |register, answer, number| {
            if register == 0x4E {
                answer.fill(number as u8)
            }
        },
        SensorErrorKind::Configuration,
    ),
    ("everything", |_, answer, number| answer.fill(number as u8), SensorErrorKind::Identification),
];

const fn untouched(_: &Attached, _: Instant) {}

#[test]
fn a_chip_that_answers_its_start_wrongly_n_times_is_started_again_and_works_at_last() {
    for (name, change, kind) in WRONG {
        for wrong in [0_u32, 1, 2, 5, 20] {
            // At most 80 ms between two starts of at most 150 ms.
            let limit = Duration::from_millis(300) + Duration::from_millis(230) * u64::from(wrong);
            let done = beside(wrong, change, limit, untouched);
            assert_eq!(done.resets, wrong + 1, "{name}, {wrong} times: reset for each start, and none after");
            assert!(done.first.is_some(), "{name}, {wrong} times: {:?}", done.flow);
            // A start that finds a wrong setting tries once more by itself.
            let failed = if name == "setting" { wrong / 2 } else { wrong };
            assert_eq!(done.flow.errors(), failed, "{name}, {wrong} times");
            assert_eq!(done.flow.last_error(), (failed > 0).then_some(kind), "{name}, {wrong} times");
        }
    }
}

#[test]
fn a_chip_that_never_starts_is_reported_again_and_again_and_the_inertial_sensor_does_not_notice() {
    let long = Duration::from_secs(4);
    let sound = beside(0, |_, _, _| {}, long, untouched);
    assert!(sound.imu.errors() == 0 && sound.samples.len() > 1_500, "{:?}", sound.imu);
    for (name, change, kind) in WRONG {
        let done = beside(u32::MAX, change, long, untouched);
        assert_eq!((done.flow.samples(), done.flow.last_error()), (0, Some(kind)), "{name}");
        // At least every 230 ms.
        assert!(done.flow.errors() > 16, "{name}: {} errors in 4 s", done.flow.errors());
        assert_eq!((done.imu.errors(), done.delays), (0, 0), "{name}");
        assert!(
            done.samples == sound.samples,
            "{name}: every inertial sample at the instant of a vehicle with a sound chip"
        );
    }
}

#[test]
fn a_chip_that_comes_out_of_a_power_cycle_on_a_noisy_bus_works_when_the_noise_is_over() {
    let done = beside(
        0,
        |_, _, _| {},
        Duration::from_secs(3),
        |chip, now| {
            // The supply fails at 0.5 s, and for one second one bit in twenty is wrong.
            let noisy = (Instant::from_millis(500)..Instant::from_millis(1_500)).contains(&now);
            if now == Instant::from_millis(500) {
                chip.reset();
            }
            chip.set_faults(Faults { bit_errors: if noisy { 0.05 } else { 0.0 }, ..Faults::default() });
        },
    );
    assert!(done.flow.errors() > 3, "{:?}", done.flow);
    // From 1.5 s on: at most 80 ms of pause and two starts of 75 ms; then 100 samples per second.
    assert!(done.flow.samples() > 30 + 110, "{:?}", done.flow);
    assert!(done.resets > 4, "each start begins with the reset: {}", done.resets);
    assert_eq!(done.imu.errors(), 0);
}
