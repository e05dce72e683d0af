//! STL as tools write it.

use super::*;

#[test]
fn binary_stl_has_face_colours_in_two_ways() {
    let plain = PYRAMID_FILES
        .iter()
        .find(|(e, _)| *e == "stl")
        .unwrap()
        .1
        .clone();
    assert!(read(&plain, "stl").unwrap().mesh.appearance.is_plain());
    let with = |header: &[u8], fields: [u16; 2]| {
        let mut bytes = plain.clone();
        bytes[..80].fill(b' ');
        bytes[..header.len()].copy_from_slice(header);
        for (face, field) in fields.into_iter().enumerate() {
            let at = 84 + 50 * (face + 1) - 2;
            bytes[at..at + 2].copy_from_slice(&field.to_le_bytes());
        }
        let look = read(&bytes, "stl").unwrap().mesh.appearance;
        [0, 1, 2].map(|f| look.corner_colours[f][0])
    };
    let (red, blue, white) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]);
    assert_eq!(
        with(b"", [0x8000 | 31 << 10, 31 << 10]),
        [red, white, white]
    );
    let whole = b"made by hand COLOR=\xFF\xFF\xFF\xFF,MATERIAL=";
    assert_eq!(with(whole, [31, 31 << 10])[..2], [red, blue]);
    assert_eq!(with(whole, [0x8000, 31])[..2], [white, red]);
}
