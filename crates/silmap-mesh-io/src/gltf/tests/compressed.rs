//! Compressed buffers and primitives: every mode and filter, and what must not reach the decoders.

use ::meshopt as codec;
use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, GeometryAttributeType, Mesh, MeshEncoder,
    PointAttribute,
};
use serde_json::{Value, json};

use super::build::{Builder, FLOAT, corner, corners, cube_indices, floats};

/// A cube of which positions and indices come from compressed views, in a buffer that has no data itself.
fn compressed(
    positions: (&[u8], Value),
    accessor: Value,
    indices: (&[u8], Value),
    index_type: u32,
    extension: &str,
) -> Builder {
    let mut builder = Builder::new();
    for ((bytes, more), length_of) in [(positions, "positions"), (indices, "indices")] {
        let view = builder.view(bytes, json!({}));
        let mut object = builder.json["bufferViews"][view].clone();
        object
            .as_object_mut()
            .unwrap()
            .extend(more.as_object().unwrap().clone());
        let size = object["count"].as_u64().unwrap() * object["byteStride"].as_u64().unwrap();
        builder.json["bufferViews"][view] = json!({
            "buffer": 1, "byteLength": size, "byteOffset": if length_of == "indices" { 4096 } else { 0 },
            "extensions": {extension: object},
        });
        if length_of == "positions" {
            builder.json["bufferViews"][view]["byteStride"] = more["byteStride"].clone();
        }
    }
    let data = builder.data.len().next_multiple_of(4);
    builder.json["buffers"] = json!([{"byteLength": data}, {"byteLength": 8192, "extensions": {extension: {"fallback": true}}}]);
    let mut positions = json!({"bufferView": 0, "count": 8, "type": "VEC3"});
    positions
        .as_object_mut()
        .unwrap()
        .extend(accessor.as_object().unwrap().clone());
    builder.push("accessors", positions);
    builder.push(
        "accessors",
        json!({"bufferView": 1, "componentType": index_type, "count": 36, "type": "SCALAR"}),
    );
    builder.mesh(json!({"attributes": {"POSITION": 0}, "indices": 1}));
    builder.json["extensionsRequired"] = json!([extension, "KHR_mesh_quantization"]);
    builder
}

/// A cube in the simplest compressed form.
pub(super) fn plain() -> Builder {
    let points: Vec<[f32; 3]> = (0..8).map(corner).collect();
    let encoded = codec::encode_vertex_buffer(&points).unwrap();
    let indices: Vec<u32> = cube_indices().into_iter().map(u32::from).collect();
    let triangles = codec::encode_index_buffer(&indices, 8).unwrap();
    compressed(
        (
            &encoded,
            json!({"count": 8, "byteStride": 12, "mode": "ATTRIBUTES"}),
        ),
        json!({"componentType": FLOAT}),
        (
            &triangles,
            json!({"count": 36, "byteStride": 2, "mode": "TRIANGLES"}),
        ),
        5123,
        "EXT_meshopt_compression",
    )
}

