//! Lines and numbers of text files, and the files they name.

use std::path::{Path, PathBuf};

use super::error::MeshFault;

/// The text of a file: UTF-8, with stray bytes of older encodings (in comments and names) tolerated.
pub(super) fn decode(bytes: &[u8]) -> Result<String, MeshFault> {
    if bytes.is_empty() {
        return Err(MeshFault::Empty);
    }
    let has_wide_mark = bytes.starts_with(&[0xFE, 0xFF]) || bytes.starts_with(&[0xFF, 0xFE]);
    if has_wide_mark || bytes.contains(&0) {
        return Err(MeshFault::NotText);
    }
    let text = String::from_utf8_lossy(bytes);
    Ok(text.strip_prefix('\u{FEFF}').unwrap_or(&text).to_owned())
}

/// A message of a library in one line: some are broken over several.
pub(super) fn in_one_line(message: impl std::fmt::Display) -> String {
    let text = message.to_string();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Lines with their numbers, from 1. Lines end in LF, CR LF, or, where the file has no LF, in CR.
pub(super) fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    text.split(end)
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()))
}

/// The first three numbers of a line, if they are there.
pub(super) fn three_numbers<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<[f64; 3]> {
    let mut next = || words.next()?.parse().ok();
    Some([next()?, next()?, next()?])
}

/// The file that `name` means, as seen from `folder`: that name, or, since names were often written on another machine, its
/// last part in the folder itself, in whatever mixture of large and small letters. `None` when there is no such file.
pub(super) fn find_file(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.trim().replace('\\', "/");
    if name.is_empty() || name.contains('\0') {
        return None;
    }
    let is_there = |path: &PathBuf| path.is_file();
    let told = Some(folder.join(&name)).filter(is_there);
    let last = name.rsplit('/').next().filter(|last| !last.is_empty())?;
    told.or_else(|| Some(folder.join(last)).filter(is_there))
        .or_else(|| {
            let here = if folder.as_os_str().is_empty() {
                Path::new(".")
            } else {
                folder
            };
            // The first of them in the order of the alphabet.
            std::fs::read_dir(here)
                .ok()?
                .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
                .filter(|known| known.eq_ignore_ascii_case(last))
                .min()
                .map(|known| folder.join(known))
                .filter(is_there)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_message_becomes_one_line() {
        let message = "declared 9 corrections, more than the \n            7 bytes left";
        assert_eq!(
            in_one_line(message),
            "declared 9 corrections, more than the 7 bytes left"
        );
    }
}
