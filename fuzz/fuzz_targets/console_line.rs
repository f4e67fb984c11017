//! libFuzzer's entry to [`fuzz_checks::console_line`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::console_line(data));
