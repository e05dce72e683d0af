//! The header of a PLY file.
//!
//! Lines are parsed by the grammar of `ply-rs-bw`; cutting the header out of the file is done here, because that crate
//! knows neither lines that end in CR alone nor a header that never ends, and silently keeps the last of two elements of
//! one name.

use std::collections::BTreeSet;

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding};

use crate::error::{HeaderFault, MeshFault, excerpt};

/// The longest header that is looked through for its end.
const LONGEST_HEADER: usize = 1 << 20;

/// What a header announces.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    /// In the order of the data.
    pub(super) elements: Vec<ElementDef>,
    /// The textures named in `comment TextureFile` lines.
    pub(super) textures: Vec<String>,
    /// A comment says that VTK wrote it.
    pub(super) is_from_vtk: bool,
    /// Lines before the data.
    pub(super) line_count: usize,
    /// Where the data begins.
    pub(super) data_start: usize,
}

/// Reads the header at the start of `bytes`.
pub(super) fn read_header(bytes: &[u8]) -> Result<Header, MeshFault> {
    let magic = MeshFault::Header(HeaderFault::Magic { expected: "ply" });
    if !bytes.starts_with(b"ply") {
        return Err(magic);
    }
    // The first line end determines how all lines end; a data byte that looks like a line end is never taken for one.
    let ends_in_cr_alone = match (bytes.get(3), bytes.get(4)) {
        (Some(b'\r'), Some(b'\n')) => false,
        (Some(b'\r'), _) => true,
        _ => false,
    };
    let line_end = if ends_in_cr_alone { b'\r' } else { b'\n' };
    let mut header = Header {
        encoding: Encoding::Ascii,
        elements: Vec::new(),
        textures: Vec::new(),
        is_from_vtk: false,
        line_count: 0,
        data_start: 0,
    };
    // The lines that matter, as the parser likes them.
    let mut cleaned = String::from("ply\n");
    let mut has_format = false;
    let mut element_names: BTreeSet<String> = BTreeSet::new();
    let mut property_names: BTreeSet<String> = BTreeSet::new();
    let parser = Parser::<DefaultElement>::new();
    loop {
        let rest = &bytes[header.data_start..];
        let end = rest
            .iter()
            .take(LONGEST_HEADER)
            .position(|&b| b == line_end);
        let line_bytes = &rest[..end.unwrap_or(rest.len().min(LONGEST_HEADER))];
        header.line_count += 1;
        header.data_start += line_bytes.len() + usize::from(end.is_some());
        let text = String::from_utf8_lossy(line_bytes);
        let text = text.trim();
        if text == "end_header" {
            break;
        }
        if end.is_none() || header.data_start > LONGEST_HEADER {
            return Err(MeshFault::Header(HeaderFault::Endless));
        }
        if header.line_count == 1 {
            if text != "ply" {
                return Err(magic);
            }
            continue;
        }
        if text.is_empty() {
            continue;
        }
        let words: Vec<&str> = text.split_whitespace().collect();
        if let ["comment", keyword, _, ..] = words[..]
            && keyword.eq_ignore_ascii_case("TextureFile")
        {
            let name = text.split_once(keyword).map(|(_, name)| name.trim());
            header.textures.extend(name.map(str::to_owned));
        }
        header.is_from_vtk |= words.starts_with(&["comment", "VTK"]);
        if matches!(words[0], "comment" | "obj_info") {
            continue;
        }
        match words[..] {
            ["format", encoding, ..] => {
                cleaned.push_str(&format!("format {encoding} 1.0\n"));
                has_format = true;
                continue;
            }
            ["element", name, _] => {
                if !element_names.insert(name.to_owned()) {
                    let name = name.to_owned();
                    return Err(MeshFault::Header(HeaderFault::RepeatedElement { name }));
                }
                property_names.clear();
            }
            ["property", .., name] if !element_names.is_empty() => {
                if !property_names.insert(name.to_owned()) {
                    return Err(unreadable(&header, bytes, text));
                }
            }
            _ => return Err(unreadable(&header, bytes, text)),
        }
        if parser.read_header_line(text).is_err() {
            return Err(unreadable(&header, bytes, text));
        }
        cleaned.push_str(&words.join(" "));
        cleaned.push('\n');
    }
    if element_names.is_empty() {
        let name = "vertex";
        return Err(MeshFault::Header(HeaderFault::NoElement { name }));
    }
    if !has_format {
        return Err(MeshFault::Header(HeaderFault::NoFormat));
    }
    cleaned.push_str("end_header\n");
    let parsed = parser
        .read_ply_header(&mut cleaned.as_bytes())
        .map_err(|_| unreadable(&header, bytes, "format"))?;
    header.encoding = parsed.encoding;
    header.elements = parsed.elements.into_values().collect();
    Ok(header)
}

/// The fault of a line; a header that runs into binary data has no end rather than a bad line.
fn unreadable(header: &Header, bytes: &[u8], text: &str) -> MeshFault {
    let has_end = bytes
        .windows(b"end_header".len())
        .take(LONGEST_HEADER)
        .any(|w| w == b"end_header");
    MeshFault::Header(if has_end {
        HeaderFault::Unreadable {
            line: header.line_count,
            text: excerpt(text),
        }
    } else {
        HeaderFault::Endless
    })
}
