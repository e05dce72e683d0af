//! Repairs of small meshes made for the purpose, of all voxel shapes, and of random faces.

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::closed_mesh::ClosedMesh;
use crate::defects::{Defect, MeshDefects};
use crate::holes::close_holes;
use crate::mesh::Appearance;

fn mesh(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> TriangleMesh {
    TriangleMesh {
        positions: positions.iter().map(|&p| DVec3::from(p)).collect(),
        faces: faces.to_vec(),
        ..TriangleMesh::default()
    }
}

/// Corners of a tetrahedron over the unit axes, one mirrored in z, and three far ones.
const CORNERS: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [-1.0, -1.0, 0.0],
    [-1.0, 0.0, 0.5],
    [5.0, 5.0, 5.0],
];
const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// The faces of a tetrahedron on four corners, outward if the fourth lies on the left of the first three.
fn tetrahedron([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 4] {
    [[a, c, b], [a, b, d], [b, c, d], [a, d, c]]
}

/// A box from `low` to `high` as eight corners and twelve faces, outward.
fn add_box(mesh: &mut TriangleMesh, low: f64, high: f64) {
    let first = mesh.positions.len() as u32;
    for i in 0..8 {
        let pick = |bit: u32| if i & bit == 0 { low } else { high };
        mesh.positions.push(DVec3::new(pick(1), pick(2), pick(4)));
    }
    for [a, b, c, d] in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        for triangle in [[a, b, c], [a, c, d]] {
            mesh.faces.push(triangle.map(|v| v + first));
        }
    }
}

fn repaired(mut mesh: TriangleMesh) -> (TriangleMesh, RepairReport) {
    let report = repair(&mut mesh).unwrap();
    assert_eq!(report.vertex_of.len(), mesh.positions.len());
    assert_eq!(report.face_of.len(), mesh.faces.len());
    turn_outward(&mut mesh);
    (mesh, report)
}

#[test]
fn a_sound_mesh_is_left_alone() {
    let before = mesh(&CORNERS[..4], &TETRAHEDRON);
    let (after, report) = repaired(before.clone());
    assert_eq!(after, before);
    assert_eq!(report.changes().count(), 0);
}

#[test]
fn joined_tetrahedra_lose_their_wall() {
    let below = [[0_u32, 1, 2], [0, 4, 1], [1, 4, 2], [0, 2, 4]];
    let both: Vec<[u32; 3]> = TETRAHEDRON.iter().chain(&below).copied().collect();
    let (after, report) = repaired(mesh(&CORNERS, &both));
    assert_eq!(report.duplicates, 2);
    let closed = ClosedMesh::try_from(after).unwrap();
    assert_eq!(closed.mesh().faces.len(), 6);
    assert!((closed.mesh().volume() - 1.0 / 3.0).abs() < 1e-15);
}

#[test]
fn a_face_given_twice_stays_once_in_the_right_direction() {
    for copy in [[0, 2, 1], [1, 2, 0]] {
        let mut faces = vec![copy];
        faces.extend(TETRAHEDRON);
        let (after, report) = repaired(mesh(&CORNERS, &faces));
        assert_eq!((report.duplicates, report.flipped), (1, 0), "{copy:?}");
        assert!(ClosedMesh::try_from(after).is_ok());
    }
}

#[test]
fn bodies_that_share_an_edge_come_apart() {
    let mut faces = TETRAHEDRON.to_vec();
    faces.extend(tetrahedron([3, 0, 5, 6]));
    let shared = mesh(&CORNERS, &faces);
    let volume = shared.volume();
    assert!(matches!(
        MeshDefects::of(&shared).unwrap().kinds()[0],
        Defect::CrowdedEdge {
            count: 1,
            edge: [0, 3],
            faces: 4
        }
    ));
    let (after, report) = repaired(shared);
    assert_eq!((report.crowded_edges, report.added_vertices), (1, 2));
    assert_eq!(report.vertex_of[8..], [3, 0]);
    assert!((after.volume() - volume).abs() < 1e-12);
    let closed = ClosedMesh::try_from(after).unwrap();
    assert_eq!(crate::Topology::new(&closed.mesh().faces, 8).parts().1, 2);
}

#[test]
fn bodies_that_share_a_vertex_come_apart() {
    let mut faces = TETRAHEDRON.to_vec();
    faces.extend(tetrahedron([0, 5, 4, 6]));
    let (after, report) = repaired(mesh(&CORNERS, &faces));
    assert_eq!(report.added_vertices, 1);
    assert!(ClosedMesh::try_from(after).is_ok());
}

#[test]
fn fins_and_strays_are_removed() {
    let mut faces = TETRAHEDRON.to_vec();
    faces.extend([[0, 1, 5], [5, 6, 0], [4, 5, 7]]);
    let (after, report) = repaired(mesh(&CORNERS, &faces));
    assert_eq!(report.fins, 3);
    assert_eq!(report.face_of, [0, 1, 2, 3]);
    assert!(ClosedMesh::try_from(after).is_ok());
}

