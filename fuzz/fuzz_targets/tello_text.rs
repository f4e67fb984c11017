//! libFuzzer's entry to [`stampfly_fuzz::tello_text`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::tello_text(data));
