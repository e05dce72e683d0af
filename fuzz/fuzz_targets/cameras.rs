//! Reading camera files of every kind, with masks that go with them, and taking lenses out.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| silmap_fuzz::cameras::read(bytes));
