//! The mask of a camera: out of a picture file, out of the alpha channel of a photograph, or by a rule out of the photograph itself.
//!
//! Cameras belong to the pixels of a file as they are stored: so COLMAP and its kin read photographs, whatever EXIF says about turning
//! them for people. A picture is therefore turned only where its size leaves no doubt that the camera means the turned one: stored it
//! does not fit the camera's image, and turned it does. A mask that somebody made of the turned photograph is turned back alike. Each is
//! said in a note; where a picture fits neither way it is refused.
//!
//! A mask may have a whole multiple of the camera's columns and rows, or the same part of both.

use std::path::Path;

use glam::DVec2;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageReader};
use silmap_geometry::{Loop, Mask};
use silmap_mesh_io::input;

use crate::levels::Levels;
use crate::mask_image::{Decoded, MaskFault, checked, decoded, levels_of, of_alpha};
use crate::mask_rule::MaskRule;

/// How masks are read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaskOptions {
    /// Black, or transparent, is the object in mask files.
    pub is_inverted: bool,
    /// How masks are made of photographs that have none.
    pub rule: Option<MaskRule>,
}

/// A mask in the image of a camera.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CameraMask {
    pub(crate) mask: Mask,
    /// In pixels of the camera's image.
    pub(crate) outline: Vec<Loop>,
    /// What was unusual, one clause each.
    pub(crate) notes: Vec<String>,
}

/// Reads a mask for an image of this size. `photo` is the photograph that it belongs to.
///
/// # Errors
/// When the file cannot be read or understood, has no size that fits, or shows no outline.
pub(crate) fn read(
    path: &Path,
    (photo, size): (Option<&Path>, (u32, u32)),
    options: &MaskOptions,
) -> Result<CameraMask, MaskFault> {
    let (picture, mut notes) = fitting(path, (photo, size), true)?;
    let mut levels = levels_of(&picture, &mut notes)?;
    if options.is_inverted {
        levels = levels.inverted();
    }
    in_image(&levels, size, notes)
}

/// Reads the alpha channel of a photograph as a mask; `None` where it has none, or says nothing.
///
/// # Errors
/// As [`read`].
pub(crate) fn read_alpha(photo: &Path, size: (u32, u32)) -> Result<Option<CameraMask>, MaskFault> {
    // Most photographs have no alpha, and need not be decoded to see that.
    if !has_alpha(photo) {
        return Ok(None);
    }
    let (picture, notes) = fitting(photo, (None, size), true)?;
    let levels = of_alpha(&picture);
    levels
        .map(|levels| in_image(&levels, size, notes))
        .transpose()
}

/// Makes a mask of a photograph by a rule.
///
/// # Errors
/// As [`read`].
pub(crate) fn by_rule(
    photo: &Path,
    size: (u32, u32),
    rule: MaskRule,
) -> Result<CameraMask, MaskFault> {
    let (picture, notes) = fitting(photo, (None, size), true)?;
    in_image(&rule.levels(&picture), size, notes).map_err(|fault| match fault {
        MaskFault::Blank { what } => MaskFault::RuleFinds { what },
        other => other,
    })
}

/// Reads a photograph for an image of this size, turned where its size shows that the camera means the turned one.
///
/// # Errors
/// When it cannot be read, is no picture, is too large, or has another size.
pub(crate) fn read_photo(path: &Path, size: (u32, u32)) -> Result<DynamicImage, MaskFault> {
    fitting(path, (None, size), false).map(|found| found.0)
}

/// Columns and rows of a picture as it is stored, by its header; `None` where it cannot be read.
pub(crate) fn size_of(path: &Path) -> Option<(u32, u32)> {
    decoder_of(path).map(|d| d.dimensions())
}

/// Whether a photograph fits a camera's image, by its header.
///
/// # Errors
/// Why not, as a clause that names the file.
pub(crate) fn fits(path: &Path, size: (u32, u32)) -> Result<(), String> {
    let shown = path.display();
    let Some((width, height)) = size_of(path) else {
        return Err(format!("{shown} is not there, or no picture"));
    };
    let is_turned = || turns_aside(orientation_of(path)) && (height, width) == size;
    if (width, height) == size || is_turned() {
        return Ok(());
    }
    let (wanted_width, wanted_height) = size;
    Err(format!(
        "{shown} has {width} × {height} pixels, not {wanted_width} × {wanted_height}"
    ))
}

