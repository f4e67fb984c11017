//! Seven drivers over seven chips on two buses, as in flight, with a note of everything each driver says.

use core::cell::RefCell;
use stampfly_board::devices;
use stampfly_drivers::chip::vl53l3cx::BootAddress;
use stampfly_drivers::shared::SharedI2c;
use stampfly_drivers::slot::Slots;
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{
    Barometer, Imu, Magnetometer, OpticalFlow, PowerMonitor, RangeFinder, Sample, SensorError, SensorErrorKind,
};
use stampfly_sim::chips::{AttachedChips, Board, I2cBus, stand_in_image};
use stampfly_sim::plant::WindConfig;
use stampfly_sim::time::Tasks;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::Instant;

/// What a driver said, and when: a figure of its sample, or its error.
pub type Said = (Instant, Result<f32, SensorErrorKind>);

/// Something that is done to the rig, and when.
pub type Event<'a> = (Instant, &'a dyn Fn(&Access));

/// The chips' names, in the order of what [`run`] returns.
pub const NAMES: [&str; 7] = ["imu", "flow", "mag", "baro", "power", "tof", "tof_front"];

/// What may be done to the rig while it runs.
pub struct Access {
    pub chips: AttachedChips,
    pub i2c: I2cBus,
}

impl Access {
    /// The chip with this place in [`NAMES`].
    pub fn chip(&self, index: usize) -> &stampfly_sim::chips::Attached {
        let chips = &self.chips;
        [&chips.imu, &chips.flow, &chips.mag, &chips.baro, &chips.power, &chips.tof, &chips.tof_front][index]
    }
}

/// Runs until `end`; at each instant of `events` something is done.
pub fn run(end: Instant, events: &[Event<'_>]) -> [Vec<Said>; 7] {
    run_with(SimulationConfig::new(stampfly_board::simulation::PLANT).seed, end, events)
}

/// The same with chips and noise of this seed.
pub fn run_with(seed: u64, end: Instant, events: &[Event<'_>]) -> [Vec<Said>; 7] {
    let config =
        SimulationConfig { wind: WindConfig::CALM, seed, ..SimulationConfig::new(stampfly_board::simulation::PLANT) };
    let Simulation { clock, world, .. } = Simulation::new(&config);
    let image = stand_in_image();
    let Board { i2c, imu, flow, shutdown_bottom, shutdown_front, attached } =
        Board::new(&world, &clock, &config, &image);
    let access = Access { chips: attached, i2c: i2c.clone() };
    let (boot, mut slots) = (BootAddress::new(), Slots::new(clock.clone(), devices::RHYTHM));
    let mut shared = SharedI2c::<_, 5>::new(i2c);
    let ([to_mag, to_baro, to_power, to_down, to_ahead], _) = shared.split();
    let (imu, flow, _) = slots.split(imu, flow, devices::LONGEST_FLOW);
    let time = || clock.clone();
    let notes: [RefCell<Vec<Said>>; 7] = Default::default();
    let healths: [SensorHealth; 7] = Default::default();
    let mut tasks = Tasks::new(clock.clone());
    macro_rules! watch {
        ($index:literal, $backoff:ident, $driver:expr, $figure:expr) => {{
            let (mut driver, clock, note) = ($driver, clock.clone(), &notes[$index]);
            let health = &healths[$index];
            tasks.spawn(async move {
                let noted = async || {
                    let outcome = driver.next().await;
                    let said = outcome.as_ref().map(|Sample { data, .. }| $figure(data)).map_err(|e| e.kind());
                    note.borrow_mut().push((clock.now(), said));
                    outcome
                };
                match run_sensor(noted, |_, _| {}, clock.clone(), Backoff::$backoff, health).await {}
            });
        }};
    }
    use stampfly_types::messages::*;
    let share = |good: bool| f32::from(u8::from(good));
    let down = devices::range_down(to_down, shutdown_bottom, &boot, time());
    let ahead = devices::range_ahead(to_ahead, shutdown_front, &boot, time());
    watch!(0, CRITICAL, devices::imu(imu, time(), &image), |data: &ImuData| data.accel.norm());
    watch!(1, SHARED, devices::flow(flow, time()), |data: &FlowData| share(data.valid && data.quality > 0));
    watch!(2, SHARED, devices::magnetometer(to_mag, time()), |data: &MagData| data.field.norm());
    watch!(3, SHARED, devices::barometer(to_baro, time()), |data: &BaroData| data.pressure);
    watch!(4, SHARED, devices::power(to_power, time()), |data: &PowerData| data.voltage);
    watch!(5, SHARED, down, |data: &TofData| data.distance);
    watch!(6, SHARED, ahead, |data: &TofData| share(data.valid));
    for (instant, action) in events {
        tasks.run_until(*instant);
        action(&access);
    }
    tasks.run_until(end);
    drop(tasks);
    notes.map(RefCell::into_inner)
}
