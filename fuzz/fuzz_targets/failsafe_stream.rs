//! libFuzzer's entry to [`stampfly_fuzz::failsafe_stream`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::failsafe_stream(data));
