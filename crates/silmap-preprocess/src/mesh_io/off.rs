//! OFF, the format of Geomview: `OFF`, the counts, one line a vertex, one line a face.
//!
//! Read by hand because no kept crate does. Comments, counts on the keyword's line, and what the keyword announces after
//! the coordinates are understood: normals, then colours (`COFF`), then texture coordinates, of which only colours are
//! taken. Faces may be followed by a colour; it counts where vertices have none. A face's single number, which picks from
//! a colour map that nobody has, and the binary variant are not read. Vertices count from 0, faces from 1.

use glam::DVec3;

use super::error::{HeaderFault, LineFault, MeshFault, excerpt};
use super::raw::{MOST_CORNERS, PolygonLook, RawMesh};
use super::text::{decode, numbered_lines, three_numbers};

const FACE_FORM: &str = "n i j k …";

/// Reads an OFF file.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, MeshFault> {
    if bytes.windows(6).take(64).any(|w| w == b"BINARY") {
        let what = "the binary variant of OFF";
        return Err(MeshFault::Header(HeaderFault::Unsupported { what }));
    }
    let text = decode(bytes)?;
    let mut lines = numbered_lines(&text)
        .map(|(n, line)| (n, line.split('#').next().unwrap_or_default().trim()))
        .filter(|(_, line)| !line.is_empty());
    let (first_line, first) = lines.next().ok_or(MeshFault::NoVertices)?;
    let (prefix, after_keyword) = split_keyword(first)?;
    let colour_at = prefix
        .contains('C')
        .then_some(if prefix.contains('N') { 6 } else { 3 });
    let (_, counts) = if after_keyword.is_empty() {
        lines.next().ok_or(MeshFault::NoVertices)?
    } else {
        (first_line, after_keyword)
    };
    let (vertex_count, face_count) = read_counts(counts)?;
    let data: Vec<(usize, &str)> = lines.collect();
    if vertex_count == 0 {
        return Err(MeshFault::NoVertices);
    }
    if face_count == 0 {
        return Err(MeshFault::NoFaces);
    }
    if vertex_count > data.len() as u64 {
        return Err(MeshFault::CountMismatch {
            element: "vertices",
            claimed: vertex_count,
            found: format!("{} data lines", data.len()),
        });
    }
    let (vertex_lines, face_lines) = data.split_at(vertex_count as usize);
    let mut raw = RawMesh::counting_from(0);
    let mut colours = Vec::new();
    for (vertex, &(number, line)) in (0..).zip(vertex_lines) {
        raw.mesh.positions.push(read_vertex(number, line, vertex)?);
        if let Some(at) = colour_at {
            colours.push(read_colour(line.split_whitespace().skip(at)));
        }
    }
    let (mut corners, mut face_colours) = (Vec::new(), Vec::new());
    for face in 0..face_count {
        let missing = MeshFault::Missing {
            element: "face",
            number: face + 1,
            count: face_count,
        };
        let &(number, line) = face_lines.get(face as usize).ok_or(missing)?;
        let colour = read_face(line, face, vertex_lines.len(), &mut corners)
            .map_err(|fault| MeshFault::at_line(number, fault))?;
        face_colours.push(colour);
        raw.push_polygon(&corners, PolygonLook::default());
    }
    if !raw.spread_vertex_colours(&colours) {
        raw.spread_face_colours(&face_colours);
    }
    Ok(raw.finish())
}

/// What stands before `OFF` in the keyword, and what follows it on its line; everything when there is no keyword, which is
/// allowed.
fn split_keyword(line: &str) -> Result<(&str, &str), MeshFault> {
    let Some(at) = line.find("OFF") else {
        return if line.starts_with(|c: char| c.is_ascii_digit()) {
            Ok(("", line))
        } else {
            Err(MeshFault::Header(HeaderFault::Magic { expected: "OFF" }))
        };
    };
    let prefix = &line[..at];
    match prefix {
        "" | "C" | "N" | "ST" | "CN" | "STC" | "STN" | "STCN" => {
            Ok((prefix, line[at + 3..].trim()))
        }
        "4" | "n" | "4n" => Err(MeshFault::Header(HeaderFault::Unsupported {
            what: "OFF in other than three dimensions",
        })),
        _ => Err(MeshFault::Header(HeaderFault::Magic { expected: "OFF" })),
    }
}

/// Vertex and face count; the edge count that follows is often wrong or missing.
fn read_counts(line: &str) -> Result<(u64, u64), MeshFault> {
    let mut words = line.split_whitespace().map(str::parse);
    match (words.next(), words.next()) {
        (Some(Ok(vertices)), Some(Ok(faces))) => Ok((vertices, faces)),
        _ => Err(MeshFault::Header(HeaderFault::Counts {
            found: excerpt(line),
        })),
    }
}

fn read_vertex(number: usize, line: &str, vertex: u64) -> Result<DVec3, MeshFault> {
    let fault = match three_numbers(line.split_whitespace()).map(DVec3::from) {
        Some(position) if position.is_finite() => return Ok(position),
        Some(_) => LineFault::NotFinite { vertex },
        None => LineFault::Coordinates { vertex },
    };
    Err(MeshFault::at_line(number, fault))
}

/// Red, green and blue, if there are that many numbers that can be a colour.
fn read_colour<'a>(words: impl Iterator<Item = &'a str>) -> Option<[f32; 3]> {
    let is_known = |c: &[f64; 3]| c.iter().all(|x| x.is_finite() && *x >= 0.0);
    let colour = three_numbers(words).filter(is_known)?;
    Some(colour.map(|x| x as f32))
}

/// Reads a face into `corners`; gives the colour behind them.
fn read_face(
    line: &str,
    face: u64,
    vertex_count: usize,
    corners: &mut Vec<u32>,
) -> Result<Option<[f32; 3]>, LineFault> {
    let form = LineFault::FaceLine {
        face: face + 1,
        form: FACE_FORM,
    };
    let mut words = line.split_whitespace();
    let count: usize = words
        .next()
        .and_then(|w| w.parse().ok())
        .ok_or_else(|| form.clone())?;
    if count < 3 {
        // A line that holds nothing but a number is not a face with few corners.
        return Err(if words.next().is_some() {
            LineFault::TooFewCorners { corners: count }
        } else {
            form
        });
    }
    if count > MOST_CORNERS {
        let (corners, most) = (count, MOST_CORNERS);
        return Err(LineFault::TooManyCorners { corners, most });
    }
    corners.clear();
    for _ in 0..count {
        let word = words.next().ok_or_else(|| form.clone())?;
        let vertex: i64 = word.parse().map_err(|_| LineFault::NotAnIndex {
            token: excerpt(word),
        })?;
        match u32::try_from(vertex) {
            Ok(v) if (v as usize) < vertex_count => corners.push(v),
            _ => {
                let count = vertex_count;
                return Err(LineFault::IndexOutOfRange { vertex, count });
            }
        }
    }
    Ok(read_colour(words))
}
