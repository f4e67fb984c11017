//! What the vehicle remembers: the newest sample of every topic, and the last seconds of a flight.

use crate::safe_state;
use core::cell::RefCell;
use embassy_time::{Duration, Ticker};
use esp_hal::system::software_reset;
use stampfly_board::black_box::{self, BlackBox, RETENTION};
use stampfly_board::console::Newest;
use stampfly_board::topics::{self, Id};
use stampfly_bus::Taps;
use stampfly_types::messages::FlightStatus;
use static_cell::ConstStaticCell;

/// Two periods of the fastest topic: every topic has room for at least that many samples.
const PERIOD: Duration = Duration::from_millis(5);

#[cfg(all(feature = "record", feature = "wifi"))]
compile_error!("the features `record` and `wifi` do not fit into the StampFly's memory together");

/// Size of the black box. Next to the flight record there is room for two seconds of a flight, next to
/// the network for one and three quarters.
const WORDS: usize = if cfg!(feature = "wifi") {
    7 * 512
} else if cfg!(feature = "record") {
    4 * 1024
} else {
    black_box::WORDS
};

/// What the vehicle remembers.
pub struct Memory {
    taps: topics::Taps<'static>,
    /// The newest sample of every topic.
    pub newest: Newest,
    /// The last flight.
    pub black_box: &'static mut BlackBox<WORDS>,
}

impl Memory {
    /// Nothing yet. Once only.
    pub fn new(taps: topics::Taps<'static>) -> Self {
        // A constant in a static, so that it is never on a stack: it is as large as some.
        static BLACK_BOX: ConstStaticCell<BlackBox<WORDS>> = ConstStaticCell::new(BlackBox::new(RETENTION));
        Self { taps, newest: Newest::new(), black_box: BLACK_BOX.take() }
    }

    /// Takes in what was published since the last time.
    pub fn catch_up(&mut self) {
        let Self { taps, newest, black_box } = self;
        taps.drain(&mut |topic, at, generation, words| {
            newest.note(topic, at, words);
            black_box.note(topic, at, generation, words);
        });
    }

    /// The mode machine's newest decision.
    pub fn mode(&self) -> Option<FlightStatus> {
        self.newest.get(Id::flight_status as usize).map(|(_, mode)| mode)
    }
}

/// Keeps it up to date, and restarts the vehicle when the bus asks for that.
#[embassy_executor::task]
pub async fn run(memory: &'static RefCell<Memory>, mut supervisor: topics::SupervisorEnds<'static>) {
    let mut ticker = Ticker::every(PERIOD);
    loop {
        ticker.next().await;
        memory.borrow_mut().catch_up();
        if supervisor.restart_request.latest().is_some() {
            restart();
        }
    }
}

/// Restarts the processor, motors off.
pub fn restart() -> ! {
    safe_state::cut();
    software_reset()
}
