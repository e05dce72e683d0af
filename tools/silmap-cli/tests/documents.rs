//! The commands that README and docs print, run as they stand there, or with smaller numbers.
//!
//! Every fenced block of the language `sh` is run in a folder of its document's own, block after block. What follows `sh` may be
//! `not-run:` and one of [`NOT_RUN`], or `given:` and a file that [`give`] makes first. Blocks of other languages hold no commands.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{Ended, bare, is_gpu_skipped, outside, run, scratch};
use serde_json::{Value, json};

/// Why a block is not run: a word for it and what it means.
const NOT_RUN: [(&str, &str); 6] = [
    ("installs", "installs software or builds silmap itself"),
    ("minutes", "takes minutes at the size that it has"),
    ("cluster", "needs a scheduler, its server or its workers"),
    ("photographs", "needs photographs of an object"),
    ("measured", "tools/results runs it to measure"),
    (
        "window",
        "opens a window, or serves a page until it is ended",
    ),
];

/// Languages whose blocks hold no commands.
const OTHER_LANGUAGES: [&str; 4] = ["json", "rust,no_run", "text", "python"];

/// What is made smaller, so that an unoptimised build needs seconds. The longest come first.
const SMALLER: [(&str, &str); 15] = [
    (
        "--instances 1000 --pixels 128 --size 2048x2048 --repeat 31",
        "--instances 6 --pixels 20 --size 64x64 --repeat 2",
    ),
    ("--views 640 --keep 192 --faces 1000", SMALL_BUILD),
    (
        "build organic.ply -o organic.glb",
        "build organic.ply SMALL -o organic.glb",
    ),
    ("SMALL", SMALL_BUILD),
    ("--faces 60000", "--faces 1200"),
    ("--faces 4000", "--faces 600"),
    ("--faces 1000", "--faces 200"),
    ("--faces 500", "--faces 150"),
    ("--keep 64", "--keep 8"),
    ("--viewpoints 60", "--viewpoints 5 --resolution 96"),
    ("--directions 300", "--directions 12"),
    ("--repeat 31", "--repeat 3 --size 64x64"),
    ("--walk 40", "--walk 4"),
    ("--orbit 72", "--orbit 3"),
    ("--orbit 60", "--orbit 3"),
];

const SMALL_BUILD: &str = "--views 40 --keep 14 --resolution 96 --faces 100 --texture-views 3 --texture-size 32 --atlas-size 32";

/// A fenced block of a document.
#[derive(Debug)]
struct Block {
    document: String,
    line: usize,
    language: String,
    text: String,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// README and the pages of docs.
fn documents() -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(root().join("docs"))
        .unwrap()
        .map(|entry| format!("docs/{}", entry.unwrap().file_name().to_string_lossy()))
        .filter(|name| name.ends_with(".md"))
        .collect();
    names.push("README.md".to_owned());
    names.sort();
    names
}

fn blocks(document: &str) -> Vec<Block> {
    let text = fs::read_to_string(root().join(document)).unwrap();
    let mut found: Vec<Block> = Vec::new();
    let mut is_open = false;
    for (k, line) in text.lines().enumerate() {
        match line.strip_prefix("```") {
            Some(_) if is_open => is_open = false,
            Some(language) => {
                is_open = true;
                found.push(Block {
                    document: document.to_owned(),
                    line: k + 1,
                    language: language.trim().to_owned(),
                    text: String::new(),
                });
            }
            None if is_open => {
                let text = &mut found.last_mut().unwrap().text;
                text.push_str(line);
                text.push('\n');
            }
            None => {}
        }
    }
    assert!(!is_open, "{document}: a block has no end");
    found
}

impl Block {
    fn place(&self) -> String {
        format!("{}:{}", self.document, self.line)
    }

    /// What follows the language, for a block of commands.
    fn commands(&self) -> Option<&str> {
        let rest = self.language.strip_prefix("sh")?;
        (rest.is_empty() || rest.starts_with(' ')).then(|| rest.trim())
    }

    /// The commands with smaller numbers.
    fn small(&self) -> String {
        SMALLER
            .iter()
            .fold(self.text.clone(), |text, (large, small)| {
                text.replace(large, small)
            })
    }

