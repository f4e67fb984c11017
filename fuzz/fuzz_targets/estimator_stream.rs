//! libFuzzer's entry to [`fuzz_checks::estimator_stream`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::estimator_stream(data));
