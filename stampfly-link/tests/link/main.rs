//! Wire formats, pairing and the secure session. One binary, because each would link the crate `mavlink` again:
//! `cargo test -p stampfly-link --test link secure_attacks` runs one file.

mod air;
mod bit_flips;
mod broadcast;
mod crsf_telemetry;
mod datagrams;
mod hex;
mod hisky;
mod joystick;
#[cfg(feature = "mavlink")]
mod mavlink;
mod msp;
mod packets;
mod peers;
mod secure_attacks;
mod secure_commands;
mod secure_payloads;
mod secure_vectors;
mod serial;
mod session;
mod slots;
mod stream;
mod tello;
