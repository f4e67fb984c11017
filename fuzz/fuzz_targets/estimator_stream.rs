//! libFuzzer's entry to [`stampfly_fuzz::estimator_stream`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::estimator_stream(data));