    /// Whether it draws, for which a graphics adapter is needed.
    fn draws(&self) -> bool {
        ["render", "report", "bench", "--textures", "align"]
            .iter()
            .any(|word| self.text.contains(word))
    }
}

/// Makes a file that the page takes for granted.
fn give(name: &str, folder: &Path) {
    match name {
        "edited.glb" => give_edited(folder),
        "models.jsonl" => give_list(folder),
        _ => panic!("nobody knows how to make {name}"),
    }
}

/// A list of two models, one with options of its own.
fn give_list(folder: &Path) {
    fs::create_dir(folder.join("chairs")).unwrap();
    let mut list = String::new();
    for (name, options) in [
        ("chairs/17.obj", json!({})),
        ("chairs/18.ply", json!({"keep": 12})),
    ] {
        let made = Ended::of(
            bare()
                .current_dir(folder)
                .args(["generate", "torus", "--faces", "300", "-o", name]),
        );
        assert_eq!(made.code, 0, "{}", made.err);
        let mut options = options;
        for (name, value) in [
            ("views", 40),
            ("resolution", 96),
            ("faces", 60),
            ("texture-views", 2),
            ("texture-size", 16),
        ] {
            options[name] = value.into();
        }
        if options.get("keep").is_none() {
            options["keep"] = 14.into();
        }
        list += &format!("{}\n", json!({"model": name, "options": options}));
    }
    fs::write(folder.join("models.jsonl"), list).unwrap();
}

/// An asset as another program saves it.
fn give_edited(folder: &Path) {
    let asset = fs::read(folder.join("organic.glb")).unwrap();
    let length = u32::from_le_bytes(asset[12..16].try_into().unwrap()) as usize;
    let mut document: Value = serde_json::from_slice(&asset[20..20 + length]).unwrap();
    document.as_object_mut().unwrap().remove("extensions");
    document["extensionsUsed"] = json!(["KHR_materials_unlit"]);
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let rest = &asset[20 + length..];
    let mut edited = b"glTF\x02\0\0\0".to_vec();
    edited.extend(((20 + json.len() + rest.len()) as u32).to_le_bytes());
    edited.extend((json.len() as u32).to_le_bytes());
    edited.extend(b"JSON");
    edited.extend(json);
    edited.extend(rest);
    fs::write(folder.join("edited.glb"), edited).unwrap();
}

/// Runs all commands of a document, and says how many blocks that were.
fn run_document(document: &str) -> usize {
    let folder = scratch(&document.replace(['/', '.'], "-"));
    let mut path = OsString::from(Path::new(env!("CARGO_BIN_EXE_silmap")).parent().unwrap());
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    let mut n_run = 0;
    for block in blocks(document) {
        let Some(how) = block.commands() else {
            continue;
        };
        if how.starts_with("not-run:") || (block.draws() && is_gpu_skipped()) {
            continue;
        }
        if let Some(name) = how.strip_prefix("given:") {
            give(name.trim(), &folder);
        }
        let mut shell = Command::new("sh");
        shell.args(["-e", "-c", &block.small()]);
        let ended = Ended::of(shell.current_dir(&folder).env("PATH", &path));
        assert_eq!(
            ended.code,
            0,
            "{}: {}{}",
            block.place(),
            block.text,
            ended.err
        );
        n_run += 1;
    }
    n_run
}

#[test]
fn every_block_is_run_or_says_why_not() {
    let mut used = BTreeSet::new();
    for document in documents() {
        for block in blocks(&document) {
            let place = block.place();
            match block.commands() {
                None => assert!(
                    OTHER_LANGUAGES.contains(&block.language.as_str()),
                    "{place}: a block of the language {:?} may hold commands: call them sh",
                    block.language
                ),
                Some(how) => {
                    if let Some(reason) = how.strip_prefix("not-run:") {
                        assert!(
                            NOT_RUN.iter().any(|(word, _)| *word == reason.trim()),
                            "{place}: {reason} is no reason"
                        );
                        used.insert(reason.trim().to_owned());
                    } else {
                        assert!(
                            how.is_empty() || how.starts_with("given:"),
                            "{place}: what is {how:?}?"
                        );
                        let words = block.text.lines().flat_map(|l| l.split_whitespace().next());
                        for word in words {
                            used.insert(word.to_owned());
                        }
                    }
                }
            }
        }
    }
    assert!(used.contains("silmap"), "no commands were found");
    let all: String = documents()
        .iter()
        .flat_map(|d| blocks(d))
        .map(|b| b.text)
        .collect();
    for (large, _) in SMALLER.iter().filter(|(large, _)| *large != "SMALL") {
        assert!(all.contains(large), "no command has {large}");
    }
}

