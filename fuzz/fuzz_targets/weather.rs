#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| skyduct_fuzz::weather(bytes));
