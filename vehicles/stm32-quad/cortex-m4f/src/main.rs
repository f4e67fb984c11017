//! Instructions of a pass of the quadcopter's flight band on a Cortex-M4F, counted, not timed: `cargo xtask stm32`.
//!
//! A pass is what the firmware's flight task does every 250 µs: the driver asks the MPU-6000 for a sample and converts it, the sample goes to the bus, sensor and
//! controller run, and the four pulses are computed. It ends when they are. Background runnables come after that and are not in it, nor is what belongs to the
//! chip's peripherals: SPI, DMA, timers.
//!
//! QEMU is told that an instruction takes 128 ns of its time ([`INSTRUCTION`]), so the core's timer counts instructions, exactly and the same on every host.
#![no_std]
#![no_main]

mod chip;

use chip::{Chip, Clock};
use core::cell::Cell;
use core::future::Future as _;
use core::hint::black_box;
use core::pin::pin;
use core::task::{Context, Waker};
use cortex_m::Peripherals;
use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;
use stampfly_control::esc;
use stampfly_drivers::Imu as _;
use stampfly_drivers::chip::mpu6000::{Config, Mpu6000};
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_flight::{Assembled, FlightLoop, task};
use stampfly_stm32_quad::Parameters;
use stampfly_stm32_quad::attitude::MOUNTING;
use stampfly_stm32_quad::messages::ReceiverInput;
use stampfly_stm32_quad::schedule::{PERIOD, Runnables};
use stampfly_stm32_quad::topics::{Bus, Outside};
use stampfly_types::Instant;

/// What an instruction takes of the emulator's time (`-icount shift=7`), ns.
const INSTRUCTION: u64 = 128;
/// A tick of the core's timer: the board runs at 25 MHz, ns.
const TICK: u64 = 40;
/// The timer counts down from here.
const RELOAD: u32 = 0x00ff_ffff;
/// Passes until the chip runs and the vehicle is in the state that is measured: half a second.
const BEFORE: u32 = 2_000;
/// Passes that are counted: a second and a half, so that the driver's question whether the chip restarted is among them.
const COUNTED: u32 = 6_000;
/// Passes from one packet to the next.
const PACKET: u32 = 36;

/// What the pilot does.
#[derive(Clone, Copy, PartialEq)]
enum Pilot {
    Flies { acro: bool },
    Calibrates,
}

#[entry]
fn main() -> ! {
    let mut timer = Peripherals::take().expect("the first to ask").SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(RELOAD);
    timer.clear_current();
    timer.enable_counter();

    count("angle", Pilot::Flies { acro: false });
    count("acro", Pilot::Flies { acro: true });
    count("calibrating", Pilot::Calibrates);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}

fn count(name: &str, pilot: Pilot) {
    let (micros, measured) = (Cell::new(0), Cell::new([0; 7]));
    let clock = Clock(&micros);
    let mut bus = Bus::new();
    let Assembled { mut flight_loop, outside, .. } =
        Assembled::<Runnables>::new(&mut bus, None, &Parameters::default(), Instant::ZERO);
    let Outside { mut imu, mut receiver, motors: mut duties, .. } = outside;
    let mut sensor = Mpu6000::new(Chip::new(&measured), clock, MOUNTING, Config::default());
    let health = SensorHealth::new();
    let sensing = run_sensor(
        async || sensor.next().await,
        |at, sample| _ = imu.sensor_imu.publish(at, sample),
        clock,
        Backoff::CRITICAL,
        &health,
    );
    // When the pulses were there, and whether one was above the least.
    let (ended, turn) = (Cell::new(None), Cell::new(false));
    let write = |_, _: &mut FlightLoop<'_, Runnables>| {
        if let Some(output) = duties.actuator_motor.latest() {
            let shares = output.data.duty.get(..4).unwrap_or_default();
            shares.iter().for_each(|share| _ = black_box(esc::counts(*share)));
            ended.set(Some(SYST::get_current()));
            turn.set(shares.iter().any(|share| *share > 0.0));
        }
    };
    let now = || Instant::from_micros(micros.get());
    let mut flying = pin!(task::fly(sensing, &mut flight_loop, now, clock, (), write));
    let mut context = Context::from_waker(Waker::noop());

    let empty = SYST::get_current().wrapping_sub(SYST::get_current()) & RELOAD;
    let (mut sum, mut most, mut passes, mut random) = (0, 0, 0u32, 1u32);
    for step in 0..BEFORE + COUNTED {
        micros.set(micros.get() + PERIOD.as_micros());
        let mut noise = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 16) as i16 / 64
        };
        // Level, turning by up to 30°/s, in the chip's counts.
        measured.set([noise() / 4, noise() / 4, 2_048 + noise() / 4, 0, noise(), noise(), noise()]);
        if step.is_multiple_of(PACKET) {
            let stick = (step / PACKET % 20) as f32 / 100.0 + 0.4;
            let aux = [if pilot == (Pilot::Flies { acro: true }) { 1.0 } else { 0.0 }, 0.0, 0.0, 0.0];
            let flown = ReceiverInput { roll: stick, pitch: 1.0 - stick, yaw: stick, throttle: 0.5, aux };
            let input = match pilot {
                Pilot::Flies { .. } if step < BEFORE - 10 * PACKET => {
                    ReceiverInput { yaw: 1.0, throttle: 0.0, ..flown }
                }
                Pilot::Flies { .. } => flown,
                Pilot::Calibrates if step < BEFORE - 10 * PACKET => ReceiverInput { throttle: 0.0, ..flown },
                Pilot::Calibrates => ReceiverInput { yaw: 0.0, throttle: 1.0, ..flown },
            };
            receiver.receiver_input.publish(now(), &input);
        }
        ended.set(None);
        let began = SYST::get_current();
        _ = black_box(flying.as_mut().poll(&mut context));
        let Some(end) = ended.get().filter(|_| step >= BEFORE) else { continue };
        let taken = (began.wrapping_sub(end) & RELOAD) - empty;
        let state = receiver.control_state.latest().map(|state| state.data).unwrap_or_default();
        let as_meant = match pilot {
            Pilot::Flies { acro } => state.armed && state.angle_mode != acro && turn.get(),
            Pilot::Calibrates => state.calibrating,
        };
        if as_meant {
            passes += 1;
            sum += u64::from(taken);
            most = most.max(taken);
        }
    }
    let [mean, most] = [instructions(sum) / u64::from(passes.max(1)), instructions(u64::from(most))];
    hprintln!("{}: passes {} mean {} most {} samples {}", name, passes, mean, most, health.samples());
}

fn instructions(ticks: u64) -> u64 {
    (ticks * TICK + INSTRUCTION / 2) / INSTRUCTION
}