#[test]
fn meshopt_modes_and_filters_are_decoded() {
    let (_, volume, warnings) = plain().shape();
    assert!(
        (volume - 1.0).abs() < 1e-9 && warnings.is_empty(),
        "{warnings:?}"
    );
    let indices: Vec<u32> = cube_indices().into_iter().map(u32::from).collect();
    let sequence = codec::encode_index_sequence(&indices, 8).unwrap();
    let sequence = (
        &sequence[..],
        json!({"count": 36, "byteStride": 4, "mode": "INDICES", "filter": "NONE"}),
    );
    // Bytes that are a vertex each four, in the second version of the encoding.
    let bytes: Vec<[i8; 4]> = (0..8)
        .map(|i| {
            let [x, y, z] = corner(i).map(|c| (254.0 * c) as i8);
            [x, y, z, 0]
        })
        .collect();
    let encoded = codec::encode_vertex_buffer_level(&bytes, 3, Some(1)).unwrap();
    let quantised = compressed(
        (
            &encoded,
            json!({"count": 8, "byteStride": 4, "mode": "ATTRIBUTES"}),
        ),
        json!({"componentType": 5120, "normalized": true}),
        sequence.clone(),
        5125,
        "KHR_meshopt_compression",
    );
    assert!((quantised.shape().1 - 8.0).abs() < 1e-9);
    // Exponents.
    let points: Vec<[f32; 3]> = (0..8).map(corner).collect();
    let filtered = codec::encode_filter_exp(&points, 20, codec::EncodeExpMode::Separate);
    let encoded = codec::encode_vertex_buffer(&filtered).unwrap();
    let exponential = compressed(
        (
            &encoded,
            json!({"count": 8, "byteStride": 12, "mode": "ATTRIBUTES", "filter": "EXPONENTIAL"}),
        ),
        json!({"componentType": FLOAT}),
        sequence.clone(),
        5125,
        "EXT_meshopt_compression",
    );
    assert!((exponential.shape().1 - 1.0).abs() < 1e-4);
    // Unit vectors as positions: corners of a cube of side 2/√3.
    let unit = |i: usize| {
        let [x, y, z] = corner(i).map(|c| 2.0 * c / 3.0_f32.sqrt());
        [x, y, z, 0.0]
    };
    let units: Vec<[f32; 4]> = (0..8).map(unit).collect();
    let small = codec::encode_vertex_buffer(&codec::encode_filter_oct::<i8>(&units, 8)).unwrap();
    let large = codec::encode_vertex_buffer(&codec::encode_filter_oct::<i16>(&units, 16)).unwrap();
    for (encoded, stride, component, off) in [(small, 4, 5120, 0.1), (large, 8, 5122, 1e-3)] {
        let octahedral = compressed(
            (
                &encoded,
                json!({"count": 8, "byteStride": stride, "mode": "ATTRIBUTES", "filter": "OCTAHEDRAL"}),
            ),
            json!({"componentType": component, "normalized": true}),
            sequence.clone(),
            5125,
            "EXT_meshopt_compression",
        );
        let wanted = (2.0 / 3.0_f64.sqrt()).powi(3);
        assert!((octahedral.shape().1 - wanted).abs() < off);
    }
}

#[test]
fn quaternions_and_colours_are_unfiltered() {
    let half = 0.5_f32.sqrt();
    let mut builder = super::build::cube();
    let turns = [[0.0, 0.0, half, half], [0.0, 0.0, 0.0, 1.0]];
    let encoded = codec::encode_vertex_buffer(&codec::encode_filter_quat(&turns, 16)).unwrap();
    let colours = [[1.0, 0.0, 0.0, 1.0]; 8];
    let red = codec::encode_vertex_buffer(&codec::encode_filter_color::<u8>(&colours, 8)).unwrap();
    let mut add = |bytes: &[u8], stride: usize, count: usize, filter: &str, component: u32| {
        let at = builder.view(bytes, json!({}));
        let mut object = builder.json["bufferViews"][at].clone();
        object["count"] = json!(count);
        object["byteStride"] = json!(stride);
        object["mode"] = json!("ATTRIBUTES");
        object["filter"] = json!(filter);
        builder.json["bufferViews"][at] = json!({"buffer": 0, "byteLength": stride * count, "extensions": {"KHR_meshopt_compression": object}});
        builder.push(
            "accessors",
            json!({"bufferView": at, "componentType": component, "normalized": true, "count": count, "type": "VEC4"}),
        )
    };
    let turns = add(&encoded, 8, 2, "QUATERNION", 5122);
    let red = add(&red, 4, 8, "COLOR", 5121);
    let places = builder.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
    builder.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": turns, "TRANSLATION": places}}});
    builder.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(red);
    let (raw, volume, _) = builder.shape();
    assert!((volume - 2.0).abs() < 1e-6);
    let turned = raw.mesh.positions[0];
    let wanted = glam::DVec3::new(0.5, -0.5, -0.5);
    assert!((turned - wanted).length() < 1e-3, "{turned}");
    let colour = raw.mesh.appearance.corner_colours[0][0];
    assert!(
        colour[0] > 0.98 && colour[1] < 0.02 && colour[2] < 0.02,
        "{colour:?}"
    );
}

