//! What the hull is painted with: shaded pictures of the original that are projected onto it, and the tile atlas.
//!
//! Source: Silhouette Mapping (TR-1-99), section 8.2, for the pictures and visibility bits; Silhouette Clipping (SIGGRAPH
//! 2000), section 4, for the atlas.
//! Deviations: views are chosen automatically ([`views`]), and a view that shows something else than the face's own surface
//! does not count as seeing it ([`visibility`]).

mod atlas;
mod item_buffer;
mod picture;
mod surface;
mod views;
mod visibility;

use glam::{DVec2, DVec3};
use image::ImageError;
use rayon::prelude::*;
use silmap_geometry::{Bvh, Camera, CameraError, ClosedMesh, TriangleMesh};
use silmap_map::asset::MAX_TEXTURE_VIEWS;
use silmap_map::{Atlas, CoarseHull, TextureSet, TextureView};
use thiserror::Error;

use crate::capture;
use crate::progress::{Interrupted, Monitor, Stage};
use atlas::{ShootingFaces, TileLayout};
use item_buffer::{ImageTriangle, ItemBuffer};
use picture::Picture;
use surface::Surface;
use visibility::HullFaces;

/// How the hull is painted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureParams {
    /// Most texture views to choose; at most [`MAX_TEXTURE_VIEWS`]. The paper takes 20.
    pub views: u32,
    /// Side of the texture views' square pictures, pixels.
    pub size_px: u32,
    /// Side of the atlas, pixels; it becomes less by rounding, and more when the hull has too many faces for it.
    pub atlas_px: u32,
    /// Viewpoints to choose from, spread evenly over the view sphere.
    pub candidates: u32,
    /// Distance of the viewpoints from the center, bounding radii.
    pub distance_rel: f64,
    /// Quality of JPEG pictures, 1 to 100.
    pub jpeg_quality: u8,
}

impl Default for TextureParams {
    fn default() -> Self {
        Self {
            views: 20,
            size_px: 512,
            atlas_px: 512,
            candidates: 200,
            distance_rel: 3.0,
            jpeg_quality: 88,
        }
    }
}

/// Sides of pictures that are worth making and can be held while they are drawn in several samples a pixel, pixels.
const SIZES_PX: std::ops::RangeInclusive<u32> = 16..=2048;

/// Most viewpoints to choose from.
const MAX_CANDIDATES: u32 = 10_000;

impl TextureParams {
    /// Checks that the numbers can be worked with.
    ///
    /// # Errors
    /// The first number that is out of range.
    pub fn validate(&self) -> Result<(), TextureError> {
        let checks = [
            ("texture views", self.views, 0..=MAX_TEXTURE_VIEWS as u32),
            ("pixels of a texture view", self.size_px, SIZES_PX),
            ("pixels of the atlas", self.atlas_px, SIZES_PX),
            ("candidate viewpoints", self.candidates, 1..=MAX_CANDIDATES),
            ("JPEG quality", self.jpeg_quality.into(), 1..=100),
        ];
        for (what, value, range) in checks {
            if !range.contains(&value) {
                let (low, high) = range.into_inner();
                return Err(TextureError::Parameter {
                    what,
                    value,
                    low,
                    high,
                });
            }
        }
        Ok(())
    }
}

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
}

/// How well a hull is painted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TextureReport {
    /// Texture views taken.
    pub views: u32,
    /// Σ area × cosine over Σ area, each hull face with the view that sees it most squarely: 1 is head-on everywhere.
    pub merit: f64,
    /// Share of the hull's area that no view may paint; it takes the atlas.
    pub unseen_share: f64,
    /// Views that may paint a face, on average over the hull's area.
    pub views_per_face: f64,
}

/// Chooses texture views, takes their pictures, finds which faces each may paint, and bakes the atlas.
///
/// `bvh` is over the original's faces. The result depends on the arguments alone, not on the number of threads.
///
/// # Errors
/// When a parameter is out of range, the hull is empty, the viewpoints lie in the model, or the caller asked to stop.
pub fn bake(
    original: &ClosedMesh,
    bvh: &Bvh,
    hull: &CoarseHull,
    params: &TextureParams,
    monitor: &Monitor<'_>,
) -> Result<TextureSet, TextureError> {
    params.validate()?;
    let vertex_count = hull.positions.len();
    let mut corners = hull.faces.iter().flatten();
    if hull.faces.is_empty() || corners.any(|&v| v as usize >= vertex_count) {
        return Err(TextureError::NoHull);
    }
    let layout = TileLayout::new(hull.faces.len(), params.atlas_px);
    let candidates = if params.views == 0 {
        0
    } else {
        params.candidates
    };
    let total = u64::from(candidates + params.views) + u64::from(layout.side());
    monitor.start(Stage::Textures, total);

    let surface = Surface::new(original.mesh());
    let hull_faces = HullFaces::new(hull);
    let chosen = choose(original, &hull_faces, candidates, params, monitor)?;
    let views = take_pictures(&surface, &chosen, params, monitor)?;
    let atlas = bake_atlas(original, bvh, hull, &hull_faces, &layout, monitor)?;
    monitor.finish(Stage::Textures);
    Ok(TextureSet {
        visible_views: (0..hull.faces.len())
            .map(|face| {
                let bit = |(v, view): (usize, &Chosen)| u64::from(view.paintable[face]) << v;
                chosen.iter().enumerate().map(bit).sum()
            })
            .collect(),
        views,
        atlas: Some(atlas),
    })
}

