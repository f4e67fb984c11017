//! The vehicle in a network: joins an access point on the pilot's channel while disarmed, and moves packets between the radio and a [`Stack`].
//!
//! With the feature `wifi`. Everything is on the radio's core, and everything but moving the bytes is `stampfly_services`': when to join is [`Association`]'s
//! decision, what is spoken at the ports is [`Ports`]'. MAVLink's turn is the console's, because it has what services need of a vehicle; sealed frames go to the
//! radio's link, wherever they come from.

use crate::channel::CHANNEL;
use crate::clock::Clock;
use crate::memory::Memory;
use core::cell::RefCell;
use core::net::Ipv4Addr;
use embassy_futures::select::select;
use embassy_time::{Duration, Ticker, with_timeout};
use esp_hal::efuse::{InterfaceMacAddress, interface_mac_address};
use esp_radio::esp_now::EspNowManager;
use esp_radio::wifi::scan::ScanConfig;
use esp_radio::wifi::sta::StationConfig;
use esp_radio::wifi::{
    AuthenticationMethodConfig, Config, ControllerConfig, Interface, WifiController, WifiRxToken, WifiTxToken,
};
use smoltcp::phy::{Device, DeviceCapabilities, Medium, RxToken, TxToken};
use stampfly_board::link::Link;
use stampfly_drivers::Timebase;
use stampfly_link::Address;
use stampfly_link::secure::MAX_FRAME;
use stampfly_services::association::{Association, Credentials, Event, State, Step};
use stampfly_services::network::{self, Door, Routes, Stack};
use stampfly_services::{CommandArbiter, RadioRequests};
use stampfly_types::Instant;
use static_cell::{ConstStaticCell, StaticCell};

/// Items of a mission that is uploaded here.
pub const ITEMS: usize = 16;
/// What is spoken at the ports.
pub type Ports = network::Ports<ITEMS>;
/// Between two looks at the radio's packets.
const TURN: Duration = Duration::from_millis(10);
/// Between two looks at how the association is.
const LOOK: Duration = Duration::from_millis(100);
/// The radio's libraries say by then that they have left.
const LEFT: Duration = Duration::from_secs(2);
/// The longest packet with its header: more than anything that is said here. The radio's layer has room for 1492.
const LONGEST: usize = 700;

/// The network, as the radio's task and the console's share it.
pub struct Network {
    /// As soon as the radio is on.
    pub stack: Option<Stack>,
    pub routes: Routes,
    association: Association,
    known: Option<Credentials>,
    /// Strength of the access point's signal, dBm.
    signal: i32,
}

impl Network {
    /// What is known of it at the start. Once only.
    pub fn new(known: Option<Credentials>) -> &'static RefCell<Self> {
        static NETWORK: StaticCell<RefCell<Network>> = StaticCell::new();
        NETWORK.init_with(|| {
            let association = Association::new(CHANNEL, known.is_some());
            RefCell::new(Self { stack: None, routes: Routes::new(), association, known, signal: 0 })
        })
    }

    /// Another network, or none, from now on.
    pub fn want(&mut self, known: Option<Credentials>) {
        self.association.want(known.is_some());
        self.known = known;
    }

    /// Is the vehicle to have ports?
    pub fn is_wanted(&self) -> bool {
        self.known.is_some()
    }

    /// How it is, for whoever asks at the cable: name, state, signal, address. Never the pass-phrase.
    pub fn show(&self) -> Shown<'_> {
        let address = self.stack.as_ref().and_then(Stack::address).filter(|_| self.association.is_joined());
        Shown { known: self.known.as_ref(), state: self.association.state(), signal: self.signal, address }
    }

    /// Is that the address of a station in the network?
    pub fn knows(&self, station: Address) -> bool {
        self.routes.place(station).is_some()
    }

    /// Sends a frame of the secure link, if it is for somebody in the network. `false`: it is for the radio.
    pub fn send_sealed(&mut self, to: Address, frame: &[u8]) -> bool {
        let Self { stack: Some(stack), routes, .. } = self else { return false };
        Ports::send_sealed(Clock.now(), stack, routes, to, frame)
    }
}

