//! After any disturbance of a start, further calls bring the chip into operation.
//!
//! Every transfer of a start fails once, before or after it reaches the chip, and a start is
//! dropped at any instant.

use crate::{mounting, standing};
use core::cell::Cell;
use core::future::poll_fn;
use core::pin::pin;
use core::task::Poll;
use embedded_hal::digital::OutputPin;
use embedded_hal_async::i2c::{self, I2c};
use embedded_hal_async::spi::{self, SpiDevice};
use stampfly_drivers::chip::AxisMap;
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::chip::vl53l3cx::{self, BootAddress, Vl53l3cx};
use stampfly_drivers::{Barometer, Imu, Magnetometer, OpticalFlow, PowerMonitor, RangeFinder, Sample};
use stampfly_sim::SimulationConfig;
use stampfly_sim::chips::{Board, BusError, stand_in_image};
use stampfly_sim::time::{Clock, block_on};
use stampfly_types::Instant;
use std::rc::Rc;

/// Number of transfers before the failing one, and whether the chip receives that one.
#[derive(Clone, Default)]
struct Trouble(Rc<Cell<Option<(u32, bool)>>>);

impl Trouble {
    /// Counts a transfer and returns its fate.
    fn next(&self) -> Option<bool> {
        let (left, seen) = self.0.get()?;
        self.0.set(left.checked_sub(1).map(|left| (left, seen)));
        (left == 0).then_some(seen)
    }
}

/// A bus on which one transfer fails.
struct Unreliable<B>(B, Trouble);

impl<B: I2c<Error = BusError>> i2c::ErrorType for Unreliable<B> {
    type Error = BusError;
}

impl<B: I2c<Error = BusError>> I2c for Unreliable<B> {
    async fn transaction(&mut self, address: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), BusError> {
        let fails = self.1.next();
        if fails != Some(false) {
            self.0.transaction(address, operations).await?;
        }
        if fails.is_none() { Ok(()) } else { Err(BusError::ArbitrationLost) }
    }
}

impl<B: SpiDevice<Error = BusError>> spi::ErrorType for Unreliable<B> {
    type Error = BusError;
}

impl<B: SpiDevice<Error = BusError>> SpiDevice for Unreliable<B> {
    async fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), BusError> {
        let fails = self.1.next();
        if fails != Some(false) {
            self.0.transaction(operations).await?;
        }
        if fails.is_none() { Ok(()) } else { Err(BusError::Overrun) }
    }
}

/// Polls a call until it ends or this instant is reached, and then drops it.
async fn drop_at<T>(clock: &Clock, instant: Instant, call: impl Future<Output = T>) -> Option<T> {
    let (mut call, mut end) = (pin!(call), pin!(clock.sleep_until(instant)));
    poll_fn(|context| match (call.as_mut().poll(context), end.as_mut().poll(context)) {
        (Poll::Ready(outcome), _) => Poll::Ready(Some(outcome)),
        (Poll::Pending, Poll::Ready(())) => Poll::Ready(None),
        (Poll::Pending, Poll::Pending) => Poll::Pending,
    })
    .await
}

/// A disturbed start, then calls until one returns the measurement of a healthy chip.
macro_rules! recovers {
    ($name:ident, $step:literal, |$board:ident, $clock:ident, $trouble:ident $(, $image:ident)? $(; $boot:ident)?| $driver:expr,
     |$data:ident| $healthy:expr) => {
        #[test]
        fn $name() {
            let image = stand_in_image();
            $(let $image = &image;)?
            let disturbed = |disturb: &dyn Fn(&Clock, &Trouble) -> Option<Instant>| {
                let (simulation, $trouble) = (standing(), Trouble::default());
                $(let $boot = BootAddress::new();)?
                let $clock = simulation.clock.clone();
                let $board = Board::new(&simulation.world, &$clock, &SimulationConfig::example(), &image);
                let mut driver = $driver;
                let drops = disturb(&$clock, &$trouble);
                if let Some(instant) = drops {
                    let _ = block_on(&$clock, drop_at(&$clock, instant, driver.next()));
                }
                let mut said = Vec::new();
                for _ in 0..6 {
                    match block_on(&$clock, driver.next()) {
                        Ok(Sample { data: $data, .. }) if $healthy => {
                            return ($clock.now(), $trouble.0.get().is_none());
                        }
                        outcome => said.push(format!("{outcome:?}")),
                    }
                }
                panic!("it stays down: {said:?}");
            };
            let (undisturbed, _) = disturbed(&|_, _| None);
            for seen in [false, true] {
                let fails = |number| {
                    disturbed(&|_, trouble| {
                        trouble.0.set(Some((number, seen)));
                        None
                    })
                };
                let transfers = (0..).take_while(|number| fails(*number).1).count();
                assert!((3..1_000).contains(&transfers), "{transfers} transfers until the first sample");
            }
            for instant in (0..undisturbed.as_micros()).step_by($step) {
                disturbed(&|_, _| Some(Instant::from_micros(instant)));
            }
        }
    };
}

recovers!(
    imu,
    970,
    |board, clock, trouble, image| {
        let config = bmi270::Config::default();
        Bmi270::spi(Unreliable(board.imu, trouble.clone()), clock.clone(), image, mounting::IMU, config)
    },
    |data| (data.accel.z + 9.81).abs() < 0.6
);
recovers!(
    flow,
    230,
    |board, clock, trouble| {
        let device = Unreliable(board.flow, trouble.clone());
        Pmw3901::new(device, clock.clone(), mounting::FLOW, pmw3901::Config::default())
    },
    |data| data.quality > 0
);
recovers!(
    magnetometer,
    230,
    |board, clock, trouble| {
        let bus = Unreliable(board.i2c, trouble.clone());
        Bmm150::i2c(bus, Bmm150::ALL_LOW, clock.clone(), AxisMap::IDENTITY, bmm150::Config::default())
    },
    |data| (20.0..80.0).contains(&data.field.norm())
);
recovers!(
    barometer,
    230,
    |board, clock, trouble| {
        Bmp280::i2c(Unreliable(board.i2c, trouble.clone()), 0x76, clock.clone(), bmp280::Config::default())
    },
    |data| (90_000.0..110_000.0).contains(&data.pressure)
);
recovers!(
    power,
    970,
    |board, clock, trouble| {
        Ina3221::new(Unreliable(board.i2c, trouble.clone()), 0x40, clock.clone(), ina3221::Config::default())
    },
    |data| (3.5..4.4).contains(&data.voltage)
);
recovers!(
    range_finder,
    970,
    |board, clock, trouble; boot| {
        let bus = Unreliable(board.i2c, trouble.clone());
        let _ahead = OutputPin::set_low(&mut { board.shutdown_front });
        Vl53l3cx::new(bus, board.shutdown_bottom, &boot, 0x30, clock.clone(), vl53l3cx::Config::default())
    },
    |data| data.valid && data.distance < 0.1
);
