//! A simulated pilot with a HiSKY transmitter: calibrates and arms with the sticks, flies the mission by sight, lands, disarms.
//!
//! The pilot sees the vehicle and its lights, and repeats a gesture that they do not answer: a packet was lost. Sticks are angles in
//! ANGLE and rates in ACRO; throttle is thrust in both.

mod sticks;

pub(super) use sticks::sticks_of;

use super::plant::HOVER;
use super::stunts::{Stunt, Stunts};
use crate::messages::ControlState;
use crate::parameters::StickParameters;
use core::cell::Cell;
use stampfly_link::hisky::HiskyChannels;
use stampfly_sim::World;
use stampfly_sim::sight::{Eye, Hand, LOOK, Places, Progress, Seen};
use stampfly_sim::time::Clock;
use stampfly_types::{Duration, Vec3};

/// What the sticks mean besides steering.
const CALIBRATE: Sticks = Sticks { yaw: -1.0, throttle: 1.0, ..Sticks::REST };
const ARM: Sticks = Sticks { yaw: 1.0, ..Sticks::REST };
const DISARM: Sticks = Sticks { yaw: -1.0, ..Sticks::REST };
/// Three quarters of the weight, then a third: one that bounces settles level, while motors that stand would let it fall and tip.
const SETTLE: [Sticks; 2] = [Sticks { throttle: 0.45, ..Sticks::REST }, Sticks { throttle: 0.2, ..Sticks::REST }];

/// A pilot whose gesture is not answered so many times puts the transmitter down.
const TRIES: u8 = 10;

/// Sticks of the transmitter: −1 to 1, throttle 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sticks {
    /// Right is positive.
    pub roll: f32,
    /// Nose up is positive.
    pub pitch: f32,
    /// Clockwise is positive.
    pub yaw: f32,
    /// Down is zero.
    pub throttle: f32,
    /// Channel 5: ACRO.
    pub acro: bool,
}

impl Sticks {
    /// Let go, with the throttle down.
    pub const REST: Self = Self { roll: 0.0, pitch: 0.0, yaw: 0.0, throttle: 0.0, acro: false };

    /// As they travel.
    #[must_use]
    pub fn channels(&self) -> HiskyChannels {
        let centred = |stick: f32| (500.0 + 500.0 * stick.clamp(-1.0, 1.0)).round() as u16;
        let throttle = (1000.0 * self.throttle.clamp(0.0, 1.0)).round() as u16;
        let switch = if self.acro { 1000 } else { 0 };
        // Elevator and throttle are the wrong way round there.
        HiskyChannels([
            centred(self.roll),
            1000 - centred(self.pitch),
            1000 - throttle,
            centred(self.yaw),
            switch,
            0,
            0,
            0,
        ])
    }
}

/// The pilot.
pub struct Pilot<'a> {
    clock: Clock,
    transmitter: &'a Cell<Sticks>,
    lights: Option<&'a Cell<ControlState>>,
    meaning: StickParameters,
    acro: bool,
    stunt: Option<(Stunt, Stunts)>,
    eye: Eye,
    hand: Hand,
}

impl<'a> Pilot<'a> {
    /// With this transmitter in the hands.
    pub fn new(
        clock: &Clock,
        world: &World,
        transmitter: &'a Cell<Sticks>,
        meaning: StickParameters,
        acro: bool,
    ) -> Self {
        let eye = Eye::new(world, clock.now());
        Self { clock: clock.clone(), transmitter, lights: None, meaning, acro, stunt: None, eye, hand: Hand::default() }
    }

    /// Sees lights that show this, too. One who does not takes every gesture for understood.
    #[must_use]
    pub fn with_lights(self, lights: &'a Cell<ControlState>) -> Self {
        Self { lights: Some(lights), ..self }
    }

    /// Flies this besides, from a seed.
    #[must_use]
    pub fn with_stunt(self, stunt: Option<Stunt>, seed: u64) -> Self {
        Self { stunt: stunt.map(|stunt| (stunt, Stunts::new(seed))), ..self }
    }

