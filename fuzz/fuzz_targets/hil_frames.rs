//! libFuzzer's entry to [`stampfly_fuzz::hil_frames`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::hil_frames(data));
