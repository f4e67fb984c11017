//! What every example on the StampFly needs: the firmware's own modules, the board started, motors off.
//!
//! The modules are the firmware's files, not copies. What they expect at the root of their program is here, so a program
//! begins with `mod board; use board::*;`. The motors are off from the first statement on, a panic keeps them off, and
//! so does the cut-off when an example stops controlling them.
#![allow(dead_code, unused_imports, reason = "each example uses a part of the board")]

#[path = "../../src/buzzer.rs"]
pub mod buzzer;
#[path = "../../src/clock.rs"]
pub mod clock;
#[path = "../../src/cutoff.rs"]
pub mod cutoff;
#[path = "../../src/i2c.rs"]
pub mod i2c;
#[path = "../../src/imu_config.rs"]
pub mod imu_config;
#[path = "../../src/motors.rs"]
pub mod motors;
#[path = "../../src/panic.rs"]
mod panic;
#[macro_use]
#[path = "../../src/pins.rs"]
pub mod pins;
#[path = "../../src/safe_state.rs"]
pub mod safe_state;
#[path = "../../src/spi.rs"]
pub mod spi;

pub use clock::Clock;
pub use esp_println::Printer;

use core::fmt::Debug;
use esp_hal::clock::CpuClock;
use esp_hal::peripherals::{I2C0, RMT};
use esp_hal::ram;
use esp_hal::timer::timg::TimerGroup;
use examples::drivers::Failure;
use pins::*;
use stampfly_flight::Watchdog;

esp_bootloader_esp_idf::esp_app_desc!();

/// The pins and units, each with what it is for.
pub struct Board {
    pub motors: MotorPins<'static>,
    pub spi: spi::Parts,
    /// The unit of the slow sensors' bus.
    pub i2c: I2C0<'static>,
    pub i2c_pins: I2cPins<'static>,
    pub range: RangePins<'static>,
    pub people: PeoplePins<'static>,
    /// The unit that makes the lights' pulses.
    pub pulses: RMT<'static>,
    /// What the motors feed.
    pub watchdog: &'static Watchdog,
}

impl Board {
    /// Stops the motors, then starts the processor, the clock and the cut-off. The first thing a program does.
    pub fn start() -> Self {
        safe_state::hold_low();
        safe_state::deselect();
        let chip = esp_hal::init(esp_hal::Config::default().with_cpu_clock(CpuClock::max()));
        // Memory the boot loader has done with.
        esp_alloc::heap_allocator!(#[ram(reclaimed)] size: 64 * 1024);
        motors::start_unit(chip.LEDC);
        esp_rtos::start(TimerGroup::new(chip.TIMG0).timer0, chip.FROM_CPU_INTR0);
        let watchdog = cutoff::start(chip.TIMG1, None);
        let pins: Pins<'static> = split_resources!(chip);
        Self {
            motors: pins.motors,
            spi: spi::Parts { unit: chip.SPI2, dma: chip.DMA_CH0, pins: pins.spi, interrupts: chip.IO_MUX },
            i2c: chip.I2C0,
            i2c_pins: pins.i2c,
            range: pins.range,
            people: pins.people,
            pulses: chip.RMT,
            watchdog,
        }
    }
}

/// The last thing a program does.
pub fn end<T, E: Debug>(outcome: Result<T, Failure<E>>) {
    match outcome {
        Ok(_) => esp_println::println!("That was it; reset to see it again."),
        Err(failure) => esp_println::println!("That did not work: {failure:?}"),
    }
}
