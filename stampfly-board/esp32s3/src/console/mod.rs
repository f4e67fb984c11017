//! The vehicle's USB port: a terminal, MAVLink and a ground station on one line ([`Cable`]), [`stampfly_board::console`] behind it. Also answers what a station
//! asks by radio, and stores what was asked for here or there.

mod known;
#[cfg(feature = "wifi")]
mod network;
mod screen;
#[cfg(feature = "wifi")]
mod served;
mod stations;
mod storing;

use crate::actions::{Later, VehicleActions};
use crate::clock::Clock;
use crate::facts::Facts;
#[cfg(feature = "hil")]
use crate::hil;
use crate::memory::{Memory, restart};
use crate::record::{Line, NAME, Taken};
use crate::sensors::Healths;
use crate::storage::Storage;
use alloc::boxed::Box;
use core::cell::RefCell;
use core::fmt::{Display, Write as _};
use core::mem::MaybeUninit;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Ticker};
use embedded_io_async::Read;
use esp_hal::Async;
use esp_hal::peripherals::USB_DEVICE;
use esp_hal::usb::usb_serial_jtag::{UsbSerialJtag, UsbSerialJtagRx, UsbSerialJtagTx};
use heapless::{String, Vec};
use known::Known;
use screen::{PATIENCE, PATIENCE_WITH_LOG, Screen};
use stampfly_board::console::{Command, Profile};
use stampfly_board::golden::Outcome;
use stampfly_board::link::Link;
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::{Id, TOPICS};
use stampfly_board::{VERSION, VehicleConfig, topics};
use stampfly_drivers::Timebase;
use stampfly_flight::black_box::{DumpError, dump, open};
use stampfly_flight::console::calibrate::{self, News};
use stampfly_flight::console::{LineEditor, Piece, Request, answer};
#[cfg(feature = "hil")]
use stampfly_flight::hil::COMMAND;
use stampfly_link::Address;
use stampfly_link::mavlink::dialects::common::MavType;
use stampfly_link::secure::Key;
use stampfly_param::ChangeDetector;
use stampfly_services::cable::{Cable, fingerprint};
use stampfly_services::mavlink::Identity;
use stampfly_services::{ArbitratedAccess, CommandArbiter, Places, RadioRequests, View};
use stampfly_types::messages::CalibrationReport;
use static_cell::StaticCell;

const PROMPT: &str = "> ";
/// Bytes of a line: a network's name and pass-phrase are the longest.
const LINE: usize = if cfg!(feature = "wifi") { 112 } else { 80 };
/// Replies are made and sent in pieces of this many bytes. Only lists are longer.
const PIECE: usize = 2048;
/// How often what is due is sent.
const TURN: Duration = Duration::from_millis(10);
/// And how many turns later the console looks for a transmitter that was paired and is not stored yet: a second.
const STORE: u32 = 100;
/// Bytes of frames that are made at once: what MAVLink's streams, parameters and a station's topics have in a turn. What finds no
/// room is not sent; the next is newer.
const FRAMES: usize = 2048;
/// Items of a mission: memory is taken for two missions.
const ITEMS: usize = 16;
/// What the vehicle is in MAVLink.
const IDENTITY: Identity = Identity {
    system: 1,
    kind: MavType::MAV_TYPE_QUADROTOR,
    take_off_height: 0.5,
    reach: 0.25,
    version: stampfly_services::version(VERSION),
};

