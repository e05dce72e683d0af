//! Output: files that appear whole or not at all, one JSON object on standard output, messages on standard error.

mod staged_file;

use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::error::ErrorKind as UsageKind;
use serde::Serialize;
use tempfile::TempPath;

use crate::args::usage_error;
use crate::interrupt;

pub(crate) use staged_file::StagedFile;

/// A file that will be written at the end of long work, checked before it.
#[derive(Debug)]
pub(crate) struct OutputFile {
    path: PathBuf,
    kind: Target,
}

/// What the path leads to.
#[derive(Debug, PartialEq)]
enum Target {
    /// A regular file or nothing yet: written beside it and renamed onto it.
    Regular,
    /// A device or pipe: written in place, since renaming would put a file where the device was.
    Special,
}

impl OutputFile {
    /// Makes sure that a file can be written at `path`, leaving nothing behind.
    ///
    /// # Errors
    /// One sentence when the folder is missing or cannot be written to, or the path is a folder.
    pub(crate) fn check(path: &Path) -> anyhow::Result<Self> {
        let shown = path.display();
        // Behind a link the file it leads to is replaced, not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let kind = match fs::metadata(&path) {
            Ok(found) if found.is_dir() => bail!("{shown}: it is a folder, a file is needed"),
            Ok(found) if !found.is_file() => Target::Special,
            _ => Target::Regular,
        };
        let file = Self { path, kind };
        if file.kind == Target::Regular {
            file.temporary()?;
        }
        Ok(file)
    }

    /// As [`OutputFile::check`], for a picture, which is written as PNG: a name that promises another kind is refused.
    ///
    /// # Errors
    /// As [`OutputFile::check`], and when the name has the ending of another kind of file.
    pub(crate) fn check_png(path: &Path) -> anyhow::Result<Self> {
        let file = Self::check(path)?;
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some(ending) if ending != "png" && file.kind == Target::Regular => bail!(
                "{}: pictures are written as PNG, and a name that ends in .{ending} promises something else",
                path.display()
            ),
            _ => Ok(file),
        }
    }

    /// Puts the bytes there, whole.
    ///
    /// # Errors
    /// When the disk is full or the folder has gone; whatever was at the path stays as it was. When the user asked to stop.
    pub(crate) fn write(&self, bytes: &[u8]) -> anyhow::Result<()> {
        let mut staging = Staging::default();
        staging.add(self, bytes)?;
        staging.publish()
    }

    /// Ends the program, as for options that are wrong together, when this is a file that is read, whose kind of content would be gone. A
    /// mesh that becomes a simpler mesh in its place is another matter.
    pub(crate) fn refuse_to_replace(&self, input: &Path) {
        if fs::canonicalize(input).is_ok_and(|input| input == self.path)
            && self.kind == Target::Regular
        {
            usage_error(
                UsageKind::ArgumentConflict,
                &format!(
                    "{}: it is read and would be replaced: name another file to write",
                    input.display()
                ),
            );
        }
    }

    /// An empty file beside the final one, removed when it is dropped.
    fn temporary(&self) -> anyhow::Result<tempfile::NamedTempFile> {
        let folder = folder_of(&self.path);
        let mut builder = tempfile::Builder::new();
        let extension = self
            .path
            .extension()
            .map_or_else(String::new, |e| format!(".{}", e.to_string_lossy()));
        let suffix = format!(".part{extension}");
        builder.prefix(".silmap-").suffix(&suffix);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // What any program's new file gets; the process's mask takes its part away.
            const NEW_FILE_MODE: u32 = 0o666;
            builder.permissions(fs::Permissions::from_mode(NEW_FILE_MODE));
        }
        builder.tempfile_in(folder).map_err(|error| {
            // The kind, not the error itself, which names the temporary file.
            let reason = match error.kind() {
                ErrorKind::NotFound if !folder.exists() => "the folder does not exist".to_owned(),
                ErrorKind::PermissionDenied => "no permission to write there".to_owned(),
                kind => kind.to_string(),
            };
            let sentence = format!(
                "{}: nothing can be written to the folder {}: {reason}",
                self.path.display(),
                folder.display()
            );
            // Of the same kind, which the exit code depends on.
            std::io::Error::new(error.kind(), sentence).into()
        })
    }
}

/// Ends the program, as for options that are wrong together, when two of the files are one.
pub(crate) fn refuse_same_file<'a>(files: impl IntoIterator<Item = &'a OutputFile>) {
    let mut paths: Vec<PathBuf> = Vec::new();
    for file in files.into_iter().filter(|f| f.kind == Target::Regular) {
        // A file that is not there yet has no full path, its folder has.
        let folder = folder_of(&file.path);
        let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf());
        let path = folder.join(file.path.file_name().unwrap_or_default());
        if paths.contains(&path) {
            usage_error(
                UsageKind::ArgumentConflict,
                &format!(
                    "{}: two results would be written to it",
                    file.path.display()
                ),
            );
        }
        paths.push(path);
    }
}

