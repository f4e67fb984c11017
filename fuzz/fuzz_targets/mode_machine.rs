//! libFuzzer's entry to [`fuzz_checks::mode_machine`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::mode_machine(data));
