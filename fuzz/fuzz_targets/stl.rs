//! Reading meshes in the format of `.stl`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| silmap_fuzz::read_mesh(bytes, "stl"));
