//! libFuzzer's entry to [`fuzz_checks::parameter_image`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::parameter_image(data));
