//! A hierarchy whose nodes are bounded by a constant number of half-spaces: Johannsen and Carter's clustered backface
//! culling, modified to extract silhouettes.
//!
//! In a frame whose z axis is a cluster's mean normal, each plane is a height over x and y with a slope in each. The
//! extremes of offsets and slopes bound all of them, by four half-spaces for the region in front and four for the region
//! behind: one for each pair of extreme slopes.
//!
//! Source: A. Johannsen, M. B. Carter. Clustered Backface Culling. Journal of Graphics Tools 3(1), 1998; modified as for the
//! comparison in Sander et al., Silhouette Clipping, SIGGRAPH 2000, section 7.
//! Deviations: the first source leaves the hierarchy open; here clusters are halved along whichever of the coordinates of
//! edge normals and edge middles varies most. The source bounds the back region only; the front region is the mirror image.

use glam::{DVec3, Vec3};

use crate::cluster_forest::{AT_ONCE, ClusterForest, Clusters, FacingBound, direction_key};
use crate::edge_mesh::EdgeMesh;
use crate::viewpoint::Query;

/// Edges of a cluster that is not divided.
const LEAF_EDGES: usize = 8;
/// How much a difference in place counts beside one in direction: radii of the mesh against unit normals.
const PLACE_WEIGHT: f64 = 0.25;
/// A bound on what single precision loses, for slopes and offsets about 1; larger ones lose in proportion.
const ROOM: f64 = 16.0 * f32::EPSILON as f64;
/// Planes steeper than this against their cluster's frame make a bound that is of no use.
const STEEPEST: f64 = 1e3;

/// The half-spaces of a cluster, in the unit ball.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacingRegions {
    middle: Vec3,
    axes: [Vec3; 3],
    /// The extreme slopes along x and along y.
    slopes: [[f32; 2]; 2],
    /// The extreme heights over the middle.
    heights: [f32; 2],
    /// Values below this are not to be trusted; infinity where there are no regions.
    room: f32,
}

/// Of each edge: its middle and the sum of its faces' normals, each coordinate a direction to halve clusters along.
type Traits = [f64; 6];

/// The hierarchy of a mesh.
pub(crate) fn region_hierarchy(mesh: &EdgeMesh) -> ClusterForest<FacingRegions> {
    let planes: Vec<Option<[f64; 4]>> = (0..mesh.faces().len())
        .map(|f| mesh.exact_plane(f))
        .collect();
    let normal = |f: u32| planes[f as usize].map(|[x, y, z, _]| DVec3::new(x, y, z));
    let mut bounded = Vec::new();
    let mut unbounded = Vec::new();
    let mut traits: Vec<Traits> = Vec::with_capacity(mesh.edges().len());
    for (edge, (ends, faces)) in (0..).zip(mesh.edges().iter().zip(mesh.edge_faces())) {
        let middle = mesh
            .ball_position(ends.from)
            .midpoint(mesh.ball_position(ends.to));
        let [left, right] = faces.map(normal);
        match left.zip(right) {
            Some(_) => bounded.push(edge),
            None => unbounded.push(edge),
        }
        let place = (middle * PLACE_WEIGHT).to_array();
        let [x, y, z] = left
            .zip(right)
            .map_or(DVec3::ZERO, |(l, r)| l + r)
            .to_array();
        traits.push([x, y, z, place[0], place[1], place[2]]);
    }
    let mut clusters = Clusters {
        nodes: Vec::new(),
        directions: Vec::new(),
        edges: Vec::with_capacity(bounded.len()),
        unbounded,
    };
    if !bounded.is_empty() {
        push_cluster(&mut clusters, mesh, (&planes, &traits), &mut bounded);
    }
    ClusterForest::new(mesh, &clusters)
}