#[test]
fn one_turned_face_is_turned_back_with_its_colours() {
    let mut before = mesh(&CORNERS, &TETRAHEDRON);
    before.appearance = Appearance {
        corner_colours: vec![[[0.0; 3], [0.5; 3], [1.0; 3]]; 4],
        ..Appearance::default()
    };
    before.faces[2].swap(1, 2);
    let (after, report) = repaired(before);
    assert_eq!(report.flipped, 1);
    assert_eq!(after.faces, TETRAHEDRON);
    assert_eq!(
        after.appearance.corner_colours[2],
        [[0.0; 3], [1.0; 3], [0.5; 3]]
    );
}

#[test]
fn a_moebius_strip_is_refused() {
    let count = 7_u32;
    let mut strip = TriangleMesh::default();
    for i in 0..count {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(count);
        let out = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let across = out * (0.3 * (angle / 2.0).cos()) + DVec3::Z * (0.3 * (angle / 2.0).sin());
        strip.positions.extend([out - across, out + across]);
    }
    for i in 0..count {
        let [a, b] = [2 * i, 2 * i + 1];
        // The last piece is joined with its sides exchanged.
        let [c, d] = if i + 1 < count {
            [a + 2, b + 2]
        } else {
            [1, 0]
        };
        strip.faces.extend([[a, c, b], [b, c, d]]);
    }
    assert!(matches!(
        repair(&mut strip),
        Err(RepairError::NotOrientable { .. })
    ));
}

/// A box with a vertex on an edge, and beside it faces without area: `chain` vertices on the edge, which one after the
/// other are cut off as an ear from the polygon they form with its ends.
fn box_with_a_flat_seam(chain: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    add_box(&mut mesh, 0.0, 64.0);
    // The edge from (0, 0, 0) to (64, 0, 0), with faces [0, 4, 5, 1] below and [0, 1, 5] ... beside it.
    let place = mesh
        .faces
        .iter()
        .position(|f| f.contains(&0) && f.contains(&1) && f.contains(&5));
    let face = mesh.faces[place.unwrap()];
    let k = (0..3).find(|&k| !matches!(face[k], 0 | 1)).unwrap();
    let [far, from, to] = [0, 1, 2].map(|i| face[(k + i) % 3]);
    let first = mesh.positions.len() as u32;
    let side = |v: u32| mesh.positions[v as usize];
    let (a, b) = (side(from), side(to));
    let inner: Vec<u32> = (0..chain).map(|i| first + i).collect();
    for i in 0..chain {
        let share = f64::from(i + 1) / f64::from(chain + 1);
        mesh.positions.push(a + (b - a) * share);
    }
    mesh.positions[first as usize..]
        .iter_mut()
        .for_each(|p| *p = p.round());
    let rim: Vec<u32> = [&[from], &inner[..], &[to]].concat();
    mesh.faces.remove(place.unwrap());
    for pair in rim.windows(2) {
        mesh.faces.push([far, pair[0], pair[1]]);
    }
    // Between the straight edge and the chain: a fan from its first vertex.
    for pair in rim[1..].windows(2) {
        mesh.faces.push([from, pair[1], pair[0]]);
    }
    mesh
}

#[test]
fn faces_without_area_are_removed_and_nothing_moves() {
    for chain in [1, 2, 3, 7] {
        let before = box_with_a_flat_seam(chain);
        let defects = MeshDefects::of(&before).unwrap();
        let count = chain as usize;
        assert!(
            matches!(defects.kinds(), [Defect::ZeroArea { count: c, .. }] if *c == count),
            "{defects}"
        );
        let (after, report) = repaired(before.clone());
        assert_eq!(report.zero_areas, count);
        assert_eq!(after.positions, before.positions);
        assert_eq!(after.faces.len(), before.faces.len());
        let closed = ClosedMesh::try_from(after).unwrap();
        assert_eq!(closed.mesh().volume(), 64.0_f64.powi(3));
    }
}

#[test]
fn the_halves_of_a_face_keep_its_looks() {
    let mut before = box_with_a_flat_seam(1);
    let line = before.faces.len() - 1;
    // Everything is painted by where it is, but for the face that is never visible.
    let paint = |mesh: &TriangleMesh, f: usize| mesh.corners(f).map(|p| p.as_vec3().to_array());
    before.appearance.corner_colours = (0..=line).map(|f| paint(&before, f)).collect();
    before.appearance.corner_colours[line] = [[-1.0; 3]; 3];
    before.appearance.face_materials = (0..=line as u16).collect();
    let (after, report) = repaired(before);
    let beyond = report.face_of[line] as usize;
    assert!(beyond != line && report.face_of[beyond] as usize == beyond);
    assert_eq!(after.appearance.face_materials[line], beyond as u16);
    for f in 0..=line {
        assert_eq!(
            after.appearance.corner_colours[f],
            paint(&after, f),
            "face {f}"
        );
    }
}

