//! Nodes: which meshes stand where.

use std::path::Path;

use glam::{DMat4, DQuat, DVec3};
use serde::Deserialize;

use super::super::error::{GltfFault, MeshFault};
use super::super::raw::RawMesh;
use super::accessor::{Accessor, Use};
use super::buffers::Buffers;
use super::document::{Attributes, Document, Node, Whole, find};
use super::skin::Skin;

/// A document with its buffers, and where its nodes are.
pub(super) struct Scene<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: Buffers<'a>,
    /// Where files lie that the document names.
    pub(super) folder: &'a Path,
    pub(super) world_from_node: Vec<DMat4>,
    parent: Vec<Option<usize>>,
}

/// A mesh in the scene.
pub(super) struct Shown {
    pub(super) mesh: usize,
    pub(super) place: Place,
    /// Weights of morph targets; those of the mesh where the node has none.
    pub(super) weights: Option<Vec<f64>>,
}

/// Where a mesh stands.
pub(super) enum Place {
    /// Everywhere that one of these transforms puts it.
    Copies(Vec<DMat4>),
    /// Where its joints pull it.
    Skinned(Skin),
}

#[derive(Deserialize)]
struct Instancing {
    attributes: Attributes,
}

#[derive(Deserialize)]
struct Visibility {
    #[serde(default = "yes")]
    visible: bool,
}

fn yes() -> bool {
    true
}

#[derive(Deserialize)]
struct Levels {
    #[serde(default)]
    ids: Vec<Whole>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(
        document: &'a Document,
        buffers: Buffers<'a>,
        folder: &'a Path,
    ) -> Result<Self, GltfFault> {
        let parent = parents(document)?;
        let order = parents_first(&parent)?;
        let mut world_from_node = vec![DMat4::IDENTITY; document.nodes.len()];
        for node in order {
            let above = parent[node].map_or(DMat4::IDENTITY, |above| world_from_node[above]);
            world_from_node[node] = above * matrix(&document.nodes[node]);
        }
        Ok(Self {
            document,
            buffers,
            folder,
            world_from_node,
            parent,
        })
    }

    /// What the default scene shows, else the first one, else all nodes without a parent. A document without nodes is a
    /// library of meshes: they are taken as they are.
    pub(super) fn shown(&self, raw: &mut RawMesh) -> Result<Vec<Shown>, MeshFault> {
        let nodes = &self.document.nodes;
        if nodes.is_empty() {
            let at_origin = |mesh| Shown {
                mesh,
                place: Place::Copies(vec![DMat4::IDENTITY]),
                weights: None,
            };
            return Ok((0..self.document.meshes.len()).map(at_origin).collect());
        }
        let roots = self.roots().map_err(MeshFault::Gltf)?;
        let mut is_seen = vec![false; nodes.len()];
        let mut open: Vec<usize> = roots.into_iter().rev().collect();
        let mut shown = Vec::new();
        while let Some(at) = open.pop() {
            if std::mem::replace(&mut is_seen[at], true) {
                return Err(MeshFault::Gltf(GltfFault::NodeLoop { node: at }));
            }
            let node = &nodes[at];
            let visibility: Option<Visibility> =
                (node.extensions.get("KHR_node_visibility")).map_err(MeshFault::Gltf)?;
            if visibility.is_some_and(|v| !v.visible) {
                raw.ignore("nodes that the file hides were left out".to_owned());
                continue;
            }
            if let Some(mesh) = node.mesh {
                find(&self.document.meshes, mesh, || format!("nodes[{at}].mesh"))
                    .map_err(MeshFault::Gltf)?;
                shown.push(Shown {
                    mesh: mesh.0,
                    place: self.place(at, raw)?,
                    weights: node.weights.clone(),
                });
            }
            open.extend(node.children.iter().rev().map(|child| child.0));
        }
        Ok(shown)
    }

    fn roots(&self) -> Result<Vec<usize>, GltfFault> {
        let document = self.document;
        let scene = match document.scene {
            Some(index) => Some(find(&document.scenes, index, || "scene".to_owned())?),
            None => document.scenes.first(),
        };
        if let Some(scene) = scene {
            let index = document.scene.unwrap_or_default().0;
            let root = |(k, &node): (usize, &Whole)| {
                let path = || format!("scenes[{index}].nodes[{k}]");
                find(&document.nodes, node, path).map(|_| node.0)
            };
            return scene.nodes.iter().enumerate().map(root).collect();
        }
        // Coarser levels of detail hang on nodes without being their children.
        let mut is_level = vec![false; document.nodes.len()];
        for node in &document.nodes {
            let levels: Option<Levels> = node.extensions.get("MSFT_lod")?;
            for id in levels.into_iter().flat_map(|levels| levels.ids) {
                if let Some(mark) = is_level.get_mut(id.0) {
                    *mark = true;
                }
            }
        }
        let is_root = |&node: &usize| self.parent[node].is_none() && !is_level[node];
        Ok((0..document.nodes.len()).filter(is_root).collect())
    }

    fn place(&self, at: usize, raw: &mut RawMesh) -> Result<Place, MeshFault> {
        let node = &self.document.nodes[at];
        let instancing: Option<Instancing> = node
            .extensions
            .get("EXT_mesh_gpu_instancing")
            .map_err(MeshFault::Gltf)?;
        if let Some(index) = node.skin {
            if instancing.is_some() {
                raw.ignore("instances of a mesh with a skin were left out".to_owned());
            }
            return Ok(Place::Skinned(self.skin(index, at)?));
        }
        let world_from_node = self.world_from_node[at];
        let Some(instancing) = instancing else {
            return Ok(Place::Copies(vec![world_from_node]));
        };
        let instances = self.instances(at, &instancing)?;
        let placed = |node_from_instance| world_from_node * node_from_instance;
        Ok(Place::Copies(instances.into_iter().map(placed).collect()))
    }

