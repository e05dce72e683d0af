//! Inner hulls lie inside their models, folds included: by a check that shares nothing with the library's own. It looks at every
//! triangle of the model for every point, takes the sum of solid angles for the winding number, and crosses triangles in its own way.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;
use silmap_geometry::Watch;
use silmap_geometry::{ClosedMesh, TriangleMesh};
use silmap_hull::{self as hull, HullParams, Tightening, VerifyParams, verify_inner};
use silmap_mesh_io::{self as mesh_io, LoadOptions};
use silmap_models as models;
use silmap_tests::outside;

/// How far outside counts, in radii of the model.
const TOLERANCE_REL: f64 = 1e-6;
/// Points along each side of a hull's triangle.
const PER_SIDE: usize = 4;

/// Models with ears, fingers and horns, the faces of their hulls, and the least share of the model's volume in them.
const QUICK: [(&str, u32, f64); 2] = [
    ("decimated-knight.off", 120, 0.5),
    ("spot/spot_triangulated.obj", 150, 0.75),
];
const SLOW: [(&str, u32, f64); 6] = [
    ("fertility.off", 300, 0.6),
    ("cheburashka.off", 200, 0.7),
    ("elephant.off", 300, 0.65),
    ("armadillo.obj", 300, 0.55),
    ("stanford-bunny-closed.off", 200, 0.75),
    ("feline/feline.obj", 400, 0.4),
];

/// How often a closed mesh winds around a point that is not on it.
///
/// Source: A. van Oosterom, J. Strackee. The Solid Angle of a Plane Triangle. IEEE Transactions on Biomedical Engineering, 1983.
fn winding(mesh: &TriangleMesh, p: DVec3) -> i32 {
    let halves: f64 = (0..mesh.faces.len())
        .map(|f| {
            let [a, b, c] = mesh.corners(f).map(|corner| corner - p);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            a.dot(b.cross(c)).atan2(below)
        })
        .sum();
    (halves / TAU).round() as i32
}

fn distance_to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let t = ((p - a).dot(b - a) / a.distance_squared(b)).clamp(0.0, 1.0);
    p.distance(a + (b - a) * t)
}

fn distance(mesh: &TriangleMesh, p: DVec3) -> f64 {
    (0..mesh.faces.len())
        .map(|f| {
            let [a, b, c] = mesh.corners(f);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let is_above = [(a, b), (b, c), (c, a)]
                .iter()
                .all(|&(s, t)| normal.cross(t - s).dot(p - s) >= 0.0);
            if is_above {
                return normal.dot(p - a).abs();
            }
            distance_to_segment(p, a, b)
                .min(distance_to_segment(p, b, c))
                .min(distance_to_segment(p, c, a))
        })
        .fold(f64::INFINITY, f64::min)
}

/// How far a point is outside the model; zero inside.
fn outside(model: &TriangleMesh, p: DVec3) -> f64 {
    if winding(model, p) > 0 {
        return 0.0;
    }
    // On the surface within the tolerance; the sum of angles needs some distance, too.
    let away = distance(model, p);
    if away <= TOLERANCE_REL * model.bounds().radius {
        0.0
    } else {
        away
    }
}

/// Where the sides of one triangle go through the other.
fn piercings(one: [DVec3; 3], two: [DVec3; 3]) -> Vec<DVec3> {
    let mut found = Vec::new();
    for (from, to) in [(one, two), (two, one)] {
        let [a, b, c] = to;
        let normal = (b - a).cross(c - a);
        for k in 0..3 {
            let (p, q) = (from[k], from[(k + 1) % 3]);
            let (s, t) = (normal.dot(p - a), normal.dot(q - a));
            if (s > 0.0) == (t > 0.0) {
                continue;
            }
            let x = p + (q - p) * (s / (s - t));
            let is_in = [(a, b), (b, c), (c, a)]
                .iter()
                .all(|&(s, t)| normal.dot((t - s).cross(x - s)) >= 0.0);
            if is_in {
                found.push(x);
            }
        }
    }
    found
}

/// The farthest that any looked-at point of the hull is outside: its vertices, a grid on each face, and points on both sides of
/// each place where a face goes through one of the model's.
fn farthest_outside(hull: &TriangleMesh, model: &TriangleMesh) -> f64 {
    let radius = model.bounds().radius;
    (0..hull.faces.len())
        .into_par_iter()
        .map(|f| {
            let face = hull.corners(f);
            let [a, b, c] = face;
            let mut points = Vec::new();
            for i in 0..=PER_SIDE {
                for j in 0..=(PER_SIDE - i) {
                    let w = [i, j, PER_SIDE - i - j].map(|n| n as f64 / PER_SIDE as f64);
                    points.push(a * w[0] + b * w[1] + c * w[2]);
                }
            }
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            for g in 0..model.faces.len() {
                let other = model.corners(g);
                let [p, q, r] = other;
                let is_far = p.min(q).min(r).cmpgt(high).any() || p.max(q).max(r).cmplt(low).any();
                if is_far {
                    continue;
                }
                let Some((first, rest)) = piercings(face, other)
                    .split_first()
                    .map(|(x, rest)| (*x, rest.to_vec()))
                else {
                    continue;
                };
                let last = rest.into_iter().fold(first, |far, x| {
                    if x.distance(first) > far.distance(first) {
                        x
                    } else {
                        far
                    }
                });
                let across = normal.cross(last - first).normalize_or_zero();
                for step in [3e-6, 1e-4, 1e-3, 1e-2] {
                    for x in [
                        first.midpoint(last) + across * (step * radius),
                        first.midpoint(last) - across * (step * radius),
                    ] {
                        let is_on = [(a, b), (b, c), (c, a)]
                            .iter()
                            .all(|&(s, t)| normal.dot((t - s).cross(x - s)) >= 0.0);
                        if is_on {
                            points.push(x);
                        }
                    }
                }
            }
            points
                .into_iter()
                .map(|p| outside(model, p))
                .fold(0.0, f64::max)
        })
        .reduce(|| 0.0, f64::max)
}