#[test]
fn a_face_without_area_at_a_free_edge_stays() {
    let mut open = box_with_a_flat_seam(1);
    let line = open.faces.len() - 1;
    let [a, b, _] = open.faces[line];
    let beyond = (0..line).find(|&f| open.faces[f].contains(&a) && open.faces[f].contains(&b));
    open.faces.remove(beyond.unwrap());
    let (after, report) = repaired(open);
    assert_eq!(report.zero_areas, 0);
    assert!(MeshDefects::of(&after).unwrap().is_open());
}

#[test]
fn nothing_but_degenerate_faces_is_refused() {
    let mut empty = mesh(&CORNERS, &[[0, 0, 1], [2, 3, 2]]);
    assert_eq!(
        repair(&mut empty),
        Err(RepairError::NothingLeft { removed: 2 })
    );
    let mut wild = mesh(&CORNERS, &[[0, 1, 99]]);
    assert!(matches!(
        repair(&mut wild),
        Err(RepairError::Meaningless(_))
    ));
}

#[test]
fn cavities_stay_and_inward_parts_are_turned() {
    let mut hollow = TriangleMesh::default();
    add_box(&mut hollow, 0.0, 3.0);
    add_box(&mut hollow, 1.0, 2.0);
    for f in 12..24 {
        hollow.flip_face(f);
    }
    assert_eq!(turn_outward(&mut hollow.clone()), 0);
    assert!((hollow.volume() - 26.0).abs() < 1e-12);
    // All inside out, with a small part beside it that is right.
    let mut wrong = hollow.clone();
    for f in 0..24 {
        wrong.flip_face(f);
    }
    add_box(&mut wrong, 5.0, 6.0);
    assert_eq!(turn_outward(&mut wrong), 24);
    assert!((wrong.volume() - 27.0).abs() < 1e-12);
    // Two boxes side by side, one inside out.
    let mut beside = TriangleMesh::default();
    add_box(&mut beside, 0.0, 3.0);
    add_box(&mut beside, 5.0, 6.0);
    for f in 12..24 {
        beside.flip_face(f);
    }
    assert_eq!(turn_outward(&mut beside), 12);
    assert!((beside.volume() - 28.0).abs() < 1e-12);
}

/// The surface between full and empty cells of a 3 × 3 × 3 grid: closed and oriented, with all the ways in which cells
/// can touch in edges and corners.
fn voxel_surface(cells: u32) -> TriangleMesh {
    const SIDE: i32 = 3;
    let is_full = |c: [i32; 3]| {
        c.iter().all(|&x| (0..SIDE).contains(&x))
            && cells >> (c[0] + SIDE * (c[1] + SIDE * c[2])) & 1 == 1
    };
    let vertex = |c: [i32; 3]| (c[0] + (SIDE + 1) * (c[1] + (SIDE + 1) * c[2])) as u32;
    let mut surface = TriangleMesh::default();
    for z in 0..=SIDE {
        for y in 0..=SIDE {
            for x in 0..=SIDE {
                surface
                    .positions
                    .push(DVec3::new(x.into(), y.into(), z.into()));
            }
        }
    }
    for z in 0..SIDE {
        for y in 0..SIDE {
            for x in 0..SIDE {
                let cell = [x, y, z];
                for axis in (0..3).filter(|_| is_full(cell)) {
                    for step in [0, 1] {
                        let mut beyond = cell;
                        beyond[axis] += 2 * step - 1;
                        if is_full(beyond) {
                            continue;
                        }
                        let corner = |u: i32, v: i32| {
                            let mut c = cell;
                            c[axis] += step;
                            c[(axis + 1) % 3] += u;
                            c[(axis + 2) % 3] += v;
                            vertex(c)
                        };
                        let mut quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                        if step == 0 {
                            quad.reverse();
                        }
                        let [a, b, c, d] = quad;
                        surface.faces.extend([[a, b, c], [a, c, d]]);
                    }
                }
            }
        }
    }
    surface
}

