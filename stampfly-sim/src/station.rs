//! A simulated ground station, and the missions in latitude and longitude that it flies.
//!
//! ```text
//! take-off; 36.5627,136.7,60; 36.5627,136.6972,60; hold 30; land
//! ```
//!
//! Places are latitude and longitude, degrees, and height above home, m. `hold` stays at the last place for so many seconds. Behind `land` a new flight may begin. The station does what a person with a telephone does:
//! waits until the vehicle knows where it is, arms it, starts the mission, and is heard all the time. For vehicles that take commands and know where on Earth they are; for those that are flown by sticks see
//! [`sight`](crate::sight).
//!
//! With feature `ground`.

use crate::sight::Progress;
use crate::time::Clock;
use core::cell::{Cell, RefCell};
use core::str::FromStr;
use stampfly_bus::TopicInfo;
use stampfly_services::mission::{Runner, Step};
use stampfly_services::{Cockpit, Hands, Helm, Places, Samples, Seat, Seated, View};
use stampfly_types::messages::{GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Instant, Origin, Vec3};

/// Between two turns of the station.
const TURN: Duration = Duration::from_millis(20);
/// Once the vehicle knows where it is, the station waits so long for the estimate to settle.
const SETTLES: Duration = Duration::from_secs(5);

/// One item.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Item {
    TakeOff,
    /// Ten-millionths of a degree, and m above home.
    Place(i32, i32, f32),
    Hold(f32),
    Land,
}

/// What to fly: flights, each from a take-off to a landing.
///
/// ```
/// use stampfly_sim::station::Mission;
/// let mission: Mission = "take-off; 47.3977,8.5456,60; hold 30; land".parse()?;
/// assert_eq!(mission.items(), 4);
/// assert!("97.0,8.5,60".parse::<Mission>().is_err(), "no such latitude");
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mission(Vec<Vec<Item>>);

impl FromStr for Mission {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut flights = vec![Vec::new()];
        for part in text.split(';').map(str::trim).filter(|part| !part.is_empty()) {
            let item = item(part).ok_or_else(|| {
                format!("'{part}' is none of take-off, LATITUDE,LONGITUDE,HEIGHT, hold SECONDS, land")
            })?;
            if let Some(flight) = flights.last_mut() {
                flight.push(item);
            }
            if item == Item::Land {
                flights.push(Vec::new());
            }
        }
        flights.retain(|flight| !flight.is_empty());
        Ok(Self(flights))
    }
}

fn item(text: &str) -> Option<Item> {
    match text.split_once(' ') {
        Some(("hold", seconds)) => seconds.parse().ok().filter(|s| (0.0..=600.0).contains(s)).map(Item::Hold),
        _ if text == "take-off" => Some(Item::TakeOff),
        _ if text == "land" => Some(Item::Land),
        _ => {
            let numbers: Vec<f64> = text.split(',').map(|part| part.trim().parse().ok()).collect::<Option<_>>()?;
            let [latitude, longitude, height] = numbers[..] else { return None };
            let is_place = latitude.abs() <= 85.0 && longitude.abs() <= 180.0 && (10.0..=400.0).contains(&height);
            let whole = |degrees: f64| (degrees * 1e7).round() as i32;
            is_place.then(|| Item::Place(whole(latitude), whole(longitude), height as f32))
        }
    }
}

impl Mission {
    /// Is there nothing to fly?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// How many items there are.
    #[must_use]
    pub fn items(&self) -> usize {
        self.0.iter().map(Vec::len).sum()
    }

    /// The steps of a flight.
    fn steps(flight: &[Item], origin: &Origin, height: f32) -> Vec<Step> {
        let mut place = Vec3::zeros();
        let step = |item: &Item| match *item {
            Item::TakeOff => Step::TakeOff(height),
            Item::Place(latitude, longitude, height) => {
                let [north, east] = origin.local(latitude, longitude);
                place = Vec3::new(north, east, -height);
                Step::GoTo { place, yaw: None, radius: None, stay: Some(Duration::ZERO) }
            }
            Item::Hold(seconds) => {
                Step::GoTo { place, yaw: None, radius: None, stay: Some(Duration::from_seconds(seconds)) }
            }
            Item::Land => Step::Land(None),
        };
        flight.iter().map(step).collect()
    }
}