/// The mask of levels in an image, and its outline.
fn in_image(
    levels: &Levels,
    size: (u32, u32),
    mut notes: Vec<String>,
) -> Result<CameraMask, MaskFault> {
    let (width, height) = levels.size();
    let mut outline = levels.outline();
    if (width, height) == size {
        let mask = checked(levels.mask())?;
        return Ok(CameraMask {
            mask,
            outline,
            notes,
        });
    }
    let scale = DVec2::new(
        f64::from(size.0) / f64::from(width),
        f64::from(size.1) / f64::from(height),
    );
    for point in outline.iter_mut().flatten() {
        *point *= scale;
    }
    if width < size.0 {
        notes.push(format!(
            "it has {width} × {height} pixels and the image {} × {}: its outline is as coarse",
            size.0, size.1
        ));
    }
    let mask = checked(levels.resampled(size))?;
    Ok(CameraMask {
        mask,
        outline,
        notes,
    })
}

/// Whether a size is a camera's, or where allowed a whole multiple or part of it along both axes.
fn is_fitting((width, height): (u32, u32), (wanted, tall): (u32, u32), may_scale: bool) -> bool {
    let is_multiple = |a: u32, b: u32, c: u32, d: u32| {
        a > 0 && b > 0 && c.is_multiple_of(a) && d.is_multiple_of(b) && c / a == d / b
    };
    let is_scaled =
        is_multiple(width, height, wanted, tall) || is_multiple(wanted, tall, width, height);
    (width, height) == (wanted, tall) || may_scale && is_scaled
}

fn turns_aside(orientation: Orientation) -> bool {
    matches!(
        orientation,
        Orientation::Rotate90
            | Orientation::Rotate270
            | Orientation::Rotate90FlipH
            | Orientation::Rotate270FlipH
    )
}

/// A picture in the frame of a camera's image.
fn fitting(
    path: &Path,
    (photo, size): (Option<&Path>, (u32, u32)),
    may_scale: bool,
) -> Result<(DynamicImage, Vec<String>), MaskFault> {
    let Decoded {
        mut picture,
        orientation,
    } = decoded(&input::read(path).map_err(MaskFault::Unreadable)?)?;
    let (width, height) = (picture.width(), picture.height());
    let fits = |is_aside: bool| {
        let turned = if is_aside {
            (height, width)
        } else {
            (width, height)
        };
        is_fitting(turned, size, may_scale)
    };
    let mut notes = Vec::new();
    if fits(false) {
        if orientation != Orientation::NoTransforms {
            notes.push(format!(
                "EXIF says that it is to be turned for people (orientation {}): it is taken as it is stored, as its camera has that size",
                orientation.to_exif()
            ));
        }
        return Ok((picture, notes));
    }
    if turns_aside(orientation) && fits(true) {
        notes.push(format!(
            "it is turned as EXIF says (orientation {}): its camera has that size",
            orientation.to_exif()
        ));
        picture.apply_orientation(orientation);
        return Ok((picture, notes));
    }
    let of_photo = photo.map_or(Orientation::NoTransforms, orientation_of);
    if turns_aside(of_photo) && fits(true) {
        notes.push(format!(
            "it was made of the photograph turned as EXIF says (orientation {}): it is turned back",
            of_photo.to_exif()
        ));
        picture.apply_orientation(inverse(of_photo));
        return Ok((picture, notes));
    }
    Err(MaskFault::OtherSize {
        width,
        height,
        wanted_width: size.0,
        wanted_height: size.1,
    })
}

fn inverse(orientation: Orientation) -> Orientation {
    match orientation {
        Orientation::Rotate90 => Orientation::Rotate270,
        Orientation::Rotate270 => Orientation::Rotate90,
        // The others undo themselves.
        other => other,
    }
}

/// What a picture's header says; known by its content and not by its name.
fn decoder_of(path: &Path) -> Option<impl ImageDecoder + use<>> {
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    reader.ok()?.into_decoder().ok()
}

