//! libFuzzer's entry to [`fuzz_checks::hil_frames`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::hil_frames(data));
