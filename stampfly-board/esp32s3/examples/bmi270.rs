//! The inertial sensor on the StampFly: leave it still for the self test, then tilt and turn it.
#![no_std]
#![no_main]

mod board;

use board::*;
use embassy_executor::Spawner;
use examples::drivers::bmi270;

#[esp_rtos::main]
async fn main(_spawner: Spawner) {
    let mut bus = spi::Bus::start(Board::start().spi);
    let (mut imu, ..) = bus.devices();
    let mut out = Printer;
    if let Err(failure) = bmi270::self_test(&mut imu, Clock, imu_config::FILE, &mut out).await {
        return end::<(), _>(Err(failure));
    }
    end(bmi270::run(imu, Clock, imu_config::FILE, &mut out).await);
}
