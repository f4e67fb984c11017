//! libFuzzer's entry to [`stampfly_fuzz::whole_stack`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::whole_stack(data));
