//! Streaming a list line by line, with a fingerprint of each output's name.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::mpsc::{self, Receiver};
use std::thread;

use anyhow::Context;
use serde::Deserialize;
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

use crate::args::Shard;

/// Longer lines are refused, so that a file that is no list is not read into memory.
const MAX_LINE_BYTES: u64 = 1 << 20;

/// What a line may say.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    model: String,
    #[serde(default)]
    out: Option<String>,
    #[serde(default)]
    options: Option<Map<String, Value>>,
}

/// A line as it is written.
#[derive(Debug, PartialEq)]
pub(super) struct Written {
    pub(super) model: String,
    /// Where the asset goes, below the folder for all.
    pub(super) out: PathBuf,
    pub(super) options: Map<String, Value>,
}

/// Why a line is no model to build: one sentence, with what is known of the line.
#[derive(Debug, PartialEq)]
pub(super) struct Refusal {
    pub(super) sentence: String,
    pub(super) model: Option<String>,
}

impl Refusal {
    pub(super) fn of_model(model: &str, sentence: String) -> Self {
        Self {
            sentence,
            model: Some(model.to_owned()),
        }
    }
}

/// A line of the list.
#[derive(Debug)]
pub(super) struct Item {
    /// Counted from 1, as editors do.
    pub(super) number: u64,
    pub(super) written: Result<Written, Refusal>,
}

/// A list that is being read.
struct List {
    name: String,
    input: Box<dyn BufRead>,
    /// Lines read, blank ones included.
    number: u64,
    /// Models read.
    place: u64,
    /// The line that each output belongs to, by the first bytes of the SHA-256 of its name.
    taken: BTreeMap<u64, u64>,
}

/// Opens a list, `-` for standard input, and reads the models of a part of it on a thread of its own, which waits for
/// input so that no other thread has to.
///
/// # Errors
/// When a thread cannot be started. What is wrong with the list comes out of the channel.
pub(super) fn read(path: &Path, shard: Shard) -> anyhow::Result<Receiver<anyhow::Result<Item>>> {
    let (sender, items) = mpsc::sync_channel(1);
    let path = path.to_owned();
    let read = move || {
        let mut list = match List::open(&path) {
            Ok(list) => list,
            // The receiver is gone after an interrupt, here and below.
            Err(error) => return drop(sender.send(Err(error))),
        };
        loop {
            let item = list.next(|place| shard.holds(place));
            let item = item.with_context(|| list.name.clone()).transpose();
            let Some(item) = item else { return };
            let is_last = item.is_err();
            if sender.send(item).is_err() || is_last {
                return;
            }
        }
    };
    (thread::Builder::new().spawn(read)).context("a thread cannot be started")?;
    Ok(items)
}

impl List {
    /// Opens a list.
    fn open(path: &Path) -> anyhow::Result<Self> {
        let (name, input): (_, Box<dyn BufRead>) = if path == Path::new("-") {
            (
                "standard input".to_owned(),
                Box::new(BufReader::new(io::stdin())),
            )
        } else {
            let name = path.display().to_string();
            let file = File::open(path).with_context(|| name.clone())?;
            (name, Box::new(BufReader::new(file)))
        };
        Ok(Self::new(name, input))
    }

    fn new(name: String, input: Box<dyn BufRead>) -> Self {
        Self {
            name,
            input,
            number: 0,
            place: 0,
            taken: BTreeMap::new(),
        }
    }

    /// The next model whose place in the list is wanted; the first model has place 1. Blank lines have no place.
    ///
    /// # Errors
    /// When the list cannot be read on.
    fn next(&mut self, wanted: impl Fn(u64) -> bool) -> io::Result<Option<Item>> {
        while let Some(line) = self.read_line()? {
            self.number += 1;
            if line
                .as_ref()
                .is_ok_and(|bytes| bytes.trim_ascii().is_empty())
            {
                continue;
            }
            self.place += 1;
            let number = self.number;
            // Lines of others are read too: the first that names an output has it, whichever run builds it.
            let written = line
                .and_then(|bytes| parse(&bytes))
                .and_then(|written| self.claim(written))
                .map_err(|refusal| Refusal {
                    sentence: format!("{}, line {number}: {}", self.name, refusal.sentence),
                    ..refusal
                });
            if wanted(self.place) {
                return Ok(Some(Item { number, written }));
            }
        }
        Ok(None)
    }

    /// The bytes of a line, or that it is too long.
    fn read_line(&mut self) -> io::Result<Option<Result<Vec<u8>, Refusal>>> {
        let mut line = Vec::new();
        let mut most = self.input.by_ref().take(MAX_LINE_BYTES);
        if most.read_until(b'\n', &mut line)? == 0 {
            return Ok(None);
        }
        if line.last() == Some(&b'\n') || (line.len() as u64) < MAX_LINE_BYTES {
            if self.number == 0 && line.starts_with(b"\xEF\xBB\xBF") {
                line.drain(..3);
            }
            return Ok(Some(Ok(line)));
        }
        self.input.skip_until(b'\n')?;
        Ok(Some(Err(Refusal {
            sentence: format!("it is longer than {MAX_LINE_BYTES} bytes"),
            model: None,
        })))
    }

