//! The console on USB: a terminal at one end, [`stampfly_board::console`] at the other.

use crate::clock::Clock;
use crate::flight::PROFILE;
use crate::memory::Memory;
use crate::motors;
use crate::radio;
use crate::self_test::Outcome;
use crate::sensors::HEALTH;
use crate::storage::{Storage, StorageError};
use core::cell::RefCell;
use core::fmt::Write as _;
use embassy_futures::select::{Either3, select3};
use embassy_time::{Duration, Timer, with_timeout};
use embedded_io_async::{Read, Write};
use esp_hal::Async;
use esp_hal::peripherals::USB_DEVICE;
use esp_hal::usb::usb_serial_jtag::{UsbSerialJtag, UsbSerialJtagTx};
use heapless::String;
use stampfly_board::VehicleConfig;
use stampfly_board::black_box::{DumpError, Refused, dump};
use stampfly_board::console::{Context, LineEditor, MotorTest, Request, SensorLine, answer};
use stampfly_drivers::Timebase;
use stampfly_link::Address;

const PROMPT: &str = "> ";
/// The longest reply is the list of parameters.
const REPLY: usize = 4 * 1024;
/// A terminal that takes nothing for this long is none.
const PATIENCE: Duration = Duration::from_millis(200);
/// A terminal in the middle of a log is one, and may be busy.
const PATIENCE_WITH_LOG: Duration = Duration::from_secs(3);
/// How often it is tried again to keep the transmitter that was paired.
const AGAIN: Duration = Duration::from_secs(1);

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
    let flown = config.clone();
    let mut console = Console { screen: Screen(screen), memory, storage, config, flown, version, unkept: None };
    let mut editor = LineEditor::<80>::new();
    let mut typed = [0; 64];
    loop {
        let again = async {
            match console.unkept {
                Some(_) => Timer::after(AGAIN).await,
                None => core::future::pending().await,
            }
        };
        let count = match select3(keys.read(&mut typed), radio::PAIRED.wait(), again).await {
            Either3::First(count) => count.unwrap_or_default(),
            Either3::Second(peer) => {
                console.paired(peer).await;
                continue;
            }
            Either3::Third(()) => {
                console.keep_peer().await;
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
    /// What the vehicle flies with after the next start.
    config: VehicleConfig,
    /// What it has flown with since the last.
    flown: VehicleConfig,
    /// Which firmware this is, and how its self test went.
    version: String<128>,
    /// A transmitter that was paired and is still to be kept.
    unkept: Option<Address>,
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
                self.unkept = self.unkept.filter(|_| outcome.is_err());
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
        let Self { screen, memory, flown, version, .. } = self;
        let mut cursor = memory.borrow().black_box.begin();
        // Borrowed for one record at a time, so that nothing is while the terminal takes its time.
        let next = || memory.borrow().black_box.next(&mut cursor);
        let show = async |line: &str| screen.offer(line, PATIENCE_WITH_LOG).await;
        if let Err(error) = dump(next, flown, version, show).await {
            self.report(Err::<(), DumpError>(error), "").await;
        }
    }

    /// The vehicle belongs to this transmitter now.
    async fn paired(&mut self, peer: Address) {
        let mut said = String::<96>::new();
        let _ = write!(said, "paired with {peer}\r\n");
        self.screen.show(&said).await;
        self.unkept = Some(peer);
        self.keep_peer().await;
    }

    /// Keeps the transmitter. On an armed vehicle nothing is kept; then it is for later.
    async fn keep_peer(&mut self) {
        let Some(peer) = self.unkept else { return };
        let memory = self.memory;
        let outcome = self.storage.save_peer(peer, || newest_mode(memory)).await;
        if !matches!(outcome, Err(StorageError::Armed)) {
            self.unkept = None;
            self.report(outcome, "transmitter kept").await;
        }
    }
}

/// Where the terminal is.
struct Screen(UsbSerialJtagTx<'static, Async>);

impl Screen {
    /// Shows a text. Without a terminal it is lost.
    async fn show(&mut self, text: &str) {
        if !text.is_empty() {
            let _ = self.offer(text, PATIENCE).await;
        }
    }

    /// Shows a text to a terminal that takes it in this time.
    async fn offer(&mut self, text: &str, patience: Duration) -> Result<(), Refused> {
        match with_timeout(patience, self.0.write_all(text.as_bytes())).await {
            Ok(Ok(())) => Ok(()),
            _ => Err(Refused),
        }
    }
}
