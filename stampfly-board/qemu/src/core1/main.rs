//! The core that flies, by itself: the firmware's flight task with its drivers and its executor, on an emulated core. `cargo xtask cache`.
//!
//! What a pass of the flight band takes is half of what this core does: the inertial sensor's driver wakes up three times a sample, the flow
//! sensor's transfers lie between the passes, background activations fill what is left. Here all of it runs as in
//! `stampfly-board/esp32s3/src/flight.rs`: both drivers in their slots, the flight loop, embassy's executor. The hardware around
//! it is a [script](script) of a flight that was flown on a PC over emulated chips, and a driver that says something else to its
//! chip than it did there ends the run. A pass, for the marks, is everything from one sample of the inertial sensor to the next.
//!
//! Left out are what no other machine has: the HAL's registers, the entry of interrupts, the motors' timers.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg_attr(target_arch = "riscv32", path = "../machine/riscv.rs")]
#[cfg_attr(target_arch = "xtensa", path = "../machine/xtensa.rs")]
#[cfg_attr(not(target_os = "none"), path = "../machine/host.rs")]
#[allow(dead_code, reason = "nothing is counted here")]
mod machine;

/// `println!` on whatever the machine has.
macro_rules! outln {
    ($($text:tt)*) => { crate::machine::line(format_args!($($text)*)) };
}

#[cfg(feature = "core1-compact")]
mod compact;
mod hardware;
#[path = "../marks.rs"]
#[allow(dead_code, reason = "this program counts nothing")]
mod marks;
mod script;

use embassy_executor::raw::Executor;
use embassy_futures::join::join;
use hardware::{Chip, Clock, Hardware, Pin};
use script::{Sample, Script};
use stampfly_board::console::Profile;
use stampfly_board::schedule::{ACTIVATIONS, Runnables};
use stampfly_board::topics::{self, Id};
use stampfly_board::{VehicleConfig, devices};
use stampfly_bus::Taps;
use stampfly_drivers::slot::Slots;
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{Imu, OpticalFlow, Timebase};
use stampfly_flight::newest::message;
use stampfly_flight::task::fly;
use stampfly_flight::{Assembled, FlightLoop, InPlace, Stopwatch, Watchdog};
use stampfly_log::FlightHash;
use stampfly_types::Duration;
use static_cell::StaticCell;

/// A flight that was flown on a PC.
static SCRIPT: &[u8] = include_bytes!(env!("STAMPFLY_CORE1"));

#[cfg(not(target_arch = "xtensa"))]
#[cfg_attr(target_arch = "riscv32", machine::entry)]
fn main() -> ! {
    machine::start();
    machine::end(run())
}

#[cfg(target_arch = "xtensa")]
#[unsafe(no_mangle)]
#[expect(unsafe_code, reason = "xtensa/start.S calls it by its name")]
extern "C" fn main() -> ! {
    machine::start();
    machine::end(run())
}

/// What flies.
struct Parts {
    flight_loop: &'static mut FlightLoop<'static, Runnables>,
    imu: topics::ImuEnds<'static>,
    flow: topics::FlowEnds<'static>,
    duties: topics::MotorsEnds<'static>,
    hardware: &'static Hardware,
    image: &'static [u8],
    health: &'static [SensorHealth; 2],
    profile: &'static Profile,
    watchdog: &'static Watchdog,
    #[cfg(feature = "core1-compact")]
    compact: compact::Writer,
}

/// Flies until the script ends. As the firmware's `flight::run`.
#[embassy_executor::task]
async fn flight(parts: Parts) {
    #[cfg(feature = "core1-compact")]
    let mut compact_writer = parts.compact;
    let Parts { flight_loop, mut imu, mut flow, mut duties, hardware, image, health, profile, watchdog, .. } = parts;
    let time = Clock(hardware);
    let mut slots = Slots::new(time, devices::RHYTHM);
    let (imu_chip, flow_chip) = (Chip { hardware, number: 0 }, Chip { hardware, number: 1 });
    let (imu_chip, flow_chip, _) = slots.split(imu_chip, flow_chip, devices::LONGEST_FLOW);
    let mut imu_chip = devices::imu(imu_chip, time, image).with_interrupt(Pin(hardware));
    let mut flow_chip = devices::flow(flow_chip, time);
    let sensing = run_sensor(
        async || imu_chip.next().await,
        |at, sample| _ = imu.sensor_imu.publish(at, sample),
        time,
        Backoff::CRITICAL,
        &health[0],
    );
    let looking_down = run_sensor(
        async || flow_chip.next().await,
        |at, sample| _ = flow.sensor_flow.publish(at, sample),
        time,
        Backoff::SHARED,
        &health[1],
    );
    let clock = || time.now();
    #[cfg(feature = "core1-compact")]
    let record = compact_writer.shared();
    let write = |_now, _flight_loop: &mut FlightLoop<'_, Runnables>| {
        #[cfg(feature = "core1-compact")]
        compact_writer.pass(_flight_loop);
        if duties.actuator_motor.has_new()
            && let Some(output) = duties.actuator_motor.latest()
        {
            hardware.set_armed(output.data.armed);
            watchdog.feed(time.now(), output.data.armed);
        }
    };
    let observer = Stopwatch::new(profile, clock);
    #[cfg(feature = "core1-compact")]
    let observer = (observer, compact::Counted(record));
    let flying = fly(sensing, flight_loop, clock, time, observer, write);
    join(flying, looking_down).await;
}

