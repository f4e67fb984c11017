//! An aircraft without a body, for tests of modes alone: a test says how high, how fast and where it is. Not for flights; those are in
//! the simulation.

use stampfly_control::fixed_wing::runway::Runway;
use stampfly_control::fixed_wing::{Track, TrackConfig, WayPoints};
use stampfly_fixed_wing::Config;
use stampfly_fixed_wing::messages::{Demand, Lateral, Place};
use stampfly_fixed_wing::modes::{CAPACITY, Order, Plane, PlaneMode, Seen, place};
use stampfly_mode::stage::{Duration, Instant, Selector};
use stampfly_types::{Origin, math};

/// An aircraft that somebody moves by hand, with the document's own numbers.
pub struct Bench {
    pub now: Instant,
    pub config: Config,
    pub origin: Origin,
    pub way_points: WayPoints<CAPACITY>,
    pub selector: Selector<Plane>,
    pub order: Order,
    pub position: Option<[f32; 2]>,
    pub height: f32,
    pub airspeed: f32,
    pub course: f32,
    pub demand: Demand,
}

impl Bench {
    pub fn new() -> Self {
        let mut config = Config::default();
        config.speed.rotation = 7.0;
        config.speed.climb = 15.0;
        config.height.climbed = 40.0;
        (config.height.flare, config.height.decrab, config.height.touchdown) = (10.0, 5.0, 2.0);
        Self {
            now: Instant::ZERO,
            config,
            origin: Origin { latitude: 434_700_000, longitude: -805_400_000, altitude: 0 },
            way_points: WayPoints::default(),
            selector: Selector::new(),
            order: Order::Fly,
            position: Some([0.0; 2]),
            height: 0.0,
            airspeed: 0.0,
            course: 0.0,
            demand: Demand::default(),
        }
    }

    fn seen(&self) -> Seen<'_> {
        Seen {
            config: &self.config,
            origin: self.origin,
            runway: Some(Runway::at(&self.origin, [0.0; 2], 0.0, 0.0)),
            way_points: &self.way_points,
            order: self.order,
            hold: None,
            position: self.position,
            height: self.height,
            airspeed: self.airspeed,
            is_measured: true,
            wind: [0.0; 2],
            ground_speed: self.airspeed,
            course: self.course,
            heading: self.course,
            on_ground: false,
        }
    }

    pub fn begin(&mut self, mode: PlaneMode) {
        let mut selector = std::mem::take(&mut self.selector);
        selector.switch(mode, self.now, &self.seen());
        self.selector = selector;
    }

    /// Moves as the demand's path says, until it is in this place.
    pub fn fly_to(&mut self, wanted: Place) {
        for _ in 0..60_000 {
            if self.cycle() == wanted {
                return;
            }
            let Demand { lateral, place, course, radius, .. } = self.demand;
            let track = match lateral {
                Lateral::Orbit => Track::Orbit { centre: place, radius: radius.abs(), clockwise: radius > 0.0 },
                _ => Track::Line { through: place, course },
            };
            let [north, east] = self.position.expect("known");
            self.course = track.steer([north, east], [0.0; 2], &TrackConfig::default()).course;
            let (sin, cos) = math::sin_cos(self.course);
            self.position = Some([north + 0.3 * cos, east + 0.3 * sin]);
        }
        panic!("in {:?} instead of {wanted:?}", place(&self.selector));
    }

    pub fn cycle(&mut self) -> Place {
        self.now += Duration::from_millis(20);
        let mut selector = std::mem::take(&mut self.selector);
        self.demand = selector.execute(self.now, &self.seen()).expect("a demand");
        self.selector = selector;
        place(&self.selector)
    }
}
