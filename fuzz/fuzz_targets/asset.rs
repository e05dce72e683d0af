//! Reading an asset, and whatever can be asked of one that was read: outlines on its polytope and off it by every method.
#![no_main]

use silmap_map::asset;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let asset = match asset::read(bytes) {
        Ok(asset) => asset,
        Err(fault) => return assert!(silmap_fuzz::is_one_sentence(&fault.to_string()), "{fault}"),
    };
    let _ = asset::sizes(bytes).expect("what can be read has sizes");
    silmap_fuzz::look_at(&asset);
});
