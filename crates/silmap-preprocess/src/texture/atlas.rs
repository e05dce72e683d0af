//! The tile atlas: one texture for the whole hull, for faces that no view sees and for viewers that know nothing of views.
//!
//! Each face has a right-angled triangle of texels, two to a square tile. A texel's colour is that of the original where the
//! line from the texel's point on the face, against the hull's interpolated normal, first meets it.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 4.
//! Deviations: where the line misses, or first meets the original far behind the nearest point of it, that point is taken.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use silmap_geometry::Bvh;

use super::picture::Picture;
use super::surface::Surface;
use crate::progress::{Interrupted, Monitor, Stage};

/// Texels between a tile's border and its triangles' corners, so that bilinear filtering stays inside.
const PADDING_TEXELS: f64 = 1.0;

/// Smallest side of a tile: legs of four texels.
const MIN_TILE_TEXELS: u32 = 8;

/// Samples along each axis of a texel.
const TEXEL_SAMPLES: usize = 2;

/// A ray starts this far outside the hull (share of the bounding radius), because rounding may have put the hull inside.
const START_OUTSIDE_REL: f64 = 1e-4;

/// A hit this many times farther away than the nearest point of the original has slipped past what the face stands for.
const MAX_HIT_DISTANCE_RATIO: f64 = 4.0;

/// Where each face's tile lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TileLayout {
    /// Side of a square tile, texels.
    tile: u32,
    /// Tiles in a row, and rows.
    grid: u32,
    face_count: usize,
}

impl TileLayout {
    /// Tiles for that many faces in a square of about `size_px` texels a side; more when the tiles would get too small.
    pub(super) fn new(face_count: usize, size_px: u32) -> Self {
        let tiles = face_count.div_ceil(2).max(1);
        let mut grid = (tiles as f64).sqrt() as u32;
        while (grid as usize).pow(2) < tiles {
            grid += 1;
        }
        Self {
            tile: (size_px / grid).max(MIN_TILE_TEXELS),
            grid,
            face_count,
        }
    }

    /// Side of the whole picture, texels.
    pub(super) fn side(&self) -> u32 {
        self.tile * self.grid
    }

    /// Length of the triangles' legs, texels.
    fn leg(&self) -> f64 {
        // Both triangles keep the distance that bilinear filtering needs from the diagonal they share.
        f64::from(self.tile) - 4.0 * PADDING_TEXELS
    }

    /// Top-left corner of a face's tile, and whether the face has the tile's second triangle.
    fn tile_of(&self, face: usize) -> (DVec2, bool) {
        let (tile, grid) = (face / 2, self.grid as usize);
        let corner = DVec2::new((tile % grid) as f64, (tile / grid) as f64);
        (corner * f64::from(self.tile), face % 2 == 1)
    }

    /// A place in the tile, as seen by its first triangle: the second is the first turned by half a turn.
    fn turned(&self, place: DVec2, is_second: bool) -> DVec2 {
        match is_second {
            true => DVec2::splat(f64::from(self.tile)) - place,
            false => place,
        }
    }

    /// The corners of a face's triangle, texels of the whole picture.
    fn corners(&self, face: usize) -> [DVec2; 3] {
        let (origin, is_second) = self.tile_of(face);
        [DVec2::ZERO, DVec2::X, DVec2::Y].map(|p| {
            let place = DVec2::splat(PADDING_TEXELS) + p * self.leg();
            origin + self.turned(place, is_second)
        })
    }

    /// Texture coordinates of a face's corners.
    pub(super) fn corner_uvs(&self, face: usize) -> [[f32; 2]; 3] {
        let side = f64::from(self.side());
        self.corners(face).map(|p| (p / side).as_vec2().to_array())
    }

    /// The face that owns a place in texels and the weights of its corners there, clamped to the face; `None` in unused
    /// tiles.
    fn face_at(&self, place: DVec2) -> Option<(usize, [f64; 3])> {
        let size = f64::from(self.tile);
        let tile = (place / size).floor();
        let within = place - tile * size;
        let is_second = within.x + within.y > size;
        let index = tile.y as usize * self.grid as usize + tile.x as usize;
        let face = 2 * index + usize::from(is_second);
        if face >= self.face_count {
            // An odd count leaves the last triangle empty: it repeats its neighbour.
            return (face == self.face_count && is_second).then(|| (face - 1, [1.0, 0.0, 0.0]));
        }
        let p = self.turned(within, is_second) - DVec2::splat(PADDING_TEXELS);
        Some((face, clamped_weights(p / self.leg())))
    }
}

/// Weights of the corners (0,0), (1,0), (0,1) at the nearest point of their triangle.
fn clamped_weights(p: DVec2) -> [f64; 3] {
    let p = p.max(DVec2::ZERO);
    let p = if p.x + p.y > 1.0 {
        let x = (0.5 * (1.0 + p.x - p.y)).clamp(0.0, 1.0);
        DVec2::new(x, 1.0 - x)
    } else {
        p
    };
    [1.0 - p.x - p.y, p.x, p.y]
}

/// The hull as texels see it.
#[derive(Debug)]
pub(super) struct ShootingFaces<'a> {
    pub(super) corners: &'a [[DVec3; 3]],
    /// Smooth outward normals at the corners.
    pub(super) normals: Vec<[DVec3; 3]>,
    /// Bounding radius of the original.
    pub(super) radius: f64,
}

