//! Masks out of picture files: which pixels show the model, however the file says so.
//!
//! What counts as inside, in this order:
//! 1. Where the picture has an alpha channel that is not the same everywhere (a cut-out), alpha is the mask: inside is what is more
//!    than half opaque. The colours do not matter then.
//! 2. A picture of two brightnesses, whichever they are (0 and 1, 0 and 255, a label's colour on black): the brighter one is inside.
//! 3. Otherwise inside is what is brighter than half of white; where nothing is, or everything, what is brighter than the middle
//!    between the darkest and the brightest pixel, and a note says so.
//!
//! Where all four corners of the picture, or three quarters of its border, are inside, it is the background that is bright: [`read`] and
//! [`decode`] take the mask the other way round, and a note says so. The masks of a capture are never turned: an object may fill an image.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError, ImageReader, Limits};
use silmap_geometry::Mask;
use silmap_geometry::camera::MAX_SIDE_PX;
use silmap_mesh_io::input;
use thiserror::Error;

use crate::levels::Levels;

/// Share of a picture's border that is inside when the picture is taken the other way round.
const BORDER_SHARE: f64 = 0.75;

/// A mask as it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct MaskImage {
    /// Set where the model is.
    pub mask: Mask,
    /// What was unusual about the picture, one clause each.
    pub notes: Vec<String>,
}

/// Why there is no mask.
#[derive(Debug, Error)]
#[error("{}: {fault}", path.display())]
pub struct MaskImageError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: MaskFault,
}

/// What is wrong with a mask's file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MaskFault {
    /// The operating system refused.
    #[error("cannot be read: {0}")]
    Unreadable(std::io::Error),
    /// Zero bytes.
    #[error("the file is empty")]
    Empty,
    /// Something else than a picture.
    #[error("it is {found}, and a picture is needed: PNG, JPEG or WebP")]
    NoPicture {
        /// What it looks like.
        found: &'static str,
    },
    /// A picture in a format that is not read.
    #[error("it is {found}, which is not read here: write it as PNG")]
    OtherPicture {
        /// What it looks like.
        found: &'static str,
    },
    /// A picture that is damaged, or larger than is sensible.
    #[error("it is {found} that cannot be read: {reason}")]
    Damaged {
        /// Its format.
        found: &'static str,
        /// What the decoder says.
        reason: ImageError,
    },
    /// Larger than any camera's image.
    #[error("it has {width} × {height} pixels, and at most {MAX_SIDE_PX} a side are used")]
    TooLarge {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Another size than the camera's.
    #[error("it has {width} × {height} pixels, not {wanted_width} × {wanted_height}")]
    OtherSize {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Columns of the camera's image.
        wanted_width: u32,
        /// Rows of the camera's image.
        wanted_height: u32,
    },
    /// Every pixel is the same.
    #[error("every pixel of the picture is the same ({what}): it shows no outline")]
    Blank {
        /// "inside", "outside", or what the value is.
        what: String,
    },
    /// A rule that finds nothing, or everything.
    #[error("by the rule every pixel is {what}: it tells no object from the background")]
    RuleFinds {
        /// "inside" or "outside".
        what: String,
    },
}

/// Reads a mask from a picture file, known by its content and not by its name.
///
/// # Errors
/// When the file cannot be read, is no picture, or shows no outline.
pub fn read(path: &Path) -> Result<MaskImage, MaskImageError> {
    let fault = |fault| MaskImageError {
        path: path.to_owned(),
        fault,
    };
    let bytes = input::read(path).map_err(|e| fault(MaskFault::Unreadable(e)))?;
    decode(&bytes).map_err(fault)
}

/// The mask in a picture file's bytes.
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8]) -> Result<MaskImage, MaskFault> {
    let MaskImage {
        mut mask,
        mut notes,
    } = of_picture(&decoded(bytes)?.picture)?;
    if is_background_bright(&mask) {
        mask = mask_of(mask.width(), mask.height(), |x, y| {
            !mask.get(x.into(), y.into())
        });
        notes.push(
            "the border of the picture is bright and what it encloses dark: the dark part is taken as the model"
                .to_owned(),
        );
    }
    Ok(MaskImage { mask, notes })
}

/// A picture as it is stored, and how it is to be turned for people.
#[derive(Debug)]
pub(crate) struct Decoded {
    pub(crate) picture: DynamicImage,
    pub(crate) orientation: Orientation,
}

