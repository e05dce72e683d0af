//! PLY, ASCII and binary of either byte order.
//!
//! Binary elements are read one by one with `ply-rs-bw`, so that the one at which a file ends is known. ASCII numbers are
//! read here: that crate's grammar refuses `.5`, `1.` and `nan`. Vertices count from 0, faces from 1. Of the elements,
//! `vertex`, `face` and `tristrips` are taken, and of their properties colours of vertices, faces and corners, texture
//! coordinates of vertices and corners, and the number of a face's texture, by all names that tools write. A file may colour
//! its faces and, all alike, its vertices: then those of the faces count.
//!
//! A triangle strip goes on with every vertex, each triangle turned against the one before; −1 begins another one.

mod colours;
mod elements;
mod header;

use std::path::Path;

use glam::DVec3;
use ply_rs_bw::ply::{ElementDef, Encoding, PropertyDef, PropertyType};
use silmap_geometry::Material;
use silmap_geometry::defects::repeated_corner;

use super::content::POINTS;
use super::error::{HeaderFault, MeshFault};
use super::mtl::read_image;
use super::raw::{MOST_CORNERS, MOST_MATERIALS, PolygonLook, RawMesh};
use super::text::find_file;
use colours::{ColourKind, Painter};
use elements::{CORNERS, REDS, Record, STRIPS, TEXTURE_US, read_ascii, read_binary};
use header::{Header, read_header};

pub(super) fn read(bytes: &[u8], folder: &Path) -> Result<RawMesh, MeshFault> {
    if bytes.is_empty() {
        return Err(MeshFault::Empty);
    }
    let header = read_header(bytes)?;
    check_elements(&header)?;
    let mut builder = Builder::new(&header);
    if header.encoding == Encoding::Ascii {
        read_ascii(bytes, &header, &mut builder)?;
    } else {
        read_binary(bytes, &header, &mut builder)?;
    }
    builder.finish(&header, folder)
}

fn check_elements(header: &Header) -> Result<(), MeshFault> {
    let find = |name: &'static str| {
        header
            .elements
            .iter()
            .find(|e| e.name == name)
            .ok_or(MeshFault::Header(HeaderFault::NoElement { name }))
    };
    let vertex = find("vertex")?;
    for property in ["x", "y", "z"] {
        let kind = vertex.properties.get(property).map(|p| &p.data_type);
        if !matches!(kind, Some(PropertyType::Scalar(_))) {
            let element = "vertex";
            return Err(MeshFault::Header(HeaderFault::NoProperty {
                element,
                property,
            }));
        }
    }
    if vertex.count == 0 {
        return Err(MeshFault::NoVertices);
    }
    let kinds = ["face", STRIPS].map(|name| header.elements.iter().find(|e| e.name == name));
    // A cloud of points has no lists; another list may be faces under a name that is not known here.
    let is_list = |p: &PropertyDef| matches!(p.data_type, PropertyType::List(..));
    let has_lists = |e: &ElementDef| e.properties.values().any(is_list);
    if kinds == [None, None] && header.elements.iter().any(has_lists) {
        return Err(MeshFault::Header(HeaderFault::NoElement { name: "face" }));
    }
    for element in kinds.into_iter().flatten().filter(|e| e.count > 0) {
        let has_corners = CORNERS.iter().any(|name| {
            let kind = element.properties.get(*name).map(|p| &p.data_type);
            matches!(kind, Some(PropertyType::List(..)))
        });
        if !has_corners {
            return Err(MeshFault::Header(HeaderFault::NoProperty {
                element: if element.name == STRIPS {
                    STRIPS
                } else {
                    "face"
                },
                property: "vertex_indices",
            }));
        }
    }
    Ok(())
}

/// What helps where a file has no faces.
fn way_to_faces(header: &Header) -> &'static str {
    if header.is_from_vtk {
        "VTK leaves triangle strips out of this format, so pass the mesh through vtkTriangleFilter first; if it is points alone, reconstruct \
         a surface"
    } else {
        POINTS
    }
}

/// Takes elements in file order and makes a mesh of them. Faces that come before the vertices are kept until then.
struct Builder {
    raw: RawMesh,
    /// sRGB, as they stand in the file.
    colours: Vec<[f64; 3]>,
    uvs: Vec<[f32; 2]>,
    faces: Vec<Record>,
    strips: Vec<Record>,
    /// The largest value of colours of vertices, faces and corners, where there are some.
    colour_kinds: [Option<ColourKind>; 3],
    has_uvs: bool,
    has_corner_uvs: bool,
}

impl Builder {
    fn new(header: &Header) -> Self {
        let kind_of = |element: &str, names: &[&str]| {
            let element = header.elements.iter().find(|e| e.name == element)?;
            names.iter().find_map(|n| element.properties.get(*n))
        };
        let colour_kind = |element: &str, names: &[&str]| {
            kind_of(element, names).map(|p| ColourKind::of(&p.data_type))
        };
        let has_texture = !header.textures.is_empty();
        Self {
            raw: RawMesh::counting_from(0),
            colours: Vec::new(),
            uvs: Vec::new(),
            faces: Vec::new(),
            strips: Vec::new(),
            colour_kinds: [
                colour_kind("vertex", &REDS),
                colour_kind("face", &REDS),
                colour_kind("face", &["color", "wedge_color"]),
            ],
            has_uvs: has_texture && kind_of("vertex", &TEXTURE_US).is_some(),
            has_corner_uvs: has_texture && kind_of("face", &["texcoord", "texcoords"]).is_some(),
        }
    }