/// How the network is.
pub struct Shown<'n> {
    known: Option<&'n Credentials>,
    state: State,
    signal: i32,
    address: Option<Ipv4Addr>,
}

impl core::fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { known, state, signal, address } = self;
        match known {
            None => return write!(f, "{state}"),
            Some(known) => write!(f, "{}: {state}", known.name())?,
        }
        if matches!(state, State::Joined(_)) {
            write!(f, ", {signal} dBm")?;
        }
        match address {
            Some(address) => write!(f, ", {address}"),
            None => f.write_str(", no address"),
        }
    }
}

/// What the radio is told at its start. Its own settings are made for downloads: two dozen packets of 1.6 kB at once.
pub fn config(config: ControllerConfig) -> ControllerConfig {
    config
        .with_static_rx_buf_num(4)
        .with_dynamic_rx_buf_num(8)
        .with_dynamic_tx_buf_num(8)
        .with_ampdu_rx_enable(false)
        .with_ampdu_tx_enable(false)
}

/// The radio's packets.
pub struct Air(Interface);

pub struct In(WifiRxToken);

pub struct Out(WifiTxToken);

impl RxToken for In {
    fn consume<R, F: FnOnce(&[u8]) -> R>(self, take: F) -> R {
        self.0.consume_token(|bytes| take(bytes))
    }
}

impl TxToken for Out {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, length: usize, fill: F) -> R {
        self.0.consume_token(length, fill)
    }
}

impl Device for Air {
    type RxToken<'a> = In;
    type TxToken<'a> = Out;

    fn receive(&mut self, _: smoltcp::time::Instant) -> Option<(In, Out)> {
        self.0.receive().map(|(received, sent)| (In(received), Out(sent)))
    }

    fn transmit(&mut self, _: smoltcp::time::Instant) -> Option<Out> {
        self.0.transmit().map(Out)
    }

    fn capabilities(&self) -> DeviceCapabilities {
        let mut capabilities = DeviceCapabilities::default();
        capabilities.max_transmission_unit = LONGEST;
        capabilities.medium = Medium::Ethernet;
        capabilities
    }
}

/// The radio's link and desk, as the network sees them.
struct Behind {
    link: &'static RefCell<Link<'static>>,
    arbiter: &'static RefCell<CommandArbiter>,
    requests: &'static RefCell<RadioRequests>,
}

impl Door for Behind {
    fn station(&self) -> Option<Address> {
        self.link.borrow().guarded.station()
    }

    fn take(&mut self, now: Instant, source: Address, frame: &mut [u8]) {
        let (mut link, mut arbiter) = (self.link.borrow_mut(), self.arbiter.borrow_mut());
        if let Ok(Some(received)) = link.receive_sealed(&mut arbiter, now, source, frame) {
            // A station asks again for what there is no room for.
            let _ = self.requests.borrow_mut().ask(now, &received.payload);
        }
    }

    fn offer<'r>(&self, room: &'r mut [u8; MAX_FRAME]) -> Option<&'r [u8]> {
        self.link.borrow().guarded.announcement(room)
    }
}

/// Makes the stack. Apart: it is made on the stack of the task.
#[inline(never)]
pub fn start(network: &RefCell<Network>, seed: u64) -> Air {
    static MEMORY: ConstStaticCell<network::Memory> = ConstStaticCell::new(network::Memory::new());
    let mut air = Air(Interface::station());
    let mut hardware = [0; 6];
    hardware.copy_from_slice(interface_mac_address(InterfaceMacAddress::Station).as_bytes());
    network.borrow_mut().stack = Some(Stack::new(MEMORY.take(), &mut air, hardware, seed, Clock.now()));
    air
}

