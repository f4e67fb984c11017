//! The pilot's radio: moves the bytes between ESP-NOW and [`Link`], which knows what they mean.
//!
//! A vehicle without a key makes one as soon as its radio is on, for only then the chip's random numbers are random, and hands
//! it to the console's task to be stored. From then on it is offered to stations with that key.
//!
//! Receiving and sending do not wait for each other: a packet that the air does not take must not keep the pilot's next
//! one from being received.

use crate::clock::Clock;
use crate::storage::KEY_ID;
use alloc::boxed::Box;
use core::cell::RefCell;
use embassy_futures::join::join;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Ticker};
use esp_hal::efuse::{InterfaceMacAddress, interface_mac_address};
use esp_hal::peripherals::WIFI;
use esp_hal::rng::Trng;
use esp_radio::esp_now::{EspNowManager, EspNowReceiver, EspNowSender, EspNowWifiInterface, PeerInfo};
use esp_radio::wifi::{ControllerConfig, WifiController};
use stampfly_board::link::{self, Link, Outgoing};
use stampfly_board::topics;
use stampfly_drivers::Timebase;
use stampfly_link::secure::{Guarded, Key, MAX_FRAME, Policy, Vehicle};
use stampfly_link::{Address, Session};

/// The channel the vehicle listens on.
const CHANNEL: u8 = 1;

/// A key that was made and is to be stored.
pub static MADE: Signal<CriticalSectionRawMutex, Key> = Signal::new();

/// What the radio needs.
pub struct Parts {
    pub unit: WIFI<'static>,
    /// The transmitter the vehicle is paired with.
    pub peer: Option<Address>,
    /// The vehicle's key, if it has one yet.
    pub key: Option<Key>,
    /// What may be used of what authenticates nobody.
    pub policy: Policy,
    pub ends: topics::LinkEnds<'static>,
}

/// Receives and sends until power-off.
#[embassy_executor::task]
pub async fn run(parts: Box<Parts>) {
    let Parts { unit, peer, key, policy, ends } = *parts;
    // A station without an access point would sleep between packets and miss the pilot's.
    let config = ControllerConfig::default().with_sta_disconnected_pm(false);
    let controller = WifiController::new(unit, config).expect("the radio starts");
    let random = Trng::try_new().expect("its radio is on");
    let (manager, sender, receiver) = controller.esp_now().split();
    manager.set_channel(CHANNEL).expect("a channel there is");
    let mut vehicle = Address::default();
    vehicle.0.copy_from_slice(interface_mac_address(InterfaceMacAddress::Station).as_bytes());
    let session = Session::new(vehicle, CHANNEL, peer);
    let key = key.or_else(|| make(&random));
    let link = RefCell::new(Link::new(Guarded::new(key.map(Vehicle::new), session, policy), ends));
    join(receive(receiver, &link), send(sender, &manager, &random, &link)).await;
}

/// A new key, which is also handed on to be stored.
fn make(random: &Trng) -> Option<Key> {
    let mut bytes = [0; 32];
    random.read(&mut bytes);
    let key = Key::generate(KEY_ID, bytes).ok()?;
    MADE.signal(key.clone());
    Some(key)
}

async fn receive(mut receiver: EspNowReceiver, link: &RefCell<Link<'_>>) {
    let mut room = [0; MAX_FRAME];
    loop {
        let received = receiver.receive_async().await;
        let source = Address(received.info.src_address);
        // What is longer is no frame of anybody's. What is refused is counted there; what only services could answer is not answered.
        if let Some(frame) = room.get_mut(..received.data().len()) {
            frame.copy_from_slice(received.data());
            let _ = link.borrow_mut().receive(Clock.now(), source, frame);
        }
    }
}

async fn send(mut sender: EspNowSender, manager: &EspNowManager, random: &Trng, link: &RefCell<Link<'_>>) {
    let mut ticker = Ticker::every(Duration::from_micros(link::PERIOD.as_micros()));
    let mut room = [0; MAX_FRAME];
    loop {
        ticker.next().await;
        for what in Outgoing::ALL {
            let mut fresh = [0; 8];
            random.read(&mut fresh);
            let outgoing = link.borrow_mut().transmit(Clock.now(), what, fresh, &mut room);
            // A packet that is not taken is lost; the next one is newer anyway.
            if let Some((to, bytes)) = outgoing {
                let _ = say(&mut sender, manager, to, bytes).await;
            }
        }
    }
}

async fn say(
    sender: &mut EspNowSender,
    manager: &EspNowManager,
    to: Address,
    bytes: &[u8],
) -> Result<(), esp_radio::esp_now::EspNowError> {
    if !manager.peer_exists(&to.0) {
        manager.add_peer(PeerInfo {
            interface: EspNowWifiInterface::Station,
            peer_address: to.0,
            lmk: None,
            channel: None,
            encrypt: false,
        })?;
    }
    sender.send_async(&to.0, bytes).await
}
