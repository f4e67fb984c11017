//! What the vehicle remembers: the newest sample of every topic, and the last seconds of a flight.

use crate::clock::Clock;
use crate::motors;
use core::cell::RefCell;
use embassy_time::Ticker;
use esp_hal::system::software_reset;
use stampfly_board::black_box::{BlackBox, ROOM};
use stampfly_board::console::Newest;
use stampfly_board::wiring;
use stampfly_drivers::Timebase;
use stampfly_types::messages::{ButtonEvent, ButtonGesture, SystemMode};
use stampfly_types::{Duration, Instant};
use static_cell::ConstStaticCell;

/// A gesture on the button that is older was meant for something else.
const FRESH: Duration = Duration::from_millis(100);
/// Two periods of the fastest topic: none has room for fewer samples than that.
const ROUND: embassy_time::Duration = embassy_time::Duration::from_millis(5);

/// What the vehicle remembers.
pub struct Memory {
    taps: wiring::Taps<'static>,
    /// The newest sample of every topic.
    pub newest: Newest,
    /// The last flight.
    pub black_box: &'static mut BlackBox<ROOM>,
    /// When the vehicle was last seen armed.
    armed_at: Instant,
}

impl Memory {
    /// Nothing yet. Once only.
    pub fn new(taps: wiring::Taps<'static>) -> Self {
        // Not on anybody's stack on its way here: it is as large as some.
        static BLACK_BOX: ConstStaticCell<BlackBox<ROOM>> = ConstStaticCell::new(BlackBox::new());
        Self { taps, newest: Newest::new(), black_box: BLACK_BOX.take(), armed_at: Instant::ZERO }
    }

    /// Takes in what was published since the last time.
    pub fn catch_up(&mut self) {
        let Self { taps, newest, black_box, .. } = self;
        taps.drain(&mut |topic, at, generation, words| {
            newest.note(topic, at, words);
            black_box.note(topic, at, generation, words);
        });
        if self.mode().is_some_and(|mode| mode.armed) {
            self.armed_at = Clock.now();
        }
    }

    /// The mode machine's newest decision.
    pub fn mode(&self) -> Option<SystemMode> {
        self.newest.get(wiring::Id::system_mode).map(|(_, mode)| mode)
    }

    /// Has the button just been held for long, on a vehicle disarmed all the while? A press that stopped the motors and
    /// was held on does not count: it would lose what is remembered of the flight.
    fn wants_restart(&self) -> bool {
        let Some((at, event)) = self.newest.get::<ButtonEvent>(wiring::Id::button_event) else { return false };
        let disarmed = self.mode().is_some_and(|mode| !mode.armed) && at.since(self.armed_at).seconds() > event.held;
        event.gesture == ButtonGesture::HoldReset && disarmed && Clock.now().since(at) < FRESH
    }
}

/// Keeps it up to date for ever, and restarts the vehicle when the button says so.
#[embassy_executor::task]
pub async fn run(memory: &'static RefCell<Memory>) {
    let mut ticker = Ticker::every(ROUND);
    loop {
        ticker.next().await;
        let mut memory = memory.borrow_mut();
        memory.catch_up();
        if memory.wants_restart() {
            motors::cut();
            software_reset();
        }
    }
}