/// Moves packets, and hands sealed frames over, until power-off.
pub async fn carry(
    mut air: Air,
    network: &RefCell<Network>,
    (link, arbiter): (&'static RefCell<Link<'static>>, &'static RefCell<CommandArbiter>),
    requests: &'static RefCell<RadioRequests>,
) {
    let mut ticker = Ticker::every(TURN);
    let mut door = Behind { link, arbiter, requests };
    loop {
        ticker.next().await;
        turn(&mut air, &mut network.borrow_mut(), &mut door);
    }
}

// A packet is made on the stack.
#[inline(never)]
fn turn(air: &mut Air, network: &mut Network, door: &mut Behind) {
    let now = Clock.now();
    let Network { stack: Some(stack), routes, association, .. } = network else { return };
    stack.poll(now, air, association.is_joined());
    if association.is_joined() {
        Ports::open(now, stack, routes, door);
    } else {
        routes.clear();
    }
}

/// Joins and leaves, as the association decides, until power-off.
pub async fn associate(
    mut controller: WifiController<'static>,
    manager: &EspNowManager,
    network: &RefCell<Network>,
    memory: &'static RefCell<Memory>,
) {
    let mut ticker = Ticker::every(LOOK);
    loop {
        ticker.next().await;
        look(&controller, network);
        match next(network, memory) {
            Some(Step::Join) => {
                // Armed meanwhile, or too slow: the attempt is dropped, and the next step is to leave.
                let joined = select(join(&mut controller, manager, network), given_up(network, memory)).await;
                if matches!(joined, embassy_futures::select::Either::Second(())) {
                    leave(&mut controller, manager, network).await;
                }
            }
            Some(Step::Leave) => leave(&mut controller, manager, network).await,
            None => {}
        }
    }
}

/// What the association wants. A vehicle nobody knows to be disarmed counts as armed.
fn next(network: &RefCell<Network>, memory: &RefCell<Memory>) -> Option<Step> {
    let armed = memory.borrow().mode().is_none_or(|mode| mode.armed);
    network.borrow_mut().association.poll(Clock.now(), armed)
}

fn note(network: &RefCell<Network>, event: Event) {
    network.borrow_mut().association.note(Clock.now(), event);
}

/// What has become of a network that was joined.
fn look(controller: &WifiController<'static>, network: &RefCell<Network>) {
    if !network.borrow().association.is_joined() {
        return;
    }
    match controller.channel().ok().filter(|_| controller.is_connected()) {
        Some((channel, _)) => note(network, Event::Channel(channel)),
        // Lost. It is left, too, so that the radio is on the pilot's channel again.
        None => note(network, Event::Channel(0)),
    }
    if let Ok(signal) = controller.rssi() {
        network.borrow_mut().signal = signal;
    }
}

/// Returns when an attempt to join is to end.
async fn given_up(network: &RefCell<Network>, memory: &RefCell<Memory>) {
    let mut ticker = Ticker::every(LOOK);
    loop {
        ticker.next().await;
        if next(network, memory) == Some(Step::Leave) {
            return;
        }
    }
}

/// Tries to join, on the pilot's channel.
async fn join(controller: &mut WifiController<'static>, manager: &EspNowManager, network: &RefCell<Network>) {
    let known = network.borrow().known.clone();
    let joined = match known {
        Some(known) => try_to_join(controller, &known).await,
        None => None,
    };
    if joined.is_none() {
        let _ = manager.set_channel(CHANNEL);
    }
    note(network, joined.map_or(Event::Away, Event::Joined));
}

async fn try_to_join(controller: &mut WifiController<'static>, known: &Credentials) -> Option<u8> {
    // To join with a channel means to begin there, and to look at all others behind it. So it is looked for first, on this one alone.
    let scan = ScanConfig::default().with_ssid(known.name().try_into().ok()?).with_channel(CHANNEL).with_max(1);
    let found = controller.scan_async(&scan).await.ok()?;
    let found = found.first().filter(|found| found.channel == CHANNEL)?;
    let station = StationConfig::default()
        .with_ssid(known.name().try_into().ok()?)
        .with_bssid(found.bssid)
        .with_channel(CHANNEL)
        .with_authentication(AuthenticationMethodConfig::Wpa2Personal(known.passphrase().try_into().ok()?));
    controller.set_config(&Config::Station(station)).ok()?;
    controller.connect_async().await.ok().map(|joined| joined.channel)
}

/// Leaves, and goes back to the pilot's channel.
async fn leave(controller: &mut WifiController<'static>, manager: &EspNowManager, network: &RefCell<Network>) {
    let _ = with_timeout(LEFT, controller.disconnect_async()).await;
    let _ = manager.set_channel(CHANNEL);
    note(network, Event::Away);
}
