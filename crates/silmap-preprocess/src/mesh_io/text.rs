//! Lines and numbers of text files.

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
