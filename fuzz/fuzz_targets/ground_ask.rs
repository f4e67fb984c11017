//! libFuzzer's entry to [`stampfly_fuzz::ground_ask`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::ground_ask(data));
