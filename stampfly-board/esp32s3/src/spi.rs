//! The SPI bus: the inertial sensor and the flow sensor, each with its own speed and chip select.
//!
//! Both are in [one mode](devices::SPI_MODE), for the unit changes the clock's idle level only when a transfer begins. After a transfer in mode 0 the clock would
//! rise with the flow sensor already selected, which would take that for a bit (the S3's SPI with a chip select of the program's:
//! esp-idf issue 12543). The inertial sensor takes either mode, by the clock's level when it is selected (BMI270 data sheet,
//! section 7.1).
//!
//! Long transfers go by DMA. A transfer that is dropped half-way releases its chip, so that the next one finds the bus in
//! order. Both chips are deselected before the first transfer, or the one nobody talks to would talk, too. Who transfers
//! when is decided by [slots](stampfly_drivers::slot); the lock here is never waited for.

use crate::clock::Clock;
use crate::pins::SpiPins;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use embedded_hal::spi::{Phase, Polarity};
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::{ErrorType, Operation, SpiBus, SpiDevice};
use esp_hal::Async;
use esp_hal::delay::Delay;
use esp_hal::gpio::{AnyPin, Input, InputConfig, Io, Level, Output, OutputConfig};
use esp_hal::interrupt::Priority;
use esp_hal::peripherals::{DMA_CH0, IO_MUX, SPI2};
use esp_hal::spi::master::{Config, Spi, SpiDma};
use esp_hal::spi::{Error, Mode};
use esp_hal::time::Rate;
use esp_hal::{dma_rx_buffer, dma_tx_buffer};
use stampfly_board::devices;

/// The longest transfer is a chunk of the inertial sensor's configuration with its address.
const LONGEST: usize = 512;
/// [`devices::SPI_SPUN`], ns.
const SPUN: u32 = devices::SPI_SPUN.as_micros() as u32 * 1_000;
/// The unit's name for the mode.
const MODE: Mode = match (devices::SPI_MODE.polarity, devices::SPI_MODE.phase) {
    (Polarity::IdleLow, Phase::CaptureOnFirstTransition) => Mode::_0,
    (Polarity::IdleLow, Phase::CaptureOnSecondTransition) => Mode::_1,
    (Polarity::IdleHigh, Phase::CaptureOnFirstTransition) => Mode::_2,
    (Polarity::IdleHigh, Phase::CaptureOnSecondTransition) => Mode::_3,
};

/// What the bus is made of. It is started where it is used, so that its interrupts come there.
pub struct Parts {
    pub unit: SPI2<'static>,
    pub dma: DMA_CH0<'static>,
    pub pins: SpiPins<'static>,
    /// Whose interrupts all pins share.
    pub interrupts: IO_MUX<'static>,
}

type Shared = Mutex<NoopRawMutex, SpiDma<'static, Async>>;

/// The bus with both chips deselected.
pub struct Bus {
    shared: Shared,
    imu: Output<'static>,
    flow: Output<'static>,
    ready: Input<'static>,
}

/// A chip on the bus.
pub struct Device<'b> {
    shared: &'b Shared,
    select: &'b mut Output<'static>,
    config: Config,
}

impl Bus {
    /// Deselects both chips and starts the bus.
    pub fn start(parts: Parts) -> Self {
        let deselected = |pin: AnyPin<'static>| Output::new(pin, Level::High, OutputConfig::default());
        let pins = parts.pins;
        let (imu, flow) = (deselected(pins.imu_select.into()), deselected(pins.flow_select.into()));
        let mut unit = Spi::new(parts.unit, imu_config())
            .expect("10 MHz is possible")
            .with_sck(pins.clock)
            .with_mosi(pins.to_chips)
            .with_miso(pins.from_chips);
        // To nobody: from here on the clock idles at its level, before anybody is selected. An error shows again with the first chip.
        _ = unit.write(&[0]);
        let unit = unit
            .with_dma(parts.dma)
            .with_buffers(
                dma_rx_buffer!(LONGEST).expect("descriptors for the whole buffer"),
                dma_tx_buffer!(LONGEST).expect("descriptors for the whole buffer"),
            )
            .into_async();
        // Until now they went to the core that started the chip, and to whatever its radio leaves over.
        Io::new(parts.interrupts).set_interrupt_priority(Priority::Priority1);
        let ready = Input::new(pins.imu_ready, InputConfig::default());
        Self { shared: Mutex::new(unit), imu, flow, ready }
    }

    /// The inertial sensor, the flow sensor, and the pin by which the first says that it has samples.
    pub fn devices(&mut self) -> (Device<'_>, Device<'_>, &mut Input<'static>) {
        let Self { shared, imu, flow, ready } = self;
        let imu = Device { shared, select: imu, config: imu_config() };
        (imu, Device { shared, select: flow, config: flow_config() }, ready)
    }
}

fn imu_config() -> Config {
    config(devices::SPI_CLOCKS[0])
}

fn flow_config() -> Config {
    config(devices::SPI_CLOCKS[1])
}

fn config(hertz: u32) -> Config {
    let config = Config::default().with_frequency(Rate::from_hz(hertz)).with_mode(MODE);
    config.with_min_async_transfer_size(devices::SPI_DMA_FROM)
}

/// A chip that listens until this is dropped.
struct Selected<'s>(&'s mut Output<'static>);

impl<'s> Selected<'s> {
    fn new(select: &'s mut Output<'static>) -> Self {
        select.set_low();
        Self(select)
    }
}

impl Drop for Selected<'_> {
    fn drop(&mut self) {
        self.0.set_high();
    }
}

impl ErrorType for Device<'_> {
    type Error = Error;
}

impl SpiDevice for Device<'_> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Error> {
        let mut unit = self.shared.lock().await;
        unit.apply_config(&self.config).map_err(|_| Error::Unsupported)?;
        // Dropped, and with it the chip deselected, before the bus is free again.
        let _selected = Selected::new(self.select);
        for operation in operations {
            match operation {
                Operation::Read(into) => SpiBus::read(&mut *unit, into).await?,
                Operation::Write(from) => SpiBus::write(&mut *unit, from).await?,
                Operation::Transfer(into, from) => SpiBus::transfer(&mut *unit, into, from).await?,
                Operation::TransferInPlace(both) => SpiBus::transfer_in_place(&mut *unit, both).await?,
                Operation::DelayNs(ns) if *ns <= SPUN => Delay::new().delay_nanos(*ns),
                Operation::DelayNs(ns) => Clock.delay_ns(*ns).await,
            }
        }
        Ok(())
    }
}
