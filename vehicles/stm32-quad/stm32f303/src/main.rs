//! The STM32 quadcopter's firmware: an STM32F303CC at 64 MHz, an MPU-6000, an nRF24L01, four speed controllers.
//!
//! | what | pins |
//! |---|---|
//! | battery, behind a divider | PA0 |
//! | speed controllers 1 to 4 | PB6, PB7, PB8, PB9: timer 4 |
//! | inertial sensor | SPI 2: select PB12, clock PB13, in PB14, out PB15 |
//! | radio | SPI 1: enable PA3, select PA4, clock PA5, in PA6, out PA7 |
//! | lights, front and back | PB3, PB4 |
//! | serial line, 115200 baud | USART 1: out PA9, in PA10 |
//!
//! The flight band runs in an interrupt's executor, above everything else; radio, lights and serial line share the thread's. Passes of the flight band that are in time feed the
//! chip's independent watchdog, which resets it when there are none.
//! With the out pin of the serial line held low at power-on, the vehicle is made new instead: see `startup`.

#![no_std]
#![no_main]

mod flight;
mod interrupts;
mod lights;
mod memory;
mod radio;
mod serial;
mod startup;

use core::cell::RefCell;
use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::Config;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt as _, Priority};
use embassy_stm32::rcc::{APBPrescaler, Pll, PllMul, PllPreDiv, PllSource, Sysclk};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::Timer;
use memory::Memory;
use panic_probe as _;
use stampfly_drivers::{EmbassyClock, Timebase as _};
use stampfly_flight::{Assembled, InPlace};
use stampfly_stm32_quad::schedule::Runnables;
use stampfly_stm32_quad::topics::{Bus, Outside};
use static_cell::StaticCell;

/// What flies. Polled by an interrupt that no device of this board has.
static FLIGHT: InterruptExecutor = InterruptExecutor::new();

#[embassy_stm32::interrupt]
unsafe fn SPI3() {
    // SAFETY: this is the interrupt with which the executor was started, and nothing else calls it.
    unsafe { FLIGHT.on_interrupt() }
}

/// 64 MHz from the internal oscillator, as fast as it goes: 8 MHz, halved, times sixteen. The first bus takes half of it at most.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.pll = Some(Pll { src: PllSource::HSI, prediv: PllPreDiv::DIV2, mul: PllMul::MUL16 });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.apb1_pre = APBPrescaler::DIV2;
    config
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let mut board = embassy_stm32::init(clocks());
    static MEMORY: StaticCell<RefCell<Memory>> = StaticCell::new();
    let memory = MEMORY.init(RefCell::new(Memory::new(board.FLASH)));
    let lights = [Output::new(board.PB3, Level::Low, Speed::Low), Output::new(board.PB4, Level::Low, Speed::Low)];
    let motors = flight::Motors::new(board.TIM4, board.PB6, board.PB7, board.PB8, board.PB9);

    // Nothing but a wire to ground pulls against this.
    let pulled = Input::new(board.PA9.reborrow(), Pull::Up);
    Timer::after_millis(100).await;
    if pulled.is_low() {
        startup::run(memory, lights, motors).await;
    }
    drop(pulled);

    let stored = memory.borrow_mut().load();
    static BUS: StaticCell<Bus> = StaticCell::new();
    static FLIGHT_LOOP: StaticCell<flight::Loop> = StaticCell::new();
    let now = EmbassyClock.now();
    // The stack has no room for a copy of the flight loop.
    let InPlace { flight_loop, outside, taps } =
        Assembled::<Runnables>::in_place(FLIGHT_LOOP.uninit(), BUS.init_with(Bus::new), None, &stored.parameters, now);
    let Outside { imu, battery, receiver, motors: duties, lights: shown, link } = outside;

    let sensor =
        flight::sensor(board.SPI2, board.PB13, board.PB15, board.PB14, board.DMA1_CH5, board.DMA1_CH4, board.PB12);
    interrupt::SPI3.set_priority(Priority::P6);
    let mut watchdog = IndependentWatchdog::new(board.IWDG, flight::STALLED);
    watchdog.unleash();
    let parts = flight::Parts { flight_loop, sensor, imu, motors, duties, watchdog };
    FLIGHT.start(interrupt::SPI3).spawn(flight::fly(parts).expect("the first of its kind"));

    let radio =
        radio::radio(board.SPI1, board.PA5, board.PA7, board.PA6, board.DMA1_CH3, board.DMA1_CH2, board.PA4, board.PA3);
    spawner.spawn(radio::listen(radio, memory, receiver).expect("the first of its kind"));
    spawner.spawn(lights::shine(lights, shown, board.ADC1, board.PA0, battery).expect("the first of its kind"));
    spawner
        .spawn(serial::answer(board.USART1, board.PA10, board.PA9, memory, taps, link).expect("the first of its kind"));
}
