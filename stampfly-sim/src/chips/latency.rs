//! Software latency of bus transfers.
//!
//! Without it a bus is as fast as its bits, and a deadline that leaves no time for software appears
//! sufficient. The default is zero. Use it to find the latency that a driver's deadlines tolerate;
//! it is not a model of a particular processor, for which no measurements exist.

use stampfly_types::Duration;

/// Software latency of a bus by cause. See [`SpiBus::set_latency`](super::SpiBus::set_latency) and
/// [`I2cBus::set_latency`](super::I2cBus::set_latency).
///
/// On SPI, a transfer whose operations are all polled and whose pauses are all spun does not yield:
/// other tasks wait, and a timeout cannot end it.
///
/// ```
/// use embedded_hal::spi::{Operation, SpiDevice};
/// use stampfly_sim::chips::{Latency, Pmw3901, SpiBus};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Duration;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let bus = SpiBus::new(&clock, 1);
/// let (mut port, _) = bus.attach(2_000_000, Pmw3901::new(&simulation.world, &clock, 1));
/// bus.set_latency(Latency { wake: Duration::from_micros(105), ..Latency::default() });
/// let (begun, mut id) = (clock.now(), [0]);
/// port.transaction(&mut [Operation::Write(&[0]), Operation::DelayNs(35_000), Operation::Read(&mut id)])?;
/// assert_eq!(clock.now().since(begun), Duration::from_micros(4 + 105 + 35 + 4 + 105), "woken after each operation");
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Latency {
    /// Before the first bit of each transfer: acquiring and configuring the bus.
    pub setup: Duration,
    /// From the end of an operation until the task waiting for its interrupt runs.
    pub wake: Duration,
    /// Delay of the end of a pause that waits for an alarm.
    pub alarm: Duration,
    /// Largest length of an operation moved by polling, without an interrupt, bytes.
    pub polled: usize,
    /// Longest pause that is spun, without an alarm.
    pub spun: Duration,
    /// Largest random addition to `setup`, `wake` and `alarm`, drawn from the bus's seed.
    pub jitter: Duration,
}

impl Latency {
    /// The latency with this share of the jitter added.
    pub(super) fn drawn(self, share: f64) -> Self {
        let more = Duration::from_micros((self.jitter.as_micros() as f64 * share) as u64);
        Self { setup: self.setup + more, wake: self.wake + more, alarm: self.alarm + more, ..self }
    }

    /// Latency after an operation of `bytes` bytes.
    pub(super) const fn of_bytes(&self, bytes: usize) -> Duration {
        if bytes > self.polled { self.wake } else { Duration::ZERO }
    }

    /// Latency after a pause, ns.
    pub(super) const fn of_pause(&self, nanoseconds: u32) -> Duration {
        if self.is_spun(nanoseconds) { Duration::ZERO } else { self.alarm }
    }

    /// True if a pause is spun.
    pub(super) const fn is_spun(&self, nanoseconds: u32) -> bool {
        nanoseconds as u64 <= self.spun.as_micros() * 1_000
    }
}
