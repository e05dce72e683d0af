//! Wavefront OBJ with its materials.
//!
//! Read here, because `tobj` forgets on which line and under which number a vertex or face stands, takes `l` with three
//! vertices for a face, and shifts all colours when one vertex has none. Everything that is not a vertex, a texture
//! coordinate, a face or a material is skipped. Vertices and faces count from 1.
//!
//! Numbers after the three coordinates are not in the standard. One is a weight, three are a colour; four are either weight
//! and colour, or colour and opacity: they are a weight first where that one is 1 at every vertex.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;

use super::content::POINTS;
use super::error::{LineFault, MeshFault, excerpt};
use super::mtl::{MaterialLibrary, Placement};
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
    /// What stands behind the coordinates, at most five numbers.
    extras: Vec<Extra>,
    uvs: Vec<[f32; 2]>,
    library: MaterialLibrary<'a>,
    current: Option<(u16, Placement)>,
    /// Index in the mesh's materials and placement of the texture of every material used, by its name.
    used: BTreeMap<String, (u16, Placement)>,
}

/// The numbers behind a vertex's coordinates.
#[derive(Clone, Copy, Debug, Default)]
struct Extra {
    numbers: [f32; 5],
    count: u8,
}

/// Reads an OBJ file; `folder` is where its material library and textures lie.
pub(super) fn read(bytes: &[u8], folder: &Path) -> Result<RawMesh, MeshFault> {
    let text = decode(bytes)?;
    let mut reader = Reader {
        raw: RawMesh::counting_from(1),
        extras: Vec::new(),
        uvs: Vec::new(),
        library: MaterialLibrary::new(folder),
        current: None,
        used: BTreeMap::new(),
    };
    // Some writers name the library after its first use.
    for (_, line) in numbered_lines(&text) {
        if let Some((keyword, names)) = line.split_once(|c: char| c.is_whitespace())
            && keyword == "mtllib"
        {
            reader.library.open(names, &mut reader.raw);
        }
    }
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
            "usemtl" => {
                self.use_material(rest.trim());
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn read_vertex(&mut self, rest: &str) -> Result<(), LineFault> {
        let vertex = self.raw.mesh.positions.len() as u64 + 1;
        let mut numbers = [0.0_f64; 8];
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
            if count <= 3 {
                self.raw.note_digits(word);
            }
        }
        if count < 3 {
            return Err(LineFault::Coordinates { vertex });
        }
        let position = DVec3::new(numbers[0], numbers[1], numbers[2]);
        if !position.is_finite() {
            return Err(LineFault::NotFinite { vertex });
        }
        self.raw.mesh.positions.push(position);
        let mut extra = Extra {
            count: (count - 3) as u8,
            ..Extra::default()
        };
        for (slot, number) in extra.numbers.iter_mut().zip(&numbers[3..]) {
            *slot = *number as f32;
        }
        self.extras.push(extra);
        Ok(())
    }

    /// The colour of every vertex, of those that have one.
    fn colours(&self) -> Vec<Option<[f32; 3]>> {
        let of_four = || self.extras.iter().filter(|e| e.count == 4);
        let weight_is_first = of_four().all(|e| e.numbers[0] == 1.0);
        let colour = |extra: &Extra| {
            let [a, b, c, d, _] = extra.numbers;
            let colour = match extra.count {
                3 => [a, b, c],
                4 if weight_is_first => [b, c, d],
                4 => [a, b, c],
                5 => [b, c, d],
                _ => return None,
            };
            colour
                .iter()
                .all(|x| x.is_finite() && *x >= 0.0)
                .then_some(colour)
        };
        self.extras.iter().map(colour).collect()
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
        let placement = self.current.map(|(_, p)| p).unwrap_or_default();
        let uvs: Option<Vec<[f32; 2]>> = corners
            .iter()
            .map(|c| c.uv.map(|uv| placement.apply(self.uvs[uv as usize])))
            .collect();
        let look = PolygonLook {
            uvs: uvs.as_deref(),
            colours: None,
            material: self.current.map(|(index, _)| index),
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
        if let Some(&known) = self.used.get(name) {
            self.current = Some(known);
            return;
        }
        self.current = None;
        let Some(painted) = self.library.material(name, &mut self.raw) else {
            return;
        };
        let materials = &mut self.raw.mesh.appearance.materials;
        if materials.len() < MOST_MATERIALS {
            let index = materials.len() as u16;
            materials.push(painted.material);
            let known = (index, painted.placement);
            self.used.insert(name.to_owned(), known);
            self.current = Some(known);
        }
    }

    fn finish(mut self) -> Result<RawMesh, MeshFault> {
        if self.raw.mesh.faces.is_empty() {
            return Err(if self.raw.mesh.positions.is_empty() {
                MeshFault::NoVertices
            } else {
                MeshFault::PointsOnly {
                    vertices: self.raw.mesh.positions.len(),
                    way_out: POINTS,
                }
            });
        }
        let colours = self.colours();
        self.raw.spread_vertex_colours(&colours);
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
