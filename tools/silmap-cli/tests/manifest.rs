//! `silmap build --manifest`: lists with good and bad models, resumed, sharded, limited and interrupted.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::{Ended, bare, path, run, scratch};
use serde_json::Value;

/// Options of a build that takes a moment.
const TINY: [&str; 7] = [
    "--views=32",
    "--keep=10",
    "--resolution=48",
    "--faces=60",
    "--texture-views=2",
    "--texture-size=16",
    "--atlas-size=16",
];

/// A folder with models: three tori of different size, an open mesh and a broken file.
fn models(name: &str) -> PathBuf {
    let folder = scratch(name);
    for (name, faces) in [("a.ply", "200"), ("b.obj", "240"), ("c.ply", "300")] {
        let file = folder.join(name);
        let made = run(&["generate", "torus", "--faces", faces, "-o", path(&file)]);
        assert_eq!(made.code, 0, "{}", made.err);
    }
    fs::write(
        folder.join("open.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .unwrap();
    fs::write(folder.join("broken.ply"), "ply\nformat ascii 1.0\nelement").unwrap();
    folder
}

/// Builds a list in a folder; `more` are further options.
fn build(folder: &Path, lines: &str, more: &[&str]) -> (Ended, Vec<Value>) {
    let list = folder.join("list.jsonl");
    fs::write(&list, lines).unwrap();
    let out = folder.join("out");
    let mut command = bare();
    command.args(["build", "--manifest", path(&list), "--out-dir", path(&out)]);
    let ended = Ended::of(command.args(TINY).args(more));
    let printed = lines_of(&ended.out);
    (ended, printed)
}

fn lines_of(out: &str) -> Vec<Value> {
    out.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn fields<'a>(lines: &'a [Value], field: &str) -> Vec<&'a str> {
    lines
        .iter()
        .map(|line| line[field].as_str().unwrap_or(""))
        .collect()
}

/// Names of files below a folder.
fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn each_model_ends_in_its_own_file_and_line() {
    let folder = models("manifest-each");
    let list = r#"{"model": "a.ply"}
{"model": "broken.ply"}

{"model": "b.obj", "out": "below/second", "options": {"views": 40, "no-normals": true, "tiles": "fixed"}}
{"model": "open.obj", "out": "closed.glb", "options": {"close-holes": true}}
{"model": "open.obj"}
{"model": "missing.stl"}
{"model": "c.ply", "out": "a.glb"}
{"model": "c.ply", "out": "x1", "options": {"viewz": 3}}
{"model": "c.ply", "out": "x2", "options": {"views": 3}}
{"model": "c.ply", "out": "x3", "options": {"keep": 50}}
{"model": "c.ply", "out": "../c.glb"}
{"model": "c.ply"
{"model": "c.ply", "options": {"max-error": "2%"}}
{"model": "b.obj", "out": "a.glb/b"}
{"model": "b.obj", "options": {"texture-format": "png"}}
"#;
    let (ended, lines) = build(&folder, list, &[]);
    assert_eq!(ended.code, 1, "{}", ended.err);
    assert!(
        ended
            .err
            .ends_with("list.jsonl: 4 done, 11 with bad input\n"),
        "{}",
        ended.err
    );
    assert_eq!(ended.err.lines().count(), 1, "{}", ended.err);
    let bad = "bad-input";
    let statuses = [
        "done", bad, "done", bad, bad, bad, bad, bad, bad, bad, bad, bad, "done", bad, "done",
    ];
    assert_eq!(fields(&lines, "status"), statuses);
    let numbers: Vec<u64> = lines.iter().map(|l| l["line"].as_u64().unwrap()).collect();
    assert_eq!(
        numbers,
        [1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]
    );
    for (place, says) in [
        (1, "broken.ply: "),
        (3, "open.obj: "),
        (4, "open.obj: "),
        (5, "missing.stl: "),
        (
            6,
            "list.jsonl, line 8: c.ply: its asset would be a.glb, which is that of line 1",
        ),
        (7, "c.ply: `viewz` is no option"),
        (8, "c.ply: invalid value '3' for '--views <N>'"),
        (9, "--keep cannot be more than --views"),
        (10, "line 12: c.ply: \"out\" is ../c.glb"),
        (11, "list.jsonl, line 13: "),
        (13, "b.obj: the folder "),
    ] {
        let message = lines[place]["message"].as_str().unwrap();
        assert!(
            message.contains(says) && !message.contains('\n'),
            "{place}: {message}"
        );
    }
    for (place, name, model, options) in [
        (0, "a.glb", "a.ply", &TINY[..]),
        (
            2,
            "below/second.glb",
            "b.obj",
            &[&["--views=40", "--no-normals", "--tiles=fixed"], &TINY[1..]].concat(),
        ),
        (
            12,
            "c.glb",
            "c.ply",
            &[&["--max-error=2%", "--views=32"], &TINY[2..]].concat(),
        ),
    ] {
        let line = &lines[place];
        let asset = folder.join("out").join(name);
        assert_eq!(line["out"], path(&asset));
        assert_eq!(line["message"], Value::Null);
        let bytes = fs::read(&asset).unwrap();
        assert_eq!(line["bytes"], bytes.len());
        assert!(
            line["peak_bytes"]
                .as_u64()
                .is_none_or(|peak| peak > 1 << 20)
        );
        assert!(
            line["seconds"]["map"].as_f64().unwrap() <= line["seconds"]["total"].as_f64().unwrap()
        );
        assert_eq!(line["hash"].as_str().unwrap().len(), 64);
        let plain = folder.join("plain.glb");
        let mut command = bare();
        command.args(["build", path(&folder.join(model)), "-o", path(&plain)]);
        let ended = Ended::of(command.args(options));
        assert_eq!(ended.code, 0, "{}", ended.err);
        assert!(
            fs::read(&plain).unwrap() == bytes,
            "{name} is not what a plain build makes"
        );
    }
    let assets = files(&folder.join("out"));
    let kinds: Vec<&String> = assets
        .iter()
        .filter(|name| name.ends_with(".glb"))
        .collect();
    assert_eq!(kinds, ["a.glb", "b.glb", "c.glb"]);
    assert!(
        assets.iter().all(|name| !name.contains("part")),
        "{assets:?}"
    );
}

#[test]
fn resuming_builds_only_what_is_new() {
    let folder = models("manifest-resume");
    let list = "{\"model\": \"a.ply\"}\n{\"model\": \"open.obj\"}\n{\"model\": \"b.obj\"}\n";
    let (_, first) = build(&folder, list, &[]);
    assert_eq!(fields(&first, "status"), ["done", "bad-input", "done"]);
    let statuses = |list: &str, more: &[&str]| {
        let (ended, lines) = build(&folder, list, &[&["--resume"], more].concat());
        assert_eq!(ended.code, 1, "{}", ended.err);
        let statuses = fields(&lines, "status").join(" ");
        (statuses, lines)
    };
    let made = fs::metadata(folder.join("out/a.glb"))
        .unwrap()
        .modified()
        .unwrap();
    let (kept, second) = statuses(list, &["--threads=1"]);
    assert_eq!(kept, "kept bad-input kept");
    assert_eq!(
        made,
        fs::metadata(folder.join("out/a.glb"))
            .unwrap()
            .modified()
            .unwrap()
    );
    for (before, after) in first.iter().zip(&second) {
        for field in [
            "line",
            "model",
            "out",
            "message",
            "seconds",
            "peak_bytes",
            "hash",
            "bytes",
        ] {
            assert_eq!(before[field], after[field], "{field}");
        }
    }
    // Said otherwise, and meant the same; then something else.
    let same = list.replace(
        "a.ply\"}",
        "a.ply\", \"options\": {\"--radius\": \"3R\", \"views\": 32}}",
    );
    assert_eq!(statuses(&same, &[]).0, "kept bad-input kept");
    let other = list.replace("a.ply\"}", "a.ply\", \"options\": {\"tolerance\": 0.6}}");
    assert_eq!(statuses(&other, &[]).0, "done bad-input kept");
    assert_eq!(statuses(list, &[]).0, "done bad-input kept");
    // The model, what it names, the asset and its record: whatever changes, the model is built again.
    let add = |name: &str, text: &str| {
        let file = folder.join(name);
        let before = fs::read_to_string(&file).unwrap();
        fs::write(&file, format!("{before}{text}")).unwrap();
    };
    add("b.obj", "# a word\nmtllib colours.mtl\n");
    assert_eq!(statuses(list, &[]).0, "kept bad-input done");
    fs::write(folder.join("colours.mtl"), "newmtl x\nKd 1 0 0\n").unwrap();
    assert_eq!(statuses(list, &[]).0, "kept bad-input done");
    add("colours.mtl", "newmtl y\n");
    assert_eq!(statuses(list, &[]).0, "kept bad-input done");
    fs::write(folder.join("out/b.glb"), "short").unwrap();
    fs::remove_file(folder.join("out/a.glb.json")).unwrap();
    assert_eq!(statuses(list, &[]).0, "done bad-input done");
    fs::write(folder.join("out/a.glb.json"), "{\"silmap_record\":").unwrap();
    fs::remove_file(folder.join("out/b.glb")).unwrap();
    assert_eq!(statuses(list, &[]).0, "done bad-input done");
    // Mended meanwhile, what was refused is built.
    fs::copy(folder.join("b.obj"), folder.join("open.obj")).unwrap();
    let (ended, lines) = build(&folder, list, &["--resume"]);
    assert_eq!(
        (ended.code, fields(&lines, "status").join(" ")),
        (0, "kept done kept".to_owned())
    );
    // Without --resume all are built again.
    let (ended, lines) = build(&folder, list, &[]);
    assert_eq!(
        (ended.code, fields(&lines, "status").join(" ")),
        (0, "done done done".to_owned())
    );
}

#[test]
fn shards_share_the_list() {
    let folder = models("manifest-shards");
    let list = "{\"model\": \"a.ply\"}\n\n{\"model\": \"b.obj\"}\n{\"model\": \"c.ply\"}\n{\"model\": \"c.ply\"}\nnonsense\n";
    let mut numbers = Vec::new();
    for shard in ["0/2", "1/2"] {
        let (ended, lines) = build(&folder, list, &["--shard", shard]);
        assert_eq!(ended.code, 1, "{}", ended.err);
        numbers.push(
            lines
                .iter()
                .map(|l| l["line"].as_u64().unwrap())
                .collect::<Vec<_>>(),
        );
        if shard == "0/2" {
            // The double is one wherever the first is built.
            let message = lines[1]["message"].as_str().unwrap();
            assert!(message.contains("that of line 4"), "{message}");
        }
    }
    assert_eq!(numbers, [vec![3, 5], vec![1, 4, 6]]);
    assert_eq!(
        build(&folder, list, &["--shard", "2/2", "--resume"]).1[0]["line"],
        3
    );
    let (ended, lines) = build(&folder, "\n\n", &[]);
    assert_eq!((ended.code, lines.len()), (0, 0), "{}", ended.err);
}

#[test]
fn a_list_may_come_from_a_pipe() {
    use std::io::Write;
    use std::process::Stdio;
    let folder = models("manifest-pipe");
    let mut child = bare()
        .current_dir(&folder)
        .args(["build", "--manifest", "-", "--out-dir", "out"])
        .args(TINY)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    input.write_all(b"{\"model\": \"a.ply\"}").unwrap();
    drop(input);
    let ended = child.wait_with_output().unwrap();
    let lines = lines_of(&String::from_utf8(ended.stdout).unwrap());
    assert_eq!(
        (ended.status.code(), fields(&lines, "status")),
        (Some(0), vec!["done"])
    );
    assert_eq!(lines[0]["out"], "out/a.glb");
}

#[test]
fn an_asset_never_replaces_its_model() {
    let folder = models("manifest-self");
    let out = folder.join("out");
    fs::create_dir(&out).unwrap();
    let model = out.join("a.glb");
    let made = run(&["generate", "torus", "--faces", "200", "-o", path(&model)]);
    assert_eq!(made.code, 0, "{}", made.err);
    let before = fs::read(&model).unwrap();
    let (ended, lines) = build(
        &folder,
        "{\"model\": \"out/a.glb\"}\n{\"model\": \"out\"}\n",
        &[],
    );
    assert_eq!(ended.code, 1);
    for (line, says) in lines.iter().zip(["would replace it", "it is a folder"]) {
        assert!(line["message"].as_str().unwrap().contains(says), "{line}");
    }
    assert!(fs::read(&model).unwrap() == before);
}

#[cfg(target_os = "linux")]
#[test]
fn limits_end_a_model_and_not_the_list() {
    let folder = models("manifest-limits");
    let big = folder.join("big.ply");
    let made = run(&["generate", "torus", "--faces", "30000", "-o", path(&big)]);
    assert_eq!(made.code, 0, "{}", made.err);
    let list = r#"{"model": "a.ply"}
{"model": "big.ply", "out": "slow", "options": {"views": 20000, "timeout": 0.5}}
{"model": "big.ply", "out": "large", "options": {"memory": "8M"}}
{"model": "open.obj"}
{"model": "b.obj"}
"#;
    let limits = ["--timeout", "300", "--memory", "2G"];
    let (ended, lines) = build(&folder, list, &limits);
    assert_eq!(ended.code, 4, "{}", ended.err);
    let statuses = fields(&lines, "status");
    assert_eq!(
        statuses,
        ["done", "resources", "resources", "bad-input", "done"],
        "{lines:?}"
    );
    let message = |place: usize| lines[place]["message"].as_str().unwrap();
    assert!(
        message(1).ends_with("big.ply: not built within 0.5 s"),
        "{}",
        message(1)
    );
    assert!(message(2).contains("memory"), "{}", message(2));
    assert_eq!(
        files(&folder.join("out")),
        [
            "a.glb",
            "a.glb.json",
            "b.glb",
            "b.glb.json",
            "large.glb.json",
            "open.glb.json",
            "slow.glb.json"
        ]
    );
    // What ran out of resources is tried again, though nothing has changed but the limit.
    let roomy = list
        .replace(", \"options\": {\"memory\": \"8M\"}", "")
        .replace("30000", "300");
    let (ended, lines) = build(&folder, &roomy, &["--resume"]);
    assert_eq!(ended.code, 4);
    assert_eq!(
        fields(&lines, "status"),
        ["kept", "resources", "done", "bad-input", "kept"]
    );
}

#[test]
fn what_is_wrong_with_the_whole_list_is_said_before_the_work() {
    let folder = models("manifest-whole");
    let list = folder.join("list.jsonl");
    fs::write(&list, "{\"model\": \"a.ply\"}\n").unwrap();
    let (list, out, model) = (path(&list), folder.join("out"), folder.join("a.ply"));
    let out = path(&out);
    for (arguments, code, says) in [
        (&["--manifest", list][..], 2, "--out-dir"),
        (
            &["--manifest", list, "--out-dir", out, "-o", "x.glb"],
            2,
            "cannot be used with",
        ),
        (
            &["--manifest", list, "--out-dir", out, path(&model)],
            2,
            "cannot be used with",
        ),
        (
            &["--manifest", list, "--out-dir", out, "--shard", "3/2"],
            2,
            "I/N",
        ),
        (
            &["--manifest", list, "--out-dir", out, "--timeout", "0"],
            2,
            "seconds",
        ),
        (&[path(&model), "-o", "x.glb", "--resume"], 2, "--manifest"),
        (
            &["--manifest", list, "--out-dir", path(&model)],
            1,
            "a.ply: ",
        ),
        (
            &["--manifest", "missing.jsonl", "--out-dir", out],
            1,
            "missing.jsonl: ",
        ),
    ] {
        let ended = run(&[&["build"], arguments].concat());
        assert_eq!(ended.code, code, "{arguments:?}: {}", ended.err);
        assert!(ended.err.contains(says), "{arguments:?}: {}", ended.err);
        assert_eq!(ended.out, "");
    }
}

#[cfg(target_os = "linux")]
mod interrupted {
    use std::io::{BufRead, BufReader};
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    use super::*;

    /// A list whose second model is far more work than a test waits for, begun.
    fn begin(folder: &Path) -> (Child, BufReader<std::process::ChildStdout>, Value) {
        let big = folder.join("big.ply");
        let made = run(&["generate", "torus", "--faces", "60000", "-o", path(&big)]);
        assert_eq!(made.code, 0, "{}", made.err);
        let list = folder.join("list.jsonl");
        let lines = "{\"model\": \"a.ply\"}\n{\"model\": \"big.ply\", \"options\": {\"views\": 20000}}\n{\"model\": \"b.obj\"}\n";
        fs::write(&list, lines).unwrap();
        let mut child = bare()
            .args([
                "build",
                "--manifest",
                path(&list),
                "--out-dir",
                path(&folder.join("out")),
            ])
            .args(TINY)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut first = String::new();
        out.read_line(&mut first).unwrap();
        // The second has begun.
        std::thread::sleep(Duration::from_millis(1500));
        (child, out, serde_json::from_str(&first).unwrap())
    }

    /// Processes that a process has started.
    fn children(process: u32) -> Vec<u32> {
        let path = format!("/proc/{process}/task/{process}/children");
        let text = fs::read_to_string(path).unwrap_or_default();
        text.split_whitespace()
            .map(|id| id.parse().unwrap())
            .collect()
    }

    fn wait_until_gone(process: u32) {
        let since = Instant::now();
        let stat = || fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        // A zombie process that was not waited for counts as gone too.
        while !stat().is_empty() && !stat().contains(") Z ") {
            assert!(
                since.elapsed() < Duration::from_secs(20),
                "it goes on: {}",
                stat()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    #[test]
    fn an_interrupt_keeps_what_is_done() {
        for signal in ["INT", "TERM", "KILL"] {
            let folder = models(&format!("manifest-{signal}"));
            let (mut child, mut out, first) = begin(&folder);
            assert_eq!(first["status"], "done");
            let builders = children(child.id());
            assert_eq!(builders.len(), 1);
            let sent = Command::new("kill")
                .args([&format!("-{signal}"), &child.id().to_string()])
                .status();
            assert!(sent.unwrap().success());
            let status = child.wait().unwrap();
            wait_until_gone(builders[0]);
            if signal != "KILL" {
                assert_eq!(status.code(), Some(130));
            }
            let mut rest = String::new();
            out.read_line(&mut rest).unwrap();
            assert_eq!(rest, "", "a model that was not finished has no line");
            assert_eq!(files(&folder.join("out")), ["a.glb", "a.glb.json"]);
            let list = "{\"model\": \"a.ply\"}\n{\"model\": \"b.obj\"}\n";
            let (ended, lines) = build(&folder, list, &["--resume"]);
            assert_eq!(ended.code, 0, "{}", ended.err);
            assert_eq!(fields(&lines, "status"), ["kept", "done"]);
        }
    }
}
