#![doc = include_str!("../README.md")]
#![no_std]

pub mod codec;
mod config;
mod hop;
mod interrupt;
mod wires;

use codec::{Status, command, register};
pub use config::{AddressBytes, Checksum, Config, Packet, Power, Rate, Tuning};
use embedded_hal::digital::OutputPin;
use embedded_hal_async::digital::Wait;
use embedded_hal_async::spi::SpiDevice;
pub use hop::Hopper;
use interrupt::Interrupt;
pub use interrupt::NoPin;
#[cfg(feature = "embassy-time")]
pub use stampfly_driver_core::EmbassyClock;
pub use stampfly_driver_core::chip::{ChipError, TransferLimit};
use stampfly_driver_core::chip::{Port, Registers};
pub use stampfly_driver_core::{SensorError, SensorErrorKind, Timebase, blocking, embedded_hal, embedded_hal_async};
pub use stampfly_types::{Duration, Instant};
use wires::Commands;

/// Time from power-on to the first access (6.1.1, figure 4, power-on reset). The older nRF24L01 is
/// ready after 10.3 ms.
const POWER_ON: Duration = Duration::from_millis(100);
/// Time from power down to standby (6.1.7, table 16, Tpd2stby): 1.5 ms with a crystal of less than
/// 30 mH, 4.5 ms with 90 mH. The crystal of a module is not known.
const POWER_UP: Duration = Duration::from_millis(5);
/// Time from standby to receiving or sending (6.1.7, Tstby2a).
const SETTLE: Duration = Duration::from_micros(130);
/// Minimum pulse on CE that starts sending (6.1.7, Thce), with a margin for clocks with a
/// resolution of 1 µs.
const PULSE: Duration = Duration::from_micros(12);
/// Time from the rising edge on CE to the next access (6.1.7, Tpece2csn).
const AFTER_CE: Duration = Duration::from_micros(4);
/// Tolerance of the time to send a packet.
const SEND_MARGIN: Duration = Duration::from_micros(500);
/// Maximum number of status reads per call. A flag without a payload is cleared, and another packet
/// may have arrived meanwhile.
const LOOKS: u8 = 3;
/// Channel and address of the self test: above the Wi-Fi channels of most countries, inside the
/// band (2480 MHz).
const TEST: Tuning = Tuning { channel: 80, address: [0x5A, 0xA5, 0x5A, 0xA5, 0x3C] };

/// The driver, on SPI in mode 0 at up to 10 MHz, for packets of `N` bytes, 1 to 32.
///
/// The radio receives from 130 µs after [`listen`](Self::listen) on. The chip stores three received
/// packets; a fourth one is lost.
///
/// A packet is returned only when the chip still has its configuration after the read. A stuck data
/// line or a chip that restarted therefore yields no packets of zeros, which are full throttle in
/// some protocols. A wrong bit on SPI is not detected, because the CRC protects only the air link.
///
/// A chip that restarted receives nothing, and its status does not show it. The driver therefore
/// checks the configuration at every change of the tuning and at the end of every wait without a
/// packet. It returns [`ChipError::Restarted`], and the next call sets the chip up again.
///
/// ```
/// # use stampfly_driver_fakes::memory::{Clock, Pin};
/// # use stampfly_sim::chips::{self, Air, AirPacket, AirRate, SpiBus};
/// # let clock = stampfly_sim::time::Clock::new(stampfly_types::Instant::ZERO);
/// # let air = Air::new(&clock, 1);
/// # let (device, _) = SpiBus::new(&clock, 1).attach(8_000_000, chips::Nrf24l01::new(&air));
/// # let (device, enable) = (device.with_mode(embedded_hal::spi::MODE_0), ());
/// # let enable = device.chip_enable();
/// # let block_on = |future| stampfly_sim::time::block_on(&clock, future);
/// # let time = clock.clone();
/// use stampfly_nrf24l01::{Config, Nrf24l01, Timebase, Tuning};
///
/// let mut radio = Nrf24l01::<_, _, _, _, 10>::new(device, enable, time, Config::default());
/// let tuning = Tuning { channel: 40, address: [1, 2, 3, 4, 5] };
/// # let hear = async {
/// radio.listen(tuning).await?;
/// # clock.advance_to(clock.now() + stampfly_types::Duration::from_millis(1));
/// # air.send(&AirPacket { channel: 40, rate: AirRate::Mbit1, address: &[1, 2, 3, 4, 5], payload: b"ten bytes.", crc: 2 });
/// let until = clock.now() + stampfly_types::Duration::from_millis(10);
/// let packet = radio.wait(until).await?.expect("somebody sends");
/// assert_eq!(&packet.payload, b"ten bytes.");
/// # Ok::<(), stampfly_nrf24l01::ChipError<stampfly_sim::chips::BusError>>(())
/// # };
/// # block_on(hear)?;
/// # Ok::<(), stampfly_nrf24l01::ChipError<stampfly_sim::chips::BusError>>(())
/// ```
#[derive(Debug)]
pub struct Nrf24l01<S, E, T, P = NoPin, const N: usize = 10> {
    port: Port<Commands<S>, T>,
    enable: E,
    interrupt: Interrupt<P>,
    config: Config,
    running: bool,
    /// Present channel and address; `None` in standby.
    tuned: Option<Tuning>,
    /// Receive address stored in the chip; `None` when unknown.
    address: Option<[u8; 5]>,
}

