//! libFuzzer's entry to [`stampfly_fuzz::rover_datagrams`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::rover_datagrams(data));
