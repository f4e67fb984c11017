//! libFuzzer's entry to [`stampfly_fuzz::services_cable`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::services_cable(data));
