//! Colours of a carved surface out of the photographs.
//!
//! Each corner takes the colours of the views that see it, those most that look at it squarely, and none where it is near the border of
//! a mask, so that no background comes in. Pictures that are taken of the surface later show it under the studio light; what is stored
//! is therefore the colour over that light, so that they show the photographs' own.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use silmap_geometry::watch::{Interrupted, Stage, Watch};
use silmap_geometry::{Bvh, ClosedMesh, ColourImage, TextureWrap, lighting};

use crate::pinhole::Pinhole;
use crate::signed_distance::SignedDistance;
use crate::view::{Capture, CaptureWarning};

/// Colouring the surface.
pub const PAINT: Stage = Stage("colouring from photographs");

/// Weights are the cosine to the view to this power: about the nearest view, and no seam.
const SHARPNESS: i32 = 6;

/// Views more oblique than this cosine are not asked.
const LEAST_COSINE: f64 = 0.1;

/// Nearer to the mask's border than the first a view has no weight, farther than the second all of it, pixels.
const BORDER_PX: [f64; 2] = [1.5, 6.0];

/// How far the surface may lie in front of a corner and not hide it, in shares of its bounding radius.
const SLACK_REL: f64 = 0.01;

/// How much of a surface was coloured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Painted {
    /// Photographs used.
    pub photographs: usize,
    /// Share of the vertices that some photograph shows.
    pub seen: f64,
}

/// Gives the surface the colours of the photographs, if there are any; what none shows has the mean colour of the rest.
///
///
/// # Errors
/// When the caller asked to stop.
pub fn paint(
    mesh: ClosedMesh,
    capture: &Capture,
    warnings: &mut Vec<CaptureWarning>,
    watch: &Watch<'_>,
) -> Result<(ClosedMesh, Painted), Interrupted> {
    let with_photo = capture.views.iter().filter(|v| v.photo.is_some()).count();
    let nothing = Painted {
        photographs: 0,
        seen: 0.0,
    };
    if with_photo == 0 {
        return Ok((mesh, nothing));
    }
    let tree = Bvh::new(mesh.mesh());
    let normals = mesh.mesh().vertex_normals();
    let mut sums = vec![([0.0_f64; 3], 0.0_f64); normals.len()];
    let mut photographs = 0;
    watch.start(PAINT, with_photo as u64);
    for view in &capture.views {
        let Some(path) = &view.photo else { continue };
        watch.check()?;
        watch.advance(PAINT, 1);
        let picture = match view.photograph() {
            Ok(Some(picture)) => picture,
            Ok(None) => continue,
            Err(fault) => {
                warnings.push(CaptureWarning::Photo {
                    view: view.name.clone(),
                    reason: format!("{} {fault}", path.display()),
                });
                continue;
            }
        };
        photographs += 1;
        let picture = ColourImage {
            width: picture.width(),
            height: picture.height(),
            rgba: picture.into_raw(),
        };
        let looker = Looker {
            camera: view.camera.moved(-mesh.origin()),
            distances: SignedDistance::new(&view.mask),
            tree: &tree,
            slack: SLACK_REL * mesh.bounds().radius,
        };
        let positions = &mesh.mesh().positions;
        (sums.par_iter_mut().zip(positions).zip(&normals)).for_each(|((sum, &p), &normal)| {
            let Some((image, weight)) = looker.look(p, normal) else {
                return;
            };
            let size = [picture.width, picture.height].map(|s| s as f32);
            let uv = [image.x as f32 / size[0], image.y as f32 / size[1]];
            let colour = picture.sample_linear(uv, [TextureWrap::ClampToEdge; 2]);
            for (s, c) in sum.0.iter_mut().zip(colour) {
                *s += weight * f64::from(c);
            }
            sum.1 += weight;
        });
    }
    watch.finish(PAINT);
    let seen = sums.iter().filter(|s| s.1 > 0.0).count();
    if seen == 0 {
        return Ok((mesh, nothing));
    }
    let colours = albedos(&sums, &normals);
    let origin = mesh.origin();
    let mut plain = mesh.clone().into_mesh();
    plain.appearance.corner_colours = (plain.faces.iter())
        .map(|face| face.map(|v| colours[v as usize]))
        .collect();
    // Colours change nothing about its being closed.
    let coloured = ClosedMesh::try_from(plain).map_or(mesh, |m| m.with_origin(origin));
    let painted = Painted {
        photographs,
        seen: seen as f64 / normals.len() as f64,
    };
    Ok((coloured, painted))
}

/// Colours over the studio light.
fn albedos(sums: &[([f64; 3], f64)], normals: &[DVec3]) -> Vec<[f32; 3]> {
    let light = |normal: DVec3| f64::from(lighting::irradiance(normal.as_vec3().to_array()));
    let mut mean = ([0.0; 3], 0.0);
    for ((sum, weight), &normal) in sums.iter().zip(normals) {
        if *weight > 0.0 {
            for (m, s) in mean.0.iter_mut().zip(sum) {
                *m += s / weight;
            }
            mean.1 += light(normal);
        }
    }
    let unseen = mean.0.map(|m| (m / mean.1) as f32);
    (sums.iter().zip(normals))
        .map(|((sum, weight), &normal)| match *weight > 0.0 {
            true => sum.map(|s| (s / weight / light(normal)) as f32),
            false => unseen,
        })
        .collect()
}

/// A view that is asked for its colours.
struct Looker<'a> {
    camera: Pinhole,
    distances: SignedDistance,
    tree: &'a Bvh,
    slack: f64,
}

impl Looker<'_> {
    /// Where the view shows a point of the surface, and how well; `None` where it does not.
    fn look(&self, point: DVec3, normal: DVec3) -> Option<(DVec2, f64)> {
        let to_eye = self.camera.eye - point;
        let cosine = to_eye.normalize_or_zero().dot(normal);
        if cosine < LEAST_COSINE {
            return None;
        }
        let (image, _) = self.camera.project(point)?;
        if !self.camera.shows(image) {
            return None;
        }
        let inside = -self.distances.at(image);
        let [none, all] = BORDER_PX;
        let trust = ((inside - none) / (all - none)).clamp(0.0, 1.0);
        if trust <= 0.0 {
            return None;
        }
        let from = self.slack / to_eye.length();
        let is_hidden = self.tree.first_hit(point, to_eye, from, 1.0).is_some();
        (!is_hidden).then(|| {
            (
                image,
                trust * (cosine - LEAST_COSINE).powi(2) * cosine.powi(SHARPNESS),
            )
        })
    }
}
