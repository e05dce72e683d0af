//! The edges of a mesh where it turns away from a view, as places to look depths up.
//!
//! The outline of a mesh is made of edges between a face that looks towards the eye and one that does not, seen where no other such edge is
//! farther out. Along them the depth of the contour generator is known exactly, without following a ray.

use glam::{DVec2, DVec3};
use silmap_geometry::topology::Topology;
use silmap_geometry::{Camera, TriangleMesh};

/// Side of the cells that edges are sorted into, pixels.
const CELL_PX: f64 = 4.0;

/// How far across an outline its edges are looked for, pixels: traced and simplified outlines are about so far off. The nearer try first.
const REACH_PX: [f64; 2] = [1.5, 3.0];

const NONE: u32 = u32::MAX;

/// The edges of a mesh with the faces beside them.
#[derive(Debug)]
pub struct MeshEdges {
    /// Per face: normal and offset of its plane.
    planes: Vec<(DVec3, f64)>,
    edges: Vec<Edge>,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [u32; 2],
    /// The same one twice where there is no other.
    faces: [u32; 2],
}

impl MeshEdges {
    /// Of `mesh`. An edge of one face, or of more than two, is one for each of them.
    #[must_use]
    pub fn new(mesh: &TriangleMesh) -> Self {
        let plane = |f: usize| {
            let normal = mesh.face_cross(f);
            (normal, normal.dot(mesh.corners(f)[0]))
        };
        let topology = Topology::new(&mesh.faces, mesh.positions.len());
        let mut edges = Vec::with_capacity(topology.edges().len());
        for (edge, &ends) in topology.edges().iter().enumerate() {
            match topology.edge_uses(edge) {
                [one, two] => edges.push(Edge {
                    ends,
                    faces: [one.face, two.face],
                }),
                uses => edges.extend(uses.iter().map(|used| Edge {
                    ends,
                    faces: [used.face; 2],
                })),
            }
        }
        Self {
            planes: (0..mesh.faces.len()).map(plane).collect(),
            edges,
        }
    }

    /// Those where the mesh turns away from a camera.
    #[must_use]
    pub fn seen_by(&self, mesh: &TriangleMesh, camera: &Camera) -> RimEdges {
        let faces_eye = |f: u32| {
            let (normal, offset) = self.planes[f as usize];
            normal.dot(camera.eye) > offset
        };
        let (columns, rows) = [camera.width_px, camera.height_px]
            .map(|px| (f64::from(px) / CELL_PX).ceil().max(1.0) as usize)
            .into();
        let mut seen = RimEdges {
            segments: Vec::new(),
            columns,
            rows,
            first: vec![NONE; columns * rows],
            entries: Vec::new(),
        };
        for edge in &self.edges {
            let [one, two] = edge.faces;
            if one != two && faces_eye(one) == faces_eye(two) {
                continue;
            }
            let [a, b] = edge.ends.map(|v| {
                let p = mesh.positions[v as usize];
                camera.image_from_object(p).extend(1.0 / camera.depth(p))
            });
            if a.is_finite() && b.is_finite() {
                seen.add(a, b);
            }
        }
        seen
    }
}

/// Edges in a camera's picture.
#[derive(Debug)]
pub struct RimEdges {
    /// Both ends: place in pixels, and inverse depth.
    segments: Vec<[DVec3; 2]>,
    columns: usize,
    rows: usize,
    /// Per cell, its first entry.
    first: Vec<u32>,
    /// A segment, and the next entry of the same cell.
    entries: Vec<(u32, u32)>,
}

impl RimEdges {
    fn add(&mut self, a: DVec3, b: DVec3) {
        let number = self.segments.len() as u32;
        self.segments.push([a, b]);
        let (low, high) = (a.min(b), a.max(b));
        let cells = |low: f64, high: f64, count: usize| {
            let cell = |x: f64| (x / CELL_PX).floor().clamp(0.0, count as f64 - 1.0) as usize;
            cell(low)..=cell(high)
        };
        for y in cells(low.y, high.y, self.rows) {
            for x in cells(low.x, high.x, self.columns) {
                let at = y * self.columns + x;
                self.entries.push((number, self.first[at]));
                self.first[at] = self.entries.len() as u32 - 1;
            }
        }
    }

