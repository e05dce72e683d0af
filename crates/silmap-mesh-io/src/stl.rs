//! STL, ASCII and binary.
//!
//! Binary files are read by `stl_io`. ASCII is read here, word by word: that crate stops at the first of several solids, knows
//! no line numbers and rounds to single precision. Which of the two a file is, is decided by its length and by what is in it,
//! not by the word `solid`, which binary headers also begin with. Triangles count from 0.
//!
//! The two bytes after a binary triangle may hold its colour, five bits a channel, in ways that contradict each other.
//! Magics writes `COLOR=` and a colour for everything in the header; the highest bit then says "that colour", and red is
//! lowest. Without it the highest bit says that there is a colour, and blue is lowest (VisCAM, SolidView). MeshLab writes the
//! header and the order of channels of Magics, and sets the highest bit on every face though each has its own colour: a file
//! of Magics in which every face says "that colour" has nothing else in its fields.

use std::io::Cursor;

use glam::DVec3;
use silmap_geometry::lighting::linear_from_srgb;

use super::error::{LineFault, MeshFault, excerpt};
use super::raw::{MOST_CORNERS, PolygonLook, RawMesh};
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

/// Whether a file is exactly as long as the triangle count at the place of a binary header's says.
pub(super) fn has_binary_length(bytes: &[u8]) -> bool {
    claimed_count(bytes).is_some_and(|claimed| {
        let length = HEADER_BYTES as u64 + u64::from(claimed) * TRIANGLE_BYTES as u64;
        length == bytes.len() as u64
    })
}

fn is_binary(bytes: &[u8]) -> bool {
    if bytes.len() < HEADER_BYTES {
        return false;
    }
    if has_binary_length(bytes) {
        return true;
    }
    // Text of any encoding has no zero bytes; the numbers of a binary file hardly ever have none.
    let begins_as = |word: &[u8]| {
        let start = bytes.trim_ascii_start();
        let start = start.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(start);
        start
            .get(..word.len())
            .is_some_and(|found| found.eq_ignore_ascii_case(word))
    };
    let has_facets = || {
        bytes
            .windows(5)
            .any(|word| word.eq_ignore_ascii_case(b"facet"))
    };
    bytes.contains(&0) || !(begins_as(b"solid") || has_facets())
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
    let colours = FaceColours::told_by(bytes, claimed as usize);
    for triangle in triangles {
        let triangle = triangle.map_err(|source| MeshFault::Unreadable { source })?;
        let corners = triangle.vertices.map(|v| DVec3::from(v.0.map(f64::from)));
        let colour = colours.of(raw.mesh.faces.len(), bytes);
        push_facet(&mut raw, &corners, colour)?;
    }
    if found as u64 > claimed {
        raw.ignore(format!(
            "{} triangles after the {claimed} that the header announces were left out",
            found as u64 - claimed
        ));
    }
    Ok(raw.finish())
}

/// The two bytes after a triangle.
fn attribute(triangle: usize, bytes: &[u8]) -> Option<u16> {
    let at = HEADER_BYTES + (triangle + 1) * TRIANGLE_BYTES - 2;
    Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
}

/// How the two bytes after a triangle mean its colour.
#[derive(Clone, Copy, Debug, PartialEq)]
enum FaceColours {
    /// The highest bit says that the other fifteen are a colour, red highest.
    Viscam,
    /// The highest bit says that the other fifteen are a colour, red lowest.
    Meshlab,
    /// The highest bit says that the whole has one colour, this one (sRGB); else the others are a colour, red lowest.
    Magics([u8; 3]),
}

const HIGHEST: u16 = 1 << 15;

impl FaceColours {
    fn told_by(bytes: &[u8], count: usize) -> Self {
        const WORD: &[u8] = b"COLOR=";
        let header = &bytes[..HEADER_BYTES - 4];
        let whole = header
            .windows(WORD.len() + 3)
            .find_map(|w| w.strip_prefix(WORD)?.try_into().ok());
        let fields = || (0..count).filter_map(|t| attribute(t, bytes));
        match whole {
            Some(whole) => {
                let all_have_highest = fields().all(|field| field & HIGHEST != 0);
                let any_has_more = fields().any(|field| field & !HIGHEST != 0);
                let all_are_full = fields().all(|field| field == u16::MAX);
                if all_have_highest && any_has_more && !all_are_full {
                    Self::Meshlab
                } else {
                    Self::Magics(whole)
                }
            }
            None => Self::Viscam,
        }
    }

    /// Linear colour of a triangle, if it has one.
    fn of(self, triangle: usize, bytes: &[u8]) -> Option<[f32; 3]> {
        let field = attribute(triangle, bytes)?;
        let five_bits = |low: u16| f32::from(field >> low & 31) / 31.0;
        let has_highest = field & HIGHEST != 0;
        let srgb = match (self, has_highest) {
            (Self::Viscam | Self::Meshlab, false) => return None,
            (Self::Viscam, true) => [10, 5, 0].map(five_bits),
            (Self::Magics(whole), true) => whole.map(|c| f32::from(c) / 255.0),
            (Self::Meshlab, true) | (Self::Magics(_), false) => [0, 5, 10].map(five_bits),
        };
        Some(srgb.map(linear_from_srgb))
    }
}

