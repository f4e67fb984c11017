//! The StampFly's firmware: the assembly of `stampfly-board` on an ESP32-S3.
//!
//! | core | what runs there |
//! |---|---|
//! | 1 | flight: inertial and flow sensor, every runnable, the motors |
//! | 0 | radio, slow sensors, lights and button, console, and the cut-off that watches core 1 |
//!
//! Both cores have an executor in thread mode, because interrupts may not use the floating-point unit here. The code is
//! the same on an ESP32-C6, which has one core and no StampFly around it: that build is for looking at, not for flying.
#![no_std]
#![no_main]

extern crate alloc;

mod actions;
mod buzzer;
mod changes;
mod channel;
mod clock;
mod console;
mod cutoff;
mod facts;
mod flash;
mod flight;
#[cfg(feature = "hil")]
mod hil;
mod i2c;
mod imu_config;
mod memory;
mod motors;
mod panic;
mod people;
mod pins;
mod radio;
mod record;
mod safe_state;
mod sensors;
#[cfg_attr(feature = "esp32c6", allow(dead_code, reason = "it has one core"))]
mod sizes;
mod spi;
mod storage;
#[cfg(feature = "wifi")]
mod wifi;

use alloc::boxed::Box;
use clock::Clock;
use core::cell::RefCell;
use embassy_executor::Spawner;
use embassy_futures::block_on;
use esp_hal::clock::CpuClock;
use esp_hal::peripherals::{FLASH, Peripherals};
use esp_hal::ram;
use esp_hal::timer::timg::TimerGroup;
use memory::Memory;
use pins::*;
use sensors::Healths;
use stampfly_board::console::Profile;
use stampfly_board::golden::{Outcome, self_test};
use stampfly_board::schedule::{ACTIVATIONS, Runnables};
use stampfly_board::{Corrector, VehicleConfig, topics};
use stampfly_drivers::Timebase;
use stampfly_flight::{Assembled, FlightLoop, InPlace};
use stampfly_link::Address;
use stampfly_link::secure::{Key, Policy};
use stampfly_services::cable::fingerprint;
use stampfly_services::{CommandArbiter, RadioRequests};
use static_cell::StaticCell;
use storage::Storage;

esp_bootloader_esp_idf::esp_app_desc!();

