//! Speeds, heights and times of the take-off and landing manager.

use stampfly_types::Duration;

/// Limits of take-off and landing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LandingConfig {
    /// Rise above the take-off spot that counts as airborne, m.
    pub airborne_rise: f32,
    /// Climb rate that counts as airborne, m/s.
    pub airborne_speed: f32,
    /// Thrust that carries the weight, N. A tenth more of it counts as airborne where no range shows a rise, and what needs only half of it
    /// while it lands is carried by something else. Infinite, as by default, it says nothing: for a vehicle of which it is not known.
    pub hover_thrust: f32,
    /// Descent speed, m/s.
    pub descent: f32,
    /// Descent speed at the ground, m/s.
    pub touchdown: f32,
    /// Below this height the descent slows down, m.
    pub flare_height: f32,
    /// Below this height the thrust ceiling begins to fall, m.
    pub ceiling_height: f32,
    /// Where the ceiling ends, share of hover thrust.
    pub ceiling_share: f32,
    /// How long the ceiling takes to get there.
    pub ceiling_time: Duration,
    /// Slower than this, or upwards, is not sinking, m/s.
    pub still_speed: f32,
    /// Not sinking for this long although it is asked to, the vehicle may stand: the thrust ceiling begins to fall at any
    /// height.
    pub stall_time: Duration,
    /// Standing for this long with the ceiling down is touchdown.
    pub touchdown_time: Duration,
    /// Where the thrust ceiling of a take-off begins, share of hover thrust. A vehicle whose height does not seem to change,
    /// because something holds it or a range finder is stuck, is not thrown up.
    pub takeoff_ceiling: f32,
    /// How fast it rises, 1/s: one that is heavier than it knows takes off later.
    pub takeoff_ceiling_rise: f32,
    /// Within this band of its goal take-off has arrived, m.
    pub takeoff_band: f32,
    /// Vertical speed with which take-off has arrived, m/s.
    pub takeoff_speed: f32,
    /// Vertical speed of the path that has arrived, m/s.
    pub takeoff_path_speed: f32,
    /// Time in the band that completes take-off.
    pub takeoff_settle: Duration,
    /// Time after which the take-off of a vehicle that has left the ground is complete, wherever it is.
    pub takeoff_limit: Duration,
}

impl Default for LandingConfig {
    /// Speeds, heights and times for flights indoors.
    fn default() -> Self {
        Self {
            airborne_rise: 0.05,
            // Twice `still_speed`, as for `takeoff_speed`: what the estimate of a vehicle that stands does not reach.
            airborne_speed: 0.16,
            hover_thrust: f32::INFINITY,
            descent: 0.3,
            touchdown: 0.15,
            flare_height: 0.3,
            ceiling_height: 0.06,
            // With less than two thirds of its weight carried, a vehicle that does not sink stands.
            ceiling_share: 0.6,
            ceiling_time: Duration::from_millis(800),
            still_speed: 0.08,
            stall_time: Duration::from_secs(1),
            touchdown_time: Duration::from_millis(300),
            // 2 m/s², which the path of a take-off asks for.
            takeoff_ceiling: 1.2,
            takeoff_ceiling_rise: 0.2,
            takeoff_band: 0.06,
            takeoff_speed: 0.16,
            takeoff_path_speed: 0.02,
            takeoff_settle: Duration::from_millis(400),
            takeoff_limit: Duration::from_secs(8),
        }
    }
}
