//! The outlines of a model's parts from a view, as precise as eyes near the view may see them.

use glam::DVec2;
use silmap_geometry::polygon::signed_area;
use silmap_geometry::trace::trace_contours;
use silmap_geometry::{Bounds, Camera, ClosedMesh, CoverageRule, Loop, Mask};
use silmap_map::ViewContour;

use crate::build_params::BuildParams;
use crate::capture::{CaptureError, RimEdges, RimSearch, cpu, edge_depths};
use crate::parts::Part;
use crate::parts::hidden::{Near, Silhouettes};
use crate::simplify_contour::{SimplifyContourParams, simplify_contours, thin_hidden};

/// What lies less deep than this within all silhouettes near a view may come to be seen, pixels.
const LEAST_DEPTH_PX: f64 = 4.0;

/// What lies deeper may move by this share of how much deeper it lies: the rest of the way is for what interpolation makes of it.
const ROOM_SHARE: f64 = 0.5;

/// But by no more than this, pixels.
const MOST_ROOM_PX: f64 = 32.0;

/// The parts of a model, and its silhouettes from all views.
pub(crate) struct PartOutlines<'a> {
    bounds: &'a Bounds,
    parts: &'a [Part],
    silhouettes: Option<Silhouettes<'a>>,
    rule: CoverageRule,
    simplification: SimplifyContourParams,
}

/// Loops, and of each of their vertices whether no eye near the view sees it.
type Thinned = (Vec<Loop>, Vec<Vec<bool>>);

impl<'a> PartOutlines<'a> {
    /// Of a model and its parts.
    pub(crate) fn new(
        model: &'a ClosedMesh,
        parts: &'a [Part],
        (cameras, masks): (&'a [Camera], &[Mask]),
        (params, simplification): (&BuildParams, SimplifyContourParams),
    ) -> Self {
        let bounds = model.bounds();
        Self {
            bounds,
            parts,
            silhouettes: Silhouettes::new((cameras, masks), bounds.center, params.map.keep),
            rule: params.capture.coverage,
            simplification,
        }
    }

    /// The outlines of all parts that a view may show, with depths.
    ///
    /// # Errors
    /// When a part cannot be drawn.
    pub(crate) fn contours(
        &self,
        view: usize,
        camera: &Camera,
    ) -> Result<Vec<ViewContour>, CaptureError> {
        let near = self.silhouettes.as_ref().map(|s| s.near(view));
        let mut mask = Mask::new(camera.width_px, camera.height_px);
        let mut contours = Vec::new();
        for (number, part) in (0_u16..).zip(self.parts) {
            cpu::rasterise(&part.mesh, camera, self.rule, &mut mask)?;
            let loops = simplify_contours(&trace_contours(&mask), &self.simplification);
            let edges = part.edges.seen_by(&part.mesh, camera);
            let (loops, is_hidden) = match &near {
                Some(near) => self.thinned(&edges, camera, &loops, near),
                None => {
                    let none = loops.iter().map(|l| vec![false; l.len()]).collect();
                    (loops, none)
                }
            };
            let search = RimSearch {
                bvh: &part.tree,
                bounds: self.bounds,
                camera,
                edges: Some(&edges),
                outward_only: self.simplification.outward_only,
            };
            let (loops, depths) = search.deep_contours(&loops, &is_hidden);
            contours.extend(
                (loops.into_iter().zip(depths)).map(|(points, depths)| ViewContour {
                    points,
                    depths,
                    part: number,
                    ..ViewContour::default()
                }),
            );
        }
        Ok(contours)
    }

    /// Thins out what no eye near the view sees, and leaves out loops of which none sees anything.
    fn thinned(&self, edges: &RimEdges, camera: &Camera, loops: &[Loop], near: &Near) -> Thinned {
        let room = |p: DVec2, depth: Option<f64>| {
            let Some(depth) = depth else { return 0.0 };
            let point = camera.object_from_image(p, depth);
            (ROOM_SHARE * near.beyond(point, LEAST_DEPTH_PX)).min(MOST_ROOM_PX)
        };
        let rooms: Vec<Vec<f64>> = (loops.iter().zip(edge_depths(edges, loops)))
            .map(|(points, depths)| {
                let vertices = points.iter().zip(depths);
                vertices.map(|(&p, depth)| room(p, depth)).collect()
            })
            .collect();
        let thinned = thin_hidden(loops, &rooms, self.simplification.outward_only);
        // What is left out conservatively must lie within another part: that is not known.
        let keeps_all = self.simplification.outward_only;
        let is_hole = |points: &Loop| signed_area(points) < 0.0;
        let shows = |is_hidden: &[bool]| is_hidden.iter().any(|hidden| !hidden);
        // A hole is one in what is around it.
        let keeps_outer = keeps_all || thinned.iter().any(|(l, h)| is_hole(l) && shows(h));
        let is_seen = |(points, is_hidden): &(Loop, Vec<bool>)| {
            (keeps_outer && !is_hole(points)) || shows(is_hidden)
        };
        thinned.into_iter().filter(is_seen).unzip()
    }
}
