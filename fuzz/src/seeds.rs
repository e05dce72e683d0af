//! Writes the corpora that the fuzz targets start from: small files of every kind, by the project's own generators and writers.
//!
//! `seeds FOLDER` fills `FOLDER/TARGET/` for every target. The same files come out every time.

mod compressed;

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use silmap_exact::ConeForest;
use silmap_fuzz::{ASSET_FILE, FOREST_MESH, cameras};
use silmap_geometry::ClosedMesh;
use silmap_geometry::Watch;
use silmap_hull::{self as hull, HullParams};
use silmap_map::asset;
use silmap_mesh_io::{LoadOptions, encode, load_bytes};
use silmap_models as models;

/// Fewer faces make smaller files, which a fuzzer gets through faster.
const FACES: usize = 60;

fn main() -> anyhow::Result<()> {
    let folder: PathBuf = std::env::args_os()
        .nth(1)
        .context("usage: seeds FOLDER")?
        .into();
    let small = models::torus(FACES);
    for extension in ["obj", "ply", "stl", "off"] {
        let bytes = encode(Path::new(&format!("torus.{extension}")), &small)?;
        put(&folder, extension, &format!("torus.{extension}"), &bytes)?;
    }
    put(
        &folder,
        "gltf",
        "torus.glb",
        &encode(Path::new("torus.glb"), &small)?,
    )?;
    put(&folder, "gltf", "gltf.gltf", GLTF.as_bytes())?;
    for (name, text) in [
        ("meshopt.gltf", compressed::by_meshopt()?),
        ("draco.gltf", compressed::by_draco()?),
    ] {
        // A seed that is refused leads nowhere.
        load_bytes(Path::new(name), text.as_bytes(), &LoadOptions::default())?;
        put(&folder, "gltf", name, text.as_bytes())?;
    }
    put_cameras(&folder)?;
    for (target, name, text) in TEXTS {
        put(&folder, target, name, text.as_bytes())?;
    }
    put(
        &folder,
        "cone_forest",
        "torus",
        &ConeForest::new(&FOREST_MESH).to_bytes(&FOREST_MESH),
    )?;

    let closed = ClosedMesh::try_from(small)
        .ok()
        .context("a torus is closed")?;
    for (name, inner) in [("outer", false), ("inner", true)] {
        let params = HullParams {
            inner,
            ..HullParams::default()
        };
        let sequence = hull::build(&closed, &params, &Watch::silent())?;
        put(&folder, "hull_sequence", name, &sequence.to_bytes())?;
    }
    put(&folder, "asset", "torus.glb", &ASSET_FILE)?;
    // As text with its data in it: bytes may come and go there without a length that contradicts them.
    let (text, plain) = as_texts(&ASSET_FILE)?;
    put(&folder, "asset", "torus.gltf", text.as_bytes())?;
    put(&folder, "attach", "plain.gltf", plain.as_bytes())?;
    put(&folder, "attach", "whole.glb", &ASSET_FILE)?;
    Ok(())
}

/// An asset's file as a document that holds its data, and that without the extension.
fn as_texts(file: &[u8]) -> anyhow::Result<(String, String)> {
    const CHUNK_HEADER: usize = 8;
    let header = file.first_chunk().context("a file has a header")?;
    let json_length = asset::json_length(header).context("a file begins with JSON")? as usize;
    let (json, rest) = file[asset::HEADER_BYTES..].split_at(json_length);
    let mut document: Value = serde_json::from_slice(json)?;
    let data = STANDARD.encode(&rest[CHUNK_HEADER..]);
    document["buffers"][0]["uri"] = format!("data:application/octet-stream;base64,{data}").into();
    let whole = document.to_string();
    let all = document
        .as_object_mut()
        .context("a document is an object")?;
    all.remove("extensions");
    all.remove("extensionsUsed");
    Ok((whole, document.to_string()))
}

fn put(folder: &Path, target: &str, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = folder.join(target);
    std::fs::create_dir_all(&folder)?;
    let path = folder.join(name);
    std::fs::write(&path, bytes).with_context(|| path.display().to_string())
}

/// Camera files of every kind: the letter that chooses the file, then its bytes.
fn put_cameras(folder: &Path) -> anyhow::Result<()> {
    for (k, name) in cameras::FILES.into_iter().enumerate() {
        let of_model = cameras::COLMAP.iter().find(|(file, _)| *file == name);
        let bytes = match (name.ends_with(".bin"), of_model) {
            (true, _) => cameras::binary(Path::new(name)),
            (_, Some((_, text))) => text.as_bytes().to_vec(),
            _ => CAMERAS
                .iter()
                .find(|(file, _)| *file == name)
                .map_or_else(Vec::new, |(_, text)| text.as_bytes().to_vec()),
        };
        let mut whole = vec![b'a' + u8::try_from(k)?];
        whole.extend(bytes);
        put(folder, "cameras", &name.replace('/', "-"), &whole)?;
    }
    Ok(())
}

