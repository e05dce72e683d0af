//! Seams that miss by rounding, sheets that are apart, and bodies given twice.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::raw::PolygonLook;

/// A surface over a grid of parameters, as three.js makes its solids: every seam is written twice, and walked to by 2π.
fn grid(
    columns: usize,
    rows: usize,
    place: impl Fn(f64, f64) -> [f64; 3],
) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    for j in 0..=rows {
        for i in 0..=columns {
            let (u, v) = (i as f64 / columns as f64, j as f64 / rows as f64);
            positions.push(DVec3::from(place(u, v)));
        }
    }
    let mut faces = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let at = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.extend([[a, b, d], [b, c, d]]);
        }
    }
    (positions, faces)
}

fn sphere(columns: usize, rows: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    grid(columns, rows, |u, v| {
        let (phi, theta) = (u * TAU, v * PI);
        [
            -phi.cos() * theta.sin(),
            theta.cos(),
            phi.sin() * theta.sin(),
        ]
    })
}

fn torus(columns: usize, rows: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    grid(columns, rows, |u, v| {
        let (u, v) = (u * TAU, v * TAU);
        let r = 1.0 + 0.4 * v.cos();
        [r * u.cos(), r * u.sin(), 0.4 * v.sin()]
    })
}

/// The mantle of a cone from its tip and a disc below, whose rims are walked separately.
fn cone(columns: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (mut positions, mut faces) = grid(columns, 1, |u, v| {
        [v * (u * TAU).sin(), 1.0 - v, v * (u * TAU).cos()]
    });
    let first = positions.len() as u32;
    positions.push(DVec3::ZERO);
    for i in 0..=columns as u32 {
        let angle = f64::from(i) / columns as f64 * TAU;
        positions.push(DVec3::new(angle.sin(), 0.0, angle.cos()));
    }
    faces.extend((1..=columns as u32).map(|i| [first, first + i, first + i + 1]));
    (positions, faces)
}

fn as_raw((positions, faces): &(Vec<DVec3>, Vec<[u32; 3]>)) -> RawMesh {
    let mut raw = RawMesh::counting_from(0);
    raw.mesh.positions = positions.clone();
    for face in faces {
        raw.push_polygon(face, PolygonLook::default());
    }
    raw.finish()
}

fn joined_only(warnings: &[MeshWarning]) -> bool {
    warnings
        .iter()
        .any(|w| w.to_string().contains("of open edges joined"))
}

#[test]
fn solids_that_are_walked_around_by_two_pi_are_closed() {
    let cone_volume = |n: usize| 0.5 * n as f64 * (TAU / n as f64).sin() / 3.0;
    for (name, shape, volume) in [
        ("sphere", sphere(32, 16), 4.0 / 3.0 * PI),
        ("torus", torus(48, 24), 2.0 * PI * PI * 0.16),
        ("cone", cone(64), cone_volume(64)),
    ] {
        let (mesh, warnings) = close(as_raw(&shape), &LoadOptions::default()).unwrap();
        let share = mesh.mesh().volume() / volume;
        assert!(share > 0.95 && share < 1.0 + 1e-9, "{name}: {share}");
        assert!(joined_only(&warnings), "{name}: {warnings:?}");
        // As its exporters write it: text with six decimals, and single precision.
        let text: String = shape
            .0
            .iter()
            .map(|p| format!("v {:.6} {:.6} {:.6}\n", p.x, p.y, p.z))
            .collect();
        let text = shape.1.iter().fold(text, |t, f| {
            t + &format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1)
        });
        assert!(
            close(
                read(text.as_bytes(), "obj").unwrap(),
                &LoadOptions::default()
            )
            .is_ok(),
            "{name}"
        );
        let single = shape.0.iter().map(|p| p.as_vec3().as_dvec3()).collect();
        assert!(
            close(as_raw(&(single, shape.1.clone())), &LoadOptions::default()).is_ok(),
            "{name}"
        );
    }
}

