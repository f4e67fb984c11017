//! The console on USB: a terminal at one end, [`stampfly_board::console`] at the other. Also stores what was asked for
//! here or by the radio.

use crate::clock::Clock;
use crate::facts::Facts;
#[cfg(feature = "hil")]
use crate::hil;
use crate::memory::{Memory, restart};
use crate::radio::MADE;
use crate::sensors::Healths;
use crate::storage::{Storage, StorageError};
use alloc::boxed::Box;
use core::cell::RefCell;
use core::fmt::{Display, Write as _};
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Ticker, with_timeout};
use embedded_io_async::{Read, Write};
use esp_hal::Async;
use esp_hal::peripherals::USB_DEVICE;
use esp_hal::usb::usb_serial_jtag::{UsbSerialJtag, UsbSerialJtagTx};
use heapless::String;
use stampfly_board::console::{self, Command, Profile};
use stampfly_board::golden::Outcome;
use stampfly_board::{VehicleConfig, black_box, topics};
use stampfly_drivers::Timebase;
use stampfly_flight::black_box::{DumpError, Refused, dump};
use stampfly_flight::console::{LineEditor, Piece, Request, SensorLine, answer};
#[cfg(feature = "hil")]
use stampfly_flight::hil::COMMAND;
use stampfly_link::Address;
use stampfly_link::secure::Key;

const PROMPT: &str = "> ";
/// Replies are made and sent in pieces of this many bytes. Only lists are longer.
const PIECE: usize = 2048;
/// A terminal that takes nothing for this long is none.
const PATIENCE: Duration = Duration::from_millis(200);
/// A terminal in the middle of a log is one, and may be busy.
const PATIENCE_WITH_LOG: Duration = Duration::from_secs(3);
/// How often the console looks for a transmitter that was paired and is not stored yet.
const STORE_PERIOD: Duration = Duration::from_secs(1);

/// What the console needs.
pub struct Parts {
    pub usb: USB_DEVICE<'static>,
    pub memory: &'static RefCell<Memory>,
    pub health: &'static Healths,
    pub profile: &'static Profile,
    pub ends: topics::ConsoleEnds<'static>,
    pub storage: Storage,
    pub storage_ends: topics::StorageEnds<'static>,
    /// The configuration the vehicle flies with.
    pub config: VehicleConfig,
    /// How the self test went.
    pub tested: Outcome,
    /// What the board says of itself.
    pub facts: Facts,
    /// The vehicle's key, if it has one yet.
    pub key: Option<Key>,
}

