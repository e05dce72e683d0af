//! Putting an asset's data back into a file that another program wrote.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| silmap_fuzz::attach_to(bytes));
