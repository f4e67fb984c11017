//! libFuzzer's entry to [`stampfly_fuzz::compact_record`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stampfly_fuzz::compact_record(data));
