//! libFuzzer's entry to [`fuzz_checks::rover_datagrams`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::rover_datagrams(data));