fn push_cluster(
    clusters: &mut Clusters<FacingRegions>,
    mesh: &EdgeMesh,
    (planes, traits): (&[Option<[f64; 4]>], &[Traits]),
    edges: &mut [u32],
) {
    let bound = FacingRegions::of(mesh, planes, edges);
    clusters
        .directions
        .push(direction_key(bound.axes[2].as_dvec3()));
    if edges.len() <= LEAF_EDGES {
        clusters.edges.extend_from_slice(edges);
        clusters.nodes.push((bound, 0, clusters.edges.len() as u32));
        return;
    }
    clusters.nodes.push((bound, 2, clusters.edges.len() as u32));
    let spread = |k: usize| {
        let (low, high) = edges
            .iter()
            .map(|&e| traits[e as usize][k])
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        high - low
    };
    let widest = (0..6)
        .max_by(|&a, &b| spread(a).total_cmp(&spread(b)))
        .unwrap_or(0);
    let half = edges.len() / 2;
    edges.select_nth_unstable_by(half, |&a, &b| {
        traits[a as usize][widest]
            .total_cmp(&traits[b as usize][widest])
            .then(a.cmp(&b))
    });
    let (first, second) = edges.split_at_mut(half);
    push_cluster(clusters, mesh, (planes, traits), first);
    push_cluster(clusters, mesh, (planes, traits), second);
}

impl FacingRegions {
    fn of(mesh: &EdgeMesh, planes: &[Option<[f64; 4]>], edges: &[u32]) -> Self {
        let known = || {
            let faces = edges.iter().flat_map(|&e| mesh.edge_faces()[e as usize]);
            faces.filter_map(|f| planes[f as usize])
        };
        let sum: DVec3 = known().map(|[x, y, z, _]| DVec3::new(x, y, z)).sum();
        let Some(z_axis) = sum.try_normalize() else {
            return Self::none();
        };
        let (x_axis, y_axis) = z_axis.any_orthonormal_pair();
        let middles = edges.iter().map(|&e| {
            let ends = mesh.edges()[e as usize];
            mesh.ball_position(ends.from)
                .midpoint(mesh.ball_position(ends.to))
        });
        // As the search has it.
        let middle = (middles.sum::<DVec3>() / edges.len() as f64).as_vec3();
        let empty = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut slopes, mut heights) = ([empty; 2], empty);
        let widen = |range: &mut [f64; 2], value: f64| {
            *range = [range[0].min(value), range[1].max(value)];
        };
        for [x, y, z, w] in known() {
            let normal = DVec3::new(x, y, z);
            let up = normal.dot(z_axis);
            if up * STEEPEST < 1.0 {
                return Self::none();
            }
            widen(&mut slopes[0], normal.dot(x_axis) / up);
            widen(&mut slopes[1], normal.dot(y_axis) / up);
            widen(&mut heights, (w + normal.dot(middle.as_dvec3())) / up);
        }
        let steepest = slopes
            .as_flattened()
            .iter()
            .fold(1.0, |a: f64, s| a.max(s.abs()));
        let highest = heights[0].abs().max(heights[1].abs());
        Self {
            middle,
            axes: [x_axis, y_axis, z_axis].map(|a| a.as_vec3()),
            slopes: slopes.map(|range| range.map(|s| s as f32)),
            heights: heights.map(|h| h as f32),
            room: (ROOM * (steepest + highest)) as f32,
        }
    }

    fn none() -> Self {
        Self {
            middle: Vec3::ZERO,
            axes: [Vec3::ZERO; 3],
            slopes: [[0.0; 2]; 2],
            heights: [0.0; 2],
            room: f32::INFINITY,
        }
    }
}

impl FacingRegions {
    #[inline(always)]
    fn is_culled(&self, query: &Query) -> bool {
        let from_middle = query.point - self.middle * query.weight;
        let [x, y, z] = self.axes.map(|axis| axis.dot(from_middle));
        let [[x_low, x_high], [y_low, y_high]] = self.slopes;
        let (ax, bx, ay, by) = (x_low * x, x_high * x, y_low * y, y_high * y);
        let lowest = z + ax.min(bx) + ay.min(by) + self.heights[0] * query.weight;
        let highest = z + ax.max(bx) + ay.max(by) + self.heights[1] * query.weight;
        (lowest > self.room) | (highest < -self.room)
    }
}

impl FacingBound for FacingRegions {
    #[inline(always)]
    fn culled(bounds: [&Self; AT_ONCE], query: &Query) -> u8 {
        let [a, b, c, d] = bounds.map(|bound| u8::from(bound.is_culled(query)));
        a | b << 1 | c << 2 | d << 3
    }
}