#[test]
fn readme_is_run() {
    assert!(run_document("README.md") >= 1);
}

#[test]
fn the_guide_is_run() {
    assert!(run_document("docs/guide.md") >= 14);
}

#[test]
fn the_other_pages_are_run() {
    for document in documents() {
        if document != "README.md" && document != "docs/guide.md" {
            run_document(&document);
        }
    }
}

#[test]
fn the_guide_has_every_command() {
    let help = run(&["--help"]).out;
    let (_, commands) = help.split_once("Commands:\n").unwrap();
    let guide: String = blocks("docs/guide.md")
        .into_iter()
        .map(|b| b.text)
        .collect();
    let mut n_commands = 0;
    for line in commands.lines().take_while(|line| !line.is_empty()) {
        let Some(name) = line.strip_prefix("  ").and_then(|l| l.split(' ').next()) else {
            continue;
        };
        if name.is_empty() || name == "help" {
            continue;
        }
        assert!(
            guide.contains(&format!("silmap {name} ")),
            "no `silmap {name}`"
        );
        n_commands += 1;
    }
    assert!(n_commands >= 14, "{help}");
}

/// Runs `tools/results` with arguments; `None`, said aloud, where there is no Python.
fn results(arguments: &[&str]) -> Option<Ended> {
    if Command::new("python3").arg("--version").output().is_err() {
        outside::skip("figures of the documents: python3 is not here");
        return None;
    }
    let mut program = Command::new("python3");
    program.arg("tools/results").args(arguments);
    Some(Ended::of(program.current_dir(root())))
}

#[test]
fn figures_are_those_that_were_measured() {
    let Some(ended) = results(&["--check"]) else {
        return;
    };
    assert_eq!(ended.code, 0, "{}", ended.err);
    // One figure that is another one shows in both pages.
    let stored = fs::read_to_string(root().join("docs/results.json")).unwrap();
    let mut measured: Value = serde_json::from_str(&stored).unwrap();
    let figure =
        &mut measured["runs"]["evaluate/torus"]["figures"]["methods.tight.misclassified_mean"];
    *figure = (figure.as_f64().unwrap() + 0.01).into();
    let other = scratch("figures").join("results.json");
    fs::write(&other, measured.to_string()).unwrap();
    let ended = results(&["--check", "--stored", other.to_str().unwrap()]).unwrap();
    assert_eq!(ended.code, 1);
    for page in ["README.md", "docs/results.md", "docs/methods.md"] {
        assert!(ended.err.contains(page), "{}", ended.err);
    }
}

#[test]
fn readme_fits_three_screens() {
    let text = fs::read_to_string(root().join("README.md")).unwrap();
    let words = text.split_whitespace().count();
    assert!(words <= 700, "{words} words");
}

#[test]
fn every_link_leads_somewhere() {
    let mut n_links = 0;
    for document in documents()
        .into_iter()
        .chain(["ARCHITECTURE.md".to_owned()])
    {
        let text = fs::read_to_string(root().join(&document)).unwrap();
        let folder = root().join(&document).parent().unwrap().to_owned();
        for link in text.split("](").skip(1) {
            let target = link.split(')').next().unwrap();
            if target.starts_with("http") {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let path = if file.is_empty() {
                root().join(&document)
            } else {
                folder.join(file)
            };
            assert!(
                path.exists(),
                "{document} leads to {target}, which is not there"
            );
            if !anchor.is_empty() {
                let page = fs::read_to_string(&path).unwrap();
                assert!(
                    page.lines()
                        .any(|l| l.starts_with('#') && anchor_of(l) == anchor),
                    "{document}: {target}"
                );
            }
            n_links += 1;
        }
    }
    assert!(n_links >= 8, "{n_links} links");
}

/// The anchor of a heading, as GitHub makes it.
fn anchor_of(heading: &str) -> String {
    let words = heading.trim_start_matches('#').trim().to_lowercase();
    words
        .chars()
        .filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}
