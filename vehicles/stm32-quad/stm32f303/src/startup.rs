//! Makes the vehicle new, as [`stampfly_stm32_quad::startup`] says, and never comes back.

use crate::flight::Motors;
use crate::memory::Memory;
use core::cell::RefCell;
use embassy_stm32::gpio::{Level, Output};
use embassy_time::{Duration, Ticker};
use stampfly_drivers::{EmbassyClock, Timebase as _};
use stampfly_stm32_quad::Parameters;
use stampfly_stm32_quad::startup::{Startup, Step};

/// Until power-off.
pub async fn run(memory: &RefCell<Memory>, mut lights: [Output<'static>; 2], mut motors: Motors) -> ! {
    let mut startup = Startup::default();
    let began = EmbassyClock.now();
    let mut ticker = Ticker::every(Duration::from_millis(10));
    loop {
        let (shown, step) = startup.step(EmbassyClock.now().since(began));
        match step {
            Some(Step::ForgetTransmitter) => memory.borrow_mut().change(|stored| stored.link = None),
            Some(Step::ResetParameters) => {
                memory.borrow_mut().change(|stored| stored.parameters = Parameters::default())
            }
            None => {}
        }
        let [front, back] = &mut lights;
        front.set_level(Level::from(shown.front));
        back.set_level(Level::from(shown.back));
        motors.write(&[shown.motors; 4]);
        ticker.next().await;
    }
}
