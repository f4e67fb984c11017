//! libFuzzer's entry to [`fuzz_checks::failsafe_stream`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::failsafe_stream(data));
