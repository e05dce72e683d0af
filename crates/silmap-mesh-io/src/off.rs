//! OFF, the format of Geomview: `OFF`, the counts, one line a vertex, one line a face.
//!
//! Read by hand because no kept crate does. Comments, counts on the keyword's line, and what the keyword announces after
//! the coordinates are understood: `C` colours, `N` normals, `ST` texture coordinates, `4` a fourth coordinate to divide
//! by, `n` a dimension (three), in whatever order the letters stand. Geomview's manual puts normals before colours whatever
//! the order, and MeshLab writes `NC` and then colours before normals; so the numbers themselves decide where they can
//! (normals have length 1), and the order of the letters where they cannot. Only colours are taken. Faces may be followed
//! by a colour; it counts where vertices have none. A face's single number, which picks from a colour map that is not in the file,
//! is left out with a warning; the binary variant is not read. Vertices count from 0, faces from 1.

use glam::DVec3;
use silmap_geometry::defects::counted;

use super::content::POINTS;
use super::error::{HeaderFault, LineFault, MeshFault, excerpt};
use super::raw::{MOST_CORNERS, PolygonLook, RawMesh};
use super::text::{decode, numbered_lines, three_numbers};

const FACE_FORM: &str = "n i j k …";

/// How far from 1 the length of a normal may be that was written with few digits.
const UNIT_SLACK: f64 = 0.02;

/// Reads an OFF file.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, MeshFault> {
    if bytes.windows(6).take(64).any(|w| w == b"BINARY") {
        let what = "the binary variant of OFF";
        return Err(MeshFault::Header(HeaderFault::Unsupported { what }));
    }
    let text = decode(bytes)?;
    let mut lines = numbered_lines(&text)
        .map(|(n, line)| (n, line.split('#').next().unwrap_or_default().trim()))
        .filter(|(_, line)| !line.is_empty())
        .peekable();
    let (first_line, first) = lines.next().ok_or(MeshFault::NoVertices)?;
    let (letters, mut after_keyword) = split_keyword(first)?;
    if letters.has_dimension {
        if after_keyword.is_empty() {
            after_keyword = lines.next().ok_or(MeshFault::NoVertices)?.1;
        }
        after_keyword = after_dimension(after_keyword)?;
    }
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
    if vertex_count > data.len() as u64 {
        return Err(MeshFault::CountMismatch {
            element: "vertices",
            claimed: vertex_count,
            found: format!("{} data lines", data.len()),
        });
    }
    if face_count == 0 {
        return Err(MeshFault::PointsOnly {
            vertices: vertex_count as usize,
            way_out: POINTS,
        });
    }
    let (vertex_lines, face_lines) = data.split_at(vertex_count as usize);
    let mut raw = RawMesh::counting_from(0);
    let mut colours = Vec::new();
    let colour_at = letters.colour_at(vertex_lines);
    for (vertex, &(number, line)) in (0..).zip(vertex_lines) {
        let position = read_vertex(number, line, vertex, letters.is_homogeneous)?;
        raw.mesh.positions.push(position);
        line.split_whitespace().take(3).for_each(|word| {
            raw.note_digits(word);
        });
        if let Some(at) = colour_at {
            colours.push(read_colour(line.split_whitespace().skip(at)));
        }
    }
    let (mut corners, mut face_colours) = (Vec::new(), Vec::new());
    let mut mapped = 0;
    for face in 0..face_count {
        let missing = MeshFault::Missing {
            element: "face",
            number: face + 1,
            count: face_count,
        };
        let &(number, line) = face_lines.get(face as usize).ok_or(missing)?;
        let colour = read_face(line, face, vertex_lines.len(), &mut corners)
            .map_err(|fault| MeshFault::at_line(number, fault))?;
        mapped += usize::from(line.split_whitespace().count() == corners.len() + 2);
        face_colours.push(colour);
        raw.push_polygon(&corners, PolygonLook::default());
    }
    if mapped > 0 {
        raw.ignore(format!(
            "colours of {}: they are numbers of a colour map, which the file does not hold",
            counted(mapped, "face")
        ));
    }
    if !raw.spread_vertex_colours(&colours) {
        raw.spread_face_colours(&face_colours);
    }
    Ok(raw.finish())
}

