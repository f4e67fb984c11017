//! libFuzzer's entry to [`fuzz_checks::services_tello`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::services_tello(data));
