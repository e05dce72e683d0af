//! Shapes: quantised, sparse, instanced, skinned, morphed, hidden, shared.

use glam::DVec3;
use serde_json::json;

use super::build::{Builder, FLOAT, corner, corners, cube, cube_indices, floats, shorts};

fn assert_near(found: f64, wanted: f64) {
    assert!((found - wanted).abs() < 1e-6, "{found} for {wanted}");
}

#[test]
fn quantised_positions_are_read() {
    for (normalized, scale) in [(true, 0.5), (false, 0.5 / 32_767.0)] {
        let mut builder = Builder::new();
        let bytes: Vec<u8> = (0..8)
            .flat_map(|i| {
                let [x, y, z] = corner(i).map(|c| (2.0 * c * 32_767.0) as i16);
                [x, y, z, 0].into_iter().flat_map(i16::to_le_bytes)
            })
            .collect();
        let view = builder.view(&bytes, json!({"byteStride": 8}));
        let positions = builder.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5122, "normalized": normalized, "count": 8, "type": "VEC3"}),
        );
        let indices = builder.indices(&cube_indices());
        builder.mesh(json!({"attributes": {"POSITION": positions}, "indices": indices}));
        builder.json["nodes"][0]["scale"] = json!([scale, scale, scale]);
        builder.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        builder.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let (_, volume, warnings) = builder.shape();
        assert_near(volume, 1.0);
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}

#[test]
fn sparse_accessors_change_a_base_or_stand_alone() {
    // Without a base: all corners are given.
    let mut builder = Builder::new();
    let which = builder.view(&(0..8).collect::<Vec<u8>>(), json!({}));
    let values = builder.view(&floats(&corners()), json!({}));
    let sparse = json!({"count": 8, "indices": {"bufferView": which, "componentType": 5121}, "values": {"bufferView": values}});
    let positions = builder.push(
        "accessors",
        json!({"componentType": FLOAT, "count": 8, "type": "VEC3", "sparse": sparse}),
    );
    let indices = builder.indices(&cube_indices());
    builder.mesh(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    assert_near(builder.shape().1, 1.0);

    // With one: the side at x = ½ is moved to 1½, and one index that was wrong is put right.
    let mut builder = cube();
    let moved: Vec<f32> = (4..8)
        .flat_map(|i| [1.5, corner(i)[1], corner(i)[2]])
        .collect();
    let which = builder.view(&shorts(&[4, 5, 6, 7]), json!({}));
    let values = builder.view(&floats(&moved), json!({}));
    builder.json["accessors"][0]["sparse"] = json!({"count": 4, "indices": {"bufferView": which, "componentType": 5123}, "values": {"bufferView": values}});
    let mut wrong = cube_indices();
    let right = std::mem::replace(&mut wrong[7], 0);
    let indices = builder.indices(&wrong);
    let which = builder.view(&[7, 0, 0, 0], json!({}));
    let values = builder.view(&shorts(&[right]), json!({}));
    builder.json["accessors"][indices]["sparse"] = json!({"count": 1, "indices": {"bufferView": which, "componentType": 5125}, "values": {"bufferView": values}});
    builder.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    assert_near(builder.shape().1, 2.0);

    let mut beyond = builder.clone();
    beyond.json["accessors"][0]["sparse"]["count"] = json!(5);
    assert_eq!(
        beyond.refusal(),
        "accessor 0 reaches past the end of its buffer view"
    );
    let mut falling = builder.clone();
    falling.json["accessors"][0]["sparse"]["count"] = json!(2);
    falling.json["accessors"][0]["sparse"]["indices"]["byteOffset"] = json!(6);
    assert!(falling.read().is_err());
    let mut claimed = builder;
    claimed.json["accessors"][0]["bufferView"].take();
    claimed.json["accessors"][0]["count"] = json!(4_000_000_000_u64);
    assert_eq!(
        claimed.refusal(),
        "accessor 0: it has more elements without data than the file has bytes"
    );
}

#[test]
fn instances_are_moved_turned_and_scaled() {
    let mut builder = cube();
    let places = builder.floats("VEC3", &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 4.0, 0.0, 0.0]);
    let attributes =
        |more: serde_json::Value| json!({"EXT_mesh_gpu_instancing": {"attributes": more}});
    builder.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    builder.json["nodes"][0]["extensions"] = attributes(json!({"TRANSLATION": places}));
    let (raw, volume, warnings) = builder.shape();
    assert_near(volume, 3.0);
    assert_near(raw.mesh.bounds().max.x, 4.5);
    assert!(warnings.is_empty(), "{warnings:?}");

    // A long box, turned about z by quarters in three kinds of numbers, one of them mirrored.
    let half = 0.5_f32.sqrt();
    builder.json["nodes"][0]["scale"] = json!([1, 1, 1]);
    let sizes = builder.floats("VEC3", &[3.0, 1.0, 1.0, 3.0, 1.0, -1.0, 3.0, 1.0, 1.0]);
    for (component, one) in [(FLOAT, 0.0), (5122, 32_767.0), (5120, 127.0_f32)] {
        let turns = [
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, half, half],
            [0.0, 0.0, half, half],
        ];
        let bytes: Vec<u8> = (turns.as_flattened().iter())
            .flat_map(|&x| match component {
                FLOAT => x.to_le_bytes().to_vec(),
                5122 => ((x * one).round() as i16).to_le_bytes().to_vec(),
                _ => ((x * one).round() as i8).to_le_bytes().to_vec(),
            })
            .collect();
        let turns = builder.accessor(
            &bytes,
            ("VEC4", component, 3),
            json!({"normalized": component != FLOAT}),
        );
        builder.json["nodes"][0]["extensions"] =
            attributes(json!({"TRANSLATION": places, "ROTATION": turns, "SCALE": sizes, "_ID": 0}));
        let (raw, volume, _) = builder.shape();
        assert_near(volume, 9.0);
        let bounds = raw.mesh.bounds();
        let wanted = DVec3::new(4.5, 1.5, 0.5);
        assert!(
            (bounds.max - wanted).length() < 1e-2,
            "{component}: {bounds:?}"
        );
    }
    let two = builder.floats("VEC3", &[1.0; 6]);
    builder.json["nodes"][0]["extensions"] =
        attributes(json!({"TRANSLATION": places, "SCALE": two}));
    assert_eq!(
        builder.refusal(),
        "node 0: the attributes of its instances have different lengths"
    );
}