fn push_facet(
    raw: &mut RawMesh,
    corners: &[DVec3],
    colour: Option<[f32; 3]>,
) -> Result<(), MeshFault> {
    let first = u32::try_from(raw.mesh.positions.len()).map_err(|_| MeshFault::TooLarge)?;
    for (k, corner) in corners.iter().enumerate() {
        if !corner.is_finite() {
            let vertex = u64::from(first) + k as u64;
            return Err(MeshFault::NotFinite { vertex });
        }
        raw.mesh.positions.push(*corner);
    }
    let colours = colour.map(|c| vec![c; corners.len()]);
    let look = PolygonLook {
        colours: colours.as_deref(),
        ..PolygonLook::default()
    };
    let vertices: Vec<u32> = (first..).take(corners.len()).collect();
    raw.push_polygon(&vertices, look);
    Ok(())
}

/// A word of a text and its line.
type Word<'a> = (usize, &'a str);

/// The words of the solids in a text: without what stands before the first one, and without their names.
fn words_of(text: &str) -> Vec<Word<'_>> {
    let is = |word: &str, keyword: &str| word.eq_ignore_ascii_case(keyword);
    let mut words: Vec<Word<'_>> = Vec::new();
    let mut has_begun = false;
    for (number, line) in numbered_lines(text) {
        let mut rest: Vec<&str> = line.split_whitespace().collect();
        let Some(&first) = rest.first() else {
            continue;
        };
        if !has_begun {
            has_begun = is(first, "solid") || is(first, "facet");
            if !has_begun {
                continue;
            }
        }
        let ends = is(first, "endsolid")
            || (is(first, "end") && rest.get(1).is_some_and(|w| is(w, "solid")));
        if is(first, "solid") || ends {
            // A name follows, or, in a file of one line, everything.
            let begins = |pair: &[&str]| is(pair[0], "facet") && is(pair[1], "normal");
            match rest.windows(2).position(begins) {
                Some(at) => drop(rest.drain(..at)),
                None => continue,
            }
        }
        words.extend(rest.into_iter().map(|word| (number, word)));
    }
    words
}

fn read_ascii(bytes: &[u8]) -> Result<RawMesh, MeshFault> {
    let text = decode(bytes)?;
    let words = words_of(&text);
    let mut raw = RawMesh::counting_from(0);
    if words.is_empty() {
        let first = text.split_whitespace().next().unwrap_or_default();
        if text
            .lines()
            .any(|line| line.trim_start().to_ascii_lowercase().starts_with("solid"))
        {
            return Err(MeshFault::NoFaces);
        }
        let (expected, found) = ("`solid`", excerpt(first));
        return Err(MeshFault::at_line(
            1,
            LineFault::Expected { expected, found },
        ));
    }
    let mut corners: Vec<DVec3> = Vec::with_capacity(3);
    let mut digits: Vec<u8> = Vec::with_capacity(9);
    let mut is_in_loop = false;
    let mut at = 0;
    while let Some(&(number, word)) = words.get(at) {
        at += 1;
        let unexpected = |expected| {
            let found = excerpt(word);
            MeshFault::at_line(number, LineFault::Expected { expected, found })
        };
        let next_is = |at: usize, keyword: &str| {
            words
                .get(at)
                .is_some_and(|(_, word)| word.eq_ignore_ascii_case(keyword))
        };
        let mut keyword = word.to_ascii_lowercase();
        // `end loop`, and `outerloop`.
        if keyword == "end" {
            keyword.push_str(
                &words
                    .get(at)
                    .map_or(String::new(), |w| w.1.to_ascii_lowercase()),
            );
            at += 1;
        } else if keyword == "outer" {
            at += usize::from(next_is(at, "loop"));
        }
        match keyword.as_str() {
            "facet" | "endfacet" | "endsolid" if is_in_loop => return Err(unexpected("`vertex`")),
            "facet" => {
                // The normal is of no use here, and may be missing.
                while at < words.len()
                    && !next_is(at, "outer")
                    && !next_is(at, "outerloop")
                    && !next_is(at, "vertex")
                {
                    at += 1;
                }
            }
            "endfacet" => {}
            // A name follows where everything stands on one line.
            "endsolid" | "solid" => {
                while at < words.len() && !next_is(at, "facet") && !next_is(at, "solid") {
                    at += 1;
                }
            }
            "outer" | "outerloop" => {
                corners.clear();
                digits.clear();
                is_in_loop = true;
            }
            "vertex" if is_in_loop && corners.len() < MOST_CORNERS => {
                let vertex = (raw.mesh.positions.len() + corners.len()) as u64;
                let numbers = words.get(at..(at + 3).min(words.len())).unwrap_or_default();
                let position = three_numbers(numbers.iter().map(|w| w.1))
                    .map(DVec3::from)
                    .ok_or_else(|| MeshFault::at_line(number, LineFault::Coordinates { vertex }))?;
                if !position.is_finite() {
                    let fault = LineFault::NotFinite { vertex };
                    return Err(MeshFault::at_line(number, fault));
                }
                digits.extend(numbers.iter().map(|w| raw.note_digits(w.1)));
                corners.push(position);
                at += 3;
            }
            "endloop" if is_in_loop => {
                if corners.len() < 3 {
                    let corners = corners.len();
                    let fault = LineFault::TooFewCorners { corners };
                    return Err(MeshFault::at_line(number, fault));
                }
                raw.note_facet_digits(&digits);
                push_facet(&mut raw, &corners, None)?;
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
        let last_line = words.last().map_or(1, |w| w.0);
        return Err(MeshFault::at_line(last_line, fault));
    }
    if raw.mesh.faces.is_empty() {
        return Err(MeshFault::NoFaces);
    }
    Ok(raw.finish())
}
