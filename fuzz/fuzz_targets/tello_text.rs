//! libFuzzer's entry to [`fuzz_checks::tello_text`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::tello_text(data));
