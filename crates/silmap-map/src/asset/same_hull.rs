//! Whether a mesh of a plain glTF file is the hull of an asset still, after another program rewrote it.
//!
//! Programs number vertices anew, merge them or take them apart, order triangles otherwise, move what nodes do into the vertices,
//! and round coordinates. What must be the same are the triangles, each with its corners in their order.

use std::collections::HashMap;
use std::fmt;

use glam::DVec3;

/// How far a vertex may have moved, as a share of the hull's largest extent: rounding to ten bits.
pub const SAME_HULL_SHARE: f64 = 1.0 / 1024.0;

/// Triangles of a file: vertices and what connects them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// What the file calls them.
    pub name: String,
    /// Vertex positions.
    pub positions: Vec<DVec3>,
    /// Three vertices each, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
}

/// What differs first between triangles and the hull.
#[derive(Clone, Debug, PartialEq)]
pub enum HullDifference {
    /// Another number of triangles.
    Count {
        /// What the file calls the mesh.
        mesh: String,
        /// Triangles of the mesh.
        found: usize,
        /// Triangles of the hull.
        expected: usize,
    },
    /// A vertex is none of the hull's.
    Vertex {
        /// What the file calls the mesh.
        mesh: String,
        /// Index of the vertex.
        vertex: usize,
        /// Distance to the nearest vertex of the hull.
        distance: f64,
        /// The largest that is allowed.
        allowed: f64,
    },
    /// A triangle is none of the hull's.
    Triangle {
        /// What the file calls the mesh.
        mesh: String,
        /// Index of the triangle.
        triangle: usize,
    },
    /// There are no triangles.
    Nothing,
}

impl fmt::Display for HullDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count {
                mesh,
                found,
                expected,
            } => write!(
                f,
                "mesh {mesh:?} has {found} triangles, the hull has {expected}"
            ),
            Self::Vertex {
                mesh,
                vertex,
                distance,
                allowed,
            } => write!(
                f,
                "vertex {vertex} of mesh {mesh:?} is {distance:.3e} from the nearest vertex of the hull, more than {allowed:.3e}"
            ),
            Self::Triangle { mesh, triangle } => {
                write!(
                    f,
                    "triangle {triangle} of mesh {mesh:?} is none of the hull's"
                )
            }
            Self::Nothing => write!(f, "the file has no triangles"),
        }
    }
}

/// A hull to compare with.
pub(super) struct HullShape {
    /// Places of vertices, each once, by their x.
    places: Vec<DVec3>,
    allowed: f64,
    /// How often each triangle is there.
    faces: HashMap<[u32; 3], i32>,
    face_count: usize,
}

