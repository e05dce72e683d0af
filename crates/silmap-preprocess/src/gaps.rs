//! Gaps between photographs that their own outlines bridge.
//!
//! Between photographs that are far from each other, the model can be drawn as a further view. Whether that is better than what the
//! photographs' outlines give there depends on the model: the arms of a starfish move past each other between views that show a statue
//! nearly alike, and a carved hull is only as good as the noise of its masks. So an added viewpoint is needed where the interpolated
//! outline differs from the drawn one much more than photographs' own outlines do.
//!
//! Source: beyond the paper, whose viewpoints are evenly spread.

use rayon::prelude::*;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::polygon::fill_non_zero;
use silmap_geometry::watch::Watch;
use silmap_geometry::{Bounds, Camera, ClosedMesh, Mask, SeenSilhouette};
use silmap_map::{Detail, Interpolation, MapReader, Method};

use crate::build_error::BuildError;
use crate::build_params::BuildParams;
use crate::captured::Captured;
use crate::seen::middle;

/// What is between photographs that are far from each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gaps {
    /// The model's own silhouettes, where the photographs' outlines do not give them.
    Drawn,
    /// Nothing.
    Open,
}

/// Viewpoints farther than this from all photographs are needed in any case: 34°, which is half of the widest gap that is bridged.
const WIDEST_RAD: f64 = 0.6;

/// Interpolated outlines may differ from the model's so many times as much as photographs' outlines usually do...
const USUAL_TIMES: f64 = 1.5;

/// ... and by this share of what is inside in any case.
const LEAST_REL: f64 = 0.01;

/// The silhouettes that photographs show, and those that the model has where there is no photograph; of a model that nobody photographed,
/// evenly spread ones. Only cameras that are needed have outlines: the others are there for the polytope.
///
/// # Errors
/// When interrupted, the view sphere is too small, or a view cannot be drawn.
pub fn capture_around(
    model: &ClosedMesh,
    silhouettes: &[SeenSilhouette],
    params: &BuildParams,
    (gaps, is_needed): (Gaps, &dyn Fn(&Camera) -> bool),
    watch: &Watch<'_>,
) -> Result<Captured, BuildError> {
    if silhouettes.is_empty() {
        return Captured::evenly(model, params, params.views, watch);
    }
    let all = Captured::around_photographs(model, silhouettes, params, is_needed, watch)?;
    let kept = match gaps {
        Gaps::Drawn => needed_views(&all, model, params, watch)?,
        Gaps::Open => views_around_gaps(&all, model.bounds()),
    };
    Ok(all.subset(&kept))
}

/// The photographs' own views, and of the others those that are far from all photographs: all of them where these make no polytope.
fn views_around_gaps(all: &Captured, bounds: &Bounds) -> Vec<bool> {
    let direction = |camera: &Camera| (camera.eye - bounds.center).normalize_or_zero();
    let (photographs, added) = all.cameras.split_at(all.seen.len());
    let is_far = |camera: &Camera| {
        let cosine = |p: &Camera| direction(p).dot(direction(camera));
        photographs.iter().map(cosine).fold(-1.0, f64::max) < WIDEST_RAD.cos()
    };
    let of_photographs = photographs.iter().map(|_| true);
    let found: Vec<bool> = of_photographs.chain(added.iter().map(is_far)).collect();
    match all.is_polytope(&found, bounds) {
        true => found,
        false => vec![true; all.cameras.len()],
    }
}