    /// The depth at the outermost edge across the outline at `p`, the object on the side of `inward`; `None` where no edge is near.
    #[must_use]
    pub(super) fn depth_at(&self, p: DVec2, inward: DVec2) -> Option<f64> {
        let along = inward.perp();
        for reach in REACH_PX {
            // How far inside, and the inverse depth there.
            let mut outermost: Option<(f64, f64)> = None;
            let mut visit = |[a, b]: [DVec3; 2]| {
                let (from, to) = (a.truncate() - p, b.truncate() - p);
                let (s, t) = (from.dot(along), to.dot(along));
                if (s > 0.0) == (t > 0.0) {
                    return;
                }
                let share = s / (s - t);
                let inside = (from + (to - from) * share).dot(inward);
                if inside.abs() <= reach && outermost.is_none_or(|(least, _)| inside < least) {
                    outermost = Some((inside, a.z + (b.z - a.z) * share));
                }
            };
            let ends = [p - inward * reach, p + inward * reach];
            let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            let cell = |x: f64, count: usize| {
                (x / CELL_PX).floor().clamp(0.0, count as f64 - 1.0) as usize
            };
            for y in cell(low.y, self.rows)..=cell(high.y, self.rows) {
                for x in cell(low.x, self.columns)..=cell(high.x, self.columns) {
                    let mut at = self.first[y * self.columns + x];
                    while at != NONE {
                        let (segment, next) = self.entries[at as usize];
                        visit(self.segments[segment as usize]);
                        at = next;
                    }
                }
            }
            if let Some((_, inverse)) = outermost {
                return (inverse > 0.0).then_some(1.0 / inverse);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{cpu, edge_depths, tangent_depths};
    use crate::simplify_contour::{SimplifyContourParams, simplify_contours};
    use silmap_geometry::bvh::Bvh;
    use silmap_geometry::trace::trace_contours;
    use silmap_geometry::{CoverageRule, Mask};
    use silmap_models as models;

    /// What rays find: the two ways share nothing but the mesh.
    #[test]
    fn edges_are_as_deep_as_rays_say() {
        for mesh in [
            models::trefoil_knot(20_000),
            models::three_holed_torus(20_000),
        ] {
            let bounds = mesh.bounds();
            let eye =
                bounds.center + DVec3::new(0.4, 0.3, 0.8).normalize_or_zero() * 3.0 * bounds.radius;
            let camera =
                Camera::fit_sphere(eye, bounds.center, bounds.radius, None, (256, 256)).unwrap();
            let mut mask = Mask::new(256, 256);
            cpu::rasterise(&mesh, &camera, CoverageRule::Center, &mut mask).unwrap();
            let params = SimplifyContourParams::default();
            let loops = simplify_contours(&trace_contours(&mask), &params);
            let by_rays = tangent_depths(&Bvh::new(&mesh), &bounds, &camera, &loops);
            let by_edges = edge_depths(&MeshEdges::new(&mesh).seen_by(&mesh, &camera), &loops);
            let rays = by_rays.iter().flatten();
            let mut off: Vec<f64> = (by_edges.iter().flatten().zip(rays))
                .filter_map(|(edge, ray)| Some((edge.as_ref()? - ray).abs() / bounds.radius))
                .collect();
            let found = off.len();
            assert!(
                found * 20 > by_rays.iter().flatten().count() * 19,
                "{found} found"
            );
            off.sort_by(f64::total_cmp);
            // At a jump in depth either may be met.
            let (middle, most) = (off[found / 2], off[found * 9 / 10]);
            assert!(middle < 0.01 && most < 0.05, "{middle} {most}");
            // Those of the next vertex but five are something else.
            let turned = by_rays.iter().flatten().cycle().skip(5);
            let mut control: Vec<f64> = (by_edges.iter().flatten().zip(turned))
                .filter_map(|(edge, ray)| Some((edge.as_ref()? - ray).abs() / bounds.radius))
                .collect();
            control.sort_by(f64::total_cmp);
            assert!(control[found / 2] > 4.0 * middle, "{}", control[found / 2]);
        }
    }
}
