//! What a file is, by its first bytes.
//!
//! Names lie: a download that failed is a page of HTML, an archive holds the mesh, a tool saved PLY under the name of an STL
//! file. What is a mesh of a known format is read as what it is; what is something else is named, with the way out.

use super::Format;

/// How many bytes from the start are looked at.
const LOOKED_AT: usize = 4096;

/// What a file holds that is no mesh which is read here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Foreign {
    /// What it is, with its article.
    pub(super) what: &'static str,
    /// What to do about it.
    pub(super) way_out: &'static str,
}

const PICTURE: &str = "a mesh is needed";
const UNPACK: &str = "unpack it first";
const EXPORT: &str =
    "export it from the program that wrote it, or from Blender, as .glb, .obj, .ply or .stl";
const TESSELLATE: &str = "it holds curved surfaces: mesh it in a CAD program such as FreeCAD and save that as .stl or .obj";
pub(super) const POINTS: &str = "points have no surface: reconstruct one first, for example with MeshLab or Open3D, and save that as .ply";

/// Files of other kinds by what they begin with.
const BY_START: [(&[u8], &str, &str); 34] = [
    (b"\xFF\xD8\xFF", "a JPEG picture", PICTURE),
    (b"\x89PNG\r\n\x1a\n", "a PNG picture", PICTURE),
    (b"GIF8", "a GIF picture", PICTURE),
    (b"II*\0", "a TIFF picture", PICTURE),
    (b"MM\0*", "a TIFF picture", PICTURE),
    (b"\x76\x2f\x31\x01", "an OpenEXR picture", PICTURE),
    (b"8BPS", "a Photoshop picture", PICTURE),
    (b"DDS ", "a DDS texture", PICTURE),
    (b"\xABKTX ", "a KTX texture", PICTURE),
    (b"%PDF-", "a PDF document", EXPORT),
    (b"\x1f\x8b", "a gzip archive", UNPACK),
    (b"BZh", "a bzip2 archive", UNPACK),
    (b"\xFD7zXZ\0", "an xz archive", UNPACK),
    (b"\x28\xB5\x2F\xFD", "a Zstandard archive", UNPACK),
    (b"7z\xBC\xAF\x27\x1C", "a 7z archive", UNPACK),
    (b"Rar!\x1a\x07", "a RAR archive", UNPACK),
    (b"Kaydara FBX Binary", "an FBX file", EXPORT),
    (b"; FBX", "an FBX file", EXPORT),
    (
        b"BLENDER",
        "a Blender file",
        "export it from Blender as .glb, .obj, .ply or .stl",
    ),
    (b"PXR-USDC", "a USD file", EXPORT),
    (b"#usda", "a USD file", EXPORT),
    (b"ISO-10303-21", "a STEP file", TESSELLATE),
    (b"DBRep_DrawableShape", "an OpenCASCADE shape", TESSELLATE),
    (b"CASCADE Topology", "an OpenCASCADE shape", TESSELLATE),
    (b"#VRML", "a VRML file", EXPORT),
    (b"#X3D", "an X3D file", EXPORT),
    (
        b"# vtk DataFile",
        "a VTK file",
        "save it from ParaView as .ply or .stl",
    ),
    (b"# .PCD", "a point cloud of PCL", POINTS),
    (b"LASF", "a LAS point cloud", POINTS),
    (
        b"DRACO",
        "a Draco mesh",
        "decode it with draco_decoder, or export the model as .glb or .ply",
    ),
    (
        b"VOX ",
        "a MagicaVoxel model",
        "export it from MagicaVoxel as .obj or .ply",
    ),
    (b"$MeshFormat", "a Gmsh mesh", "save it from Gmsh as .stl"),
    (
        b"MeshVersionFormatted",
        "a Medit mesh",
        "save it from Gmsh as .stl",
    ),
    (
        b"version https://git-lfs",
        "a pointer of Git LFS, not the file itself",
        "run `git lfs pull`",
    ),
];

