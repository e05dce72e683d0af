//! Colours of a carved surface out of the photographs.
//!
//! Each corner takes the colours of the views that see it, those most that look at it squarely, and none where it is near the border of
//! a mask, so that no background comes in. Pictures that are taken of the surface later show it under the studio light; what is stored
//! is therefore the colour over that light, so that they show the photographs' own.

use glam::DVec3;
use rayon::prelude::*;
use silmap_geometry::watch::{Interrupted, Stage, Watch};
use silmap_geometry::{Bvh, ClosedMesh, lighting};

use crate::looker::Looker;
use crate::photographs::ViewPhotograph;

/// Colouring the surface.
pub const PAINT: Stage = Stage("colouring from photographs");

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
/// # Errors
/// When the caller asked to stop.
pub fn paint(
    mesh: ClosedMesh,
    photographs: &[ViewPhotograph],
    watch: &Watch<'_>,
) -> Result<(ClosedMesh, Painted), Interrupted> {
    let nothing = Painted {
        photographs: 0,
        seen: 0.0,
    };
    if photographs.is_empty() {
        return Ok((mesh, nothing));
    }
    let tree = Bvh::new(mesh.mesh());
    let normals = mesh.mesh().vertex_normals();
    let mut sums = vec![([0.0_f64; 3], 0.0_f64); normals.len()];
    watch.start(PAINT, photographs.len() as u64);
    for ViewPhotograph { photograph, .. } in photographs {
        watch.check()?;
        let looker = Looker::new(photograph, &tree, &mesh);
        let positions = &mesh.mesh().positions;
        (sums.par_iter_mut().zip(positions).zip(&normals)).for_each(|((sum, &p), &normal)| {
            let Some(look) = looker.look(p, normal) else {
                return;
            };
            for (s, c) in sum.0.iter_mut().zip(look.seen.colour) {
                *s += look.weight * f64::from(c);
            }
            sum.1 += look.weight;
        });
        watch.advance(PAINT, 1);
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
        photographs: photographs.len(),
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
