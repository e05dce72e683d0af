//! Files as other programs rewrite them: all numbered anew, in several buffers, with what they add of their own.

use serde_json::{Value, json};

use super::super::references::{self, Kind};
use super::super::{EXTENSION_NAME, container};

/// The file with another JSON text.
pub(crate) fn with_json(file: &[u8], change: impl Fn(&mut Value)) -> Vec<u8> {
    let chunks = container::split(file).unwrap();
    let mut document: Value = serde_json::from_slice(chunks.json).unwrap();
    change(&mut document);
    container::join(&document.to_string(), chunks.binary).unwrap()
}

/// Turns a list of a document round and adds something in front; returns where each thing is now.
fn turn(document: &mut Value, list: &str, first: Value) -> impl Fn(usize) -> usize + use<> {
    let mut items = document[list].as_array().cloned().unwrap_or_default();
    let count = items.len();
    items.push(first);
    items.reverse();
    document[list] = items.into();
    move |index| count - index
}

/// Numbers of a value as another program spells them.
fn respell(value: &mut Value) {
    match value {
        Value::Object(object) => object.values_mut().for_each(respell),
        Value::Array(items) => items.iter_mut().for_each(respell),
        Value::Number(number) => {
            if let Some(n) = number.as_u64().filter(|&n| n < 1 << 50) {
                *value = (n as f64).into();
            }
        }
        _ => {}
    }
}

/// The asset in a file of another program.
pub(crate) fn by_another(file: &[u8]) -> Vec<u8> {
    let chunks = container::split(file).unwrap();
    let mut document: Value = serde_json::from_slice(chunks.json).unwrap();
    document["asset"]["generator"] = "another".into();
    document["materials"] = json!([{ "name": "another" }]);
    document["nodes"] = json!([{ "name": "new" }, { "mesh": 0, "scale": [2, 2, 2] }]);
    // Each view's bytes on their own, those of every other one in a second buffer.
    let mut binaries = [vec![1_u8; 5], vec![2_u8; 9]];
    for (v, view) in document["bufferViews"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .enumerate()
    {
        let number = |key: &str| view[key].as_u64().unwrap() as usize;
        let bytes = &chunks.binary[number("byteOffset")..][..number("byteLength")];
        let binary = &mut binaries[v % 2];
        view["buffer"] = (v % 2).into();
        view["byteOffset"] = binary.len().into();
        binary.extend_from_slice(bytes);
    }
    use base64::Engine as _;
    let text = base64::engine::general_purpose::STANDARD.encode(&binaries[1]);
    document["buffers"] = json!([
        { "byteLength": binaries[0].len() },
        { "byteLength": binaries[1].len(), "uri": format!("data:application/octet-stream;base64,{text}") },
    ]);
    let new = json!({ "buffer": 0, "byteLength": 2 });
    let view_of = turn(&mut document, "bufferViews", new);
    for list in ["accessors", "images"] {
        for item in document[list].as_array_mut().into_iter().flatten() {
            let view = item["bufferView"].as_u64().unwrap() as usize;
            item["bufferView"] = view_of(view).into();
        }
    }
    let new = json!({ "componentType": 5126, "count": 1, "type": "MAT4" });
    let accessor_of = turn(&mut document, "accessors", new);
    let image_of = turn(&mut document, "images", json!({ "uri": "new.png" }));
    let mut extension = document["extensions"][EXTENSION_NAME].clone();
    references::renumber(extension.as_object_mut().unwrap(), &mut |kind, index| {
        Ok::<_, ()>(match kind {
            Kind::View => view_of(index),
            Kind::Accessor => accessor_of(index),
            Kind::Image => image_of(index),
        })
    })
    .unwrap();
    respell(&mut extension);
    document["extensions"] = json!({ "OTHER_extension": {}, EXTENSION_NAME: extension });
    document["meshes"] = json!([]);
    container::join(
        &serde_json::to_string_pretty(&document).unwrap(),
        &binaries[0],
    )
    .unwrap()
}
