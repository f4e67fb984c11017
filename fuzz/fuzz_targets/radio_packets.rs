//! libFuzzer's entry to [`stampfly_fuzz::radio_packets`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::radio_packets(data));
