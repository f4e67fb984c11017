//! The receiver's radio: an nRF24L01 that is polled, because this board's wire for its interrupt goes nowhere.

use crate::interrupts::Interrupts;
use crate::memory::Memory;
use core::cell::RefCell;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{DMA1_CH2, DMA1_CH3, PA3, PA4, PA5, PA6, PA7, SPI1};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_time::{Delay, Timer};
use embedded_hal_bus::spi::ExclusiveDevice;
use stampfly_drivers::chip::nrf24l01::{Config, NoPin, Nrf24l01};
use stampfly_drivers::{EmbassyClock, Timebase as _};
use stampfly_stm32_quad::receiver::Receiver;
use stampfly_stm32_quad::topics::ReceiverEnds;

type Device = ExclusiveDevice<Spi<'static, Async, Master>, Output<'static>, Delay>;
/// The radio on its bus.
pub type Radio = Nrf24l01<Device, Output<'static>, EmbassyClock, NoPin, 10>;

/// The radio.
#[expect(clippy::too_many_arguments, reason = "a pin each")]
pub fn radio(
    spi: Peri<'static, SPI1>,
    clock: Peri<'static, PA5>,
    out: Peri<'static, PA7>,
    into: Peri<'static, PA6>,
    out_dma: Peri<'static, DMA1_CH3>,
    into_dma: Peri<'static, DMA1_CH2>,
    select: Peri<'static, PA4>,
    enable: Peri<'static, PA3>,
) -> Radio {
    let mut config = spi::Config::default();
    config.mode = spi::MODE_0;
    config.frequency = Hertz(8_000_000);
    let bus = Spi::new(spi, clock, out, into, out_dma, into_dma, Interrupts, config);
    let Ok(device) = ExclusiveDevice::new(bus, Output::new(select, Level::High, Speed::VeryHigh), Delay);
    Nrf24l01::new(device, Output::new(enable, Level::Low, Speed::VeryHigh), EmbassyClock, Config::default())
}

/// Listens until power-off. A transmitter that binds is stored, which no armed vehicle does.
#[embassy_executor::task]
pub async fn listen(mut radio: Radio, memory: &'static RefCell<Memory>, ends: ReceiverEnds<'static>) {
    let stored = memory.borrow_mut().load().link;
    let mut receiver = Receiver::new(stored, EmbassyClock.now(), ends);
    loop {
        if memory.borrow_mut().is_binding_asked() {
            receiver.bind();
        }
        match receiver.step(&mut radio, EmbassyClock.now()).await {
            Ok(Some(link)) => memory.borrow_mut().change(|stored| stored.link = Some(link)),
            Ok(None) => {}
            Err(_) => Timer::after_millis(10).await,
        }
    }
}
