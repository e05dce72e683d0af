//! What the extension's JSON refers to, by the names of its numbers, and the checksum over it all.
//!
//! A number whose name ends in `View` or `Accessor` is the index of a buffer view or an accessor; `image`, `images` and `normals`
//! are indices of images. Other programs number these things anew, order keys otherwise and spell numbers otherwise. The checksum
//! is over what is meant: keys in order, numbers by value, and in place of an index the bytes behind it.

use serde_json::{Map, Number, Value};

/// What an index is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    View,
    Accessor,
    Image,
}

/// Names below which nothing is an index: what is there is data of others.
const OPAQUE: &str = "params";
/// The one value that the checksum is not over.
const CHECKSUM: &str = "checksum";

/// Integers up to this size are the same as floating-point numbers.
const LARGEST_EXACT: f64 = 9_007_199_254_740_992.0;

fn kind_of(key: &str) -> Option<Kind> {
    match key {
        "image" | "images" | "normals" => Some(Kind::Image),
        key if key.ends_with("View") => Some(Kind::View),
        key if key.ends_with("Accessor") => Some(Kind::Accessor),
        _ => None,
    }
}

/// Calls `visit` with every index in an object, in the order of its keys; what it returns takes the index's place.
pub(super) fn renumber<E>(
    object: &mut Map<String, Value>,
    visit: &mut impl FnMut(Kind, usize) -> Result<usize, E>,
) -> Result<(), E> {
    // Keys of a map are in their order.
    for (key, value) in object.iter_mut() {
        if key != OPAQUE {
            renumber_value(value, kind_of(key), visit)?;
        }
    }
    Ok(())
}

fn renumber_value<E>(
    value: &mut Value,
    kind: Option<Kind>,
    visit: &mut impl FnMut(Kind, usize) -> Result<usize, E>,
) -> Result<(), E> {
    match value {
        Value::Object(object) => renumber(object, visit)?,
        Value::Array(items) => {
            for item in items {
                renumber_value(item, kind, visit)?;
            }
        }
        Value::Number(number) => {
            if let (Some(kind), Some(index)) = (kind, as_index(number)) {
                *value = visit(kind, index)?.into();
            }
        }
        _ => {}
    }
    Ok(())
}

/// The index that a number is, whichever way it is spelled.
fn as_index(number: &Number) -> Option<usize> {
    match integer(number)? {
        n if n >= 0 => usize::try_from(n).ok(),
        _ => None,
    }
}

fn integer(number: &Number) -> Option<i128> {
    if let Some(n) = number.as_u64() {
        return Some(n.into());
    }
    if let Some(n) = number.as_i64() {
        return Some(n.into());
    }
    let x = number.as_f64()?;
    (x.fract() == 0.0 && x.abs() <= LARGEST_EXACT).then_some(x as i128)
}

/// Spells whole numbers as integers, which other programs may have written as `2.0` or `2e0`.
pub(super) fn spell_integers(value: &mut Value) {
    match value {
        Value::Object(object) => object.values_mut().for_each(spell_integers),
        Value::Array(items) => items.iter_mut().for_each(spell_integers),
        Value::Number(number) if number.is_f64() => {
            let whole = integer(number).and_then(|n| i64::try_from(n).ok());
            // A negative zero stays what it is.
            let is_zero = number.as_f64() == Some(0.0);
            if let Some(n) = whole.filter(|_| !is_zero) {
                *value = match u64::try_from(n) {
                    Ok(n) => n.into(),
                    Err(_) => n.into(),
                };
            }
        }
        _ => {}
    }
}

/// The checksum of an extension, whose own value is left out, and the bytes that it refers to. `fetch` appends what an index means.
pub(super) fn checksum<E>(
    extension: &Map<String, Value>,
    fetch: &mut impl FnMut(Kind, usize, &mut Vec<u8>) -> Result<(), E>,
) -> Result<(String, u64), E> {
    let mut sum = Sum {
        crc: crc32fast::Hasher::new(),
        bytes: 0,
        buffer: Vec::new(),
    };
    sum.object(extension, Place::Root, fetch)?;
    Ok((format!("{:08x}", sum.crc.finalize()), sum.bytes))
}

/// Where in the extension an object stands.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// It is the extension, which holds the checksum.
    Root,
    Inside,
    /// Where no number is an index.
    Opaque,
}

struct Sum {
    crc: crc32fast::Hasher,
    bytes: u64,
    buffer: Vec<u8>,
}

