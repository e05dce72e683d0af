//! Primitives: vertices and triangles of meshes, in the poses the scene shows them in.

use glam::{DMat4, DVec3};

use super::super::error::{GltfFault, MeshFault};
use super::super::raw::{PolygonLook, RawMesh};
use super::accessor::{Accessor, Component, Use};
use super::alpha::Shows;
use super::attribute::Attribute;
use super::document::{Primitive, Whole, find};
use super::draco::{self, Decoded};
use super::material::{CornerLooks, Look, Materials};
use super::scene::{Place, Scene, Shown};
use super::skin::Influences;

/// Nodes may show one mesh many times; this many triangles are enough, and so many vertices.
const MOST_TRIANGLES: usize = 100_000_000;
const MOST_VERTICES: usize = 150_000_000;

/// Points and lines are left out; these remain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Triangles,
    Strip,
    Fan,
}

/// Where a primitive is in the document, and what it is made of.
struct Source<'a> {
    scene: &'a Scene<'a>,
    primitive: &'a Primitive,
    mesh: usize,
    number: usize,
    decoded: Option<Decoded>,
}

/// Adds what a node shows.
pub(super) fn read_mesh(
    scene: &Scene<'_>,
    shown: &Shown,
    materials: &mut Materials,
    raw: &mut RawMesh,
) -> Result<(), MeshFault> {
    let mesh = &scene.document.meshes[shown.mesh];
    let weights = shown.weights.as_ref().or(mesh.weights.as_ref());
    let weights = weights.map_or(&[][..], Vec::as_slice);
    for (number, primitive) in mesh.primitives.iter().enumerate() {
        let mode = match primitive.mode {
            None | Some(Whole(4)) => Mode::Triangles,
            Some(Whole(5)) => Mode::Strip,
            Some(Whole(6)) => Mode::Fan,
            _ => {
                raw.ignore("points and lines were left out".to_owned());
                continue;
            }
        };
        if !primitive.attributes.contains_key("POSITION") {
            raw.ignore("primitives without positions were left out".to_owned());
            continue;
        }
        let mut source = Source {
            scene,
            primitive,
            mesh: shown.mesh,
            number,
            decoded: None,
        };
        let mode = source.decode()?.unwrap_or(mode);
        source.read(mode, &shown.place, weights, (materials, raw))?;
    }
    Ok(())
}

impl<'a> Source<'a> {
    /// Decodes the primitive where it is compressed as a whole; gives the mode of what comes out.
    fn decode(&mut self) -> Result<Option<Mode>, MeshFault> {
        let (mesh, primitive) = (self.mesh, self.number);
        let extensions = &self.primitive.extensions;
        let compressed: Option<draco::Compressed> = extensions
            .get("KHR_draco_mesh_compression")
            .map_err(MeshFault::Gltf)?;
        let Some(compressed) = compressed else {
            return Ok(None);
        };
        let view = self.scene.buffers.view(compressed.buffer_view, || {
            format!("meshes[{mesh}].primitives[{primitive}].extensions.KHR_draco_mesh_compression.bufferView")
        });
        let view = view.map_err(MeshFault::Gltf)?;
        let decoded = draco::decode(&compressed, view.bytes).map_err(|reason| {
            MeshFault::Gltf(GltfFault::Draco {
                mesh,
                primitive,
                reason,
            })
        })?;
        self.decoded = Some(decoded);
        Ok(Some(Mode::Triangles))
    }

    fn path(&self, what: &str) -> String {
        format!("meshes[{}].primitives[{}].{what}", self.mesh, self.number)
    }