    fn take(&mut self, element: &ElementDef, record: Record) -> Result<(), MeshFault> {
        match element.name.as_str() {
            "vertex" => {
                let position = DVec3::from(record.position);
                if !position.is_finite() {
                    let vertex = self.raw.mesh.positions.len() as u64;
                    return Err(MeshFault::NotFinite { vertex });
                }
                self.raw.mesh.positions.push(position);
                if self.colour_kinds[0].is_some() {
                    self.colours.push(record.colour);
                }
                if self.has_uvs {
                    self.uvs.push(top_left_uv(record.uv));
                }
            }
            "face" => self.faces.push(record),
            STRIPS => self.strips.push(record),
            _ => {}
        }
        Ok(())
    }

    /// The textures as materials; where one cannot be read, it is a plain one.
    fn read_textures(&mut self, header: &Header, folder: &Path) -> usize {
        let mut are_read = false;
        let textures = header.textures.iter().take(MOST_MATERIALS);
        let materials: Vec<Material> = textures
            .map(|name| {
                let path = find_file(folder, name).unwrap_or_else(|| folder.join(name));
                let texture = read_image(&path)
                    .map_err(|reason| {
                        self.raw
                            .ignore(format!("texture `{name}` cannot be read: {reason}"));
                    })
                    .ok();
                are_read |= texture.is_some();
                Material {
                    base_colour: [1.0; 3],
                    texture,
                    ..Material::default()
                }
            })
            .collect();
        if !are_read {
            return 0;
        }
        self.raw.mesh.appearance.materials = materials;
        self.raw.mesh.appearance.materials.len()
    }

    fn finish(mut self, header: &Header, folder: &Path) -> Result<RawMesh, MeshFault> {
        let count = self.raw.mesh.positions.len();
        if u32::try_from(count).is_err() {
            return Err(MeshFault::TooLarge);
        }
        let texture_count = self.read_textures(header, folder);
        let painter = Painter::new(&self);
        let mut vertices = Vec::new();
        let faces = std::mem::take(&mut self.faces);
        for (face, record) in (1..).zip(&faces) {
            let corners = record.corners.len();
            if corners < 3 {
                return Err(MeshFault::TooFewCorners { face, corners });
            }
            if corners > MOST_CORNERS {
                let most = MOST_CORNERS;
                return Err(MeshFault::TooManyCorners {
                    face,
                    corners,
                    most,
                });
            }
            vertices.clear();
            for &vertex in &record.corners {
                vertices.push(checked(face, vertex, count)?);
            }
            let uvs = self.face_uvs(record, &vertices);
            let colours = painter.colours(record, &vertices);
            let texture = record.texture.max(0.0) as usize;
            let look = PolygonLook {
                uvs: uvs.as_deref(),
                colours: colours.as_deref(),
                material: (texture < texture_count).then_some(texture as u16),
            };
            self.raw.push_polygon(&vertices, look);
        }
        let strips = std::mem::take(&mut self.strips);
        for (strip, record) in (1..).zip(&strips) {
            for piece in record.corners.split(|&v| v == RESTART) {
                for (at, corners) in piece.windows(3).enumerate() {
                    let mut triangle = [0; 3];
                    for (slot, &vertex) in triangle.iter_mut().zip(corners) {
                        *slot = checked(strip, vertex, count)?;
                    }
                    // A strip turns a corner by naming a vertex twice.
                    if repeated_corner(&triangle).is_some() {
                        continue;
                    }
                    if at % 2 == 1 {
                        triangle.swap(0, 1);
                    }
                    let uvs = self.face_uvs(record, &triangle);
                    let colours = painter.colours(record, &triangle);
                    let look = PolygonLook {
                        uvs: uvs.as_deref(),
                        colours: colours.as_deref(),
                        material: (texture_count > 0).then_some(0),
                    };
                    self.raw.push_polygon(&triangle, look);
                }
            }
        }
        if self.raw.mesh.faces.is_empty() {
            return Err(if faces.is_empty() && strips.is_empty() {
                let way_out = way_to_faces(header);
                MeshFault::PointsOnly {
                    vertices: count,
                    way_out,
                }
            } else {
                MeshFault::NoFaces
            });
        }
        Ok(self.raw.finish())
    }

    fn face_uvs(&self, record: &Record, vertices: &[u32]) -> Option<Vec<[f32; 2]>> {
        if self.has_corner_uvs && record.corner_uvs.len() == 2 * vertices.len() {
            let pairs = record.corner_uvs.chunks_exact(2);
            return Some(pairs.map(|uv| top_left_uv([uv[0], uv[1]])).collect());
        }
        self.has_uvs
            .then(|| vertices.iter().map(|&v| self.uvs[v as usize]).collect())
    }
}

/// Ends a strip; the next vertex begins another one.
const RESTART: i64 = -1;

/// A vertex that exists.
fn checked(face: u64, vertex: i64, count: usize) -> Result<u32, MeshFault> {
    u32::try_from(vertex)
        .ok()
        .filter(|&v| (v as usize) < count)
        .ok_or(MeshFault::IndexOutOfRange {
            face,
            vertex,
            count,
        })
}

/// Texture coordinates as they are used here: v down, finite.
fn top_left_uv([u, v]: [f64; 2]) -> [f32; 2] {
    [u as f32, (1.0 - v) as f32].map(|x| if x.is_finite() { x } else { 0.0 })
}