/// All files of a command, which appear together: each is written beside its place, and when all of them are, they are renamed.
#[derive(Debug, Default)]
pub(crate) struct Staging {
    regular: Vec<(TempPath, PathBuf)>,
    /// Devices and pipes hold nothing back, so that they come when nothing else can fail but a renaming.
    special: Vec<(PathBuf, Vec<u8>)>,
}

impl Staging {
    /// Writes the bytes beside where they will be.
    ///
    /// # Errors
    /// As [`OutputFile::write`].
    pub(crate) fn add(&mut self, file: &OutputFile, bytes: &[u8]) -> anyhow::Result<()> {
        interrupt::check()?;
        if file.kind == Target::Special {
            self.special.push((file.path.clone(), bytes.to_vec()));
            return Ok(());
        }
        let mut temporary = file.temporary()?;
        let written = temporary.write_all(bytes);
        written
            .and_then(|()| temporary.as_file().sync_all())
            .with_context(|| cannot_write(&file.path))?;
        self.regular
            .push((temporary.into_temp_path(), file.path.clone()));
        Ok(())
    }

    /// Makes the files appear, all of them or none.
    ///
    /// # Errors
    /// When a device or pipe does not take its bytes, a file cannot be renamed, or the user asked to stop.
    pub(crate) fn publish(self) -> anyhow::Result<()> {
        interrupt::check()?;
        for (path, bytes) in self.special {
            let device = path.clone();
            // Writing to a pipe without a reader blocks.
            match interrupt::unless_stopped(move || write_into(&device, &bytes))? {
                // The reader closed the pipe early, which is fine.
                Err(error) if error.kind() == ErrorKind::BrokenPipe => {}
                other => other.with_context(|| cannot_write(&path))?,
            }
        }
        let pairs: Vec<(&Path, &Path)> = (self.regular.iter())
            .map(|(from, to)| (&**from, &**to))
            .collect();
        rename_all(&pairs)
    }
}

fn cannot_write(path: &Path) -> String {
    format!("{}: it cannot be written", path.display())
}

fn write_into(device: &Path, bytes: &[u8]) -> io::Result<()> {
    fs::OpenOptions::new()
        .write(true)
        .open(device)?
        .write_all(bytes)
}

/// Renames the first of each pair to the second, all or none: what was replaced comes back when a later one fails.
fn rename_all(pairs: &[(&Path, &Path)]) -> anyhow::Result<()> {
    let mut done: Vec<(&Path, Option<tempfile::TempDir>)> = Vec::new();
    for &(from, to) in pairs {
        let kept = if pairs.len() > 1 {
            keep_aside(to)
        } else {
            None
        };
        if let Err(error) = fs::rename(from, to) {
            for (path, kept) in done.into_iter().rev() {
                // The first failure is the one to report.
                let _ = match kept {
                    Some(folder) => fs::rename(folder.path().join(KEPT), path),
                    None => fs::remove_file(path),
                };
            }
            return Err(error).with_context(|| cannot_write(to));
        }
        done.push((to, kept));
    }
    Ok(())
}

/// What a replaced file is called while it may be needed again.
const KEPT: &str = "kept";

/// A second name for the file, if there is one and the system has such, in a folder of its own.
fn keep_aside(path: &Path) -> Option<tempfile::TempDir> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".silmap-").suffix(".part");
    let folder = builder.tempdir_in(folder_of(path)).ok()?;
    fs::hard_link(path, folder.path().join(KEPT)).ok()?;
    Some(folder)
}

/// The folder that a file is in.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A folder that files will be written into at the end of long work, checked before it.
#[derive(Debug)]
pub(crate) struct OutputFolder {
    path: PathBuf,
}

impl OutputFolder {
    /// Makes sure that a folder is or can be made at `path` and written into, leaving nothing behind.
    ///
    /// # Errors
    /// One sentence when the path is a file, or the folder it is in is missing or cannot be written to.
    pub(crate) fn check(path: &Path) -> anyhow::Result<Self> {
        let shown = path.display();
        match fs::metadata(path) {
            Ok(found) if !found.is_dir() => bail!("{shown}: it is a file, a folder is needed"),
            Ok(_) => OutputFile::check(&path.join(".silmap")).map(drop)?,
            Err(_) => OutputFile::check(path).map(drop)?,
        }
        Ok(Self {
            path: path.to_path_buf(),
        })
    }

    /// As [`OutputFolder::check`], with the folders around it made where they are missing.
    ///
    /// # Errors
    /// As [`OutputFolder::check`].
    pub(crate) fn check_with_parents(path: &Path) -> anyhow::Result<Self> {
        let around = folder_of(path);
        fs::create_dir_all(around)
            .with_context(|| format!("{}: the folder cannot be made", around.display()))?;
        Self::check(path)
    }