impl ShootingFaces<'_> {
    /// The colour of the original behind a point of a face.
    fn colour(
        &self,
        face: usize,
        weights: [f64; 3],
        original: &Surface<'_>,
        bvh: &Bvh,
    ) -> [f32; 3] {
        let blend = |v: &[DVec3; 3]| -> DVec3 { (0..3).map(|k| v[k] * weights[k]).sum() };
        let point = blend(&self.corners[face]);
        let outward = blend(&self.normals[face]).normalize_or_zero();
        let (nearest, near_face, near_weights) = bvh.closest_point(point);
        let outside = START_OUTSIDE_REL * self.radius;
        let reach = MAX_HIT_DISTANCE_RATIO * point.distance(nearest) + 2.0 * outside;
        let start = point + outward * outside;
        match bvh.first_hit(start, -outward, 0.0, reach + outside) {
            Some(hit) if hit.enters => original.colour(hit.face as usize, hit.barycentric),
            _ => original.colour(near_face as usize, near_weights),
        }
    }
}

/// The atlas picture. Every texel has a colour; between tiles the borders are repeated.
pub(super) fn shoot_atlas(
    layout: &TileLayout,
    faces: &ShootingFaces<'_>,
    original: &Surface<'_>,
    bvh: &Bvh,
    monitor: &Monitor<'_>,
) -> Result<Picture, Interrupted> {
    let side = layout.side() as usize;
    let rows = (0..side)
        .into_par_iter()
        .map(|y| {
            monitor.check()?;
            let row = shoot_row(layout, y, |face, weights| {
                faces.colour(face, weights, original, bvh)
            });
            monitor.advance(Stage::Textures, 1);
            Ok(row)
        })
        .collect::<Result<Vec<_>, Interrupted>>()?;
    let mut picture = Picture {
        width: side,
        height: side,
        pixels: rows.concat(),
    };
    picture.fill();
    Ok(picture)
}

/// One row of texels, from a function that colours points of faces.
fn shoot_row(
    layout: &TileLayout,
    y: usize,
    colour: impl Fn(usize, [f64; 3]) -> [f32; 3],
) -> Vec<[f32; 4]> {
    let mut row = Picture::new(layout.side() as usize, 1);
    for x in 0..row.width {
        let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        // All samples of a texel belong to the face of its centre.
        let Some((face, _)) = layout.face_at(centre) else {
            continue;
        };
        for sample in 0..TEXEL_SAMPLES * TEXEL_SAMPLES {
            let step = |k: usize| (k as f64 + 0.5) / TEXEL_SAMPLES as f64 - 0.5;
            let offset = DVec2::new(step(sample % TEXEL_SAMPLES), step(sample / TEXEL_SAMPLES));
            let weights = match layout.face_at(centre + offset) {
                Some((same, weights)) if same == face => weights,
                _ => layout.face_at(centre).map_or([1.0, 0.0, 0.0], |at| at.1),
            };
            row.add(x, colour(face, weights));
        }
    }
    row.pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shade_of(face: usize) -> f32 {
        0.1 + 0.8 * (face as f32 * 0.618).fract()
    }

    /// Each face in its own flat shade: bilinear samples anywhere in a face must show exactly that.
    #[test]
    fn filtering_never_reaches_another_face() {
        for (face_count, size) in [(1, 16), (2, 8), (7, 40), (51, 64), (500, 512), (333, 200)] {
            let layout = TileLayout::new(face_count, size);
            let side = layout.side() as usize;
            let picture = Picture {
                width: side,
                height: side,
                pixels: (0..side)
                    .flat_map(|y| shoot_row(&layout, y, |face, _| [shade_of(face); 3]))
                    .collect(),
            };
            let shade_at = |p: DVec2| {
                let low = (p - 0.5).floor();
                let t = p - 0.5 - low;
                let texel = |dx: f64, dy: f64| {
                    let clamp = |v: f64| v.clamp(0.0, (side - 1) as f64) as usize;
                    f64::from(picture.colour(clamp(low.y + dy) * side + clamp(low.x + dx))[0])
                };
                let row = |dy| texel(0.0, dy) * (1.0 - t.x) + texel(1.0, dy) * t.x;
                row(0.0) * (1.0 - t.y) + row(1.0) * t.y
            };
            for face in 0..face_count {
                let uvs = layout.corner_uvs(face);
                for (i, j) in (0..=8).flat_map(|i| (0..=8 - i).map(move |j| (i, j))) {
                    let weights = [i, j, 8 - i - j].map(|w| f64::from(w) / 8.0);
                    let place: DVec2 = (0..3)
                        .map(|k| {
                            let [u, v] = uvs[k].map(f64::from);
                            DVec2::new(u, v) * side as f64 * weights[k]
                        })
                        .sum();
                    let found = shade_at(place);
                    let expected = f64::from(shade_of(face));
                    assert!(
                        (found - expected).abs() < 1e-3,
                        "face {face} of {face_count} shows {found}, not {expected}, at {place}"
                    );
                }
            }
        }
    }

    #[test]
    fn five_hundred_faces_have_about_five_hundred_texels_each() {
        let layout = TileLayout::new(500, 512);
        assert_eq!(layout.side(), 512);
        assert_eq!(layout.tile, 32);
    }

    #[test]
    fn weights_at_the_corners_and_beyond() {
        let layout = TileLayout::new(5, 64);
        for face in 0..5 {
            for (k, corner) in layout.corners(face).into_iter().enumerate() {
                let (found, weights) = layout.face_at(corner).unwrap();
                assert_eq!(found, face);
                assert!((weights[k] - 1.0).abs() < 1e-9, "{weights:?}");
            }
        }
        for p in [(-3.0, 0.2), (0.5, 2.0), (7.0, 0.0), (0.6, 0.6)] {
            let weights = clamped_weights(DVec2::from(p));
            assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)));
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