impl<S: SpiDevice, E: OutputPin, T: Timebase, const N: usize> Nrf24l01<S, E, T, NoPin, N> {
    /// A driver of the chip on this device, with this pin connected to CE.
    pub const fn new(device: S, enable: E, clock: T, config: Config) -> Self {
        const { assert!(N > 0 && N <= 32, "a payload has 1 to 32 bytes") };
        Self {
            port: Port::new(Commands(device), clock, Commands::<S>::LIMIT),
            enable,
            interrupt: Interrupt::none(),
            config,
            running: false,
            tuned: None,
            address: None,
        }
    }

    /// The same driver with the pin connected to IRQ. The chip drives it low when it has a packet.
    pub fn with_interrupt<P: Wait>(self, pin: P) -> Nrf24l01<S, E, T, P, N> {
        let Self { port, enable, config, running, tuned, address, .. } = self;
        Nrf24l01 { port, enable, interrupt: Interrupt::on(pin), config, running, tuned, address }
    }
}

impl<S, E, T, P, const N: usize> Nrf24l01<S, E, T, P, N> {
    stampfly_driver_core::transfer_limit!();

    /// Takes the driver apart and returns the device, CE, the clock and the interrupt pin, if any.
    /// The state of the chip does not change.
    pub fn release(self) -> (S, E, T, Option<P>) {
        let (device, clock) = self.port.release();
        (device, self.enable, clock, self.interrupt.release())
    }
}

