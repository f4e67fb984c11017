//! libFuzzer's entry to [`fuzz_checks::whole_stack`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::whole_stack(data));
