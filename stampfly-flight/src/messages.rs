//! Messages of a board: what every vehicle on one needs beside what flies it.
//!
//! For a topic table to name. A vehicle's own messages are declared beside its table.

use stampfly_types::{Instant, message};

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

message! {
    /// A parameter was changed. A gain is flown at once; with any other, each runnable that holds it begins again when the vehicle is disarmed.
    pub struct ParameterChange {
        /// Its place in the vehicle's table.
        index: u32,
        /// What it is now, in its unit.
        value: f32 ["SI"],
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

impl MotorTest {
    /// When it ends.
    #[must_use]
    pub const fn end(&self) -> Instant {
        Instant::from_micros(self.until)
    }
}
