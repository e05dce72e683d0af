//! Reading a saved cone forest for a mesh it may belong to, and searching it from a few eyes.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| silmap_fuzz::read_forest(bytes));