/// Camera files that are texts of their own; masks `a` and `b` have 24 × 20 pixels.
const CAMERAS: &[(&str, &str)] = &[
    (
        "cameras.json",
        r#"{"width":24,"height":20,"pixel_centre":0.5,"metric":true,"views":[{"name":"a","P":[[30,0,12,0],[0,30,10,0],[0,0,1,3]]},{"name":"b","K":[[30,0,12],[0,30,10],[0,0,1]],"R":[[0,0,-1],[0,1,0],[1,0,0]],"t":[0,0,3]}]}"#,
    ),
    (
        "transforms.json",
        r#"{"w":24,"h":20,"fl_x":30,"cx":12,"cy":10,"camera_model":"OPENCV","k1":-0.1,"p2":0.01,"frames":[{"file_path":"a","transform_matrix":[[1,0,0,0],[0,1,0,0],[0,0,1,3],[0,0,0,1]]},{"file_path":"b.jpg","camera_model":"OPENCV_FISHEYE","k4":0.1,"transform_matrix":[[0,0,1,3],[0,1,0,0],[-1,0,0,0]]}]}"#,
    ),
    (
        "x_par.txt",
        "2\na.png 30 0 12 0 30 10 0 0 1 1 0 0 0 1 0 0 0 1 0 0 3\nb.png 30 0 12 0 30 10 0 0 1 0 0 -1 0 1 0 1 0 0 0 0 3\n",
    ),
    (
        "cameras.xml",
        r#"<document><chunk><sensors><sensor id="0" type="fisheye"><resolution width="24" height="20"/><calibration type="frame" class="adjusted"><f>30</f><cx>1</cx><b1>.5</b1><k1>-.1</k1><p1>.01</p1></calibration></sensor></sensors><components><component id="0"><transform><rotation>1 0 0 0 1 0 0 0 1</rotation><translation>1 2 3</translation><scale>2</scale></transform></component></components><cameras><camera id="0" sensor_id="0" component_id="0" label="a"><transform>1 0 0 0 0 1 0 0 0 0 1 -3 0 0 0 1</transform></camera><group><camera id="1" sensor_id="0" label="b.jpg"><transform>0 0 1 -3 0 1 0 0 -1 0 0 0 0 0 0 1</transform></camera></group></cameras></chunk></document>"#,
    ),
    (
        "matrices.txt",
        "a.png 30 0 12 36 0 30 10 30 0 0 1 3\nb\n0 0 1 0\n0 1 0 0\n1 0 0 3\n",
    ),
    ("txt/a.txt", "CONTOUR\n30 0 12 36\n0 30 10 30\n0 0 1 3\n"),
];

/// What our own writers do not write: target, file, content.
const TEXTS: &[(&str, &str, &str)] = &[
    (
        "mtl",
        "options.mtl",
        "newmtl m\nKd 1 0.5 0\nd 0.9\nmap_Kd -o 0.5 0.5 0 -s 2 2 1 -clamp on -bm 0.2 t.png\n",
    ),
    (
        "mtl",
        "plain.mtl",
        "newmtl other\nKd 1 1 1\nnewmtl m\nmap_Kd t.png\nKa 0 0 0\nNs 10\nillum 2\n",
    ),
    (
        "obj",
        "polygons.obj",
        "mtllib a.mtl b.mtl\no box\ng side\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0\nv .5 .5 1e0 1\nvt 0 0\nvn 0 0 1\n\
         usemtl m\ns off\nf 4/1/1 3/1/1 2/1/1 1/1/1\nf -5 -4 -1\nf 2//1 3//1 \\\n 5//1\nf 3 4 5\nf 4/1 1/1 5/1\nl 1 2\np 1\n",
    ),
    (
        "ply",
        "strips.ply",
        "ply\nformat ascii 1.0\ncomment TextureFile t.png\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement tristrips 1\nproperty list int int vertex_indices\n\
         end_header\n0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n0 0 1 0 0 0\n8 0 2 1 3 0 2 -1 1\n",
    ),
    (
        "ply",
        "faces.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n\
         property list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         property list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1 255 0 0 6 0 0 1 0 1 1\n\
         3 0 1 3 0 255 0 0\n3 1 2 3 0 0 255 0\n3 2 0 3 9 9 9 0\n",
    ),
    (
        "stl",
        "text.stl",
        "solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 0 1 0\n   vertex 1 0 0\n  endloop\n endfacet\n\
         facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\nendsolid a\n",
    ),
    (
        "off",
        "colours.off",
        "NCOFF # a comment\n4 4 6\n0 0 0 0 0 1 255 0 0 255\n1 0 0 0 0 1 0 255 0 255\n0 1 0 0 0 1 0 0 1 1\n0 0 1 0 0 1 1 1 1 1\n3 0 2 1 255 0 0\n3 0 1 3\n3 1 2 3 0.5 0.5 0.5\n3 2 0 3 4\n",
    ),
    (
        "pose",
        "bare.json",
        r#"{"eye":[3,0.5,1],"target":[0,0,0],"up":[0,0,1],"fov_y_degrees":40}"#,
    ),
    (
        "pose",
        "whole.json",
        r#"{"method":"tight","camera":{"eye":[3.0,1e0,-2],"fov_y_degrees":null},"loops":[]}"#,
    ),
];

/// A tetrahedron with a transformed texture, a sparse accessor, an instance, a skin and a morph target, the buffer in the text.
const GLTF: &str = include_str!("tetrahedron.gltf");
