//! libFuzzer's entry to [`fuzz_checks::hisky`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::hisky(data));