impl Sum {
    /// A letter for what follows, and how much of it.
    fn tag(&mut self, letter: u8, count: usize) {
        self.crc.update(&[letter]);
        self.crc.update(&(count as u64).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.tag(b's', text.len());
        self.crc.update(text.as_bytes());
    }

    fn object<E>(
        &mut self,
        object: &Map<String, Value>,
        place: Place,
        fetch: &mut impl FnMut(Kind, usize, &mut Vec<u8>) -> Result<(), E>,
    ) -> Result<(), E> {
        self.tag(b'o', object.len());
        let mut entries: Vec<(&String, &Value)> = object.iter().collect();
        entries.sort_unstable_by_key(|&(key, _)| key);
        for (key, value) in entries {
            if place == Place::Root && key == CHECKSUM {
                continue;
            }
            self.text(key);
            let is_opaque = place == Place::Opaque || key == OPAQUE;
            let kind = if is_opaque { None } else { kind_of(key) };
            self.value(value, kind, is_opaque, fetch)?;
        }
        Ok(())
    }

    fn value<E>(
        &mut self,
        value: &Value,
        kind: Option<Kind>,
        is_opaque: bool,
        fetch: &mut impl FnMut(Kind, usize, &mut Vec<u8>) -> Result<(), E>,
    ) -> Result<(), E> {
        match value {
            Value::Null => self.tag(b'n', 0),
            Value::Bool(truth) => self.tag(b'b', usize::from(*truth)),
            Value::String(text) => self.text(text),
            Value::Array(items) => {
                self.tag(b'a', items.len());
                for item in items {
                    self.value(item, kind, is_opaque, fetch)?;
                }
            }
            Value::Object(object) => {
                let place = if is_opaque {
                    Place::Opaque
                } else {
                    Place::Inside
                };
                self.object(object, place, fetch)?;
            }
            Value::Number(number) => match (kind, as_index(number)) {
                (Some(kind), Some(index)) => {
                    self.buffer.clear();
                    fetch(kind, index, &mut self.buffer)?;
                    self.bytes += self.buffer.len() as u64;
                    self.tag(b'd', self.buffer.len());
                    self.crc.update(&self.buffer);
                }
                _ => self.number(number),
            },
        }
        Ok(())
    }

    /// By value: `2`, `2.0` and `2e0` are the same.
    fn number(&mut self, number: &Number) {
        match integer(number) {
            Some(n) => {
                self.tag(b'i', 0);
                self.crc.update(&n.to_le_bytes());
            }
            None => {
                self.tag(b'f', 0);
                let bits = number.as_f64().unwrap_or(f64::NAN).to_bits();
                self.crc.update(&bits.to_le_bytes());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// The bytes behind an index: its kind and itself, counted from `first`.
    fn sum_of(value: &Value, first: usize) -> (String, u64) {
        checksum(value.as_object().unwrap(), &mut |kind, index, bytes| {
            bytes.extend([kind as u8, (index - first) as u8, 7]);
            Ok::<_, ()>(())
        })
        .unwrap()
    }

    #[test]
    fn the_checksum_is_over_what_is_meant() {
        let sound = json!({
            "checksum": "0", "a": 2, "b": 0.1, "oneView": 10, "x": { "images": [11, 12], "arrayAccessor": 13 },
        });
        let same = json!({
            "x": { "arrayAccessor": 23.0, "images": [21, 22] }, "b": 1e-1, "a": 2.0, "oneView": 20, "checksum": "1",
        });
        assert_eq!(sum_of(&sound, 10), sum_of(&same, 20));
        assert_eq!(sum_of(&sound, 10).1, 12);
        for other in [
            json!({ "checksum": "0", "a": 3, "b": 0.1, "oneView": 10, "x": { "images": [11, 12], "arrayAccessor": 13 } }),
            json!({ "checksum": "0", "a": 2, "b": 0.1, "oneView": 11, "x": { "images": [11, 12], "arrayAccessor": 13 } }),
            json!({ "checksum": "0", "a": 2, "b": 0.1, "oneView": 10, "x": { "images": [12, 11], "arrayAccessor": 13 } }),
            json!({ "checksum": "0", "a": 2, "b": 0.1, "onesView": 10, "x": { "images": [11, 12], "arrayAccessor": 13 } }),
            json!({ "checksum": "0", "a": 2, "b": 0.1, "oneView": 10, "x": { "images": [11, 12] }, "arrayAccessor": 13 }),
        ] {
            assert_ne!(sum_of(&sound, 10), sum_of(&other, 10), "{other}");
        }
    }

    #[test]
    fn indices_are_numbered_anew_and_nothing_else_is() {
        let mut value = json!({ "aView": 1, "aAccessor": [2.0, 3], "images": [], "n": 4, "params": { "aView": 5 } });
        let mut seen = Vec::new();
        renumber(value.as_object_mut().unwrap(), &mut |kind, index| {
            seen.push((kind, index));
            Ok::<_, ()>(index + 10)
        })
        .unwrap();
        assert_eq!(
            value,
            json!({ "aView": 11, "aAccessor": [12, 13], "images": [], "n": 4, "params": { "aView": 5 } })
        );
        assert_eq!(
            seen,
            [(Kind::Accessor, 2), (Kind::Accessor, 3), (Kind::View, 1)]
        );
    }

    #[test]
    fn whole_numbers_become_integers() {
        let mut value = json!([1.0, -2.0, 0.5, 1e300, 3, -0.0]);
        spell_integers(&mut value);
        assert_eq!(value, json!([1, -2, 0.5, 1e300, 3, -0.0]));
    }
}
