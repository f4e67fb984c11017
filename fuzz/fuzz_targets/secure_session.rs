//! libFuzzer's entry to [`stampfly_fuzz::secure_session`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::secure_session(data));
