//! The receiver: packets of a HiSKY transmitter, through an nRF24L01, to the bus.
//!
//! The protocol's receiver says what the radio listens to, and when to something else; the driver does it. Whoever flies keeps the transmitter:
//! while the vehicle is armed, none is bound.

use crate::messages::ReceiverInput;
use crate::topics::ReceiverEnds;
use stampfly_drivers::Timebase;
use stampfly_drivers::chip::ChipError;
use stampfly_drivers::chip::nrf24l01::embedded_hal::digital::OutputPin;
use stampfly_drivers::chip::nrf24l01::embedded_hal_async::digital::Wait;
use stampfly_drivers::chip::nrf24l01::embedded_hal_async::spi::SpiDevice;
use stampfly_drivers::chip::nrf24l01::{Hopper, Nrf24l01, Tuning};
use stampfly_link::hisky::{HiskyEvent, HiskyLink, HiskyReceiver};
use stampfly_types::{Duration, Instant};

/// A step waits no longer.
const STEP: Duration = Duration::from_millis(10);

/// The receiver.
pub struct Receiver<'b> {
    hisky: HiskyReceiver,
    ends: ReceiverEnds<'b>,
    bound: Option<HiskyLink>,
}

impl<'b> Receiver<'b> {
    /// At power-on, with the transmitter that was stored. Without one it binds.
    #[must_use]
    pub fn new(link: Option<HiskyLink>, now: Instant, ends: ReceiverEnds<'b>) -> Self {
        Self { hisky: HiskyReceiver::new(link, now), ends, bound: None }
    }

    /// Listens for a transmitter that binds from now on. An armed vehicle does not.
    pub fn bind(&mut self) {
        // Refused when it is armed.
        let _ = self.hisky.start_binding();
    }

    /// One step with the radio. Returns a transmitter that was just bound: store it.
    ///
    /// # Errors
    /// Of the radio, which is set up anew at the next call.
    pub async fn step<S: SpiDevice, E: OutputPin, T: Timebase, P: Wait>(
        &mut self,
        radio: &mut Nrf24l01<S, E, T, P, 10>,
        now: Instant,
    ) -> Result<Option<HiskyLink>, ChipError<S::Error>> {
        self.hisky.set_armed(self.ends.control_state.latest().is_some_and(|state| state.data.armed));
        radio.follow(self, now + STEP).await?;
        Ok(self.bound.take())
    }
}

impl Hopper<10> for Receiver<'_> {
    fn tuning(&self) -> Tuning {
        let tuning = self.hisky.tuning();
        Tuning { channel: tuning.channel, address: tuning.address }
    }

    fn due(&self) -> Option<Instant> {
        self.hisky.due()
    }

    fn poll(&mut self, now: Instant) {
        self.hisky.poll(now);
    }

    fn receive(&mut self, at: Instant, packet: &[u8; 10]) {
        match self.hisky.receive(at, packet) {
            HiskyEvent::Channels(channels) => _ = self.ends.receiver_input.publish(at, &ReceiverInput::from(&channels)),
            HiskyEvent::Bound(link) => self.bound = Some(link),
            _ => {}
        }
    }
}