#[test]
fn compressed_views_that_cannot_be_are_refused_before_they_are_decoded() {
    let object = |builder: &mut Builder, view: usize, name: &str, value: Value| {
        builder.json["bufferViews"][view]["extensions"]["EXT_meshopt_compression"][name] = value;
    };
    for (view, name, value, says) in [
        (0, "byteStride", json!(3), "a stride of 3 bytes cannot be"),
        (
            0,
            "byteStride",
            json!(260),
            "a stride of 260 bytes cannot be",
        ),
        (0, "count", json!(4_000_000_000_u64), "do not come from"),
        (0, "count", json!(7), "its encoded bytes are damaged"),
        (0, "mode", json!("POINTS"), "mode POINTS is not known"),
        (0, "filter", json!("SEPIA"), "filter SEPIA is not known"),
        (
            0,
            "filter",
            json!("OCTAHEDRAL"),
            "filter OCTAHEDRAL cannot be with 12 bytes",
        ),
        (0, "filter", json!("QUATERNION"), "cannot be with 12 bytes"),
        (0, "byteLength", json!(20), "its encoded bytes are damaged"),
        (
            0,
            "byteLength",
            json!(1_000_000),
            "reaches past the end of its buffer",
        ),
        (0, "buffer", json!(7), "there is no such element"),
        (0, "buffer", json!(1), "buffer 1 has no data"),
        (1, "count", json!(35), "35 indices do not make triangles"),
        (1, "byteStride", json!(3), "indices of 3 bytes cannot be"),
        (1, "filter", json!("COLOR"), "mode TRIANGLES has no filters"),
        (
            1,
            "mode",
            json!("ATTRIBUTES"),
            "a stride of 2 bytes cannot be",
        ),
        (
            1,
            "count",
            json!("many"),
            "extension EXT_meshopt_compression cannot be read",
        ),
    ] {
        let mut builder = plain();
        object(&mut builder, view, name, value);
        let refusal = builder.refusal();
        assert!(refusal.contains(says), "`{says}` is not in `{refusal}`");
    }
}

#[test]
fn a_view_may_not_announce_more_than_it_decodes_to() {
    let mut builder = plain();
    builder.json["bufferViews"][0]["byteLength"] = json!(97);
    assert_eq!(
        builder.refusal(),
        "buffer view 0 cannot be decoded: it holds 96 bytes, and 97 are announced"
    );
}

/// A cube compressed by Draco, with red corners.
pub(super) fn draco() -> Builder {
    let mut mesh = Mesh::new();
    let mut add = |kind, width: u8, data_type, bytes: &[u8]| {
        let mut attribute = PointAttribute::new();
        attribute.init(kind, width, data_type, data_type == DataType::Uint8, 8);
        attribute.buffer_mut().write(0, bytes);
        mesh.add_attribute(attribute)
    };
    let position = add(
        GeometryAttributeType::Position,
        3,
        DataType::Float32,
        &floats(&corners()),
    );
    let colour = add(
        GeometryAttributeType::Color,
        4,
        DataType::Uint8,
        &[[255, 0, 0, 255]; 8].concat(),
    );
    let indices: Vec<u32> = cube_indices().into_iter().map(u32::from).collect();
    mesh.set_num_points(8);
    mesh.set_num_faces(12);
    mesh.set_faces_from_flat_indices(&indices);
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut encoded = EncoderBuffer::new();
    encoder
        .encode(&EncoderOptions::new(), &mut encoded)
        .unwrap();
    let mut builder = Builder::new();
    let view = builder.view(encoded.data(), json!({}));
    builder.json["accessors"] = json!([
        {"componentType": FLOAT, "count": 8, "type": "VEC3"},
        {"componentType": 5121, "normalized": true, "count": 8, "type": "VEC4"},
        {"componentType": 5123, "count": 36, "type": "SCALAR"},
    ]);
    builder.mesh(json!({
        "attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2,
        "extensions": {"KHR_draco_mesh_compression": {"bufferView": view, "attributes": {"POSITION": position, "COLOR_0": colour}}},
    }));
    builder.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    builder
}

#[test]
fn primitives_compressed_by_draco_are_decoded() {
    let (raw, volume, warnings) = draco().shape();
    assert!((volume - 1.0).abs() < 1e-2, "{volume}");
    assert_eq!(raw.mesh.faces.len(), 12);
    assert_eq!(raw.mesh.appearance.corner_colours[5], [[1.0, 0.0, 0.0]; 3]);
    assert!(warnings.is_empty(), "{warnings:?}");
    let mut short = draco();
    short.json["bufferViews"][0]["byteLength"] = json!(20);
    let refusal = short.refusal();
    assert!(
        refusal.starts_with("mesh 0, primitive 0 cannot be decoded (KHR_draco_mesh_compression): "),
        "{refusal}"
    );
    let mut missing = draco();
    missing.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"] =
        json!({});
    assert_eq!(missing.refusal(), "accessor 0: it has no data");
}
