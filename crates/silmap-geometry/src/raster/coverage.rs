//! Which pixels a mesh covers, on the processor.
//!
//! Vertices are projected in `f64`, rounded to a lattice of 1/4096 pixel, and everything after that is integer
//! arithmetic: neighbouring triangles share their rounded corners, so there are no cracks, and a mask is the same on
//! every machine.
//!
//! Faces that look away from the eye are left out. On a closed mesh the rounded faces still form a closed surface, over
//! every point of which as many faces look towards the eye as away from it, so the mask is the same with half the work.
//!
//! Source: J. Pineda. A Parallel Algorithm for Polygon Rasterization. SIGGRAPH 1988 (edge functions).

use glam::DVec2;
use thiserror::Error;

use super::rows::visit_rows;
use crate::{Camera, CoverageRule, Mask, TriangleMesh};

/// Lattice steps in a pixel, as a power of two. Rounding moves an outline by 0.0002 pixel at most; coordinates within
/// [`REACH_PX`] keep products of two differences in 62 bits.
const SUBPIXEL_BITS: u32 = 12;
/// Lattice steps in a pixel.
const PIXEL: i64 = 1 << SUBPIXEL_BITS;
/// Lattice steps from a pixel's border to its centre.
const HALF: i64 = PIXEL / 2;
/// Farthest from the image's origin, in pixels, that a vertex may fall.
const REACH_PX: f64 = 262_144.0;
/// For [`CoverageRule::Any`]: a triangle this many lattice steps from a pixel touches it, so that rounding a vertex
/// (by half a step) never loses a pixel.
const TOUCH: i64 = 1;
/// Triangles whose box holds centres in at most this many columns, and at most [`SMALL_CENTRES`], are tested centre by centre.
const NARROW_COLUMNS: i64 = 16;
const SMALL_CENTRES: i64 = 96;

/// Why a mesh cannot be drawn.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RasterError {
    /// Part of the mesh lies behind the eye or beside it, where no image reaches.
    #[error("vertex {vertex} lies behind the eye or too close to it: move the eye farther out")]
    BehindEye {
        /// The first such vertex of a face.
        vertex: u32,
    },
    /// Part of the mesh falls so far outside the image that the arithmetic would overflow.
    #[error(
        "vertex {vertex} falls more than {limit_px} pixels from the image: widen the field of view or move the eye out"
    )]
    OutOfReach {
        /// The first such vertex of a face.
        vertex: u32,
        /// How far is too far, pixels.
        limit_px: f64,
    },
    /// The mask handed in does not have the camera's size.
    #[error("the mask is {mask_width} × {mask_height} pixels and the camera {width} × {height}")]
    MaskSize {
        /// Columns of the mask.
        mask_width: u32,
        /// Rows of the mask.
        mask_height: u32,
        /// Columns of the camera.
        width: u32,
        /// Rows of the camera.
        height: u32,
    },
}

/// Sets the pixels of `mask` that the faces of `mesh` looking towards the camera cover; `mask` is overwritten.
///
/// With [`CoverageRule::Center`] a pixel is covered when its centre lies in a projected face or on its edge. With
/// [`CoverageRule::Any`] a pixel is covered when a face comes within about 1/4096 pixel of it: touching its border is
/// enough, and rounding loses nothing.
/// The mesh must be closed; of an open one, what is seen from behind is missing.
///
/// # Errors
/// When a face reaches behind the eye or too far outside the image, or the mask does not have the camera's size.
pub fn cover(
    mesh: &TriangleMesh,
    camera: &Camera,
    rule: CoverageRule,
    mask: &mut Mask,
) -> Result<(), RasterError> {
    if (mask.width(), mask.height()) != (camera.width_px, camera.height_px) {
        return Err(RasterError::MaskSize {
            mask_width: mask.width(),
            mask_height: mask.height(),
            width: camera.width_px,
            height: camera.height_px,
        });
    }
    mask.clear();
    let points = project(mesh, camera)?;
    let mut bands = Vec::new();
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| points[v as usize].map(i64::from));
        // Counter-clockwise seen from outside is clockwise, and negative, with y down.
        let area = (c[0] - a[0]) * (b[1] - a[1]) - (c[1] - a[1]) * (b[0] - a[0]);
        match rule {
            CoverageRule::Center if area > 0 => cover_centres([a, c, b], mask),
            // A face seen edge-on still touches pixels.
            CoverageRule::Any if area >= 0 => cover_touched([a, c, b], &mut bands, mask),
            _ => {}
        }
    }
    Ok(())
}

