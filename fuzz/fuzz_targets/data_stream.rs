//! libFuzzer's entry to [`stampfly_fuzz::data_stream`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::data_stream(data));
