//! The StampFly's firmware.
#![no_std]
#![no_main]

mod cutoff;
mod motors;
mod panic;
mod pins;

extern crate alloc;

use esp_hal::clock::CpuClock;
use esp_hal::ram;
use esp_hal::timer::timg::TimerGroup;
use motors::Motors;
use pins::*;
use stampfly_drivers::MotorOutputs;

esp_bootloader_esp_idf::esp_app_desc!();

#[esp_hal::main]
fn main() -> ! {
    motors::cut();
    let chip = esp_hal::init(esp_hal::Config::default().with_cpu_clock(CpuClock::max()));
    let pins: Pins<'static> = split_resources!(chip);
    let mut motors = Motors::new(chip.LEDC, pins.motors);
    esp_alloc::heap_allocator!(#[ram(reclaimed)] size: 64 * 1024);
    esp_alloc::heap_allocator!(size: 36 * 1024);
    let group = TimerGroup::new(chip.TIMG0);
    esp_rtos::start(group.timer0, chip.FROM_CPU_INTR0);
    let radio = esp_radio::wifi::WifiController::new(chip.WIFI, Default::default()).expect("the radio starts");
    let _link = radio.esp_now().split();
    cutoff::start(TimerGroup::new(chip.TIMG1).timer0);
    loop {
        let _ = motors.write(&Default::default());
    }
}