    /// A skin whose joints stand where the scene puts them.
    fn skin(&self, index: Whole, node: usize) -> Result<Skin, MeshFault> {
        let document = self.document;
        let skin = find(&document.skins, index, || format!("nodes[{node}].skin"))
            .map_err(MeshFault::Gltf)?;
        let fault = |what| {
            let skin = index.0;
            MeshFault::Gltf(GltfFault::Skin { skin, what })
        };
        let inverse_bind = match skin.inverse_bind_matrices {
            None => None,
            Some(accessor) => Some(Accessor::new(
                document,
                &self.buffers,
                accessor,
                Use::MATRIX,
                || format!("skins[{}].inverseBindMatrices", index.0),
            )?),
        };
        if (inverse_bind.as_ref()).is_some_and(|matrices| matrices.count < skin.joints.len()) {
            return Err(fault("has fewer inverse bind matrices than joints"));
        }
        let mut world_from_bind = Vec::with_capacity(skin.joints.len());
        for (k, joint) in skin.joints.iter().enumerate() {
            let world_from_joint = find(&self.world_from_node, *joint, || {
                format!("skins[{}].joints[{k}]", index.0)
            })
            .map_err(MeshFault::Gltf)?;
            let joint_from_bind = inverse_bind.as_ref().map_or(DMat4::IDENTITY, |matrices| {
                DMat4::from_cols_array(&matrices.get::<16>(k))
            });
            world_from_bind.push(*world_from_joint * joint_from_bind);
        }
        if world_from_bind.is_empty() {
            return Err(fault("has no joints"));
        }
        Ok(Skin {
            index: index.0,
            world_from_bind,
        })
    }

    /// The transforms of EXT_mesh_gpu_instancing; attributes with other names are the application's.
    fn instances(&self, at: usize, instancing: &Instancing) -> Result<Vec<DMat4>, MeshFault> {
        let accessor = |name: &str, purpose| {
            let found = instancing.attributes.get(name);
            let path =
                || format!("nodes[{at}].extensions.EXT_mesh_gpu_instancing.attributes.{name}");
            found
                .map(|&index| Accessor::new(self.document, &self.buffers, index, purpose, path))
                .transpose()
        };
        let translation = accessor("TRANSLATION", Use::POINT)?;
        let rotation = accessor("ROTATION", Use::ROTATION)?;
        let scale = accessor("SCALE", Use::POINT)?;
        let counts = [&translation, &rotation, &scale].map(|a| a.as_ref().map(|a| a.count));
        let mut counts = counts.into_iter().flatten();
        // Whatever else is said of instances, each has one of these.
        let Some(count) = counts.next() else {
            return Ok(vec![DMat4::IDENTITY]);
        };
        if counts.any(|other| other != count) {
            return Err(MeshFault::Gltf(GltfFault::Instances { node: at }));
        }
        let transform = |i: usize| {
            let translation = translation.as_ref().map_or([0.0; 3], |a| a.get(i));
            let rotation = rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |a| a.get(i));
            let scale = scale.as_ref().map_or([1.0; 3], |a| a.get(i));
            composed(translation, rotation, scale)
        };
        Ok((0..count).map(transform).collect())
    }
}

/// Every node has at most one parent, and is not its own descendant, in the scene or not.
fn parents(document: &Document) -> Result<Vec<Option<usize>>, GltfFault> {
    let mut parent = vec![None; document.nodes.len()];
    for (above, node) in document.nodes.iter().enumerate() {
        for (k, &child) in node.children.iter().enumerate() {
            find(&document.nodes, child, || {
                format!("nodes[{above}].children[{k}]")
            })?;
            if parent[child.0].replace(above).is_some() {
                return Err(GltfFault::NodeLoop { node: child.0 });
            }
        }
    }
    Ok(parent)
}

/// All nodes, each after its parent.
fn parents_first(parent: &[Option<usize>]) -> Result<Vec<usize>, GltfFault> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); parent.len()];
    let mut order = Vec::with_capacity(parent.len());
    for (node, &above) in parent.iter().enumerate() {
        match above {
            Some(above) => children[above].push(node),
            None => order.push(node),
        }
    }
    let mut next = 0;
    while let Some(&node) = order.get(next) {
        order.extend_from_slice(&children[node]);
        next += 1;
    }
    if order.len() == parent.len() {
        return Ok(order);
    }
    let mut is_reached = vec![false; parent.len()];
    for node in order {
        is_reached[node] = true;
    }
    let node = is_reached.iter().position(|&r| !r).unwrap_or(0);
    Err(GltfFault::NodeLoop { node })
}

fn matrix(node: &Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(matrix);
    }
    composed(
        node.translation.unwrap_or([0.0; 3]),
        node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
        node.scale.unwrap_or([1.0; 3]),
    )
}

fn composed(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> DMat4 {
    let rotation = DQuat::from_array(rotation);
    // A quaternion of zero length is no rotation at all.
    let length = rotation.length();
    let rotation = if length > 0.0 && length.is_finite() {
        rotation / length
    } else {
        DQuat::IDENTITY
    };
    DMat4::from_translation(DVec3::from(translation))
        * DMat4::from_quat(rotation)
        * DMat4::from_scale(DVec3::from(scale))
}
