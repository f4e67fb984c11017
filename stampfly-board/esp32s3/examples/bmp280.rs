//! The barometer on the StampFly: lift it after a second.
#![no_std]
#![no_main]

mod board;

use board::*;
use embassy_executor::Spawner;
use examples::drivers::bmp280;

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let board = Board::start();
    let mut bus = i2c::Bus::start(board.i2c, board.i2c_pins).await;
    let mut out = Printer;
    if let Err(failure) = bmp280::self_test(&mut bus, Clock, &mut out).await {
        return end::<(), _>(Err(failure));
    }
    end(bmp280::run(bus, Clock, &mut out).await);
}