fn inner_hull(mesh: &ClosedMesh, faces: u32) -> hull::ProgressiveHull {
    let params = HullParams {
        target_faces: faces,
        inner: true,
        ..HullParams::default()
    };
    hull::build(mesh, &params, &Watch::silent()).unwrap()
}

fn check_models(list: &[(&str, u32, f64)]) {
    for &(name, faces, least_ratio) in list {
        let Some(path) = outside::shared(&format!("models/{name}")) else {
            continue;
        };
        let mesh = mesh_io::load(&path, &LoadOptions::default()).unwrap().mesh;
        let sequence = inner_hull(&mesh, faces);
        assert_eq!(sequence.least_faces(), faces as usize, "{name}");
        for how in [Tightening::Off, Tightening::Fast] {
            let level = (sequence.tightened_level(faces as usize, how, &Watch::silent())).unwrap();
            let report = verify_inner(&level.mesh, mesh.mesh(), &VerifyParams::default());
            let found = farthest_outside(&level.mesh, mesh.mesh());
            eprintln!(
                "{name} {how:?}: {:.4}, outside by {found:e}; {report:?}",
                level.volume_ratio
            );
            assert_eq!(found, 0.0, "{name}, {how:?}: {report:?}");
            assert!(report.encloses, "{name}, {how:?}: {report:?}");
            assert!(
                level.volume_ratio > least_ratio,
                "{name}, {how:?}: {}",
                level.volume_ratio
            );
        }
    }
}

#[test]
fn nothing_of_an_inner_hull_is_outside_a_small_model() {
    check_models(&QUICK);
}

#[test]
#[ignore = "takes minutes: a part of tools/test --full"]
fn nothing_of_an_inner_hull_is_outside_a_large_model() {
    check_models(&SLOW);
}

#[test]
fn nothing_of_an_inner_hull_is_outside_a_generated_model() {
    for (name, mesh, faces) in [
        ("knot", models::trefoil_knot(2000), 150),
        ("three holes", models::three_holed_torus(2000), 150),
        // As far down as it goes: its tips then fold outside unless each collapse is held against the model.
        ("organic", models::organic(2500), 30),
    ] {
        let mesh = ClosedMesh::try_from(mesh).unwrap();
        let sequence = inner_hull(&mesh, faces);
        let level = sequence.level(sequence.least_faces());
        assert_eq!(farthest_outside(&level.mesh, mesh.mesh()), 0.0, "{name}");
        let report = verify_inner(&level.mesh, mesh.mesh(), &VerifyParams::default());
        assert!(report.encloses, "{name}: {report:?}");
        assert!(
            level.mesh.faces.len() < 200 && level.volume_ratio > 0.3,
            "{name}"
        );
    }
}

/// Parts joined to one mesh.
fn joined(first: &TriangleMesh, second: &TriangleMesh) -> TriangleMesh {
    let mut all = first.clone();
    all.appearance = silmap_geometry::Appearance::default();
    let shift = all.positions.len() as u32;
    all.positions.extend(&second.positions);
    all.faces
        .extend(second.faces.iter().map(|f| f.map(|v| v + shift)));
    all
}

#[test]
fn both_checks_see_what_is_outside() {
    let model = models::trefoil_knot(2000);
    let mesh = ClosedMesh::try_from(model.clone()).unwrap();
    let good = inner_hull(&mesh, 200).level(200).mesh;
    let (bounds, normals) = (model.bounds(), good.vertex_normals());
    let is_verified =
        |hull: &TriangleMesh| verify_inner(hull, &model, &VerifyParams::default()).encloses;
    assert!(is_verified(&good) && farthest_outside(&good, &model) == 0.0);
    let mut bulging = good.clone();
    bulging.positions[17] += normals[17] * (0.1 * bounds.radius);
    // A fold outside: a body of its own, inside out, so that the hull winds around no point more often than before.
    let small = TriangleMesh {
        positions: [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]
            .map(|p| bounds.max + p * (0.01 * bounds.radius))
            .to_vec(),
        faces: vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    };
    assert!(small.volume() < 0.0);
    let folded = joined(&good, &small);
    // The same as a part of a face: a needle that sticks out through the surface and is folded over.
    let mut needled = good.clone();
    let [a, b, c] = good.corners(5);
    let middle = (a + b + c) / 3.0;
    let tip = middle + good.face_cross(5).normalize_or_zero() * (0.2 * bounds.radius);
    let first = needled.positions.len() as u32;
    needled
        .positions
        .extend([tip, middle + (a - middle) * 0.01]);
    let [i, j, k] = needled.faces[5];
    needled.faces[5] = [i, j, first + 1];
    needled.faces.extend([
        [j, k, first + 1],
        [k, first, first + 1],
        [k, i, first],
        [first, i, first + 1],
    ]);
    for (name, bad) in [
        ("bulging", bulging),
        ("folded", folded),
        ("needled", needled),
    ] {
        assert!(!is_verified(&bad), "{name}");
        assert!(
            farthest_outside(&bad, &model) > 1e-3 * bounds.radius,
            "{name}"
        );
    }
}