#[esp_hal::main]
fn main() -> ! {
    safe_state::hold_low();
    safe_state::deselect();
    let chip = esp_hal::init(esp_hal::Config::default().with_cpu_clock(CpuClock::max()));
    // For the radio, which wants 96 kB, and the log: memory the boot loader has done with, and what the S3's data cache leaves over.
    #[cfg(feature = "esp32s3")]
    {
        esp_alloc::heap_allocator!(#[ram(reclaimed)] size: sizes::FIRST_HEAP);
        esp_alloc::heap_allocator!(#[ram(unstable(dcache_reclaimed))] size: sizes::SECOND_HEAP);
    }
    #[cfg(feature = "esp32c6")]
    {
        esp_alloc::heap_allocator!(#[ram(reclaimed)] size: 64 * 1024);
        esp_alloc::heap_allocator!(size: sizes::SECOND_HEAP);
    }
    #[cfg(feature = "hil")]
    if hil::is_wanted() {
        let pins: Pins<'static> = split_resources!(chip);
        hil::run(hil::Parts {
            motors: pins.motors,
            usb: chip.USB_DEVICE,
            ticks: chip.TIMG0,
            interrupt: chip.FROM_CPU_INTR0,
            cutoff: chip.TIMG1,
            bus: fresh_bus(),
        })
    }
    // On the heap, which the radio does not need yet: the stack would hold little else.
    let tested = self_test(&mut Box::new_uninit(), &mut fresh_bus());
    esp_println::println!("{tested}");
    if !tested.may_fly() {
        cutoff::lock_out();
    }
    start(chip, tested)
}

/// A bus for the self test, or for a flight without a world of its own. Not inlined, because it is made on the stack.
#[inline(never)]
fn fresh_bus() -> Box<topics::Bus> {
    Box::new(topics::Bus::new())
}

/// What is stored, and what uses it.
struct Stored {
    storage: Storage,
    config: VehicleConfig,
    /// Parameters that cannot be used.
    unusable: usize,
    peer: Option<Address>,
    key: Option<Key>,
    /// A network, and the time up to which signatures are reserved.
    #[cfg(feature = "wifi")]
    network: (Option<stampfly_services::association::Credentials>, Option<u64>),
}

/// What the tasks of the first core are given. Boxed, because a task keeps its arguments as long as what it makes of them.
struct Ground {
    sensors: Box<sensors::Parts>,
    people: Box<people::Parts>,
    memory: (&'static RefCell<Memory>, topics::SupervisorEnds<'static>),
    console: (&'static mut console::Console, console::Keys),
    radio: Box<radio::Parts>,
}

/// Assembles the vehicle and runs it. Apart from [`main`], so that the self test and this have the stack one after the other.
///
/// Executors never return, so what lies in a frame below them is never free again. Everything large is therefore made in a frame that
/// is gone by then, and waits on the heap until its task has it.
#[inline(never)]
fn start(chip: Peripherals, tested: Outcome) -> ! {
    motors::start_unit(chip.LEDC);
    esp_rtos::start(TimerGroup::new(chip.TIMG0).timer0, chip.FROM_CPU_INTR0);
    let stored = stored(chip.FLASH);
    let vehicle = assemble(&stored.config);
    let (flight, sensors, people, memory, radio, console) = in_a_frame_of_its_own(move || {
        let Stored {
            storage,
            config,
            unusable,
            peer,
            key,
            #[cfg(feature = "wifi")]
            network,
        } = *stored;
        #[cfg(feature = "wifi")]
        let (network, reserved) = (wifi::Network::new(network.0), network.1);
        let InPlace { flight_loop, mut outside, taps } = *vehicle;
        let watchdog = cutoff::start(chip.TIMG1, Some(outside.cutoff.cutoff_state));
        outside.self_test.self_test.publish(Clock.now(), &tested.message());
        let memory: &'static _ = Box::leak(Box::new(RefCell::new(Memory::new(taps))));
        static HEALTH: Healths = Healths::new();
        static PROFILE: Profile = Profile::new(&ACTIVATIONS);
        let pins: Pins<'static> = split_resources!(chip);
        let (ring, reader) = record::ring();
        let taken: &'static _ = Box::leak(Box::new(record::Taken::new(reader)));
        let flight = Box::new(flight::Parts {
            flight_loop,
            imu: outside.imu,
            flow: outside.flow,
            duties: outside.motors,
            motors: pins.motors,
            spi: spi::Parts { unit: chip.SPI2, dma: chip.DMA_CH0, pins: pins.spi, interrupts: chip.IO_MUX },
            watchdog,
            health: &HEALTH,
            profile: &PROFILE,
            corrector: Corrector::new(&config.corrections),
            ring,
        });
        let sensors = Box::new(sensors::Parts {
            unit: chip.I2C0,
            pins: pins.i2c,
            range: pins.range,
            tof: outside.tof,
            tof_front: outside.tof_front,
            mag: outside.mag,
            baro: outside.baro,
            power: outside.power,
            health: &HEALTH,
            corrector: Corrector::new(&config.corrections),
        });
        let people = Box::new(people::Parts {
            pulses: chip.RMT,
            pins: pins.people,
            indicator: outside.indicator,
            button: outside.button_pin,
        });
        let policy = Policy { accept_unauthenticated: config.accept_unauthenticated };
        static DESK: StaticCell<RefCell<RadioRequests>> = StaticCell::new();
        let tables = fingerprint(&topics::TOPICS, &config);
        let requests: &'static _ = DESK.init_with(|| RefCell::new(RadioRequests::new(tables)));
        static ARBITER: StaticCell<RefCell<CommandArbiter>> = StaticCell::new();
        let arbiter: &'static _ = ARBITER.init_with(|| RefCell::new(CommandArbiter::new()));
        let link = radio::link(peer, key.clone(), policy, outside.link);
        let radio = Box::new(radio::Parts {
            unit: chip.WIFI,
            link,
            arbiter,
            requests,
            taken,
            memory,
            #[cfg(feature = "wifi")]
            network,
        });
        let console = Box::new(console::Parts {
            memory,
            health: &HEALTH,
            profile: &PROFILE,
            ends: outside.console,
            storage,
            storage_ends: outside.storage,
            config,
            tested,
            facts: facts::Facts::read(unusable),
            key,
            link,
            arbiter,
            requests,
            taken,
            #[cfg(feature = "wifi")]
            network: (network, reserved),
        });
        (flight, sensors, people, (memory, outside.supervisor), radio, console)
    });
    // It is made on the stack, and large.
    let console = console::assemble(chip.USB_DEVICE, console);
    let ground = Ground { sensors, people, memory, console, radio };
    let fly = move |spawner: Spawner| spawner.spawn(flight::run(flight).expect("spawned once"));

    #[cfg(feature = "esp32s3")]
    {
        cores::start_second(chip.CPU_CTRL, chip.FROM_CPU_INTR1, fly);
        cores::run(move |spawner| spawn(spawner, ground))
    }
    #[cfg(feature = "esp32c6")]
    cores::run(move |spawner| {
        fly(spawner);
        spawn(spawner, ground);
    })
}

/// Does it apart from the caller's stack frame.
#[inline(never)]
fn in_a_frame_of_its_own<T>(what: impl FnOnce() -> T) -> T {
    what()
}

/// Starts the tasks of the first core.
#[inline(never)]
fn spawn(spawner: Spawner, ground: Ground) {
    let Ground { sensors, people, memory, console, radio } = ground;
    spawner.spawn(sensors::run(sensors).expect("spawned once"));
    spawner.spawn(people::run(people).expect("spawned once"));
    spawner.spawn(memory::run(memory.0, memory.1).expect("spawned once"));
    spawner.spawn(console::run(console.0, console.1).expect("spawned once"));
    spawner.spawn(radio::run(radio).expect("spawned once"));
}

/// Reads what is stored.
#[inline(never)]
fn stored(flash: FLASH<'static>) -> Box<Stored> {
    let mut storage = Storage::open(flash);
    let mut config = VehicleConfig::default();
    let unusable = block_on(storage.load(&mut config));
    if unusable > 0 {
        esp_println::println!("{unusable} stored parameters cannot be used; their defaults apply");
    }
    let peer = block_on(storage.load_peer());
    let key = block_on(storage.load_key());
    #[cfg(feature = "wifi")]
    let network = block_on(storage.load_network());
    Box::new(Stored {
        storage,
        config,
        unusable,
        peer,
        key,
        #[cfg(feature = "wifi")]
        network,
    })
}

/// Makes the bus and the vehicle on it.
#[inline(never)]
fn assemble(config: &VehicleConfig) -> Box<InPlace<'static, Runnables>> {
    static BUS: StaticCell<topics::Bus> = StaticCell::new();
    static FLIGHT_LOOP: StaticCell<FlightLoop<'static, Runnables>> = StaticCell::new();
    let bus = BUS.init_with(topics::Bus::new);
    Box::new(Assembled::in_place(FLIGHT_LOOP.uninit(), bus, None, config, Clock.now()))
}

/// Executors, one a core.
mod cores {
    use embassy_executor::Spawner;
    use esp_rtos::embassy::Executor;
    use static_cell::StaticCell;

    /// Runs tasks on the core it is called on, for ever.
    pub fn run(start: impl FnOnce(Spawner)) -> ! {
        static EXECUTOR: StaticCell<Executor> = StaticCell::new();
        EXECUTOR.init(Executor::new()).run(start)
    }

    /// Runs tasks on the second core, for ever, ahead of everything the radio might do there.
    #[cfg(feature = "esp32s3")]
    pub fn start_second(
        control: esp_hal::peripherals::CPU_CTRL<'static>,
        interrupt: esp_hal::peripherals::FROM_CPU_INTR1<'static>,
        start: impl FnOnce(Spawner) + Send + 'static,
    ) {
        use esp_hal::system::Stack;
        static STACK: StaticCell<Stack<{ super::sizes::FLIGHT_STACK }>> = StaticCell::new();
        static EXECUTOR: StaticCell<Executor> = StaticCell::new();
        esp_rtos::start_second_core(control, interrupt, STACK.init_with(Stack::new), || {
            esp_rtos::CurrentThreadHandle::get().set_priority(HIGHEST);
            EXECUTOR.init(Executor::new()).run(start)
        });
    }

    /// Of the threads of esp-rtos.
    #[cfg(feature = "esp32s3")]
    const HIGHEST: usize = 31;
}
