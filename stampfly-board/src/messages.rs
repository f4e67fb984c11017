//! Messages of this vehicle alone, declared beside its topic table.

pub use stampfly_flight::messages::{
    CutoffState, MotorTest, PairingRequest, ParameterChange, RestartRequest, StorageBusy,
};
pub use stampfly_link::LinkPeer;
use stampfly_types::messages::{Alerts, ArmBlocks, FlightMode, FlightPhase};
use stampfly_types::{Vec3, message};

message! {
    /// The board's button as its pin shows it, not debounced.
    pub struct ButtonContact {
        /// Closed?
        pressed: bool,
    }
}

message! {
    /// What a ground station needs to know, at a rate a radio can carry.
    pub struct TelemetryFrame {
        /// Where the vehicle is in its life.
        phase: FlightPhase,
        /// The flight mode.
        mode: FlightMode,
        /// May the motors turn?
        armed: bool,
        /// Why arming would be refused.
        blocks: ArmBlocks,
        /// What the failsafe has found.
        alerts: Alerts,
        /// Estimated position, world NED.
        position: Vec3 ["m"],
        /// Estimated velocity, world NED.
        velocity: Vec3 ["m/s"],
        /// Estimated roll, pitch, yaw.
        attitude: Vec3 ["rad"],
        /// Battery voltage.
        battery: f32 ["V"],
        /// Way-points still ahead.
        remaining: u32,
        /// Is the route finished?
        arrived: bool,
    }
}
