//! What flies: the inertial sensor's samples, every runnable, the motors' pulses.

use crate::interrupts::Interrupts;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, OutputType, Speed};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{DMA1_CH4, DMA1_CH5, IWDG, PB6, PB7, PB8, PB9, PB12, PB13, PB14, PB15, SPI2, TIM4};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::Channel;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::Delay;
use embedded_hal_bus::spi::ExclusiveDevice;
use stampfly_control::esc::{self, Protocol};
use stampfly_drivers::chip::mpu6000::{BusClock, Config, Mpu6000};
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{EmbassyClock, Imu as _, Timebase as _};
use stampfly_flight::{FlightLoop, task};
use stampfly_stm32_quad::attitude::MOUNTING;
use stampfly_stm32_quad::schedule::{PERIOD, Runnables};
use stampfly_stm32_quad::topics::{ImuEnds, MotorsEnds};

/// Every runnable, with the scheduler.
pub type Loop = FlightLoop<'static, Runnables>;
/// The sensor's device.
type Device = ExclusiveDevice<Spi<'static, Async, Master>, Output<'static>, Delay>;
/// The sensor on its bus.
pub type Sensor = Mpu6000<Device, EmbassyClock, fn(&mut Device, BusClock)>;

const CHANNELS: [Channel; 4] = [Channel::Ch1, Channel::Ch2, Channel::Ch3, Channel::Ch4];
const PULSES: Protocol = Protocol::Oneshot125;
/// Without a pass that was in time for so long, the chip is reset, and with it the motors' pins, µs. Longer than flash takes to erase a page, in which nothing runs
/// (40 ms, see `memory`).
pub const STALLED: u32 = 100_000;

/// Four speed controllers at one timer.
pub struct Motors(SimplePwm<'static, TIM4>);

impl Motors {
    /// Standing.
    pub fn new(
        timer: Peri<'static, TIM4>,
        first: Peri<'static, PB6>,
        second: Peri<'static, PB7>,
        third: Peri<'static, PB8>,
        fourth: Peri<'static, PB9>,
    ) -> Self {
        let kind = OutputType::PushPull;
        let mut pwm = SimplePwm::new(
            timer,
            Some(PwmPin::new(first, kind)),
            Some(PwmPin::new(second, kind)),
            Some(PwmPin::new(third, kind)),
            Some(PwmPin::new(fourth, kind)),
            Hertz(PULSES.frequency()),
            CountingMode::EdgeAlignedUp,
        );
        CHANNELS.into_iter().for_each(|channel| pwm.channel(channel).enable());
        let mut motors = Self(pwm);
        motors.write(&[0.0; 4]);
        motors
    }

    /// Shares of full speed, from now on.
    pub fn write(&mut self, shares: &[f32]) {
        for (channel, share) in CHANNELS.into_iter().zip(shares) {
            self.0.channel(channel).set_duty_cycle_fraction(esc::counts(*share).into(), esc::PERIOD.into());
        }
    }
}

/// The inertial sensor.
pub fn sensor(
    spi: Peri<'static, SPI2>,
    clock: Peri<'static, PB13>,
    out: Peri<'static, PB15>,
    into: Peri<'static, PB14>,
    out_dma: Peri<'static, DMA1_CH5>,
    into_dma: Peri<'static, DMA1_CH4>,
    select: Peri<'static, PB12>,
) -> Sensor {
    let bus = Spi::new(spi, clock, out, into, out_dma, into_dma, Interrupts, settings(BusClock::Setup));
    let Ok(device) = ExclusiveDevice::new(bus, Output::new(select, Level::High, Speed::VeryHigh), Delay);
    let change: fn(&mut Device, BusClock) = |device, clock| {
        // A frequency that it cannot do stays as it was.
        let _ = device.bus_mut().set_config(&settings(clock));
    };
    Mpu6000::new(device, EmbassyClock, MOUNTING, Config::default()).with_bus_clock(change)
}

/// 16 MHz is the most that half of the second bus's 32 MHz gives.
fn settings(clock: BusClock) -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = spi::MODE_0;
    config.frequency = match clock {
        BusClock::Setup => Hertz(1_000_000),
        BusClock::Data => Hertz(16_000_000),
    };
    config
}

/// What flies.
pub struct Parts {
    pub flight_loop: &'static mut Loop,
    pub sensor: Sensor,
    pub imu: ImuEnds<'static>,
    pub motors: Motors,
    pub duties: MotorsEnds<'static>,
    /// Runs already.
    pub watchdog: IndependentWatchdog<'static, IWDG>,
}

/// Flies until power-off.
#[embassy_executor::task]
pub async fn fly(parts: Parts) {
    let Parts { flight_loop, mut sensor, mut imu, mut motors, mut duties, mut watchdog } = parts;
    static HEALTH: SensorHealth = SensorHealth::new();
    let sensing = run_sensor(
        async || sensor.next().await,
        |at, sample| _ = imu.sensor_imu.publish(at, sample),
        EmbassyClock,
        Backoff::CRITICAL,
        &HEALTH,
    );
    let write = |began, _: &mut FlightLoop<'_, Runnables>| {
        if let Some(output) = duties.actuator_motor.latest() {
            motors.write(output.data.duty.get(..CHANNELS.len()).unwrap_or_default());
        }
        // One that took longer than a period does not count.
        if EmbassyClock.now().since(began) < PERIOD {
            watchdog.pet();
        }
    };
    task::fly(sensing, flight_loop, || EmbassyClock.now(), EmbassyClock, (), write).await;
}
