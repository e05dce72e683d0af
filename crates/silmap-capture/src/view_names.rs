//! Names of views that come from paths: short where they are different, and as long as they must be where they are not.

use std::collections::HashMap;
use std::path::Path;

use crate::pictures::is_picture;

/// The name of each path's view: the file's without a picture's extension, or with folders and extension where those alone are different.
/// Paths that are there twice are numbered.
pub(crate) fn view_names<'a>(paths: impl Iterator<Item = &'a str> + Clone) -> Vec<String> {
    let without = |path: &str| match Path::new(path) {
        picture if is_picture(picture) => picture.with_extension("").to_string_lossy().into_owned(),
        _ => path.to_owned(),
    };
    let stem = |path: &str| {
        let path = without(path);
        let name = Path::new(&path).file_name();
        name.map_or_else(|| path.clone(), |s| s.to_string_lossy().into_owned())
    };
    for form in [&stem as &dyn Fn(&str) -> String, &without, &str::to_owned] {
        let names: Vec<String> = paths.clone().map(form).collect();
        if counts(&names).values().all(|&count| count == 1) {
            return names;
        }
    }
    let mut seen: HashMap<&str, usize> = HashMap::new();
    let mut names = Vec::new();
    for path in paths {
        let before = seen.entry(path).or_default();
        *before += 1;
        names.push(match before {
            1 => path.to_owned(),
            count => format!("{path} ({count})"),
        });
    }
    names
}

fn counts(names: &[String]) -> HashMap<&str, usize> {
    let mut counts = HashMap::new();
    for name in names {
        *counts.entry(name.as_str()).or_default() += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_as_short_as_they_can_be() {
        let of = |paths: &[&str]| view_names(paths.iter().copied());
        assert_eq!(of(&["a/1.jpg", "b/2.png"]), ["1", "2"]);
        assert_eq!(of(&["a/1.jpg", "b/1.jpg"]), ["a/1", "b/1"]);
        assert_eq!(of(&["1.jpg", "1.png"]), ["1.jpg", "1.png"]);
        assert_eq!(of(&["1.jpg", "1.jpg"]), ["1.jpg", "1.jpg (2)"]);
        assert_eq!(of(&["a photo.v2.jpg"]), ["a photo.v2"]);
        // What follows a point is an extension only where it is that of a picture.
        assert_eq!(of(&["a/1.v2", "b/1.JpG"]), ["1.v2", "1"]);
        assert_eq!(of(&["1.v2", "1.v2"]), ["1.v2", "1.v2 (2)"]);
    }
}
