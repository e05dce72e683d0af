//! How the window was left, and what was open in it: kept from one time to the next.

use crate::look::Look;
use crate::scene::Scene;
use crate::start::{Opened, Start};

/// The key under which it is kept how the window was left, and those of what was open.
const LEFT_AS: &str = "silmap-view";
#[cfg(not(target_arch = "wasm32"))]
const LEFT_OPEN: [&str; 3] = ["silmap-file", "silmap-model", "silmap-capture"];

/// How it is looked at, and what is opened: as it was left, where nothing else is asked for.
pub(crate) fn as_it_was(storage: &dyn eframe::Storage, start: &Start) -> (Look, Option<Opened>) {
    let asked = || (start.look, start.file.clone());
    if start.is_given {
        return asked();
    }
    let Some(link) = storage.get_string(LEFT_AS) else {
        return asked();
    };
    // A link of another version that is not understood is as good as none.
    let mut look = Look::read_link(&link).unwrap_or_default();
    #[cfg(not(target_arch = "wasm32"))]
    let left_open = left_open(storage);
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
fn left_open(storage: &dyn eframe::Storage) -> Option<Opened> {
    let [path, model, capture] = LEFT_OPEN.map(|key| {
        let name = storage.get_string(key).filter(|name| !name.is_empty())?;
        let path = std::path::PathBuf::from(name);
        path.exists().then_some(path)
    });
    Some(Opened {
        path: path?,
        model,
        capture,
    })
}

/// Keeps how it is looked at, as a link, and what is open.
pub(crate) fn remember(storage: &mut dyn eframe::Storage, link: &str, shown: &Scene) {
    storage.set_string(LEFT_AS, link.to_owned());
    #[cfg(target_arch = "wasm32")]
    let _ = shown;
    #[cfg(not(target_arch = "wasm32"))]
    {
        let paths = match &shown.opened {
            Some(opened) => [
                Some(&opened.path),
                opened.model.as_ref(),
                opened.capture.as_ref(),
            ],
            None => [None; 3],
        };
        for (key, path) in LEFT_OPEN.into_iter().zip(paths) {
            let whole = path.and_then(|path| std::path::absolute(path).ok());
            let name = whole.as_ref().and_then(|path| path.to_str());
            storage.set_string(key, name.unwrap_or_default().to_owned());
        }
    }
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
    use std::collections::BTreeMap;

    use super::*;

    #[derive(Default)]
    struct Kept(BTreeMap<String, String>);

    impl eframe::Storage for Kept {
        fn get_string(&self, key: &str) -> Option<String> {
            self.0.get(key).cloned()
        }

        fn set_string(&mut self, key: &str, value: String) {
            self.0.insert(key.to_owned(), value);
        }

        fn remove_string(&mut self, key: &str) {
            self.0.remove(key);
        }

        fn flush(&mut self) {}
    }

    #[test]
    fn it_opens_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        std::fs::write(&path, "").unwrap();
        let mut kept = Kept::default();
        let start = |file: Option<&std::path::Path>| Start {
            file: file.map(|path| Opened {
                path: path.to_owned(),
                ..Opened::default()
            }),
            ..Start::default()
        };
        let nothing = as_it_was(&kept, &start(None));
        assert_eq!(nothing, (Look::default(), None));
        let link = "eye=1,2,3&mode=coarse&keep=9";
        let shown = Scene {
            opened: start(Some(&path)).file,
            ..Scene::default()
        };
        remember(&mut kept, link, &shown);
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