    /// An attribute, where the primitive has it.
    fn attribute(&self, name: &str, purpose: Use) -> Result<Option<Attribute<'a>>, MeshFault> {
        let Some(&index) = self.primitive.attributes.get(name) else {
            return Ok(None);
        };
        if let Some(decoded) = &self.decoded {
            let document = self.scene.document;
            let path = || self.path(&format!("attributes.{name}"));
            let accessor = find(&document.accessors, index, path).map_err(MeshFault::Gltf)?;
            let is_fraction = accessor.normalized || purpose.is_fraction;
            let fraction_of = Component::of_code(accessor.component_type).filter(|_| is_fraction);
            if let Some((width, values)) = decoded.attribute(name, fraction_of) {
                return Ok(Some(Attribute::Decoded { width, values }));
            }
        }
        let scene = self.scene;
        let path = || self.path(&format!("attributes.{name}"));
        let accessor = Accessor::new(scene.document, &scene.buffers, index, purpose, path)?;
        Ok(Some(Attribute::Stored(accessor)))
    }

    /// An attribute with something for each of `count` vertices; a shorter one is of no use.
    fn whole_attribute(
        &self,
        name: &str,
        purpose: Use,
        count: usize,
    ) -> Result<Option<Attribute<'a>>, MeshFault> {
        let found = self.attribute(name, purpose)?;
        Ok(found.filter(|attribute| attribute.count() >= count))
    }

    fn read(
        &self,
        mode: Mode,
        place: &Place,
        weights: &[f64],
        (materials, raw): (&mut Materials, &mut RawMesh),
    ) -> Result<(), MeshFault> {
        let scene = self.scene;
        let positions = match &self.decoded {
            None => self.stored_positions()?,
            Some(_) => self.attribute("POSITION", Use::POINT)?,
        };
        let Some(positions) = positions else {
            return Ok(());
        };
        let count = positions.count();
        let indices = self.indices(count)?;
        let triangles = triangles(mode, &indices);
        if triangles.is_empty() {
            return Ok(());
        }
        let vertices = Vertices::of(&triangles, count);
        let targets = self.targets(weights, count)?;
        let mut bind = Vec::with_capacity(vertices.of_file.len());
        for &vertex in &vertices.of_file {
            let mut position = DVec3::from(positions.get::<3>(vertex as usize));
            for (weight, target) in &targets {
                position += *weight * DVec3::from(target.get::<3>(vertex as usize));
            }
            bind.push(position);
        }
        let look = materials.look(scene, self.primitive.material, raw)?;
        let corners = self.corner_looks(&look, &triangles, count)?;
        let shows = look.what_shows(materials, &raw.mesh.appearance, &corners);
        let faces = Faces {
            triangles: &triangles,
            vertices: &vertices,
            corners: &corners,
            shows: &shows,
            material: look.material,
        };
        match place {
            Place::Copies(copies) => {
                for world_from_mesh in copies {
                    let placed = bind.iter().map(|&p| world_from_mesh.transform_point3(p));
                    let is_mirrored = world_from_mesh.determinant() < 0.0;
                    faces.push(raw, placed, is_mirrored)?;
                }
            }
            Place::Skinned(skin) => {
                let influences = self.influences(count)?;
                if influences.sets.is_empty() {
                    raw.ignore(
                        "a mesh with a skin has no JOINTS_0 and WEIGHTS_0: all of it follows the first joint"
                            .to_owned(),
                    );
                }
                let matrices: Vec<DMat4> = (vertices.of_file.iter())
                    .map(|&vertex| skin.matrix(&influences, vertex as usize))
                    .collect::<Result<_, _>>()?;
                let turned = matrices.iter().filter(|m| m.determinant() < 0.0).count();
                let is_mirrored = 2 * turned > matrices.len();
                let placed = bind.iter().zip(&matrices);
                let placed = placed.map(|(&p, matrix)| matrix.transform_point3(p));
                faces.push(raw, placed, is_mirrored)?;
            }
        }
        Ok(())
    }

    /// Positions from their accessor; what indices say of vertices that are not there goes first.
    fn stored_positions(&self) -> Result<Option<Attribute<'a>>, MeshFault> {
        let document = self.scene.document;
        if let Some(&index) = self.primitive.attributes.get("POSITION") {
            let path = || self.path("attributes.POSITION");
            let accessor = find(&document.accessors, index, path).map_err(MeshFault::Gltf)?;
            if accessor.buffer_view.is_none() && accessor.sparse.is_none() {
                // There is nothing to read, but what the indices say may be worse.
                self.indices(accessor.count.0)?;
            }
        }
        self.attribute("POSITION", Use::POINT)
    }

    /// The vertices of a primitive's faces, all of them below `count`.
    fn indices(&self, count: usize) -> Result<Vec<u32>, MeshFault> {
        let indices: Vec<u32> = match (&self.decoded, self.primitive.indices) {
            (Some(decoded), _) => decoded.indices(),
            (None, Some(index)) => {
                let scene = self.scene;
                let path = || self.path("indices");
                let indices =
                    Accessor::new(scene.document, &scene.buffers, index, Use::INDEX, path)?
                        .into_indices(index)?;
                (0..indices.count)
                    .map(|i| indices.get::<1>(i)[0] as u32)
                    .collect()
            }
            (None, None) => {
                let count = u32::try_from(count).map_err(|_| MeshFault::TooLarge)?;
                (0..count).collect()
            }
        };
        match indices.iter().find(|&&v| v as usize >= count) {
            None => Ok(indices),
            Some(&vertex) => Err(MeshFault::Gltf(GltfFault::IndexOutOfRange {
                mesh: self.mesh,
                primitive: self.number,
                vertex,
                count,
            })),
        }
    }

    /// The morph targets that have weight, with it.
    fn targets(
        &self,
        weights: &[f64],
        count: usize,
    ) -> Result<Vec<(f64, Attribute<'a>)>, MeshFault> {
        let mut targets = Vec::new();
        for (k, (target, &weight)) in self.primitive.targets.iter().zip(weights).enumerate() {
            let Some(&index) = target.get("POSITION") else {
                continue;
            };
            if weight == 0.0 {
                continue;
            }
            let scene = self.scene;
            let path = || self.path(&format!("targets[{k}].POSITION"));
            let accessor = Accessor::new(scene.document, &scene.buffers, index, Use::POINT, path)?;
            if accessor.count < count {
                return Err(MeshFault::Gltf(GltfFault::AccessorKind {
                    accessor: index.0,
                    what: "it moves fewer vertices than its primitive has",
                }));
            }
            targets.push((weight, Attribute::Stored(accessor)));
        }
        Ok(targets)
    }

    fn influences(&self, count: usize) -> Result<Influences<'a>, MeshFault> {
        let mut sets = Vec::new();
        for set in 0.. {
            let joints = self.whole_attribute(&format!("JOINTS_{set}"), Use::JOINTS, count)?;
            let weights = self.whole_attribute(&format!("WEIGHTS_{set}"), Use::WEIGHTS, count)?;
            match (joints, weights) {
                (Some(joints), Some(weights)) => sets.push((joints, weights)),
                _ => break,
            }
        }
        Ok(Influences { sets })
    }

    fn corner_looks(
        &self,
        look: &Look,
        triangles: &[[u32; 3]],
        count: usize,
    ) -> Result<CornerLooks, MeshFault> {
        let mut found = CornerLooks {
            triangles: triangles.len(),
            ..CornerLooks::default()
        };
        if let Some(mapping) = &look.mapping {
            let name = format!("TEXCOORD_{}", mapping.set);
            if let Some(uvs) = self.whole_attribute(&name, Use::PAIR, count)? {
                let uv = |v: u32| mapping.uv(uvs.get(v as usize)).map(|x| finite_or(x, 0.0));
                found.uvs = triangles.iter().map(|t| t.map(uv)).collect();
            }
        }
        if let Some(colours) = self.whole_attribute("COLOR_0", Use::COLOUR, count)? {
            let colour = |v: u32| {
                colours
                    .get::<3>(v as usize)
                    .map(|x| finite_or(x, 1.0).max(0.0))
            };
            found.colours = triangles.iter().map(|t| t.map(colour)).collect();
            if colours.width() == 4 && look.has_alpha() {
                let alpha = |v: u32| finite_or(colours.get::<4>(v as usize)[3], 1.0);
                found.alphas = triangles.iter().map(|t| t.map(alpha)).collect();
            }
        }
        Ok(found)
    }
}

