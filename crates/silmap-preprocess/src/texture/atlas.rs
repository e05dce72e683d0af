//! The tile atlas: one texture for the whole hull, for faces that no view sees and for viewers without support for views.
//!
//! A texel's colour and normal are those of the point of the original that its point of the hull shows ([`parametrisation`]),
//! averaged over a few samples.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 4.
//! Deviation: colours are lit, for the pictures beside them are; normals are stored in the tangent space of glTF.
//!
//! [`parametrisation`]: super::parametrisation

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use silmap_map::CoarseHull;
use silmap_map::asset::TangentFrames;

use super::parametrisation::{Shooter, blend};
use super::picture::Picture;
use super::surface::Surface;
use super::tiles::{Place, TileLayout};
use crate::progress;
use silmap_geometry::watch::{Interrupted, Watch};

/// Samples along each axis of a texel.
const TEXEL_SAMPLES: usize = 2;

/// Frames flatter than this (the determinant of three unit vectors) cannot represent normals.
const MIN_FRAME_VOLUME: f64 = 1e-3;

/// The pictures of an atlas.
#[derive(Debug)]
pub(super) struct AtlasPictures {
    /// Linear light.
    pub(super) colours: Picture,
    /// Normals in tangent space, of any length.
    pub(super) normals: Option<Picture>,
}

/// What fills an atlas.
#[derive(Debug)]
pub(super) struct AtlasBaker<'a> {
    layout: &'a TileLayout,
    shooter: Shooter<'a>,
    original: &'a Surface<'a>,
    /// Per face: tangents and bitangents of its corners; none where normals are not asked for.
    frames: Option<Vec<[[DVec3; 3]; 2]>>,
}

impl<'a> AtlasBaker<'a> {
    pub(super) fn new(
        layout: &'a TileLayout,
        hull: &CoarseHull,
        shooter: Shooter<'a>,
        original: &'a Surface<'a>,
        with_normals: bool,
    ) -> Self {
        let frames = with_normals.then(|| {
            let uvs: Vec<_> = (0..hull.faces.len())
                .map(|f| layout.corner_uvs(f))
                .collect();
            let tangents = TangentFrames::new(hull, &uvs).tangents;
            let of_face = |(tangents, normals): (&[[f32; 4]; 3], &[DVec3; 3])| {
                let along = tangents.map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into()));
                let up =
                    std::array::from_fn(|k| f64::from(tangents[k][3]) * normals[k].cross(along[k]));
                [along, up]
            };
            tangents.iter().zip(&shooter.normals).map(of_face).collect()
        });
        Self {
            layout,
            shooter,
            original,
            frames,
        }
    }

    /// The atlas. Every texel has a colour; in unused squares colours run on.
    pub(super) fn bake(&self, watch: &Watch<'_>) -> Result<AtlasPictures, Interrupted> {
        let side = self.layout.side() as usize;
        let rows = (0..side)
            .into_par_iter()
            .map(|y| {
                watch.check()?;
                let row = self.bake_row(y);
                watch.advance(progress::TEXTURES, 1);
                Ok(row)
            })
            .collect::<Result<Vec<_>, Interrupted>>()?;
        let (colours, normals): (Vec<_>, Vec<_>) =
            rows.into_iter().map(|(c, n)| (c.pixels, n.pixels)).unzip();
        let whole = |rows: Vec<Vec<[f32; 4]>>| {
            let mut picture = Picture {
                width: side,
                height: side,
                pixels: rows.concat(),
            };
            picture.fill();
            picture
        };
        Ok(AtlasPictures {
            colours: whole(colours),
            normals: self.frames.is_some().then(|| whole(normals)),
        })
    }

    /// One row of texels: colours, and normals where they are asked for.
    fn bake_row(&self, y: usize) -> (Picture, Picture) {
        let side = self.layout.side() as usize;
        let mut colours = Picture::new(side, 1);
        let mut normals = Picture::new(if self.frames.is_some() { side } else { 0 }, 1);
        for x in 0..side {
            let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            // All samples of a texel belong to the face of its centre.
            let Some(middle) = self.layout.place_at(centre) else {
                continue;
            };
            // One for all samples: the hull's distance changes little within a texel.
            let reach = self.shooter.reach(middle.face, middle.weights);
            for sample in 0..TEXEL_SAMPLES * TEXEL_SAMPLES {
                let step = |k: usize| (k as f64 + 0.5) / TEXEL_SAMPLES as f64 - 0.5;
                let offset = DVec2::new(step(sample % TEXEL_SAMPLES), step(sample / TEXEL_SAMPLES));
                let place = self.layout.place_at(centre + offset);
                let place = place.filter(|p| p.face == middle.face).unwrap_or(middle);
                let source = self.shooter.source(place.face, place.weights, reach);
                let normal = self.original.normal(source.face, source.weights);
                let colour = self
                    .original
                    .lit_colour(source.face, source.weights, normal);
                colours.add(x, colour);
                if let Some(frames) = &self.frames {
                    let told = self.told_normal(&frames[place.face], place, normal);
                    normals.add(x, told.as_vec3().to_array());
                }
            }
        }
        (colours, normals)
    }

    /// A normal of object space in the frame at a place; straight up where there is no frame.
    fn told_normal(&self, frame: &[[DVec3; 3]; 2], place: Place, normal: DVec3) -> DVec3 {
        let at = |vectors| blend(vectors, place.weights).normalize_or_zero();
        let [along, up] = frame.each_ref().map(at);
        let outward = at(&self.shooter.normals[place.face]);
        let object_from_tangent = DMat3::from_cols(along, up, outward);
        if object_from_tangent.determinant().abs() < MIN_FRAME_VOLUME {
            return DVec3::Z;
        }
        (object_from_tangent.inverse() * normal)
            .try_normalize()
            .unwrap_or(DVec3::Z)
    }
}
