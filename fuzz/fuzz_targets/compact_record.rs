//! libFuzzer's entry to [`fuzz_checks::compact_record`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_checks::compact_record(data));
