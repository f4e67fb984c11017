//! Hardware in the loop: the program at the other end of USB has the world, and this chip computes what the vehicle does.
//!
//! The console's `hil` restarts into it, and it ends with a restart. Nothing of the vehicle is started but the core that
//! computes, USB and the cut-off, which has been told to keep the motors off until the next start: no driver, no radio, no PWM.

use crate::clock::Clock;
use crate::memory::restart;
use crate::pins::MotorPins;
use crate::safe_state::Parked;
use crate::{cutoff, safe_state};
use alloc::boxed::Box;
use alloc::vec;
use core::sync::atomic::Ordering;
use embassy_futures::block_on;
use embassy_time::{Duration, with_timeout};
use embedded_io_async::{Read, Write};
use esp_hal::Async;
use esp_hal::peripherals::{FROM_CPU_INTR0, TIMG0, TIMG1, USB_DEVICE};
use esp_hal::ram;
use esp_hal::system::software_reset;
use esp_hal::timer::timg::TimerGroup;
use esp_hal::usb::usb_serial_jtag::{UsbSerialJtag, UsbSerialJtagRx, UsbSerialJtagTx};
use portable_atomic::AtomicU32;
use stampfly_board::VehicleConfig;
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::Bus;
use stampfly_drivers::Timebase;
use stampfly_flight::hil::{LONGEST, LONGEST_FRAME, Line, Wire, serve};
use stampfly_types::Instant;

/// The next start is one of these.
const WANTED: u32 = 0x5746_4c59;
/// Zero after power-on; a restart leaves it alone.
#[ram(unstable(rtc_fast, persistent))]
static NEXT_START: AtomicU32 = AtomicU32::new(0);
/// A computer that takes nothing, or says nothing, for this long is asked again later.
const PATIENCE: Duration = Duration::from_millis(100);

/// Restarts into it.
pub fn restart_into() -> ! {
    NEXT_START.store(WANTED, Ordering::Release);
    safe_state::cut();
    software_reset()
}

/// Is this start one of these? The next is not, unless it is asked for again.
pub fn is_wanted() -> bool {
    NEXT_START.swap(0, Ordering::AcqRel) == WANTED
}

/// What it needs of the chip.
pub struct Parts {
    pub motors: MotorPins<'static>,
    pub usb: USB_DEVICE<'static>,
    pub ticks: TIMG0<'static>,
    pub interrupt: FROM_CPU_INTR0<'static>,
    pub cutoff: TIMG1<'static>,
    /// On which nothing has been published.
    pub bus: Box<Bus>,
}

/// Flies once what the computer says, and restarts.
#[inline(never)]
pub fn run(parts: Parts) -> ! {
    cutoff::lock_out();
    let motors = Parked::new(parts.motors);
    esp_rtos::start(TimerGroup::new(parts.ticks).timer0, parts.interrupt);
    cutoff::start(parts.cutoff, None);
    fly(parts.usb, parts.bus, &motors);
    restart()
}

/// Flies once. The motors are shown to be parked.
fn fly(usb: USB_DEVICE<'static>, mut bus: Box<Bus>, _motors: &Parked) {
    // The heap is the radio's otherwise.
    let (mut incoming, mut happened, mut reply) = (vec![0; LONGEST], vec![0; LONGEST], vec![0; LONGEST_FRAME]);
    let mut line = Line::new(&mut incoming, &mut happened, &mut reply);
    let (mut place, mut config) = (Box::new_uninit(), Box::new(VehicleConfig::default()));
    let (keys, screen) = UsbSerialJtag::new(usb).into_async().split();
    // Nothing else is to be done on this core, so nobody is kept waiting.
    block_on(serve::<Runnables>(&mut Usb { keys, screen }, &mut line, &mut place, &mut bus, &mut config));
}

/// The line.
struct Usb {
    keys: UsbSerialJtagRx<'static, Async>,
    screen: UsbSerialJtagTx<'static, Async>,
}

impl Wire for Usb {
    async fn receive(&mut self, buffer: &mut [u8]) -> usize {
        with_timeout(PATIENCE, self.keys.read(buffer)).await.ok().and_then(Result::ok).unwrap_or_default()
    }

    async fn send(&mut self, bytes: &[u8]) {
        let _ = with_timeout(PATIENCE, self.screen.write_all(bytes)).await;
    }

    fn now(&self) -> Instant {
        Clock.now()
    }
}
