//! One small program per crate, each runs on a PC: `cargo run -p stampfly-examples --example NAME`.
//!
//! | name | crate | shows |
//! |---|---|---|
//! | `types` | `stampfly-types` | declaring a message, its words and its schema |
//! | `bus` | `stampfly-bus` | a vehicle of two topics and two runnables |
//! | `eskf` | `stampfly-eskf` | height and climb rate from a noisy accelerometer and range finder |
//! | `control` | `stampfly-control` | a rate loop that learns a disturbance, on a hexacopter's mixer |
//! | `mode` | `stampfly-mode` | a flight through the state table, and what refuses to arm |
//! | `log` | `stampfly-log` | writing a log and reading it back |
//! | `link` | `stampfly-link` | a vehicle that looks for a transmitter in a room full of them |
//! | `param` | `stampfly-param` | a value that survives the power cut in the middle of its change |
//! | `drivers` | `stampfly-drivers` | motors on any PWM channel |
//! | `sim` | `stampfly-sim` | a hop on virtual time that nobody stabilises |
