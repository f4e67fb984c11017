//! libFuzzer's entry to [`fuzz_checks::ulog`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::ulog(data));
