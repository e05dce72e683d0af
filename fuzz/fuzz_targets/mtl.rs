//! Reading a material library beside a small OBJ file that uses it, and what it names for a texture.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

const MODEL: &[u8] =
    b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\n\
    f 1/1 3/3 2/2\nf 1/1 2/2 4/3\nf 2/2 3/3 4/1\nf 3/3 1/1 4/2\n";

/// A folder of this process alone; it stays behind, as fuzzers end without a word.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = tempfile::tempdir()
        .expect("there is room for a folder")
        .keep();
    let picture =
        image::RgbImage::from_fn(2, 2, |x, y| image::Rgb([x as u8 * 255, y as u8 * 255, 128]));
    picture
        .save(folder.join("t.png"))
        .expect("there is room for a picture");
    folder
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    std::fs::write(FOLDER.join("m.mtl"), bytes).expect("there is room for the library");
    silmap_fuzz::read_mesh_at(MODEL, &FOLDER.join("m.obj"));
});
