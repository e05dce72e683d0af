//! How the window was left, and what was open in it: kept from one time to the next.

use crate::look::Look;
use crate::scene::Scene;
use crate::start::{Opened, Start};

/// The key under which it is kept how the window was left, and those of what was open.
const LEFT_AS: &str = "silmap-view";
#[cfg(not(target_arch = "wasm32"))]
const LEFT_OPEN: [&str; 3] = ["silmap-file", "silmap-model", "silmap-capture"];

/// What was kept under a key.
type Kept<'a> = &'a dyn Fn(&str) -> Option<String>;

/// How it is looked at, and what is opened: as it was left, where nothing else is asked for.
pub(crate) fn as_it_was(kept: Kept<'_>, start: &Start) -> (Look, Option<Opened>) {
    let asked = || (start.look, start.file.clone());
    if start.is_given {
        return asked();
    }
    let Some(link) = kept(LEFT_AS) else {
        return asked();
    };
    // A link of another version that is not understood is as good as none.
    let mut look = Look::read_link(&link).unwrap_or_default();
    #[cfg(not(target_arch = "wasm32"))]
    let left_open = left_open(kept);
    #[cfg(target_arch = "wasm32")]
    let left_open: Option<Opened> = None;
    let is_same = match (&start.file, &left_open) {
        (Some(asked), Some(left)) => is_same(asked, left),
        (asked, left) => asked.is_none() && left.is_some(),
    };
    if !is_same {
        // Where the eye was belongs to what was shown.
        (look.pose, look.keep, look.faces) = (None, None, None);
    }
    (look, start.file.clone().or(left_open))
}

/// What was open, where it is still there.
#[cfg(not(target_arch = "wasm32"))]
fn left_open(kept: Kept<'_>) -> Option<Opened> {
    let [path, model, capture] = LEFT_OPEN.map(|key| {
        let name = kept(key).filter(|name| !name.is_empty())?;
        let path = std::path::PathBuf::from(name);
        path.exists().then_some(path)
    });
    Some(Opened {
        path: path?,
        model,
        capture,
    })
}

/// What to keep of how it is looked at, as a link, and of what is open: keys and values.
pub(crate) fn to_keep(link: String, shown: &Scene) -> Vec<(&'static str, String)> {
    std::iter::once((LEFT_AS, link))
        .chain(open_files(shown))
        .collect()
}

/// The files that are open, by their keys; nothing for those that are not.
#[cfg(not(target_arch = "wasm32"))]
fn open_files(shown: &Scene) -> impl Iterator<Item = (&'static str, String)> {
    let opened = shown.opened.as_ref();
    let paths = [
        opened.map(|opened| &opened.path),
        opened.and_then(|opened| opened.model.as_ref()),
        opened.and_then(|opened| opened.capture.as_ref()),
    ];
    LEFT_OPEN.into_iter().zip(paths).map(|(key, path)| {
        let whole = path.and_then(|path| std::path::absolute(path).ok());
        let name = whole.as_ref().and_then(|path| path.to_str());
        (key, name.unwrap_or_default().to_owned())
    })
}

/// On a page nothing is opened again.
#[cfg(target_arch = "wasm32")]
fn open_files(_: &Scene) -> [(&'static str, String); 0] {
    []
}

/// Whether two name the same file.
fn is_same(a: &Opened, b: &Opened) -> bool {
    #[cfg(target_arch = "wasm32")]
    return a == b;
    #[cfg(not(target_arch = "wasm32"))]
    {
        let whole = |named: &Opened| std::path::absolute(&named.path).ok();
        whole(a) == whole(b)
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;

    #[test]
    fn it_opens_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        std::fs::write(&path, "").unwrap();
        let start = |file: Option<&std::path::Path>| Start {
            file: file.map(|path| Opened {
                path: path.to_owned(),
                ..Opened::default()
            }),
            ..Start::default()
        };
        let nothing = as_it_was(&|_| None, &start(None));
        assert_eq!(nothing, (Look::default(), None));
        let link = "eye=1,2,3&mode=coarse&keep=9";
        let shown = Scene {
            opened: start(Some(&path)).file,
            ..Scene::default()
        };
        let all = to_keep(link.to_owned(), &shown);
        let kept = |key: &str| {
            all.iter()
                .find(|pair| pair.0 == key)
                .map(|pair| pair.1.clone())
        };
        // Without a file the last one, seen as it was; the same one likewise.
        for asked in [None, Some(path.as_path())] {
            let (look, file) = as_it_was(&kept, &start(asked));
            assert_eq!(look.link(), link);
            assert_eq!(file.map(|f| f.path), Some(path.clone()));
        }
        // Another one is framed, in the same mode.
        let (look, file) = as_it_was(&kept, &start(Some(folder.path())));
        assert_eq!(look.link(), "mode=coarse");
        assert_eq!(file.unwrap().path, folder.path());
        // What is asked for wins.
        let asked = Start {
            is_given: true,
            ..start(None)
        };
        assert_eq!(as_it_was(&kept, &asked), (Look::default(), None));
        // What is not there any more is not opened.
        std::fs::remove_file(&path).unwrap();
        let (look, file) = as_it_was(&kept, &start(None));
        assert_eq!((look.link().as_str(), file), ("mode=coarse", None));
    }
}
