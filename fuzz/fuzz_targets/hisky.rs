//! libFuzzer's entry to [`stampfly_fuzz::hisky`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::hisky(data));