/// A box without its front and back, and a lid for each, `gap` off.
fn lids(gap: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    for v in 0..8 {
        positions.push(DVec3::from(
            [4, 2, 1].map(|bit| f64::from(u8::from(v & bit != 0))),
        ));
    }
    for v in 0..8 {
        let outside = if v & 1 == 0 { -gap } else { gap };
        let place = positions[v] + DVec3::Z * outside;
        positions.push(place);
    }
    let quads = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [8, 10, 14, 12],
        [9, 13, 15, 11],
    ];
    let faces = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    (positions, faces)
}

#[test]
fn open_edges_join_within_the_distance_and_no_further() {
    let weld = |distance| LoadOptions {
        weld: Some(distance),
        ..LoadOptions::default()
    };
    let (mesh, warnings) = close(as_raw(&lids(0.01)), &weld(0.011)).unwrap();
    assert_eq!(
        (mesh.mesh().positions.len(), mesh.mesh().faces.len()),
        (8, 12)
    );
    assert!(joined_only(&warnings));
    for options in [LoadOptions::default(), weld(0.005)] {
        let fault = close(as_raw(&lids(0.01)), &options)
            .unwrap_err()
            .to_string();
        assert!(fault.contains("boundary edges"), "{fault}");
    }
    // Lids without the box between them are sheets a thickness apart, both open: nothing of them is within reach.
    let (positions, faces) = lids(0.0);
    let lids_only = (positions, faces[8..].to_vec());
    for options in [LoadOptions::default(), weld(0.3)] {
        assert!(close(as_raw(&lids_only), &options).is_err());
    }
    // What is closed stays as it is, however close its vertices are.
    let (mut positions, faces) = lids(0.0);
    for p in &mut positions {
        p.z *= 1e-3;
    }
    let plate = (positions, faces);
    let (mesh, warnings) = close(as_raw(&plate), &weld(0.5)).unwrap();
    assert_eq!(mesh.mesh().positions.len(), 8);
    assert!(!joined_only(&warnings));
}

#[test]
fn what_a_few_last_places_are_depends_on_the_numbers() {
    let distance = |digits: u8, places: &[f64]| {
        let mut raw = RawMesh::counting_from(0);
        raw.mesh.positions = places.iter().map(|&x| DVec3::splat(x)).collect();
        raw.digits = digits;
        super::super::seams::rounding_distance(&raw)
    };
    // Doubles, singles, and numbers of seven and of few digits.
    assert_eq!(distance(17, &[0.1, 1.0]), 8.0 * f64::EPSILON);
    assert_eq!(distance(0, &[0.25, 1.0]), 8.0 * f64::from(f32::EPSILON));
    assert!((distance(7, &[0.1, 1.0]) - 4e-6).abs() < 1e-18);
    assert!((distance(2, &[0.1, 9.0]) - 4e-5).abs() < 1e-17);
    assert_eq!(distance(0, &[]), 0.0);
}

/// VTK writes the triangles of an STL file with all digits and those that it cuts polygons into with six.
#[test]
fn facets_of_six_digits_meet_those_of_seventeen() {
    let (positions, faces) = cone(32);
    let mantle = faces.len() - 32;
    let text = |lift: f64| {
        let facets: String = faces
            .iter()
            .enumerate()
            .map(|(i, face)| {
                let corners = face.map(|v| {
                    let p = 0.4 * positions[v as usize];
                    if i < mantle {
                        format!("vertex {} {} {}\n", p.x, p.y, p.z)
                    } else {
                        format!("vertex {:.6} {:.6} {:.6}\n", p.x, p.y + lift, p.z)
                    }
                });
                let corners = corners.concat();
                format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
            })
            .collect();
        format!("solid cone\n{facets}endsolid cone\n")
    };
    let closed = |lift: f64| {
        let raw = read(text(lift).as_bytes(), "stl").unwrap();
        close(raw, &LoadOptions::default())
    };
    let (mesh, warnings) = closed(0.0).unwrap();
    let volume = 0.064 * 16.0 * (TAU / 32.0).sin() / 3.0;
    assert!((mesh.mesh().volume() / volume - 1.0).abs() < 1e-5);
    assert!(joined_only(&warnings), "{warnings:?}");
    let fault = closed(8e-6).unwrap_err().to_string();
    assert!(fault.ends_with("(--weld 1e-5 may help)"), "{fault}");
    let fault = closed(1e-2).unwrap_err().to_string();
    assert!(fault.ends_with("(--close-holes may help)"), "{fault}");
}

