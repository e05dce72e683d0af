//! PLY, ASCII and binary of either byte order.
//!
//! Binary elements are read one by one with `ply-rs-bw`, so that the one at which a file ends is known. ASCII numbers are
//! read here: that crate's grammar refuses `.5`, `1.` and `nan`. Vertices count from 0, faces from 1. Of the elements,
//! `vertex`, `face` and `tristrips` are taken, and of their properties colours of vertices, faces and corners, texture
//! coordinates of vertices and corners, and the number of a face's texture, by all names that tools write. A file may colour
//! its faces and, all alike, its vertices: then those of the faces count.
//!
//! A triangle strip goes on with every vertex, each triangle turned against the one before; −1 begins another one.

use std::path::Path;

use glam::DVec3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyDef,
    PropertyType, ScalarType,
};
use silmap_geometry::Material;
use silmap_geometry::defects::repeated_corner;
use silmap_geometry::lighting::linear_from_srgb;

use super::content::POINTS;
use super::error::{HeaderFault, LineFault, MeshFault, excerpt};
use super::mtl::read_image;
use super::ply_header::{Header, read_header};
use super::raw::{MOST_CORNERS, MOST_MATERIALS, PolygonLook, RawMesh};
use super::text::{find_file, numbered_lines};

const FACE_FORM: &str = "n i j k …";

/// The element of triangle strips.
const STRIPS: &str = "tristrips";

/// Names of the list of a face's vertices.
const CORNERS: [&str; 4] = [
    "vertex_indices",
    "vertex_index",
    "vertex_indexes",
    "vertices",
];

const REDS: [&str; 5] = ["red", "r", "diffuse_red", "ambient_red", "diffuse_r"];

const TEXTURE_US: [&str; 5] = ["s", "u", "texture_u", "texture_s", "s0"];

/// One element, of whichever kind: what is of use in it.
#[derive(Debug)]
struct Record {
    position: [f64; 3],
    colour: [f64; 3],
    uv: [f64; 2],
    corners: Vec<i64>,
    corner_uvs: Vec<f64>,
    corner_colours: Vec<f64>,
    texture: f64,
}

impl PropertyAccess for Record {
    fn new() -> Self {
        Self {
            position: [f64::NAN; 3],
            colour: [f64::NAN; 3],
            uv: [f64::NAN; 2],
            corners: Vec::new(),
            corner_uvs: Vec::new(),
            corner_colours: Vec::new(),
            texture: 0.0,
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            _ if CORNERS.contains(&name) => self.corners = integers(property),
            "texcoord" | "texcoords" => self.corner_uvs = numbers(property),
            "color" | "wedge_color" => self.corner_colours = numbers(property),
            _ => match (self.slot(name), numbers(property).first()) {
                (Some(slot), Some(&value)) => *slot = value,
                _ => return PropertyAccessResult::Ignored,
            },
        }
        PropertyAccessResult::Set
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set_double(name, f64::from(value))
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        match self.slot(name) {
            Some(slot) => {
                *slot = value;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::Ignored,
        }
    }
}

impl Record {
    fn slot(&mut self, name: &str) -> Option<&mut f64> {
        Some(match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            _ if REDS.contains(&name) => &mut self.colour[0],
            "green" | "g" | "diffuse_green" | "ambient_green" | "diffuse_g" => &mut self.colour[1],
            "blue" | "b" | "diffuse_blue" | "ambient_blue" | "diffuse_b" => &mut self.colour[2],
            _ if TEXTURE_US.contains(&name) => &mut self.uv[0],
            "t" | "v" | "texture_v" | "texture_t" | "t0" => &mut self.uv[1],
            "texnumber" | "texture_id" | "texid" => &mut self.texture,
            _ => return None,
        })
    }
}

/// The values of a property, in order.
fn numbers(property: Property) -> Vec<f64> {
    fn all<T: Into<f64>>(list: Vec<T>) -> Vec<f64> {
        list.into_iter().map(Into::into).collect()
    }
    match property {
        Property::Char(v) => vec![v.into()],
        Property::UChar(v) => vec![v.into()],
        Property::Short(v) => vec![v.into()],
        Property::UShort(v) => vec![v.into()],
        Property::Int(v) => vec![v.into()],
        Property::UInt(v) => vec![v.into()],
        Property::Float(v) => vec![v.into()],
        Property::Double(v) => vec![v],
        Property::ListChar(v) => all(v),
        Property::ListUChar(v) => all(v),
        Property::ListShort(v) => all(v),
        Property::ListUShort(v) => all(v),
        Property::ListInt(v) => all(v),
        Property::ListUInt(v) => all(v),
        Property::ListFloat(v) => all(v),
        Property::ListDouble(v) => v,
    }
}

