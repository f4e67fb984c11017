//! The task that firmware flies with, on virtual time: the same flight as the host's own loop, bit for bit.

use core::cell::{Cell, RefCell};
use stampfly_board::schedule::{COUNT, Runnables};
use stampfly_board::simulation::ground_station::{self, Progress};
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::radio::Radio;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::{self, Bus};
use stampfly_bus::{Activation, Taps};
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{Barometer, Imu, Magnetometer, MotorOutputs, OpticalFlow, PowerMonitor, RangeFinder};
use stampfly_flight::{Assembled, FlightLoop, Observer, task};
use stampfly_host::flown;
use stampfly_host::recorder::Recorder;
use stampfly_log::FlightHash;
use stampfly_sim::Simulation;
use stampfly_sim::sensors::Sensors;
use stampfly_sim::time::Tasks;
use stampfly_types::Duration;

/// Counts the activations of every runnable.
struct Count<'a>(&'a RefCell<Vec<u32>>);

impl Observer for Count<'_> {
    fn has_read(&mut self, activation: &Activation) {
        self.0.borrow_mut()[usize::from(activation.record().index)] += 1;
    }
}

fn setup() -> Setup {
    let mission = Mission::parse("arm\ntakeoff 0.4\ngoto 0.3 -0.2 0.5\nland").expect("a mission");
    Setup { mission, ..Setup::reference(4) }
}

#[test]
fn the_flight_task_publishes_what_the_hosts_loop_does() {
    let setup = setup();
    let mut recorder = Recorder::<StampFly>::hash_only();
    let expected = flown::fly::<StampFly>(&setup, &mut recorder, &mut |_, _| {});
    assert!(expected.outcome.metrics.landed);

    let Simulation { clock, world, sensors } = Simulation::new(&setup.simulation);
    let Sensors { mut imu, mut tof, mut flow, mut mag, mut baro, mut power, mut motors, .. } = sensors;
    let mut bus = Bus::new();
    let Assembled { mut flight_loop, outside, mut taps } =
        Assembled::<Runnables>::new(&mut bus, None, &setup.vehicle, setup.simulation.start);
    let topics::Outside { link, button_pin, .. } = outside;
    let (mut to_imu, mut to_tof, mut to_flow) =
        (outside.imu.sensor_imu, outside.tof.sensor_tof, outside.flow.sensor_flow);
    let (mut to_mag, mut to_baro, mut to_power) =
        (outside.mag.sensor_mag, outside.baro.sensor_baro, outside.power.sensor_power);
    let (mut button, mut duties) = (button_pin.button_contact, outside.motors.actuator_motor);

    let (progress, healths) = (Progress::default(), [const { SensorHealth::new() }; 6]);
    let (ran, written) = (RefCell::new(vec![0; COUNT]), Cell::new(0));
    let mut tasks = Tasks::new(clock.clone());
    let [imu_health, tof_health, flow_health, mag_health, baro_health, power_health] = &healths;
    macro_rules! spawn_sensor {
        ($sensor:ident, $publisher:ident, $health:ident) => {{
            let clock = clock.clone();
            tasks.spawn(async move {
                let publish = |at, data: &_| {
                    $publisher.publish(at, data);
                };
                match run_sensor(async || $sensor.next().await, publish, clock, Backoff::SHARED, $health).await {}
            });
        }};
    }
    // The order in which the host's loop starts its tasks; the one that flies comes last there, too.
    spawn_sensor!(tof, to_tof, tof_health);
    spawn_sensor!(flow, to_flow, flow_health);
    spawn_sensor!(mag, to_mag, mag_health);
    spawn_sensor!(baro, to_baro, baro_health);
    spawn_sensor!(power, to_power, power_health);
    let time = clock.clone();
    tasks.spawn(async move {
        loop {
            button.publish(time.now(), &Default::default());
            time.sleep_until(time.now() + Duration::from_millis(20)).await;
        }
    });
    tasks.spawn(ground_station::fly(Radio::undisturbed(&clock, link), &setup.mission, false, &progress, None));
    let publish = |at, data: &_| {
        to_imu.publish(at, data);
    };
    let sensing = run_sensor(async || imu.next().await, publish, clock.clone(), Backoff::CRITICAL, imu_health);
    let write_motors = |_, _: &mut FlightLoop<'_, Runnables>| {
        if duties.has_new()
            && let Some(output) = duties.latest()
        {
            let Ok(()) = motors.write(&output.data);
            written.set(written.get() + 1);
        }
    };
    let (time, alarm, count) = (clock.clone(), clock.clone(), Count(&ran));
    let flight_loop = &mut flight_loop;
    tasks.spawn(
        async move { match task::fly(sensing, flight_loop, || time.now(), alarm, count, write_motors).await {} },
    );

    let mut hash = FlightHash::new();
    let end = setup.simulation.start + expected.duration;
    while clock.now() < end {
        tasks.step();
        taps.drain(&mut |id, at, generation, words| hash.publish(id as u16, generation, at, words));
    }
    assert!(progress.finished.get(), "the mission was flown");
    assert!(world.truth_at(clock.now()).contact, "and the vehicle stands");
    assert_eq!(hash.finish(), recorder.hash());
    let steps = imu_health.samples();
    assert_eq!(ran.borrow()[0], steps, "an estimate for every sample");
    assert!(written.get() >= steps, "and a duty");
    assert!(healths.iter().all(|health| health.samples() > 20 && health.errors() == 0), "{healths:?}");
}