#[test]
fn a_ring_pinched_along_an_edge_becomes_manifold() {
    // Cells that touch along one edge and hang together around it, so that its ends cannot be split.
    let cell = |x: u32, y: u32, z: u32| 1 << (x + 3 * (y + 3 * z));
    let ring = cell(0, 0, 0) | cell(1, 1, 0) | cell(0, 0, 1) | cell(1, 0, 1) | cell(1, 1, 1);
    let (after, report) = repaired(voxel_surface(ring));
    assert_eq!(report.crowded_edges, 1);
    let closed = ClosedMesh::try_from(after).unwrap();
    assert!((closed.mesh().volume() - 5.0).abs() < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn every_voxel_shape_is_repaired_and_keeps_its_volume(cells in 1_u32..1 << 27) {
        let (after, _) = repaired(voxel_surface(cells));
        let closed = ClosedMesh::try_from(after);
        prop_assert!(closed.is_ok(), "{}", closed.unwrap_err());
        let volume = closed.unwrap().mesh().volume();
        prop_assert!((volume - f64::from(cells.count_ones())).abs() < 1e-9, "{}", volume);
    }

    #[test]
    fn random_faces_end_closed_or_with_a_reason(
        faces in prop::collection::vec(prop::array::uniform3(0_u32..9), 1..60),
        places in prop::collection::vec(prop::array::uniform3(0_i8..4), 9),
    ) {
        let positions: Vec<[f64; 3]> = places.iter().map(|p| p.map(f64::from)).collect();
        let mut soup = mesh(&positions, &faces);
        let _ = MeshDefects::of(&soup);
        let _ = close_holes(&mut soup.clone());
        turn_outward(&mut soup.clone());
        let Ok(report) = repair(&mut soup) else { return Ok(()); };
        prop_assert_eq!(report.vertex_of.len(), soup.positions.len());
        prop_assert_eq!(report.face_of.len(), soup.faces.len());
        if let Some(defects) = MeshDefects::of(&soup) {
            // Faces without area stay where no edge can be turned for them.
            let is_left = |d: &Defect| matches!(d, Defect::ZeroArea { .. } | Defect::NoVolume
                | Defect::Boundary { .. } | Defect::Inward { .. });
            prop_assert!(defects.kinds().iter().all(is_left), "{}", defects);
        }
        let report = close_holes(&mut soup);
        prop_assert_eq!(report.vertex_of.len(), soup.positions.len());
        turn_outward(&mut soup);
        if let Err(defects) = ClosedMesh::try_from(soup) {
            let is_flat = |d: &Defect| matches!(d, Defect::NoVolume | Defect::Inward { .. } | Defect::ZeroArea { .. });
            prop_assert!(defects.kinds().iter().all(is_flat), "{}", defects);
        }
    }
}

/// Writes the faces of a mesh once more, each turned around its corners by its number.
fn add_copy(mesh: &mut TriangleMesh, is_inside_out: bool) {
    let faces = mesh.faces.clone();
    for (f, [a, b, c]) in faces.into_iter().enumerate() {
        let mut copy = if is_inside_out { [a, c, b] } else { [a, b, c] };
        copy.rotate_left(f % 3);
        mesh.faces.push(copy);
    }
}

#[test]
fn a_body_given_several_times_is_one_body() {
    let volume_of = |mesh: TriangleMesh| {
        let (mut mesh, report) = repaired(mesh);
        turn_outward(&mut mesh);
        let closed = ClosedMesh::try_from(mesh).unwrap();
        (
            closed.mesh().volume(),
            closed.mesh().faces.len(),
            report.duplicates,
        )
    };
    for copies in [
        vec![false],
        vec![false, false],
        vec![true],
        vec![false, true],
    ] {
        let mut cube = TriangleMesh::default();
        add_box(&mut cube, 0.0, 1.0);
        let once = cube.clone();
        for &is_inside_out in &copies {
            let mut copy = once.clone();
            add_copy(&mut copy, is_inside_out);
            cube.faces.extend_from_slice(&copy.faces[12..]);
        }
        assert_eq!(
            volume_of(cube.clone()),
            (1.0, 12, 12 * copies.len()),
            "{copies:?}"
        );
        // The same beside another body, and with one that touches it in a corner.
        for (low, high) in [(3.0, 4.0), (1.0, 2.0)] {
            let mut two = cube.clone();
            add_box(&mut two, low, high);
            let (mut welded, _) = (two.clone(), ());
            for v in welded.faces.iter_mut().flatten() {
                let at = two.positions[*v as usize];
                *v = two.positions.iter().position(|&p| p == at).unwrap() as u32;
            }
            let (volume, faces, _) = volume_of(welded);
            assert_eq!((volume, faces), (2.0, 24), "{copies:?} {low}");
        }
    }
}

#[test]
fn a_ball_in_a_hole_of_its_size_shares_its_wall() {
    // A large box with a cavity, and a small box that fills it exactly.
    let mut mesh = TriangleMesh::default();
    add_box(&mut mesh, 0.0, 1.0);
    add_copy(&mut mesh, true);
    add_box(&mut mesh, -1.0, 2.0);
    let (mesh, report) = repaired(mesh);
    assert_eq!((mesh.faces.len(), report.duplicates), (12, 24));
    assert!((mesh.volume() - 27.0).abs() < 1e-12);
}
