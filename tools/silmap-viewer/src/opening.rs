//! Something that is being opened: how, and what all kinds of files have in common.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Context;
use silmap_map::asset;
use silmap_mesh_io::Loaded;
use silmap_preprocess::pipeline::{self, BuildParams, Photographed};

use crate::loader::{News, Teller, watched};
use crate::making::{Maker, Ready, Shape};
use crate::scene::Scene;
use crate::start::Opened;

/// How something is opened.
pub(crate) struct Opening {
    pub(crate) opened: Opened,
    /// What makes it ready to be drawn, and the shape that it is to have.
    pub(crate) maker: Maker,
    pub(crate) shape: Shape,
    /// What is shown: an asset and its mesh belong together, whichever is opened first.
    pub(crate) shown: Scene,
}

/// Something that is being opened.
pub(crate) struct Work<'a> {
    pub(crate) opening: &'a Opening,
    pub(crate) teller: &'a Teller,
    pub(crate) stop: &'a AtomicBool,
}

impl Work<'_> {
    /// Makes a scene ready to be drawn; `None` when it was stopped.
    pub(crate) fn ready(&self, scene: Scene) -> anyhow::Result<Option<Ready>> {
        let (maker, shape) = (&self.opening.maker, self.opening.shape);
        let made = watched(self.teller, self.stop, |watch| {
            maker.make(scene, (shape, None), watch)
        });
        made.map_err(anyhow::Error::msg)
    }

    /// A scene that knows where it is from.
    pub(crate) fn named(&self, scene: Scene) -> Scene {
        let opened = &self.opening.opened;
        let whole = std::path::absolute(&opened.path).unwrap_or_else(|_| opened.path.clone());
        Scene {
            source: whole.display().to_string(),
            opened: Some(opened.clone()),
            ..scene
        }
    }

    /// Shows what there is already, if it can be shown.
    pub(crate) fn preview(&self, scene: &Scene) {
        let preview = self.ready(scene.clone());
        if let Ok(Some(ready)) = preview {
            self.teller.tell(News::Preview(Box::new(ready)));
        }
    }

    /// Says what goes on.
    pub(crate) fn say(&self, what: impl Into<String>) {
        self.teller.tell(News::Progress(what.into(), None));
    }

    /// A scene with the asset that is built of a mesh; `None` when it was stopped.
    pub(crate) fn built(
        &self,
        mut scene: Scene,
        (loaded, seen): (&Loaded, &Photographed),
        params: &BuildParams,
    ) -> anyhow::Result<Option<Scene>> {
        let (mesh, name) = (&loaded.mesh, &loaded.name);
        let built = watched(self.teller, self.stop, |watch| {
            pipeline::build_photographed(mesh, seen, name, params, watch)
        });
        match built {
            Ok((asset, report)) => {
                scene
                    .warnings
                    .extend(report.warnings.iter().map(ToString::to_string));
                scene.bytes = asset::write(&asset).map_or(0, |bytes| bytes.len() as u64);
                scene.asset = Some(Arc::new(asset));
                Ok(Some(scene))
            }
            Err(_) if self.is_stopped() => Ok(None),
            Err(error) => {
                let path = &self.opening.opened.path;
                Err(error).with_context(|| path.display().to_string())
            }
        }
    }

    /// Whether it shall stop.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(std::sync::atomic::Ordering::Relaxed)
    }
}

/// What people call a file.
pub(crate) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