/// What the console needs.
pub struct Parts {
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
    pub link: &'static RefCell<Link<'static>>,
    pub arbiter: &'static RefCell<CommandArbiter>,
    /// What a station with the key asks by radio.
    pub requests: &'static RefCell<RadioRequests>,
    /// The flight record.
    pub taken: &'static RefCell<Taken>,
    /// The network, and the time up to which signatures are reserved.
    #[cfg(feature = "wifi")]
    pub network: (&'static RefCell<crate::wifi::Network>, Option<u64>),
}

/// Keys from the USB port.
pub type Keys = UsbSerialJtagRx<'static, Async>;

/// Answers until power-off.
#[embassy_executor::task]
pub async fn run(console: &'static mut Console, mut keys: Keys) {
    let mut editor = LineEditor::<LINE>::new();
    let mut typed = [0; 64];
    let mut ticker = Ticker::every(TURN);
    let mut turns: u32 = 0;
    loop {
        let count = match select(keys.read(&mut typed), ticker.next()).await {
            Either::First(count) => count.unwrap_or_default(),
            Either::Second(()) => {
                turns = turns.wrapping_add(1);
                if turns.is_multiple_of(STORE) {
                    console.store_peer().await;
                    console.store_key().await;
                    #[cfg(feature = "wifi")]
                    console.open_ports().await;
                }
                0
            }
        };
        let mut text = Vec::<u8, 64>::new();
        console.turn(typed.get(..count).unwrap_or_default(), &mut text);
        console.send_frames().await;
        #[cfg(feature = "wifi")]
        console.serve();
        for byte in text {
            let mut echo = String::<256>::new();
            let line: Option<String<LINE>> =
                editor.feed(byte, &mut echo).map(|line| String::try_from(line).unwrap_or_default());
            console.screen.show(&echo).await;
            if let Some(line) = line {
                if console.obey(&line).await == Wanted::Log {
                    console.dump().await;
                }
                console.screen.show(PROMPT).await;
            }
        }
        console.answer_stations().await;
        console.tell().await;
        console.tell_changes();
        console.send_record().await;
    }
}

/// Makes the console, before anything runs: whoever waits for it would keep its parts on the stack.
pub fn assemble(usb: USB_DEVICE<'static>, parts: Box<Parts>) -> (&'static mut Console, Keys) {
    static CONSOLE: StaticCell<Console> = StaticCell::new();
    let (keys, screen) = UsbSerialJtag::new(usb).into_async().split();
    let version = version(&parts.tested);
    (place(CONSOLE.uninit(), parts, screen, version), keys)
}

/// Which firmware this is. Apart: formatting takes stack that has a whole console on it otherwise.
#[inline(never)]
fn version(tested: &Outcome) -> String<128> {
    let mut version = String::new();
    // One that is too long ends early.
    let _ = write!(version, "stampfly-esp32s3 {VERSION}, {tested}");
    version
}

// Two functions: what the one returns is made where the other is told to.
#[inline(never)]
fn place(
    slot: &'static mut MaybeUninit<Console>,
    parts: Box<Parts>,
    screen: UsbSerialJtagTx<'static, Async>,
    version: String<128>,
) -> &'static mut Console {
    slot.write(made(parts, screen, version))
}

#[inline(never)]
fn made(parts: Box<Parts>, screen: UsbSerialJtagTx<'static, Async>, version: String<128>) -> Console {
    #[cfg(feature = "wifi")]
    let network = served::Served::new(parts.network);
    let Parts {
        memory,
        health,
        profile,
        ends,
        storage,
        storage_ends,
        config,
        facts,
        key,
        link,
        arbiter,
        requests,
        taken,
        ..
    } = *parts;
    let (detector, flown) = (ChangeDetector::new(config.clone()), (config.clone(), false));
    let cable = Cable::new(IDENTITY, fingerprint(&TOPICS, &config));
    Console {
        screen: Screen(screen),
        known: Known { memory, health, profile, version, facts },
        ends,
        storage,
        storage_ends,
        config,
        detector,
        flown,
        unstored: None,
        key,
        unstored_key: None,
        link,
        requests,
        taken,
        cable,
        arbiter,
        places: Places::of(&TOPICS),
        later: None,
        news: News::default(),
        frames: Vec::new(),
        #[cfg(feature = "wifi")]
        network,
    }
}

fn newest_mode(memory: &RefCell<Memory>) -> Option<stampfly_types::messages::FlightStatus> {
    let mut memory = memory.borrow_mut();
    memory.catch_up();
    memory.mode()
}

/// A text, as far as there is room for it.
fn text(what: &dyn Display) -> String<128> {
    let mut text = String::new();
    let _ = write!(text, "{what}");
    text
}

