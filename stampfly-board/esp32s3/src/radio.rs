//! The pilot's radio: moves the bytes between ESP-NOW and [`Link`], which knows what they mean.
//!
//! A vehicle without a key makes one as soon as its radio is on, for only then the chip's random numbers are random, and hands
//! it to the console's task to be stored. From then on it is offered to stations with that key.
//!
//! With the feature `wifi` the same radio is in a network (`wifi.rs`): a station there is answered there.
//!
//! Receiving and sending do not wait for each other: a packet that the air does not take must not keep the pilot's next
//! one from being received.

use crate::channel::CHANNEL;
use crate::clock::Clock;
use crate::memory::Memory;
use crate::record::{Line, Taken};
use crate::storage::KEY_ID;
#[cfg(feature = "wifi")]
use crate::wifi::{self, Network};
use alloc::boxed::Box;
use core::cell::RefCell;
use embassy_futures::join::join;
#[cfg(feature = "wifi")]
use embassy_futures::join::join3;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Ticker};
use esp_hal::efuse::{InterfaceMacAddress, interface_mac_address};
use esp_hal::peripherals::WIFI;
use esp_hal::rng::Trng;
use esp_radio::esp_now::{EspNowError, EspNowManager, EspNowReceiver, EspNowSender, EspNowWifiInterface, PeerInfo};
use esp_radio::wifi::{ControllerConfig, WifiController};
use stampfly_board::link::{self, Link, Outgoing};
use stampfly_board::topics;
use stampfly_drivers::Timebase;
use stampfly_link::secure::{Guarded, Key, MAX_BODY, MAX_FRAME, Payload, Policy, Vehicle};
use stampfly_link::{Address, Session};
use stampfly_services::CommandArbiter;
use stampfly_services::radio_requests::{NETWORK_SAMPLES, RADIO_SAMPLES, RadioRequests, Words};
use stampfly_services::requests::QueuedPayload;
use stampfly_services::subscription::{RADIO_CHUNK, RADIO_CHUNKS};
use static_cell::StaticCell;

/// A key that was made and is to be stored.
pub static MADE: Signal<CriticalSectionRawMutex, Key> = Signal::new();

/// What the radio needs.
pub struct Parts {
    pub unit: WIFI<'static>,
    pub link: &'static RefCell<Link<'static>>,
    /// Who commands, by radio and at the console's services alike.
    pub arbiter: &'static RefCell<CommandArbiter>,
    /// What a station with the key asks besides flying.
    pub requests: &'static RefCell<RadioRequests>,
    /// The flight record.
    pub taken: &'static RefCell<Taken>,
    /// The newest samples, and whether the vehicle is armed.
    pub memory: &'static RefCell<Memory>,
    /// What the radio joins while disarmed.
    #[cfg(feature = "wifi")]
    pub network: &'static RefCell<Network>,
}

/// Answers of the desk, which the console's task makes: sealed right before they are sent, so that no frame overtakes another.
pub static POST: Channel<CriticalSectionRawMutex, QueuedPayload, POST_AT_ONCE> = Channel::new();
const POST_AT_ONCE: usize = 2;

/// A link of a vehicle with this transmitter and key, as far as it has them.
pub fn link(
    peer: Option<Address>,
    key: Option<Key>,
    policy: Policy,
    ends: topics::LinkEnds<'static>,
) -> &'static RefCell<Link<'static>> {
    static LINK: StaticCell<RefCell<Link<'static>>> = StaticCell::new();
    let mut vehicle = Address::default();
    vehicle.0.copy_from_slice(interface_mac_address(InterfaceMacAddress::Station).as_bytes());
    let session = Session::new(vehicle, CHANNEL, peer);
    LINK.init_with(|| RefCell::new(Link::new(Guarded::new(key.map(Vehicle::new), session, policy), ends)))
}

/// Receives and sends until power-off.
#[embassy_executor::task]
pub async fn run(parts: Box<Parts>) {
    let Parts {
        unit,
        link,
        arbiter,
        requests,
        taken,
        memory,
        #[cfg(feature = "wifi")]
        network,
    } = *parts;
    // A station without an access point would sleep between packets and miss the pilot's.
    let config = ControllerConfig::default().with_sta_disconnected_pm(false);
    #[cfg(feature = "wifi")]
    let config = wifi::config(config);
    let controller = WifiController::new(unit, config).expect("the radio starts");
    let random = Trng::try_new().expect("its radio is on");
    let (manager, sender, receiver) = controller.esp_now().split();
    manager.set_channel(CHANNEL).expect("a channel there is");
    if link.borrow().guarded.vehicle().is_none()
        && let Some(key) = make(&random)
    {
        link.borrow_mut().guarded.set_vehicle(Vehicle::new(key));
    }
    let waiting = Waiting { arbiter, taken, requests, memory };
    #[cfg(feature = "wifi")]
    {
        let mut seed = [0; 8];
        random.read(&mut seed);
        let air = wifi::start(network, u64::from_le_bytes(seed));
        let say = Say { sender, manager: &manager, network };
        let in_the_network = join(
            wifi::carry(air, network, (link, arbiter), requests),
            wifi::associate(controller, &manager, network, memory),
        );
        join3(receive(receiver, link, arbiter, requests), send(say, &random, link, waiting), in_the_network).await;
    }
    #[cfg(not(feature = "wifi"))]
    join(receive(receiver, link, arbiter, requests), send(Say { sender, manager: &manager }, &random, link, waiting))
        .await;
}