/// Whatever the executor rings: nobody sleeps.
#[unsafe(export_name = "__pender")]
#[expect(unsafe_code, reason = "the executor calls it by its name")]
fn pender(_: *mut ()) {}

/// Flies and says what came of it. Did every driver say what it said on the PC?
fn run() -> bool {
    let Some(script) = Script::open(SCRIPT) else {
        outln!("no script");
        return false;
    };
    let (start, image) = (script.start, script.image);
    static BUS: StaticCell<topics::Bus> = StaticCell::new();
    static FLIGHT_LOOP: StaticCell<FlightLoop<'static, Runnables>> = StaticCell::new();
    static HARDWARE: StaticCell<Hardware> = StaticCell::new();
    static EXECUTOR: StaticCell<Executor> = StaticCell::new();
    static HEALTH: [SensorHealth; 2] = [SensorHealth::new(), SensorHealth::new()];
    static PROFILE: Profile = Profile::new(&ACTIVATIONS);
    static WATCHDOG: Watchdog = Watchdog::new(Duration::from_millis(25));

    let hardware: &'static Hardware = HARDWARE.init_with(|| Hardware::new(script));
    let bus = BUS.init_with(topics::Bus::new);
    let config = VehicleConfig::default();
    let InPlace { flight_loop, outside, mut taps } =
        Assembled::in_place(FLIGHT_LOOP.uninit(), bus, None, &config, start);
    let mut other_core = OtherCore {
        tof: outside.tof,
        tof_front: outside.tof_front,
        mag: outside.mag,
        baro: outside.baro,
        power: outside.power,
        self_test: outside.self_test,
        link: outside.link,
        button: outside.button_pin,
    };
    #[cfg(feature = "core1-compact")]
    let (compact, mut reader) = compact::begin(flight_loop);
    let executor = EXECUTOR.init_with(|| Executor::new(core::ptr::null_mut()));
    let parts = Parts {
        flight_loop,
        imu: outside.imu,
        flow: outside.flow,
        duties: outside.motors,
        hardware,
        image,
        health: &HEALTH,
        profile: &PROFILE,
        watchdog: &WATCHDOG,
        #[cfg(feature = "core1-compact")]
        compact,
    };
    let Ok(task) = flight(parts) else {
        outln!("no room for the task");
        return false;
    };
    executor.spawner().spawn(task);
    let (mut hash, mut messages) = (FlightHash::new(), 0u32);
    loop {
        // SAFETY: never from within a task, and nobody else polls it.
        #[expect(unsafe_code, reason = "a machine without interrupts polls its executor itself")]
        unsafe {
            executor.poll();
        }
        marks::aside_begins();
        taps.drain(&mut |topic, at, generation, words| {
            hash.publish(topic as u16, generation, at, words);
            messages += 1;
        });
        #[cfg(feature = "core1-compact")]
        reader.take_datagrams();
        marks::aside_ends();
        if !hardware.sleep(|sample| other_core.publish(sample)) {
            break;
        }
    }
    let waits = hardware.waits();
    let [imu, flow] = &HEALTH;
    outln!("published: {messages} messages, hash {:016x}", hash.finish());
    outln!("sensors: imu {imu}; flow {flow}");
    outln!("until {} us", Clock(hardware).now().as_micros());
    outln!(
        "waits: mean {} most {} us of {} periods",
        waits.all.as_micros() / u64::from(waits.periods.max(1)),
        waits.most.as_micros(),
        waits.periods
    );
    #[cfg(feature = "core1-compact")]
    reader.print();
    if hardware.was_left() {
        outln!("a driver says something else than on the PC");
    }
    !hardware.was_left() && imu.samples() > 400 && imu.errors() == 0
}

/// What the other core publishes.
struct OtherCore {
    tof: topics::TofEnds<'static>,
    tof_front: topics::TofFrontEnds<'static>,
    mag: topics::MagEnds<'static>,
    baro: topics::BaroEnds<'static>,
    power: topics::PowerEnds<'static>,
    self_test: topics::SelfTestEnds<'static>,
    link: topics::LinkEnds<'static>,
    button: topics::ButtonPinEnds<'static>,
}

impl OtherCore {
    fn publish(&mut self, sample: &Sample<'_>) {
        let words: heapless::Vec<u32, 64> = sample.words().collect();
        macro_rules! publish {
            ($($topic:ident on $owner:ident),+) => { match sample.topic {
                $(topic if topic == Id::$topic as usize => {
                    if let Some(data) = message(&words) {
                        _ = self.$owner.$topic.publish(sample.at, &data);
                    }
                })+
                topic if topic == Id::command_guided as usize => {
                    if let Some(data) = message(&words) {
                        _ = self.link.command_guided.publish(sample.at, data);
                    }
                }
                _ => outln!("nobody publishes on topic {}", sample.topic),
            } };
        }
        publish!(
            sensor_tof on tof, sensor_tof_front on tof_front, sensor_mag on mag, sensor_baro on baro, sensor_power on power,
            self_test on self_test, command_pilot on link, link_peer on link, button_contact on button
        );
    }
}
