//! libFuzzer's entry to [`fuzz_checks::secure_session`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::secure_session(data));
