//! Fields of a camera file in JSON, with sentences for what is missing or of another shape.

use serde_json::{Map, Value};

use crate::error::CaptureFault;

/// Parses a file's text.
///
/// # Errors
/// The line and column where it is damaged; NaN and infinity, which some programs write, are named.
pub(crate) fn parse(text: &str) -> Result<Value, CaptureFault> {
    serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|error| {
        let (line, column) = (error.line(), error.column());
        let words = text.lines().nth(line.saturating_sub(1)).unwrap_or("");
        let start: String = words
            .chars()
            .skip(column.saturating_sub(2))
            .take(9)
            .collect();
        let is_word = ["NaN", "nan", "Inf", "inf"]
            .iter()
            .any(|w| start.contains(w));
        if is_word || error.to_string().starts_with("number out of range") {
            return CaptureFault::NotFinite { line, column };
        }
        CaptureFault::Damaged {
            reason: error.to_string(),
        }
    })
}

/// An object of the file, and how to name it in a sentence.
#[derive(Clone, Debug)]
pub(crate) struct Fields<'a> {
    pub(crate) place: String,
    pub(crate) map: &'a Map<String, Value>,
}

/// What something is, in a few words.
fn described(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(b) => b.to_string(),
        Value::Number(n) => n.to_string(),
        Value::String(_) => "text".to_owned(),
        Value::Object(_) => "an object".to_owned(),
        Value::Array(list) => match list.first() {
            Some(Value::Array(first)) => {
                let is_even = list
                    .iter()
                    .all(|row| row.as_array().is_some_and(|r| r.len() == first.len()));
                match is_even {
                    true => format!("{}×{}", list.len(), first.len()),
                    false => format!("{} rows of different lengths", list.len()),
                }
            }
            _ => format!("a list of {}", list.len()),
        },
    }
}

impl<'a> Fields<'a> {
    /// The fault of a field.
    pub(crate) fn fault(&self, field: &'static str, shape: &'static str) -> CaptureFault {
        CaptureFault::Field {
            place: self.place.clone(),
            field,
            shape,
            found: self.map.get(field).map(described),
        }
    }

    /// A field that is there and not null.
    pub(crate) fn get(&self, field: &str) -> Option<&'a Value> {
        self.map.get(field).filter(|v| !v.is_null())
    }

    /// Text.
    pub(crate) fn text(&self, field: &'static str) -> Result<Option<&'a str>, CaptureFault> {
        let text = |v: &'a Value| v.as_str().ok_or_else(|| self.fault(field, "text"));
        self.get(field).map(text).transpose()
    }

    /// A number.
    pub(crate) fn number(&self, field: &'static str) -> Result<Option<f64>, CaptureFault> {
        let number = |v: &Value| v.as_f64().ok_or_else(|| self.fault(field, "a number"));
        self.get(field).map(number).transpose()
    }

    /// A count of pixels; a whole number written as 1280.0 is one.
    pub(crate) fn pixels(&self, field: &'static str) -> Result<Option<u32>, CaptureFault> {
        let fault = || self.fault(field, "a whole number of pixels");
        let pixels = |v: f64| {
            let is_whole = v.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&v);
            if is_whole { Ok(v as u32) } else { Err(fault()) }
        };
        self.number(field)?.map(pixels).transpose()
    }

    /// A matrix of `R` rows of `C`.
    pub(crate) fn matrix<const R: usize, const C: usize>(
        &self,
        field: &'static str,
        shape: &'static str,
    ) -> Result<Option<[[f64; C]; R]>, CaptureFault> {
        let Some(value) = self.get(field) else {
            return Ok(None);
        };
        matrix(value)
            .map(Some)
            .ok_or_else(|| self.fault(field, shape))
    }

    /// `N` numbers.
    pub(crate) fn numbers<const N: usize>(
        &self,
        field: &'static str,
        shape: &'static str,
    ) -> Result<Option<[f64; N]>, CaptureFault> {
        let Some(value) = self.get(field) else {
            return Ok(None);
        };
        numbers(value)
            .map(Some)
            .ok_or_else(|| self.fault(field, shape))
    }
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let list = value.as_array().filter(|list| list.len() == N)?;
    let mut found = [0.0; N];
    for (slot, v) in found.iter_mut().zip(list) {
        *slot = v.as_f64()?;
    }
    Some(found)
}

fn matrix<const R: usize, const C: usize>(value: &Value) -> Option<[[f64; C]; R]> {
    let rows = value.as_array().filter(|rows| rows.len() == R)?;
    let mut found = [[0.0; C]; R];
    for (slot, row) in found.iter_mut().zip(rows) {
        *slot = numbers(row)?;
    }
    Some(found)
}
