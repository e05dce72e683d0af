//! An entry of the list: its paths, and its options merged with those of the command line.
//!
//! Options of a line go through the same parser as those of the command line, so that they have the same names, values and
//! sentences.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::parser::ValueSource;
use clap::{ArgMatches, Command, CommandFactory};
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

use super::companions;
use super::list::{Refusal, Written};
use crate::args::Cli;

/// Options that say nothing about one asset, or where it comes from and goes.
const NOT_OF_A_LINE: [&str; 12] = [
    "model", "out", "from", "json", "manifest", "out-dir", "shard", "resume", "reader", "help",
    "version", "check",
];
/// Options that do not change the asset.
const NOT_IN_THE_HASH: [&str; 3] = ["threads", "timeout", "memory"];
/// Options of which a line may have one where the command line has the other.
const EITHER_OR: [[&str; 2]; 1] = [["keep", "max-error"]];

/// Options by name; a flag has no value.
type Options = BTreeMap<String, Option<OsString>>;

/// What holds for all lines.
#[derive(Debug)]
pub(super) struct Shared {
    /// Options of the command line.
    options: Options,
    /// The parser of `build`.
    parser: Command,
    /// Names of all options that a line may have, and whether they are flags.
    known: BTreeMap<String, bool>,
    /// Other names of some of them.
    aliases: BTreeMap<String, String>,
    /// Where relative models are looked for first: beside the list.
    beside: PathBuf,
    /// Where assets go.
    folder: PathBuf,
}

/// A model to build.
#[derive(Debug)]
pub(super) struct Entry {
    /// As the list says it.
    pub(super) model: String,
    /// The model as a file.
    pub(super) path: PathBuf,
    /// The asset.
    pub(super) out: PathBuf,
    /// The options as words for the parser.
    pub(super) words: Vec<OsString>,
    /// All values that matter to the asset, defaults included, a line each.
    pub(super) meaning: String,
    /// Files that options name.
    pub(super) files: Vec<PathBuf>,
    pub(super) timeout: Option<f64>,
    pub(super) memory: Option<u64>,
}

impl Shared {
    /// What the command line says.
    ///
    /// # Errors
    /// Never: the command line was understood before.
    pub(super) fn from_command_line(list: &Path, folder: &Path) -> anyhow::Result<Self> {
        let matches = Cli::command().try_get_matches_from(std::env::args_os())?;
        let matches = matches.subcommand_matches("build");
        Ok(Self::new(matches, list, folder))
    }

    fn new(matches: Option<&ArgMatches>, list: &Path, folder: &Path) -> Self {
        let mut parser = Cli::command();
        parser.build();
        let build = parser
            .find_subcommand("build")
            .expect("there is a command build");
        let mut known = BTreeMap::new();
        let mut aliases = BTreeMap::new();
        let mut options = Options::new();
        for argument in build.get_arguments() {
            let Some(name) = argument
                .get_long()
                .filter(|name| !NOT_OF_A_LINE.contains(name))
            else {
                continue;
            };
            let is_flag = !argument.get_action().takes_values();
            known.insert(name.to_owned(), is_flag);
            let others = argument.get_all_aliases().into_iter().flatten();
            aliases.extend(others.map(|other| (other.to_owned(), name.to_owned())));
            let id = argument.get_id().as_str();
            let given = matches.filter(|m| m.value_source(id) == Some(ValueSource::CommandLine));
            if let Some(mut values) = given.and_then(|m| m.get_raw(id)) {
                let value = values.next().map(OsStr::to_owned).filter(|_| !is_flag);
                options.insert(name.to_owned(), value);
            }
        }
        let beside = list.parent().unwrap_or(Path::new("")).to_owned();
        Self {
            options,
            parser,
            known,
            aliases,
            beside,
            folder: folder.to_owned(),
        }
    }

    /// The file that a line's model is.
    fn model_path(&self, model: &str) -> PathBuf {
        let beside = self.beside.join(model);
        let here = Path::new(model);
        if !beside.exists() && here.exists() {
            here.to_owned()
        } else {
            beside
        }
    }

    /// Options of a line put over those of the command line.
    fn merge(&self, written: &Map<String, Value>) -> Result<Options, String> {
        let mut options = self.options.clone();
        let mut seen = BTreeSet::new();
        for (key, value) in written {
            let name = key.trim_start_matches('-').replace('_', "-");
            let name = self.aliases.get(&name).cloned().unwrap_or(name);
            let Some(&is_flag) = self.known.get(&name) else {
                return Err(format!("`{key}` is no option of a model in a list"));
            };
            if !seen.insert(name.clone()) {
                return Err(format!("`{key}` is there twice"));
            }
            let is_given = !matches!(value, Value::Null | Value::Bool(false));
            for pair in EITHER_OR
                .iter()
                .filter(|pair| is_given && pair.contains(&&name[..]))
            {
                // Of the command line; both in one line are for the parser to refuse.
                for other in pair.iter().filter(|other| !seen.contains(**other)) {
                    options.remove(*other);
                }
            }
            match (value, is_flag) {
                (Value::Null, _) | (Value::Bool(false), true) => {
                    options.remove(&name);
                }
                (Value::Bool(true), true) => {
                    options.insert(name, None);
                }
                (Value::String(text), false) => {
                    options.insert(name, Some(text.into()));
                }
                (Value::Number(number), false) => {
                    options.insert(name, Some(number.to_string().into()));
                }
                (_, true) => return Err(format!("`{key}` is true or false")),
                (_, false) => return Err(format!("`{key}` needs a number or a text")),
            }
        }
        Ok(options)
    }
}

