//! Where results go: files that appear whole or not at all, one JSON object on standard output, messages on standard error.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde::Serialize;

use crate::interrupt;

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

    /// Puts the bytes there, whole.
    ///
    /// # Errors
    /// When the disk is full or the folder has gone; whatever was at the path stays as it was. When the user asked to stop.
    pub(crate) fn write(&self, bytes: &[u8]) -> anyhow::Result<()> {
        self.write_with(|file| file.write_all(bytes))
    }

    fn write_with(
        &self,
        fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
    ) -> anyhow::Result<()> {
        interrupt::check()?;
        let cannot = || format!("{}: it cannot be written", self.path.display());
        if self.kind == Target::Special {
            let mut device = fs::OpenOptions::new()
                .write(true)
                .open(&self.path)
                .with_context(cannot)?;
            return fill(&mut device).with_context(cannot);
        }
        let mut temporary = self.temporary()?;
        fill(temporary.as_file_mut()).with_context(cannot)?;
        temporary.as_file().sync_all().with_context(cannot)?;
        interrupt::check()?;
        temporary.persist(&self.path).with_context(cannot)?;
        Ok(())
    }

    /// An empty file beside the final one, removed when it is dropped.
    fn temporary(&self) -> anyhow::Result<tempfile::NamedTempFile> {
        let folder = match self.path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
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

    /// Puts files there, all of them or none: a new folder appears with all of them, and in one that was there each replaces its
    /// namesake after all have been written.
    ///
    /// # Errors
    /// When the disk is full or a folder has gone, or the user asked to stop.
    pub(crate) fn write(&self, files: &[(&str, &[u8])]) -> anyhow::Result<()> {
        interrupt::check()?;
        let cannot = || format!("{}: it cannot be written", self.path.display());
        let is_there = self.path.is_dir();
        let around = match self.path.parent() {
            _ if is_there => &self.path,
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
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
        for (name, _) in files {
            fs::rename(folder.join(name), self.path.join(name)).with_context(cannot)?;
        }
        Ok(())
    }
}

/// Makes a folder if it is not there and checks that files can be written into it.
///
/// # Errors
/// One sentence when that fails.
pub(crate) fn prepare_folder(folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder)
        .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    OutputFile::check(&folder.join("report.html")).map(drop)
}

/// Prints one JSON object and a line end on standard output.
///
/// # Errors
/// When standard output cannot be written to; a closed one is nobody listening, which is fine.
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
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output cannot be written to"),
    }
}

/// One line on standard error. A closed one is nobody listening.
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
    fn a_failed_write_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let file = OutputFile::check(&path).unwrap();
        let failed = file.write_with(|out| {
            out.write_all(b"new, but not")?;
            Err(std::io::Error::other("the disk is full"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
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
