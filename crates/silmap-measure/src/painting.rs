//! Quality measures of a hull's textures.

use silmap_geometry::Camera;
use silmap_map::{Atlas, CoarseHull, TextureSet};
use silmap_preprocess::texture::{HullFaces, face_cosines, merit, picture_bytes};

/// How well a hull is painted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Painting {
    /// Texture views taken.
    pub views: u32,
    /// Σ area × cosine over Σ area, each hull face with the view that sees it most squarely: 1 is head-on everywhere.
    pub merit: f64,
    /// Share of the hull's area that some view may paint.
    pub seen_share: f64,
    /// Share of the hull's area that no view may paint: it falls to the atlas, or without one is lit.
    pub atlas_share: f64,
    /// Views that may paint a face, on average over the hull's area.
    pub views_per_face: f64,
    /// Pixels of the texture views along a bounding radius of the model: the root of their mean number an area, over the faces that
    /// are seen, each in the view that shows it largest.
    pub view_texels_per_radius: f64,
    /// The same of the atlas over all faces; zero without one.
    pub atlas_texels_per_radius: f64,
    /// Bytes of all pictures.
    pub bytes: u64,
}

/// How well `textures` paint `hull`, which encloses a model of this bounding radius.
#[must_use]
pub fn painting(hull: &CoarseHull, textures: &TextureSet, radius: f64) -> Painting {
    let faces = HullFaces::new(hull);
    let bits = |face: usize| textures.visible_views.get(face).copied().unwrap_or(0);
    let is_seen_by = |face: usize, view: usize| bits(face) >> view & 1 == 1;
    let cosines: Vec<Vec<f64>> = textures
        .views
        .iter()
        .enumerate()
        .map(|(v, view)| {
            let paintable: Vec<bool> = (0..faces.len()).map(|f| is_seen_by(f, v)).collect();
            face_cosines(&faces, &paintable, view.camera.eye)
        })
        .collect();
    let cosines: Vec<&[f64]> = cosines.iter().map(Vec::as_slice).collect();
    let area = |weight: &dyn Fn(usize) -> f64| -> f64 {
        (0..faces.len()).map(|f| faces.areas[f] * weight(f)).sum()
    };
    let whole = area(&|_| 1.0);
    let seen = area(&|f| f64::from(u8::from(bits(f) != 0)));
    let of = |part: f64, all: f64| if all > 0.0 { part / all } else { 0.0 };
    let largest_in_views = |f: usize| -> f64 {
        let views = textures.views.iter().enumerate();
        let pixels = views.filter(|(v, _)| is_seen_by(f, *v));
        pixels.fold(0.0, |most, (_, view)| {
            most.max(pixels_of(&faces, f, &view.camera))
        })
    };
    let in_views: f64 = (0..faces.len()).map(largest_in_views).sum();
    let in_atlas: f64 = textures.atlas.as_ref().map_or(0.0, texels_of);
    Painting {
        views: textures.views.len() as u32,
        merit: merit(&faces.areas, &cosines),
        seen_share: of(seen, whole),
        atlas_share: of(whole - seen, whole),
        views_per_face: of(area(&|f| f64::from(bits(f).count_ones())), whole),
        view_texels_per_radius: of(in_views, seen).sqrt() * radius,
        atlas_texels_per_radius: of(in_atlas, whole).sqrt() * radius,
        bytes: picture_bytes(textures),
    }
}

/// Pixels that a face has in a picture.
fn pixels_of(faces: &HullFaces, face: usize, camera: &Camera) -> f64 {
    let [a, b, c] = faces.corners[face].map(|p| camera.image_from_object(p));
    0.5 * (b - a).perp_dot(c - a).abs()
}

/// Texels of all faces' triangles.
fn texels_of(atlas: &Atlas) -> f64 {
    let size = atlas.size_px.map(f64::from);
    let of_face = |uvs: &[[f32; 2]; 3]| {
        let [a, b, c] = uvs.map(|[u, v]| glam::DVec2::new(u.into(), v.into()));
        0.5 * (b - a).perp_dot(c - a).abs() * size[0] * size[1]
    };
    atlas.corner_uvs.iter().map(of_face).sum()
}
