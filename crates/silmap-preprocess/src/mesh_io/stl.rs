//! STL, ASCII and binary.
//!
//! Binary files are read by `stl_io`. ASCII is read here: that crate stops at the first of several solids, knows no line
//! numbers and rounds to single precision. Which of the two a file is, is decided by its length and not by the word
//! `solid`, which binary headers also begin with. Triangles count from 0.
//!
//! The two bytes after a binary triangle may hold its colour, five bits a channel, in one of two ways that contradict each
//! other. Magics writes `COLOR=` and a colour for everything in the header; the highest bit then says "that colour", and
//! red is lowest. Without it the highest bit says that there is a colour, and blue is lowest (VisCAM, SolidView).

use std::io::Cursor;

use glam::DVec3;
use silmap_geometry::lighting::linear_from_srgb;

use super::error::{LineFault, MeshFault, excerpt};
use super::raw::{PolygonLook, RawMesh};
use super::text::{decode, numbered_lines, three_numbers};

/// Bytes before the first triangle, with the count in the last four.
const HEADER_BYTES: usize = 84;
/// Bytes a triangle.
const TRIANGLE_BYTES: usize = 50;

/// Reads an STL file.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, MeshFault> {
    if bytes.is_empty() {
        return Err(MeshFault::Empty);
    }
    if is_binary(bytes) {
        read_binary(bytes)
    } else {
        read_ascii(bytes)
    }
}

/// The triangle count in a binary header.
fn claimed_count(bytes: &[u8]) -> Option<u32> {
    let field = bytes.get(HEADER_BYTES - 4..HEADER_BYTES)?;
    Some(u32::from_le_bytes(field.try_into().ok()?))
}

fn is_binary(bytes: &[u8]) -> bool {
    let Some(claimed) = claimed_count(bytes) else {
        return false;
    };
    let fits =
        HEADER_BYTES as u64 + u64::from(claimed) * TRIANGLE_BYTES as u64 == bytes.len() as u64;
    let begins_as_text = bytes
        .trim_ascii_start()
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // Text of any encoding has no zero bytes; the numbers of a binary file hardly ever have none.
    fits || !begins_as_text || bytes.contains(&0)
}

fn read_binary(bytes: &[u8]) -> Result<RawMesh, MeshFault> {
    let claimed = u64::from(claimed_count(bytes).unwrap_or(0));
    let found = (bytes.len() - HEADER_BYTES) / TRIANGLE_BYTES;
    if claimed > found as u64 {
        return Err(MeshFault::CountMismatch {
            element: "triangles",
            claimed,
            found: found.to_string(),
        });
    }
    if claimed == 0 {
        return Err(MeshFault::NoFaces);
    }
    // The crate takes a header that begins with `solid` for text; it has no use for the header otherwise.
    let mut body = bytes.to_vec();
    body[..HEADER_BYTES - 4].fill(0);
    let mut cursor = Cursor::new(body);
    let triangles = stl_io::create_stl_reader(&mut cursor)
        .map_err(|source| MeshFault::Unreadable { source })?;
    let mut raw = RawMesh::counting_from(0);
    let colours = FaceColours::told_by(&bytes[..HEADER_BYTES - 4]);
    for triangle in triangles {
        let triangle = triangle.map_err(|source| MeshFault::Unreadable { source })?;
        let corners = triangle.vertices.map(|v| DVec3::from(v.0.map(f64::from)));
        let colour = colours.of(raw.mesh.faces.len(), bytes);
        push_triangle(&mut raw, corners, colour)?;
    }
    if found as u64 > claimed {
        raw.ignore(format!(
            "{} triangles after the {claimed} that the header announces were left out",
            found as u64 - claimed
        ));
    }
    Ok(raw.finish())
}

/// How the two bytes after a triangle mean its colour.
enum FaceColours {
    /// The highest bit says that the other fifteen are a colour, red highest.
    Viscam,
    /// The highest bit says that the whole has one colour, this one (sRGB); else the others are a colour, red lowest.
    Magics([u8; 3]),
}

