//! PLY, ASCII and binary of either byte order.
//!
//! Binary elements are read one by one with `ply-rs-bw`, so that the one at which a file ends is known. ASCII numbers are
//! read here: that crate's grammar refuses `.5`, `1.` and `nan`. Vertices count from 0, faces from 1. Elements other than `vertex` and
//! `face` are skipped; vertex colours and texture coordinates are taken where there are some.

use std::path::Path;

use glam::DVec3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};
use silmap_geometry::Material;
use silmap_geometry::lighting::linear_from_srgb;

use super::error::{HeaderFault, LineFault, MeshFault, excerpt};
use super::mtl::decode_image;
use super::ply_header::{Header, read_header};
use super::raw::{MOST_CORNERS, PolygonLook, RawMesh};
use super::text::numbered_lines;

const FACE_FORM: &str = "n i j k …";

/// One element, of whichever kind: what is of use in it.
#[derive(Debug)]
struct Record {
    position: [f64; 3],
    colour: [f64; 3],
    uv: [f64; 2],
    corners: Vec<i64>,
    corner_uvs: Vec<f64>,
}

impl PropertyAccess for Record {
    fn new() -> Self {
        Self {
            position: [f64::NAN; 3],
            colour: [f64::NAN; 3],
            uv: [f64::NAN; 2],
            corners: Vec::new(),
            corner_uvs: Vec::new(),
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            "vertex_indices" | "vertex_index" => self.corners = integers(property),
            "texcoord" => self.corner_uvs = numbers(property),
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
            "red" | "r" | "diffuse_red" => &mut self.colour[0],
            "green" | "g" | "diffuse_green" => &mut self.colour[1],
            "blue" | "b" | "diffuse_blue" => &mut self.colour[2],
            "s" | "u" | "texture_u" | "texture_s" => &mut self.uv[0],
            "t" | "v" | "texture_v" | "texture_t" => &mut self.uv[1],
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
    let face = find("face")?;
    let has_corners = ["vertex_indices", "vertex_index"].iter().any(|name| {
        let kind = face.properties.get(*name).map(|p| &p.data_type);
        matches!(kind, Some(PropertyType::List(..)))
    });
    if !has_corners {
        return Err(MeshFault::Header(HeaderFault::NoProperty {
            element: "face",
            property: "vertex_indices",
        }));
    }
    if face.count == 0 {
        return Err(MeshFault::NoFaces);
    }
    Ok(())
}

/// Takes elements in file order and makes a mesh of them. Faces that come before the vertices are kept until then.
struct Builder {
    raw: RawMesh,
    colours: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    faces: Vec<Record>,
    colour_scale: Option<f64>,
    has_uvs: bool,
    has_corner_uvs: bool,
}

impl Builder {
    fn new(header: &Header) -> Self {
        let kind_of = |element: &str, names: &[&str]| {
            let element = header.elements.iter().find(|e| e.name == element)?;
            names.iter().find_map(|n| element.properties.get(*n))
        };
        let colour_scale =
            kind_of("vertex", &["red", "r", "diffuse_red"]).map(|p| match p.data_type {
                PropertyType::Scalar(ScalarType::Float | ScalarType::Double) => 1.0,
                PropertyType::Scalar(ScalarType::UShort | ScalarType::Short) => 1.0 / 65_535.0,
                _ => 1.0 / 255.0,
            });
        let has_texture = header.texture.is_some();
        Self {
            raw: RawMesh::counting_from(0),
            colours: Vec::new(),
            uvs: Vec::new(),
            faces: Vec::new(),
            colour_scale,
            has_uvs: has_texture
                && kind_of("vertex", &["s", "u", "texture_u", "texture_s"]).is_some(),
            has_corner_uvs: has_texture && kind_of("face", &["texcoord"]).is_some(),
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
                if let Some(scale) = self.colour_scale {
                    let linear = record
                        .colour
                        .map(|c| linear_from_srgb((c * scale).clamp(0.0, 1.0) as f32));
                    let is_known = linear.iter().all(|c| c.is_finite());
                    self.colours.push(if is_known { linear } else { [1.0; 3] });
                }
                if self.has_uvs {
                    self.uvs.push(top_left_uv(record.uv));
                }
            }
            "face" => self.faces.push(record),
            _ => {}
        }
        Ok(())
    }

    fn finish(mut self, header: &Header, folder: &Path) -> Result<RawMesh, MeshFault> {
        let count = self.raw.mesh.positions.len();
        if u32::try_from(count).is_err() {
            return Err(MeshFault::TooLarge);
        }
        let material = header.texture.as_deref().and_then(|name| {
            let read = std::fs::read(folder.join(name)).map_err(|e| e.to_string());
            match read.and_then(|bytes| decode_image(&bytes)) {
                Ok(image) => Some(image),
                Err(reason) => {
                    self.raw
                        .ignore(format!("texture `{name}` cannot be read: {reason}"));
                    None
                }
            }
        });
        let has_material = material.is_some();
        if let Some(image) = material {
            self.raw.mesh.appearance.materials.push(Material {
                base_colour: [1.0; 3],
                texture: Some(image),
                ..Material::default()
            });
        }
        let mut vertices = Vec::new();
        for (face, record) in (1..).zip(std::mem::take(&mut self.faces)) {
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
                match u32::try_from(vertex) {
                    Ok(v) if (v as usize) < count => vertices.push(v),
                    _ => {
                        return Err(MeshFault::IndexOutOfRange {
                            face,
                            vertex,
                            count,
                        });
                    }
                }
            }
            let uvs = self.face_uvs(&record, &vertices);
            let colours: Option<Vec<[f32; 3]>> = self
                .colour_scale
                .map(|_| vertices.iter().map(|&v| self.colours[v as usize]).collect());
            let look = PolygonLook {
                uvs: uvs.as_deref(),
                colours: colours.as_deref(),
                material: has_material.then_some(0),
            };
            self.raw.push_polygon(&vertices, look);
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
            let record = read_ascii_element(line, element, number)
                .map_err(|fault| MeshFault::at_line(header.line_count + line_number, fault))?;
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