/// Which views a map needs: the photographs' own, and of the others those whose outline these do not give.
///
/// # Errors
/// When interrupted, or the views far from all photographs make no map.
fn needed_views(
    all: &Captured,
    model: &ClosedMesh,
    params: &BuildParams,
    watch: &Watch<'_>,
) -> Result<Vec<bool>, BuildError> {
    let mut needed = views_around_gaps(all, model.bounds());
    if needed.iter().all(|&is_needed| is_needed) {
        return Ok(needed);
    }
    let (photographs, bridge) = (all.seen.len(), all.subset(&needed));
    let differ = |a: &Mask, b: &Mask| a.count_different(b) as f64 / b.count().max(1) as f64;
    let noise = (all.masks.iter().zip(&all.drawn))
        .filter_map(|(own, drawn)| Some(differ(own, drawn.as_ref()?)));
    let usual = middle(noise).unwrap_or(0.0);
    let most = (USUAL_TIMES * usual).max(LEAST_REL);

    let map = bridge.map(model, &Bvh::new(model.mesh()), params, &watch.quiet())?;
    let how = Interpolation {
        method: Method::Tight,
        detail: Detail::Level(0),
        ..Interpolation::default()
    };
    let wanted: Vec<bool> = (photographs..all.cameras.len())
        .into_par_iter()
        .map_init(
            || MapReader::new(&map),
            |reader, view| {
                watch.check()?;
                if needed[view] || !all.has_outline(view) {
                    return Ok(true);
                }
                let camera = &all.cameras[view];
                let Ok(reader) = reader else {
                    return Ok(true);
                };
                if reader.interpolate(&map, camera, how).is_err() {
                    return Ok(true);
                }
                let mut given = Mask::new(camera.width_px, camera.height_px);
                fill_non_zero(reader.simple_loops().to_loops(), &mut given);
                Ok(differ(&given, &all.masks[view]) > most)
            },
        )
        .collect::<Result<_, BuildError>>()?;
    needed.truncate(photographs);
    needed.extend(wanted);
    match all.is_polytope(&needed, model.bounds()) {
        true => Ok(needed),
        false => Ok(vec![true; all.cameras.len()]),
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};
    use silmap_geometry::TriangleMesh;
    use silmap_models as models;

    use super::*;
    use crate::capture::Backend;
    use crate::progress::Unused;
    use crate::seen::tests::seen_by;

    /// How many views near their ring are kept of a model that ten photographs around it show, each 36° from the next.
    fn kept(mesh: TriangleMesh, gaps: Gaps) -> usize {
        let model = ClosedMesh::try_from(mesh).unwrap();
        let bounds = *model.bounds();
        let photograph = |k: u32| -> SeenSilhouette {
            let turn = std::f64::consts::TAU * f64::from(k) / 10.0;
            let eye = bounds.center + 4.0 * bounds.radius * DVec3::new(turn.cos(), 0.2, turn.sin());
            let size = (600, 600);
            let camera = Camera::fit_sphere(eye, bounds.center, bounds.radius, None, size).unwrap();
            seen_by(model.mesh(), &camera, "photograph")
        };
        let photographs: Vec<SeenSilhouette> = (0..10).map(photograph).collect();
        let mut params = BuildParams {
            views: 300,
            resolution_px: 256,
            ..BuildParams::default()
        };
        params.capture.backend = Backend::Cpu;
        let watch = Watch::silent();
        let which: (Gaps, &dyn Fn(&Camera) -> bool) = (gaps, &|_| true);
        let found = capture_around(&model, &photographs, &params, which, &watch).unwrap();
        assert!(found.is_polytope(&vec![true; found.cameras.len()], &bounds));
        let height = |c: &Camera| (c.eye - bounds.center).normalize_or_zero().y;
        let near_the_ring = |c: &&Camera| (height(c) - 0.2).abs() < 0.1;
        found.cameras.iter().filter(near_the_ring).count()
    }

    #[test]
    fn gaps_are_drawn_where_the_photographs_do_not_give_what_is_there() {
        // Its axis is that of the ring.
        let mut cone = models::bicone(64);
        for p in &mut cone.positions {
            *p = DVec3::new(p.y, p.z, p.x);
        }
        let cone = kept(cone, Gaps::Drawn);
        let arms = kept(models::organic(3000), Gaps::Drawn);
        let open = kept(models::organic(3000), Gaps::Open);
        assert!(cone <= 13, "{cone}");
        assert_eq!(open, 10);
        assert!(arms >= 18);
    }

    /// A photograph from within the model says nothing: the views are those of a model that nobody photographed.
    #[test]
    fn silhouettes_that_cannot_be_used_leave_evenly_spread_views() {
        let model = ClosedMesh::try_from(models::torus(600)).unwrap();
        let params = BuildParams {
            views: 20,
            resolution_px: 32,
            ..BuildParams::default()
        };
        let silhouette = SeenSilhouette {
            name: "within".to_owned(),
            eye: model.bounds().center + DVec3::X * 0.5 * model.bounds().radius,
            outline: Vec::new(),
            ray_from_image: DMat3::IDENTITY,
            photographed: 1.0,
        };
        let watch = Watch::silent();
        let which: (Gaps, &dyn Fn(&Camera) -> bool) = (Gaps::Drawn, &|_| true);
        let found = capture_around(&model, &[silhouette], &params, which, &watch).unwrap();
        let evenly = Captured::evenly(&model, &params, 20, &watch).unwrap();
        assert_eq!(found.cameras, evenly.cameras);
        assert_eq!(found.unused, [(0, Unused::Behind)]);
    }
}