/// What EXIF says; nothing where the file cannot be read.
fn orientation_of(path: &Path) -> Orientation {
    let found = decoder_of(path).and_then(|mut d| d.orientation().ok());
    found.unwrap_or(Orientation::NoTransforms)
}

fn has_alpha(path: &Path) -> bool {
    // A file that cannot be read is looked at again, to say why.
    decoder_of(path).is_none_or(|d| d.color_type().has_alpha())
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma, LumaA, RgbImage};

    use super::*;

    const SIZE: (u32, u32) = (24, 20);

    fn read_plain(path: &Path, size: (u32, u32)) -> Result<CameraMask, MaskFault> {
        read(path, (None, size), &MaskOptions::default())
    }

    fn is_disc(x: u32, y: u32) -> bool {
        (f64::from(x) - 10.0).hypot(f64::from(y) - 12.0) < 7.0
    }

    #[test]
    fn soft_hard_and_tiny_values_are_cut_alike() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        let mut disc = Mask::new(SIZE.0, SIZE.1);
        for (x, y) in (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y))) {
            disc.set(x, y, is_disc(x, y));
        }
        for (inside, outside) in [(255_u8, 0_u8), (1, 0), (200, 100), (130, 120)] {
            let value = |x, y| Luma([if is_disc(x, y) { inside } else { outside }]);
            GrayImage::from_fn(24, 20, value).save(&path).unwrap();
            assert_eq!(
                read_plain(&path, SIZE).unwrap().mask,
                disc,
                "{inside} {outside}"
            );
        }
        // Alpha decides, whatever the colours.
        image::ImageBuffer::from_fn(24, 20, |x, y| LumaA([9_u8, 255 * u8::from(is_disc(x, y))]))
            .save(&path)
            .unwrap();
        assert_eq!(read_plain(&path, SIZE).unwrap().mask, disc);
        assert_eq!(read_alpha(&path, SIZE).unwrap().map(|m| m.mask), Some(disc));
        RgbImage::new(24, 20).save(&path).unwrap();
        assert_eq!(read_alpha(&path, SIZE).unwrap(), None);
    }

    /// An object that fills all corners of an image is no background.
    #[test]
    fn masks_of_a_capture_are_never_turned() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        let value = |x, y| Luma([if is_disc(x, y) { 0_u8 } else { 255 }]);
        GrayImage::from_fn(24, 20, value).save(&path).unwrap();
        let CameraMask { mask, notes, .. } = read_plain(&path, SIZE).unwrap();
        assert!(mask.get(0, 0) && !mask.get(10, 12) && notes.is_empty());
        assert!(!crate::mask_image::read(&path).unwrap().mask.get(0, 0));
    }

    #[test]
    fn what_shows_no_outline_or_has_another_size_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mask.png");
        let message = || read_plain(&path, (4, 4)).unwrap_err().to_string();
        assert!(message().starts_with("cannot be read"));
        for (value, word) in [(0, "(black)"), (255, "(white)")] {
            GrayImage::from_pixel(4, 4, Luma([value]))
                .save(&path)
                .unwrap();
            assert!(message().contains(word), "{}", message());
        }
        GrayImage::new(3, 4).save(&path).unwrap();
        assert_eq!(message(), "it has 3 × 4 pixels, not 4 × 4");
        std::fs::write(&path, "what is this?").unwrap();
        assert!(message().contains("a picture is needed"));
    }

    /// A JPEG of a grey picture whose EXIF says how to turn it for people.
    fn jpeg(picture: &GrayImage, orientation: u8) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100);
        picture.write_with_encoder(encoder).unwrap();
        let mut bytes = bytes.into_inner();
        // A TIFF header and one entry: tag 0x0112, a short.
        let mut exif = b"Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
        exif.extend([orientation, 0, 0, 0, 0, 0, 0]);
        let length = (exif.len() as u16 + 2).to_be_bytes();
        let segment = [&[0xff, 0xe1], &length[..], &exif].concat();
        bytes.splice(2..2, segment);
        bytes
    }

    /// The picture that a program shows which turns pictures as EXIF says.
    fn shown(picture: &GrayImage, orientation: u8) -> GrayImage {
        let mut turned = DynamicImage::from(picture.clone());
        turned.apply_orientation(Orientation::from_exif(orientation).unwrap());
        turned.into_luma8()
    }

    #[test]
    fn pictures_are_turned_where_their_size_leaves_no_doubt() {
        let folder = tempfile::tempdir().unwrap();
        let (photo, path) = (folder.path().join("photo.jpg"), folder.path().join("mask"));
        let disc = GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| Luma([255 * u8::from(is_disc(x, y))]));
        let read_beside = |size| read(&path, (Some(&photo), size), &MaskOptions::default());
        let is_disc_of = |found: &CameraMask, picture: &GrayImage| {
            let mut wanted = Mask::new(picture.width(), picture.height());
            for (x, y, pixel) in picture.enumerate_pixels() {
                wanted.set(x, y, pixel.0[0] > 127);
            }
            found.mask.count_different(&wanted) == 0
        };
        for orientation in 1..=8 {
            let is_aside = orientation > 4;
            let upright = shown(&disc, orientation);
            let turned_size = upright.dimensions();
            std::fs::write(&photo, jpeg(&disc, orientation)).unwrap();
            // The camera has the stored size: the photograph is taken as it is, whatever EXIF says.
            assert_eq!(
                read_photo(&photo, SIZE).unwrap().to_luma8().dimensions(),
                SIZE
            );
            assert!(fits(&photo, SIZE).is_ok());
            // A mask of the stored photograph, with the same EXIF.
            std::fs::write(&path, jpeg(&disc, orientation)).unwrap();
            let found = read_beside(SIZE).unwrap();
            assert!(is_disc_of(&found, &disc), "{orientation}");
            assert_eq!(
                found.notes.is_empty(),
                orientation == 1,
                "{:?}",
                found.notes
            );
            // The camera has the size of the photograph as it is shown: both are turned.
            assert_eq!(
                fits(&photo, turned_size).is_ok(),
                is_aside || turned_size == SIZE
            );
            if is_aside {
                let picture = read_photo(&photo, turned_size).unwrap().into_luma8();
                let off = picture.pixels().zip(upright.pixels());
                assert!(
                    off.into_iter().all(|(a, b)| a.0[0].abs_diff(b.0[0]) < 40),
                    "{orientation}"
                );
                let found = read_beside(turned_size).unwrap();
                assert!(is_disc_of(&found, &upright), "{orientation}");
                // A mask that was made of the photograph as it is shown is turned back.
                upright
                    .save_with_format(&path, image::ImageFormat::Png)
                    .unwrap();
                let found = read_beside(SIZE).unwrap();
                assert!(is_disc_of(&found, &disc), "{orientation}");
                assert!(found.notes[0].contains("turned back"), "{:?}", found.notes);
            }
        }
        // Without EXIF nothing says which way.
        std::fs::write(&photo, jpeg(&disc, 1)).unwrap();
        shown(&disc, 6)
            .save_with_format(&path, image::ImageFormat::Png)
            .unwrap();
        let told = read_beside(SIZE).unwrap_err().to_string();
        assert_eq!(told, "it has 20 × 24 pixels, not 24 × 20");
    }

    #[test]
    fn pictures_are_known_by_content_and_not_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("photo.jpg");
        let disc = GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| Luma([255 * u8::from(is_disc(x, y))]));
        disc.save_with_format(&path, image::ImageFormat::Png)
            .unwrap();
        assert_eq!(size_of(&path), Some(SIZE));
        assert_eq!(fits(&path, SIZE), Ok(()));
        std::fs::write(&path, "no picture").unwrap();
        assert_eq!(size_of(&path), None);
    }

    #[test]
    fn a_rule_that_tells_nothing_from_the_rest_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("photo.png");
        RgbImage::from_fn(24, 20, |x, y| image::Rgb([x as u8, y as u8, 90]))
            .save(&path)
            .unwrap();
        for (rule, what) in [("lighter:200", "outside"), ("darker:200", "inside")] {
            let fault = by_rule(&path, SIZE, rule.parse().unwrap()).unwrap_err();
            assert_eq!(
                fault.to_string(),
                format!(
                    "by the rule every pixel is {what}: it tells no object from the background"
                )
            );
        }
    }
}