/// All vertices in lattice coordinates of the image.
fn project(mesh: &TriangleMesh, camera: &Camera) -> Result<Vec<[i32; 2]>, RasterError> {
    // Adding this leaves a number's nearest integer in the low bits of its mantissa.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let (focal, middle) = (camera.focal_px(), camera.principal_px());
    let per_right = camera.right * focal.x;
    let per_up = camera.up * -focal.y;
    let mut is_clean = true;
    let locate = |&position: &glam::DVec3| {
        let offset = position - camera.eye;
        let z = offset.dot(camera.forward);
        let x = middle.x + offset.dot(per_right) / z;
        let y = middle.y + offset.dot(per_up) / z;
        (x, y, z)
    };
    let is_sound =
        |(x, y, z): (f64, f64, f64)| z > 0.0 && x.abs() <= REACH_PX && y.abs() <= REACH_PX;
    let points = mesh
        .positions
        .iter()
        .map(|position| {
            let (x, y, z) = locate(position);
            is_clean &= is_sound((x, y, z));
            [x, y].map(|v| (v * PIXEL as f64 + ROUND).to_bits() as i32)
        })
        .collect();
    if !is_clean {
        // Vertices that no face uses do not matter.
        for &vertex in mesh.faces.iter().flatten() {
            let place = locate(&mesh.positions[vertex as usize]);
            if place.2.is_nan() || place.2 <= 0.0 {
                return Err(RasterError::BehindEye { vertex });
            }
            if !is_sound(place) {
                return Err(RasterError::OutOfReach {
                    vertex,
                    limit_px: REACH_PX,
                });
            }
        }
    }
    Ok(points)
}

/// Smallest and largest of three.
fn extent(values: [i64; 3]) -> (i64, i64) {
    let [a, b, c] = values;
    (a.min(b).min(c), a.max(b).max(c))
}

/// Covers the pixels whose centre lies in a triangle of positive area, edges included.
#[inline]
fn cover_centres(corners: [[i64; 2]; 3], mask: &mut Mask) {
    let (left, right) = extent(corners.map(|p| p[0]));
    let (top, bottom) = extent(corners.map(|p| p[1]));
    let first_column = ((left + HALF - 1) >> SUBPIXEL_BITS).max(0);
    let last_column = ((right - HALF) >> SUBPIXEL_BITS).min(i64::from(mask.width()) - 1);
    let first_row = ((top + HALF - 1) >> SUBPIXEL_BITS).max(0);
    let last_row = ((bottom - HALF) >> SUBPIXEL_BITS).min(i64::from(mask.height()) - 1);
    if first_column > last_column || first_row > last_row {
        return;
    }
    // Each edge function is non-negative on the inner side, and linear: one step per column and row.
    let (x, y) = (
        (first_column << SUBPIXEL_BITS) + HALF,
        (first_row << SUBPIXEL_BITS) + HALF,
    );
    let edge = |p: [i64; 2], q: [i64; 2]| {
        let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
        (
            dx * (y - p[1]) - dy * (x - p[0]),
            -dy << SUBPIXEL_BITS,
            dx << SUBPIXEL_BITS,
        )
    };
    let [a, b, c] = corners;
    let edges = [edge(a, b), edge(b, c), edge(c, a)];
    let (columns, rows) = (last_column - first_column + 1, last_row - first_row + 1);
    if columns > NARROW_COLUMNS || columns * rows > SMALL_CENTRES {
        let in_pixels = |p: [i64; 2]| DVec2::new(p[0] as f64, p[1] as f64) / PIXEL as f64;
        let (rows, columns) = (first_row..last_row + 1, first_column..last_column + 1);
        visit_rows(corners.map(in_pixels), rows, columns, |j, found| {
            let is_inside = |i: i64| {
                let (right, down) = (i - first_column, j - first_row);
                let value = |e: &(i64, i64, i64)| e.0 + right * e.1 + down * e.2;
                (value(&edges[0]) | value(&edges[1]) | value(&edges[2])) >= 0
            };
            // What is inside is in one piece.
            let (mut from, mut to) = (found.start, found.end);
            while from < to && !is_inside(from) {
                from += 1;
            }
            while from < to && !is_inside(to - 1) {
                to -= 1;
            }
            mask.set_span(j as u32, from, to);
        });
        return;
    }
    let mut row = edges.map(|e| e.0);
    for j in first_row..=last_row {
        let [mut e0, mut e1, mut e2] = row;
        let mut bits = 0_u64;
        for i in 0..columns {
            bits |= u64::from((e0 | e1 | e2) >= 0) << i;
            e0 += edges[0].1;
            e1 += edges[1].1;
            e2 += edges[2].1;
        }
        let (word, shift) = ((first_column / 64) as usize, first_column % 64);
        let words = mask.row_mut(j as u32);
        words[word] |= bits << shift;
        if shift > 64 - NARROW_COLUMNS && word + 1 < words.len() {
            words[word + 1] |= bits >> (64 - shift);
        }
        for (value, e) in row.iter_mut().zip(&edges) {
            *value += e.2;
        }
    }
}

