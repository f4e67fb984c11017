//! libFuzzer's entry to [`stampfly_fuzz::receiver_bytes`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::receiver_bytes(data));
