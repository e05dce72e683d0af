//! Files on this machine: an asset is read, a mesh is shown and then built to an asset, on a thread of its own.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{Context, bail};
use silmap_geometry::{Stage, StageEvent, Watch};
use silmap_map::{AssetError, asset};
use silmap_mesh_io::{self as mesh_io, LoadOptions, input};
use silmap_preprocess::pipeline::{self, BuildParams, model_crc32};

use crate::loader::{Loading, News, Teller};
use crate::scene::Scene;

/// What is opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Opened {
    /// The asset, or a mesh.
    pub path: PathBuf,
    /// The full mesh of an asset, to compare with.
    pub model: Option<PathBuf>,
}

/// Begins to load.
pub(crate) fn open(context: &egui::Context, opened: Opened) -> Loading {
    let name = opened.path.display().to_string();
    Loading::begin(context, &name, |teller, stop| {
        let started = std::thread::Builder::new()
            .name("loading".to_owned())
            .spawn({
                let teller = teller.clone();
                move || run(&opened, &teller, &stop)
            });
        if let Err(error) = started {
            teller.tell(News::Failed(format!("no thread can be started: {error}")));
        }
    })
}

fn run(opened: &Opened, teller: &Teller, stop: &AtomicBool) {
    let loaded = load(opened, teller, stop);
    teller.tell(match loaded {
        Ok(Some(scene)) => News::Done(Box::new(scene)),
        Ok(None) => News::Stopped,
        Err(error) => News::Failed(format!("{error:#}")),
    });
}

/// Loads all; `None` when it was stopped.
fn load(opened: &Opened, teller: &Teller, stop: &AtomicBool) -> anyhow::Result<Option<Scene>> {
    let path = opened.path.as_path();
    let named = || path.display().to_string();
    if path.is_dir() {
        bail!(
            "{}: it is a folder; a capture is built with `silmap build {} -o OUT.glb`, and the asset shown then",
            named(),
            named()
        );
    }
    let bytes = input::read(path).with_context(named)?;
    let read = asset::read_with(&bytes, &input::beside(path));
    // Anything else is an asset, with something wrong.
    let is_no_asset = |error: &AssetError| {
        matches!(
            error,
            AssetError::NotGlb { .. } | AssetError::NoSilhouetteMap { .. }
        )
    };
    if read.as_ref().is_err_and(is_no_asset) {
        return build(path, &bytes, teller, stop);
    }
    let read = read.with_context(named)?;
    let mut scene = Scene::of_asset(&file_name(path), bytes.len() as u64, read);
    drop(bytes);
    if let Some(model) = &opened.model {
        add_model(&mut scene, model, teller)?;
    }
    Ok(Some(scene))
}

/// Reads the full mesh of an asset.
fn add_model(scene: &mut Scene, path: &Path, teller: &Teller) -> anyhow::Result<()> {
    let Some(asset) = scene.asset.clone() else {
        return Ok(());
    };
    teller.tell(News::Preview(Box::new(scene.clone())));
    teller.tell(News::Progress(format!("reading {}", file_name(path)), None));
    let loaded = mesh_io::load(path, &LoadOptions::default())?;
    let mesh = loaded.mesh.about(asset.placement.in_model);
    if model_crc32(mesh.mesh()) != asset.record.model_crc32 {
        scene.warnings.push(format!(
            "{}: this is not the mesh that the asset was made from ({})",
            path.display(),
            asset.record.name
        ));
    }
    scene.model = Some(Arc::new(mesh.mesh().clone()));
    Ok(())
}

/// Shows a mesh, and builds its asset.
fn build(
    path: &Path,
    bytes: &[u8],
    teller: &Teller,
    stop: &AtomicBool,
) -> anyhow::Result<Option<Scene>> {
    let loaded = mesh_io::load_bytes(path, bytes, &LoadOptions::default())?;
    let mut scene = Scene {
        name: file_name(path),
        bytes: bytes.len() as u64,
        asset: None,
        model: Some(Arc::new(loaded.mesh.mesh().clone())),
        origin: loaded.mesh.origin(),
        warnings: loaded.warnings.iter().map(ToString::to_string).collect(),
    };
    teller.tell(News::Preview(Box::new(scene.clone())));
    let stages = Mutex::new(BTreeMap::<Stage, (u64, u64)>::new());
    let listen = |event| {
        let mut stages = stages.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            StageEvent::Started { stage, total } => {
                stages.insert(stage, (0, total));
            }
            StageEvent::Advanced { stage, count } => {
                if let Some((done, total)) = stages.get_mut(&stage) {
                    let before = *done * 100 / (*total).max(1);
                    *done += count;
                    if *done * 100 / (*total).max(1) == before {
                        return;
                    }
                }
            }
            StageEvent::Finished { stage } => {
                stages.remove(&stage);
            }
        }
        if let Some((stage, &(done, total))) = stages.iter().next() {
            let share = (total > 0).then(|| (done as f32 / total as f32).min(1.0));
            teller.tell(News::Progress(stage.to_string(), share));
        }
    };
    let watch = Watch::new(&listen, stop);
    match pipeline::build(&loaded.mesh, &loaded.name, &BuildParams::default(), &watch) {
        Ok((asset, report)) => {
            scene
                .warnings
                .extend(report.warnings.iter().map(ToString::to_string));
            scene.bytes = asset::write(&asset).map_or(0, |bytes| bytes.len() as u64);
            scene.asset = Some(Arc::new(asset));
            Ok(Some(scene))
        }
        Err(_) if watch.check().is_err() => Ok(None),
        Err(error) => Err(error).with_context(|| path.display().to_string()),
    }
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
