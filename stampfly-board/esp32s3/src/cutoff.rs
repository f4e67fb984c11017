//! The cut-off: a hardware timer that stops the motors when nobody controls them any more.
//!
//! It has a timer and an interrupt of its own, on the core that does not fly, and takes no lock. So it works when the
//! flight task waits for a bus that has died, when its executor is stuck, and when its core has stopped with interrupts
//! off. Once it has acted, motors stay off until the flight task says that it is disarmed.
//!
//! Should this core stop, too, and with it the clock the flight task waits by, the chip's watchdog restarts it all: after a
//! tenth of a second in flight. A chip that starts has its motors off.

use crate::clock::Clock;
use crate::motors;
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
use stampfly_board::tasks::DeadMan;
use stampfly_drivers::Timebase;
use static_cell::StaticCell;

/// Motors that nobody has confirmed for this long are stopped.
const PATIENCE: stampfly_types::Duration = stampfly_types::Duration::from_millis(25);
/// How often the timer looks. Motors turn for at most `PATIENCE` and this after the last confirmation.
const PERIOD: Duration = Duration::from_millis(1);

/// The watchdog's patience while motors may turn.
const IN_FLIGHT: Duration = Duration::from_millis(100);
/// And while they may not: longer than any write to flash, which stops both cores.
const ON_THE_GROUND: Duration = Duration::from_secs(4);

/// Shared by the flight task and the timer's interrupt.
static SWITCH: DeadMan = DeadMan::new(PATIENCE);
/// For the interrupt only.
static WATCH: AtomicPtr<Watch> = AtomicPtr::new(null_mut());

struct Watch {
    timer: PeriodicTimer<'static, Blocking>,
    watchdog: Wdt<TIMG1<'static>>,
    /// Which patience the watchdog has.
    in_flight: bool,
}

/// Starts to watch. Called on the core that does not fly.
pub fn start(group: TIMG1<'static>) {
    static CELL: StaticCell<Watch> = StaticCell::new();
    let group = TimerGroup::new(group);
    let watch = CELL.init(Watch { timer: PeriodicTimer::new(group.timer0), watchdog: group.wdt, in_flight: false });
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
}

/// The flight task controls the motors: to be said with every output. `armed` says whether they may turn.
pub fn confirm(armed: bool) {
    SWITCH.confirm(Clock.now(), armed);
}

/// Has the cut-off acted, and nobody reset it since?
pub fn has_tripped() -> bool {
    SWITCH.has_tripped()
}

/// Lets the motors turn again. Returns whether they may.
pub fn reset() -> bool {
    SWITCH.reset()
}

/// Stops the motors until the vehicle is switched off.
pub fn trip_for_good() {
    SWITCH.trip_for_good();
    motors::cut();
}

/// Keeps the watchdog from restarting a vehicle that has stopped on purpose.
pub fn stand_down() {
    Wdt::<TIMG1<'static>>::new().disable();
}

#[handler(priority = Priority::Priority3)]
fn look() {
    // SAFETY: the pointer is null or leads to the static, which `start` has handed over to this function and does not
    // touch again; an interrupt does not interrupt itself.
    if let Some(watch) = unsafe { WATCH.load(Ordering::Acquire).as_mut() } {
        watch.timer.clear_interrupt();
        watch.watchdog.feed();
        let armed = SWITCH.is_armed();
        if watch.in_flight != armed {
            watch.in_flight = armed;
            watch.watchdog.set_timeout(MwdtStage::Stage0, if armed { IN_FLIGHT } else { ON_THE_GROUND });
        }
    }
    // Again and again: whatever gave the pins back, tripped means off.
    if SWITCH.must_cut(|| Clock.now()) {
        motors::cut();
    }
}
