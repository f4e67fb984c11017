//! libFuzzer's entry to [`fuzz_checks::data_stream`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::data_stream(data));
