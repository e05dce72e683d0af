//! The coarse hull as a glTF mesh and back.
//!
//! glTF has one texture coordinate a vertex, so a hull vertex becomes as many glTF vertices as it has texture coordinates.
//! The extension adds which hull vertex each of them is, and P(v); positions are stored once, in the mesh.

use std::collections::HashMap;

use super::packing::{Decoder, Encoder};
use super::{AssetError, Atlas, CoarseHull, TangentFrames};

/// Per face and corner: texture coordinates.
type CornerUvs = Vec<[[f32; 2]; 3]>;

const PART: &str = "hull vertices";

/// The tangent of a vertex that no face uses.
const NO_TANGENT: [f32; 4] = [1.0, 0.0, 0.0, 1.0];

/// The arrays of the glTF mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct HullArrays {
    /// Per glTF vertex: the hull vertex it is.
    pub(super) hull_vertices: Vec<u32>,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    /// Empty without an atlas.
    pub(super) uvs: Vec<[f32; 2]>,
    /// Empty without an atlas of normals.
    pub(super) tangents: Vec<[f32; 4]>,
    /// Three glTF vertices a face.
    pub(super) indices: Vec<u32>,
}

/// Gives every hull vertex with a texture coordinate, and a tangent where the atlas has normals, a vertex of its own, in order of
/// first use; hull vertices that no face uses come last.
pub(super) fn unweld(hull: &CoarseHull, atlas: Option<&Atlas>) -> Result<HullArrays, AssetError> {
    check(hull, atlas)?;
    let has_normals = atlas.is_some_and(|a| a.normals.is_some());
    let corner_uvs = atlas.map_or(&[][..], |a| &a.corner_uvs);
    let frames = TangentFrames::new(hull, if has_normals { corner_uvs } else { &[] });
    let mut arrays = HullArrays::default();
    let mut made: HashMap<(u32, [u32; 2], [u32; 4]), u32> = HashMap::new();
    let mut is_used = vec![false; hull.positions.len()];
    let emit = |arrays: &mut HullArrays, vertex: u32, uv: [f32; 2], tangent: [f32; 4]| {
        let index = arrays.positions.len() as u32;
        arrays.hull_vertices.push(vertex);
        arrays.positions.push(hull.positions[vertex as usize]);
        arrays.normals.push(frames.normals[vertex as usize]);
        if atlas.is_some() {
            arrays.uvs.push(uv);
        }
        if has_normals {
            arrays.tangents.push(tangent);
        }
        index
    };
    for (f, face) in hull.faces.iter().enumerate() {
        for (corner, &vertex) in face.iter().enumerate() {
            let uv = atlas.map_or([0.0; 2], |a| a.corner_uvs[f][corner]);
            let tangent = frames.tangents.get(f).map_or(NO_TANGENT, |t| t[corner]);
            let index = *made
                .entry((vertex, uv.map(f32::to_bits), tangent.map(f32::to_bits)))
                .or_insert_with(|| emit(&mut arrays, vertex, uv, tangent));
            arrays.indices.push(index);
            is_used[vertex as usize] = true;
        }
    }
    for vertex in (0..hull.positions.len()).filter(|&v| !is_used[v]) {
        emit(&mut arrays, vertex as u32, [0.0; 2], NO_TANGENT);
    }
    Ok(arrays)
}

fn check(hull: &CoarseHull, atlas: Option<&Atlas>) -> Result<(), AssetError> {
    if hull.faces.is_empty() {
        return Err(AssetError::Count {
            what: "faces of the hull",
            found: 0,
            expected: 4,
        });
    }
    let vertex_count = hull.positions.len();
    if let Some(&index) = hull
        .faces
        .iter()
        .flatten()
        .find(|&&v| v as usize >= vertex_count)
    {
        return Err(AssetError::NoSuch {
            what: "hull vertex",
            index: index.into(),
            count: vertex_count,
        });
    }
    let points = hull.surface_points.len();
    if points != 0 && points != vertex_count {
        return Err(AssetError::Count {
            what: "surface points",
            found: points,
            expected: vertex_count,
        });
    }
    if let Some(atlas) = atlas
        && atlas.corner_uvs.len() != hull.faces.len()
    {
        return Err(AssetError::Count {
            what: "faces with texture coordinates",
            found: atlas.corner_uvs.len(),
            expected: hull.faces.len(),
        });
    }
    let uvs = atlas.map_or(&[][..], |a| &a.corner_uvs);
    check_finite(hull.positions.as_flattened())?;
    check_finite(hull.surface_points.as_flattened())?;
    check_finite(uvs.as_flattened().as_flattened())
}

