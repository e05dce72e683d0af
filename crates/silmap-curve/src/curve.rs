//! An outline as a curve in space, and as the texels that shaders read.
//!
//! Texels of an outline, four 32-bit integers each:
//!
//! | texels | content |
//! |---|---|
//! | 1 | points, bands, cells a side, 0 |
//! | 1 | where bands, edges and cells begin, counted from this outline's first texel; 0 |
//! | 1 | right of the picture that it was sorted in (three floats), 0 |
//! | one a point | place relative to the hull's origin (three floats); its triangle, as [`packed_triangle`] has it, or [`NO_EDGE`] |
//! | bands + 1, eight a texel | where a band's edges begin |
//! | eight a texel | edges, by the number of their first point |
//! | 64 a texel | cells, two bits each |
//!
//! Each loop ends with its first point again.
//!
//! Source: Gu et al., Silhouette Mapping, TR-1-99, sections 5 and 8.1: outlines are loops, loops are triangles.

use glam::{DVec2, DVec3, DVec4, Vec4Swizzles};
use silmap_geometry::Camera;
use silmap_map::{Loops, SeenLoops};

use crate::bands::{BandParams, Bands};
use crate::thin::Thinning;
use crate::winding_triangles::{NO_EDGE, packed_triangle};

/// Four integers of an outline.
pub type Texel = [u32; 4];

/// Texels before the points.
const HEADER: usize = 3;

/// Room about the bounding sphere in the picture that an outline is sorted in.
pub const ROOM: f64 = 1.02;

/// The picture of an eye that an outline is sorted in: the bounding sphere fills the square from −1 to 1, nearly. `outline_rows` of
/// `shaders/outline.wgsl` makes the same for other eyes.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Unit direction to the right of the picture.
    pub right: DVec3,
    forward: DVec3,
    center: DVec3,
    radius: f64,
    rows: [DVec4; 3],
}

/// How an outline is thinned out and sorted. Lengths are in the picture, in which the sphere has a radius of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sorting {
    /// Bands and cells.
    pub bands: BandParams,
    /// How far points may be from an outline that has fewer.
    pub tolerance: f64,
    /// Sine of the angle by which eyes turn that it serves.
    pub turn: f64,
}

impl Frame {
    /// For an eye (with a 1 appended, or a direction with a 0) outside of a sphere.
    #[must_use]
    pub fn new(eye: DVec4, center: DVec3, radius: f64) -> Self {
        let (forward, scale, last) = if eye.w == 0.0 {
            (-eye.xyz(), 1.0 / (ROOM * radius), DVec4::W)
        } else {
            let arm = center - eye.xyz();
            let distance = arm.length();
            let tangent = radius / (distance * distance - radius * radius).max(0.0).sqrt();
            let forward = arm / distance;
            let last = forward.extend(-forward.dot(eye.xyz()));
            (forward, 1.0 / (ROOM * tangent), last)
        };
        let right = forward.any_orthonormal_vector();
        let up = right.cross(forward);
        let row = |axis: DVec3| (axis * scale).extend(-axis.dot(center) * scale);
        Self {
            right,
            forward,
            center,
            radius,
            rows: [row(right), row(up), last],
        }
    }

    /// Where a point is seen, and by how much it moves there when the eye turns by an angle with this sine.
    fn deep(&self, point: DVec3, turn: f64) -> DVec3 {
        let depth = self.forward.dot(point - self.center) / self.radius;
        self.project(point).extend(depth * turn)
    }

    /// Where a point is seen.
    #[must_use]
    pub fn project(&self, point: DVec3) -> DVec2 {
        let [x, y, w] = self.rows.map(|row| row.dot(point.extend(1.0)));
        DVec2::new(x, y) / w
    }
}

/// The points of an outline that begins with these texels, relative to the hull's origin, and whether an edge begins at each.
pub fn points_of(texels: &[Texel]) -> impl Iterator<Item = (DVec3, bool)> + '_ {
    let points = texels[HEADER..].iter().take(texels[0][0] as usize);
    points.map(|&[x, y, z, triangle]| {
        let place = [x, y, z].map(|bits| f64::from(f32::from_bits(bits)));
        (DVec3::from(place), triangle != NO_EDGE)
    })
}