impl<S: SpiDevice, E: OutputPin, T: Timebase, P: Wait, const N: usize> Nrf24l01<S, E, T, P, N> {
    /// Sets the chip up: settings with read-back, and power. Takes 5 ms, and ends at least 100 ms
    /// after power-on. The radio is in standby afterwards.
    ///
    /// # Errors
    /// [`ChipError::Identification`] when no chip answers: it has no identification, but settings
    /// that are never all zeros or all ones. [`ChipError::Configuration`] when a setting was not
    /// kept, such as 250 kbit/s on a part that does not support it.
    pub async fn start(&mut self) -> Result<(), ChipError<S::Error>> {
        self.stand_by()?;
        (self.running, self.address) = (false, None);
        self.port.wait_until(Instant::ZERO + POWER_ON).await;
        let configuration = codec::configuration(self.config.checksum);
        // A send that was dropped may still be on the air, and the chip accepts no register writes
        // then. Power down can be reached from any state (figure 4).
        self.port.write(register::CONFIG, &[configuration & !codec::POWERED]).await?;
        let settings = codec::settings(&self.config, N as u8);
        for (register, value, _) in settings {
            self.port.write(register, &[value]).await?;
        }
        self.port.write(register::CONFIG, &[configuration]).await?;
        self.port.wait(POWER_UP).await;
        for (register, value, compared) in settings {
            let [kept]: [u8; 1] = self.port.read(register).await?;
            // The first register holds the length of addresses, 1 to 3.
            if register == register::SETUP_AW && (kept == 0 || kept == 0xFF) {
                return Err(ChipError::Identification { found: u16::from(kept) });
            }
            if (kept ^ value) & compared != 0 {
                return Err(ChipError::Configuration { status: kept });
            }
        }
        let [kept]: [u8; 1] = self.port.read(register::CONFIG).await?;
        if kept != configuration {
            return Err(ChipError::Configuration { status: kept });
        }
        self.port.write(command::FLUSH_RX, &[]).await?;
        self.port.write(command::FLUSH_TX, &[]).await?;
        self.port.write(register::STATUS, &[codec::FLAGS]).await?;
        self.interrupt.trust();
        self.running = true;
        Ok(())
    }

    /// Sets the chip up, checks that it stores an address and its inverse, and sends one packet at
    /// the lowest power. 6 ms. The radio is in standby afterwards.
    ///
    /// The chip has no self test of its own. A packet that is sent shows that CE, crystal and
    /// synthesizer work. The antenna and the receiver cannot be tested without a second radio.
    ///
    /// # Errors
    /// Those of [`start`](Self::start), and [`ChipError::SelfTest`].
    pub async fn self_test(&mut self) -> Result<(), ChipError<S::Error>> {
        self.start().await?;
        for address in [TEST.address, TEST.address.map(|byte| !byte)] {
            self.port.write(register::RX_ADDR_P0, &address).await?;
            let kept: [u8; 5] = self.port.read(register::RX_ADDR_P0).await?;
            if kept != address {
                return Err(ChipError::SelfTest);
            }
        }
        // Low power, to disturb other radios as little as possible.
        let quiet = codec::rf_setup(self.config.rate, Power::Minus18);
        self.port.write(register::RF_SETUP, &[quiet]).await?;
        let sent = self.send(TEST, &[0; N]).await;
        let loud = codec::rf_setup(self.config.rate, self.config.power);
        self.port.write(register::RF_SETUP, &[loud]).await?;
        match sent {
            Err(ChipError::NoSample) => Err(ChipError::SelfTest),
            sent => sent,
        }
    }

    /// Listens to a channel and an address, from 130 µs after this call on. Does nothing when it
    /// already listens there.
    ///
    /// Received packets that have not been read are kept when only the channel changes.
    ///
    /// # Errors
    /// [`ChipError::InvalidConfiguration`] for a channel that does not exist; those of
    /// [`start`](Self::start) when the chip has to be set up; [`ChipError::Restarted`].
    pub async fn listen(&mut self, tuning: Tuning) -> Result<(), ChipError<S::Error>> {
        if tuning.channel > codec::LAST_CHANNEL {
            return Err(ChipError::InvalidConfiguration);
        }
        if !self.running {
            self.start().await?;
        }
        if self.tuned == Some(tuning) {
            return Ok(());
        }
        self.stand_by()?;
        self.check().await?;
        self.port.write(register::RF_CH, &[tuning.channel]).await?;
        if self.address != Some(tuning.address) {
            self.address = None;
            self.write_address(register::RX_ADDR_P0, &tuning.address).await?;
            self.port.write(command::FLUSH_RX, &[]).await?;
            self.port.write(register::STATUS, &[codec::FLAGS]).await?;
            self.address = Some(tuning.address);
        }
        self.enable(true)?;
        self.tuned = Some(tuning);
        // SPI access directly after the edge would be too early.
        self.port.wait(AFTER_CE).await;
        Ok(())
    }

