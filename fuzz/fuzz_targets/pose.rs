//! Reading the camera that `align` starts from.
#![no_main]

#[path = "../../tools/silmap-cli/src/pose_file.rs"]
mod pose_file;

use glam::DVec3;

libfuzzer_sys::fuzz_target!(|text: &str| {
    match pose_file::parse(
        text,
        ((64, 48), None),
        DVec3::X,
        (DVec3::new(0.0, 2.0, 3.0), 0.5),
    ) {
        Ok(camera) => {
            assert!(camera.eye.is_finite() && camera.forward.is_finite());
            let _ = camera.image_from_object(DVec3::new(1.0, 2.5, 3.0));
        }
        Err(fault) => assert!(silmap_fuzz::is_one_sentence(&format!("{fault:#}"))),
    }
});
