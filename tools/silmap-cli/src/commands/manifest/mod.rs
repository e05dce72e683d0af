//! `silmap build --manifest`: a list of models, each built by a process of its own.
//!
//! A model that runs out of memory or time, or into a fault of ours or of a library, ends its own process and none else. What
//! became of it stays beside its asset as a record, which a later run reads to know what is done ([`record`]). Nothing grows
//! with the list but a few bytes for each output's name, by which doubles are found.

mod child;
mod companions;
mod ending;
mod entry;
mod list;
mod record;

use std::fs;
use std::io::IsTerminal;
use std::path::Path;

use anyhow::Context;
use indicatif::ProgressBar;

use crate::args::{ManifestArgs, Shard};
use crate::interrupt;
use crate::output;
use entry::{Entry, Shared};
use list::{Item, List};
use record::{Line, Record, Status};

pub(crate) use child::end_with_reader;

/// How many models ended in which way.
#[derive(Debug, Default)]
struct Counts {
    done: u64,
    kept: u64,
    bad_input: u64,
    resources: u64,
    failed: u64,
}

/// Not everything was built; each model's own line says why.
#[derive(Debug, thiserror::Error)]
#[error("{sentence}")]
pub(crate) struct NotAllBuilt {
    sentence: String,
    /// What an engine should do with the list: the program's exit code.
    pub(crate) code: u8,
}

impl Counts {
    fn add(&mut self, status: Status) {
        *match status {
            Status::Done => &mut self.done,
            Status::Kept => &mut self.kept,
            Status::BadInput => &mut self.bad_input,
            Status::Resources => &mut self.resources,
            Status::Failed => &mut self.failed,
        } += 1;
    }

    fn sentence(&self) -> String {
        let named = [
            (self.done, "done"),
            (self.kept, "kept"),
            (self.bad_input, "with bad input"),
            (self.resources, "out of resources"),
            (self.failed, "failed by a fault of ours"),
        ];
        let parts: Vec<String> = named
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        if parts.is_empty() {
            "no models".to_owned()
        } else {
            parts.join(", ")
        }
    }

    /// The exit code that says what to do: again and elsewhere before report before never again. What was refused or failed
    /// is in the lines, and a further run does not repeat what is done.
    fn code(&self) -> Option<u8> {
        if self.resources > 0 {
            Some(Status::Resources.code())
        } else if self.failed > 0 {
            Some(Status::Failed.code())
        } else if self.bad_input > 0 {
            Some(Status::BadInput.code())
        } else {
            None
        }
    }
}

/// Builds the models of a list, or of a part of it.
///
/// # Errors
/// When the list cannot be read or nothing can be written to the folder; [`NotAllBuilt`] after everything else was; when the
/// user asked to stop.
pub(crate) fn run(list: &Path, args: &ManifestArgs) -> anyhow::Result<()> {
    let folder = args.out_dir.as_deref().unwrap_or(Path::new("."));
    let shared = Shared::from_command_line(list, folder)?;
    output::prepare_folder(folder)?;
    if args.memory.is_some() && !cfg!(target_os = "linux") {
        anyhow::bail!("--memory needs Linux");
    }
    let shard = args.shard.unwrap_or(Shard::ALL);
    let bar = std::io::stderr()
        .is_terminal()
        .then(ProgressBar::new_spinner);
    let mut counts = Counts::default();
    let mut list = List::open(list)?;
    while let Some(item) = list
        .next(|place| shard.holds(place))
        .with_context(|| list.name())?
    {
        interrupt::check()?;
        let line = settle(item, &shared, args)?;
        counts.add(line.status);
        output::print_json(&line)?;
        if let Some(bar) = &bar {
            bar.set_message(format!("line {}: {}", line.line, counts.sentence()));
            bar.tick();
        }
    }
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    let sentence = counts.sentence();
    match counts.code() {
        None => {
            output::say(&format!("{}: {sentence}", list.name()));
            Ok(())
        }
        Some(code) => Err(NotAllBuilt {
            sentence: format!("{}: {sentence}", list.name()),
            code,
        }
        .into()),
    }
}

/// What becomes of one line of the list.
fn settle(item: Item, shared: &Shared, args: &ManifestArgs) -> anyhow::Result<Line> {
    let entry = match item.written.and_then(|written| Entry::new(written, shared)) {
        Ok(entry) => entry,
        Err(refusal) => return Ok(Line::refused(item.number, refusal)),
    };
    if args.resume
        && let Some(line) = record::read(&entry).and_then(|r| r.still_holds(&entry))
    {
        return Ok(line.at(item.number));
    }
    if let Some(folder) = entry.out.parent() {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let hash = entry.hash();
    let ended = child::build(&entry)?;
    let line = Line::new(item.number, &entry, hash, ended);
    Record::of(&line).write(&entry)?;
    Ok(line)
}