/// The cube on two joints: the side at x = ½ follows joint 1, the other joint 0.
fn skinned() -> Builder {
    let mut builder = cube();
    let joints: Vec<u8> = (0..8).flat_map(|i| [i >> 2, 1, 0, 0]).collect();
    let joints = builder.accessor(&joints, ("VEC4", 5121, 8), json!({}));
    let weights: Vec<u8> = (0..8).flat_map(|_| [255, 0, 0, 0]).collect();
    let weights = builder.accessor(&weights, ("VEC4", 5121, 8), json!({"normalized": true}));
    let attributes = &mut builder.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    builder.json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0], "scale": [7, 7, 7]},
        {"children": [2], "translation": [0, 0, 5]},
        {"translation": [1, 0, 0]},
    ]);
    builder.json["skins"] = json!([{"joints": [1, 2]}]);
    builder.json["scenes"][0]["nodes"] = json!([0, 1]);
    builder
}

#[test]
fn skins_pull_vertices_to_their_joints() {
    // Without inverse bind matrices, the joints alone move the vertices; the mesh's node does not.
    let mut builder = skinned();
    let (raw, volume, warnings) = builder.shape();
    assert_near(volume, 2.0);
    assert!(warnings.is_empty(), "{warnings:?}");
    let bounds = raw.mesh.bounds();
    assert!(
        (bounds.min - DVec3::new(-0.5, -0.5, 4.5)).length() < 1e-9,
        "{bounds:?}"
    );
    // In the pose they were bound in, everything stays where it is stored.
    let inverse = |x: f32| {
        let mut matrix = [0.0_f32; 16];
        for k in [0, 5, 10, 15] {
            matrix[k] = 1.0;
        }
        (matrix[12], matrix[14]) = (-x, -5.0);
        matrix
    };
    let matrices = builder.floats("MAT4", [inverse(0.0), inverse(1.0)].as_flattened());
    builder.json["skins"][0]["inverseBindMatrices"] = json!(matrices);
    let (raw, volume, _) = builder.shape();
    assert_near(volume, 1.0);
    assert_near(raw.mesh.bounds().max.x, 0.5);
    // Half the weight in a second set of joints: one side follows joint 1 by half.
    let joints: Vec<u8> = [0; 32].to_vec();
    let joints = builder.accessor(&joints, ("VEC4", 5121, 8), json!({}));
    let weights = builder.floats("VEC4", &[[0.5, 0.0, 0.0, 0.0]; 8].concat());
    let attributes = &mut builder.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_1"] = json!(joints);
    attributes["WEIGHTS_1"] = json!(weights);
    attributes["WEIGHTS_0"] = json!(weights);
    builder.json["skins"][0]
        .as_object_mut()
        .unwrap()
        .remove("inverseBindMatrices");
    assert_near(builder.shape().1, 1.5);
    // A mirrored skeleton turns the faces over.
    builder.json["nodes"][1]["scale"] = json!([1, -1, 1]);
    assert_near(builder.shape().1, 1.5);
    builder.json["skins"][0]["joints"] = json!([1]);
    assert_eq!(
        builder.refusal(),
        "skin 0: joint 1 out of range, past the last of 1"
    );
}

