//! The hull's textures: projected pictures of the original, and the tile atlas.
//!
//! Source: Silhouette Mapping (TR-1-99), section 8.2, for the pictures and visibility bits; Silhouette Clipping (SIGGRAPH
//! 2000), section 4, for the atlas.
//! Deviations: views are chosen automatically ([`views`]), and a view that shows something else than the face's own surface
//! does not count as seeing it ([`visibility`]). Where there are photographs of the original, views are photographs
//! ([`photographed`]), completed by pictures of the original where they see nothing.

mod atlas;
mod detail;
mod encode;
mod item_buffer;
mod parametrisation;
mod params;
mod photographed;
mod picture;
mod relief;
mod surface;
mod tiles;
mod views;
mod visibility;

use std::ops::RangeInclusive;

use glam::DVec2;
use image::ImageError;
use rayon::prelude::*;
use silmap_geometry::{Bvh, Camera, CameraError, ClosedMesh, Photograph};
use silmap_map::{Atlas, CoarseHull, Relief, TextureSet, TextureView};
use thiserror::Error;

use crate::capture;
use crate::progress;
use atlas::AtlasBaker;
use encode::{RawPicture, RawSet};
use item_buffer::ItemBuffer;
pub use parametrisation::{Shooter, Source};
pub use params::{Parametrisation, PictureFormat, TextureParams, TileSizes};
use photographed::Looks;
use picture::Picture;
use silmap_geometry::raster::ImageTriangle;
use silmap_geometry::watch::{Interrupted, Watch};
use surface::Surface;
use tiles::TileLayout;
pub use views::{face_cosines, merit};
pub use visibility::HullFaces;

/// Why there are no textures.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TextureError {
    /// The caller asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// A parameter is out of range.
    #[error("{value} {what} cannot be: it must be between {low} and {high}")]
    Parameter {
        /// Which.
        what: &'static str,
        /// Its value.
        value: u32,
        /// The smallest allowed.
        low: u32,
        /// The largest allowed.
        high: u32,
    },
    /// The viewpoints lie in the model.
    #[error("texture views cannot be taken: {0}")]
    Camera(#[from] CameraError),
    /// The hull has no faces, or a face names a vertex that does not exist.
    #[error("the hull has no faces, or a face without its vertices")]
    NoHull,
    /// A picture could not be encoded.
    #[error("a picture cannot be encoded: {0}")]
    Encode(#[from] ImageError),
    /// A picture could not be encoded as JPEG.
    #[error("a picture cannot be encoded as JPEG: {0}")]
    Jpeg(#[from] jpeg_encoder::EncodingError),
    /// This library was built without the encoder of WebP.
    #[error(
        "pictures cannot be written as WebP: this program was built without it (feature `webp`)"
    )]
    NoWebp,
    /// A picture could not be encoded as WebP.
    #[cfg(feature = "webp")]
    #[error("a picture cannot be encoded as WebP: {0:?}")]
    Webp(webp::WebPEncodingError),
}

/// Sides of the pictures, as shares of those asked for, that are tried in order when there is a budget.
const SCALES: [f64; 10] = [1.0, 0.84, 0.71, 0.59, 0.5, 0.42, 0.35, 0.25, 0.18, 0.125];

/// With a budget, pictures become smaller rather than worse than this.
const LEAST_QUALITY: u8 = 60;

/// Smallest side of a picture, pixels.
const LEAST_SIDE_PX: u32 = 16;

/// Chooses texture views, takes their pictures, finds which faces each may paint, and bakes the atlas.
///
/// `bvh` is over the original's faces. The result depends on the arguments alone, not on the number of threads. A budget that
/// even small pictures of low quality are over is not kept.
///
/// # Errors
/// When a parameter is out of range, the hull is empty, the viewpoints lie in the model, or the caller asked to stop.
pub fn bake(
    original: &ClosedMesh,
    bvh: &Bvh,
    hull: &CoarseHull,
    params: &TextureParams,
    watch: &Watch<'_>,
) -> Result<TextureSet, TextureError> {
    bake_photographed((original, bvh), hull, &[], params, watch)
}