impl FaceColours {
    fn told_by(header: &[u8]) -> Self {
        const WORD: &[u8] = b"COLOR=";
        header
            .windows(WORD.len() + 3)
            .find_map(|w| w.strip_prefix(WORD)?.try_into().ok())
            .map_or(Self::Viscam, Self::Magics)
    }

    /// Linear colour of a triangle, if it has one.
    fn of(&self, triangle: usize, bytes: &[u8]) -> Option<[f32; 3]> {
        let at = HEADER_BYTES + (triangle + 1) * TRIANGLE_BYTES - 2;
        let field = u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?);
        let five_bits = |low: u16| f32::from(field >> low & 31) / 31.0;
        let has_highest = field >> 15 == 1;
        let srgb = match (self, has_highest) {
            (Self::Viscam, false) => return None,
            (Self::Viscam, true) => [10, 5, 0].map(five_bits),
            (Self::Magics(whole), true) => whole.map(|c| f32::from(c) / 255.0),
            (Self::Magics(_), false) => [0, 5, 10].map(five_bits),
        };
        Some(srgb.map(linear_from_srgb))
    }
}

fn push_triangle(
    raw: &mut RawMesh,
    corners: [DVec3; 3],
    colour: Option<[f32; 3]>,
) -> Result<(), MeshFault> {
    let first = u32::try_from(raw.mesh.positions.len()).map_err(|_| MeshFault::TooLarge)?;
    for (k, corner) in corners.into_iter().enumerate() {
        if !corner.is_finite() {
            let vertex = u64::from(first) + k as u64;
            return Err(MeshFault::NotFinite { vertex });
        }
        raw.mesh.positions.push(corner);
    }
    let colours = colour.map(|c| [c; 3]);
    let look = PolygonLook {
        colours: colours.as_ref().map(<[_; 3]>::as_slice),
        ..PolygonLook::default()
    };
    raw.push_polygon(&[first, first + 1, first + 2], look);
    Ok(())
}

fn read_ascii(bytes: &[u8]) -> Result<RawMesh, MeshFault> {
    let text = decode(bytes)?;
    let mut raw = RawMesh::counting_from(0);
    let mut corners: Vec<DVec3> = Vec::with_capacity(3);
    let mut has_begun = false;
    let mut is_in_loop = false;
    let mut last_line = 1;
    for (number, line) in numbered_lines(&text).filter(|(_, line)| !line.is_empty()) {
        last_line = number;
        let unexpected = |expected| {
            let found = excerpt(line);
            MeshFault::at_line(number, LineFault::Expected { expected, found })
        };
        let mut words = line.split_whitespace();
        let keyword = words.next().unwrap_or_default().to_ascii_lowercase();
        match keyword.as_str() {
            "solid" => has_begun = true,
            _ if !has_begun => return Err(unexpected("`solid`")),
            "facet" | "endfacet" | "endsolid" if is_in_loop => return Err(unexpected("`vertex`")),
            "facet" | "endfacet" | "endsolid" => {}
            "outer" => {
                corners.clear();
                is_in_loop = true;
            }
            "vertex" if is_in_loop && corners.len() < 3 => {
                let vertex = (raw.mesh.positions.len() + corners.len()) as u64;
                let position = three_numbers(words)
                    .map(DVec3::from)
                    .ok_or_else(|| MeshFault::at_line(number, LineFault::Coordinates { vertex }))?;
                if !position.is_finite() {
                    let fault = LineFault::NotFinite { vertex };
                    return Err(MeshFault::at_line(number, fault));
                }
                corners.push(position);
            }
            "endloop" if is_in_loop => {
                let &[a, b, c] = corners.as_slice() else {
                    let corners = corners.len();
                    let fault = LineFault::TooFewCorners { corners };
                    return Err(MeshFault::at_line(number, fault));
                };
                push_triangle(&mut raw, [a, b, c], None)?;
                is_in_loop = false;
            }
            _ => return Err(unexpected("a line of an ASCII STL file")),
        }
    }
    if is_in_loop {
        let fault = LineFault::Expected {
            expected: "`endloop`",
            found: "the end of the file".to_owned(),
        };
        return Err(MeshFault::at_line(last_line, fault));
    }
    if raw.mesh.faces.is_empty() {
        return Err(MeshFault::NoFaces);
    }
    Ok(raw.finish())
}
