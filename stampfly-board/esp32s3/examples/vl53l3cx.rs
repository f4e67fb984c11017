//! The range finders on the StampFly, on the battery: the one that looks ahead does not measure on USB alone.
#![no_std]
#![no_main]

mod board;

use board::*;
use embassy_embedded_hal::shared_bus::asynch::i2c::I2cDevice;
use embassy_executor::Spawner;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use esp_hal::gpio::{AnyPin, Level, Output, OutputConfig};
use examples::drivers::vl53l3cx;

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let board = Board::start();
    let bus: Mutex<NoopRawMutex, _> = Mutex::new(i2c::start(board.i2c).await);
    let asleep = |pin: AnyPin<'static>| Output::new(pin, Level::Low, OutputConfig::default());
    let shutdown = [asleep(board.range.bottom_enable.into()), asleep(board.range.front_enable.into())];
    end(vl53l3cx::run([I2cDevice::new(&bus), I2cDevice::new(&bus)], shutdown, Clock, &mut Printer).await);
}
