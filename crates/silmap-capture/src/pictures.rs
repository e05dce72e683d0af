//! Photographs that a camera file does not name, or names in part.

use std::cmp::Ordering;
use std::fs;
use std::path::{Path, PathBuf};

/// Folders that photographs are looked for in; the first is the capture's own.
const FOLDERS: [&str; 6] = ["", "images", "photos", "visualize", "image", "imgs"];

/// Extensions of photographs.
pub(crate) const EXTENSIONS: [&str; 8] =
    ["jpg", "png", "jpeg", "webp", "JPG", "PNG", "JPEG", "WEBP"];

/// The photograph of a name with or without its extension; `None` where there is none.
pub(crate) fn find(folder: &Path, name: &str) -> Option<PathBuf> {
    let places = || FOLDERS.iter().map(|place| folder.join(place));
    let mut whole = places()
        .map(|place| place.join(name))
        .filter(|_| is_picture(Path::new(name)));
    if let Some(found) = whole.find(|path| path.is_file()) {
        return Some(found);
    }
    let mut extended = places()
        .flat_map(|place| EXTENSIONS.map(|extension| place.join(format!("{name}.{extension}"))));
    extended.find(|path| path.is_file())
}

/// All photographs of the first folder that has so many, in the order of the numbers in their names.
pub(crate) fn in_order(folder: &Path, count: usize) -> Option<Vec<PathBuf>> {
    FOLDERS.iter().find_map(|place| {
        let mut found = files(&folder.join(place), is_picture);
        found.sort_by(|a, b| by_numbers(&file_name(a), &file_name(b)));
        (found.len() == count).then_some(found)
    })
}

pub(crate) fn is_picture(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|e| EXTENSIONS.iter().any(|known| e.eq_ignore_ascii_case(known)))
}

/// Files of a folder; none of one that cannot be read. Sorted, as the order in a folder is the file system's own.
pub(crate) fn files(folder: &Path, is_wanted: impl Fn(&Path) -> bool) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    let mut found: Vec<PathBuf> = paths.filter(|p| is_wanted(p) && p.is_file()).collect();
    found.sort();
    found
}

/// The folder that a file is in.
pub(crate) fn folder_of(file: &Path) -> PathBuf {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

pub(crate) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Order of names in which `a2` comes before `a10`.
pub(crate) fn by_numbers(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let split = |text: &'_ str| {
            let is_digit = text.starts_with(|c: char| c.is_ascii_digit());
            let end = text.find(|c: char| c.is_ascii_digit() != is_digit);
            (is_digit, end.unwrap_or(text.len()))
        };
        if a.is_empty() || b.is_empty() {
            return a.len().cmp(&b.len());
        }
        let ((a_digit, a_end), (b_digit, b_end)) = (split(a), split(b));
        let (x, y) = (&a[..a_end], &b[..b_end]);
        let order = match a_digit && b_digit {
            true => {
                let (m, n) = (x.trim_start_matches('0'), y.trim_start_matches('0'));
                let by_size = m.len().cmp(&n.len()).then_with(|| m.cmp(n));
                by_size.then_with(|| x.len().cmp(&y.len()))
            }
            false => x.cmp(y),
        };
        if order != Ordering::Equal {
            return order;
        }
        (a, b) = (&a[a_end..], &b[b_end..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = ["a10", "a2", "b1", "a02", "a", "a2b", "10", "9"];
        names.sort_by(|a, b| by_numbers(a, b));
        assert_eq!(names, ["9", "10", "a", "a2", "a2b", "a02", "a10", "b1"]);
    }
}
