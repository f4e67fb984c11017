//! Messages of this vehicle alone, declared beside its topic table.

use stampfly_types::messages::{Alerts, ArmBlocks, FlightMode, FlightPhase};
use stampfly_types::{Instant, Vec3, message};

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

message! {
    /// One motor to turn. Ignored while the vehicle is armed, and over when it has been armed since.
    pub struct MotorTest {
        /// 1 to 4; 0 for none.
        motor: u32,
        /// Share of the full duty.
        duty: f32,
        /// When it ends, µs since power-on.
        until: u64 ["us"],
    }
}

message! {
    /// Is flash being written? It stops both cores for up to 200 ms, so no motor may turn.
    pub struct StorageBusy {
        /// From before the first write to after the last.
        busy: bool,
    }
}

message! {
    /// Look for another transmitter, or stop looking.
    pub struct PairingRequest {
        /// Look for one?
        wanted: bool,
    }
}

message! {
    /// A transmitter's address.
    pub struct LinkPeer {
        /// Its six bytes, the first one highest.
        address: u64,
    }
}

message! {
    /// The processor is to be restarted.
    pub struct RestartRequest {
        /// Always true.
        requested: bool,
    }
}

message! {
    /// State of the cut-off, which stops motors that the flight task does not confirm.
    pub struct CutoffState {
        /// Has it stopped the motors, and not been reset since?
        tripped: bool,
    }
}

impl MotorTest {
    /// When it ends.
    #[must_use]
    pub const fn end(&self) -> Instant {
        Instant::from_micros(self.until)
    }
}
