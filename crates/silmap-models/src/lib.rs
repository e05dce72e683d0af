//! Models that need no file: closed, oriented, outward manifolds of any face count.
//!
//! Counts are approached, not promised: each function says how near.
//!
#![doc = include_str!("../README.md")]

mod fans;
mod field;
mod noise;
mod organic;
mod polygonise;
mod remesh;
mod three_holes;
mod tube;

use std::fmt;
use std::str::FromStr;

pub use fans::{bicone, flat_drum};
use polygonise::Field;
use rayon::prelude::*;
use silmap_geometry::TriangleMesh;
use silmap_geometry::mesh::{Appearance, Material};
use thiserror::Error;

/// Most faces a model is made of; larger requests get this many.
pub const MAX_FACES: usize = 8_000_000;

/// The models there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum ModelKind {
    /// [`torus`]
    Torus,
    /// [`trefoil_knot`]
    TrefoilKnot,
    /// [`three_holed_torus`]
    ThreeHoledTorus,
    /// [`organic()`]
    Organic,
}

impl ModelKind {
    /// Every kind, in a fixed order.
    pub const ALL: [Self; 4] = [
        Self::Torus,
        Self::TrefoilKnot,
        Self::ThreeHoledTorus,
        Self::Organic,
    ];

    /// The name that [`ModelKind::from_str`] reads.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Torus => "torus",
            Self::TrefoilKnot => "knot",
            Self::ThreeHoledTorus => "three-holes",
            Self::Organic => "organic",
        }
    }
}

impl fmt::Display for ModelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A model's name that is none.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("there is no model called {name:?}: use {}", all_names())]
pub struct UnknownModel {
    /// The name as given.
    pub name: String,
}

fn all_names() -> String {
    ModelKind::ALL.map(ModelKind::name).join(", ")
}

impl FromStr for ModelKind {
    type Err = UnknownModel;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| UnknownModel {
                name: name.to_owned(),
            })
    }
}

/// The model of a kind with about `faces` faces; see the functions of this module for how near.
#[must_use]
pub fn generate(kind: ModelKind, faces: usize) -> TriangleMesh {
    match kind {
        ModelKind::Torus => torus(faces),
        ModelKind::TrefoilKnot => trefoil_knot(faces),
        ModelKind::ThreeHoledTorus => three_holed_torus(faces),
        ModelKind::Organic => organic(faces),
    }
}

/// A torus with radii 1 and 0.4 about the z axis.
///
/// A grid of quadrilaterals cut in two: the count is the nearest `2 · rings · sides` with near-square cells, at least 18.
#[must_use]
pub fn torus(faces: usize) -> TriangleMesh {
    tube::torus(faces.min(MAX_FACES))
}

/// A tube about a (2, 3) torus knot: genus 1, knotted, radius about 1.5.
///
/// The count is the nearest `2 · rings · sides` with near-square cells, at least 144.
#[must_use]
pub fn trefoil_knot(faces: usize) -> TriangleMesh {
    tube::trefoil_knot(faces.min(MAX_FACES))
}

/// A smooth surface of genus 3: three tori in a triangle, blended; radius about 1.2.
///
/// Any even count of at least 400 is met exactly; odd counts lose one face.
#[must_use]
pub fn three_holed_torus(faces: usize) -> TriangleMesh {
    implicit(&three_holes::ThreeHoles, 48, faces.clamp(400, MAX_FACES))
}

/// An octopus: lobes, curled arms, a loop, fine relief, and vertex colours on one white material.
///
/// Any even count of at least 2,000 is met exactly; odd counts lose one face.
#[must_use]
pub fn organic(faces: usize) -> TriangleMesh {
    let octopus = &*organic::OCTOPUS;
    let mut mesh = implicit(octopus, 72, faces.clamp(2_000, MAX_FACES));
    let colours: Vec<[f32; 3]> = mesh
        .positions
        .par_iter()
        .map(|&p| octopus.colour(p))
        .collect();
    mesh.appearance = Appearance {
        corner_colours: mesh
            .faces
            .iter()
            .map(|f| f.map(|v| colours[v as usize]))
            .collect(),
        face_materials: vec![0; mesh.faces.len()],
        materials: vec![Material {
            base_colour: [1.0; 3],
            ..Material::default()
        }],
        ..Appearance::default()
    };
    mesh
}