/// The same out of photographs of the original: texture views are chosen among them, and the atlas has their colours. Where none shows
/// the original, it is as it is without them.
///
/// # Errors
/// As [`bake`].
pub fn bake_photographed(
    (original, bvh): (&ClosedMesh, &Bvh),
    hull: &CoarseHull,
    photographs: &[Photograph],
    params: &TextureParams,
    watch: &Watch<'_>,
) -> Result<TextureSet, TextureError> {
    params.validate()?;
    let vertex_count = hull.positions.len();
    let mut corners = hull.faces.iter().flatten();
    if hull.faces.is_empty() || corners.any(|&v| v as usize >= vertex_count) {
        return Err(TextureError::NoHull);
    }
    let hull_faces = HullFaces::new(hull);
    let candidates = if params.views == 0 {
        0
    } else {
        params.candidates
    };
    let layout = TileLayout::new(&hull_faces.areas, params.atlas_px, params.tiles);
    // Each photograph is drawn for once as a view and once for single points.
    let looked_at = candidates + params.views + 2 * photographs.len() as u32;
    let total = u64::from(looked_at) + u64::from(layout.side());
    watch.start(progress::TEXTURES, total);

    let mut surface = Surface::new(original.mesh());
    if !photographs.is_empty() {
        let fit = |camera: &Camera| fit_to_hull(camera, &hull_faces);
        surface = surface.photographed(Looks::new(original, photographs, fit, watch)?);
    }
    let chooser = Chooser {
        original,
        hull: &hull_faces,
        params,
        watch,
    };
    let chosen = chooser.choose(candidates, photographs)?;
    let params = &TextureParams {
        size_px: detail::side_px(&surface, &chosen, params, watch)?,
        ..*params
    };
    let model = (&surface, bvh, original.bounds().radius);
    let mut textures = paint(model, hull, (&hull_faces, &chosen), params, (1.0, watch))?;
    if let Some(budget) = params.budget_bytes {
        // Further rounds were not announced.
        let quiet = watch.quiet();
        for &scale in &SCALES[1..] {
            if picture_bytes(&textures) <= budget {
                break;
            }
            textures = paint(model, hull, (&hull_faces, &chosen), params, (scale, &quiet))?;
        }
    }
    watch.finish(progress::TEXTURES);
    Ok(textures)
}

/// Bytes of all pictures, and of depths.
#[must_use]
pub fn picture_bytes(textures: &TextureSet) -> u64 {
    let atlas = textures.atlas.iter();
    let of_atlas = atlas.flat_map(|a| [Some(&a.image), a.normals.as_ref()]);
    let views = textures.views.iter().map(|view| &view.image);
    let all = views.chain(of_atlas.flatten());
    let depths = textures.relief.as_ref().map_or(0, Relief::stored_bytes);
    depths + all.map(|image| image.bytes.len() as u64).sum::<u64>()
}

