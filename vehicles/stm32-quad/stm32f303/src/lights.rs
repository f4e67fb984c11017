//! Lights and battery, eight times a second.

use crate::interrupts::Interrupts;
use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, SampleTime};
use embassy_stm32::gpio::{Level, Output};
use embassy_stm32::peripherals::{ADC1, PA0};
use embassy_time::{Duration, Ticker};
use stampfly_drivers::{EmbassyClock, Timebase as _};
use stampfly_stm32_quad::messages::BatterySample;
use stampfly_stm32_quad::topics::{BatteryEnds, LightsEnds};

/// Converts the battery's voltage and shows the lights until power-off.
#[embassy_executor::task]
pub async fn shine(
    mut lights: [Output<'static>; 2],
    mut shown: LightsEnds<'static>,
    converter: Peri<'static, ADC1>,
    mut pin: Peri<'static, PA0>,
    mut battery: BatteryEnds<'static>,
) {
    let mut converter = Adc::new(converter, Interrupts);
    let mut ticker = Ticker::every(Duration::from_millis(125));
    loop {
        // The divider has kiloohms: it takes time to charge the converter.
        let counts = converter.read(&mut pin, SampleTime::CYCLES601_5).await;
        battery.battery_sample.publish(EmbassyClock.now(), &BatterySample { counts: counts.into() });
        if let Some(shown) = shown.lights.latest() {
            let [front, back] = &mut lights;
            front.set_level(Level::from(shown.data.front));
            back.set_level(Level::from(shown.data.back));
        }
        ticker.next().await;
    }
}