/// An implicit shape with `faces` faces; `least_cells` cells along the box's side resolve its topology.
fn implicit(field: &impl Field, least_cells: u64, faces: usize) -> TriangleMesh {
    // The grid's mesh has many slivers; from this many times the faces wanted, collapses leave an even mesh.
    const SURPLUS: f64 = 1.6;
    let first = polygonise::polygonise(field, least_cells);
    let refine = (SURPLUS * faces as f64 / first.faces.len() as f64).sqrt();
    let fine = if refine > 1.0 {
        polygonise::polygonise(field, (least_cells as f64 * refine).ceil() as u64)
    } else {
        first
    };
    remesh::remesh(&fine, field, faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The defects that a closed, oriented manifold must not have, found without the product's own validation.
    fn defects(mesh: &TriangleMesh) -> Vec<String> {
        let mut found = Vec::new();
        let mut edges: Vec<(u32, u32)> = mesh
            .faces
            .iter()
            .flat_map(|f| [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])])
            .collect();
        edges.sort_unstable();
        for pair in edges.windows(2).filter(|p| p[0] == p[1]) {
            found.push(format!("edge {:?} twice in one direction", pair[0]));
        }
        for &(a, b) in &edges {
            if edges.binary_search(&(b, a)).is_err() {
                found.push(format!("edge {a}-{b} has no face on its other side"));
            }
        }
        // Around each vertex, the edges opposite to it must chain into one cycle.
        let mut fans = vec![Vec::new(); mesh.positions.len()];
        for face in &mesh.faces {
            for k in 0..3 {
                fans[face[k] as usize].push((face[(k + 1) % 3], face[(k + 2) % 3]));
            }
        }
        for (v, fan) in fans.iter().enumerate() {
            let mut seen = 0;
            let mut at = fan.first().map(|&(from, _)| from);
            while let Some(here) = at.filter(|_| seen < fan.len()) {
                at = fan.iter().find(|e| e.0 == here).map(|e| e.1);
                seen += 1;
                if at == fan.first().map(|&(from, _)| from) {
                    break;
                }
            }
            if seen == 0 || seen != fan.len() {
                found.push(format!(
                    "vertex {v}: {seen} of {} faces in its first fan",
                    fan.len()
                ));
            }
        }
        for f in 0..mesh.faces.len() {
            if mesh.face_cross(f).length() < 1e-12 {
                found.push(format!("face {f} has no area"));
            }
        }
        found
    }

    fn euler_characteristic(mesh: &TriangleMesh) -> i64 {
        // Closed: three edges for two faces.
        mesh.positions.len() as i64 - mesh.faces.len() as i64 / 2
    }

    #[test]
    fn every_model_is_a_closed_oriented_manifold() {
        for kind in ModelKind::ALL {
            // The organic model's raised arm closes one loop.
            let (characteristic, counts): (_, &[usize]) = match kind {
                ModelKind::Torus | ModelKind::TrefoilKnot => {
                    (0, &[0, 500, 501, 2_048, 9_999, 30_000])
                }
                ModelKind::ThreeHoledTorus => (-4, &[0, 500, 501, 2_048, 9_999, 30_000]),
                ModelKind::Organic => (0, &[0, 3_001, 12_000]),
            };
            for &faces in counts {
                let mesh = generate(kind, faces);
                assert_eq!(defects(&mesh), Vec::<String>::new(), "{kind} {faces}");
                assert_eq!(
                    euler_characteristic(&mesh),
                    characteristic,
                    "{kind} {faces}"
                );
                assert!(mesh.volume() > 0.0, "{kind} {faces}");
                if faces > 0 {
                    let miss = mesh.faces.len().abs_diff(faces);
                    assert!(miss <= faces / 100, "{kind} {faces}: {}", mesh.faces.len());
                }
            }
        }
    }

    #[test]
    fn the_check_sees_defects() {
        let whole = torus(200);
        let with = |change: fn(&mut TriangleMesh)| {
            let mut mesh = whole.clone();
            change(&mut mesh);
            defects(&mesh).len()
        };
        assert_eq!(with(|_| ()), 0);
        assert!(with(|m| m.faces.truncate(199)) > 0);
        assert!(with(|m| m.faces[3].swap(0, 1)) > 0);
        assert!(with(|m| m.positions.push(glam::DVec3::ZERO)) > 0);
        // Two tori that touch in one vertex.
        let pinched = |m: &mut TriangleMesh| {
            let count = m.positions.len() as u32;
            let twin = m.faces.clone();
            m.positions.extend(m.positions.clone());
            let shift = |v: u32| if v == 0 { 0 } else { v + count };
            m.faces.extend(twin.iter().map(|f| f.map(shift)));
            m.positions[count as usize] = glam::DVec3::ONE;
        };
        assert!(with(pinched) > 0);
    }

    #[test]
    fn same_request_same_mesh_for_any_thread_count() {
        for kind in ModelKind::ALL {
            let alone = rayon::ThreadPoolBuilder::new()
                .num_threads(1)
                .build()
                .expect("a pool of one thread")
                .install(|| generate(kind, 3_000));
            assert_eq!(alone, generate(kind, 3_000), "{kind}");
        }
    }

    #[test]
    fn organic_model_is_colourful_and_plain_ones_are_plain() {
        let mesh = organic(3_000);
        let looks = &mesh.appearance;
        assert_eq!(looks.corner_colours.len(), mesh.faces.len());
        let mut colours: Vec<[u8; 3]> = looks
            .corner_colours
            .iter()
            .flatten()
            .map(|c| c.map(|x| (x * 255.0) as u8))
            .collect();
        colours.sort_unstable();
        colours.dedup();
        assert!(colours.len() > 300, "{} colours", colours.len());
        assert!(torus(500).appearance.is_plain());
    }

    #[test]
    fn names_round_trip() {
        for kind in ModelKind::ALL {
            assert_eq!(kind.to_string().parse(), Ok(kind));
        }
        let message = "teapot".parse::<ModelKind>().map_err(|e| e.to_string());
        assert!(message.is_err_and(|m| m.contains("teapot") && m.contains("knot")));
    }
}
