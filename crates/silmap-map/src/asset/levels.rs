//! Levels of detail of the contours as bits, next to the silhouettes.
//!
//! After a byte that names the coding, contour by contour: for each level from 1 to the coarsest one bit for each vertex of the level
//! before, set where the vertex is still there. Where each level halves the one before, that is two bits a vertex at most. The bits
//! fill bytes from the low end; the last byte's unused bits are zero. Files of earlier versions have no such part.

use super::AssetError;
use super::packing::{Decoder, Encoder};
use crate::{SilhouetteMap, ViewContour};

const PART: &str = "levels of detail";

/// The one coding that this program writes and reads.
const CODING: u8 = 1;

/// Fewest vertices of a contour at any level, unless it has fewer itself.
const FEWEST_VERTICES: usize = 3;

/// The bytes for a map whose contours have levels; `None` for one without. A contour without any among others is always whole.
pub(super) fn encode(map: &SilhouetteMap) -> Result<Option<Vec<u8>>, AssetError> {
    if !map.has_levels() {
        return Ok(None);
    }
    let mut out = Encoder::default();
    out.byte(CODING);
    let mut bits = BitWriter::default();
    for (v, view) in map.views.iter().enumerate() {
        for (c, contour) in view.contours.iter().enumerate() {
            let levels = &contour.levels;
            if !levels.is_empty() && levels.len() != contour.points.len() {
                return Err(AssetError::Count {
                    what: "levels of a contour",
                    found: levels.len(),
                    expected: contour.points.len(),
                });
            }
            check_coarsest(contour, v, c)?;
            let level_of = |k: usize| levels.get(k).map_or(ViewContour::COARSEST_LEVEL, |&l| l);
            for level in 1..=ViewContour::COARSEST_LEVEL {
                for k in (0..contour.points.len()).filter(|&k| level_of(k) >= level - 1) {
                    bits.push(&mut out, level_of(k) >= level);
                }
            }
        }
    }
    bits.finish(&mut out);
    Ok(Some(out.finish()))
}

/// Gives the contours of `map` their levels.
pub(super) fn decode(bytes: &[u8], map: &mut SilhouetteMap) -> Result<(), AssetError> {
    let mut read = Decoder::new(bytes, PART);
    let found = read.byte()?;
    if found != CODING {
        return Err(AssetError::LevelCoding {
            found,
            known: CODING,
        });
    }
    let mut bits = BitReader::default();
    for (v, view) in map.views.iter_mut().enumerate() {
        for (c, contour) in view.contours.iter_mut().enumerate() {
            contour.levels = vec![0; contour.points.len()];
            for level in 1..=ViewContour::COARSEST_LEVEL {
                for own in contour.levels.iter_mut().filter(|l| **l == level - 1) {
                    *own += u8::from(bits.take(&mut read)?);
                }
            }
            check_coarsest(contour, v, c)?;
        }
    }
    bits.finish()?;
    read.finish()
}

/// Refuses a contour that is no loop any more at its coarsest level.
pub(super) fn check_coarsest(
    contour: &ViewContour,
    view: usize,
    number: usize,
) -> Result<(), AssetError> {
    let vertices = contour.vertices_at(ViewContour::COARSEST_LEVEL).count();
    if vertices >= FEWEST_VERTICES.min(contour.points.len()) {
        return Ok(());
    }
    Err(AssetError::CoarseContour {
        view,
        contour: number,
        vertices,
    })
}

/// Bits on their way into bytes.
#[derive(Debug, Default)]
struct BitWriter {
    byte: u8,
    used: u32,
}

impl BitWriter {
    fn push(&mut self, out: &mut Encoder, bit: bool) {
        self.byte |= u8::from(bit) << self.used;
        self.used += 1;
        if self.used == u8::BITS {
            out.byte(self.byte);
            *self = Self::default();
        }
    }

    fn finish(self, out: &mut Encoder) {
        if self.used > 0 {
            out.byte(self.byte);
        }
    }
}