    /// Puts files there, all of them or none: a new folder appears with all of them, and in one that was there each replaces its
    /// namesake after all have been written.
    ///
    /// # Errors
    /// When the disk is full or a folder has gone, or the user asked to stop.
    pub(crate) fn write(&self, files: &[(&str, &[u8])]) -> anyhow::Result<()> {
        interrupt::check()?;
        let cannot = || cannot_write(&self.path);
        let is_there = self.path.is_dir();
        let around = if is_there {
            &self.path
        } else {
            folder_of(&self.path)
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".silmap-").suffix(".part");
        let staging = builder.tempdir_in(around).with_context(cannot)?;
        // A folder within, made with the rights that any new folder gets; the temporary one is this user's alone.
        let folder = staging.path().join("new");
        fs::create_dir(&folder).with_context(cannot)?;
        for (name, bytes) in files {
            let mut file = fs::File::create(folder.join(name)).with_context(cannot)?;
            file.write_all(bytes).with_context(cannot)?;
            file.sync_all().with_context(cannot)?;
        }
        interrupt::check()?;
        if !is_there {
            return fs::rename(&folder, &self.path).with_context(cannot);
        }
        let pairs: Vec<(PathBuf, PathBuf)> = (files.iter())
            .map(|(name, _)| (folder.join(name), self.path.join(name)))
            .collect();
        let pairs: Vec<(&Path, &Path)> = pairs.iter().map(|(a, b)| (&**a, &**b)).collect();
        rename_all(&pairs)
    }
}

/// Prints one JSON object and a line end on standard output.
///
/// # Errors
/// When standard output cannot be written to; a closed one has no reader, which is fine.
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    let mut bytes = serde_json::to_vec(value).context("the result cannot be put into JSON")?;
    bytes.push(b'\n');
    print_bytes(&bytes)
}

/// Writes to standard output.
///
/// # Errors
/// As [`print_json`].
pub(crate) fn print_bytes(bytes: &[u8]) -> anyhow::Result<()> {
    let bytes = bytes.to_vec();
    let written = interrupt::unless_stopped(move || {
        let mut out = io::stdout().lock();
        out.write_all(&bytes).and_then(|()| out.flush())
    })?;
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output cannot be written to"),
    }
}

/// One line on standard error. A closed one has no reader, which is fine.
pub(crate) fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// A warning on standard error.
pub(crate) fn warn(sentence: &str) {
    say(&format!("silmap: warning: {sentence}"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_whole_and_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let file = OutputFile::check(&path).unwrap();
        assert!(!path.exists());
        file.write(b"whole").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn several_files_appear_together_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let [old, new, last] = ["old", "new", "last"].map(|name| folder.path().join(name));
        fs::write(&old, "what was there").unwrap();
        let files = [&old, &new, &last].map(|path| OutputFile::check(path).unwrap());
        let staged = || {
            let mut staging = Staging::default();
            for file in &files {
                staging.add(file, b"whole").unwrap();
            }
            staging
        };
        let dropped = staged();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
        drop(dropped);
        // The last cannot be renamed: a folder came in its way.
        let staging = staged();
        fs::create_dir_all(last.join("full")).unwrap();
        assert!(staging.publish().is_err());
        assert_eq!(fs::read(&old).unwrap(), b"what was there");
        assert!(!new.exists());
        fs::remove_dir_all(&last).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        staged().publish().unwrap();
        assert_eq!(fs::read(&old).unwrap(), b"whole");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[test]
    fn a_folder_appears_with_all_its_files() {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("results");
        let folder = OutputFolder::check(&path).unwrap();
        assert!(!path.exists());
        folder.write(&[("a", b"1"), ("b", b"2")]).unwrap();
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 1);
        fs::write(path.join("other"), "stays").unwrap();
        let again = OutputFolder::check(&path).unwrap();
        again.write(&[("a", b"3")]).unwrap();
        let read = |name: &str| fs::read(path.join(name)).unwrap();
        assert_eq!(
            [read("a"), read("b"), read("other")],
            [&b"3"[..], b"2", b"stays"]
        );
        assert_eq!(fs::read_dir(&path).unwrap().count(), 3);
    }

    #[test]
    fn a_folder_that_fails_is_not_there() {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("results");
        let folder = OutputFolder::check(&path).unwrap();
        assert!(folder.write(&[("a", b"1"), ("no/such/b", b"2")]).is_err());
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 0);
        fs::write(&path, "a file").unwrap();
        assert!(OutputFolder::check(&path).is_err());
        assert!(OutputFolder::check(&path.join("below")).is_err());
    }

    #[test]
    fn a_folder_or_a_missing_folder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(OutputFile::check(folder.path()).is_err());
        assert!(OutputFile::check(&folder.path().join("missing").join("a.txt")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_device_stays_a_device() {
        let null = Path::new("/dev/null");
        OutputFile::check(null).unwrap().write(b"gone").unwrap();
        assert!(!fs::metadata(null).unwrap().is_file());
    }
}