/// What the letters before `OFF` announce.
#[derive(Debug, Default, PartialEq, Eq)]
struct Letters {
    has_colours: bool,
    has_normals: bool,
    has_uvs: bool,
    /// `C` stands before `N`.
    colours_first: bool,
    is_homogeneous: bool,
    has_dimension: bool,
}

impl Letters {
    /// Reads the letters in any order, each at most once; `None` when they mean nothing.
    fn of(mut prefix: &str) -> Option<Self> {
        let mut letters = Self::default();
        while let Some(first) = prefix.chars().next() {
            let length = if prefix.starts_with("ST") { 2 } else { 1 };
            let seen = match first {
                'S' if length == 2 => &mut letters.has_uvs,
                'C' => {
                    letters.colours_first = !letters.has_normals;
                    &mut letters.has_colours
                }
                'N' => &mut letters.has_normals,
                '4' => &mut letters.is_homogeneous,
                'n' => &mut letters.has_dimension,
                _ => return None,
            };
            if std::mem::replace(seen, true) {
                return None;
            }
            prefix = prefix.get(length..)?;
        }
        Some(letters)
    }

    /// Which word of a vertex line its colour begins with.
    fn colour_at(&self, lines: &[(usize, &str)]) -> Option<usize> {
        if !self.has_colours {
            return None;
        }
        let coordinates = if self.is_homogeneous { 4 } else { 3 };
        if !self.has_normals {
            return Some(coordinates);
        }
        let words = lines.first()?.1.split_whitespace().count();
        let uvs = if self.has_uvs { 2 } else { 0 };
        // A colour has three numbers or, with its opacity, four.
        let colour = words.saturating_sub(coordinates + 3 + uvs).clamp(3, 4);
        let are_normals_at = |at: usize| {
            lines.iter().all(|(_, line)| {
                let normal = three_numbers(line.split_whitespace().skip(at)).map(DVec3::from);
                normal.is_some_and(|n| n == DVec3::ZERO || (n.length() - 1.0).abs() < UNIT_SLACK)
            })
        };
        let normals_first = are_normals_at(coordinates);
        let normals_last = are_normals_at(coordinates + colour);
        let colours_first = match (normals_first, normals_last) {
            (true, false) => false,
            (false, true) => true,
            _ => self.colours_first,
        };
        Some(coordinates + if colours_first { 0 } else { 3 })
    }
}

/// What stands before `OFF` in the keyword, and what follows it on its line; everything when there is no keyword, which is
/// allowed.
fn split_keyword(line: &str) -> Result<(Letters, &str), MeshFault> {
    let magic = MeshFault::Header(HeaderFault::Magic { expected: "OFF" });
    let Some(at) = line.find("OFF").or_else(|| line.find("off")) else {
        return if line.starts_with(|c: char| c.is_ascii_digit()) {
            Ok((Letters::default(), line))
        } else {
            Err(magic)
        };
    };
    // Small letters all through mean the large ones.
    let prefix = if line[at..].starts_with("off") {
        line[..at].to_ascii_uppercase()
    } else {
        line[..at].to_owned()
    };
    let letters = Letters::of(&prefix).ok_or(magic)?;
    Ok((letters, line[at + 3..].trim()))
}

/// What follows the dimension on a line, which has to be three.
fn after_dimension(line: &str) -> Result<&str, MeshFault> {
    let (word, rest) = line
        .split_once(|c: char| c.is_whitespace())
        .unwrap_or((line, ""));
    if word == "3" {
        return Ok(rest.trim());
    }
    Err(MeshFault::Header(HeaderFault::Unsupported {
        what: "OFF in other than three dimensions",
    }))
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

fn read_vertex(
    number: usize,
    line: &str,
    vertex: u64,
    is_homogeneous: bool,
) -> Result<DVec3, MeshFault> {
    let mut divisor = 1.0;
    if is_homogeneous {
        let fourth = line.split_whitespace().nth(3).and_then(|w| w.parse().ok());
        divisor =
            fourth.ok_or_else(|| MeshFault::at_line(number, LineFault::Coordinates { vertex }))?;
    }
    let fault = match three_numbers(line.split_whitespace()).map(DVec3::from) {
        Some(position) if (position / divisor).is_finite() => return Ok(position / divisor),
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