/// Builds outlines. Everything is kept between them.
#[derive(Clone, Debug, Default)]
pub struct CurveBuilder {
    /// In space; loops are not closed by their first point.
    loops: Loops<DVec3>,
    thinning: Thinning,
    /// Of a loop: where points are seen, and how deep.
    deep: Vec<DVec3>,
    points: Vec<DVec3>,
    triangles: Vec<u32>,
    is_edge: Vec<bool>,
    seen: Vec<DVec2>,
    bands: Bands,
}

impl CurveBuilder {
    /// Takes loops.
    pub fn assign<'a>(&mut self, loops: impl IntoIterator<Item = &'a [DVec3]>) {
        self.loops.assign(loops);
    }

    /// Takes an outline that a camera sees, which looks at the center of the sphere that holds the object.
    pub fn assign_seen(
        &mut self,
        seen: &SeenLoops,
        camera: &Camera,
        (center, radius): (DVec3, f64),
    ) {
        let middle = camera.depth(center);
        let (nearest, farthest) = (middle - radius, middle + radius);
        self.loops.clear();
        for points in seen.iter() {
            for p in points {
                let depth = if p.z > 0.0 {
                    (1.0 / p.z).clamp(nearest, farthest)
                } else {
                    middle
                };
                let point = camera.object_from_image(DVec2::new(p.x, p.y), depth);
                self.loops.push(point);
            }
            self.loops.close();
        }
    }

    /// Appends the texels of the outline to `texels`, its points relative to `origin`; returns the number of its points. `None`
    /// where it has more than can be numbered.
    pub fn encode(
        &mut self,
        frame: &Frame,
        origin: DVec3,
        sorting: &Sorting,
        texels: &mut Vec<Texel>,
    ) -> Option<u32> {
        self.close_loops(frame, sorting);
        let params = &sorting.bands;
        if !self.bands.sort(&self.seen, &self.is_edge, params) {
            return None;
        }
        let n_points = self.points.len();
        let bands_at = HEADER + n_points;
        let edges_at = bands_at + self.bands.starts.len().div_ceil(8);
        let cells_at = edges_at + self.bands.edges.len().div_ceil(8);
        texels.push([n_points, params.bands, params.cells, 0].map(|n| n as u32));
        texels.push([bands_at, edges_at, cells_at, 0].map(|n| n as u32));
        self.push_points(frame, origin, texels);
        push_halves(&self.bands.starts, texels);
        push_halves(&self.bands.edges, texels);
        for cells in self.bands.cells.chunks(64) {
            let mut texel = [0_u32; 4];
            for (k, &state) in cells.iter().enumerate() {
                texel[k / 16] |= u32::from(state) << (2 * (k % 16));
            }
            texels.push(texel);
        }
        Some(n_points as u32)
    }

    /// Appends the texels that windings need, without bands and cells, which may be too few for what the stencil can count; returns the
    /// number of points.
    pub fn encode_windings(
        &mut self,
        frame: &Frame,
        origin: DVec3,
        sorting: &Sorting,
        texels: &mut Vec<Texel>,
    ) -> u32 {
        self.close_loops(frame, sorting);
        let n_points = self.points.len() as u32;
        texels.push([n_points, 0, 0, 0]);
        texels.push([0; 4]);
        self.push_points(frame, origin, texels);
        n_points
    }

    /// Appends the frame's right and the points.
    fn push_points(&self, frame: &Frame, origin: DVec3, texels: &mut Vec<Texel>) {
        let bits = |v: DVec3| v.as_vec3().to_array().map(f32::to_bits);
        let [x, y, z] = bits(frame.right);
        texels.push([x, y, z, 0]);
        for (point, &triangle) in self.points.iter().zip(&self.triangles) {
            let [x, y, z] = bits(point - origin);
            texels.push([x, y, z, triangle]);
        }
    }

    /// Lays out points with their triangles.
    fn close_loops(&mut self, frame: &Frame, sorting: &Sorting) {
        self.points.clear();
        self.triangles.clear();
        self.is_edge.clear();
        self.seen.clear();
        for points in self.loops.iter() {
            let first = self.points.len() as u32;
            self.deep.clear();
            let deep = points.iter().map(|&p| frame.deep(p, sorting.turn));
            self.deep.extend(deep);
            let is_kept = self.thinning.keep(&self.deep, sorting.tolerance);
            let kept = points.iter().zip(is_kept).filter(|(_, is_kept)| **is_kept);
            self.points.extend(kept.map(|(&p, _)| p));
            if self.points.len() < first as usize + 3 {
                // It is as good as flat.
                self.points.truncate(first as usize);
                continue;
            }
            self.points.push(self.points[first as usize]);
            let seen = self.points[first as usize..].iter();
            self.seen.extend(seen.map(|&p| frame.project(p)));
            let count = self.points.len() as u32 - 1 - first;
            let triangles = (0..count).map(|k| packed_triangle(k, count));
            self.triangles.extend(triangles);
            self.triangles.push(NO_EDGE);
            self.is_edge.extend((0..count).map(|_| true));
            self.is_edge.push(false);
        }
    }
}

