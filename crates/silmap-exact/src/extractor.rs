//! One interface to all extraction methods.

use std::fmt;

use silmap_geometry::{Interrupted, Watch};

use crate::backface_regions::{FacingRegions, region_hierarchy};
use crate::brute::{Brute, BruteParallel};
use crate::cluster_forest::ClusterForest;
use crate::cones::{AnchoredCones, ConeForest, search_forest};
use crate::dual::{Division, MovingSilhouette};
use crate::edge_hash::EdgeHash;
use crate::edge_mesh::EdgeMesh;
use crate::edge_table::EdgeTable;
use crate::{DirectedEdge, Viewpoint, Work, edge_list};

/// How silhouette edges are found. All methods find the same ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ExtractionMethod {
    /// Every face, then every edge, on one core.
    Brute,
    /// The same on several faces at a time and on all cores.
    BruteParallel,
    /// A list of candidates that front faces toggle.
    List,
    /// The same list as a table with a row for each vertex.
    Hash,
    /// The faces across the edges of front faces.
    Table,
    /// A forest of nodes that are passed over from viewpoints in their anchored cones.
    Cones,
    /// A hierarchy of clusters bounded by half-spaces.
    Jc,
    /// What changed since the last viewpoint, by an octree of the faces' planes as points of dual space.
    Dual,
    /// The same by a balanced-aspect-ratio tree.
    DualBar,
}

impl ExtractionMethod {
    /// Every method.
    pub const ALL: &[Self] = &[
        Self::Brute,
        Self::BruteParallel,
        Self::List,
        Self::Hash,
        Self::Table,
        Self::Cones,
        Self::Jc,
        Self::Dual,
        Self::DualBar,
    ];

    /// The name that commands and reports use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Brute => "brute",
            Self::BruteParallel => "brute-parallel",
            Self::List => "list",
            Self::Hash => "hash",
            Self::Table => "table",
            Self::Cones => "cones",
            Self::Jc => "jc",
            Self::Dual => "dual",
            Self::DualBar => "dual-bar",
        }
    }
}

impl fmt::Display for ExtractionMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A method with the data it precomputed for a mesh, and its buffers.
#[derive(Clone, Debug)]
pub struct Extractor<'m> {
    mesh: &'m EdgeMesh,
    data: MethodData,
}

#[derive(Clone, Debug)]
enum MethodData {
    Brute(Brute),
    BruteParallel(BruteParallel),
    List,
    Hash(EdgeHash),
    Table(EdgeTable),
    Cones(ClusterForest<AnchoredCones>),
    Jc(ClusterForest<FacingRegions>),
    Dual(Box<MovingSilhouette>),
}

impl From<MovingSilhouette> for MethodData {
    fn from(silhouette: MovingSilhouette) -> Self {
        Self::Dual(Box::new(silhouette))
    }
}

impl<'m> Extractor<'m> {
    /// Precomputes what `method` needs.
    #[must_use]
    pub fn new(mesh: &'m EdgeMesh, method: ExtractionMethod) -> Self {
        let made = Self::watched(mesh, method, &Watch::silent());
        made.unwrap_or_else(|Interrupted| unreachable!("nobody stops it"))
    }

    /// As [`Self::new`]; with a watch over what takes long, the forest of [`ExtractionMethod::Cones`].
    ///
    /// # Errors
    /// When the caller asks to stop.
    pub fn watched(
        mesh: &'m EdgeMesh,
        method: ExtractionMethod,
        watch: &Watch<'_>,
    ) -> Result<Self, Interrupted> {
        let data = match method {
            ExtractionMethod::Brute => MethodData::Brute(Brute::default()),
            ExtractionMethod::BruteParallel => MethodData::BruteParallel(BruteParallel::new(mesh)),
            ExtractionMethod::List => MethodData::List,
            ExtractionMethod::Hash => MethodData::Hash(EdgeHash::new(mesh)),
            ExtractionMethod::Table => MethodData::Table(EdgeTable::new(mesh)),
            ExtractionMethod::Cones => {
                let forest = ConeForest::watched(mesh, watch)?;
                return Ok(Self::with_forest(mesh, &forest));
            }
            ExtractionMethod::Jc => MethodData::Jc(region_hierarchy(mesh)),
            ExtractionMethod::Dual => MovingSilhouette::new(mesh, Division::Octree).into(),
            ExtractionMethod::DualBar => MovingSilhouette::new(mesh, Division::Bar).into(),
        };
        Ok(Self { mesh, data })
    }

    /// Finds edges by [`ExtractionMethod::Cones`] with a forest that was built or read for `mesh`; with one for another mesh what is found
    /// means nothing.
    ///
    /// # Panics
    /// When the forest is of another mesh with more edges.
    #[must_use]
    pub fn with_forest(mesh: &'m EdgeMesh, forest: &ConeForest) -> Self {
        Self {
            mesh,
            data: MethodData::Cones(search_forest(mesh, forest)),
        }
    }

    /// Puts the silhouette edges for `viewpoint` into `out`, which is cleared before, in an order that depends on the
    /// method.
    pub fn extract(&mut self, viewpoint: &Viewpoint, out: &mut Vec<DirectedEdge>) -> Work {
        out.clear();
        let mesh = self.mesh;
        match &mut self.data {
            MethodData::Brute(brute) => brute.extract(mesh, viewpoint, out),
            MethodData::BruteParallel(brute) => brute.extract(mesh, viewpoint, out),
            MethodData::List => edge_list::extract(mesh, viewpoint, out),
            MethodData::Hash(hash) => hash.extract(mesh, viewpoint, out),
            MethodData::Table(table) => table.extract(mesh, viewpoint, out),
            MethodData::Cones(forest) => forest.extract(mesh, viewpoint, out),
            MethodData::Jc(forest) => forest.extract(mesh, viewpoint, out),
            MethodData::Dual(moving) => moving.extract(mesh, viewpoint, out),
        }
    }

    /// Discards earlier viewpoints: the next extraction starts afresh, where a method would otherwise go on from the last.
    pub fn forget(&mut self) {
        if let MethodData::Dual(moving) = &mut self.data {
            moving.forget();
        }
    }

    /// Bytes of what the method keeps about the mesh: planes and edges where it uses them, and its own structure.
    #[must_use]
    pub fn data_bytes(&self) -> usize {
        let (planes, faces) = (
            size_of_val(self.mesh.planes()),
            size_of_val(self.mesh.faces()),
        );
        match &self.data {
            MethodData::Brute(_) => self.mesh.brute_bytes(),
            MethodData::BruteParallel(brute) => brute.bytes() + self.mesh.brute_bytes(),
            MethodData::List => planes + faces,
            MethodData::Hash(hash) => planes + faces + hash.bytes(),
            MethodData::Table(table) => planes + faces + table.bytes(),
            MethodData::Cones(forest) => forest.bytes(),
            MethodData::Jc(forest) => forest.bytes(),
            MethodData::Dual(moving) => self.mesh.brute_bytes() + moving.bytes(),
        }
    }
}