/// The decoded picture, if its sides are within the limit: what the header claims is looked at first.
pub(crate) fn decoded(bytes: &[u8]) -> Result<Decoded, MaskFault> {
    let found = match kind_of(bytes) {
        Kind::Read(found) => found,
        Kind::Empty => return Err(MaskFault::Empty),
        Kind::Picture(found) => return Err(MaskFault::OtherPicture { found }),
        Kind::Other(found) => return Err(MaskFault::NoPicture { found }),
    };
    let damaged = |reason| MaskFault::Damaged { found, reason };
    let reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| damaged(ImageError::IoError(error)))?;
    let mut decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        return Err(MaskFault::TooLarge { width, height });
    }
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    Limits::default()
        .reserve(decoder.total_bytes())
        .map_err(damaged)?;
    let picture = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    Ok(Decoded {
        picture,
        orientation,
    })
}

/// The mask of a picture, as it is.
pub(crate) fn of_picture(picture: &DynamicImage) -> Result<MaskImage, MaskFault> {
    let mut notes = Vec::new();
    let mask = checked(levels_of(picture, &mut notes)?.mask())?;
    Ok(MaskImage { mask, notes })
}

/// What a picture says about each pixel: inside is above zero.
pub(crate) fn levels_of(
    picture: &DynamicImage,
    notes: &mut Vec<String>,
) -> Result<Levels, MaskFault> {
    match of_alpha(picture) {
        Some(levels) => Ok(levels),
        None => of_brightness(picture, notes),
    }
}

/// A mask that shows an outline.
pub(crate) fn checked(mask: Mask) -> Result<Mask, MaskFault> {
    let all = u64::from(mask.width()) * u64::from(mask.height());
    let what = match mask.count() {
        0 => "outside",
        inside if inside == all => "inside",
        _ => return Ok(mask),
    };
    Err(MaskFault::Blank {
        what: what.to_owned(),
    })
}

/// The mask of the pixels for which `is_inside` holds.
fn mask_of(width: u32, height: u32, is_inside: impl Fn(u32, u32) -> bool) -> Mask {
    let mut mask = Mask::new(width, height);
    for y in 0..height {
        for x in 0..width {
            if is_inside(x, y) {
                mask.set(x, y, true);
            }
        }
    }
    mask
}

/// How opaque the picture is, against one half, if its alpha says anything.
pub(crate) fn of_alpha(picture: &DynamicImage) -> Option<Levels> {
    if !picture.color().has_alpha() {
        return None;
    }
    let rgba = picture.to_rgba16();
    let alphas: Vec<u16> = rgba.pixels().map(|p| p.0[3]).collect();
    let first = *alphas.first()?;
    if alphas.iter().all(|&a| a == first) {
        return None;
    }
    Some(above(&alphas, (rgba.width(), rgba.height()), u16::MAX / 2))
}

/// How bright the picture is, against the brightness from which on it shows the object.
fn of_brightness(picture: &DynamicImage, notes: &mut Vec<String>) -> Result<Levels, MaskFault> {
    let luma = picture.to_luma16();
    let size = (luma.width(), luma.height());
    let values = luma.into_raw();
    let (low, high) =
        (values.iter()).fold((u16::MAX, 0), |(low, high), &v| (v.min(low), v.max(high)));
    if low >= high {
        let percent = 100.0 * f64::from(low) / f64::from(u16::MAX);
        let what = match percent {
            0.0 => "black".to_owned(),
            100.0 => "white".to_owned(),
            other => format!("{other:.1} % of white"),
        };
        return Err(MaskFault::Blank { what });
    }
    let half = u16::MAX / 2;
    let has_two = values.iter().all(|&v| v == low || v == high);
    let threshold = if has_two {
        low
    } else if (low..high).contains(&half) {
        half
    } else {
        let middle = low.midpoint(high);
        let percent = |value: u16| 100.0 * f64::from(value) / f64::from(u16::MAX);
        notes.push(format!(
            "its pixels have {:.1} % to {:.1} % of white: what has more than {:.1} % is taken as the model",
            percent(low),
            percent(high),
            percent(middle)
        ));
        middle
    };
    Ok(above(&values, size, threshold))
}

/// Values against a threshold; those above it are inside.
fn above(values: &[u16], size: (u32, u32), threshold: u16) -> Levels {
    let level = f32::from(threshold) + 0.5;
    let mut two: Vec<u16> = Vec::new();
    for &value in values {
        if !two.contains(&value) {
            two.push(value);
            if two.len() > 2 {
                break;
            }
        }
    }
    let span = f32::from(u16::MAX) / 2.0;
    let heights = values.iter().map(|&v| (f32::from(v) - level) / span);
    Levels::new(size, heights.collect(), two.len() <= 2)
}

