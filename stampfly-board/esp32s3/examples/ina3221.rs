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
    let bus = i2c::Bus::start(board.i2c, board.i2c_pins).await;
    end(ina3221::run(bus, Clock, &mut Printer).await);
}
