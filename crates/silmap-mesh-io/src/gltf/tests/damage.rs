//! Valid files, damaged: whatever comes of it, it is a mesh or one sentence.

use std::path::Path;

use proptest::prelude::*;
use serde_json::{Value, json};

use super::build::{Builder, cube, quarters, textured};
use super::compressed;
use crate::{AlphaUse, LoadOptions, close};

/// Files with something of everything.
fn files() -> Vec<Builder> {
    let mut skinned = cube();
    let joints = skinned.accessor(&[0; 32], ("VEC4", 5121, 8), json!({}));
    let weights = skinned.floats("VEC4", &[[1.0, 0.0, 0.0, 0.0]; 8].concat());
    let target = skinned.floats("VEC3", &[0.25; 24]);
    let matrices = skinned.floats("MAT4", &[1.0; 16]);
    let primitive = &mut skinned.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["JOINTS_0"] = json!(joints);
    primitive["attributes"]["WEIGHTS_0"] = json!(weights);
    primitive["targets"] = json!([{"POSITION": target}]);
    skinned.json["meshes"][0]["weights"] = json!([0.5]);
    skinned.json["nodes"] =
        json!([{"mesh": 0, "skin": 0, "children": [1]}, {"rotation": [0, 0, 0, 1]}]);
    skinned.json["skins"] = json!([{"joints": [1], "inverseBindMatrices": matrices}]);
    let mut many = textured(|u, v| [u, v], &quarters());
    let places = many.floats("VEC3", &[0.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
    many.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    many.push("samplers", json!({"wrapS": 33648, "wrapT": 33071}));
    many.json["textures"][0]["sampler"] = json!(0);
    many.json["materials"][0]["alphaMode"] = json!("MASK");
    many.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": {"offset": [0.5, 0.5], "scale": [2, 2]}});
    let mut sparse = cube();
    let which = sparse.view(&[7, 0, 0, 0], json!({}));
    sparse.json["accessors"][0]["sparse"] = json!({"count": 1, "indices": {"bufferView": which, "componentType": 5121}, "values": {"bufferView": 0}});
    vec![
        skinned,
        many,
        sparse,
        compressed::plain(),
        compressed::draco(),
    ]
}

/// All places of a JSON value.
fn places(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Array(list) => {
            for (i, element) in list.iter().enumerate() {
                places(element, &format!("{at}/{i}"), found);
            }
        }
        Value::Object(map) => {
            for (key, element) in map {
                places(element, &format!("{at}/{key}"), found);
            }
        }
        _ => (),
    }
}

fn nasty() -> impl Strategy<Value = Value> {
    prop::sample::select(vec![
        json!(null),
        json!(0),
        json!(1),
        json!(2),
        json!(7),
        json!(-1),
        json!(0.5),
        json!(1e300),
        json!(3_000_000_000_u64),
        json!(u64::MAX),
        json!("VEC4"),
        json!(""),
        json!([]),
        json!({}),
        json!([0, 0, 0, 0]),
        json!(true),
        json!(5123),
        json!(5126),
    ])
}

fn check(bytes: &[u8]) -> Result<(), TestCaseError> {
    let outcome = super::super::read(bytes, true, Path::new("no such folder")).and_then(|raw| {
        let options = LoadOptions {
            close_holes: true,
            repair: true,
            alpha: AlphaUse::Mask,
            weld: None,
        };
        close(raw, &options)
    });
    if let Err(fault) = outcome {
        let said = fault.to_string();
        prop_assert!(!said.contains('\n') && !said.is_empty(), "{}", said);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn documents_with_other_values_end_in_a_sentence_or_a_mesh(
        which in 0_usize..5,
        changes in prop::collection::vec((any::<prop::sample::Index>(), nasty()), 1..4),
    ) {
        let mut builder = files().swap_remove(which);
        let mut found = Vec::new();
        if builder.json["buffers"].is_null() {
            builder.json["buffers"] = json!([{"byteLength": builder.data.len()}]);
        }
        places(&builder.json, "", &mut found);
        // All but the document as a whole.
        found.remove(0);
        for (place, value) in changes {
            let place = &found[place.index(found.len())];
            if let Some(slot) = builder.json.pointer_mut(place) {
                *slot = value;
            }
        }
        check(&builder.glb())?;
    }

    #[test]
    fn damaged_bytes_end_in_a_sentence_or_a_mesh(
        which in 0_usize..5,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        in_data in any::<bool>(),
    ) {
        let builder = files().swap_remove(which);
        let mut bytes = builder.glb();
        let first = if in_data { bytes.len() - builder.data.len() } else { 0 };
        for (place, value) in changes {
            let at = first + place.index(bytes.len() - first);
            bytes[at] = value;
        }
        check(&bytes)?;
    }
}
