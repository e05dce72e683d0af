//! Names of numbered files: `frames/%04d.png`.

use std::path::{Path, PathBuf};

use anyhow::bail;

/// The most digits that a pattern asks for.
const MOST_DIGITS: usize = 9;

/// Where a number goes in a file's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FrameNames {
    folder: PathBuf,
    before: String,
    /// Digits at least, zeros in front.
    digits: usize,
    after: String,
}

/// What a file's name says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Naming {
    /// One file for each frame.
    Numbered(FrameNames),
    /// One file.
    Single(PathBuf),
}

impl Naming {
    /// Reads a name in which `%d`, or `%04d` with any number of digits, is a number, and `%%` a percent sign. Folders have none.
    ///
    /// # Errors
    /// One sentence with the name, for any other percent sign and a second number.
    pub(crate) fn of(path: &Path) -> anyhow::Result<Self> {
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
            return Ok(Self::Single(path.to_path_buf()));
        };
        let mut number: Option<(String, usize)> = None;
        let mut text = String::new();
        let mut rest = name;
        while let Some((plain, directive)) = rest.split_once('%') {
            text += plain;
            if let Some(after) = directive.strip_prefix('%') {
                text.push('%');
                rest = after;
                continue;
            }
            let Some((digits, after)) = number_of(directive) else {
                bail!(
                    "{}: a percent sign in the name begins a frame's number, %d or %04d; %% is a percent sign itself",
                    path.display()
                );
            };
            if number.is_some() {
                bail!("{}: the name has two numbers of frames", path.display());
            }
            number = Some((std::mem::take(&mut text), digits));
            rest = after;
        }
        text += rest;
        Ok(match number {
            Some((before, digits)) => Self::Numbered(FrameNames {
                folder: path.parent().map(Path::to_path_buf).unwrap_or_default(),
                before,
                digits,
                after: text,
            }),
            None => Self::Single(path.with_file_name(text)),
        })
    }
}

/// The digits that what follows a percent sign asks for, and what follows that.
fn number_of(directive: &str) -> Option<(usize, &str)> {
    let (width, after) = directive.split_once('d')?;
    if width.is_empty() {
        return Some((1, after));
    }
    let digits = width.strip_prefix('0')?;
    let is_number = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    let digits = digits.parse().ok().filter(|_| is_number)?;
    (1..=MOST_DIGITS)
        .contains(&digits)
        .then_some((digits, after))
}

impl FrameNames {
    /// The file of a frame.
    pub(crate) fn path(&self, frame: u32) -> PathBuf {
        let Self { digits, .. } = *self;
        let name = format!("{}{frame:0digits$}{}", self.before, self.after);
        self.folder.join(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(pattern: &str, frame: u32) -> String {
        match Naming::of(Path::new(pattern)).unwrap() {
            Naming::Numbered(names) => names.path(frame).display().to_string(),
            Naming::Single(path) => panic!("{} has no number", path.display()),
        }
    }

    #[test]
    fn numbers_stand_where_the_pattern_says() {
        assert_eq!(path("frames/%04d.png", 7), "frames/0007.png");
        assert_eq!(path("%d", 12), "12");
        assert_eq!(path("50%% of %02d.webp", 123), "50% of 123.webp");
        assert_eq!(
            path("a%b/é%012d.png".replace("12", "9").as_str(), 1),
            "a%b/é000000001.png"
        );
        assert_eq!(
            Naming::of(Path::new("x/100%%.webp")).unwrap(),
            Naming::Single("x/100%.webp".into())
        );
        assert_eq!(
            Naming::of(Path::new("%04d/turn.webp")).unwrap(),
            Naming::Single("%04d/turn.webp".into())
        );
    }

    #[test]
    fn other_percent_signs_are_refused() {
        for name in [
            "%.png",
            "100%.webp",
            "%4d.png",
            "%04x.png",
            "%0d.png",
            "%+04d.png",
            "%00d.png",
            "%010d.png",
            "%d-%d.png",
            "%04",
        ] {
            let refused = Naming::of(Path::new(name)).unwrap_err().to_string();
            assert!(refused.starts_with(name), "{refused}");
        }
    }
}
