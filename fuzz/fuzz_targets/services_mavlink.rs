//! libFuzzer's entry to [`stampfly_fuzz::services_mavlink`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::services_mavlink(data));