/// What a file is if it is no mesh that is read here, as far as its content shows.
pub(super) fn foreign(bytes: &[u8]) -> Option<Foreign> {
    let found = |what, way_out| Some(Foreign { what, way_out });
    for (start, what, way_out) in BY_START {
        if bytes.starts_with(start) {
            return found(what, way_out);
        }
    }
    let head = &bytes[..bytes.len().min(LOOKED_AT)];
    let has = |word: &[u8]| {
        head.windows(word.len())
            .any(|w| w.eq_ignore_ascii_case(word))
    };
    if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        return found("a WebP picture", PICTURE);
    }
    if bytes.starts_with(b"BM") && bytes.get(6..10) == Some(&[0; 4]) {
        return found("a BMP picture", PICTURE);
    }
    if bytes.starts_with(b"PK\x03\x04") {
        // The names of what is in it stand in clear.
        return if has(b"3dmodel.model") || has(b"[Content_Types].xml") {
            found(
                "a 3MF file",
                "export it from the program that wrote it, or from MeshLab, as .stl or .obj",
            )
        } else if has(b".usdc") || has(b".usda") {
            found("a USDZ file", EXPORT)
        } else {
            found("a zip archive", UNPACK)
        };
    }
    let start = text_start(head);
    let begins = |word: &[u8]| {
        start
            .get(..word.len())
            .is_some_and(|found| found.eq_ignore_ascii_case(word))
    };
    if begins(b"<!doctype html") || begins(b"<html") || begins(b"<head") {
        return found(
            "a page of HTML, such as a download that failed leaves",
            "fetch the file itself",
        );
    }
    if begins(b"<?xml") || begins(b"<") {
        return if has(b"<COLLADA") {
            found("a COLLADA file", EXPORT)
        } else if has(b"<X3D") {
            found("an X3D file", EXPORT)
        } else if has(b"<svg") {
            found("an SVG picture", PICTURE)
        } else if has(b"<amf") {
            found("an AMF file", EXPORT)
        } else if has(b"<VTKFile") {
            found("a VTK file", "save it from ParaView as .ply or .stl")
        } else if has(b"<html") {
            found(
                "a page of HTML, such as a download that failed leaves",
                "fetch the file itself",
            )
        } else {
            found("an XML document", EXPORT)
        };
    }
    if begins(b"0") && has(b"SECTION") && has(b"HEADER") && !has(b"facet") {
        return found("a DXF drawing", EXPORT);
    }
    None
}

fn text_start(head: &[u8]) -> &[u8] {
    let head = head.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(head);
    head.trim_ascii_start()
}

/// The format by the first bytes.
pub(super) fn sniff(bytes: &[u8]) -> Option<Format> {
    let head = &bytes[..bytes.len().min(LOOKED_AT)];
    let start = text_start(head);
    let first_line = start
        .split(|&b| b == b'\n' || b == b'\r')
        .next()
        .unwrap_or_default()
        .trim_ascii();
    let lines = || {
        start
            .split(|&b| b == b'\n' || b == b'\r')
            .map(<[u8]>::trim_ascii)
    };
    let any_begins =
        |words: &[&[u8]]| lines().any(|line| words.iter().any(|w| line.starts_with(w)));
    let has_facets = || {
        start
            .windows(6)
            .any(|word| word.eq_ignore_ascii_case(b"facet "))
    };
    if start.starts_with(b"glTF") {
        Some(Format::Glb)
    } else if start.starts_with(b"{") {
        Some(Format::Gltf)
    } else if first_line.eq_ignore_ascii_case(b"ply") {
        Some(Format::Ply)
    } else if is_off_keyword(first_line) {
        Some(Format::Off)
    } else if any_begins(&[b"v ", b"v\t"])
        && any_begins(&[b"v ", b"f ", b"vt ", b"vn ", b"o ", b"g "])
        || any_begins(&[b"mtllib "])
    {
        Some(Format::Obj)
    } else if start
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        || has_facets()
        || super::stl::has_binary_length(bytes)
    {
        Some(Format::Stl)
    } else {
        None
    }
}

/// `OFF` with letters that announce something before it, and nothing but numbers behind it.
fn is_off_keyword(line: &[u8]) -> bool {
    let is_letter = |b: u8| b"STCN4n".contains(&b);
    let Some(at) = line.windows(3).position(|w| w.eq_ignore_ascii_case(b"OFF")) else {
        return false;
    };
    let rest = line[at + 3..].trim_ascii();
    line[..at]
        .iter()
        .all(|&b| is_letter(b.to_ascii_uppercase()) || b == b'n')
        && (rest
            .iter()
            .all(|&b| b.is_ascii_digit() || b == b' ' || b == b'\t')
            || rest.starts_with(b"#")
            || rest.starts_with(b"BINARY"))
}

/// The format a file's content is, where it is plainly another one than its name says.
pub(super) fn contradicts(bytes: &[u8], named: Format) -> Option<Format> {
    let found = sniff(bytes)?;
    let is_gltf = |f: Format| matches!(f, Format::Gltf | Format::Glb);
    if found == named
        || is_gltf(named)
        || (named == Format::Stl && super::stl::has_binary_length(bytes))
    {
        // The glTF reader itself distinguishes what files of these names hold.
        return None;
    }
    // A file of no clear beginning is what its name says.
    let is_clear = match found {
        Format::Ply | Format::Glb | Format::Off | Format::Obj => true,
        Format::Gltf => bytes.windows(7).take(LOOKED_AT).any(|w| w == b"\"asset\""),
        Format::Stl => {
            super::stl::has_binary_length(bytes)
                || bytes[..bytes.len().min(LOOKED_AT)]
                    .windows(13)
                    .any(|w| w.eq_ignore_ascii_case(b"facet normal "))
        }
    };
    is_clear.then_some(found)
}
