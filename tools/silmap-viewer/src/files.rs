//! Files on this machine: an asset is read, a mesh or a capture is shown and then built to an asset, on a thread of its own.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use silmap_geometry::ClosedMesh;
use silmap_map::{Asset, AssetError, asset};
use silmap_mesh_io::{self as mesh_io, LoadOptions, input};
use silmap_preprocess::pipeline::{BuildParams, Photographed, model_crc32};

use crate::captures;
use crate::loader::{Loading, News};
use crate::opening::{Opening, Work, file_name};
use crate::scene::Scene;
use crate::shot::upwards;
use crate::start::Opened;

/// Begins to load.
pub(crate) fn open(context: &egui::Context, opening: Opening) -> Loading {
    let name = opening.opened.path.display().to_string();
    Loading::beside(context, &name, move |teller, stop| {
        let work = Work {
            opening: &opening,
            teller,
            stop,
        };
        run(&work)
    })
}

fn run(work: &Work<'_>) -> News {
    let made = load(work).and_then(|scene| match scene {
        Some(scene) if !work.is_stopped() => work.ready(scene),
        _ => Ok(None),
    });
    match made {
        Ok(Some(ready)) => News::Done(Box::new(ready)),
        Ok(None) => News::Stopped,
        Err(error) => News::Failed(format!("{error:#}")),
    }
}

/// Loads all; `None` when it was stopped.
fn load(work: &Work<'_>) -> anyhow::Result<Option<Scene>> {
    let path = work.opening.opened.path.as_path();
    if silmap_capture::is_capture(path) {
        return captures::build(path, work);
    }
    let named = || path.display().to_string();
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
        return mesh(work, path, &bytes);
    }
    let read = read.with_context(named)?;
    let mut scene = work.named(Scene::of_asset(&file_name(path), bytes.len() as u64, read));
    drop(bytes);
    add_beside(work, &mut scene)?;
    Ok(Some(scene))
}

/// Reads the mesh and the capture of an asset, or keeps the mesh that is shown, where it is the asset's.
fn add_beside(work: &Work<'_>, scene: &mut Scene) -> anyhow::Result<()> {
    let Some(asset) = scene.asset.clone() else {
        return Ok(());
    };
    let Opened { model, capture, .. } = &work.opening.opened;
    // What is upwards says how the first picture is looked at.
    let cameras = (capture.as_deref()).map(captures::cameras).transpose()?;
    if let Some(list) = &cameras {
        scene.upwards = upwards(list.views.iter().map(|view| &view.camera));
    }
    if model.is_some() || capture.is_some() {
        work.preview(scene);
    }
    if let Some(path) = model {
        work.say(format!("reading {}", file_name(path)));
        let loaded = mesh_io::load(path, &LoadOptions::default())?;
        let mesh = loaded.mesh.about(asset.placement.in_model);
        if model_crc32(mesh.mesh()) != asset.record.model_crc32 {
            scene.warnings.push(format!(
                "{}: this is not the mesh that the asset was made from ({})",
                path.display(),
                asset.record.name
            ));
        }
        scene.model = Some(Arc::new(mesh));
    } else if let Some(mesh) = &work.opening.shown.model {
        scene.model = of_asset(mesh, &asset);
        let of_mesh = work.opening.shown.opened.as_ref();
        let file = of_mesh.map(|shown| shown.model.as_ref().unwrap_or(&shown.path));
        if let (Some(opened), Some(_), Some(file)) = (&mut scene.opened, &scene.model, file) {
            opened.model = Some(file.clone());
        }
    }
    if let Some(list) = &cameras {
        scene.shots = captures::shots(list, asset.placement.in_model, work);
    }
    Ok(())
}

/// Shows a mesh beside its asset, where that is shown, or builds it.
fn mesh(work: &Work<'_>, path: &Path, bytes: &[u8]) -> anyhow::Result<Option<Scene>> {
    let loaded = mesh_io::load_bytes(path, bytes, &LoadOptions::default())?;
    let shown = &work.opening.shown;
    let its_mesh = (shown.loaded()).and_then(|asset| of_asset(&loaded.mesh, asset));
    if let Some(mesh) = its_mesh {
        let mut scene = shown.clone();
        scene.asset = shown.loaded().cloned();
        (scene.whole, scene.model) = (None, Some(mesh));
        if let Some(opened) = &mut scene.opened {
            opened.model = Some(path.to_owned());
        }
        scene.warnings = vec![format!(
            "{}: {} was made from it, and is compared with it now",
            path.display(),
            scene.name
        )];
        return Ok(Some(scene));
    }
    let scene = work.named(Scene {
        name: file_name(path),
        bytes: bytes.len() as u64,
        model: Some(Arc::new(loaded.mesh.clone())),
        origin: loaded.mesh.origin(),
        warnings: loaded.warnings.iter().map(ToString::to_string).collect(),
        ..Scene::default()
    });
    work.preview(&scene);
    let params = BuildParams::default();
    work.built(scene, (&loaded, &Photographed::default()), &params)
}

/// A mesh in the coordinates of an asset, if that was made from it.
fn of_asset(mesh: &ClosedMesh, asset: &Asset) -> Option<Arc<ClosedMesh>> {
    if mesh.mesh().faces.len() as u64 != asset.record.model_faces {
        return None;
    }
    let mesh = mesh.clone().about(asset.placement.in_model);
    (model_crc32(mesh.mesh()) == asset.record.model_crc32).then(|| Arc::new(mesh))
}