/// Takes the pictures of chosen views and bakes the atlas, all of them with sides of that scale.
fn paint(
    (surface, bvh, radius): (&Surface<'_>, &Bvh, f64),
    hull: &CoarseHull,
    (hull_faces, chosen): (&HullFaces, &[Chosen<'_>]),
    params: &TextureParams,
    (scale, watch): (f64, &Watch<'_>),
) -> Result<TextureSet, TextureError> {
    let scaled = |side: u32| ((f64::from(side) * scale).round() as u32).max(LEAST_SIDE_PX);
    let size_px = scaled(params.size_px);
    let cameras: Vec<Camera> = (chosen.iter())
        .map(|view| view.camera.resized((size_px, size_px)))
        .collect();
    let layout = TileLayout::new(&hull_faces.areas, scaled(params.atlas_px), params.tiles);
    let shooter = Shooter::new(hull, (bvh, radius), params.parametrisation);
    let baker = AtlasBaker::new(&layout, hull, shooter, surface, params.normals);
    // A photograph does not show all that is seen from its place, and which part cannot be told from depths.
    let is_drawn = !chosen.is_empty() && chosen.iter().all(|c| c.photograph.is_none());
    let relief = if params.relief_px > 0 && is_drawn {
        let side = (scaled(params.relief_px), params.relief_bits);
        Some(relief::take(surface.mesh, &cameras, side, watch)?)
    } else {
        None
    };
    let raw = RawSet {
        views: take_pictures(surface, chosen, &cameras, watch)?,
        ..raw_atlas(&baker, watch)?
    };
    let encoded = match params.budget_bytes {
        None => raw.encode(params.format, params.quality)?,
        Some(budget) => {
            let is_last = SCALES.last() == Some(&scale);
            let least = if is_last { 1 } else { LEAST_QUALITY };
            let depths = relief.as_ref().map_or(0, Relief::stored_bytes);
            let budget = budget.saturating_sub(depths);
            let qualities: RangeInclusive<u8> = least.min(params.quality)..=params.quality;
            raw.encode_within(params.format, qualities, budget)?.0
        }
    };
    let views = cameras.into_iter().zip(encoded.views);
    Ok(TextureSet {
        visible_views: (0..hull.faces.len())
            .map(|face| {
                let bit = |(v, view): (usize, &Chosen<'_>)| u64::from(view.paintable[face]) << v;
                chosen.iter().enumerate().map(bit).sum()
            })
            .collect(),
        relief,
        views: views
            .map(|(camera, image)| TextureView { camera, image })
            .collect(),
        atlas: Some(Atlas {
            image: encoded.atlas,
            normals: encoded.normals,
            size_px: [layout.side(); 2],
            corner_uvs: (0..hull.faces.len())
                .map(|face| layout.corner_uvs(face))
                .collect(),
        }),
    })
}

/// A view that was chosen.
struct Chosen<'a> {
    camera: Camera,
    /// What it shows, if that is not the original itself.
    photograph: Option<&'a Photograph>,
    /// Per hull face: whether the view may paint it.
    paintable: Vec<bool>,
}

/// Margin left around the hull in a picture, as a factor on the half-tangent: two or three pixels for filtering.
const FRAME_MARGIN: f64 = 1.01;

/// The same camera with the narrowest field of view that holds the hull and all P(v): most models leave much of their
/// bounding sphere empty, and the picture's pixels are better spent on the model. Nothing changes when the hull reaches
/// behind the eye.
fn fit_to_hull(camera: &Camera, hull: &HullFaces) -> Camera {
    let points = hull.corners.iter().chain(&hull.surface_corners).flatten();
    let tangent = points.fold(0.0_f64, |tangent, &p| {
        let depth = camera.depth(p);
        let aside = (p - camera.eye).dot(camera.right).abs();
        let above = (p - camera.eye).dot(camera.up).abs();
        match depth > 0.0 {
            true => tangent.max(aside.max(above) / depth),
            false => f64::INFINITY,
        }
    });
    match tangent.is_finite() {
        true => Camera {
            half_tangent: DVec2::splat(tangent * FRAME_MARGIN),
            ..*camera
        },
        false => *camera,
    }
}

/// Views are chosen by pictures this many times smaller than their own.
const CHOICE_SIZE_DIVISOR: u32 = 2;

/// Faces that no photograph may paint and that together are less than this share of the area are left to the atlas.
const LEAST_UNSEEN: f64 = 0.01;

/// At most this share of the views are pictures of the original where there are photographs.
const MOST_COMPLETING: f64 = 1.0 / 3.0;

/// What views are chosen by.
struct Chooser<'a> {
    original: &'a ClosedMesh,
    hull: &'a HullFaces,
    params: &'a TextureParams,
    watch: &'a Watch<'a>,
}

impl<'a> Chooser<'a> {
    /// Photographs first; where there are none, or they leave faces out, pictures of the original.
    fn choose(
        &self,
        candidates: u32,
        photographs: &'a [Photograph],
    ) -> Result<Vec<Chosen<'a>>, TextureError> {
        let most = self.params.views as usize;
        let center = self.original.bounds().center;
        let of_photograph = |photograph: &'a Photograph| {
            let camera = photographed::camera_at(photograph, center, self.params.size_px)?;
            let camera = fit_to_hull(&camera, self.hull);
            photographed::is_in_front(&camera, self.hull).then_some((camera, Some(photograph)))
        };
        let taken: Vec<Candidate<'a>> = photographs.iter().filter_map(of_photograph).collect();
        let cosines = self.cosines(&taken)?;
        let unseen: Vec<bool> = (0..self.hull.len())
            .map(|face| cosines.iter().all(|c| c[face] <= 0.0))
            .collect();
        let areas = || (0..self.hull.len()).map(|f| (f, self.hull.areas[f]));
        let whole: f64 = areas().map(|(_, area)| area).sum();
        let left: f64 = areas()
            .filter(|&(f, _)| unseen[f])
            .map(|(_, area)| area)
            .sum();
        let share = left / whole.max(f64::MIN_POSITIVE);
        let completing = match (taken.is_empty(), share < LEAST_UNSEEN) {
            (true, _) => most,
            (false, true) => 0,
            (false, false) => ((most as f64 * share).ceil() as usize)
                .min((most as f64 * MOST_COMPLETING) as usize),
        };
        let picked = views::choose_views(&self.hull.areas, &cosines, most - completing.min(most));
        let mut chosen = self.look_closely(picked.into_iter().map(|v| taken[v]).collect())?;
        if completing > 0 {
            chosen.extend(self.complete(candidates, completing, &unseen)?);
        }
        Ok(chosen)
    }

    /// Pictures of the original for the faces that are left.
    fn complete(
        &self,
        candidates: u32,
        count: usize,
        left: &[bool],
    ) -> Result<Vec<Chosen<'a>>, TextureError> {
        let bounds = self.original.bounds();
        let distance = self.params.distance_rel * bounds.radius;
        let side_px = self.params.size_px;
        let cameras: Vec<Candidate<'a>> =
            capture::view_sphere(bounds, distance, candidates, side_px)?
                .iter()
                .map(|camera| (fit_to_hull(camera, self.hull), None))
                .collect();
        let mut cosines = self.cosines(&cameras)?;
        for of_view in &mut cosines {
            for (cosine, &is_left) in of_view.iter_mut().zip(left) {
                *cosine *= f64::from(u8::from(is_left));
            }
        }
        let picked = views::choose_views(&self.hull.areas, &cosines, count);
        let mut chosen = self.look_closely(picked.into_iter().map(|v| cameras[v]).collect())?;
        for view in &mut chosen {
            for (may, &is_left) in view.paintable.iter_mut().zip(left) {
                *may &= is_left;
            }
        }
        Ok(chosen)
    }

    /// At what cosines candidates see the faces, by a quick look: enough to choose by.
    fn cosines(&self, candidates: &[Candidate<'a>]) -> Result<Vec<Vec<f64>>, Interrupted> {
        let quick_px = (self.params.size_px / CHOICE_SIZE_DIVISOR).max(LEAST_SIDE_PX);
        let cosines = candidates
            .par_iter()
            .map(|&(camera, photograph)| {
                let seen = self.look((camera.resized((quick_px, quick_px)), photograph))?;
                self.watch.advance(progress::TEXTURES, 1);
                Ok(views::face_cosines(self.hull, &seen.paintable, camera.eye))
            })
            .collect::<Result<Vec<_>, Interrupted>>()?;
        self.watch.check()?;
        Ok(cosines)
    }

    /// What views may paint, found at their own size.
    fn look_closely(&self, views: Vec<Candidate<'a>>) -> Result<Vec<Chosen<'a>>, Interrupted> {
        let whole = views.into_par_iter().map(|view| self.look(view));
        whole.collect()
    }

    fn look(&self, (camera, photograph): Candidate<'a>) -> Result<Chosen<'a>, Interrupted> {
        self.watch.check()?;
        let buffer = ItemBuffer::draw_mesh(&camera, self.original.mesh());
        let radius = self.original.bounds().radius;
        let mut paintable = visibility::paintable_faces(self.hull, &buffer, &camera, radius);
        if let Some(photograph) = photograph {
            for (may, &points) in paintable.iter_mut().zip(&self.hull.surface_corners) {
                *may = *may && photographed::shows_face(photograph, points);
            }
        }
        Ok(Chosen {
            camera,
            photograph,
            paintable,
        })
    }
}

/// A camera, and the photograph that was taken at its eye.
type Candidate<'a> = (Camera, Option<&'a Photograph>);

/// Samples along each axis of a pixel of a texture view.
const PIXEL_SAMPLES: usize = 2;

fn take_pictures(
    surface: &Surface<'_>,
    chosen: &[Chosen<'_>],
    cameras: &[Camera],
    watch: &Watch<'_>,
) -> Result<Vec<RawPicture>, Interrupted> {
    (chosen.par_iter().zip(cameras))
        .map(|(view, camera)| {
            watch.check()?;
            let mut picture = match view.photograph {
                Some(photograph) => photographed::resampled(photograph, camera),
                None => take_picture(surface, camera),
            };
            picture.fill();
            watch.advance(progress::TEXTURES, 1);
            Ok(RawPicture::of_colours(&picture))
        })
        .collect()
}

fn raw_atlas(baker: &AtlasBaker<'_>, watch: &Watch<'_>) -> Result<RawSet, Interrupted> {
    let pictures = baker.bake(watch)?;
    Ok(RawSet {
        views: Vec::new(),
        atlas: RawPicture::of_colours(&pictures.colours),
        normals: pictures.normals.as_ref().map(RawPicture::of_normals),
    })
}

/// The shaded original; pixels beside it stay unknown.
fn take_picture(surface: &Surface<'_>, camera: &Camera) -> Picture {
    let (width, height) = (camera.width_px as usize, camera.height_px as usize);
    let fine_size = (width * PIXEL_SAMPLES, height * PIXEL_SAMPLES);
    let fine_camera = camera.resized((fine_size.0 as u32, fine_size.1 as u32));
    let buffer = ItemBuffer::draw_mesh(&fine_camera, surface.mesh);
    let mut picture = Picture::new(width, height);
    for y in 0..fine_size.1 {
        for x in 0..fine_size.0 {
            let Some((face, image_weights)) = buffer.face_at(y * fine_size.0 + x) else {
                continue;
            };
            let corners = surface.mesh.corners(face);
            if let Some(triangle) = ImageTriangle::project(&fine_camera, corners) {
                let weights = triangle.object_weights(image_weights);
                let pixel = (y / PIXEL_SAMPLES) * width + x / PIXEL_SAMPLES;
                let normal = surface.normal(face, weights);
                picture.add(pixel, surface.lit_colour(face, weights, normal));
            }
        }
    }
    picture
}

#[cfg(test)]
mod photographed_tests;
#[cfg(test)]
mod tests;
