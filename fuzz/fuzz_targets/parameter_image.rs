//! libFuzzer's entry to [`stampfly_fuzz::parameter_image`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::parameter_image(data));
