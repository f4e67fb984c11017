//! libFuzzer's entry to [`fuzz_checks::ground_ask`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::ground_ask(data));
