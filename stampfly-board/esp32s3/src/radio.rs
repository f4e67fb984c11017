//! The pilot's radio: moves the bytes between ESP-NOW and [`Link`], which knows what they mean.
//!
//! Receiving and sending do not wait for each other: a packet that the air does not take must not keep the pilot's next
//! one from being received.

use crate::clock::Clock;
use alloc::boxed::Box;
use core::cell::RefCell;
use embassy_futures::join::join;
use embassy_time::{Duration, Ticker};
use esp_hal::efuse::{InterfaceMacAddress, interface_mac_address};
use esp_hal::peripherals::WIFI;
use esp_radio::esp_now::{EspNowManager, EspNowReceiver, EspNowSender, EspNowWifiInterface, PeerInfo};
use esp_radio::wifi::{ControllerConfig, WifiController};
use stampfly_board::link::{self, Link, Outgoing};
use stampfly_board::topics;
use stampfly_drivers::Timebase;
use stampfly_link::{Address, Session};

/// The channel the vehicle listens on.
const CHANNEL: u8 = 1;

/// What the radio needs.
pub struct Parts {
    pub unit: WIFI<'static>,
    /// The transmitter the vehicle is paired with.
    pub peer: Option<Address>,
    pub ends: topics::LinkEnds<'static>,
}

/// Receives and sends until power-off.
#[embassy_executor::task]
pub async fn run(parts: Box<Parts>) {
    let Parts { unit, peer, ends } = *parts;
    // A station without an access point would sleep between packets and miss the pilot's.
    let config = ControllerConfig::default().with_sta_disconnected_pm(false);
    let controller = WifiController::new(unit, config).expect("the radio starts");
    let (manager, sender, receiver) = controller.esp_now().split();
    manager.set_channel(CHANNEL).expect("a channel there is");
    let mut vehicle = Address::default();
    vehicle.0.copy_from_slice(interface_mac_address(InterfaceMacAddress::Station).as_bytes());
    let session = Session::new(vehicle, CHANNEL, peer);
    let topics::LinkEnds { command_pilot, flight_status, telemetry, link_peer, .. } = ends;
    let link = RefCell::new(Link::new(session, command_pilot, link_peer, flight_status, telemetry));
    join(receive(receiver, &link), send(sender, &manager, &link)).await;
}

async fn receive(mut receiver: EspNowReceiver, link: &RefCell<Link<'_>>) {
    loop {
        let received = receiver.receive_async().await;
        let source = Address(received.info.src_address);
        // What is refused is counted there.
        let _ = link.borrow_mut().receive(Clock.now(), source, received.data());
    }
}

async fn send(mut sender: EspNowSender, manager: &EspNowManager, link: &RefCell<Link<'_>>) {
    let mut ticker = Ticker::every(Duration::from_micros(link::PERIOD.as_micros()));
    loop {
        ticker.next().await;
        let Outgoing { call, telemetry } = link.borrow_mut().transmit(Clock.now());
        // A packet that is not taken is lost; the next one is newer anyway.
        if let Some(call) = call {
            let _ = say(&mut sender, manager, Address::BROADCAST, &call).await;
        }
        if let Some((peer, packet)) = telemetry {
            let _ = say(&mut sender, manager, peer, &packet).await;
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
