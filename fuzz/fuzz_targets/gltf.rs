//! Reading glTF, binary or as JSON with its buffers in the text: the first bytes say which.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| silmap_fuzz::read_mesh(bytes, "gltf"));
