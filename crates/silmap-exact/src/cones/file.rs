//! The cone forest's file format.
//!
//! All numbers are little-endian, of four bytes if not said otherwise:
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | [`VERSION`] |
//! | 4 | CRC-32 of all that follows |
//! | 4 + 4 | edges of the mesh; CRC-32 of its vertices and faces |
//! | 4 + 4 | nodes; edges that are tested always |
//! | 4 + 4 a node | in depth-first order: its own edges; its children |
//! | 4 an edge | those of the nodes, in their order, then those tested always |
//!
//! A reader verifies all of it: every edge must be there once and the nodes make trees; cones are not stored but worked out again,
//! which takes a fraction of the time that choosing the nodes took. So whatever a file holds, what is found with it is right.

use thiserror::Error;

use super::forest::{ConeForest, ForestNode};
use crate::EdgeMesh;

/// What a file begins with.
const MAGIC: [u8; 8] = *b"SILMAPCF";
/// Version of the layout.
const VERSION: u32 = 1;

/// Why bytes are no forest of a mesh.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ForestError {
    /// They begin otherwise.
    #[error("this is no cone forest")]
    NotAForest,
    /// They come from another version of the program.
    #[error("the cone forest has version {found}, and only {VERSION} can be read")]
    UnknownVersion {
        /// What they say.
        found: u32,
    },
    /// They belong to another mesh.
    #[error(
        "the cone forest belongs to another mesh, of {found_edges} edges and checksum {found_crc32:08x} instead of {edges} and {crc32:08x}"
    )]
    OtherMesh {
        /// Edges of the mesh it was built for.
        found_edges: u32,
        /// Checksum of that mesh.
        found_crc32: u32,
        /// Edges of this mesh.
        edges: u32,
        /// Checksum of this mesh.
        crc32: u32,
    },
    /// They were cut short or changed.
    #[error("the cone forest is damaged: {what}")]
    Damaged {
        /// What does not fit, and where.
        what: String,
    },
}

fn damaged<T>(what: impl Into<String>) -> Result<T, ForestError> {
    Err(ForestError::Damaged { what: what.into() })
}

impl ConeForest {
    /// The forest as the bytes of a file; the layout is the module's. `mesh` is the one that it was built for.
    #[must_use]
    pub fn to_bytes(&self, mesh: &EdgeMesh) -> Vec<u8> {
        let mut numbers = vec![
            mesh.edges().len() as u32,
            mesh.crc32(),
            self.nodes.len() as u32,
            self.unbounded.len() as u32,
        ];
        for (k, node) in self.nodes.iter().enumerate() {
            numbers.extend([self.edges_of(k).len() as u32, node.child_count]);
        }
        numbers.extend(&self.edges);
        numbers.extend(&self.unbounded);
        let body: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        let mut file = MAGIC.to_vec();
        file.extend(VERSION.to_le_bytes());
        file.extend(crc32fast::hash(&body).to_le_bytes());
        file.extend(body);
        file
    }

    /// Reads what [`Self::to_bytes`] wrote for the same mesh.
    ///
    /// # Errors
    /// When the bytes are something else, of another version or another mesh, or do not fit together.
    pub fn from_bytes(mesh: &EdgeMesh, bytes: &[u8]) -> Result<Self, ForestError> {
        let Some(rest) = bytes.strip_prefix(&MAGIC) else {
            return Err(ForestError::NotAForest);
        };
        let mut head = Reader(rest);
        let found = head.number()?;
        if found != VERSION {
            return Err(ForestError::UnknownVersion { found });
        }
        // A fuzzer is to get past the checksum, to what must hold without it.
        if head.number()? != crc32fast::hash(head.0) && !cfg!(fuzzing) {
            return damaged("its checksum does not fit");
        }
        let mut body = Reader(head.0);
        let (found_edges, found_crc32) = (body.number()?, body.number()?);
        let (edges, crc32) = (mesh.edges().len() as u32, mesh.crc32());
        if (found_edges, found_crc32) != (edges, crc32) {
            return Err(ForestError::OtherMesh {
                found_edges,
                found_crc32,
                edges,
                crc32,
            });
        }
        let (node_count, unbounded_count) = (body.number()? as usize, body.number()? as usize);
        // Before memory is allocated for them.
        if body.0.len() as u64 != 8 * node_count as u64 + 4 * u64::from(edges) {
            return damaged(format!(
                "its counts ({node_count} nodes, {edges} edges) do not fit its length"
            ));
        }
        let mut forest = Self {
            nodes: Vec::with_capacity(node_count),
            edges: Vec::new(),
            unbounded: Vec::new(),
        };
        let mut edges_end: u32 = 0;
        for node in 0..node_count {
            let (own, child_count) = (body.number()?, body.number()?);
            if own > edges - edges_end {
                return damaged(format!("node {node} has {own} edges, more than are left"));
            }
            edges_end += own;
            forest.nodes.push(ForestNode {
                edges_end,
                child_count,
                cones: None,
            });
        }
        if u64::from(edges_end) + unbounded_count as u64 != u64::from(edges) {
            return damaged(format!(
                "its nodes have {edges_end} edges and {unbounded_count} are tested always, of {edges}"
            ));
        }
        let mut is_used = vec![false; edges as usize];
        for place in 0..edges {
            let edge = body.number()?;
            match is_used.get_mut(edge as usize) {
                Some(used) if !*used => *used = true,
                Some(_) => return damaged(format!("it holds edge {edge} twice")),
                None => return damaged(format!("place {place} names edge {edge} of {edges}")),
            }
            if place < edges_end {
                forest.edges.push(edge);
            } else {
                forest.unbounded.push(edge);
            }
        }
        // From the last node on: how many trees there are behind the current one.
        let mut trees: usize = 0;
        for (place, node) in forest.nodes.iter().enumerate().rev() {
            let Some(others) = trees.checked_sub(node.child_count as usize) else {
                let children = node.child_count;
                return damaged(format!(
                    "node {place} has {children} children, more than there are"
                ));
            };
            trees = others + 1;
        }
        forest.find_cones(mesh);
        Ok(forest)
    }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn number(&mut self) -> Result<u32, ForestError> {
        let Some((first, rest)) = self.0.split_first_chunk() else {
            return damaged("it ends too early");
        };
        self.0 = rest;
        Ok(u32::from_le_bytes(*first))
    }
}

#[cfg(test)]
#[path = "file_tests.rs"]
mod tests;