/// How well `textures` paint `hull`.
#[must_use]
pub fn report(hull: &CoarseHull, textures: &TextureSet) -> TextureReport {
    let faces = HullFaces::new(hull);
    let bits = |face: usize| textures.visible_views.get(face).copied().unwrap_or(0);
    let cosines: Vec<Vec<f64>> = textures
        .views
        .iter()
        .enumerate()
        .map(|(v, view)| {
            let paintable: Vec<bool> = (0..faces.len()).map(|f| bits(f) >> v & 1 == 1).collect();
            views::face_cosines(&faces, &paintable, view.camera.eye)
        })
        .collect();
    let cosines: Vec<&[f64]> = cosines.iter().map(Vec::as_slice).collect();
    let whole: f64 = faces.areas.iter().sum();
    let share = |weight: &dyn Fn(usize) -> f64| -> f64 {
        let sum: f64 = (0..faces.len()).map(|f| faces.areas[f] * weight(f)).sum();
        if whole > 0.0 { sum / whole } else { 0.0 }
    };
    TextureReport {
        views: textures.views.len() as u32,
        merit: views::merit(&faces.areas, &cosines),
        unseen_share: share(&|f| f64::from(u8::from(bits(f) == 0))),
        views_per_face: share(&|f| f64::from(bits(f).count_ones())),
    }
}

/// A view that was chosen.
struct Chosen {
    camera: Camera,
    /// Per hull face: whether the view may paint it.
    paintable: Vec<bool>,
}

fn draw_mesh(camera: &Camera, mesh: &TriangleMesh) -> ItemBuffer {
    ItemBuffer::draw(camera, mesh.faces.len(), |f| mesh.corners(f))
}

/// Room left around the hull in a picture, as a factor on the half-tangent: two or three pixels for filtering.
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

fn choose(
    original: &ClosedMesh,
    hull: &HullFaces,
    candidates: u32,
    params: &TextureParams,
    monitor: &Monitor<'_>,
) -> Result<Vec<Chosen>, TextureError> {
    let bounds = original.bounds();
    let distance = params.distance_rel * bounds.radius;
    let mut seen = capture::view_sphere(bounds, distance, candidates, params.size_px)?
        .into_par_iter()
        .map(|camera| {
            monitor.check()?;
            let camera = fit_to_hull(&camera, hull);
            let buffer = draw_mesh(&camera, original.mesh());
            let paintable = visibility::paintable_faces(hull, &buffer, &camera, bounds.radius);
            monitor.advance(Stage::Textures, 1);
            Ok(Some(Chosen { camera, paintable }))
        })
        .collect::<Result<Vec<_>, Interrupted>>()?;
    let cosines: Vec<Vec<f64>> = seen
        .iter()
        .flatten()
        .map(|view| views::face_cosines(hull, &view.paintable, view.camera.eye))
        .collect();
    monitor.check()?;
    let chosen = views::choose_views(&hull.areas, &cosines, params.views as usize);
    Ok(chosen.into_iter().filter_map(|v| seen[v].take()).collect())
}

/// Samples along each axis of a pixel of a texture view.
const PIXEL_SAMPLES: usize = 2;

fn take_pictures(
    surface: &Surface<'_>,
    chosen: &[Chosen],
    params: &TextureParams,
    monitor: &Monitor<'_>,
) -> Result<Vec<TextureView>, TextureError> {
    chosen
        .par_iter()
        .map(|view| {
            monitor.check()?;
            let mut picture = take_picture(surface, &view.camera);
            picture.fill();
            let image = picture.to_smallest(params.jpeg_quality)?;
            monitor.advance(Stage::Textures, 1);
            Ok(TextureView {
                camera: view.camera,
                image,
            })
        })
        .collect()
}

/// The shaded original; pixels beside it stay unknown.
fn take_picture(surface: &Surface<'_>, camera: &Camera) -> Picture {
    let (width, height) = (camera.width_px as usize, camera.height_px as usize);
    let fine_size = (width * PIXEL_SAMPLES, height * PIXEL_SAMPLES);
    let fine_camera = camera.resized((fine_size.0 as u32, fine_size.1 as u32));
    let buffer = draw_mesh(&fine_camera, surface.mesh);
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
                picture.add(pixel, surface.colour(face, weights));
            }
        }
    }
    picture
}

fn bake_atlas(
    original: &ClosedMesh,
    bvh: &Bvh,
    hull: &CoarseHull,
    hull_faces: &HullFaces,
    layout: &TileLayout,
    monitor: &Monitor<'_>,
) -> Result<Atlas, TextureError> {
    let positions = hull.positions.iter();
    let mesh = TriangleMesh {
        positions: positions
            .map(|p| DVec3::from_array(p.map(f64::from)))
            .collect(),
        faces: hull.faces.clone(),
        ..TriangleMesh::default()
    };
    let normals = mesh.vertex_normals();
    let faces = ShootingFaces {
        corners: &hull_faces.corners,
        normals: mesh
            .faces
            .iter()
            .map(|f| f.map(|v| normals[v as usize]))
            .collect(),
        radius: original.bounds().radius,
    };
    let surface = Surface::new(original.mesh());
    let picture = atlas::shoot_atlas(layout, &faces, &surface, bvh, monitor)?;
    Ok(Atlas {
        image: picture.to_png()?,
        size_px: [layout.side(); 2],
        corner_uvs: (0..hull.faces.len())
            .map(|face| layout.corner_uvs(face))
            .collect(),
    })
}

#[cfg(test)]
mod tests;
