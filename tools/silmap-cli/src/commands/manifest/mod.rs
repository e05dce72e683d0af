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
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use anyhow::Context;
use indicatif::ProgressBar;

use crate::args::{ManifestArgs, Shard};
use crate::exit::{ExitClass, NotAllBuilt};
use crate::interrupt;
use crate::output::{self, OutputFolder};
use ending::{Ended, Status};
use entry::{Entry, Shared};
use list::Item;
use record::{Line, Record};

pub(crate) use child::end_with_reader;

/// How often the wish to stop is looked at while the list has nothing new.
const LOOK: Duration = Duration::from_millis(20);

/// How many models ended in which way.
#[derive(Debug, Default)]
struct Counts {
    done: u64,
    kept: u64,
    bad_input: u64,
    resources: u64,
    failed: u64,
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

    /// What an engine should do: try again elsewhere, else report, else never try again. What was refused or failed is in the
    /// lines, and a further run does not repeat what is done.
    fn class(&self) -> Option<ExitClass> {
        [
            (self.resources, ExitClass::Resources),
            (self.failed, ExitClass::Fault),
            (self.bad_input, ExitClass::BadInput),
        ]
        .into_iter()
        .find_map(|(count, class)| (count > 0).then_some(class))
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
    fs::create_dir_all(folder)
        .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    OutputFolder::check(folder)?;
    if args.memory.is_some() && !cfg!(target_os = "linux") {
        anyhow::bail!("--memory needs Linux");
    }
    let shard = args.shard.unwrap_or(Shard::ALL);
    let bar = std::io::stderr()
        .is_terminal()
        .then(ProgressBar::new_spinner);
    let mut counts = Counts::default();
    let items = list::read(list, shard)?;
    while let Some(item) = next(&items)? {
        let line = settle(item?, &shared, args.resume)?;
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
    let sentence = format!("{}: {}", list.display(), counts.sentence());
    match counts.class() {
        None => {
            output::say(&sentence);
            Ok(())
        }
        Some(class) => Err(NotAllBuilt { sentence, class }.into()),
    }
}

/// The next thing that the thread that reads the list has, or that the user asked to stop.
fn next<T>(items: &Receiver<T>) -> anyhow::Result<Option<T>> {
    loop {
        interrupt::check()?;
        match items.recv_timeout(LOOK) {
            Ok(item) => return Ok(Some(item)),
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

/// What becomes of one line of the list.
fn settle(item: Item, shared: &Shared, resume: bool) -> anyhow::Result<Line> {
    let entry = match item.written.and_then(|written| Entry::new(written, shared)) {
        Ok(entry) => entry,
        Err(refusal) => return Ok(Line::refused(item.number, refusal)),
    };
    if resume && let Some(line) = record::read(&entry).and_then(|r| r.still_holds(&entry)) {
        return Ok(line.at(item.number));
    }
    if let Err(error) = make_folder_of(&entry) {
        // In the way may be the asset of another line.
        let ended = Ended::without_process(Status::of(ExitClass::of(&error)), format!("{error:#}"));
        return Ok(Line::new(item.number, &entry, None, ended));
    }
    let hash = entry.hash();
    let ended = child::build(&entry)?;
    let line = Line::new(item.number, &entry, hash, ended);
    if let Err(error) = Record::of(&line).write(&entry) {
        // The asset is whole; without a record it is built again another time.
        output::warn(&format!("{error:#}"));
    }
    Ok(line)
}

fn make_folder_of(entry: &Entry) -> anyhow::Result<()> {
    let folder = entry.out.parent().unwrap_or(Path::new(""));
    let cannot = || {
        format!(
            "{}: the folder {} cannot be made",
            entry.model,
            folder.display()
        )
    };
    fs::create_dir_all(folder).with_context(cannot)
}
