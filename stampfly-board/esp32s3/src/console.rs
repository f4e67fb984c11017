//! The console on USB: a terminal at one end, [`stampfly_board::console`] at the other.

use crate::clock::Clock;
use crate::flight::PROFILE;
use crate::memory::Memory;
use crate::motors;
use crate::radio;
use crate::self_test::Outcome;
use crate::sensors::HEALTH;
use crate::storage::Storage;
use core::cell::RefCell;
use core::fmt::Write as _;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, with_timeout};
use embedded_io_async::{Read, Write};
use esp_hal::Async;
use esp_hal::peripherals::USB_DEVICE;
use esp_hal::usb::usb_serial_jtag::{UsbSerialJtag, UsbSerialJtagTx};
use heapless::{String, Vec};
use stampfly_board::console::{Context, LineEditor, MotorTest, Request, SensorLine, answer};
use stampfly_board::{VehicleConfig, black_box};
use stampfly_drivers::Timebase;
use stampfly_log::ulog::{Full, Level, Sample, Sink};

const PROMPT: &str = "> ";
/// The longest reply is the list of parameters.
const REPLY: usize = 4 * 1024;
/// A terminal that takes nothing for this long is none.
const PATIENCE: Duration = Duration::from_millis(200);
/// Bytes of the log in a line of its dump.
const LINE: usize = 32;

/// The motor test, asked for here and applied where duties go to the motors.
pub static MOTOR_TEST: MotorTest = MotorTest::new();

/// What the console needs.
pub struct Parts {
    pub usb: USB_DEVICE<'static>,
    pub memory: &'static RefCell<Memory>,
    pub storage: Storage,
    /// The configuration the vehicle flies with.
    pub config: VehicleConfig,
    /// How the self test went.
    pub tested: Outcome,
}

/// Answers for ever.
#[embassy_executor::task]
pub async fn run(parts: Parts) {
    let Parts { usb, memory, storage, config, tested } = parts;
    let (mut keys, screen) = UsbSerialJtag::new(usb).into_async().split();
    let mut version = String::new();
    // A version that is too long ends early.
    let _ = write!(version, concat!("stampfly-esp32s3 ", env!("CARGO_PKG_VERSION"), ", {}"), tested);
    let mut console = Console { screen: Screen(screen), memory, storage, config, version };
    let mut editor = LineEditor::<80>::new();
    let mut typed = [0; 64];
    loop {
        let count = match select(keys.read(&mut typed), radio::PAIRED.wait()).await {
            Either::First(count) => count.unwrap_or_default(),
            Either::Second(peer) => {
                let memory = console.memory;
                let kept = console.storage.save_peer(peer, || newest_mode(memory)).await;
                let mut said = String::<96>::new();
                let _ = match kept {
                    Ok(()) => write!(said, "paired with {peer}\r\n"),
                    Err(error) => write!(said, "paired with {peer}, not kept: {error}\r\n"),
                };
                console.screen.show(&said).await;
                continue;
            }
        };
        for byte in typed.iter().take(count) {
            let mut echo = String::<256>::new();
            let line: Option<String<80>> =
                editor.feed(*byte, &mut echo).map(|line| String::try_from(line).unwrap_or_default());
            console.screen.show(&echo).await;
            if let Some(line) = line {
                console.obey(&line).await;
                console.screen.show(PROMPT).await;
            }
        }
    }
}

fn newest_mode(memory: &RefCell<Memory>) -> Option<stampfly_types::messages::SystemMode> {
    let mut memory = memory.borrow_mut();
    memory.catch_up();
    memory.mode()
}

struct Console {
    screen: Screen,
    memory: &'static RefCell<Memory>,
    storage: Storage,
    config: VehicleConfig,
    /// Which firmware this is, and how its self test went.
    version: String<128>,
}

