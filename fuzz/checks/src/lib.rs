//! Fuzz targets: what reads bytes from outside must survive any bytes, and what flies any sequence of inputs.
//!
//! Each target is a plain function that panics when something is wrong. libFuzzer calls it
//! (`fuzz/fuzz_targets`), and so does a test of this crate, with every file of the target's corpus
//! (`fuzz/corpus`) and some thousands of mutations of them.
//!
//! | target | bytes from | checked besides panics |
//! |---|---|---|
//! | [`compact_record`] | flight records in files | damage is an error or a gap, a whole chunk is read as it was written |
//! | [`console_line`] | the serial port | lines stay short and printable, parameters in range, an armed vehicle does nothing |
//! | [`data_stream`] | UDP, and a vehicle that fills packets | packets mean the same when sent again, are never too long, hold what was taken |
//! | [`estimator_stream`] | a stream of samples and times | numbers stay finite, the covariance symmetric with a diagonal of variances |
//! | [`failsafe_stream`] | a stream of inertial samples | a sensor that gives nothing usable is found in time, an alert stays while the vehicle is armed |
//! | [`ground_ask`] | a WebSocket of the ground station | numbers are finite and in range, what is accepted is accepted again |
//! | [`ground_http`] | a browser | a head has an end, a refusal stays one, what follows a head means nothing |
//! | [`hil_frames`] | a line with a computer that simulates the world | the vehicle answers whole frames alone, its clock is its own, entries end |
//! | [`hisky`] | a receiver's radio | the armed keep their transmitter, the radio is told channels that it has |
//! | [`mode_machine`] | steps with any commands, gestures, frames, alerts | a kill disarms in its step, phases change by the table, order does not matter |
//! | [`parameter_image`] | flash, left by other firmware or a power cut | values in range, what was saved is loaded |
//! | [`radio_packets`] | the radio | accepted packets mean the same when sent again, the armed keep their transmitter |
//! | [`receiver_bytes`] | a radio receiver or a configurator at a UART | frames mean the same when sent again, every byte is accounted for |
//! | [`rover_datagrams`] | UDP and CSV files | what is accepted is accepted again, as bytes and as text |
//! | [`stick_file`] | files of a pilot's sticks | numbers are in range, times ascend, what is written is read as it was |
//! | [`tello_text`] | any program on the network | what is accepted is within limits, every answer is text that can be read |
//! | [`services_cable`] | a person and programs on one serial line | a line that is typed comes whole, what is sent is sound, an armed vehicle changes nothing |
//! | [`services_mavlink`] | ground stations, three at once, with a key and without | what is sent is sound, a command is acknowledged, strangers are not obeyed |
//! | [`services_msp`] | a configurator | what is sent is sound, an armed vehicle changes nothing |
//! | [`services_tello`] | programs that speak a Tello's text, three at once | every answer is text, what is asked of the vehicle is within limits |
//! | [`secure_session`] | the radio, from strangers and from whoever has the key | what was changed or heard before is refused, and is no sign of life |
//! | [`whole_stack`] | edits of all that a flying vehicle is given | every invariant that an open loop can keep |
//! | [`ulog`] | log files | the reader moves on, offsets lie in the file, values lie in their payload |
//!
//! With cargo-fuzz: `cargo fuzz run --sanitizer none console_line`, or all of them with `cargo xtask search SECONDS`. A file that fails goes into
//! `fuzz/corpus/TARGET`, so that the test keeps it.

mod compact_record;
mod console;
mod datagrams;
mod estimator;
mod failsafe;
mod flash;
mod hil;
mod hisky;
mod http;
mod machine;
mod packets;
mod parameters;
mod receivers;
mod secured;
mod services;
mod stack;
mod sticks;
mod stream;
mod tello;
mod ulog_file;

pub use compact_record::compact_record;
pub use console::console_line;
pub use datagrams::rover_datagrams;
pub use estimator::estimator_stream;
pub use failsafe::failsafe_stream;
pub use hil::hil_frames;
pub use hisky::hisky;
pub use http::{ground_ask, ground_http};
pub use machine::mode_machine;
pub use packets::radio_packets;
pub use parameters::parameter_image;
pub use receivers::receiver_bytes;
pub use secured::secure_session;
pub use services::{services_cable, services_mavlink, services_msp, services_tello};
pub use stack::whole_stack;
pub use sticks::stick_file;
pub use stream::data_stream;
pub use tello::tello_text;
pub use ulog_file::ulog;

use stampfly_types::Vec3;

/// Takes bytes off the front of the input. Past its end everything is zero, so any input is a whole one.
struct Input<'d>(&'d [u8]);

impl<'d> Input<'d> {
    fn byte(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        *first
    }

    fn bytes(&mut self, count: usize) -> &'d [u8] {
        let (taken, rest) = self.0.split_at(count.min(self.0.len()));
        self.0 = rest;
        taken
    }

    /// A number: mostly near what a sensor gives, at times any bits at all, and so no number, infinite or tiny.
    fn number(&mut self, scale: f32) -> f32 {
        match self.byte() {
            255 => f32::from_bits(u32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()])),
            254 => f32::NAN,
            253 => f32::INFINITY,
            byte => (f32::from(byte) - 126.0) / 126.0 * scale,
        }
    }

    fn vector(&mut self, scale: f32) -> Vec3 {
        Vec3::new(self.number(scale), self.number(scale), self.number(scale))
    }

    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
