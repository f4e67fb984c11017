//! libFuzzer's entry to [`stampfly_fuzz::ulog`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::ulog(data));