/// The triangle with its smallest corner first.
fn turned([a, b, c]: [u32; 3]) -> [u32; 3] {
    let least = a.min(b).min(c);
    if a == least {
        [a, b, c]
    } else if b == least {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

impl HullShape {
    pub(super) fn new(hull: &Triangles) -> Self {
        let mut places = hull.positions.clone();
        let order = |a: &DVec3, b: &DVec3| {
            (a.x.total_cmp(&b.x))
                .then(a.y.total_cmp(&b.y))
                .then(a.z.total_cmp(&b.z))
        };
        places.sort_by(order);
        places.dedup();
        let first = places.first().copied().unwrap_or_default();
        let (least, most) = (places.iter()).fold((first, first), |(least, most), &p| {
            (least.min(p), most.max(p))
        });
        let mut shape = Self {
            allowed: SAME_HULL_SHARE * (most - least).max_element(),
            places,
            faces: HashMap::new(),
            face_count: hull.faces.len(),
        };
        let exact: Vec<u32> = (hull.positions.iter())
            .map(|&p| shape.nearest(p).map_or(0, |(place, _)| place))
            .collect();
        for face in &hull.faces {
            let face = turned(face.map(|v| exact[v as usize]));
            *shape.faces.entry(face).or_default() += 1;
        }
        shape
    }

    /// The nearest place within what is allowed, and its distance; the nearest at all where none is so near.
    fn nearest(&self, p: DVec3) -> Option<(u32, f64)> {
        let near = |reach: f64| {
            let first = self.places.partition_point(|q| q.x < p.x - reach);
            let places =
                (first..self.places.len()).take_while(|&k| self.places[k].x <= p.x + reach);
            let distances = places.map(|k| (k as u32, self.places[k].distance(p)));
            distances.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        near(self.allowed)
            .filter(|found| found.1 <= self.allowed)
            .or_else(|| near(f64::INFINITY))
    }

    /// Whether these triangles are the hull's.
    pub(super) fn compare(&self, mesh: &Triangles) -> Result<(), HullDifference> {
        let name = || mesh.name.clone();
        if mesh.faces.len() != self.face_count {
            return Err(HullDifference::Count {
                mesh: name(),
                found: mesh.faces.len(),
                expected: self.face_count,
            });
        }
        let mut place_of: HashMap<u32, u32> = HashMap::new();
        for &vertex in mesh.faces.iter().flatten() {
            if place_of.contains_key(&vertex) {
                continue;
            }
            let position = mesh.positions.get(vertex as usize).copied();
            let found = position.and_then(|p| self.nearest(p));
            match found {
                Some((place, distance)) if distance <= self.allowed => {
                    place_of.insert(vertex, place);
                }
                other => {
                    return Err(HullDifference::Vertex {
                        mesh: name(),
                        vertex: vertex as usize,
                        distance: other.map_or(f64::NAN, |(_, distance)| distance),
                        allowed: self.allowed,
                    });
                }
            }
        }
        let mut left = self.faces.clone();
        for (triangle, face) in mesh.faces.iter().enumerate() {
            let face = turned(face.map(|v| place_of[&v]));
            match left.get_mut(&face) {
                Some(count) if *count > 0 => *count -= 1,
                _ => {
                    return Err(HullDifference::Triangle {
                        mesh: name(),
                        triangle,
                    });
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn octahedron() -> Triangles {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let positions = axes.iter().flat_map(|&a| [a, -a]).collect();
        let faces = (0..8_u32).map(|k| {
            let [a, b, c] = [0, 1, 2].map(|axis| 2 * axis + (k >> axis & 1));
            if k.count_ones().is_multiple_of(2) {
                [a, b, c]
            } else {
                [a, c, b]
            }
        });
        Triangles {
            name: "o".into(),
            positions,
            faces: faces.collect(),
        }
    }

    proptest! {
        /// Vertices taken apart, shuffled and rounded; triangles turned and shuffled.
        #[test]
        fn rewritten_triangles_are_the_same(
            order in Just((0..8_usize).collect::<Vec<_>>()).prop_shuffle(),
            turns in prop::collection::vec(0..3_usize, 8),
            bits in 11..20_i32,
        ) {
            let hull = octahedron();
            let step = 2.0 / 2.0_f64.powi(bits);
            let mut other = Triangles { name: "p".into(), ..Triangles::default() };
            for f in order {
                let mut corners = hull.faces[f];
                corners.rotate_left(turns[f]);
                let first = other.positions.len() as u32;
                other.positions.extend(corners.map(|v| {
                    ((hull.positions[v as usize] + 0.1) / step).round() * step - 0.1
                }));
                other.faces.push([first, first + 1, first + 2]);
            }
            let shape = HullShape::new(&hull);
            prop_assert_eq!(shape.compare(&other), Ok(()));
            // A triangle turned over, one left out, a vertex moved.
            let mut over = other.clone();
            over.faces[3].reverse();
            prop_assert_eq!(shape.compare(&over), Err(HullDifference::Triangle { mesh: "p".into(), triangle: 3 }));
            let mut fewer = other.clone();
            fewer.faces.pop();
            let counted = HullDifference::Count { mesh: "p".into(), found: 7, expected: 8 };
            prop_assert_eq!(shape.compare(&fewer), Err(counted));
            other.positions[5].z += 0.01;
            let moved = matches!(shape.compare(&other), Err(HullDifference::Vertex { vertex: 5, .. }));
            prop_assert!(moved);
        }
    }
}
