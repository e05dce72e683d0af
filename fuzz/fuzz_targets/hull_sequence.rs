//! Reading a saved hull sequence, and making hulls of it.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| silmap_fuzz::read_sequence(bytes));
