//! The pilot's radio: ESP-NOW in, the pilot's frames out; telemetry and calls for a transmitter back.
//!
//! Hearing and speaking do not wait for each other: a packet that the air does not take must not keep the pilot's next
//! one from being heard.

use crate::clock::Clock;
use core::cell::RefCell;
use embassy_futures::join::join;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Ticker};
use esp_hal::efuse::{InterfaceMacAddress, interface_mac_address};
use esp_hal::peripherals::WIFI;
use esp_radio::esp_now::{EspNowManager, EspNowReceiver, EspNowSender, EspNowWifiInterface, PeerInfo};
use esp_radio::wifi::{ControllerConfig, WifiController};
use stampfly_board::messages::TelemetryFrame;
use stampfly_board::wiring;
use stampfly_drivers::Timebase;
use stampfly_link::{Address, Session, TelemetryPacket};
use stampfly_types::messages::{Alerts, ArmBlocks};

/// The channel the vehicle listens on.
const CHANNEL: u8 = 1;

/// What the transmitter shows as a sensor's error.
const SENSOR_ERROR: Alerts =
    Alerts::IMU_DEGRADED.with(Alerts::IMU_LOST).with(Alerts::TOF_LOST).with(Alerts::POWER_LOST);

/// Somebody at the console wants a transmitter to be looked for.
pub static PAIR: Signal<CriticalSectionRawMutex, ()> = Signal::new();
/// The vehicle belongs to this transmitter from now on; to be kept.
pub static PAIRED: Signal<CriticalSectionRawMutex, Address> = Signal::new();

/// What the radio needs.
pub struct Parts {
    pub unit: WIFI<'static>,
    /// The transmitter the vehicle belongs to.
    pub peer: Option<Address>,
    pub pilot: wiring::command_pilot::Tx<'static>,
    pub telemetry: wiring::telemetry::Rx<'static>,
}

/// Listens and speaks for ever.
#[embassy_executor::task]
pub async fn run(parts: Parts) {
    let Parts { unit, peer, pilot, telemetry } = parts;
    // A station without an access point would sleep between packets and miss the pilot's.
    let config = ControllerConfig::default().with_sta_disconnected_pm(false);
    let controller = WifiController::new(unit, config).expect("the radio starts");
    let (manager, sender, receiver) = controller.esp_now().split();
    manager.set_channel(CHANNEL).expect("a channel there is");
    let mut vehicle = Address::default();
    vehicle.0.copy_from_slice(interface_mac_address(InterfaceMacAddress::Station).as_bytes());
    let session = RefCell::new(Session::new(vehicle, CHANNEL, peer));
    join(hear(receiver, &session, pilot), speak(sender, &manager, &session, telemetry)).await;
}

async fn hear(mut receiver: EspNowReceiver, session: &RefCell<Session>, mut pilot: wiring::command_pilot::Tx<'static>) {
    loop {
        let received = receiver.receive_async().await;
        let (at, source) = (Clock.now(), Address(received.info.src_address));
        // What is refused is counted there and is no sign of life.
        let (input, before, after) = {
            let mut session = session.borrow_mut();
            let before = session.peer();
            (session.receive(at, source, received.data()), before, session.peer())
        };
        if let Ok(input) = input {
            pilot.publish(at, &input);
        }
        if let Some(peer) = after.filter(|_| before != after) {
            PAIRED.signal(peer);
        }
    }
}

async fn speak(
    mut sender: EspNowSender,
    manager: &EspNowManager,
    session: &RefCell<Session>,
    mut telemetry: wiring::telemetry::Rx<'static>,
) {
    let mut wanted = false;
    let mut counter = 0u8;
    let mut ticker = Ticker::every(Duration::from_millis(20));
    loop {
        ticker.next().await;
        let frame = telemetry.latest().map(|sample| sample.data).unwrap_or_default();
        let wants = frame.blocks.contains(ArmBlocks::PAIRING);
        session.borrow_mut().set_armed(frame.armed);
        // Refused with motors armed, and then there is nothing to be done.
        if PAIR.try_take().is_some() {
            let _ = session.borrow_mut().start_pairing(Clock.now());
        }
        match (wanted, wants) {
            (false, true) => _ = session.borrow_mut().start_pairing(Clock.now()),
            (true, false) => session.borrow_mut().stop_pairing(),
            _ => {}
        }
        wanted = wants;
        let (call, peer) = {
            let mut session = session.borrow_mut();
            (session.beacon(Clock.now()), session.peer().filter(|_| !session.is_pairing()))
        };
        // A packet nobody took is lost; the next one is newer anyway.
        if let Some(call) = call {
            let _ = say(&mut sender, manager, Address::BROADCAST, &call).await;
        }
        if let Some(peer) = peer {
            counter = counter.wrapping_add(1);
            let _ = say(&mut sender, manager, peer, &packet(counter, &frame).to_bytes()).await;
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

fn packet(counter: u8, frame: &TelemetryFrame) -> TelemetryPacket {
    TelemetryPacket {
        counter,
        battery: frame.battery,
        height: -frame.position.z,
        velocity: frame.velocity,
        attitude: frame.attitude,
        state: frame.state.into(),
        low_battery: frame.alerts.intersects(Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY),
        sensor_error: frame.alerts.intersects(SENSOR_ERROR),
        link_lost: frame.alerts.intersects(Alerts::COMM_LOST),
        calibrating: frame.blocks.contains(ArmBlocks::CALIBRATING),
    }
}