impl Entry {
    /// Reads what a line asks for.
    ///
    /// # Errors
    /// When an option is unknown or its value wrong, or the asset would replace the model.
    pub(super) fn new(written: Written, shared: &Shared) -> Result<Self, Refusal> {
        let model = written.model.clone();
        Self::understand(written, shared)
            .map_err(|sentence| Refusal::of_model(&model, format!("{model}: {sentence}")))
    }

    fn understand(written: Written, shared: &Shared) -> Result<Self, String> {
        let options = shared.merge(&written.options)?;
        let words: Vec<OsString> = (options.iter())
            .filter(|(name, _)| !["timeout", "memory"].contains(&name.as_str()))
            .map(|(name, value)| word(name, value.as_deref()))
            .collect();
        let all = options
            .iter()
            .map(|(name, value)| word(name, value.as_deref()));
        // A list's own options need a list to be allowed.
        let start = ["silmap", "build", "--manifest=-", "--out-dir=."].map(OsString::from);
        let matches = (shared.parser.clone())
            .try_get_matches_from(start.into_iter().chain(all))
            .map_err(|error| one_line(&error.to_string()))?;
        let matches = (matches.subcommand_matches("build")).expect("the words are those of build");
        let entry = Self {
            path: shared.model_path(&written.model),
            out: shared.folder.join(&written.out),
            model: written.model,
            meaning: meaning(shared, matches),
            files: options
                .values()
                .flatten()
                .map(PathBuf::from)
                .filter(|file| file.is_file())
                .collect(),
            words,
            timeout: matches.get_one("timeout").copied(),
            memory: matches.get_one("memory").copied(),
        };
        entry.check_paths()?;
        Ok(entry)
    }

    fn check_paths(&self) -> Result<(), String> {
        let Ok(model) = self.path.canonicalize() else {
            // Reading the model reports what is wrong.
            return Ok(());
        };
        if self.out.canonicalize().is_ok_and(|out| out == model) {
            return Err("its asset would replace it".to_owned());
        }
        match model.metadata() {
            Ok(found) if found.is_dir() => Err("it is a folder".to_owned()),
            Ok(found) if !found.is_file() => {
                Err("it is a device or a pipe, which a list cannot hold".to_owned())
            }
            _ => Ok(()),
        }
    }

    /// What the asset depends on: SHA-256 of the version, the options, the model, and the files that both name. `None` where the
    /// model cannot be read.
    pub(super) fn hash(&self) -> Option<String> {
        let mut hasher = Sha256::new();
        hasher.update(format!(
            "silmap {}\n{}",
            env!("CARGO_PKG_VERSION"),
            self.meaning
        ));
        for (name, digest) in companions::digests(&self.path).ok()? {
            hasher.update(format!("{name} {digest}\n"));
        }
        for file in &self.files {
            hasher.update(companions::digest(file).ok()?);
        }
        Some(companions::hex(&hasher.finalize()))
    }
}

fn word(name: &str, value: Option<&OsStr>) -> OsString {
    let mut word = OsString::from(format!("--{name}"));
    if let Some(value) = value {
        word.push("=");
        word.push(value);
    }
    word
}

/// Every option that matters to the asset with its value, given or by default.
fn meaning(shared: &Shared, matches: &ArgMatches) -> String {
    let build = (shared.parser.find_subcommand("build")).expect("there is a command build");
    let mut lines = BTreeSet::new();
    for argument in build.get_arguments() {
        let name = argument.get_long().unwrap_or_default();
        if !shared.known.contains_key(name) || NOT_IN_THE_HASH.contains(&name) {
            continue;
        }
        if let Some(values) = matches.get_raw(argument.get_id().as_str()) {
            let values: Vec<_> = values.map(|v| v.to_string_lossy()).collect();
            lines.insert(format!("{name}={}\n", values.join(" ")));
        }
    }
    lines.into_iter().collect()
}

/// The sentence of a parser's message of many lines.
pub(super) fn one_line(message: &str) -> String {
    let paragraph: Vec<&str> = message
        .lines()
        .map(str::trim)
        .take_while(|line| !line.is_empty())
        .collect();
    let sentence = paragraph.join(" ");
    sentence
        .strip_prefix("error: ")
        .unwrap_or(&sentence)
        .to_owned()
}