#[test]
fn the_same_body_in_other_vertices_is_one_body() {
    // Quadrilaterals, which are cut into triangles alike, in vertices of their own.
    let body = |first: u32, turn: usize| -> String {
        let quads: [[u32; 4]; 6] = [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ];
        quads.iter().fold(String::new(), |text, q| {
            let corners = (0..4).map(|k| format!(" {}", q[(k + turn) % 4] + first));
            text + "f" + &corners.collect::<String>() + "\n"
        })
    };
    let vertices: String = (0..8)
        .map(|v| format!("v {} {} {}\n", v >> 2 & 1, v >> 1 & 1, v & 1))
        .collect();
    for copies in [2, 3] {
        let text = vertices.repeat(copies)
            + &(0..copies)
                .map(|c| body(8 * c as u32 + 1, 0))
                .collect::<String>();
        for repair in [false, true] {
            let options = LoadOptions {
                repair,
                ..LoadOptions::default()
            };
            let (mesh, warnings) = close(read(text.as_bytes(), "obj").unwrap(), &options).unwrap();
            assert!(
                (mesh.mesh().volume() - 1.0).abs() < 1e-12,
                "{copies} {repair}"
            );
            let said = warnings
                .iter()
                .any(|w| w.to_string().contains("on the same vertices as others"));
            assert!(said, "{warnings:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Noise of a few units in the last place closes, whatever the order; the result is as many vertices as there are places.
    #[test]
    fn scattered_corners_join_in_any_order(
        noise in prop::collection::vec(-1.0_f64..1.0, 3 * 49 * 25),
        is_single in any::<bool>(),
        scale in -8_i32..8,
        shuffle in prop::collection::vec(any::<u32>(), 49 * 25),
    ) {
        let (positions, faces) = torus(12, 8);
        let unit = if is_single { f64::from(f32::EPSILON) } else { f64::EPSILON };
        let scale = f64::powi(2.0, scale);
        // Every face has corners of its own.
        let scattered: Vec<DVec3> = faces.iter().flatten().enumerate().map(|(k, &v)| {
            let shift = DVec3::from([0, 1, 2].map(|i| noise[(3 * k + i) % noise.len()]));
            let place = (positions[v as usize] + shift * unit) * scale;
            if is_single { place.as_vec3().as_dvec3() } else { place }
        }).collect();
        let mut order: Vec<u32> = (0..faces.len() as u32).collect();
        order.sort_by_key(|&f| shuffle[f as usize]);
        let mesh_of = |order: &[u32]| {
            let places: Vec<DVec3> = order.iter().flat_map(|&f| [0, 1, 2].map(|k| scattered[3 * f as usize + k])).collect();
            let corners = (0..order.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
            close(as_raw(&(places, corners)), &LoadOptions::default())
        };
        let in_order: Vec<u32> = (0..faces.len() as u32).collect();
        let (one, _) = mesh_of(&in_order).unwrap();
        let (other, _) = mesh_of(&order).unwrap();
        prop_assert_eq!(one.mesh().positions.len(), 96);
        let sorted = |mesh: &ClosedMesh| {
            let mut all: Vec<[u64; 3]> = mesh.mesh().positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
            all.sort_unstable();
            all
        };
        prop_assert_eq!(sorted(&one), sorted(&other));
    }
}
