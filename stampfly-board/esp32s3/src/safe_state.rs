//! Motors off at the pin, from any context, and chips that nobody talks to. Depends on nothing but the pins.
//!
//! [`hold_low`], the first thing the program does, makes the motors' pins outputs that are low, and [`deselect`], the second, the chip
//! selects ones that are high. [`cut`] takes them away from the
//! PWM unit and pulls them low again: it needs no lock and no peripheral driver. The panic handler, the cut-off and a
//! restart call it. Only a disarmed vehicle gets its pins back.

use crate::pins::{MotorPins, SpiPins};
use esp_hal::gpio::{AnyPin, Level, Output, OutputConfig, OutputSignal, Pin};
use esp_hal::peripherals::GPIO;

/// Keeps every motor off from now on, whatever the pins were before: two belong to a debugger's port after a reset.
pub fn hold_low() {
    // SAFETY: nothing uses the pins yet, and what is made of them here is dropped.
    let MotorPins { front_right, rear_right, rear_left, front_left } = unsafe { MotorPins::steal() };
    let pins: [AnyPin<'_>; 4] = [front_right.into(), rear_right.into(), rear_left.into(), front_left.into()];
    for pin in pins {
        // What this returns can be dropped: the pin stays as it is.
        Output::new(pin, Level::Low, OutputConfig::default());
    }
}

/// Motors' pins that are low until the next start. What drives a motor wants its pins, and nobody gets these back.
#[cfg(feature = "hil")]
pub struct Parked(#[expect(dead_code, reason = "held, and never given back")] [Output<'static>; 4]);

#[cfg(feature = "hil")]
impl Parked {
    /// Takes the pins, and makes them outputs that are low.
    pub fn new(pins: MotorPins<'static>) -> Self {
        let MotorPins { front_right, rear_right, rear_left, front_left } = pins;
        let pins: [AnyPin<'static>; 4] = [front_right.into(), rear_right.into(), rear_left.into(), front_left.into()];
        Self(pins.map(|pin| Output::new(pin, Level::Low, OutputConfig::default())))
    }
}

/// Deselects both chips on SPI. A resistor pulls the inertial sensor's select low, so that it is selected from power-on, and
/// after a warm start drives the line on which the boot loader speaks.
pub fn deselect() {
    // SAFETY: nothing uses the pins yet, and what is made of them here is dropped.
    let SpiPins { imu_select, flow_select, .. } = unsafe { SpiPins::steal() };
    let pins: [AnyPin<'_>; 2] = [imu_select.into(), flow_select.into()];
    for pin in pins {
        Output::new(pin, Level::High, OutputConfig::default());
    }
}

/// Stops every motor at the pin, from any context. Writes registers and takes no lock: the core that holds one may be the
/// core that has stopped.
pub fn cut() {
    let gpio = GPIO::regs();
    // SAFETY: only numbers are taken from these.
    let MotorPins { front_right, rear_right, rear_left, front_left } = unsafe { MotorPins::steal() };
    for pin in [front_right.number(), rear_right.number(), rear_left.number(), front_left.number()] {
        let bit = 1u32 << (pin % 32);
        // SAFETY: the pins may be in use by the PWM channels at the same time. Taking the outputs away from them is the
        // purpose; what the channels do afterwards reaches no pin. Each write is to a register of one pin, or one that
        // sets or clears the bits written as one, so nothing else on the chip is disturbed, nor by another core.
        unsafe {
            // Low before the pin is told to listen to that.
            if pin < 32 {
                gpio.out_w1tc().write(|w| w.bits(bit));
                gpio.enable_w1ts().write(|w| w.bits(bit));
            } else {
                gpio.out1_w1tc().write(|w| w.bits(bit));
                gpio.enable1_w1ts().write(|w| w.bits(bit));
            }
            gpio.func_out_sel_cfg(pin.into()).write(|w| w.out_sel().bits(OutputSignal::GPIO as _).oen_sel().set_bit());
        }
    }
}
