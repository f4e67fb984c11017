//! The optical flow sensor on the StampFly: move it over a floor with a pattern.
#![no_std]
#![no_main]

mod board;

use board::*;
use embassy_executor::Spawner;
use examples::drivers::pmw3901;

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let mut bus = spi::Bus::start(Board::start().spi);
    let (_, mut flow, _) = bus.devices();
    let mut out = Printer;
    if let Err(failure) = pmw3901::self_test(&mut flow, Clock, &mut out).await {
        return end::<(), _>(Err(failure));
    }
    end(pmw3901::run(flow, Clock, &mut out).await);
}