fn check_finite(numbers: &[f32]) -> Result<(), AssetError> {
    match numbers.iter().find(|x| !x.is_finite()) {
        None => Ok(()),
        Some(&value) => Err(AssetError::OutOfRange {
            what: "hull coordinate",
            value: value.into(),
            limit: f32::MAX.into(),
        }),
    }
}

/// Which hull vertex each glTF vertex is, and P(v).
pub(super) fn encode(hull: &CoarseHull, arrays: &HullArrays) -> Vec<u8> {
    let mut out = Encoder::default();
    out.count(hull.positions.len());
    for &vertex in &arrays.hull_vertices {
        out.unsigned(vertex.into());
    }
    out.unsigned(u64::from(!hull.surface_points.is_empty()));
    for &x in hull.surface_points.as_flattened() {
        out.single(x);
    }
    out.finish()
}

/// Undoes [`unweld`]: the hull (without its volume ratio) and the texture coordinates of its corners.
pub(super) fn weld(
    bytes: &[u8],
    arrays: &HullArrays,
) -> Result<(CoarseHull, CornerUvs), AssetError> {
    let mut read = Decoder::new(bytes, PART);
    // Each hull vertex is at least one glTF vertex, and that takes at least a byte here.
    let vertex_count = read.count(1)?;
    let mut positions: Vec<Option<[f32; 3]>> = vec![None; vertex_count];
    let mut hull_vertices = Vec::with_capacity(arrays.positions.len());
    for &position in &arrays.positions {
        let vertex = read.index("hull vertex", vertex_count)?;
        let slot = &mut positions[vertex as usize];
        if slot.is_some_and(|p| p.map(f32::to_bits) != position.map(f32::to_bits)) {
            return Err(AssetError::HullContradiction {
                vertex: vertex as usize,
            });
        }
        *slot = Some(position);
        hull_vertices.push(vertex);
    }
    let positions = positions
        .into_iter()
        .enumerate()
        .map(|(vertex, p)| p.ok_or(AssetError::HullContradiction { vertex }))
        .collect::<Result<Vec<_>, _>>()?;
    let mut surface_points = Vec::new();
    if read.index("table of surface points", 2)? == 1 {
        for _ in 0..vertex_count {
            surface_points.push([read.single()?, read.single()?, read.single()?]);
        }
    }
    read.finish()?;

    let mut faces = Vec::with_capacity(arrays.indices.len() / 3);
    let mut corner_uvs = Vec::new();
    for corners in arrays.indices.chunks_exact(3) {
        let corner = |k: usize| -> Result<usize, AssetError> {
            let index = corners[k] as usize;
            if index < hull_vertices.len() {
                return Ok(index);
            }
            Err(AssetError::NoSuch {
                what: "mesh vertex",
                index: index as u64,
                count: hull_vertices.len(),
            })
        };
        let corners = [corner(0)?, corner(1)?, corner(2)?];
        faces.push(corners.map(|c| hull_vertices[c]));
        if !arrays.uvs.is_empty() {
            corner_uvs.push(corners.map(|c| arrays.uvs[c]));
        }
    }
    let hull = CoarseHull {
        positions,
        faces,
        surface_points,
        volume_ratio: 0.0,
    };
    check(&hull, None)?;
    check_finite(corner_uvs.as_flattened().as_flattened())?;
    Ok((hull, corner_uvs))
}