/// Bits on their way out of bytes.
#[derive(Debug, Default)]
struct BitReader {
    byte: u8,
    left: u32,
}

impl BitReader {
    fn take(&mut self, read: &mut Decoder<'_>) -> Result<bool, AssetError> {
        if self.left == 0 {
            self.byte = read.byte()?;
            self.left = u8::BITS;
        }
        let bit = self.byte & 1 == 1;
        self.byte >>= 1;
        self.left -= 1;
        Ok(bit)
    }

    /// Refuses bits that stand for nothing.
    fn finish(self) -> Result<(), AssetError> {
        match self.byte {
            0 => Ok(()),
            _ => Err(AssetError::Trailing {
                part: PART,
                bytes: 1,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};
    use silmap_geometry::{Camera, CoverageRule};

    use super::*;
    use crate::CapturedView;

    /// One view with one contour of nine vertices.
    fn map(levels: Vec<u8>) -> SilhouetteMap {
        let camera = Camera::fit_sphere(DVec3::Z * 3.0, DVec3::ZERO, 1.0, None, (64, 64)).unwrap();
        let contour = ViewContour {
            part: 0,
            points: (0..9)
                .map(|k| DVec2::new(k.into(), f64::from(k * k)))
                .collect(),
            depths: Vec::new(),
            levels,
        };
        SilhouetteMap {
            center: DVec3::ZERO,
            radius: 1.0,
            resolution_px: 64,
            tolerance_px: 0.5,
            coverage: CoverageRule::Center,
            views: vec![CapturedView {
                camera,
                contours: vec![contour],
                photographed: None,
            }],
            triangles: Vec::new(),
        }
    }

    #[test]
    fn levels_come_back() {
        let levels = vec![6, 0, 1, 6, 2, 0, 6, 5, 0];
        let bytes = encode(&map(levels.clone())).unwrap().unwrap();
        // Nine bits for the first level, six for the second, then five, four, four and four.
        assert_eq!(bytes.len(), 1 + (9_usize + 6 + 5 + 4 + 4 + 4).div_ceil(8));
        let mut read = map(Vec::new());
        decode(&bytes, &mut read).unwrap();
        assert_eq!(read.views[0].contours[0].levels, levels);
        assert_eq!(encode(&map(Vec::new())).unwrap(), None);
    }

    #[test]
    fn what_contradicts_itself_is_refused() {
        let levels = vec![6, 0, 1, 6, 2, 0, 6, 5, 0];
        let good = encode(&map(levels)).unwrap().unwrap();
        let refused = |bytes: &[u8]| decode(bytes, &mut map(Vec::new())).unwrap_err().to_string();
        let mut other = good.clone();
        other[0] = 7;
        assert_eq!(
            refused(&other),
            "its levels of detail have coding 7, this program reads coding 1: update it or build again"
        );
        assert_eq!(
            refused(&good[..3]),
            "it is damaged: the levels of detail end too early"
        );
        let mut long = good.clone();
        long.push(0);
        assert_eq!(
            refused(&long),
            "it is damaged: 1 bytes too many after the levels of detail"
        );
        // No vertex is left at level 1.
        assert_eq!(
            refused(&[1, 0, 0]),
            "it is damaged: contour 0 of view 0 has 0 vertices at its coarsest level of detail, fewer than 3"
        );
        for levels in [vec![6, 6, 0, 0, 0, 0, 0, 0, 0], vec![6; 8]] {
            assert!(encode(&map(levels)).is_err());
        }
    }

    #[test]
    fn bits_after_the_last_contour_are_refused() {
        let mut wide = map(Vec::new());
        let bytes = encode(&map(vec![6; 9])).unwrap().unwrap();
        assert_eq!(bytes.len(), 1 + 54_usize.div_ceil(8));
        decode(&bytes, &mut wide).unwrap();
        let mut padded = bytes;
        if let Some(last) = padded.last_mut() {
            *last |= 0x80;
        }
        assert!(matches!(
            decode(&padded, &mut wide),
            Err(AssetError::Trailing { part: PART, .. })
        ));
    }
}
