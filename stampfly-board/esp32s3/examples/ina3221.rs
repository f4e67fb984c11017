//! The battery monitor on the StampFly: on the battery, not on USB alone.
#![no_std]
#![no_main]

mod board;

use board::*;
use embassy_executor::Spawner;
use examples::drivers::ina3221;

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let board = Board::start();
    let mut bus = i2c::Bus::start(board.i2c, board.i2c_pins).await;
    let mut out = Printer;
    if let Err(failure) = ina3221::self_test(&mut bus, Clock, &mut out).await {
        return end::<(), _>(Err(failure));
    }
    end(ina3221::run(bus, Clock, &mut out).await);
}
