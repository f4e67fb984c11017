//! libFuzzer's entry to [`stampfly_fuzz::console_line`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::console_line(data));
