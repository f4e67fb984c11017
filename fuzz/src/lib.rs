//! Fuzz targets: what reads bytes from outside must survive any bytes.
//!
//! Each target is a plain function that panics when something is wrong. libFuzzer calls it (`fuzz_targets/`), and so does a
//! test on the stable compiler (`cargo xtask fuzz`), with every file of the target's corpus and some thousands of
//! mutations of them.
//!
//! | target | bytes from | checked besides panics |
//! |---|---|---|
//! | [`console_line`] | the serial port | lines stay short and printable, parameters in range, an armed vehicle does nothing |
//! | [`parameter_image`] | flash, left by other firmware or a power cut | values in range, what was saved is loaded |
//! | [`radio_packets`] | the radio | accepted packets mean the same when sent again, the armed keep their transmitter |
//! | [`rover_datagrams`] | UDP and CSV files | what is accepted is accepted again, as bytes and as text |
//! | [`ulog`] | log files | the reader moves on, offsets lie in the file, values lie in their payload |
//!
//! With a nightly compiler and cargo-fuzz: `cargo +nightly fuzz run console_line`. A file that fails goes into
//! `fuzz/corpus/TARGET`, so that the test keeps it.

mod console;
mod datagrams;
mod flash;
mod packets;
mod parameters;
mod ulog_file;

pub use console::console_line;
pub use datagrams::rover_datagrams;
pub use packets::radio_packets;
pub use parameters::parameter_image;
pub use ulog_file::ulog;

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

    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

#[cfg(test)]
mod smoke;
