//! What travels on an aircraft's topics, beside the family's own messages.

use stampfly_types::{Instant, Origin, message, message_enum, message_flags};

pub use stampfly_control::fixed_wing::{Demand, EditKind, EditRefusal, Lateral, Thrust, Vertical, WayPointEdit};
pub use stampfly_types::messages::AirState;

message! {
    /// Where the local frame begins: the first good fix of the satellite receiver.
    pub struct Home {
        /// Ten-millionths of a degree, north is positive.
        latitude: i32 ["1e-7 deg"],
        /// Ten-millionths of a degree, east is positive.
        longitude: i32 ["1e-7 deg"],
        /// Above mean sea level.
        altitude: i32 ["mm"],
        /// Is it known?
        known: bool,
    }
}

message_flags! {
    /// What is wrong, as long as it is.
    pub struct Troubles {
        /// Nobody has been heard for longer than [`Limits::link_lost`](crate::config::Limits).
        LINK = 0,
        /// Outside of the fence.
        FENCE = 1,
        /// Where it is, is not known.
        POSITION = 2,
        /// The pitot tube is not to be believed.
        AIRSPEED = 3,
        /// The battery is at its warning level.
        BATTERY = 4,
        /// Its attitude is not known: nothing can be flown.
        ATTITUDE = 5,
        /// It has crashed.
        CRASH = 6,
        /// Its height contradicts what measures it.
        HEIGHT = 7,
    }
}

message! {
    /// Heights that are measured, and that no estimator has a part in.
    pub struct MeasuredHeights {
        /// Above home, by the air's pressure.
        barometer: f32 ["m"],
        /// When; zero is never.
        barometer_at: Instant ["us"],
        /// Above home, by the satellite receiver.
        receiver: f32 ["m"],
        /// When; zero is never.
        receiver_at: Instant ["us"],
    }
}

message! {
    /// What the watch has found, and since when.
    pub struct Safety {
        /// What is wrong.
        troubles: Troubles,
        /// For how long the link has been lost.
        link: f32 ["s"],
        /// For how long the position has been.
        position: f32 ["s"],
    }
}

message_enum! {
    /// How far a cycle of the path manager is.
    pub enum CycleStatus {
        /// In it.
        #[default]
        InCycle = 0,
        /// It is over.
        CompletedCycle = 1,
        /// Something has failed, for good.
        FailureMode = 2,
    }
}

message_enum! {
    /// A mode and its stage.
    pub enum Place {
        /// Before the first cycle.
        #[default]
        Nowhere = 0,
        /// Along the strip at full throttle.
        TakeOffRoll = 1,
        /// Off the ground and straight ahead.
        TakeOffClimb = 2,
        /// From way-point to way-point.
        CruisingCruise = 3,
        /// To the beginning of the slope.
        LandingTransition = 4,
        /// Down the slope.
        LandingSlope = 5,
        /// The throttle is closed.
        LandingFlare = 6,
        /// The nose turns to the strip.
        LandingDecrab = 7,
        /// Until it has stopped flying.
        LandingTouchdown = 8,
        /// Brakes.
        TaxiingStop = 9,
        /// Off the strip.
        TaxiingTurnOff = 10,
        /// It stands.
        TaxiingPark = 11,
        /// Back to the strip.
        TaxiingReturn = 12,
        /// Along the strip to where it takes off.
        TaxiingLineUp = 13,
    }
}

message! {
    /// Where the path manager is.
    pub struct PathStatus {
        /// The last cycle.
        cycle: CycleStatus,
        /// Mode and stage.
        place: Place,
        /// Number of the way-point ahead; zero without one.
        way_point: u32,
        /// How many are ahead.
        remaining: u32,
        /// Landings so far.
        landings: u32,
        /// Of the last change of the list.
        refusal: EditRefusal,
        /// Changes that were refused.
        refused: u32,
        /// When somebody was last heard; zero is never.
        heard: Instant ["us"],
    }
}

impl MeasuredHeights {
    /// Of barometer and receiver, with their times.
    #[must_use]
    pub fn both(&self) -> [Option<(Instant, f32)>; 2] {
        let Self { barometer, barometer_at, receiver, receiver_at } = *self;
        [(barometer_at, barometer), (receiver_at, receiver)]
            .map(|(at, height)| (at > Instant::ZERO && height.is_finite()).then_some((at, height)))
    }
}

impl Home {
    /// The same in the words of the family, if it is known.
    #[must_use]
    pub fn origin(&self) -> Option<Origin> {
        let Self { latitude, longitude, altitude, known } = *self;
        known.then_some(Origin { latitude, longitude, altitude })
    }
}
