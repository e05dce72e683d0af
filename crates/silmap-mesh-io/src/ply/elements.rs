//! One element of a PLY file, and reading elements one by one, binary and ASCII.

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType,
};

use super::Builder;
use super::header::Header;
use crate::error::{LineFault, MeshFault, excerpt};
use crate::text::numbered_lines;

const FACE_FORM: &str = "n i j k …";

/// The element of triangle strips.
pub(super) const STRIPS: &str = "tristrips";

/// Names of the list of a face's vertices.
pub(super) const CORNERS: [&str; 4] = [
    "vertex_indices",
    "vertex_index",
    "vertex_indexes",
    "vertices",
];

pub(super) const REDS: [&str; 5] = ["red", "r", "diffuse_red", "ambient_red", "diffuse_r"];

pub(super) const TEXTURE_US: [&str; 5] = ["s", "u", "texture_u", "texture_s", "s0"];

/// One element, of whichever kind: what is of use in it.
#[derive(Debug)]
pub(super) struct Record {
    pub(super) position: [f64; 3],
    pub(super) colour: [f64; 3],
    pub(super) uv: [f64; 2],
    pub(super) corners: Vec<i64>,
    pub(super) corner_uvs: Vec<f64>,
    pub(super) corner_colours: Vec<f64>,
    pub(super) texture: f64,
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
pub(super) fn read_binary(
    bytes: &[u8],
    header: &Header,
    builder: &mut Builder,
) -> Result<(), MeshFault> {
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

pub(super) fn read_ascii(
    bytes: &[u8],
    header: &Header,
    builder: &mut Builder,
) -> Result<(), MeshFault> {
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
