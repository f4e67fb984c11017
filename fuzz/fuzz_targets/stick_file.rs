//! libFuzzer's entry to [`fuzz_checks::stick_file`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::stick_file(data));
