//! Wavefront OBJ with its materials.
//!
//! The material library is read by `tobj`. The geometry is read here, because that crate forgets on which line and under
//! which number a vertex or face stands, takes `l` with three vertices for a face, and shifts all colours when one vertex
//! has none. Everything that is not a vertex, a texture coordinate, a face or a material is skipped. Vertices and faces
//! count from 1.

use std::path::Path;

use glam::DVec3;

use super::error::{LineFault, MeshFault, excerpt};
use super::mtl::MaterialLibrary;
use super::raw::{MOST_CORNERS, MOST_MATERIALS, PolygonLook, RawMesh};
use super::text::{decode, numbered_lines};

/// One corner of a face line.
struct Corner {
    vertex: u32,
    uv: Option<u32>,
}

/// What has been read so far.
struct Reader<'a> {
    raw: RawMesh,
    colours: Vec<Option<[f32; 3]>>,
    uvs: Vec<[f32; 2]>,
    library: MaterialLibrary<'a>,
    current_material: Option<u16>,
    /// Name, and index in the mesh's materials, of every material used.
    used: Vec<(String, u16)>,
}

/// Reads an OBJ file; `folder` is where its material library and textures lie.
pub(super) fn read(bytes: &[u8], folder: &Path) -> Result<RawMesh, MeshFault> {
    let text = decode(bytes)?;
    let mut reader = Reader {
        raw: RawMesh::counting_from(1),
        colours: Vec::new(),
        uvs: Vec::new(),
        library: MaterialLibrary::new(folder),
        current_material: None,
        used: Vec::new(),
    };
    let mut joined = String::new();
    let mut corners = Vec::new();
    for (number, part) in numbered_lines(&text) {
        // A backslash continues the line on the next one.
        if let Some(part) = part.strip_suffix('\\') {
            joined.push_str(part);
            joined.push(' ');
            continue;
        }
        let whole;
        let line = if joined.is_empty() {
            part
        } else {
            joined.push_str(part);
            whole = std::mem::take(&mut joined);
            whole.trim()
        };
        reader
            .read_line(line, &mut corners)
            .map_err(|fault| MeshFault::at_line(number, fault))?;
    }
    reader.finish()
}

impl Reader<'_> {
    fn read_line(&mut self, line: &str, corners: &mut Vec<Corner>) -> Result<(), LineFault> {
        let (keyword, rest) = line
            .split_once(|c: char| c.is_whitespace())
            .unwrap_or((line, ""));
        match keyword {
            "v" => self.read_vertex(rest),
            "vt" => {
                self.read_uv(rest);
                Ok(())
            }
            "f" => self.read_face(rest, corners),
            "mtllib" => {
                self.library.open(rest.trim(), &mut self.raw);
                Ok(())
            }
            "usemtl" => {
                self.use_material(rest.trim());
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn read_vertex(&mut self, rest: &str) -> Result<(), LineFault> {
        let vertex = self.raw.mesh.positions.len() as u64 + 1;
        let mut numbers = [0.0; 7];
        let mut count = 0;
        for word in rest
            .split('#')
            .next()
            .unwrap_or_default()
            .split_whitespace()
        {
            let (Ok(number), Some(slot)) = (word.parse(), numbers.get_mut(count)) else {
                break;
            };
            *slot = number;
            count += 1;
        }
        if count < 3 {
            return Err(LineFault::Coordinates { vertex });
        }
        let position = DVec3::new(numbers[0], numbers[1], numbers[2]);
        if !position.is_finite() {
            return Err(LineFault::NotFinite { vertex });
        }
        self.raw.mesh.positions.push(position);
        // x y z, x y z w, x y z r g b, or x y z w r g b.
        let colour = match count {
            6 => Some([numbers[3], numbers[4], numbers[5]]),
            7 => Some([numbers[4], numbers[5], numbers[6]]),
            _ => None,
        };
        self.colours.push(
            colour
                .filter(|c| c.iter().all(|x| x.is_finite() && *x >= 0.0))
                .map(|c| c.map(|x| x as f32)),
        );
        Ok(())
    }

    fn read_uv(&mut self, rest: &str) {
        let mut words = rest.split_whitespace().map(|w| w.parse::<f32>().ok());
        let mut next = || {
            words
                .next()
                .flatten()
                .filter(|x| x.is_finite())
                .unwrap_or(0.0)
        };
        let (u, v) = (next(), next());
        self.uvs.push([u, 1.0 - v]);
    }

    fn read_face(&mut self, rest: &str, corners: &mut Vec<Corner>) -> Result<(), LineFault> {
        corners.clear();
        for word in rest
            .split('#')
            .next()
            .unwrap_or_default()
            .split_whitespace()
        {
            corners.push(self.read_corner(word)?);
        }
        if corners.len() < 3 {
            let corners = corners.len();
            return Err(LineFault::TooFewCorners { corners });
        }
        if corners.len() > MOST_CORNERS {
            let (corners, most) = (corners.len(), MOST_CORNERS);
            return Err(LineFault::TooManyCorners { corners, most });
        }
        let vertices: Vec<u32> = corners.iter().map(|c| c.vertex).collect();
        let uvs: Option<Vec<[f32; 2]>> = corners
            .iter()
            .map(|c| c.uv.map(|uv| self.uvs[uv as usize]))
            .collect();
        let look = PolygonLook {
            uvs: uvs.as_deref(),
            colours: None,
            material: self.current_material,
        };
        self.raw.push_polygon(&vertices, look);
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`, each counting from 1, or back from the last one when negative.
    fn read_corner(&self, word: &str) -> Result<Corner, LineFault> {
        let mut parts = word.split('/');
        let token = parts.next().unwrap_or_default();
        let index: i64 = token.parse().map_err(|_| LineFault::NotAnIndex {
            token: excerpt(word),
        })?;
        let count = self.raw.mesh.positions.len();
        if index == 0 {
            return Err(LineFault::IndexZero);
        }
        let vertex = absolute(index, count).ok_or(LineFault::IndexOutOfRange {
            vertex: index,
            count,
        })?;
        // A texture coordinate that does not exist costs the colour, not the face.
        let uv = parts
            .next()
            .and_then(|t| t.parse().ok())
            .and_then(|i| absolute(i, self.uvs.len()));
        Ok(Corner { vertex, uv })
    }

    fn use_material(&mut self, name: &str) {
        if let Some((_, index)) = self.used.iter().find(|(used, _)| used == name) {
            self.current_material = Some(*index);
            return;
        }
        self.current_material = None;
        let Some(material) = self.library.material(name, &mut self.raw) else {
            return;
        };
        let materials = &mut self.raw.mesh.appearance.materials;
        if materials.len() < MOST_MATERIALS {
            let index = materials.len() as u16;
            materials.push(material);
            self.used.push((name.to_owned(), index));
            self.current_material = Some(index);
        }
    }

    fn finish(mut self) -> Result<RawMesh, MeshFault> {
        if self.raw.mesh.faces.is_empty() {
            return Err(if self.raw.mesh.positions.is_empty() {
                MeshFault::NoVertices
            } else {
                MeshFault::NoFaces
            });
        }
        self.raw.spread_vertex_colours(&self.colours);
        Ok(self.raw.finish())
    }
}

/// An index from 0, of one that counts from 1 or back from the end.
fn absolute(index: i64, count: usize) -> Option<u32> {
    let from_zero = if index > 0 {
        index - 1
    } else {
        index.checked_add(i64::try_from(count).ok()?)?
    };
    u32::try_from(from_zero)
        .ok()
        .filter(|&i| index != 0 && (i as usize) < count)
}
