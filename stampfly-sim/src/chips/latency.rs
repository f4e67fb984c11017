//! The time that a processor takes for a transfer beyond what the wires need.
//!
//! Without it a bus is as fast as its bits, and a deadline that leaves nothing to the software looks sufficient. Zero is the
//! default, as for everything else that a vehicle flies on here. Use it to find out what a driver's deadlines leave; not
//! as a model of a certain processor, whose figures nobody has measured.

use stampfly_types::Duration;

/// What the software of a bus takes, by cause. [`SpiBus::set_latency`](super::SpiBus::set_latency),
/// [`I2cBus::set_latency`](super::I2cBus::set_latency).
///
/// On SPI, a transfer of which the processor does every part itself is one that its task does not give way in: other
/// tasks wait, and no deadline can end it.
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
    /// Before the first bit of each transfer: taking the bus, setting it up.
    pub setup: Duration,
    /// From the end of an operation to the task that waits for its interrupt.
    pub wake: Duration,
    /// How much later than asked for a pause ends that waits for an alarm.
    pub alarm: Duration,
    /// Operations of up to so many bytes are moved by the processor, which waits for no interrupt.
    pub polled: usize,
    /// Pauses up to this are spun away and not late.
    pub spun: Duration,
    /// Each of the three lasts up to so much longer, at random, by the bus's seed.
    pub jitter: Duration,
}

impl Latency {
    /// The same with its causes longer by this share of the jitter.
    pub(super) fn drawn(self, share: f64) -> Self {
        let more = Duration::from_micros((self.jitter.as_micros() as f64 * share) as u64);
        Self { setup: self.setup + more, wake: self.wake + more, alarm: self.alarm + more, ..self }
    }

    /// After an operation of so many bytes.
    pub(super) const fn of_bytes(&self, bytes: usize) -> Duration {
        if bytes > self.polled { self.wake } else { Duration::ZERO }
    }

    /// After a pause, ns.
    pub(super) const fn of_pause(&self, nanoseconds: u32) -> Duration {
        if self.is_spun(nanoseconds) { Duration::ZERO } else { self.alarm }
    }

    /// Does the processor spin a pause away?
    pub(super) const fn is_spun(&self, nanoseconds: u32) -> bool {
        nanoseconds as u64 <= self.spun.as_micros() * 1_000
    }
}