/// Covers the pixels that a triangle touches.
///
/// In each row of pixels the triangle's part is convex, so the touched pixels are those between its leftmost and
/// rightmost points there; these lie on the triangle's edges, cut to the row.
#[inline]
fn cover_touched(corners: [[i64; 2]; 3], bands: &mut Vec<(i64, i64)>, mask: &mut Mask) {
    let (left, right) = extent(corners.map(|p| p[0]));
    let (top, bottom) = extent(corners.map(|p| p[1]));
    let rows = (touched_from(top), touched_to(bottom));
    let columns = (touched_from(left), touched_to(right));
    let first_row = rows.0.max(0);
    let last_row = rows.1.min(i64::from(mask.height()) - 1);
    if first_row > last_row {
        return;
    }
    if rows.0 == rows.1 || columns.0 == columns.1 {
        for j in first_row..=last_row {
            mask.set_span(j as u32, columns.0, columns.1 + 1);
        }
        return;
    }
    bands.clear();
    bands.resize((last_row - first_row + 1) as usize, (i64::MAX, i64::MIN));
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        let (p, q) = if p[1] <= q[1] { (p, q) } else { (q, p) };
        let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
        for j in touched_from(p[1]).max(first_row)..=touched_to(q[1]).min(last_row) {
            let enter = (j << SUBPIXEL_BITS) - TOUCH;
            let leave = ((j + 1) << SUBPIXEL_BITS) + TOUCH;
            let band = &mut bands[(j - first_row) as usize];
            let mut reach = |x: i64, remainder: i64| {
                band.0 = band.0.min(x);
                band.1 = band.1.max(x + i64::from(remainder != 0));
            };
            let mut cut = |y: i64| {
                let across = dx * (y - p[1]);
                reach(p[0] + across.div_euclid(dy), across.rem_euclid(dy));
            };
            if p[1] < enter {
                cut(enter);
            }
            if q[1] > leave {
                cut(leave);
            }
            if p[1] >= enter {
                reach(p[0], 0);
            }
            if q[1] <= leave {
                reach(q[0], 0);
            }
        }
    }
    for (j, &(from, to)) in (first_row..).zip(bands.iter()) {
        if from <= to {
            mask.set_span(j as u32, touched_from(from), touched_to(to) + 1);
        }
    }
}

/// First pixel (row or column) that a coordinate touches.
fn touched_from(v: i64) -> i64 {
    // The smallest j with (j + 1)·PIXEL + TOUCH ≥ v.
    (v - TOUCH - 1) >> SUBPIXEL_BITS
}

