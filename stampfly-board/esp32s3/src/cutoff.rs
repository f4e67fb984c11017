//! The cut-off: a hardware timer that stops the motors when nobody controls them any more.
//!
//! It has a timer and an interrupt of its own, on the core that does not fly, and takes no lock. So it works when the
//! flight task waits for a bus that has died, when its executor is stuck, and when its core has stopped with interrupts
//! off. Once it has acted, motors stay off until the flight task says that it is disarmed.
//!
//! Should this core stop, too, and with it the clock the flight task waits by, the chip's watchdog restarts it all: after a
//! tenth of a second in flight. A chip that starts has its motors off.

use crate::clock::Clock;
use crate::safe_state;
use core::ptr::null_mut;
use core::sync::atomic::{AtomicPtr, Ordering};
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, RawMutex};
use esp_hal::Blocking;
use esp_hal::handler;
use esp_hal::interrupt::Priority;
use esp_hal::peripherals::TIMG1;
use esp_hal::time::Duration;
use esp_hal::timer::PeriodicTimer;
use esp_hal::timer::timg::{MwdtStage, MwdtStageAction, TimerGroup, Wdt};
use stampfly_board::airframe::CUT_OFF;
use stampfly_board::messages::CutoffState;
use stampfly_board::topics::CutoffStateTx;
use stampfly_drivers::Timebase;
use stampfly_flight::Watchdog;
use static_cell::StaticCell;

/// How often the timer looks. Motors turn for at most [`CUT_OFF`] and this after the last confirmation.
const PERIOD: Duration = Duration::from_millis(1);

/// Timeout of the chip's watchdog while motors may turn.
const IN_FLIGHT: Duration = Duration::from_millis(100);
/// And while they may not: longer than any write to flash, which stops both cores.
const ON_THE_GROUND: Duration = Duration::from_secs(4);

/// Shared by the motors, which feed it, the timer's interrupt and the panic handler.
static WATCHDOG: Watchdog = Watchdog::new(CUT_OFF);
/// For the interrupt only.
static WATCH: AtomicPtr<Watch> = AtomicPtr::new(null_mut());

struct Watch {
    timer: PeriodicTimer<'static, Blocking>,
    watchdog: Wdt<TIMG1<'static>>,
    /// Which timeout the chip's watchdog has.
    in_flight: bool,
    /// Where the bus is told, and what it was told last.
    report: Option<CutoffStateTx<'static>>,
    reported: bool,
}

/// Starts to watch, and returns what the motors are to feed. Called on the core that does not fly. `report` is told when
/// the cut-off acts and when it is over.
pub fn start(group: TIMG1<'static>, report: Option<CutoffStateTx<'static>>) -> &'static Watchdog {
    static CELL: StaticCell<Watch> = StaticCell::new();
    let group = TimerGroup::new(group);
    let timer = PeriodicTimer::new(group.timer0);
    let watch = CELL.init(Watch { timer, watchdog: group.wdt, in_flight: false, report, reported: false });
    watch.timer.set_interrupt_handler(look);
    watch.timer.start(PERIOD).expect("a millisecond is within the timer's range");
    watch.watchdog.set_timeout(MwdtStage::Stage0, ON_THE_GROUND);
    watch.watchdog.set_stage_action(MwdtStage::Stage0, MwdtStageAction::ResetSystem);
    watch.watchdog.enable();
    // An interrupt in between would find nothing to clear, and come again for ever.
    CriticalSectionRawMutex::new().lock(|| {
        watch.timer.listen();
        WATCH.store(watch, Ordering::Release);
    });
    &WATCHDOG
}

/// Stops the motors until the next power-on. Not inlined, as [`stand_down`] is not, so that `cargo xtask panic-calls` finds it.
#[inline(never)]
pub fn lock_out() {
    WATCHDOG.lock_out();
    safe_state::cut();
}

/// The watchdog's registers take what is written while this is in one of them (ESP32-S3 technical reference manual, section 12.4.2.3).
const WRITE_KEY: u32 = 0x50D8_3AA1;

/// Keeps the watchdog from restarting a vehicle that has stopped on purpose. Writes registers and takes no lock: the driver's own
/// function asks for the clock tree, which whoever panicked may have held.
#[inline(never)]
pub fn stand_down() {
    let registers = TIMG1::regs();
    // SAFETY: `Watch` may be in the middle of feeding it, on the other core too; a watchdog that is off needs no feeding, and
    // whichever of them writes the protection last leaves it on.
    registers.wdtwprotect().write(|w| unsafe { w.wdt_wkey().bits(WRITE_KEY) });
    registers.wdtconfig0().modify(|_, w| w.wdt_en().clear_bit());
    #[cfg(feature = "esp32c6")]
    registers.wdtconfig0().modify(|_, w| w.wdt_conf_update_en().set_bit());
    // SAFETY: as above.
    registers.wdtwprotect().write(|w| unsafe { w.wdt_wkey().bits(0) });
}

#[handler(priority = Priority::Priority3)]
fn look() {
    let expired = WATCHDOG.expired(|| Clock.now());
    // Every time: whatever gave the pins back, expired means off.
    if expired {
        safe_state::cut();
    }
    // SAFETY: the pointer is null or leads to the static, which `start` has handed over to this function and does not
    // touch again; an interrupt does not interrupt itself.
    let Some(watch) = (unsafe { WATCH.load(Ordering::Acquire).as_mut() }) else { return };
    watch.timer.clear_interrupt();
    watch.watchdog.feed();
    let armed = WATCHDOG.is_armed();
    if watch.in_flight != armed {
        watch.in_flight = armed;
        watch.watchdog.set_timeout(MwdtStage::Stage0, if armed { IN_FLIGHT } else { ON_THE_GROUND });
    }
    if watch.reported != expired
        && let Some(report) = &mut watch.report
    {
        report.publish(Clock.now(), &CutoffState { tripped: expired });
        watch.reported = expired;
    }
}
