//! The buzzer's channel of the PWM unit, on a timer that the motors do not use.

use core::convert::Infallible;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use esp_hal::gpio::{AnyPin, DriveMode};
use esp_hal::ledc::LowSpeed;
use esp_hal::ledc::channel::{self, ChannelHW, ChannelIFace};
use esp_hal::ledc::timer::{self, LSClockSource, Timer, TimerIFace};
use esp_hal::peripherals::LEDC;
use esp_hal::time::Rate;
use stampfly_drivers::SetFrequency;
use static_cell::StaticCell;

const RESOLUTION: timer::config::Duty = timer::config::Duty::Duty10Bit;
/// What the timer can divide its clock by without leaving a tune: all notes are far inside.
const PITCHES: core::ops::RangeInclusive<u32> = 100..=20_000;

/// A channel with a frequency of its own.
pub struct Channel(channel::Channel<'static, LowSpeed>);

impl Channel {
    /// Silence. The PWM unit must have been started.
    pub fn new(pin: AnyPin<'static>) -> Self {
        static TIMER: StaticCell<Timer<'static, LowSpeed>> = StaticCell::new();
        let timer = TIMER.init(tuned(*PITCHES.start()));
        let mut channel = channel::Channel::new(channel::Number::Channel4, pin);
        let config = channel::config::Config { timer, duty_pct: 0, drive_mode: DriveMode::PushPull };
        channel.configure(config).expect("the timer is configured and zero is a duty");
        Self(channel)
    }
}

impl ErrorType for Channel {
    type Error = Infallible;
}

impl SetDutyCycle for Channel {
    fn max_duty_cycle(&self) -> u16 {
        1 << RESOLUTION as u16
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.set_duty_hw(duty.into());
        Ok(())
    }
}

impl SetFrequency for Channel {
    fn set_frequency(&mut self, hertz: u32) -> Result<(), Infallible> {
        tuned(hertz.clamp(*PITCHES.start(), *PITCHES.end()));
        Ok(())
    }
}

/// The timer at this frequency, in hertz. It is one set of registers; every value of this type writes the same.
fn tuned(frequency: u32) -> Timer<'static, LowSpeed> {
    let mut timer = Timer::new(LEDC::regs(), timer::Number::Timer1);
    let config = timer::config::Config {
        duty: RESOLUTION,
        clock_source: LSClockSource::APBClk,
        frequency: Rate::from_hz(frequency),
    };
    timer.configure(config).expect("every pitch is within the timer's range");
    timer
}