/// Last pixel (row or column) that a coordinate touches.
fn touched_to(v: i64) -> i64 {
    (v + TOUCH) >> SUBPIXEL_BITS
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use proptest::prelude::*;

    /// A camera under which the point (x, y, −1) falls on pixel coordinates (x, y).
    fn pixel_camera(width: u32, height: u32) -> Camera {
        let middle = DVec3::new(f64::from(width) / 2.0, f64::from(height) / 2.0, 0.0);
        let target = middle - DVec3::Z;
        Camera::with_half_tangent(
            middle,
            target,
            Some(DVec3::NEG_Y),
            middle.y,
            (width, height),
        )
        .unwrap()
    }

    fn covered(
        triangles: &[[(f64, f64); 3]],
        rule: CoverageRule,
        (width, height): (u32, u32),
    ) -> Mask {
        // Looking along −z with y down, right is −x: mirror x so that the picture is not.
        let mut mesh = TriangleMesh::default();
        for triangle in triangles {
            let first = mesh.positions.len() as u32;
            mesh.positions
                .extend(triangle.map(|(x, y)| DVec3::new(f64::from(width) - x, y, -1.0)));
            mesh.faces.push([first, first + 1, first + 2]);
            mesh.faces.push([first, first + 2, first + 1]);
        }
        let mut mask = Mask::new(width, height);
        cover(&mesh, &pixel_camera(width, height), rule, &mut mask).unwrap();
        mask
    }

    fn side(a: (f64, f64), b: (f64, f64), p: (f64, f64)) -> f64 {
        (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0)
    }

    fn holds(t: &[(f64, f64); 3], p: (f64, f64)) -> bool {
        let sides = [
            side(t[0], t[1], p),
            side(t[1], t[2], p),
            side(t[2], t[0], p),
        ];
        side(t[0], t[1], t[2]) != 0.0
            && (sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0))
    }

    /// Whether a closed triangle meets the closed square of a pixel, grown on all sides: clip it to the square.
    fn touches(t: &[(f64, f64); 3], (x, y): (f64, f64), grow: f64) -> bool {
        let mut polygon = t.to_vec();
        for (is_x, limit, sign) in [
            (true, x - grow, 1.0),
            (true, x + 1.0 + grow, -1.0),
            (false, y - grow, 1.0),
            (false, y + 1.0 + grow, -1.0),
        ] {
            let height = |p: &(f64, f64)| sign * (if is_x { p.0 } else { p.1 } - limit);
            let mut kept = Vec::new();
            for k in 0..polygon.len() {
                let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                let (ha, hb) = (height(&a), height(&b));
                if ha >= 0.0 {
                    kept.push(a);
                }
                if ha * hb < 0.0 {
                    let s = ha / (ha - hb);
                    kept.push((a.0 + (b.0 - a.0) * s, a.1 + (b.1 - a.1) * s));
                }
            }
            polygon = kept;
        }
        !polygon.is_empty()
    }

    /// Quarter pixels, also outside the image: vertices on centres, on borders, flat triangles.
    fn any_triangle() -> impl Strategy<Value = [(f64, f64); 3]> {
        let point = (-40_i32..400, -40_i32..120)
            .prop_map(|(x, y)| (f64::from(x) / 4.0, f64::from(y) / 4.0));
        let near =
            (-8_i32..8, -8_i32..8).prop_map(|(x, y)| (f64::from(x) / 4.0, f64::from(y) / 4.0));
        prop_oneof![
            [point.clone(), point.clone(), point.clone()],
            (point, near.clone(), near).prop_map(|(p, q, r)| [
                p,
                (p.0 + q.0, p.1 + q.1),
                (p.0 + r.0, p.1 + r.1)
            ]),
        ]
    }

    proptest! {
        #[test]
        fn both_rules_equal_their_definition(triangles in prop::collection::vec(any_triangle(), 1..6)) {
            let size = (90, 24);
            let centres = covered(&triangles, CoverageRule::Center, size);
            let touched = covered(&triangles, CoverageRule::Any, size);
            for j in 0..size.1 {
                for i in 0..size.0 {
                    let (x, y) = (f64::from(i), f64::from(j));
                    let centre = triangles.iter().any(|t| holds(t, (x + 0.5, y + 0.5)));
                    prop_assert_eq!(centres.get(i.into(), j.into()), centre, "centre of ({}, {})", i, j);
                    let touch = |grow| triangles.iter().any(|t| touches(t, (x, y), grow));
                    let is_touched = touched.get(i.into(), j.into());
                    prop_assert!(is_touched || !touch(0.0), "({}, {}) is lost", i, j);
                    prop_assert!(!is_touched || touch(3.0 / 4096.0), "({}, {}) is too much", i, j);
                }
            }
        }
    }

    #[test]
    fn a_fan_of_slivers_has_no_cracks() {
        // A disc cut into thousands of triangles that meet in one point: every centre inside must be found.
        let middle = (31.37, 30.91);
        let rim = |k: u32| {
            let angle = f64::from(k) / 5000.0 * std::f64::consts::TAU;
            (middle.0 + 25.0 * angle.cos(), middle.1 + 25.0 * angle.sin())
        };
        let fan: Vec<_> = (0..5000)
            .map(|k| [middle, rim(k), rim((k + 1) % 5000)])
            .collect();
        let mask = covered(&fan, CoverageRule::Center, (64, 64));
        for j in 0..64 {
            for i in 0..64 {
                let (x, y) = (f64::from(i) + 0.5 - middle.0, f64::from(j) + 0.5 - middle.1);
                if (x.hypot(y) - 25.0).abs() > 0.01 {
                    assert_eq!(
                        mask.get(i.into(), j.into()),
                        x.hypot(y) < 25.0,
                        "({i}, {j})"
                    );
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_an_error() {
        let camera = pixel_camera(16, 16);
        let mesh = |z: f64, x: f64| TriangleMesh {
            positions: vec![
                DVec3::new(1.0, 1.0, -1.0),
                DVec3::new(x, 1.0, z),
                DVec3::new(1.0, 9.0, -1.0),
                DVec3::new(f64::NAN, 0.0, 9.0),
            ],
            faces: vec![[0, 1, 2]],
            ..TriangleMesh::default()
        };
        let draw =
            |mesh: &TriangleMesh, mask: &mut Mask| cover(mesh, &camera, CoverageRule::Center, mask);
        let mut mask = Mask::new(16, 16);
        assert_eq!(draw(&mesh(-1.0, 5.0), &mut mask), Ok(()));
        assert_eq!(
            draw(&mesh(1.0, 5.0), &mut mask),
            Err(RasterError::BehindEye { vertex: 1 })
        );
        assert!(matches!(
            draw(&mesh(-1.0, 1e7), &mut mask),
            Err(RasterError::OutOfReach { vertex: 1, .. })
        ));
        let mut other = Mask::new(16, 17);
        assert!(matches!(
            draw(&mesh(-1.0, 5.0), &mut other),
            Err(RasterError::MaskSize { .. })
        ));
    }
}