/// Answers until power-off.
#[embassy_executor::task]
pub async fn run(parts: Box<Parts>) {
    let Parts { usb, memory, health, profile, ends, storage, storage_ends, config, tested, facts, key } = *parts;
    let (mut keys, screen) = UsbSerialJtag::new(usb).into_async().split();
    let mut version = String::new();
    // A version that is too long ends early.
    let _ = write!(version, concat!("stampfly-esp32s3 ", env!("CARGO_PKG_VERSION"), ", {}"), tested);
    let (flown, screen) = (config.clone(), Screen(screen));
    let mut console = Console {
        screen,
        memory,
        health,
        profile,
        ends,
        storage,
        storage_ends,
        config,
        flown,
        version,
        facts,
        unstored: None,
        key,
        unstored_key: None,
    };
    let mut editor = LineEditor::<80>::new();
    let mut typed = [0; 64];
    let mut ticker = Ticker::every(STORE_PERIOD);
    loop {
        let count = match select(keys.read(&mut typed), ticker.next()).await {
            Either::First(count) => count.unwrap_or_default(),
            Either::Second(()) => {
                console.store_peer().await;
                console.store_key().await;
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

fn newest_mode(memory: &RefCell<Memory>) -> Option<stampfly_types::messages::FlightStatus> {
    let mut memory = memory.borrow_mut();
    memory.catch_up();
    memory.mode()
}

struct Console {
    screen: Screen,
    memory: &'static RefCell<Memory>,
    health: &'static Healths,
    profile: &'static Profile,
    ends: topics::ConsoleEnds<'static>,
    storage: Storage,
    storage_ends: topics::StorageEnds<'static>,
    /// What the vehicle flies with after the next start.
    config: VehicleConfig,
    /// What it has flown with since the last.
    flown: VehicleConfig,
    /// Which firmware this is, and how its self test went.
    version: String<128>,
    facts: Facts,
    /// A transmitter that was paired and is still to be stored.
    unstored: Option<Address>,
    /// The vehicle's key, once it is stored.
    key: Option<Key>,
    /// One that was made and is still to be stored.
    unstored_key: Option<Key>,
}

impl Console {
    async fn obey(&mut self, line: &str) {
        let mut piece = Piece::default();
        let mut sent = 0;
        // An error is the end of the piece. Longer replies than one only show something: those lines are answered again.
        let request = self.answer(line, &mut piece).unwrap_or(Request::Nothing);
        while self.screen.offer(piece.bytes(), PATIENCE).await.is_ok() && piece.is_cut() {
            sent += piece.bytes().len();
            piece.start_at(sent);
            let _ = self.answer(line, &mut piece);
        }
        let memory = self.memory;
        let mode = || newest_mode(memory);
        let busy = &mut self.storage_ends.storage_busy;
        match request {
            Request::Nothing => {}
            Request::SaveParameters => {
                let outcome = self.storage.save(&self.config, busy, mode).await;
                self.report(outcome, "saved; they apply after a reboot").await;
            }
            Request::ResetParameters => {
                let outcome = self.storage.reset(busy, mode).await;
                self.unstored = self.unstored.filter(|_| outcome.is_err());
                self.key = self.key.take().filter(|_| outcome.is_err());
                self.report(outcome, "erased, transmitter and key, too; defaults and a new key apply after a reboot")
                    .await;
            }
            Request::Vehicle(Command::ShowKey) => self.show_key().await,
            Request::Vehicle(command) => {
                command.publish(Clock.now(), &mut self.ends);
                self.screen
                    .show(match command {
                        Command::Pair(true) => "looking for a transmitter\r\n",
                        Command::TestMotor { .. } => "turning for two seconds\r\n",
                        Command::Pair(false) | Command::StopMotor => "stopped\r\n",
                        // Its answer has been given.
                        Command::AcceptGains | Command::ShowKey => "",
                    })
                    .await;
            }
            Request::DumpLog => self.dump().await,
            #[cfg(feature = "hil")]
            Request::Reboot if line.trim() == COMMAND => hil::restart_into(),
            Request::Reboot => restart(),
        }
    }

    /// Shows the key to whoever has the vehicle on a cable.
    async fn show_key(&mut self) {
        let mut said = String::<128>::new();
        let _ = match &self.key {
            Some(key) => write!(said, "{}\r\n", key.uri()),
            None => write!(said, "no key is stored yet\r\n"),
        };
        self.screen.show(&said).await;
    }

    /// Stores a key that was made, as soon as that may be.
    async fn store_key(&mut self) {
        if let Some(made) = MADE.try_take() {
            self.unstored_key = Some(made);
        }
        let Some(key) = &self.unstored_key else { return };
        let memory = self.memory;
        let busy = &mut self.storage_ends.storage_busy;
        let outcome = self.storage.save_key(key, busy, || newest_mode(memory)).await;
        if !matches!(outcome, Err(StorageError::Armed)) {
            self.key = self.unstored_key.take().filter(|_| outcome.is_ok());
            self.report(outcome, "a key was made and stored: `key` shows it").await;
        }
    }

    /// Answers a line with what is known now.
    fn answer(&mut self, line: &str, reply: &mut Piece<PIECE>) -> Result<Request<Command>, core::fmt::Error> {
        let sensors = self.health.all();
        let errors = sensors.map(|(_, health)| health.last_error());
        let lines: [SensorLine<'_>; 7] = core::array::from_fn(|index| {
            let (name, health) = sensors[index];
            let last_error = errors[index].as_ref().map(|error| error as &dyn Display);
            SensorLine { name, samples: health.samples(), errors: health.errors(), last_error }
        });
        let mut memory = self.memory.borrow_mut();
        memory.catch_up();
        let mut vehicle = console::Console {
            version: &self.version,
            newest: &memory.newest,
            sensors: &lines,
            profile: self.profile,
            facts: &self.facts.all(),
            config: &mut self.config,
        };
        answer(line, Clock.now(), &mut vehicle, reply)
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
        let show = async |line: &str| screen.offer(line.as_bytes(), PATIENCE_WITH_LOG).await;
        let dumped = dump(next, |sink, at| black_box::open(sink, at, flown, version), show).await;
        if let Err(error) = dumped {
            self.report(Err::<(), DumpError>(error), "").await;
        }
    }

    /// Stores a transmitter that the vehicle was paired with. Nothing is stored on an armed vehicle; then it is for later.
    async fn store_peer(&mut self) {
        if self.storage_ends.link_peer.has_new()
            && let Some(peer) = self.storage_ends.link_peer.latest()
        {
            let peer = Address::from(peer.data);
            let mut said = String::<96>::new();
            let _ = write!(said, "paired with {peer}\r\n");
            self.screen.show(&said).await;
            self.unstored = Some(peer);
        }
        let Some(peer) = self.unstored else { return };
        let memory = self.memory;
        let busy = &mut self.storage_ends.storage_busy;
        let outcome = self.storage.save_peer(peer, busy, || newest_mode(memory)).await;
        if !matches!(outcome, Err(StorageError::Armed)) {
            self.unstored = None;
            self.report(outcome, "transmitter stored").await;
        }
    }
}

/// Where the terminal is.
struct Screen(UsbSerialJtagTx<'static, Async>);

impl Screen {
    /// Shows a text. Without a terminal it is lost.
    async fn show(&mut self, text: &str) {
        if !text.is_empty() {
            let _ = self.offer(text.as_bytes(), PATIENCE).await;
        }
    }

    /// Shows a text to a terminal that takes it in this time.
    async fn offer(&mut self, text: &[u8], patience: Duration) -> Result<(), Refused> {
        match with_timeout(patience, self.0.write_all(text)).await {
            Ok(Ok(())) => Ok(()),
            _ => Err(Refused),
        }
    }
}
