//! libFuzzer's entry to [`stampfly_fuzz::mode_machine`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::mode_machine(data));
