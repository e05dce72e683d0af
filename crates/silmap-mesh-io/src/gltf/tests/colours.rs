//! Colours: textures moved, wrapped and cut out, vertex colours, materials of other kinds.

use serde_json::json;

use super::build::{Builder, cube, encoded, quarters, seen, textured};
use crate::{AlphaUse, LoadOptions, close};

fn upright() -> Builder {
    textured(|u, v| [u, v], &quarters())
}

fn with_transform(mut builder: Builder, transform: serde_json::Value) -> Builder {
    builder.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": transform});
    builder.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    builder
}

#[test]
fn texture_transforms_move_scale_turn_and_choose_coordinates() {
    assert_eq!(seen(&upright().read().unwrap()), "rgby");
    for (transform, wanted) in [
        (json!({"offset": [0.5, 0.5]}), "ybgr"),
        (json!({"scale": [0.5, 0.5]}), "rrrr"),
        (json!({"scale": [0.5, 1]}), "rrbb"),
        // A quarter against the clock about the origin, and the picture turns with the clock: (u, v) → (v, −u).
        (json!({"rotation": std::f64::consts::FRAC_PI_2}), "bryg"),
        (json!({"rotation": std::f64::consts::PI}), "ybgr"),
        // Scaled first, then turned, then moved.
        (
            json!({"scale": [0.5, 1], "rotation": std::f64::consts::FRAC_PI_2, "offset": [0, 1]}),
            "bbyy",
        ),
    ] {
        let builder = with_transform(upright(), transform.clone());
        let (raw, _, warnings) = builder.shape();
        assert_eq!(seen(&raw), wanted, "{transform}");
        assert!(warnings.is_empty(), "{warnings:?}");
    }
    // Another set of coordinates, all of which name the blue quarter.
    let mut builder = with_transform(upright(), json!({"texCoord": 1}));
    let blue = builder.floats("VEC2", &[[0.25, 0.75]; 24].concat());
    builder.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(blue);
    assert_eq!(seen(&builder.read().unwrap()), "bbbb");
    let mut builder = with_transform(upright(), json!({"offset": "left"}));
    assert!(
        builder
            .refusal()
            .starts_with("extension KHR_texture_transform cannot be read: ")
    );
    builder.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = json!(4);
    assert!(builder.read().is_err());
}

#[test]
fn samplers_wrap_each_axis_in_its_own_way() {
    let moved = |du: f32, dv: f32, sampler: serde_json::Value| {
        let mut builder = textured(|u, v| [u + du, v + dv], &quarters());
        builder.push("samplers", sampler);
        builder.json["textures"][0]["sampler"] = json!(0);
        seen(&builder.read().unwrap())
    };
    assert_eq!(
        moved(1.0, 0.0, json!({"wrapS": 33648, "wrapT": 33071})),
        "gryb"
    );
    assert_eq!(moved(1.0, 1.0, json!({})), "rgby");
    assert_eq!(moved(0.0, 1.0, json!({"wrapT": 33648})), "byrg");
    assert_eq!(moved(1.0, 0.0, json!({"wrapS": 33071})), "ggyy");
    assert_eq!(
        moved(1.0, -1.0, json!({"wrapS": 33071, "wrapT": 33071})),
        "gggg"
    );
    assert_eq!(moved(2.0, 0.0, json!({"wrapS": 33648})), "rgby");
}

#[test]
fn coordinates_and_colours_may_be_integers() {
    let mut builder = upright();
    // The same coordinates in bytes, between others.
    let uvs = [[0_u8, 255], [255, 255], [255, 0], [0, 0]];
    let bytes: Vec<u8> = (0..24)
        .flat_map(|i| [uvs[i % 4][0], uvs[i % 4][1], 7, 7])
        .collect();
    let view = builder.view(&bytes, json!({"byteStride": 4}));
    let uvs = builder.push(
        "accessors",
        json!({"bufferView": view, "componentType": 5121, "normalized": true, "count": 24, "type": "VEC2"}),
    );
    builder.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    assert_eq!(seen(&builder.read().unwrap()), "rgby");
    let mut builder = cube();
    let red: Vec<u8> = [[255_u8, 0, 0, 128]; 8].concat();
    let red = builder.accessor(&red, ("VEC4", 5121, 8), json!({}));
    builder.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(red);
    let raw = builder.read().unwrap();
    assert_eq!(raw.mesh.appearance.corner_colours[0], [[1.0, 0.0, 0.0]; 3]);
}

