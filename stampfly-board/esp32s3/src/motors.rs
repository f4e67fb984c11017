//! The motors: four transistors behind four channels of the PWM unit, which a watchdog confirms.
//!
//! While the [watchdog](stampfly_flight::Watchdog) has expired, the pins are [cut off](crate::safe_state). Only a
//! disarmed vehicle gets them back.

use crate::clock::Clock;
use crate::pins::MotorPins;
use esp_hal::gpio::DriveMode;
use esp_hal::ledc::channel::{self, Channel, ChannelIFace};
use esp_hal::ledc::timer::{self, LSClockSource, Timer, TimerIFace};
use esp_hal::ledc::{LSGlobalClkSource, Ledc, LowSpeed};
use esp_hal::peripherals::LEDC;
use esp_hal::time::Rate;
use stampfly_drivers::{MotorError, MotorOutputs, PwmMotors, Timebase};
use stampfly_flight::Watchdog;
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

/// Starts the PWM unit, which the buzzer uses, too.
pub fn start_unit(unit: LEDC<'static>) {
    Ledc::new(unit).set_global_slow_clock(LSGlobalClkSource::APBClk);
}

type PwmChannel = Channel<'static, LowSpeed>;

/// The motors, in motor order: front right, rear right, rear left, front left.
pub struct Motors {
    pwm: PwmMotors<PwmChannel, 4>,
    timer: &'static Timer<'static, LowSpeed>,
    watchdog: &'static Watchdog,
}

impl Motors {
    /// Takes the pins, at duty zero. The unit must have been started. Every output feeds the watchdog.
    pub fn new(pins: MotorPins<'static>, watchdog: &'static Watchdog) -> Self {
        static TIMER: StaticCell<Timer<'static, LowSpeed>> = StaticCell::new();
        let mut timer = Timer::new(LEDC::regs(), timer::Number::Timer0);
        let config =
            timer::config::Config { duty: RESOLUTION, clock_source: LSClockSource::APBClk, frequency: FREQUENCY };
        timer.configure(config).expect("the assertion above has computed the divisor");
        let timer = TIMER.init(timer);
        Self { pwm: connect(pins, timer), timer, watchdog }
    }

    /// Gives the pins back to the PWM unit after they were cut off, at duty zero.
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
        self.watchdog.feed(Clock.now(), output.armed);
        if self.watchdog.has_expired() {
            if output.armed || !self.watchdog.reset() {
                return self.pwm.write(&MotorOutput { armed: false, ..*output });
            }
            self.reconnect();
        }
        self.pwm.write(output)
    }
}