/// Whether it is the background that is inside.
fn is_background_bright(mask: &Mask) -> bool {
    let (right, bottom) = (mask.width() - 1, mask.height() - 1);
    let inside = |x: u32, y: u32| mask.get(x.into(), y.into());
    let corners = [(0, 0), (right, 0), (0, bottom), (right, bottom)];
    if corners.iter().all(|&(x, y)| inside(x, y)) {
        return true;
    }
    let along_x = (0..=right).flat_map(|x| [(x, 0), (x, bottom)]);
    let along_y = (0..=bottom).flat_map(|y| [(0, y), (right, y)]);
    let (mut set, mut all) = (0_u64, 0_u64);
    for (x, y) in along_x.chain(along_y) {
        set += u64::from(inside(x, y));
        all += 1;
    }
    set as f64 > BORDER_SHARE * all as f64
}

/// What a file is, by its first bytes.
enum Kind {
    /// A picture that is read.
    Read(&'static str),
    /// A picture that is not.
    Picture(&'static str),
    /// No picture.
    Other(&'static str),
    Empty,
}

fn kind_of(bytes: &[u8]) -> Kind {
    use image::ImageFormat as Format;
    /// First bytes, after blanks, of what people take for a mask.
    const TEXTS: &[(&[u8], &str)] = &[
        (b"ply", "a PLY mesh"),
        (b"glTF", "a binary glTF file"),
        (b"solid", "an STL mesh"),
        (b"OFF", "an OFF mesh"),
        (b"COFF", "an OFF mesh"),
        (b"v ", "an OBJ mesh"),
        (b"mtllib", "an OBJ mesh"),
        (b"# Blender", "an OBJ mesh"),
        (b"{", "a JSON file"),
        (b"[", "a JSON file"),
        (b"%PDF", "a PDF file"),
    ];
    if bytes.is_empty() {
        return Kind::Empty;
    }
    match image::guess_format(bytes) {
        Ok(Format::Png) => return Kind::Read("a PNG picture"),
        Ok(Format::Jpeg) => return Kind::Read("a JPEG picture"),
        Ok(Format::WebP) => return Kind::Read("a WebP picture"),
        Ok(Format::Gif) => return Kind::Picture("a GIF picture"),
        Ok(Format::Bmp) => return Kind::Picture("a BMP picture"),
        Ok(Format::Tiff) => return Kind::Picture("a TIFF picture"),
        Ok(Format::Pnm) => return Kind::Picture("a PBM, PGM or PPM picture"),
        Ok(Format::OpenExr) => return Kind::Picture("an OpenEXR picture"),
        Ok(Format::Hdr) => return Kind::Picture("a Radiance HDR picture"),
        Ok(Format::Avif) => return Kind::Picture("an AVIF picture"),
        Ok(Format::Qoi) => return Kind::Picture("a QOI picture"),
        Ok(_) => return Kind::Picture("a picture of a rare format"),
        Err(_) => {}
    }
    if bytes.get(4..8) == Some(b"ftyp") {
        return Kind::Picture("a HEIF picture or a film");
    }
    let start = bytes.trim_ascii_start();
    if let Some((_, found)) = TEXTS.iter().find(|(first, _)| start.starts_with(first)) {
        return Kind::Other(found);
    }
    let head = String::from_utf8_lossy(&start[..start.len().min(512)]);
    if head.contains("<svg") {
        return Kind::Picture("an SVG drawing");
    }
    Kind::Other("no kind of file that is known here")
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, ImageFormat, Luma, LumaA, Rgb, RgbImage, Rgba, RgbaImage};

    use super::*;

    const SIDE: u32 = 24;

    /// A disc off the middle.
    fn is_disc(x: u32, y: u32) -> bool {
        (f64::from(x) - 10.0).hypot(f64::from(y) - 12.0) < 7.0
    }

    fn disc() -> Mask {
        mask_of(SIDE, SIDE, is_disc)
    }

    fn png(picture: impl Into<DynamicImage>) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture
            .into()
            .write_to(&mut bytes, ImageFormat::Png)
            .unwrap();
        bytes.into_inner()
    }

    fn grey(inside: u8, outside: u8) -> Vec<u8> {
        png(GrayImage::from_fn(SIDE, SIDE, |x, y| {
            Luma([if is_disc(x, y) { inside } else { outside }])
        }))
    }

    #[test]
    fn two_brightnesses_are_a_mask_whichever_they_are() {
        for (inside, outside) in [(255, 0), (1, 0), (200, 10), (100, 0), (255, 254), (2, 1)] {
            let read = decode(&grey(inside, outside)).unwrap();
            assert_eq!(read.mask, disc(), "{inside} {outside}");
            assert!(read.notes.is_empty());
        }
        let wide = image::ImageBuffer::from_fn(SIDE, SIDE, |x, y| Luma([u16::from(is_disc(x, y))]));
        assert_eq!(decode(&png(wide)).unwrap().mask, disc());
        // A label in a colour that is darker than half of white.
        let label = RgbImage::from_fn(SIDE, SIDE, |x, y| {
            Rgb(if is_disc(x, y) { [200, 0, 0] } else { [0; 3] })
        });
        assert_eq!(decode(&png(label)).unwrap().mask, disc());
    }

    #[test]
    fn the_alpha_of_a_cut_out_is_the_mask() {
        // A dark object, cut out of a picture whose hidden rest is bright.
        let cut = RgbaImage::from_fn(SIDE, SIDE, |x, y| {
            Rgba(if is_disc(x, y) {
                [20, 20, 20, 255]
            } else {
                [255, 255, 255, 0]
            })
        });
        assert_eq!(decode(&png(cut)).unwrap().mask, disc());
        let soft = image::ImageBuffer::from_fn(SIDE, SIDE, |x, y| {
            LumaA([9_u8, if is_disc(x, y) { 180 } else { 60 }])
        });
        assert_eq!(decode(&png(soft)).unwrap().mask, disc());
        // An alpha that says nothing.
        for alpha in [255, 0, 99] {
            let plain = RgbaImage::from_fn(SIDE, SIDE, |x, y| {
                let bright = if is_disc(x, y) { 230 } else { 3 };
                Rgba([bright, bright, bright, alpha])
            });
            assert_eq!(decode(&png(plain)).unwrap().mask, disc(), "{alpha}");
        }
    }

    #[test]
    fn a_bright_background_is_noticed() {
        let read = decode(&grey(0, 255)).unwrap();
        assert_eq!(read.mask, disc());
        assert_eq!(read.notes.len(), 1, "{:?}", read.notes);
        // An object that leaves the picture below: its background still reaches most of the border.
        let stands = |x: u32, y: u32| (6..18).contains(&x) && y > 4;
        for (is_inverted, bright) in [(false, 255), (true, 0)] {
            let picture = GrayImage::from_fn(SIDE, SIDE, |x, y| {
                Luma([if stands(x, y) { bright } else { 255 - bright }])
            });
            let read = decode(&png(picture)).unwrap();
            assert_eq!(read.mask, mask_of(SIDE, SIDE, stands));
            assert_eq!(!read.notes.is_empty(), is_inverted);
        }
    }

    #[test]
    fn grey_pictures_are_cut_at_half_or_in_the_middle() {
        let ramp = |from: u32, to: u32| {
            let grey = move |x: u32, y: u32| {
                if is_disc(x, y) {
                    to - x % 3
                } else {
                    from + y % 3
                }
            };
            png(GrayImage::from_fn(SIDE, SIDE, move |x, y| {
                Luma([grey(x, y) as u8])
            }))
        };
        let plain = decode(&ramp(5, 250)).unwrap();
        assert_eq!((plain.mask, plain.notes.len()), (disc(), 0));
        let dark = decode(&ramp(0, 60)).unwrap();
        assert_eq!((dark.mask, dark.notes.len()), (disc(), 1));
    }

    #[test]
    fn what_shows_nothing_or_is_no_picture_is_said() {
        let message = |bytes: &[u8]| decode(bytes).unwrap_err().to_string();
        assert!(message(&grey(0, 0)).contains("(black)"));
        assert!(message(&grey(255, 255)).contains("(white)"));
        assert!(message(b"").contains("empty"));
        assert!(message(b"ply\nformat ascii 1.0\n").contains("a PLY mesh"));
        assert!(message(b"{\"eye\": 1}").contains("JSON"));
        assert!(message(b"GIF89a....").contains("GIF"));
        assert!(message(b"what is this?").contains("no kind of file"));
        let half = &grey(255, 0)[..60];
        assert!(message(half).starts_with("it is a PNG picture that cannot be read"));
        // By content, not by name.
        let mut bytes = Cursor::new(Vec::new());
        DynamicImage::from(GrayImage::from_fn(SIDE, SIDE, |x, y| {
            Luma([if is_disc(x, y) { 255 } else { 0 }])
        }))
        .write_to(&mut bytes, ImageFormat::Jpeg)
        .unwrap();
        let read = decode(&bytes.into_inner()).unwrap();
        assert!(read.mask.count_missing_in(&disc()) + disc().count_missing_in(&read.mask) < 20);
    }
}
