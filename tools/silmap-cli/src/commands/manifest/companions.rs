//! The files of a model: its own, and those that it refers to.
//!
//! What a model names is found by the words that its format uses for it, without reading the mesh. A name too many, of a file
//! that the reader would not open, costs a build at the worst; what is missing has no part in the hash until it is there.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use serde_json::Value;
use sha2::{Digest, Sha256};

/// Lines longer than this name no file.
const MAX_LINE_BYTES: u64 = 1 << 16;
/// Where the header of a PLY file ends at the latest.
const MAX_HEADER_LINES: usize = 1 << 10;
/// JSON larger than this is not looked through.
const MAX_JSON_BYTES: u64 = 1 << 28;

/// SHA-256 of the model (under no name) and of every file it names that is there, by name.
///
/// # Errors
/// When the model cannot be read.
pub(super) fn digests(model: &Path) -> io::Result<BTreeMap<String, String>> {
    let mut found = BTreeMap::from([(String::new(), digest(model)?)]);
    let folder = model.parent().unwrap_or(Path::new(""));
    let mut names = names_in(model)?;
    while let Some(name) = names.pop() {
        let path = folder.join(&name);
        if found.contains_key(&name) || !path.is_file() {
            continue;
        }
        if let Ok(digest) = digest(&path) {
            found.insert(name, digest);
            // A material library names pictures.
            if is(&path, "mtl") {
                names.extend(names_in(&path).unwrap_or_default());
            }
        }
    }
    Ok(found)
}

/// Bytes as hexadecimal digits.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 of a file.
///
/// # Errors
/// When it cannot be read.
pub(super) fn digest(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hex(&hasher.finalize())),
            n => hasher.update(&buffer[..n]),
        }
    }
}

fn is(path: &Path, extension: &str) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// Names of files in a file's text.
fn names_in(path: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    if is(path, "gltf") || is(path, "glb") {
        names_in_json(&json_of(path)?, &mut names);
    } else if !is(path, "stl") && !is(path, "off") {
        let is_ply = is(path, "ply");
        let mut input = BufReader::new(File::open(path)?);
        let mut line = Vec::new();
        let mut count = 0;
        loop {
            line.clear();
            if input
                .by_ref()
                .take(MAX_LINE_BYTES)
                .read_until(b'\n', &mut line)?
                == 0
            {
                break;
            }
            count += 1;
            let text = String::from_utf8_lossy(&line);
            names_in_line(text.trim(), &mut names);
            if is_ply && (count > MAX_HEADER_LINES || text.trim() == "end_header") {
                break;
            }
        }
    }
    Ok(names)
}

/// `mtllib`, the maps of MTL, and the comment by which PLY names its texture. Names may have blanks and follow options, so
/// every ending of the line is tried.
fn names_in_line(line: &str, names: &mut Vec<String>) {
    let mut words = line.split_whitespace();
    let key = words.next().unwrap_or_default().to_ascii_lowercase();
    let starts = match key.as_str() {
        "mtllib" | "bump" | "disp" | "decal" | "refl" | "norm" => true,
        "comment" => words
            .next()
            .is_some_and(|w| w.eq_ignore_ascii_case("texturefile")),
        other => other.starts_with("map_"),
    };
    if !starts {
        return;
    }
    let mut rest = line;
    while let Some(at) = rest.find(char::is_whitespace) {
        rest = rest[at..].trim_start();
        names.push(rest.replace('\\', "/"));
        names.extend(
            rest.split_whitespace()
                .next()
                .map(|word| word.replace('\\', "/")),
        );
    }
}

/// The JSON of a glTF file, which in a binary one is the first chunk.
fn json_of(path: &Path) -> io::Result<Value> {
    let mut file = File::open(path)?;
    let mut start = [0; 20];
    let is_binary = file.read_exact(&mut start).is_ok() && start.starts_with(b"glTF");
    let mut text = Vec::new();
    if is_binary {
        let length = u32::from_le_bytes([start[12], start[13], start[14], start[15]]);
        file.take(u64::from(length)).read_to_end(&mut text)?;
    } else {
        File::open(path)?
            .take(MAX_JSON_BYTES)
            .read_to_end(&mut text)?;
    }
    Ok(serde_json::from_slice(&text).unwrap_or_default())
}

/// Every `uri` that is no data itself.
fn names_in_json(value: &Value, names: &mut Vec<String>) {
    for list in ["buffers", "images"] {
        let entries = value.get(list).and_then(Value::as_array);
        for uri in entries
            .into_iter()
            .flatten()
            .filter_map(|entry| entry.get("uri")?.as_str())
        {
            if !uri.starts_with("data:") {
                names.push(uri.to_owned());
                names.push(decoded(uri));
            }
        }
    }
}

/// A URI with `%20` and the like as the bytes they stand for.
fn decoded(uri: &str) -> String {
    let mut parts = uri.split('%');
    let mut bytes = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let code = part
            .get(..2)
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        match code {
            Some(byte) => {
                bytes.push(byte);
                bytes.extend(&part.as_bytes()[2..]);
            }
            None => {
                bytes.push(b'%');
                bytes.extend(part.as_bytes());
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn every_file_that_a_model_names_counts() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("m.obj", "mtllib a.mtl two words.mtl\nv 0 0 0\n");
        write("a.mtl", "newmtl x\nmap_Kd -s 2 2 2 -clamp on wood.png\n");
        write("two words.mtl", "bump tex\\bump map.png\n");
        fs::create_dir(folder.path().join("tex")).unwrap();
        for picture in [
            "wood.png",
            "tex/bump map.png",
            "data file.bin",
            "p.png",
            "unnamed.png",
        ] {
            write(picture, "x");
        }
        write(
            "m.gltf",
            r#"{"buffers": [{"uri": "data%20file.bin"}, {"uri": "data:,"}], "images": [{"uri": "p.png"}]}"#,
        );
        write(
            "m.ply",
            "ply\ncomment TextureFile p.png\nend_header\ncomment TextureFile wood.png\n",
        );
        for (model, named) in [
            (
                "m.obj",
                &["a.mtl", "tex/bump map.png", "two words.mtl", "wood.png"][..],
            ),
            ("m.gltf", &["data file.bin", "p.png"]),
            ("m.ply", &["p.png"]),
        ] {
            let path = folder.path().join(model);
            let found = digests(&path).unwrap();
            assert_eq!(
                found.keys().map(String::as_str).collect::<Vec<_>>(),
                [&[""], named].concat()
            );
            for name in named {
                let before = digests(&path).unwrap();
                let text = fs::read_to_string(folder.path().join(name)).unwrap();
                write(name, &format!("{text} "));
                assert_ne!(digests(&path).unwrap(), before, "{model}: {name}");
            }
            let before = digests(&path).unwrap();
            write("unnamed.png", model);
            assert_eq!(digests(&path).unwrap(), before);
        }
        assert!(digests(&folder.path().join("missing.obj")).is_err());
    }
}
