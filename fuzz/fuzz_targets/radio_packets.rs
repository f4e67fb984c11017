//! libFuzzer's entry to [`fuzz_checks::radio_packets`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::radio_packets(data));
