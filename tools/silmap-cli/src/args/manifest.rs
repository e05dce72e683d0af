//! Options of `build` for a list of models.

use std::path::PathBuf;

use clap::Args;

use crate::values::{parse_bytes, parse_seconds};

/// A part of a list: every `of`-th model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    pub(crate) index: u64,
    pub(crate) of: u64,
}

impl Shard {
    /// The whole list.
    pub(crate) const ALL: Self = Self { index: 0, of: 1 };

    /// Whether the model at this place belongs to this part; the first has place 1.
    pub(crate) fn holds(self, place: u64) -> bool {
        place % self.of == self.index % self.of
    }
}

/// Over the options of a list in the help.
const LIST: &str = "A list of models";

/// How a list of models is built.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct ManifestArgs {
    /// Build every model of a list, `-` for standard input: a line each, such as {"model": "a.ply", "out": "a.glb", "options":
    /// {"keep": 64}}. Other options hold for all, those of a line go before. One line of JSON on standard output says how each
    /// ended
    #[arg(long, help_heading = LIST, value_name = "LIST.jsonl", conflicts_with_all = ["model", "from", "out"], requires = "out_dir")]
    pub(crate) manifest: Option<PathBuf>,
    /// The folder for the list's assets, and for a record beside each
    #[arg(long, help_heading = LIST, value_name = "DIR", requires = "manifest")]
    pub(crate) out_dir: Option<PathBuf>,
    /// Only every N-th model of the list: those whose place, counted from 1, leaves the same remainder by N as I; 0/N is N/N
    #[arg(long, help_heading = LIST, value_name = "I/N", value_parser = parse_shard, requires = "manifest")]
    pub(crate) shard: Option<Shard>,
    /// Keep assets that are there, if model, options and version are the same, and do not try again what was refused
    #[arg(long, help_heading = LIST, requires = "manifest")]
    pub(crate) resume: bool,
    /// Stop a model after so many seconds
    #[arg(long, help_heading = LIST, value_name = "SECONDS", value_parser = parse_seconds, requires = "manifest")]
    pub(crate) timeout: Option<f64>,
    /// Stop a model that needs more memory, such as 500M or 2G
    #[arg(long, help_heading = LIST, value_name = "BYTES", value_parser = parse_bytes, requires = "manifest")]
    pub(crate) memory: Option<u64>,
    /// The process that reads the list: the build of one model ends with it
    #[arg(long, help_heading = LIST, value_name = "PID", hide = true)]
    pub(crate) reader: Option<i32>,
}

/// Two numbers with a slash between.
fn parse_shard(text: &str) -> Result<Shard, String> {
    text.split_once('/')
        .and_then(|(index, of)| {
            Some(Shard {
                index: index.trim().parse().ok()?,
                of: of.trim().parse().ok()?,
            })
        })
        .filter(|shard| shard.of > 0 && shard.index <= shard.of)
        .ok_or_else(|| {
            "a part of the list is I/N with I from 0 to N, such as 3/8; 0/8 and 8/8 are the same"
                .to_owned()
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_hold_every_model_once_however_they_are_counted() {
        for of in 1..7 {
            for place in 1..50 {
                let holding = |from: u64| {
                    (from..from + of)
                        .filter(|index| parse_shard(&format!("{index}/{of}")).unwrap().holds(place))
                        .count()
                };
                assert_eq!((holding(0), holding(1)), (1, 1));
            }
        }
        assert!((1..9).all(|place| Shard::ALL.holds(place)));
        for bad in ["", "1", "3/2", "1/0", "-1/2", "a/b", "1/2/3"] {
            assert!(parse_shard(bad).is_err(), "{bad}");
        }
    }
}
