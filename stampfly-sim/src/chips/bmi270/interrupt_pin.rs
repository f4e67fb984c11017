//! Interrupt pin 1 of the BMI270 as the processor sees it.
//!
//! For testing drivers that wait for the chip. [`InterruptPin`] implements embedded-hal's
//! `InputPin` and embedded-hal-async's `Wait` on virtual time: a waiting task runs at the next
//! instant at which the chip can change the level, and after every transfer. The chip counts edges,
//! so none is missed when the task runs late.

use super::Bmi270;
use super::interrupt::Interrupt;
use crate::chips::{Seen, SpiBus, SpiPort};
use crate::time::Clock;
use core::cell::RefCell;
use core::convert::Infallible;
use core::future::{Future, poll_fn};
use core::pin::Pin;
use core::task::Poll;
use embedded_hal::digital::{ErrorType, InputPin};
use embedded_hal_async::digital::Wait;
use std::rc::Rc;

/// Interrupt pin 1 of an emulated BMI270, from [`SpiPort::interrupt_pin`].
///
/// ```
/// use embedded_hal::digital::InputPin;
/// use embedded_hal::spi::SpiDevice;
/// use stampfly_sim::chips::{Bmi270, SpiBus};
/// use stampfly_sim::{Simulation, SimulationConfig};
/// use stampfly_types::Instant;
///
/// let simulation = Simulation::new(&SimulationConfig::example());
/// let clock = simulation.clock.clone();
/// let chip = Bmi270::new(&simulation.world, &clock, 1, 1.0, &[0x5A; 8192]);
/// let (mut port, _) = SpiBus::new(&clock, 1).attach(8_000_000, chip);
/// let mut pin = port.interrupt_pin();
/// assert_eq!(pin.is_high(), Ok(true), "the board's pull-up");
/// clock.advance_to(Instant::from_millis(2));
/// port.transfer(&mut [0; 3], &[0x80])?; // chooses SPI
/// port.write(&[0x53, 0x0A])?; // an output, active high
/// assert_eq!(pin.is_high(), Ok(false), "nothing to say");
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Clone, Debug)]
pub struct InterruptPin {
    clock: Clock,
    bus: SpiBus,
    chip: Rc<RefCell<Bmi270>>,
}

impl SpiPort<Bmi270> {
    /// The chip's interrupt pin 1 with the board's pull-up.
    #[must_use]
    pub fn interrupt_pin(&self) -> InterruptPin {
        let (clock, chip) = self.chip();
        InterruptPin { clock, bus: self.bus(), chip }
    }
}

impl InterruptPin {
    /// Reads the present state of the pin.
    fn look<T>(&self, at: impl FnOnce(&Interrupt) -> T) -> T {
        let mut chip = self.chip.borrow_mut();
        chip.update(self.clock.now());
        at(&chip.interrupt)
    }

    async fn until(&self, reached: impl Fn(&Interrupt) -> bool) -> Result<(), Infallible> {
        poll_fn(|context| {
            if self.look(&reached) {
                return Poll::Ready(Ok(()));
            }
            let mut chip = self.chip.borrow_mut();
            let waiting = &mut chip.interrupt.waiting;
            if !waiting.iter().any(|waker| waker.will_wake(context.waker())) {
                waiting.push(context.waker().clone());
            }
            if let Some(next) = chip.next_event() {
                // Polling once registers the deadline with the clock.
                let _ = Pin::new(&mut self.clock.sleep_until(next)).poll(context);
            }
            Poll::Pending
        })
        .await
    }
}

impl ErrorType for InterruptPin {
    type Error = Infallible;
}

impl InputPin for InterruptPin {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.look(|pin| pin.high))
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(self.look(|pin| !pin.high))
    }
}

impl Wait for InterruptPin {
    async fn wait_for_high(&mut self) -> Result<(), Infallible> {
        self.until(|pin| pin.high).await?;
        self.bus.note(Seen::PinHigh(self.clock.now()));
        Ok(())
    }

    async fn wait_for_low(&mut self) -> Result<(), Infallible> {
        self.until(|pin| !pin.high).await
    }

    async fn wait_for_rising_edge(&mut self) -> Result<(), Infallible> {
        let before = self.look(|pin| pin.rises);
        self.until(|pin| pin.rises != before).await
    }

    async fn wait_for_falling_edge(&mut self) -> Result<(), Infallible> {
        let before = self.look(|pin| pin.falls);
        self.until(|pin| pin.falls != before).await
    }

    async fn wait_for_any_edge(&mut self) -> Result<(), Infallible> {
        let before = self.look(|pin| (pin.rises, pin.falls));
        self.until(|pin| (pin.rises, pin.falls) != before).await
    }
}
