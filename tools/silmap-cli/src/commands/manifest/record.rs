//! The result of a model: the line on standard output, and the record beside the asset.
//!
//! A record appears after its asset, so that an asset without one is built again and never taken for something else.

use std::fs::{self, File};
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::ending::{Ended, Status};
use super::entry::Entry;
use super::list::Refusal;

/// Larger files are no records.
const MAX_RECORD_BYTES: u64 = 1 << 22;

/// How one model of a list ended, as it is printed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Line {
    /// Its line in the list, counted from 1.
    pub(super) line: u64,
    /// As the list says it; null where the list does not say it.
    model: Option<String>,
    /// The asset's path; null where the line does not lead to one.
    out: Option<PathBuf>,
    pub(super) status: Status,
    /// Why there is no asset; null where there is one.
    message: Option<String>,
    /// Seconds of each stage as `build` counts them, and of the whole; `total` alone where there is no asset.
    seconds: Value,
    /// The most memory that its process held at once; null where the system does not report it.
    peak_bytes: Option<u64>,
    /// SHA-256 of version, options, the model and the files it names; null where it cannot be read.
    hash: Option<String>,
    /// What the process ended with; null when it was a signal, or there was no process.
    exit_code: Option<i32>,
    /// Size of the asset.
    bytes: Option<u64>,
    /// What was odd about the model.
    warnings: Vec<String>,
}

impl Line {
    /// A line of the list that names no model to build.
    pub(super) fn refused(number: u64, refusal: Refusal) -> Self {
        Self {
            line: number,
            model: refusal.model,
            out: None,
            status: Status::BadInput,
            message: Some(refusal.sentence),
            seconds: serde_json::json!({"total": 0.0}),
            peak_bytes: None,
            hash: None,
            exit_code: None,
            bytes: None,
            warnings: Vec::new(),
        }
    }

    /// The same for another line of the list.
    pub(super) fn at(self, number: u64) -> Self {
        Self {
            line: number,
            ..self
        }
    }

    /// How a process ended.
    pub(super) fn new(number: u64, entry: &Entry, hash: Option<String>, ended: Ended) -> Self {
        Self {
            line: number,
            model: Some(entry.model.clone()),
            out: Some(entry.out.clone()),
            status: ended.status,
            message: ended.message,
            seconds: ended.seconds,
            peak_bytes: ended.peak_bytes,
            hash,
            exit_code: ended.exit_code,
            bytes: ended.bytes,
            warnings: ended.warnings,
        }
    }
}

/// What is kept of a line beside its asset.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Record {
    /// So that other JSON of the same name is not taken for a record.
    silmap_record: u32,
    #[serde(flatten)]
    line: Line,
}

/// Changes with the meaning of what is recorded.
const FORMAT: u32 = 1;

impl Record {
    pub(super) fn of(line: &Line) -> Self {
        Self {
            silmap_record: FORMAT,
            line: line.clone(),
        }
    }

    /// Puts the record beside the asset.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn write(&self, entry: &Entry) -> anyhow::Result<()> {
        let path = path_of(entry);
        let mut bytes = serde_json::to_vec(self).context("a record cannot be put into JSON")?;
        bytes.push(b'\n');
        let cannot = || format!("{}: it cannot be written", path.display());
        let mut builder = tempfile::Builder::new();
        builder.prefix(".silmap-").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // What any program's new file gets; the process's mask takes its part away.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let folder = entry.out.parent().unwrap_or(Path::new(""));
        let mut part = builder.tempfile_in(folder).with_context(cannot)?;
        part.write_all(&bytes).with_context(cannot)?;
        // Not waited for until it is on the disk: a record that is lost costs a build.
        part.persist(&path).with_context(cannot)?;
        Ok(())
    }

    /// What this record says about the model today: its asset is kept, or it is refused again. `None` where it must be built.
    pub(super) fn still_holds(self, entry: &Entry) -> Option<Line> {
        let line = self.line;
        if line.hash.is_none() || line.hash != entry.hash() {
            return None;
        }
        let status = match line.status {
            Status::Done | Status::Kept => {
                let there = fs::metadata(&entry.out)
                    .ok()
                    .filter(fs::Metadata::is_file)?;
                if line.bytes != Some(there.len()) {
                    return None;
                }
                Status::Kept
            }
            Status::BadInput => Status::BadInput,
            Status::Resources | Status::Failed => return None,
        };
        Some(Line {
            status,
            // The list may have moved.
            model: Some(entry.model.clone()),
            out: Some(entry.out.clone()),
            ..line
        })
    }
}

/// The record beside a model's asset, where there is one that can be read.
pub(super) fn read(entry: &Entry) -> Option<Record> {
    let file = File::open(path_of(entry)).ok()?;
    let input = BufReader::new(file.take(MAX_RECORD_BYTES));
    let record: Record = serde_json::from_reader(input).ok()?;
    (record.silmap_record == FORMAT).then_some(record)
}

/// `chair.glb.json` beside `chair.glb`.
fn path_of(entry: &Entry) -> PathBuf {
    let mut name = entry.out.clone().into_os_string();
    name.push(".json");
    PathBuf::from(name)
}
