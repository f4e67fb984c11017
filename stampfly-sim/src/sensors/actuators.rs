//! Models of motor outputs, lights and buzzer, and the button.

use crate::plant::ROTORS;
use crate::time::Clock;
use crate::world::World;
use core::cell::{Cell, RefCell};
use core::convert::Infallible;
use stampfly_drivers::{Button, Indicator, MotorOutputs};
use stampfly_types::Instant;
use stampfly_types::messages::{MotorOutput, Signal};
use std::rc::Rc;

/// Steps of the pulse-width modulation: 8 bits at 150 kHz.
const PWM_STEPS: f64 = 255.0;

/// Power stage of the motors. Implements [`MotorOutputs`]. Unarmed outputs and values that are not
/// finite stop the motor.
#[derive(Clone, Debug)]
pub struct MotorModel {
    world: World,
    clock: Clock,
}

impl MotorModel {
    pub(crate) fn new(world: &World, clock: &Clock) -> Self {
        Self { world: world.clone(), clock: clock.clone() }
    }
}

impl MotorOutputs for MotorModel {
    type Error = Infallible;

    fn write(&mut self, output: &MotorOutput) -> Result<(), Infallible> {
        let mut duty = [0.0; ROTORS];
        for (duty, wanted) in duty.iter_mut().zip(output.duty) {
            if output.armed && wanted.is_finite() {
                // Rounded to the resolution of the pulse-width modulation.
                *duty = (f64::from(wanted.clamp(0.0, 1.0)) * PWM_STEPS).round() / PWM_STEPS;
            }
        }
        self.world.set_duty(self.clock.now(), duty);
        Ok(())
    }
}

/// Records the signals for lights and buzzer. Implements [`Indicator`]; clones share the record.
#[derive(Clone, Debug)]
pub struct IndicatorRecorder {
    clock: Clock,
    changes: Rc<RefCell<Vec<(Instant, Signal)>>>,
}

impl IndicatorRecorder {
    pub(crate) fn new(clock: &Clock) -> Self {
        Self { clock: clock.clone(), changes: Rc::default() }
    }

    /// All changes of the signal with their instants, oldest first.
    #[must_use]
    pub fn changes(&self) -> Vec<(Instant, Signal)> {
        self.changes.borrow().clone()
    }

    /// The present signal; `None` before the first.
    #[must_use]
    pub fn showing(&self) -> Option<Signal> {
        self.changes.borrow().last().map(|(_, signal)| *signal)
    }
}

impl Indicator for IndicatorRecorder {
    fn show(&mut self, signal: &Signal) {
        if self.showing() != Some(*signal) {
            self.changes.borrow_mut().push((self.clock.now(), *signal));
        }
    }
}

/// A button pressed by a script. Implements [`Button`]; clones are the same button.
#[derive(Clone, Debug, Default)]
pub struct ButtonModel(Rc<Cell<bool>>);

impl ButtonModel {
    /// Presses or releases it.
    pub fn press(&self, pressed: bool) {
        self.0.set(pressed);
    }
}

impl Button for ButtonModel {
    fn is_pressed(&mut self) -> bool {
        self.0.get()
    }
}
