//! libFuzzer's entry to [`fuzz_checks::services_mavlink`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::services_mavlink(data));
