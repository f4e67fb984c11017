//! The range finders on the StampFly, on the battery: the one that looks ahead does not measure on USB alone.
#![no_std]
#![no_main]

mod board;

use board::*;
use embassy_executor::Spawner;
use esp_hal::gpio::{AnyPin, Level, Output, OutputConfig};
use examples::drivers::vl53l3cx;
use stampfly_drivers::shared::SharedI2c;

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let board = Board::start();
    let mut bus = SharedI2c::new(i2c::Bus::start(board.i2c, board.i2c_pins).await);
    let (mut buses, _) = bus.split();
    let asleep = |pin: AnyPin<'static>| Output::new(pin, Level::Low, OutputConfig::default());
    let mut shutdown = [asleep(board.range.bottom_enable.into()), asleep(board.range.front_enable.into())];
    let mut out = Printer;
    if let Err(failure) = vl53l3cx::self_test(buses.each_mut(), shutdown.each_mut(), Clock, &mut out).await {
        return end::<(), _>(Err(failure));
    }
    end(vl53l3cx::run(buses, shutdown, Clock, &mut out).await);
}