/// What came of something.
fn said<E: Display>(outcome: Result<(), E>, good: &str) -> String<128> {
    match outcome {
        Ok(()) => text(&good),
        Err(error) => text(&error),
    }
}

/// A terminal, MAVLink and a station on one line.
pub struct Console {
    screen: Screen,
    known: Known,
    ends: topics::ConsoleEnds<'static>,
    storage: Storage,
    storage_ends: topics::StorageEnds<'static>,
    /// What the vehicle flies with after the next start.
    config: VehicleConfig,
    /// Finds what has changed in it. The vehicle flies with its last one as soon as it is disarmed.
    detector: ChangeDetector<VehicleConfig>,
    /// What the last flight was flown with, and whether that goes on.
    flown: (VehicleConfig, bool),
    /// A transmitter that was paired and is still to be stored.
    unstored: Option<Address>,
    /// The vehicle's key, once it is stored.
    key: Option<Key>,
    /// One that was made and is still to be stored.
    unstored_key: Option<Key>,
    link: &'static RefCell<Link<'static>>,
    /// Questions of the station on the radio.
    requests: &'static RefCell<RadioRequests>,
    /// The flight record.
    taken: &'static RefCell<Taken>,
    /// Everything that is spoken on the line.
    cable: Cable<{ TOPICS.len() }, ITEMS>,
    /// Who commands, here and by radio.
    arbiter: &'static RefCell<CommandArbiter>,
    places: Places,
    /// What a service has asked for.
    later: Option<Later>,
    /// What of a calibration was told.
    news: News,
    /// Frames that are to be sent.
    frames: Vec<u8, FRAMES>,
    /// Programs in the network.
    #[cfg(feature = "wifi")]
    network: served::Served,
}

/// What a line has asked for that takes memory of its own.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wanted {
    Nothing,
    /// The black box.
    Log,
}

/// Adds a frame, if there is room for all of it.
fn put(frames: &mut Vec<u8, FRAMES>, frame: &[u8]) {
    let _ = frames.extend_from_slice(frame);
}

impl Console {
    /// Takes what has come, and makes the frames that are due. `text` is given what a person has typed.
    fn turn(&mut self, bytes: &[u8], text: &mut Vec<u8, 64>) {
        let Self { known, link, ends, config, later, cable, arbiter, places, frames, .. } = self;
        let now = Clock.now();
        let mut memory = known.memory.borrow_mut();
        memory.catch_up();
        let view = View::new(&memory.newest, places);
        let actions = &mut VehicleActions { link, ends, config, later };
        let mut arbiter = arbiter.borrow_mut();
        arbiter.poll(now, view.state().armed, actions);
        let mut access = ArbitratedAccess { arbiter: &mut arbiter, actions, view };
        let mut send = |frame: &[u8]| put(frames, frame);
        cable.hear(now, bytes, &mut access, &mut send, &mut |key| {
            let _ = text.push(key);
        });
        if bytes.is_empty() {
            cable.poll(now, &mut access, &memory.newest, &mut send);
        }
    }

    /// Sends the frames that were made. Without anybody at the other end they are lost.
    async fn send_frames(&mut self) {
        let Self { screen, frames, taken, .. } = self;
        if !frames.is_empty() {
            if screen.offer(frames, PATIENCE).await.is_err() {
                // The flight record is for whoever asks next.
                taken.borrow_mut().ask(Clock.now(), Line::Cable, Some(false));
            }
            frames.clear();
        }
    }

    /// Tells how far a calibration is, when there is something new to tell: whoever has both hands full need not ask.
    async fn tell(&mut self) {
        let newest = {
            let mut memory = self.known.memory.borrow_mut();
            memory.catch_up();
            memory.newest.get::<CalibrationReport>(Id::calibration_report as usize)
        };
        let Some((_, report)) = newest.filter(|(_, report)| self.news.is_new(report)) else { return };
        let mut told = String::<320>::new();
        // What is too long is cut.
        let _ = calibrate::report(&mut told, &report);
        self.screen.show(&told).await;
    }

