//! A file that is written piece by piece beside its place.

use std::io::{self, BufWriter, Cursor, Seek, SeekFrom, Write};
use std::path::PathBuf;

use anyhow::Context;
use tempfile::NamedTempFile;

use super::{OutputFile, Staging, Target, cannot_write};
use crate::interrupt;

/// A file that is not whole yet: [`Staging::keep`] takes it when it is, and dropping it leaves nothing.
#[derive(Debug)]
pub(crate) struct StagedFile {
    path: PathBuf,
    pieces: Pieces,
}

#[derive(Debug)]
enum Pieces {
    Regular(BufWriter<NamedTempFile>),
    /// Devices and pipes get everything at the end.
    Special(Cursor<Vec<u8>>),
}

impl OutputFile {
    /// Begins to write it.
    ///
    /// # Errors
    /// When the folder has gone or cannot be written to.
    pub(crate) fn begin(&self) -> anyhow::Result<StagedFile> {
        let pieces = match self.kind {
            Target::Regular => Pieces::Regular(BufWriter::new(self.temporary()?)),
            Target::Special => Pieces::Special(Cursor::default()),
        };
        Ok(StagedFile {
            path: self.path.clone(),
            pieces,
        })
    }
}

impl Staging {
    /// Takes a file that is whole now; returns how many bytes it has.
    ///
    /// # Errors
    /// When the disk is full, or the user asked to stop.
    pub(crate) fn keep(&mut self, file: StagedFile) -> anyhow::Result<u64> {
        interrupt::check()?;
        let StagedFile { path, pieces } = file;
        let cannot = || cannot_write(&path);
        match pieces {
            Pieces::Regular(buffered) => {
                let written = buffered
                    .into_inner()
                    .map_err(io::IntoInnerError::into_error);
                let temporary = written.with_context(cannot)?;
                temporary.as_file().sync_all().with_context(cannot)?;
                let bytes = temporary.as_file().metadata().with_context(cannot)?.len();
                self.regular.push((temporary.into_temp_path(), path));
                Ok(bytes)
            }
            Pieces::Special(bytes) => {
                let bytes = bytes.into_inner();
                let count = bytes.len() as u64;
                self.special.push((path, bytes));
                Ok(count)
            }
        }
    }
}

impl Write for StagedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.pieces {
            Pieces::Regular(file) => file.write(bytes),
            Pieces::Special(held) => held.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.pieces {
            Pieces::Regular(file) => file.flush(),
            Pieces::Special(held) => held.flush(),
        }
    }
}

impl Seek for StagedFile {
    fn seek(&mut self, place: SeekFrom) -> io::Result<u64> {
        match &mut self.pieces {
            Pieces::Regular(file) => file.seek(place),
            Pieces::Special(held) => held.seek(place),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn pieces_appear_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        let file = OutputFile::check(&path).unwrap();
        let mut dropped = file.begin().unwrap();
        dropped.write_all(b"lost").unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        drop(dropped);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);

        let mut whole = file.begin().unwrap();
        whole.write_all(b"????, and more").unwrap();
        whole.seek(SeekFrom::Start(0)).unwrap();
        whole.write_all(b"once").unwrap();
        let mut staging = Staging::default();
        assert_eq!(staging.keep(whole).unwrap(), 14);
        assert!(!path.exists());
        staging.publish().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"once, and more");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