/// Appends numbers of 16 bits, eight a texel, the lower half first.
fn push_halves(numbers: &[u16], texels: &mut Vec<Texel>) {
    for eight in numbers.chunks(8) {
        let mut texel = [0_u32; 4];
        for (k, &number) in eight.iter().enumerate() {
            texel[k / 2] |= u32::from(number) << (16 * (k % 2));
        }
        texels.push(texel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A triangle and a square, in space.
    fn two_loops() -> Vec<Vec<DVec3>> {
        vec![
            [(0.0, 0.0, 0.1), (0.5, 0.0, 0.0), (0.0, 0.5, -0.2)]
                .map(DVec3::from)
                .to_vec(),
            [
                (-0.6, -0.6, 0.0),
                (-0.2, -0.6, 0.3),
                (-0.2, -0.2, 0.0),
                (-0.6, -0.2, 0.1),
            ]
            .map(DVec3::from)
            .to_vec(),
        ]
    }

    #[test]
    fn texels_hold_what_the_table_says() {
        let mut builder = CurveBuilder::default();
        let loops = two_loops();
        builder.assign(loops.iter().map(Vec::as_slice));
        let frame = Frame::new(DVec4::new(0.0, 0.0, 5.0, 1.0), DVec3::ZERO, 1.0);
        let params = Sorting {
            bands: BandParams {
                bands: 9,
                cells: 10,
                margin: 0.01,
            },
            tolerance: 0.0,
            turn: 0.1,
        };
        let origin = DVec3::new(0.25, 0.0, 0.0);
        let mut texels = vec![[7; 4]];
        assert_eq!(
            builder.encode(&frame, origin, &params, &mut texels),
            Some(9)
        );
        let texels = &texels[1..];
        assert_eq!(texels[0], [9, 9, 10, 0]);
        let [bands, edges, cells, _] = texels[1].map(|n| n as usize);
        assert_eq!((bands, edges), (12, 14));
        assert_eq!(texels.len(), cells + 2);
        let point = |k: usize| {
            let [x, y, z, triangle] = texels[3 + k];
            let place = [x, y, z].map(|b| f64::from(f32::from_bits(b)));
            (DVec3::from(place) + origin, triangle)
        };
        let starts: Vec<u32> = (0..10)
            .map(|k| texels[bands + k / 8][k % 8 / 2] >> (16 * (k % 2)) & 0xffff)
            .collect();
        assert!(starts.is_sorted() && starts[0] == 0);
        for (first, points) in [(0, &loops[0]), (4, &loops[1])] {
            let n = points.len();
            for k in 0..=n {
                let (place, triangle) = point(first + k);
                assert!(place.distance(points[k % n]) < 1e-6);
                let wanted = if k == n {
                    NO_EDGE
                } else {
                    packed_triangle(k as u32, n as u32)
                };
                assert_eq!(triangle, wanted);
            }
        }
    }

    proptest! {
        /// The sphere fills the square of the frame, nearly, for eyes near and far and infinitely far.
        #[test]
        fn the_sphere_fills_the_frame(
            eye in (-1.0..1.0_f64, -1.0..1.0_f64, 0.1..1.0_f64), distance in 1.1..1e4_f64, turn in 0.0..6.2_f64, is_far: bool,
        ) {
            let center = DVec3::new(0.3, -2.0, 1.0);
            let direction = DVec3::from(eye).normalize_or_zero();
            let eye = if is_far { direction.extend(0.0) } else { (center + direction * distance).extend(1.0) };
            let frame = Frame::new(eye, center, 1.0);
            let sine = if is_far { 0.0 } else { 1.0 / distance };
            let across = direction.any_orthonormal_vector();
            let around = across * turn.cos() + direction.cross(across) * turn.sin();
            let rim = center + direction * sine + around * (1.0 - sine * sine).sqrt();
            let seen = frame.project(rim).length();
            prop_assert!((seen * ROOM - 1.0).abs() < 1e-6, "{seen}");
            prop_assert!(frame.project(center).length() < 1e-6);
        }
    }
}