    /// Flies it. Without a place to fly to it is made ready and stands.
    pub async fn fly(mut self, places: &Places, progress: &Progress) {
        self.hold(Sticks::REST, 1.0).await;
        let is_calibrated = self.calibrate().await;
        if places.0.is_empty() {
            return;
        }
        if !is_calibrated || !self.gesture(ARM, |lights| lights.armed, 0.5).await {
            progress.finished.set(true);
            return;
        }
        let clock = self.clock.clone();
        if let (Some((Stunt::Freestyle(seconds), stunts)), Some(leg)) = (&mut self.stunt, places.0.first()) {
            let (seconds, stunts) = (*seconds, core::mem::replace(stunts, Stunts::new(0)));
            self.freestyle(stunts, leg.place, seconds).await;
        }
        places.fly(&clock, progress, &mut async |place, sinks| self.steer(place, sinks).await).await;
        for sticks in SETTLE {
            self.hold(sticks, 0.5).await;
        }
        self.hold(Sticks::REST, 0.5).await;
        self.hold(DISARM, 0.5).await;
        self.transmitter.set(Sticks::REST);
        progress.finished.set(true);
    }

    async fn calibrate(&mut self) -> bool {
        self.gesture(CALIBRATE, |lights| lights.calibrating, 2.2).await
    }

    /// Climbs to a place, and flies stunts there.
    async fn freestyle(&mut self, mut stunts: Stunts, place: Vec3, seconds: f32) {
        let acro = core::mem::take(&mut self.acro);
        let mut begun = None;
        while begun.is_none_or(|begun| self.clock.now().since(begun).seconds() < seconds) {
            let seen = self.steer(place, false).await;
            while let Some(sticks) = stunts.next(&self.eye.look(self.clock.now()), LOOK.seconds()) {
                begun.get_or_insert(self.clock.now());
                self.transmitter.set(sticks);
                self.clock.sleep_until(self.clock.now() + LOOK).await;
            }
            if seen.contact && begun.is_some() {
                return;
            }
        }
        self.acro = acro;
    }

    /// Makes a gesture until the lights say that it was seen, and waits for some seconds after it. Was it?
    async fn gesture(&mut self, sticks: Sticks, is_seen: impl Fn(&ControlState) -> bool, seconds: f32) -> bool {
        for _ in 0..TRIES {
            self.hold(sticks, 0.3).await;
            let seen = self.lights.is_none_or(|lights| is_seen(&lights.get()));
            self.hold(Sticks::REST, seconds).await;
            if seen {
                return true;
            }
        }
        false
    }

    async fn hold(&mut self, sticks: Sticks, seconds: f32) {
        self.transmitter.set(Sticks { acro: self.acro, ..sticks });
        self.clock.sleep_until(self.clock.now() + Duration::from_seconds(seconds)).await;
    }

    /// Looks, moves the sticks, and waits for the next look.
    async fn steer(&mut self, place: Vec3, sinks: bool) -> Seen {
        let now = self.clock.now();
        let seen = self.eye.look(now);
        if let (Some((Stunt::Drop(height), _)), true) = (&self.stunt, sinks)
            && -seen.position.z < *height
        {
            self.transmitter.set(Sticks { acro: self.acro, ..Sticks::REST });
            self.clock.sleep_until(now + LOOK).await;
            return seen;
        }
        let wish = self.hand.steer(&seen, place, sinks);
        let StickParameters { angle_max, rotation_max, .. } = self.meaning;
        let mut lean = wish.lean;
        for (stick, leans) in lean.iter_mut().zip(seen.lean) {
            // 3 1/s: two fifths of what the reaction time would bear.
            *stick = if self.acro { 3.0 * (*stick - leans) / rotation_max } else { *stick / angle_max };
        }
        let [ahead, right] = lean;
        let throttle = (HOVER + wish.throttle).clamp(0.2, 1.0);
        let yaw = (1.5 * wish.turn).clamp(-1.0, 1.0) / rotation_max;
        self.transmitter.set(Sticks { roll: right, pitch: -ahead, yaw, throttle, acro: self.acro });
        self.clock.sleep_until(now + LOOK).await;
        seen
    }
}