    /// The oldest received packet, if there is one. `None` before [`listen`](Self::listen), and
    /// after an error until the next `listen`.
    ///
    /// # Errors
    /// [`ChipError::Data`] for an impossible status; [`ChipError::Restarted`].
    pub async fn receive(&mut self) -> Result<Option<Packet<N>>, ChipError<S::Error>> {
        if !self.running {
            return Ok(None);
        }
        for _ in 0..LOOKS {
            let at = self.port.now();
            let status = self.status().await?;
            if status.pipe.is_some() {
                let payload = self.port.read(command::R_RX_PAYLOAD).await?;
                // Before the check, so that a call dropped in between does not clear the flag of a
                // later packet.
                self.port.write(register::STATUS, &[codec::RECEIVED]).await?;
                self.check().await?;
                return Ok(Some(Packet { at, payload }));
            }
            if !status.received {
                break;
            }
            // The packet of this flag was read earlier. A packet that arrives during this write is
            // found by the next status read.
            self.port.write(register::STATUS, &[codec::RECEIVED]).await?;
        }
        Ok(None)
    }

    /// Waits for a packet until an instant; checks once when that has passed. May be dropped: a
    /// packet stays in the chip until it is read. It is lost only when the call is dropped during
    /// the read.
    ///
    /// # Errors
    /// Those of [`receive`](Self::receive).
    pub async fn wait(&mut self, until: Instant) -> Result<Option<Packet<N>>, ChipError<S::Error>> {
        loop {
            let packet = self.receive().await?;
            self.interrupt.judge(packet.is_some());
            if packet.is_some() {
                return Ok(packet);
            }
            if self.port.now() >= until {
                break;
            }
            self.interrupt.wait(&mut self.port, until, self.config.poll).await;
        }
        if self.running {
            self.check().await?;
        }
        Ok(None)
    }

    /// One step of a hopping receiver: listens to its channel until a packet arrives, until its
    /// next poll is due, or until an instant, whichever is first. Call it in a loop, with the rest
    /// of the task's work in between.
    ///
    /// ```
    /// # use core::convert::Infallible;
    /// use stampfly_nrf24l01::embedded_hal::digital::OutputPin;
    /// use stampfly_nrf24l01::embedded_hal_async::spi::SpiDevice;
    /// use stampfly_nrf24l01::{ChipError, Duration, Hopper, Nrf24l01, Timebase};
    ///
    /// /// A task that follows a transmitter, with a chance for other work every 10 ms.
    /// async fn receive<S: SpiDevice, E: OutputPin, T: Timebase + Clone>(
    ///     mut radio: Nrf24l01<S, E, T>,
    ///     mut receiver: impl Hopper<10>,
    ///     clock: T,
    /// ) -> Result<Infallible, ChipError<S::Error>> {
    ///     loop {
    ///         radio.follow(&mut receiver, clock.now() + Duration::from_millis(10)).await?;
    ///     }
    /// }
    /// ```
    ///
    /// # Errors
    /// Those of [`listen`](Self::listen) and [`wait`](Self::wait).
    pub async fn follow(&mut self, hopper: &mut impl Hopper<N>, until: Instant) -> Result<(), ChipError<S::Error>> {
        self.listen(hopper.tuning()).await?;
        let until = hopper.due().map_or(until, |due| due.min(until));
        if let Some(Packet { at, payload }) = self.wait(until).await? {
            hopper.receive(at, &payload);
        }
        hopper.poll(self.port.now());
        Ok(())
    }