impl Console {
    async fn obey(&mut self, line: &str) {
        let mut reply = String::<REPLY>::new();
        let request = {
            let mut memory = self.memory.borrow_mut();
            memory.catch_up();
            let mut context = Context {
                now: Clock.now(),
                version: &self.version,
                newest: &memory.newest,
                sensors: &[
                    SensorLine { name: "imu", health: &HEALTH.imu },
                    SensorLine { name: "flow", health: &HEALTH.flow },
                    SensorLine { name: "tof", health: &HEALTH.tof },
                    SensorLine { name: "tof_front", health: &HEALTH.tof_front },
                    SensorLine { name: "mag", health: &HEALTH.mag },
                    SensorLine { name: "baro", health: &HEALTH.baro },
                    SensorLine { name: "power", health: &HEALTH.power },
                ],
                profile: &PROFILE,
                config: &mut self.config,
            };
            // A reply that is too long ends early.
            answer(line, &mut context, &mut reply).unwrap_or(Request::Nothing)
        };
        self.screen.show(&reply).await;
        let memory = self.memory;
        let mode = || newest_mode(memory);
        match request {
            Request::Nothing => {}
            Request::SaveParameters => {
                let outcome = self.storage.save(&self.config, mode).await;
                self.report(outcome, "kept; they apply after a reboot").await;
            }
            Request::ResetParameters => {
                let outcome = self.storage.reset(mode).await;
                self.report(outcome, "forgotten, the transmitter, too; defaults apply after a reboot").await;
            }
            Request::Pair => {
                radio::PAIR.signal(());
                self.screen.show("looking for a transmitter\r\n").await;
            }
            Request::TestMotor { motor, duty } => {
                let armed = mode().is_none_or(|mode| mode.armed);
                let outcome = MOTOR_TEST.start(Clock.now(), armed, motor, duty);
                self.report(outcome, "turning for two seconds").await;
            }
            Request::StopMotor => MOTOR_TEST.stop(),
            Request::DumpLog => self.dump().await,
            Request::Reboot => {
                motors::cut();
                esp_hal::system::software_reset();
            }
        }
    }

    async fn report<E: core::fmt::Display>(&mut self, outcome: Result<(), E>, good: &str) {
        let mut said = String::<128>::new();
        let _ = match outcome {
            Ok(()) => write!(said, "{good}\r\n"),
            Err(error) => write!(said, "{error}\r\n"),
        };
        self.screen.show(&said).await;
    }

    /// Sends the black box as a log in hexadecimal, a format that survives every terminal.
    async fn dump(&mut self) {
        let bytes = RefCell::new(Vec::new());
        let begun = self.memory.borrow().black_box.records().next().map(|record| record.at);
        let Some(begun) = begun else { return self.screen.show("no flight yet\r\n").await };
        let Ok(mut log) = black_box::open(Bytes(&bytes), begun, &self.config) else { return };
        let _ = log.text(Level::Info, begun, &self.version);
        self.screen.send_all(&bytes).await;
        // Looked up one by one, so that nothing is borrowed while the terminal takes its time.
        let mut index = 0;
        loop {
            let record = self.memory.borrow().black_box.records().nth(index);
            let Some(record) = record else { break };
            let sample = Sample { at: record.at, generation: record.generation, words: record.words() };
            // A sample the log refuses is left out.
            let _ = log.sample(record.topic, &sample);
            self.screen.send_all(&bytes).await;
            index += 1;
        }
        self.screen.show("\r\n").await;
    }
}

/// Where the terminal is.
struct Screen(UsbSerialJtagTx<'static, Async>);

impl Screen {
    /// Shows a text. Without a terminal it is lost.
    async fn show(&mut self, text: &str) {
        if !text.is_empty() {
            let _ = with_timeout(PATIENCE, self.0.write_all(text.as_bytes())).await;
        }
    }

    /// Sends bytes in lines of hexadecimal digits, and forgets them.
    async fn send_all(&mut self, bytes: &RefCell<Vec<u8, LOG_PIECE>>) {
        let mut sent = 0;
        loop {
            let mut line = String::<{ 2 * LINE + 2 }>::new();
            for byte in bytes.borrow().iter().skip(sent).take(LINE) {
                let _ = write!(line, "{byte:02x}");
            }
            if line.is_empty() {
                break;
            }
            sent += LINE;
            let _ = line.push_str("\r\n");
            self.show(&line).await;
        }
        bytes.borrow_mut().clear();
    }
}

/// The longest piece of a log that is made at once: what explains its topics.
const LOG_PIECE: usize = 10 * 1024;

/// Collects what a log is made of.
struct Bytes<'b>(&'b RefCell<Vec<u8, LOG_PIECE>>);

impl Sink for Bytes<'_> {
    type Error = Full;

    fn write(&mut self, bytes: &[u8]) -> Result<(), Full> {
        self.0.borrow_mut().extend_from_slice(bytes).map_err(|_| Full)
    }
}