    /// Answers a line. Returns what is to be done when the room for the answer is free again.
    async fn obey(&mut self, line: &str) -> Wanted {
        #[cfg(feature = "wifi")]
        if self.obey_wish(line).await {
            return Wanted::Nothing;
        }
        let mut piece = Piece::default();
        let mut sent = 0;
        // An error is the end of the piece. Longer replies than one only show something: those lines are answered again.
        let request = self.answer(line, &mut piece).unwrap_or(Request::Nothing);
        while self.screen.offer(piece.bytes(), PATIENCE).await.is_ok() && piece.is_cut() {
            sent += piece.bytes().len();
            piece.start_at(sent);
            let _ = self.answer(line, &mut piece);
        }
        match request {
            Request::Nothing => {}
            Request::DumpLog => return Wanted::Log,
            #[cfg(feature = "hil")]
            Request::Reboot if line.trim() == COMMAND => hil::restart_into(),
            request => {
                let said = self.carry_out(request, true).await;
                if !said.is_empty() {
                    self.screen.show(&said).await;
                    self.screen.show("\r\n").await;
                }
            }
        }
        Wanted::Nothing
    }

    /// Does what only a board can do, for somebody at the USB port or for a station on the radio. Returns what came of it.
    async fn carry_out(&mut self, request: Request<Command>, at_cable: bool) -> String<128> {
        let memory = self.known.memory;
        let mode = || newest_mode(memory);
        let busy = &mut self.storage_ends.storage_busy;
        match request {
            Request::Nothing => String::new(),
            Request::SaveParameters => {
                let outcome = self.storage.save(&self.config, busy, mode).await;
                said(outcome, "saved")
            }
            Request::ResetParameters => {
                let outcome = self.storage.reset(busy, mode).await;
                #[cfg(feature = "wifi")]
                self.network.forget(outcome.is_ok());
                self.unstored = self.unstored.filter(|_| outcome.is_err());
                self.key = self.key.take().filter(|_| outcome.is_err());
                said(outcome, "erased, transmitter and key, too; defaults and a new key apply after a reboot")
            }
            Request::Vehicle(Command::ShowKey) if at_cable => self.key(),
            Request::Vehicle(command) => {
                command.publish(Clock.now(), &mut self.ends);
                text(&match command {
                    Command::Pair(true) => "looking for a transmitter",
                    Command::TestMotor { .. } => "turning for two seconds",
                    Command::Pair(false) | Command::StopMotor => "stopped",
                    Command::ShowKey => "at the USB port alone",
                    // Their answers have been given.
                    Command::AcceptGains | Command::Calibrate(_) => "",
                })
            }
            Request::DumpLog => text(&"in a terminal at the USB port alone"),
            Request::Reboot => restart(),
        }
    }

    /// The key, for whoever has the vehicle on a cable.
    fn key(&self) -> String<128> {
        match &self.key {
            Some(key) => text(&key.uri()),
            None => text(&"no key is stored yet"),
        }
    }

    /// Answers a line with what is known now.
    fn answer(&mut self, line: &str, reply: &mut Piece<PIECE>) -> Result<Request<Command>, core::fmt::Error> {
        self.known.vehicle(&mut self.config, |vehicle| answer(line, Clock.now(), vehicle, reply))
    }

    async fn report<E: Display>(&mut self, outcome: Result<(), E>, good: &str) {
        self.screen.show(&said(outcome, good)).await;
        self.screen.show("\r\n").await;
    }

    /// Sends the black box as a log in hexadecimal, a format that survives every terminal.
    async fn dump(&mut self) {
        let Self { screen, known: Known { memory, version, .. }, flown: (flown, _), .. } = self;
        let mut cursor = memory.borrow().black_box.begin();
        // Borrowed for one record at a time, so that nothing is while the terminal takes its time.
        let next = || memory.borrow().black_box.next(&mut cursor);
        let show = async |line: &str| screen.offer(line.as_bytes(), PATIENCE_WITH_LOG).await;
        let dumped = dump(next, |sink, at| open::<Runnables, _>(sink, at, NAME, &*flown, version), show).await;
        if let Err(error) = dumped {
            self.report(Err::<(), DumpError>(error), "").await;
        }
    }
}
