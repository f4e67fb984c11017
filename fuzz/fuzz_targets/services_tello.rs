//! libFuzzer's entry to [`stampfly_fuzz::services_tello`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::services_tello(data));