/// The ground station.
pub struct Station<'a, H, S> {
    clock: Clock,
    helm: Helm,
    hands: H,
    places: Places,
    newest: &'a RefCell<S>,
    /// While this is true nothing gets through.
    silent: &'a Cell<bool>,
}

impl<'a, H: Hands, S: Samples> Station<'a, H, S> {
    /// One at the other end of the link of a vehicle with these hands, of which these are the topics.
    #[must_use]
    pub fn new(clock: &Clock, hands: H, topics: &[TopicInfo], newest: &'a RefCell<S>, silent: &'a Cell<bool>) -> Self {
        Self { clock: clock.clone(), helm: Helm::new(), hands, places: Places::of(topics), newest, silent }
    }

    /// Flies it. A vehicle without a take-off height of its own takes off to `height`, m; a place is reached within `reach`, m.
    pub async fn fly(mut self, Mission(flights): &Mission, [height, reach]: [f32; 2], progress: &Progress) {
        for flight in flights {
            self.wait_until_ready().await;
            let Some(origin) = self.seat(|cockpit, _| cockpit.origin()) else { return };
            let steps = Mission::steps(flight, &origin, height);
            let mut runner = Runner::new(height, reach);
            let armed = |cockpit: &mut dyn Cockpit| cockpit.view().state().armed;
            while !self.seat(|cockpit, _| armed(cockpit)) {
                self.seat(|cockpit, now| {
                    // Refused while the queue is full: asked again.
                    let _ = cockpit.guide(
                        now,
                        Seat::Console,
                        GuidedCommand { kind: GuidedKind::Arm, ..Default::default() },
                    );
                });
                self.turn().await;
            }
            self.seat(|cockpit, now| {
                let _ = runner.start(now, Seat::Console, cockpit);
            });
            let before = progress.legs.get();
            // A mission that the failsafe has taken over is not taken back.
            while !runner.is_finished() && self.seat(|cockpit, _| armed(cockpit)) {
                let current = if self.silent.get() {
                    runner.current()
                } else {
                    self.seat(|cockpit, now| {
                        cockpit.alive(now, Seat::Console);
                        runner.alive(now, Seat::Console);
                        runner.poll(now, cockpit, &|place| steps.get(place).copied());
                        runner.current()
                    })
                };
                progress.legs.set(before + current.min(steps.len()));
                self.turn().await;
            }
            if runner.current() + 1 >= steps.len() {
                progress.legs.set(before + steps.len());
            }
        }
        progress.finished.set(true);
    }

    /// Waits until it would arm, and a little longer.
    async fn wait_until_ready(&mut self) {
        let mut since = self.clock.now();
        loop {
            let is_ready = self.seat(|cockpit, _| {
                let state = cockpit.view().state();
                cockpit.origin().is_some() && state.blocks.is_empty() && !state.armed
            });
            let now = self.clock.now();
            if !is_ready {
                since = now;
            } else if now.since(since) >= SETTLES {
                return;
            }
            self.turn().await;
        }
    }

    async fn turn(&mut self) {
        let now = self.clock.now();
        if !self.silent.get() {
            let armed = self.seat(|cockpit, _| cockpit.view().state().armed);
            self.helm.poll(now, armed, &mut self.hands);
        }
        self.clock.sleep_until(now + TURN).await;
    }

    /// The vehicle, for one call.
    fn seat<T>(&mut self, call: impl FnOnce(&mut dyn Cockpit, Instant) -> T) -> T {
        let newest = self.newest.borrow();
        let view = View::new(&*newest, &self.places);
        call(&mut Seated { helm: &mut self.helm, hands: &mut self.hands, view }, self.clock.now())
    }
}
