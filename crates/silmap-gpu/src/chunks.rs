//! Splitting a mesh into chunks that fit the device's buffers.

/// A piece of a mesh with its own small numbering of vertices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshChunk {
    /// The mesh's vertices that the piece uses, in the order of first use.
    pub vertices: Vec<u32>,
    /// Its faces, as positions in `vertices`.
    pub faces: Vec<[u32; 3]>,
}

/// Cuts `faces` (over `vertex_count` vertices) into consecutive pieces of at most `max_vertices` vertices and `max_faces`
/// faces each; together they are all faces in their order.
///
/// # Panics
/// When `max_vertices` is under 3, `max_faces` is 0, or a face names a vertex that does not exist.
#[must_use]
pub fn split_faces(
    faces: &[[u32; 3]],
    vertex_count: usize,
    max_vertices: usize,
    max_faces: usize,
) -> Vec<MeshChunk> {
    assert!(
        max_vertices >= 3 && max_faces >= 1,
        "a piece holds at least one face"
    );
    const UNSEEN: u32 = u32::MAX;
    let mut local = vec![UNSEEN; vertex_count];
    let mut chunks = Vec::new();
    let mut chunk = MeshChunk::default();
    for face in faces {
        if chunk.vertices.len() + 3 > max_vertices || chunk.faces.len() == max_faces {
            for &v in &chunk.vertices {
                local[v as usize] = UNSEEN;
            }
            chunks.push(std::mem::take(&mut chunk));
        }
        chunk.faces.push(face.map(|v| {
            let slot = &mut local[v as usize];
            if *slot == UNSEEN {
                *slot = chunk.vertices.len() as u32;
                chunk.vertices.push(v);
            }
            *slot
        }));
    }
    if !chunk.faces.is_empty() {
        chunks.push(chunk);
    }
    chunks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of `count` faces over `count + 2` vertices.
    fn strip(count: u32) -> Vec<[u32; 3]> {
        (0..count).map(|i| [i, i + 1, i + 2]).collect()
    }

    #[test]
    fn pieces_add_up_to_the_mesh_and_keep_the_limits() {
        let faces = strip(100);
        for (max_vertices, max_faces) in [(3, 50), (7, 100), (1000, 9), (1000, 1000)] {
            let chunks = split_faces(&faces, 102, max_vertices, max_faces);
            let back: Vec<[u32; 3]> = chunks
                .iter()
                .flat_map(|c| c.faces.iter().map(|f| f.map(|v| c.vertices[v as usize])))
                .collect();
            assert_eq!(back, faces);
            for c in &chunks {
                assert!(c.vertices.len() <= max_vertices && c.faces.len() <= max_faces);
                let mut once = c.vertices.clone();
                once.sort_unstable();
                once.dedup();
                assert_eq!(once.len(), c.vertices.len(), "a vertex is stored twice");
            }
        }
    }

    #[test]
    fn a_mesh_that_fits_stays_whole_and_nothing_stays_nothing() {
        assert_eq!(split_faces(&strip(10), 12, 1000, 1000).len(), 1);
        assert_eq!(split_faces(&[], 12, 1000, 1000), Vec::new());
    }
}
