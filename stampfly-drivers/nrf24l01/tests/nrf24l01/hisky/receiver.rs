//! Task of a receiver: the protocol, the radio driver, and the vehicle's use of them.

use super::transmitter::{Identity, Knobs, transmit};
use core::convert::Infallible;
use core::future::pending;
use embedded_hal::digital::ErrorType;
use embedded_hal::spi::MODE_0;
use embedded_hal_async::digital::Wait;
use stampfly_link::hisky::{HiskyChannels, HiskyEvent, HiskyLink, HiskyReceiver};
use stampfly_nrf24l01::{Config, Hopper, Nrf24l01, Tuning};
use stampfly_sim::chips::{self, Air, Attached, ChipEnable, RadioInterrupt, SpiBus, SpiPort};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_types::{Duration, Instant};
use std::cell::RefCell;
use std::rc::Rc;

/// The receiver of the protocol as a `Hopper`, one line per method.
#[derive(Debug)]
pub struct Hisky {
    pub receiver: HiskyReceiver,
    /// All stick packets, with the time at which they were received.
    pub heard: Vec<(Instant, HiskyChannels)>,
    pub bound: Option<HiskyLink>,
    /// Number of errors of the radio.
    pub errors: u32,
}

/// The receiver, shared with the test.
struct Shared(Rc<RefCell<Hisky>>);

impl Hopper<10> for Shared {
    fn tuning(&self) -> Tuning {
        let tuning = self.0.borrow().receiver.tuning();
        Tuning { channel: tuning.channel, address: tuning.address }
    }

    fn due(&self) -> Option<Instant> {
        self.0.borrow().receiver.due()
    }

    fn poll(&mut self, now: Instant) {
        self.0.borrow_mut().receiver.poll(now);
    }

    fn receive(&mut self, at: Instant, packet: &[u8; 10]) {
        let mut this = self.0.borrow_mut();
        match this.receiver.receive(at, packet) {
            HiskyEvent::Channels(channels) => this.heard.push((at, channels)),
            HiskyEvent::Bound(link) => this.bound = Some(link),
            _ => {}
        }
    }
}

/// Longest wait of a step.
const STEP: Duration = Duration::from_millis(10);

type Radio<P> = Nrf24l01<SpiPort<chips::Nrf24l01>, ChipEnable, Clock, P, 10>;

/// Task of the receiver.
async fn receive<P: Wait>(mut radio: Radio<P>, clock: Clock, hisky: Rc<RefCell<Hisky>>) {
    let mut hopper = Shared(hisky.clone());
    loop {
        let until = clock.now() + STEP;
        if radio.follow(&mut hopper, until).await.is_err() {
            hisky.borrow_mut().errors += 1;
            clock.sleep_until(clock.now() + STEP).await;
        }
    }
}

/// A vehicle's radio and a transmitter that share the air.
pub struct Link {
    pub clock: Clock,
    pub air: Air,
    pub identity: Identity,
    pub knobs: Knobs,
    pub hisky: Rc<RefCell<Hisky>>,
    pub attached: Attached,
    tasks: Tasks<'static>,
}

impl Link {
    /// A receiver that is switched on at zero, and a transmitter that is switched on at `from`.
    pub fn new(id: u32, bound: bool, from: Instant, seed: u64, wired: bool) -> Self {
        Self::wired(id, bound, from, seed, |pin| wired.then_some(pin))
    }

    fn wired<P: Wait + 'static>(
        id: u32,
        bound: bool,
        from: Instant,
        seed: u64,
        wire: impl FnOnce(RadioInterrupt) -> Option<P>,
    ) -> Self {
        let clock = Clock::new(Instant::ZERO);
        let air = Air::new(&clock, seed);
        let identity = Identity::of(id);
        let link = bound.then_some(HiskyLink { address: identity.address, hops: identity.hops });
        let receiver = HiskyReceiver::new(link, clock.now());
        let hisky = Rc::new(RefCell::new(Hisky { receiver, heard: Vec::new(), bound: None, errors: 0 }));
        let (device, attached) = SpiBus::new(&clock, seed).attach(8_000_000, chips::Nrf24l01::new(&air));
        let device = device.with_mode(MODE_0);
        let (enable, interrupt) = (device.chip_enable(), device.radio_interrupt());
        let radio = Nrf24l01::<_, _, _, _, 10>::new(device, enable, clock.clone(), Config::default());
        let mut tasks = Tasks::new(clock.clone());
        match wire(interrupt) {
            Some(pin) => tasks.spawn(receive(radio.with_interrupt(pin), clock.clone(), hisky.clone())),
            None => tasks.spawn(receive(radio, clock.clone(), hisky.clone())),
        }
        let knobs = Knobs::default();
        tasks.spawn(transmit(clock.clone(), air.clone(), identity, from, knobs.clone()));
        Self { clock, air, identity, knobs, hisky, attached, tasks }
    }

    pub fn run(&mut self, millis: u64) {
        self.tasks.run_until(self.clock.now() + Duration::from_millis(millis));
    }

    pub fn clock_step(&mut self, micros: u64) {
        self.tasks.run_until(self.clock.now() + Duration::from_micros(micros));
    }

    /// With an interrupt pin that is disconnected or shorted to ground.
    pub fn broken_pin(id: u32, stuck_low: bool) -> Self {
        Self::wired(id, true, Instant::from_millis(50), 1, |_| Some(Stuck(stuck_low)))
    }

    /// Number of stick packets so far.
    pub fn heard(&self) -> usize {
        self.hisky.borrow().heard.len()
    }

    pub fn is_offline(&self) -> bool {
        self.hisky.borrow().receiver.is_offline(self.clock.now())
    }

    /// Adds another transmitter.
    pub fn join(&mut self, id: u32) -> Knobs {
        let knobs = Knobs::default();
        let from = self.clock.now() + Duration::from_micros(4_321);
        self.tasks.spawn(transmit(self.clock.clone(), self.air.clone(), Identity::of(id), from, knobs.clone()));
        knobs
    }
}

/// A pin that never changes.
pub struct Stuck(bool);

impl ErrorType for Stuck {
    type Error = Infallible;
}

impl Wait for Stuck {
    async fn wait_for_high(&mut self) -> Result<(), Infallible> {
        if self.0 { pending().await } else { Ok(()) }
    }
    async fn wait_for_low(&mut self) -> Result<(), Infallible> {
        if self.0 { Ok(()) } else { pending().await }
    }
    async fn wait_for_rising_edge(&mut self) -> Result<(), Infallible> {
        pending().await
    }
    async fn wait_for_falling_edge(&mut self) -> Result<(), Infallible> {
        pending().await
    }
    async fn wait_for_any_edge(&mut self) -> Result<(), Infallible> {
        pending().await
    }
}
