//! The motors: four transistors behind four channels of the PWM unit, and two ways to keep them off.
//!
//! [`hold_low`], the first thing the program does, makes the pins outputs that are low. [`cut`] takes them away from the
//! PWM unit and pulls them low again: it asks for nothing, waits for nobody, works from any context, and is what a panic
//! does, and what the [cut-off](crate::cutoff) does when nobody controls the motors any more. Only a disarmed vehicle
//! gets its pins back.

use crate::clock::Clock;
use crate::console::MOTOR_TEST;
use crate::pins::MotorPins;
use crate::{cutoff, storage};
use esp_hal::gpio::{AnyPin, DriveMode, Level, Output, OutputConfig, OutputSignal, Pin};
use esp_hal::ledc::channel::{self, Channel, ChannelIFace};
use esp_hal::ledc::timer::{self, LSClockSource, Timer, TimerIFace};
use esp_hal::ledc::{LSGlobalClkSource, Ledc, LowSpeed};
use esp_hal::peripherals::{GPIO, LEDC};
use esp_hal::time::Rate;
use stampfly_drivers::{MotorError, MotorOutputs, PwmMotors, Timebase};
use stampfly_types::messages::MotorOutput;
use static_cell::StaticCell;

/// Far above what ears and brushes notice, as on the vehicle's original firmware.
const FREQUENCY: Rate = Rate::from_khz(150);
/// The resolution of a duty. [`PwmMotors`] scales by what the channel says, so this is the only place that knows.
const RESOLUTION: timer::config::Duty = timer::config::Duty::Duty8Bit;
/// The PWM unit's clock.
const CLOCK: Rate = Rate::from_mhz(80);
// A period must be at least one tick of the clock a step, or the timer refuses it at run time.
const _: () = assert!(CLOCK.as_hz() >= FREQUENCY.as_hz() << RESOLUTION as u32);

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

/// Starts the PWM unit, which the buzzer uses, too.
pub fn start_unit(unit: LEDC<'static>) {
    Ledc::new(unit).set_global_slow_clock(LSGlobalClkSource::APBClk);
}

type PwmChannel = Channel<'static, LowSpeed>;

/// The motors, in motor order: front right, rear right, rear left, front left.
pub struct Motors {
    pwm: PwmMotors<PwmChannel, 4>,
    timer: &'static Timer<'static, LowSpeed>,
}

impl Motors {
    /// Takes the pins, at duty zero. The unit must have been started.
    pub fn new(pins: MotorPins<'static>) -> Self {
        static TIMER: StaticCell<Timer<'static, LowSpeed>> = StaticCell::new();
        let mut timer = Timer::new(LEDC::regs(), timer::Number::Timer0);
        let config =
            timer::config::Config { duty: RESOLUTION, clock_source: LSClockSource::APBClk, frequency: FREQUENCY };
        timer.configure(config).expect("the assertion above has computed the divisor");
        let timer = TIMER.init(timer);
        Self { pwm: connect(pins, timer), timer }
    }

    /// Gives the pins back to the PWM unit after a [`cut`], at duty zero.
    fn reconnect(&mut self) {
        // SAFETY: the pins were given to `new` and belong to the channels in `self.pwm`, which are replaced.
        self.pwm = connect(unsafe { MotorPins::steal() }, self.timer);
    }
}

fn connect(pins: MotorPins<'static>, timer: &'static Timer<'static, LowSpeed>) -> PwmMotors<PwmChannel, 4> {
    let configured = |mut channel: PwmChannel| {
        let config = channel::config::Config { timer, duty_pct: 0, drive_mode: DriveMode::PushPull };
        channel.configure(config).expect("the timer is configured and zero is a duty");
        channel
    };
    PwmMotors::new([
        configured(Channel::new(channel::Number::Channel0, pins.front_right)),
        configured(Channel::new(channel::Number::Channel1, pins.rear_right)),
        configured(Channel::new(channel::Number::Channel2, pins.rear_left)),
        configured(Channel::new(channel::Number::Channel3, pins.front_left)),
    ])
}

impl MotorOutputs for Motors {
    type Error = MotorError;

    fn write(&mut self, output: &MotorOutput) -> Result<(), MotorError> {
        let mut output = MOTOR_TEST.apply(Clock.now(), *output);
        output.armed &= !storage::is_writing();
        cutoff::confirm(output.armed);
        if cutoff::has_tripped() {
            if output.armed || !cutoff::reset() {
                return self.pwm.write(&MotorOutput { armed: false, ..output });
            }
            self.reconnect();
        }
        self.pwm.write(&output)
    }
}
