//! What the guidance of a fixed-wing aircraft wants of its autopilot: how to steer, what the pitch is for, what the throttle is for.
//!
//! A message, so that a demand travels on a topic and is logged. A mode builds one from a [`Track`] or a course and adds height and speed.

use super::track::Track;
use stampfly_types::{message, message_enum};

message_enum! {
    /// How it steers.
    pub enum Lateral {
        /// At a bank, `bank`.
        #[default]
        Bank = 0,
        /// Along the line through `place` with `course`.
        Line = 1,
        /// Around `place`.
        Orbit = 2,
        /// The nose to `course`, with the rudder and the wheel.
        Heading = 3,
    }
}

message_enum! {
    /// What the pitch is for.
    pub enum Vertical {
        /// At a pitch, `pitch`.
        #[default]
        Pitch = 0,
        /// At a height, `height`, which changes by `climb`.
        Height = 1,
        /// At a rate of climb, `climb`, whatever the speed.
        Climb = 2,
    }
}

message_enum! {
    /// What the throttle is for.
    pub enum Thrust {
        /// At a throttle, `throttle`.
        #[default]
        Throttle = 0,
        /// At an airspeed, `speed`.
        Airspeed = 1,
        /// At a speed over the ground, on wheels, `speed`.
        Ground = 2,
    }
}

message! {
    /// What the guidance wants of the autopilot.
    pub struct Demand {
        /// How it steers.
        lateral: Lateral,
        /// A point of the line, or the middle of the orbit, north and east of home.
        place: [f32; 2] ["m"],
        /// Of the line or the nose; beside a line, where the nose is held with the rudder when `aligned`.
        course: f32 ["rad"],
        /// Of the orbit; to the left is negative.
        radius: f32 ["m"],
        /// A bank to be held.
        bank: f32 ["rad"],
        /// Largest bank.
        bank_max: f32 ["rad"],
        /// The nose along `course`, although the wind blows from aside.
        aligned: bool,
        /// What the pitch is for.
        vertical: Vertical,
        /// Above home.
        height: f32 ["m"],
        /// Rate of climb.
        climb: f32 ["m/s"],
        /// A pitch to be held.
        pitch: f32 ["rad"],
        /// What the throttle is for.
        thrust: Thrust,
        /// True airspeed, or speed over the ground.
        speed: f32 ["m/s"],
        /// Share of full throttle.
        throttle: f32,
        /// Do wheels carry it?
        on_ground: bool,
        /// Brakes.
        brake: bool,
    }
}

impl Demand {
    /// Along a path, with this bank at most.
    ///
    /// ```
    /// use stampfly_control::fixed_wing::{Demand, Lateral, Thrust, Track, Vertical};
    /// let north = Track::Line { through: [0.0, 0.0], course: 0.0 };
    /// let cruise = Demand::track(north, 0.6).at(60.0, 0.0).fast(15.0);
    /// assert_eq!((cruise.lateral, cruise.vertical, cruise.thrust), (Lateral::Line, Vertical::Height, Thrust::Airspeed));
    /// assert_eq!(cruise.path(), Some(north));
    /// ```
    #[must_use]
    pub fn track(track: Track, bank_max: f32) -> Self {
        match track {
            Track::Line { through, course } => {
                Self { lateral: Lateral::Line, place: through, course, bank_max, ..Self::default() }
            }
            Track::Orbit { centre, radius, clockwise } => {
                let radius = if clockwise { radius } else { -radius };
                Self { lateral: Lateral::Orbit, place: centre, radius, bank_max, ..Self::default() }
            }
        }
    }

    /// The nose to a heading, with rudder and wheel.
    #[must_use]
    pub fn nose(course: f32) -> Self {
        Self { lateral: Lateral::Heading, course, ..Self::default() }
    }

    /// The path, if there is one.
    #[must_use]
    pub fn path(&self) -> Option<Track> {
        match self.lateral {
            Lateral::Line => Some(Track::Line { through: self.place, course: self.course }),
            Lateral::Orbit => {
                Some(Track::Orbit { centre: self.place, radius: self.radius.abs(), clockwise: self.radius > 0.0 })
            }
            Lateral::Bank | Lateral::Heading => None,
        }
    }

    /// At a height, which changes by `climb`.
    #[must_use]
    pub fn at(self, height: f32, climb: f32) -> Self {
        Self { vertical: Vertical::Height, height, climb, ..self }
    }

    /// At a true airspeed.
    #[must_use]
    pub fn fast(self, speed: f32) -> Self {
        Self { thrust: Thrust::Airspeed, speed, ..self }
    }

    /// Rolling at a speed over the ground, with brakes when `now` it is faster than twice that.
    #[must_use]
    pub fn rolling(self, speed: f32, now: f32) -> Self {
        Self { thrust: Thrust::Ground, speed, on_ground: true, brake: now > 2.0 * speed, ..self }
    }

    /// The throttle closed and the brakes on.
    #[must_use]
    pub fn standing(self) -> Self {
        Self { thrust: Thrust::Throttle, throttle: 0.0, on_ground: true, brake: true, ..self }
    }
}
