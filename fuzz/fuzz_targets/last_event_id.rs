#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| skyduct_fuzz::last_event_id(bytes));