#[test]
fn morph_targets_count_by_their_default_weights() {
    let mut builder = cube();
    // One target widens the cube by two along x, the other by one along y.
    let along = |axis: usize, by: f32| -> Vec<f32> {
        let moved = |i: usize| {
            let mut delta = [0.0; 3];
            delta[axis] = if corner(i)[axis] > 0.0 { by } else { 0.0 };
            delta
        };
        (0..8).flat_map(moved).collect()
    };
    let wide = builder.floats("VEC3", &along(0, 2.0));
    let tall = builder.floats("VEC3", &along(1, 1.0));
    builder.json["meshes"][0]["primitives"][0]["targets"] =
        json!([{"POSITION": wide}, {"POSITION": tall, "NORMAL": 999}]);
    assert_near(builder.shape().1, 1.0);
    builder.json["meshes"][0]["weights"] = json!([1, 0]);
    assert_near(builder.shape().1, 3.0);
    builder.json["nodes"][0]["weights"] = json!([0.5, 1.0]);
    let (_, volume, warnings) = builder.shape();
    assert_near(volume, 4.0);
    assert!(warnings.is_empty(), "{warnings:?}");
    // A target may be a few vertices alone.
    let which = builder.view(&[7, 0], json!({}));
    let values = builder.view(&floats(&[1.0, 1.0, 1.0]), json!({}));
    let sparse = json!({"count": 1, "indices": {"bufferView": which, "componentType": 5121}, "values": {"bufferView": values}});
    let few = builder.push(
        "accessors",
        json!({"componentType": FLOAT, "count": 8, "type": "VEC3", "sparse": sparse}),
    );
    builder.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": few}]);
    builder.json["nodes"][0]["weights"] = json!([1]);
    let (raw, _, _) = builder.shape();
    assert_near(raw.mesh.bounds().max.z, 1.5);
    builder.json["accessors"][few]["count"] = json!(7);
    assert!(
        builder.refusal().contains("sparse index"),
        "{}",
        builder.refusal()
    );
}

