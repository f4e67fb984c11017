//! libFuzzer's entry to [`fuzz_checks::receiver_bytes`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::receiver_bytes(data));