    fn claim(&mut self, written: Written) -> Result<Written, Refusal> {
        let name = written.out.as_os_str().as_encoded_bytes();
        let digest = Sha256::digest(name);
        let mut first = [0; 8];
        first.copy_from_slice(&digest[..8]);
        match self.taken.insert(u64::from_be_bytes(first), self.number) {
            None => Ok(written),
            Some(owner) => {
                self.taken.insert(u64::from_be_bytes(first), owner);
                let out = written.out.display();
                Err(Refusal::of_model(
                    &written.model,
                    format!(
                        "{}: its asset would be {out}, which is that of line {owner}; \"out\" names another",
                        written.model
                    ),
                ))
            }
        }
    }
}

fn parse(line: &[u8]) -> Result<Written, Refusal> {
    let fields: Fields = serde_json::from_slice(line).map_err(|error| {
        let said = error.to_string();
        // The line that it counts is always its first.
        let (what, _) = said.rsplit_once(" at line ").unwrap_or((&said, ""));
        let place = match error.column() {
            0 => String::new(),
            column => format!(" (column {column})"),
        };
        Refusal {
            sentence: format!("it is no model of a list: {what}{place}"),
            model: None,
        }
    })?;
    let out = out_path(&fields).map_err(|sentence| Refusal::of_model(&fields.model, sentence))?;
    Ok(Written {
        model: fields.model,
        out,
        options: fields.options.unwrap_or_default(),
    })
}

/// The asset's path below the folder for all: what the line says, or the model's name.
fn out_path(fields: &Fields) -> Result<PathBuf, String> {
    let model = Path::new(&fields.model);
    let stem = || Some(model.file_stem()?.to_str()?.to_owned());
    let name = fields.out.clone().or_else(stem).unwrap_or_default();
    if name.is_empty() || name.contains('\0') || fields.model.contains('\0') {
        return Err("it names no file".to_owned());
    }
    let has_ending = Path::new(&name)
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    let name = if has_ending {
        name
    } else {
        format!("{name}.glb")
    };
    let mut inside = PathBuf::new();
    for part in Path::new(&name).components() {
        match part {
            Component::Normal(part) => inside.push(part),
            Component::CurDir => {}
            _ => {
                return Err(format!(
                    "{}: \"out\" is {name}, which leads out of the folder for the assets",
                    fields.model
                ));
            }
        }
    }
    Ok(inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Vec<Item> {
        let input = Box::new(io::Cursor::new(text.as_bytes().to_vec()));
        let mut list = List::new("l".to_owned(), input);
        std::iter::from_fn(|| list.next(|_| true).unwrap()).collect()
    }

    fn sentence(line: &str) -> String {
        read(line).remove(0).written.unwrap_err().sentence
    }

    #[test]
    fn lines_become_models() {
        let items = read(
            "\u{feff}{\"model\": \"a/b.obj\"}\r\n\n  \n{\"model\": \"c.ply\", \"out\": \"x/./y\", \"options\": {\"keep\": 9}}",
        );
        assert_eq!(items.iter().map(|i| i.number).collect::<Vec<_>>(), [1, 4]);
        let [first, second] = &items[..] else {
            panic!()
        };
        let first = first.written.as_ref().unwrap();
        assert_eq!(
            (&first.model[..], &first.out),
            ("a/b.obj", &PathBuf::from("b.glb"))
        );
        let second = second.written.as_ref().unwrap();
        assert_eq!(second.out, PathBuf::from("x/y.glb"));
        assert_eq!(second.options["keep"], 9);
    }

    #[test]
    fn what_is_no_model_is_said_with_its_line() {
        for (line, says) in [
            ("{", "l, line 1: it is no model of a list: EOF"),
            ("[]", "it is no model of a list"),
            ("{}", "missing field `model`"),
            ("{\"model\": 3}", "expected a string (column 11)"),
            (
                "{\"model\": \"a.ply\", \"keep\": 3}",
                "unknown field `keep`",
            ),
            ("{\"model\": \"\"}", "it names no file"),
            ("{\"model\": \"a\\u0000\"}", "it names no file"),
            (
                "{\"model\": \"a.ply\", \"out\": \"../b\"}",
                "leads out of the folder",
            ),
            (
                "{\"model\": \"a.ply\", \"out\": \"/b.glb\"}",
                "leads out of the folder",
            ),
        ] {
            let said = sentence(line);
            assert!(
                said.contains(says) && !said.contains(" at line "),
                "{line}: {said}"
            );
        }
        let long = format!(
            "{{\"model\": \"{}\"}}\n{{\"model\": \"b\"}}",
            "a".repeat(3 << 20)
        );
        let items = read(&long);
        let refusal = items[0].written.as_ref().unwrap_err();
        assert!(
            refusal.sentence.contains("longer than 1048576 bytes"),
            "{refusal:?}"
        );
        assert_eq!(items[1].number, 2);
        assert!(items[1].written.is_ok() && items.len() == 2);
    }

    #[test]
    fn the_first_line_with_an_output_has_it() {
        let text = "{\"model\": \"a/m.obj\"}\n{\"model\": \"b/m.obj\"}\n{\"model\": \"b/m.obj\", \"out\": \"m.GLB\"}\n{\"model\": \"c\", \"out\": \"./m.glb\"}";
        let items = read(text);
        let is_taken: Vec<bool> = items.iter().map(|i| i.written.is_err()).collect();
        assert_eq!(is_taken, [false, true, false, true]);
        for item in [&items[1], &items[3]] {
            let said = &item.written.as_ref().unwrap_err().sentence;
            assert!(said.contains("that of line 1"), "{said}");
        }
    }
}