#[test]
fn extensions_are_read_needed_or_named() {
    let mut builder = cube();
    builder.json["extensionsUsed"] = json!([
        "KHR_lights_punctual",
        "KHR_xmp_json_ld",
        "ACME_thing",
        "KHR_materials_unlit"
    ]);
    let (_, _, warnings) = builder.shape();
    assert_eq!(warnings.len(), 3, "{warnings:?}");
    assert!(warnings[1].contains("ACME_thing is not read here"));
    builder.json["extensionsRequired"] = json!(["KHR_materials_unlit"]);
    assert_near(builder.shape().1, 1.0);
    builder.json["extensionsRequired"] = json!(["ACME_thing"]);
    assert_eq!(
        builder.refusal(),
        "needs ACME_thing, which is not read here"
    );
    builder.json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    let refusal = builder.refusal();
    assert!(
        refusal.starts_with("needs KHR_texture_basisu, which is not read here (")
            && refusal.contains("`npx "),
        "{refusal}"
    );
    // Node visibility, and levels of detail that hang on a node without being its children.
    let mut builder = cube();
    builder.json["nodes"] = json!([
        {"children": [1, 2]},
        {"mesh": 0},
        {"mesh": 0, "translation": [5, 0, 0], "extensions": {"KHR_node_visibility": {"visible": false}}},
    ]);
    let (_, volume, warnings) = builder.shape();
    assert_near(volume, 1.0);
    assert_eq!(warnings, ["nodes that the file hides were left out"]);
    let mut builder = cube();
    builder.json["nodes"] =
        json!([{"mesh": 0, "extensions": {"MSFT_lod": {"ids": [1]}}}, {"mesh": 0}]);
    builder.json["scenes"].take();
    builder.json["scenes"] = json!([]);
    builder.json.as_object_mut().unwrap().remove("scene");
    assert_near(builder.shape().1, 1.0);
}

#[test]
fn one_buffer_may_serve_many_primitives_and_places_are_exact() {
    let mut builder = cube();
    let sides: Vec<usize> = (0..6)
        .map(|s| builder.indices(&cube_indices()[6 * s..6 * s + 6]))
        .collect();
    let primitives: Vec<_> = sides
        .iter()
        .map(|&indices| json!({"attributes": {"POSITION": 0}, "indices": indices}))
        .collect();
    builder.json["meshes"][0]["primitives"] = json!(primitives);
    // Digits beyond single precision hold.
    builder.json["nodes"][0]["translation"] = json!([500_000.123_456_789, 0, 0]);
    let (raw, volume, _) = builder.shape();
    assert_near(volume, 1.0);
    assert_eq!(raw.mesh.positions.len(), 24);
    assert_eq!(raw.mesh.positions[0].x, 500_000.123_456_789 - 0.5);
}

#[test]
fn containers_may_hold_more_and_numbers_may_be_written_as_fractions() {
    let mut bytes = cube().glb();
    bytes.extend([4, 0, 0, 0]);
    bytes.extend(b"NOTEabcd");
    let length = bytes.len() as u32;
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    let read = |bytes: &[u8]| super::super::read(bytes, true, std::path::Path::new(""));
    assert_eq!(read(&bytes).unwrap().mesh.faces.len(), 12);
    let mut builder = cube();
    builder.json["meshes"][0]["primitives"][0]["mode"] = json!(4.0);
    builder.json["accessors"][0]["count"] = json!(8.0);
    builder.json["cameras"] = json!("whatever");
    builder.json["extras"] = json!({"anything": [1, {}]});
    assert_near(builder.shape().1, 1.0);
    builder.json["accessors"][0]["count"] = json!(7.5);
    assert!(
        builder.refusal().contains("7.5 is not a whole number"),
        "{}",
        builder.refusal()
    );
    let mut builder = cube();
    builder.json["asset"]["version"] = json!("1.0");
    assert_eq!(builder.refusal(), "glTF 1.0 is not supported, only 2");
}

#[test]
fn indices_beyond_everything_end_in_a_sentence() {
    for (place, sentence) in [
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            "meshes[0].primitives[0].attributes.POSITION is 99: there is no such element",
        ),
        (
            "/meshes/0/primitives/0/indices",
            "meshes[0].primitives[0].indices is 99: there is no such element",
        ),
        (
            "/nodes/0/mesh",
            "nodes[0].mesh is 99: there is no such element",
        ),
        (
            "/scenes/0/nodes/0",
            "scenes[0].nodes[0] is 99: there is no such element",
        ),
        ("/scene", "scene is 99: there is no such element"),
        (
            "/accessors/0/bufferView",
            "accessors[0].bufferView is 99: there is no such element",
        ),
        (
            "/bufferViews/0/buffer",
            "bufferViews[0].buffer is 99: there is no such element",
        ),
        (
            "/accessors/0/componentType",
            "accessor 0: its component type is not known",
        ),
    ] {
        let mut builder = cube();
        *builder.json.pointer_mut(place).unwrap() = json!(99);
        assert_eq!(builder.refusal(), sentence);
    }
}