/// The vertices that triangles use: primitives often share one large buffer.
struct Vertices {
    /// In the order of the file.
    of_file: Vec<u32>,
    /// Their numbers there.
    new: Vec<u32>,
}

impl Vertices {
    fn of(triangles: &[[u32; 3]], count: usize) -> Self {
        let mut new = vec![u32::MAX; count];
        for &v in triangles.as_flattened() {
            new[v as usize] = 0;
        }
        let mut of_file = Vec::new();
        for (v, slot) in new.iter_mut().enumerate() {
            if *slot == 0 {
                *slot = of_file.len() as u32;
                of_file.push(v as u32);
            }
        }
        Self { of_file, new }
    }
}

/// A primitive's faces, without places.
struct Faces<'a> {
    triangles: &'a [[u32; 3]],
    vertices: &'a Vertices,
    corners: &'a CornerLooks,
    /// By triangle; empty where everything shows.
    shows: &'a [Shows],
    material: Option<u16>,
}

impl Faces<'_> {
    /// Adds one copy of them.
    fn push(
        &self,
        raw: &mut RawMesh,
        placed: impl Iterator<Item = DVec3>,
        is_mirrored: bool,
    ) -> Result<(), MeshFault> {
        let first = raw.mesh.positions.len();
        if first + self.vertices.of_file.len() > MOST_VERTICES
            || raw.mesh.faces.len() + self.triangles.len() > MOST_TRIANGLES
        {
            return Err(MeshFault::TooLarge);
        }
        for position in placed {
            if !position.is_finite() {
                let vertex = raw.mesh.positions.len() as u64;
                return Err(MeshFault::NotFinite { vertex });
            }
            raw.mesh.positions.push(position);
        }
        for (t, triangle) in self.triangles.iter().enumerate() {
            // A mirrored copy turns its faces over.
            let order = if is_mirrored { [0, 2, 1] } else { [0, 1, 2] };
            let corners =
                order.map(|k: usize| first as u32 + self.vertices.new[triangle[k] as usize]);
            let uvs = self.corners.uvs.get(t).map(|uvs| order.map(|k| uvs[k]));
            let colours = self.corners.colours.get(t).map(|c| order.map(|k| c[k]));
            let look = PolygonLook {
                uvs: uvs.as_ref().map(<[_; 3]>::as_slice),
                colours: colours.as_ref().map(<[_; 3]>::as_slice),
                material: self.material,
            };
            match self.shows.get(t) {
                Some(Shows::Nothing) => raw.alpha.hidden.push(raw.mesh.faces.len() as u32),
                Some(Shows::Partly) => raw.alpha.partly += 1,
                Some(Shows::Whole) | None => (),
            }
            raw.push_polygon(&corners, look);
        }
        Ok(())
    }
}

fn finite_or(value: f64, other: f32) -> f32 {
    let value = value as f32;
    if value.is_finite() { value } else { other }
}

/// The triangles of a primitive, as indices into its vertices.
fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::Triangles => indices.as_chunks().0.to_vec(),
        Mode::Strip => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| {
                if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[0], w[2], w[1]]
                }
            })
            // Strips are continued by repeating vertices.
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect(),
        Mode::Fan => indices
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|w| [indices[0], w[0], w[1]])
            .collect(),
    }
}
