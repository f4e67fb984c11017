//! The task that firmware flies with, on virtual time: the same flight as the host's own loop, bit for bit.

use core::cell::{Cell, RefCell};
use stampfly_board::tasks::{Health, Retry, fly, pump};
use stampfly_board::vehicle::{Assembled, Outside, assemble};
use stampfly_board::{Observer, wiring};
use stampfly_bus::Activation;
use stampfly_drivers::{Barometer, Imu, Magnetometer, OpticalFlow, PowerMonitor, RangeFinder};
use stampfly_host::ground_station::{self, Progress};
use stampfly_host::mission::Mission;
use stampfly_host::recorder::Recorder;
use stampfly_host::simulate::{self, FlightConfig};
use stampfly_log::FlightHash;
use stampfly_sim::Simulation;
use stampfly_sim::sensors::Sensors;
use stampfly_sim::time::Tasks;
use stampfly_types::Duration;
use std::convert::Infallible;

/// Counts the activations of every runnable.
struct Count<'a>(&'a RefCell<Vec<u32>>);

impl Observer for Count<'_> {
    fn has_read(&mut self, index: usize, _: &Activation) {
        self.0.borrow_mut()[index] += 1;
    }
}

fn config() -> FlightConfig {
    let mission = Mission::parse("arm\ntakeoff 0.4\ngoto 0.3 -0.2 0.5\nland").expect("a mission");
    FlightConfig { mission, ..FlightConfig::reference(4) }
}

#[test]
fn the_flight_task_publishes_what_the_hosts_loop_does() {
    let config = config();
    let mut recorder = Recorder::hash_only();
    let expected = simulate::fly(&config, &mut recorder, &mut |_, _| {});
    assert!(expected.metrics.landed);

    let Simulation { clock, world, sensors } = Simulation::new(&config.simulation);
    let Sensors { mut imu, mut tof, mut flow, mut mag, mut baro, mut power, motors, .. } = sensors;
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports, mut taps, heads } = bus.split(None);
    let Assembled { mut flight_loop, outside } = assemble(ports, heads, &config.vehicle, config.simulation.start);
    let Outside { imu: mut to_imu, tof: mut to_tof, flow: mut to_flow, mag: mut to_mag, .. } = outside;
    let (mut to_baro, mut to_power, mut button) = (outside.baro, outside.power, outside.button);

    let (progress, healths) = (Progress::default(), [const { Health::new() }; 6]);
    let (ran, written) = (RefCell::new(vec![0; stampfly_board::plan::COUNT]), Cell::new(0));
    let mut count = Count(&ran);
    let mut tasks = Tasks::new(clock.clone());
    let [imu_health, tof_health, flow_health, mag_health, baro_health, power_health] = &healths;
    macro_rules! spawn_pump {
        ($sensor:ident, $publisher:ident, $health:ident) => {{
            let clock = clock.clone();
            tasks.spawn(async move {
                let publish = |at, data: &_| {
                    $publisher.publish(at, data);
                };
                match pump(async || $sensor.next().await, publish, clock, Retry::PATIENT, $health).await {}
            });
        }};
    }
    // The order in which the host's loop starts its tasks; the one that flies comes last there, too.
    spawn_pump!(tof, to_tof, tof_health);
    spawn_pump!(flow, to_flow, flow_health);
    spawn_pump!(mag, to_mag, mag_health);
    spawn_pump!(baro, to_baro, baro_health);
    spawn_pump!(power, to_power, power_health);
    let time = clock.clone();
    tasks.spawn(async move {
        loop {
            button.publish(time.now(), &Default::default());
            time.sleep_until(time.now() + Duration::from_millis(20)).await;
        }
    });
    tasks.spawn(ground_station::fly(clock.clone(), &config.mission, outside.guided, outside.telemetry, &progress));
    let publish = |at, data: &_| {
        to_imu.publish(at, data);
    };
    let sensing = pump(async || imu.next().await, publish, clock.clone(), Retry::PROMPT, imu_health);
    let note = |outcome: Result<(), Infallible>| {
        let Ok(()) = outcome;
        written.set(written.get() + 1);
    };
    let (time, count) = (clock.clone(), &mut count);
    tasks
        .spawn(async move { match fly(sensing, &mut flight_loop, outside.motors, motors, time, count, note).await {} });

    let mut hash = FlightHash::new();
    let end = config.simulation.start + expected.duration;
    while clock.now() < end {
        tasks.step();
        taps.drain(&mut |id, at, generation, words| hash.publish(id as u16, generation, at, words));
    }
    assert!(progress.finished.get(), "the mission was flown");
    assert!(world.truth_at(clock.now()).contact, "and the vehicle stands");
    assert_eq!(hash.finish(), expected.log_hash);
    let steps = imu_health.samples();
    assert_eq!(ran.borrow()[0], steps, "an estimate for every sample");
    assert!(written.get() >= steps, "and a duty");
    assert!(healths.iter().all(|health| health.samples() > 20 && health.errors() == 0), "{healths:?}");
}
