//! Reading an asset, and whatever can be asked of one that was read: outlines on its polytope and off it by every method, fewer views.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| silmap_fuzz::read_asset(bytes));
