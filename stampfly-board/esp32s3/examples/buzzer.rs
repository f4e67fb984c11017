//! The buzzer of the StampFly: every tune.
#![no_std]
#![no_main]

mod board;

use board::*;
use embassy_executor::Spawner;

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let channel = board::buzzer::Channel::new(Board::start().people.buzzer.into());
    end(examples::drivers::buzzer::run(channel, Clock, &mut Printer).await);
}