#[test]
fn pictures_and_colours_of_other_extensions_are_used() {
    let mut builder = upright();
    let webp = encoded(&quarters(), image::ImageFormat::WebP);
    let view = builder.view(&webp, json!({}));
    builder.push(
        "images",
        json!({"bufferView": view, "mimeType": "image/webp"}),
    );
    builder.json["textures"][0] = json!({"extensions": {"EXT_texture_webp": {"source": 1}}});
    builder.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
    assert_eq!(seen(&builder.read().unwrap()), "rgby");
    // An older kind of material, with its own colour and texture.
    let mut builder = upright();
    builder.json["materials"][0] = json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
        "extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1, 0, 1, 1], "diffuseTexture": {"index": 0}}},
    });
    builder.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
    assert_eq!(seen(&builder.read().unwrap()), "r?br");
    // A picture that is there in a form that is not read, and in one that is.
    let mut builder = upright();
    builder.json["textures"][0]["extensions"] = json!({"KHR_texture_basisu": {"source": 5}});
    builder.json["extensionsUsed"] = json!(["KHR_texture_basisu"]);
    let (raw, _, warnings) = builder.shape();
    assert_eq!(seen(&raw), "rgby");
    assert_eq!(
        warnings,
        ["extension KHR_texture_basisu is not read here and was left out"]
    );
}

#[test]
fn cut_out_faces_go_on_request_and_are_told_of_otherwise() {
    // The lower half of the picture is clear; the side at +z shows that half alone, the others the upper one.
    let mut picture = quarters();
    for (_, y, pixel) in picture.enumerate_pixels_mut() {
        pixel[3] = if y < 8 { 255 } else { 20 };
    }
    let mut builder = textured(|u, v| [u, 0.5 * v], &picture);
    let mut uvs = vec![0.0_f32; 48];
    for (i, uv) in uvs.chunks_exact_mut(2).enumerate() {
        let (u, v) = [(0.0, 0.5), (1.0, 0.5), (1.0, 0.0), (0.0, 0.0)][i % 4];
        let is_front = i / 4 == 5;
        uv.copy_from_slice(&[u, if is_front { v + 0.5 } else { v }]);
    }
    let uvs = builder.floats("VEC2", &uvs);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    let load = |builder: &Builder, alpha, close_holes| {
        let options = LoadOptions {
            alpha,
            close_holes,
            ..LoadOptions::default()
        };
        close(builder.read().unwrap(), &options).map(|(mesh, warnings)| {
            let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
            (mesh.mesh().faces.len(), warnings)
        })
    };
    assert_eq!(load(&builder, AlphaUse::Mask, false).unwrap(), (12, vec![]));
    builder.json["materials"][0]["alphaMode"] = json!("MASK");
    let (faces, warnings) = load(&builder, AlphaUse::Opaque, false).unwrap();
    assert_eq!(faces, 12);
    assert_eq!(
        warnings,
        [
            "2 faces not drawn by a material that cuts out by alpha: taken as if opaque (--alpha mask takes them out)"
        ]
    );
    let fault = load(&builder, AlphaUse::Mask, false)
        .unwrap_err()
        .to_string();
    assert_eq!(
        fault,
        "open: 4 boundary edges in 1 loop, the first is (1, 2) (--close-holes may help)"
    );
    let (faces, warnings) = load(&builder, AlphaUse::Mask, true).unwrap();
    assert!(faces >= 12);
    assert_eq!(
        warnings[0],
        "2 faces that a material cuts out by alpha: taken out"
    );
    // The cutoff decides, and so does the factor.
    builder.json["materials"][0]["alphaCutoff"] = json!(0.05);
    assert_eq!(load(&builder, AlphaUse::Mask, false).unwrap(), (12, vec![]));
    builder.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 0.5]);
    assert!(load(&builder, AlphaUse::Mask, false).is_err());
    // What shows in part stays.
    let mut partly = textured(|u, v| [u, v], &picture);
    partly.json["materials"][0]["alphaMode"] = json!("MASK");
    let (faces, warnings) = load(&partly, AlphaUse::Mask, false).unwrap();
    assert_eq!(faces, 12);
    assert_eq!(
        warnings,
        ["12 faces only partly drawn by a material that cuts out by alpha: taken whole"]
    );
    partly.json["materials"][0]["alphaMode"] = json!("BLEND");
    let (_, warnings) = load(&partly, AlphaUse::Mask, false).unwrap();
    assert_eq!(
        warnings,
        ["transparent materials (alphaMode BLEND) are drawn opaque"]
    );
}

#[test]
fn vertex_colours_without_a_texture_cut_out_as_well() {
    let mut builder = cube();
    // Clear at the four corners at x = ½, where two faces lie.
    let colours: Vec<f32> = (0..8)
        .flat_map(|i| [1.0, 1.0, 1.0, if i < 4 { 1.0 } else { 0.1 }])
        .collect();
    let colours = builder.floats("VEC4", &colours);
    builder.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colours);
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    builder.push("materials", json!({"alphaMode": "MASK"}));
    let raw = builder.read().unwrap();
    assert_eq!(raw.alpha.hidden, [2, 3]);
    assert_eq!(raw.alpha.partly, 8);
}