/// A new key, which is also handed on to be stored.
fn make(random: &Trng) -> Option<Key> {
    let mut bytes = [0; 32];
    random.read(&mut bytes);
    let key = Key::generate(KEY_ID, bytes).ok()?;
    MADE.signal(key.clone());
    Some(key)
}

async fn receive(
    mut receiver: EspNowReceiver,
    link: &RefCell<Link<'_>>,
    arbiter: &RefCell<CommandArbiter>,
    requests: &RefCell<RadioRequests>,
) {
    let mut room = [0; MAX_FRAME];
    loop {
        let received = receiver.receive_async().await;
        let source = Address(received.info.src_address);
        // What is longer is no frame of anybody's. What is refused is counted there.
        if let Some(frame) = room.get_mut(..received.data().len()) {
            frame.copy_from_slice(received.data());
            let now = Clock.now();
            if let Ok(Some(received)) = link.borrow_mut().receive(&mut arbiter.borrow_mut(), now, source, frame) {
                // A station asks again for what there is no room for.
                let _ = requests.borrow_mut().ask(now, &received.payload);
            }
        }
    }
}

/// Where there may be something for a station that has asked for it.
struct Waiting {
    arbiter: &'static RefCell<CommandArbiter>,
    taken: &'static RefCell<Taken>,
    requests: &'static RefCell<RadioRequests>,
    memory: &'static RefCell<Memory>,
}

impl Waiting {
    /// Seals what is due of the topics that the station watches.
    // Apart: its room is not kept while something is sent.
    #[inline(never)]
    fn sample<'r>(&self, link: &RefCell<Link<'_>>, room: &'r mut [u8; MAX_FRAME]) -> Option<(Address, &'r [u8])> {
        let (now, mut words): (_, Words) = (Clock.now(), [[0; 4]; _]);
        let (mut requests, memory) = (self.requests.borrow_mut(), self.memory.borrow());
        let payload = requests.next(now, &memory.newest, &mut words)?;
        link.borrow_mut().guarded.seal(now, &payload, room)
    }
}

async fn send(mut say: Say<'_>, random: &Trng, link: &RefCell<Link<'_>>, waiting: Waiting) {
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
                let _ = say.say(to, bytes).await;
            }
        }
        link.borrow_mut().keep(&mut waiting.arbiter.borrow_mut(), Clock.now());
        let notice = link.borrow_mut().notice(&waiting.arbiter.borrow(), Clock.now(), &mut room);
        if let Some((to, bytes)) = notice {
            let _ = say.say(to, bytes).await;
        }
        for _ in 0..POST_AT_ONCE {
            let Ok(post) = POST.try_receive() else { break };
            let sealed = link.borrow_mut().guarded.seal(Clock.now(), &post.payload(), &mut room);
            if let Some((to, bytes)) = sealed {
                let _ = say.say(to, bytes).await;
            }
        }
        let samples = if say.is_network(link.borrow().guarded.station()) { NETWORK_SAMPLES } else { RADIO_SAMPLES };
        for _ in 0..samples {
            let Some((to, bytes)) = waiting.sample(link, &mut room) else { break };
            let _ = say.say(to, bytes).await;
        }
        for _ in 0..RADIO_CHUNKS {
            let sealed = {
                let (mut taken, mut chunk) = (waiting.taken.borrow_mut(), [0; MAX_BODY]);
                let Some(chunk) = taken.chunk(Line::Radio, &mut chunk, RADIO_CHUNK) else { break };
                link.borrow_mut().guarded.seal(Clock.now(), &Payload::Chunk(chunk), &mut room)
            };
            if let Some((to, bytes)) = sealed {
                let _ = say.say(to, bytes).await;
            }
        }
    }
}

/// Where frames leave.
struct Say<'s> {
    sender: EspNowSender,
    manager: &'s EspNowManager,
    #[cfg(feature = "wifi")]
    network: &'s RefCell<Network>,
}

impl Say<'_> {
    /// Is that station in the network?
    #[cfg(feature = "wifi")]
    fn is_network(&self, station: Option<Address>) -> bool {
        station.is_some_and(|station| self.network.borrow().knows(station))
    }

    #[cfg(not(feature = "wifi"))]
    fn is_network(&self, _: Option<Address>) -> bool {
        false
    }

    async fn say(&mut self, to: Address, bytes: &[u8]) -> Result<(), EspNowError> {
        #[cfg(feature = "wifi")]
        if self.network.borrow_mut().send_sealed(to, bytes) {
            return Ok(());
        }
        if !self.manager.peer_exists(&to.0) {
            self.manager.add_peer(PeerInfo {
                interface: EspNowWifiInterface::Station,
                peer_address: to.0,
                lmk: None,
                channel: None,
                encrypt: false,
            })?;
        }
        self.sender.send_async(&to.0, bytes).await
    }
}
