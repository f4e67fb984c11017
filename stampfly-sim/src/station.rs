//! A simulated ground station that flies missions in latitude and longitude (feature `ground`).
//!
//! ```text
//! take-off; 36.5627,136.7,60; 36.5627,136.6972,60; hold 30; land
//! ```
//!
//! A waypoint is latitude and longitude in degrees and height above home in m. `hold` stays at the
//! last waypoint for a number of seconds. Another flight may begin after `land`. The station waits
//! until the vehicle has an origin and no arming blocks, arms it, starts the mission, and keeps the
//! link alive. For vehicles that accept guided commands and know their geographic position; for
//! vehicles that take stick input only use [`sight`](crate::sight).

use crate::sight::Progress;
use crate::time::Clock;
use core::cell::{Cell, RefCell};
use core::str::FromStr;
use stampfly_bus::TopicInfo;
use stampfly_services::mission::{Runner, Step};
use stampfly_services::{
    ArbitratedAccess, CommandArbiter, Places, Requester, Samples, VehicleAccess, VehicleActions, View,
};
use stampfly_types::messages::{GuidedCommand, GuidedKind};
use stampfly_types::{Duration, Instant, Origin, Vec3};

/// Period of the station.
const TURN: Duration = Duration::from_millis(20);
/// Time for which the vehicle has to be ready before it is armed, so that its estimate settles.
const SETTLES: Duration = Duration::from_secs(5);

/// One mission item.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Item {
    TakeOff,
    /// Latitude and longitude, 10⁻⁷ degrees, and height above home, m.
    Place(i32, i32, f32),
    Hold(f32),
    Land,
}

/// A mission: one or more flights, each from take-off to landing.
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
    /// True if there is nothing to fly.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Number of items.
    #[must_use]
    pub fn items(&self) -> usize {
        self.0.iter().map(Vec::len).sum()
    }

    /// The mission steps of one flight. `hold` repeats the last waypoint with a stay.
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

/// The ground station at the other end of a vehicle's link.
pub struct Station<'a, H, S> {
    clock: Clock,
    arbiter: CommandArbiter,
    actions: H,
    places: Places,
    newest: &'a RefCell<S>,
    /// While true, the link is interrupted in both directions.
    silent: &'a Cell<bool>,
}

impl<'a, H: VehicleActions, S: Samples> Station<'a, H, S> {
    /// A station for a vehicle with these `actions` and `topics`. It reads samples from `newest`.
    #[must_use]
    pub fn new(
        clock: &Clock,
        actions: H,
        topics: &[TopicInfo],
        newest: &'a RefCell<S>,
        silent: &'a Cell<bool>,
    ) -> Self {
        Self {
            clock: clock.clone(),
            arbiter: CommandArbiter::new(),
            actions,
            places: Places::of(topics),
            newest,
            silent,
        }
    }

    /// Flies the mission. A vehicle without a take-off height of its own climbs to `height`, m; a
    /// waypoint is reached within `reach`, m.
    pub async fn fly(mut self, Mission(flights): &Mission, [height, reach]: [f32; 2], progress: &Progress) {
        for flight in flights {
            self.wait_until_ready().await;
            let Some(origin) = self.requester(|access, _| access.origin()) else { return };
            // Positions are relative to the origin, which is known only when the vehicle is ready.
            let steps = Mission::steps(flight, &origin, height);
            let mut runner = Runner::new(height, reach);
            let armed = |access: &mut dyn VehicleAccess| access.view().state().armed;
            while !self.requester(|access, _| armed(access)) {
                self.requester(|access, now| {
                    // The request is refused while the queue is full; the loop repeats it.
                    let _ = access.guide(
                        now,
                        Requester::Console,
                        GuidedCommand { kind: GuidedKind::Arm, ..Default::default() },
                    );
                });
                self.turn().await;
            }
            self.requester(|access, now| {
                let _ = runner.start(now, Requester::Console, access);
            });
            let before = progress.legs.get();
            // The loop ends on disarming: a mission that a failsafe has taken over is not resumed.
            while !runner.is_finished() && self.requester(|access, _| armed(access)) {
                let current = if self.silent.get() {
                    runner.current()
                } else {
                    self.requester(|access, now| {
                        access.alive(now, Requester::Console);
                        runner.alive(now, Requester::Console);
                        runner.poll(now, access, &|place| steps.get(place).copied());
                        runner.current()
                    })
                };
                progress.legs.set(before + current.min(steps.len()));
                self.turn().await;
            }
            // The vehicle disarms during the last step, landing, before the runner has counted it.
            if runner.current() + 1 >= steps.len() {
                progress.legs.set(before + steps.len());
            }
        }
        progress.finished.set(true);
    }

    /// Waits until the vehicle has been ready to arm for [`SETTLES`].
    async fn wait_until_ready(&mut self) {
        // Restarts whenever the vehicle becomes unready, so the time counts from the last change.
        let mut since = self.clock.now();
        loop {
            let is_ready = self.requester(|access, _| {
                let state = access.view().state();
                access.origin().is_some() && state.blocks.is_empty() && !state.armed
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
            let armed = self.requester(|access, _| access.view().state().armed);
            self.arbiter.poll(now, armed, &mut self.actions);
        }
        self.clock.sleep_until(now + TURN).await;
    }

    /// Gives `call` access to the vehicle.
    fn requester<T>(&mut self, call: impl FnOnce(&mut dyn VehicleAccess, Instant) -> T) -> T {
        let newest = self.newest.borrow();
        let view = View::new(&*newest, &self.places);
        call(&mut ArbitratedAccess { arbiter: &mut self.arbiter, actions: &mut self.actions, view }, self.clock.now())
    }
}