    /// Sends a packet and returns to standby.
    ///
    /// # Errors
    /// [`ChipError::NoSample`] when the chip does not report that it has sent the packet, and those
    /// of [`listen`](Self::listen).
    pub async fn send(&mut self, tuning: Tuning, payload: &[u8; N]) -> Result<(), ChipError<S::Error>> {
        if tuning.channel > codec::LAST_CHANNEL {
            return Err(ChipError::InvalidConfiguration);
        }
        if !self.running {
            self.start().await?;
        }
        self.stand_by()?;
        self.check().await?;
        // Until the chip is a receiver again. If the call is dropped before that, the next one
        // starts with a set-up.
        self.running = false;
        let configuration = codec::configuration(self.config.checksum);
        self.port.write(register::CONFIG, &[configuration & !codec::RECEIVES]).await?;
        self.port.write(register::RF_CH, &[tuning.channel]).await?;
        self.write_address(register::TX_ADDR, &tuning.address).await?;
        self.port.write(register::STATUS, &[codec::FLAGS]).await?;
        self.port.write(command::FLUSH_TX, &[]).await?;
        self.port.write(command::W_TX_PAYLOAD, payload).await?;
        self.enable(true)?;
        self.port.wait(PULSE).await;
        self.enable(false)?;
        // No polling during the transmission, whose duration is known.
        let takes = SETTLE + Duration::from_micros(codec::airtime(&self.config, N));
        let deadline = self.port.now() + takes + SEND_MARGIN;
        self.port.wait(takes).await;
        let sent = loop {
            let looks = self.port.now();
            if self.status().await?.sent {
                break true;
            }
            if looks > deadline {
                break false;
            }
            self.port.wait(self.config.poll).await;
        };
        self.port.write(command::FLUSH_TX, &[]).await?;
        self.port.write(register::STATUS, &[codec::FLAGS]).await?;
        self.port.write(register::CONFIG, &[configuration]).await?;
        self.running = true;
        if sent { Ok(()) } else { Err(ChipError::NoSample) }
    }

    /// Whether the chip has detected a carrier of at least −64 dBm on the channel (6.4). Valid from
    /// 170 µs after [`listen`](Self::listen) on.
    ///
    /// # Errors
    /// Errors of the bus.
    pub async fn carrier(&mut self) -> Result<bool, ChipError<S::Error>> {
        let [detected]: [u8; 1] = self.port.read(register::RPD).await?;
        Ok(detected & 1 != 0)
    }

    /// Powers the radio down. The settings are kept, and the next call sets the chip up. May be
    /// called before the first start.
    ///
    /// # Errors
    /// Errors of the bus, and [`ChipError::Pin`].
    pub async fn power_down(&mut self) -> Result<(), ChipError<S::Error>> {
        self.stand_by()?;
        self.running = false;
        self.port.write(register::CONFIG, &[codec::configuration(self.config.checksum) & !codec::POWERED]).await
    }

    /// Checks that the chip still has its configuration.
    async fn check(&mut self) -> Result<(), ChipError<S::Error>> {
        let wanted = codec::configuration(self.config.checksum);
        for _ in 0..2 {
            // Two reads, so that one wrong bit on the bus does not cause a new set-up.
            let [kept]: [u8; 1] = self.port.read(register::CONFIG).await?;
            if kept == wanted {
                return Ok(());
            }
        }
        (self.running, self.tuned) = (false, None);
        Err(ChipError::Restarted)
    }

    async fn status(&mut self) -> Result<Status, ChipError<S::Error>> {
        let [status]: [u8; 1] = self.port.read(register::STATUS).await?;
        Status::decode(status).ok_or(ChipError::Data)
    }

    async fn write_address(&mut self, register: u8, address: &[u8; 5]) -> Result<(), ChipError<S::Error>> {
        let (used, _) =
            address.split_at_checked(codec::address_bytes(self.config.address_bytes)).unwrap_or((address, &[]));
        self.port.write(register, used).await
    }

    fn stand_by(&mut self) -> Result<(), ChipError<S::Error>> {
        self.tuned = None;
        self.enable(false)
    }

    fn enable(&mut self, enabled: bool) -> Result<(), ChipError<S::Error>> {
        let outcome = if enabled { self.enable.set_high() } else { self.enable.set_low() };
        outcome.map_err(|_| ChipError::Pin)
    }
}