/// Vertex numbers; one that is no whole number becomes −1, which no vertex has.
fn integers(property: Property) -> Vec<i64> {
    numbers(property)
        .into_iter()
        .map(|x| if x.fract() == 0.0 { x as i64 } else { -1 })
        .collect()
}

/// Reads a PLY file; `folder` is where its texture lies.
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

/// How colours are stored.
#[derive(Clone, Copy, Debug)]
enum ColourKind {
    /// To this value.
    To(f64),
    /// To 1, or to 255 where one of them is larger than 1.
    Real,
}

impl ColourKind {
    fn of(kind: &PropertyType) -> Self {
        match kind {
            PropertyType::Scalar(scalar) | PropertyType::List(_, scalar) => match scalar {
                ScalarType::Float | ScalarType::Double => Self::Real,
                ScalarType::UShort | ScalarType::Short => Self::To(65_535.0),
                _ => Self::To(255.0),
            },
        }
    }

    fn largest<'a>(self, mut all: impl Iterator<Item = &'a f64>) -> f64 {
        match self {
            Self::To(largest) => largest,
            Self::Real if all.any(|&c| c > 1.0) => 255.0,
            Self::Real => 1.0,
        }
    }
}

/// Linear colours of values that reach to `largest`; white where they are not numbers.
fn linear(colour: [f64; 3], largest: f64) -> [f32; 3] {
    let linear = colour.map(|c| linear_from_srgb((c / largest).clamp(0.0, 1.0) as f32));
    if linear.iter().all(|c| c.is_finite()) {
        linear
    } else {
        [1.0; 3]
    }
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

/// Which colours count, and what they are.
enum Painter {
    Plain,
    /// Linear.
    Vertices(Vec<[f32; 3]>),
    /// By the largest value.
    Faces(f64),
    Corners(f64),
}

impl Painter {
    fn new(builder: &Builder) -> Self {
        let [vertex, face, corner] = builder.colour_kinds;
        let are_alike = builder.colours.windows(2).all(|pair| pair[0] == pair[1]);
        if let Some(kind) = corner {
            let all = builder.faces.iter().flat_map(|f| &f.corner_colours);
            return Self::Corners(kind.largest(all));
        }
        match (vertex, face) {
            (Some(kind), None) => Self::vertices(kind, &builder.colours),
            (Some(kind), Some(_)) if !are_alike => Self::vertices(kind, &builder.colours),
            (_, Some(kind)) => {
                let all = builder.faces.iter().flat_map(|f| &f.colour);
                Self::Faces(kind.largest(all))
            }
            (None, None) => Self::Plain,
        }
    }

    fn vertices(kind: ColourKind, colours: &[[f64; 3]]) -> Self {
        let largest = kind.largest(colours.as_flattened().iter());
        Self::Vertices(colours.iter().map(|&c| linear(c, largest)).collect())
    }

    /// Linear colours of a face's corners.
    fn colours(&self, record: &Record, vertices: &[u32]) -> Option<Vec<[f32; 3]>> {
        match self {
            Self::Plain => None,
            Self::Vertices(colours) => {
                Some(vertices.iter().map(|&v| colours[v as usize]).collect())
            }
            Self::Faces(largest) => Some(vec![linear(record.colour, *largest); vertices.len()]),
            Self::Corners(largest) => {
                let values = &record.corner_colours;
                if values.len() == 3 {
                    let whole = [values[0], values[1], values[2]];
                    return Some(vec![linear(whole, *largest); vertices.len()]);
                }
                // Three numbers a corner, or four with the opacity.
                let step = values.len() / vertices.len().max(1);
                if !(3..=4).contains(&step) || values.len() != step * vertices.len() {
                    return Some(vec![[1.0; 3]; vertices.len()]);
                }
                let corners = values.chunks_exact(step);
                Some(
                    corners
                        .map(|c| linear([c[0], c[1], c[2]], *largest))
                        .collect(),
                )
            }
        }
    }
}

/// Texture coordinates as they are used here: v down, finite.
fn top_left_uv([u, v]: [f64; 2]) -> [f32; 2] {
    [u as f32, (1.0 - v) as f32].map(|x| if x.is_finite() { x } else { 0.0 })
}

fn read_binary(bytes: &[u8], header: &Header, builder: &mut Builder) -> Result<(), MeshFault> {
    let mut data = &bytes[header.data_start..];
    let parser = Parser::<Record>::new();
    for element in &header.elements {
        if element.properties.is_empty() {
            continue;
        }
        // Every element takes a byte a property at least.
        if (element.count as u64).saturating_mul(element.properties.len() as u64) > 0
            && data.is_empty()
        {
            return Err(ends_inside(element, 0));
        }
        for number in 0..element.count {
            let record = if header.encoding == Encoding::BinaryBigEndian {
                parser.read_big_endian_element(&mut data, element)
            } else {
                parser.read_little_endian_element(&mut data, element)
            };
            let record = record.map_err(|_| ends_inside(element, number))?;
            builder.take(element, record)?;
        }
    }
    Ok(())
}

fn ends_inside(element: &ElementDef, number: usize) -> MeshFault {
    MeshFault::EndsInside {
        element: element.name.clone(),
        number: number as u64 + 1,
        count: element.count as u64,
    }
}

fn read_ascii(bytes: &[u8], header: &Header, builder: &mut Builder) -> Result<(), MeshFault> {
    let text = String::from_utf8_lossy(&bytes[header.data_start..]);
    let mut lines = numbered_lines(&text).filter(|(_, line)| !line.is_empty());
    for element in &header.elements {
        if element.properties.is_empty() {
            continue;
        }
        for number in 0..element.count {
            let (line_number, line) = lines.next().ok_or_else(|| missing(element, number))?;
            // A strip is long, and may be written on several lines where nothing follows it.
            let is_last = header.elements.last().is_some_and(|e| e.name == STRIPS);
            let is_long = is_last && element.name == STRIPS && element.count == 1;
            let whole;
            let line = if is_long {
                let more: Vec<&str> = std::iter::once(line)
                    .chain(lines.by_ref().map(|(_, line)| line))
                    .collect();
                whole = more.join(" ");
                &whole
            } else {
                line
            };
            let record = read_ascii_element(line, element, number)
                .map_err(|fault| MeshFault::at_line(header.line_count + line_number, fault))?;
            if element.name == "vertex" {
                let names = element.properties.keys();
                for (word, _) in line
                    .split_ascii_whitespace()
                    .zip(names)
                    .filter(|(_, name)| matches!(name.as_str(), "x" | "y" | "z"))
                {
                    builder.raw.note_digits(word);
                }
            }
            builder.take(element, record)?;
        }
    }
    Ok(())
}

fn missing(element: &ElementDef, number: usize) -> MeshFault {
    MeshFault::Missing {
        element: match element.name.as_str() {
            "vertex" => "vertex",
            "face" => "face",
            STRIPS => "strip",
            _ => "element",
        },
        number: number as u64 + 1,
        count: element.count as u64,
    }
}

fn read_ascii_element(
    line: &str,
    element: &ElementDef,
    number: usize,
) -> Result<Record, LineFault> {
    let fault = || match element.name.as_str() {
        "vertex" => LineFault::Coordinates {
            vertex: number as u64,
        },
        "face" => LineFault::FaceLine {
            face: number as u64 + 1,
            form: FACE_FORM,
        },
        _ => LineFault::Expected {
            expected: "numbers",
            found: excerpt(line),
        },
    };
    let mut record = Record::new();
    let mut words = line.split_ascii_whitespace();
    let mut next = || {
        let word = words.next().ok_or_else(fault)?;
        word.parse::<f64>().map_err(|_| fault())
    };
    for (name, property) in &element.properties {
        match property.data_type {
            PropertyType::Scalar(_) => {
                record.set_double(name, next()?);
            }
            PropertyType::List(..) => {
                let count = next()?;
                let mut list = Vec::new();
                // Ends with an error at the end of the line at the latest.
                while (list.len() as f64) < count {
                    list.push(next()?);
                }
                record.set_property(name, Property::ListDouble(list));
            }
        }
    }
    Ok(record)
}
