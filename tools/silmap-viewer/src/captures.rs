//! Captures: carved, coloured and built to an asset as `silmap build` does, and their photographs to look at.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use glam::DVec3;
use silmap_capture::{
    CameraList, CarveParams, Coloured, MaskOptions, carve, coloured, fitting_resolution_px,
    read_cameras, read_with, silhouettes_with_room,
};
use silmap_mesh_io::Loaded;
use silmap_preprocess::pipeline::{BuildParams, Photographed};

use crate::loader::{News, watched};
use crate::opening::{Work, file_name};
use crate::scene::Scene;
use crate::shot::{Shot, ShotSource, upwards};

/// Shows the carved hull of a capture, then its photographs' colours, and builds its asset; `None` when it was stopped.
pub(crate) fn build(path: &Path, work: &Work<'_>) -> anyhow::Result<Option<Scene>> {
    let built = build_unless_stopped(path, work);
    // Whatever did not end well has ended.
    if work.is_stopped() { Ok(None) } else { built }
}

fn build_unless_stopped(path: &Path, work: &Work<'_>) -> anyhow::Result<Option<Scene>> {
    work.say("reading cameras and masks");
    let capture = Arc::new(read_with(path, &MaskOptions::default())?);
    let named = || capture.path.display().to_string();
    let mut odd = capture.warnings.clone();
    let mut carved = watched(work.teller, work.stop, |watch| {
        carve(&capture, &CarveParams::default(), watch)
    })
    .with_context(named)?;
    odd.append(&mut carved.warnings);
    let mut scene = work.named(Scene {
        name: file_name(path),
        model: Some(Arc::new(carved.mesh.clone())),
        origin: carved.mesh.origin(),
        upwards: upwards(capture.views.iter().map(|view| &view.camera)),
        ..Scene::default()
    });
    work.preview(&scene);

    let sources = (0..capture.views.len()).map(|view| ShotSource::View(Arc::clone(&capture), view));
    scene.shots = read_shots(sources, scene.origin, work);
    let params = BuildParams {
        resolution_px: fitting_resolution_px(&capture),
        ..BuildParams::default()
    };
    let mesh = carved.mesh.clone();
    let Coloured {
        mesh, photographs, ..
    } = watched(work.teller, work.stop, |watch| {
        coloured(&capture, mesh, params.textures.size_px, &mut odd, watch)
    })?;
    carved.mesh = mesh;
    scene.model = Some(Arc::new(carved.mesh.clone()));
    work.preview(&scene);

    let (silhouettes, wider) = watched(work.teller, work.stop, |watch| {
        silhouettes_with_room(&capture, &carved, watch)
    })
    .with_context(named)?;
    let seen = Photographed {
        silhouettes,
        photographs: photographs.into_iter().map(|p| p.photograph).collect(),
        wider: Some(wider),
    };
    scene.warnings = odd.iter().map(ToString::to_string).collect();
    let loaded = Loaded {
        mesh: carved.mesh,
        name: capture.name.clone(),
        warnings: Vec::new(),
    };
    let built = work.built(scene, (&loaded, &seen), &params)?;
    Ok(built.map(|scene| Scene {
        photographed: Some(Arc::new(seen)),
        ..scene
    }))
}

/// The cameras of a capture.
pub(crate) fn cameras(path: &Path) -> anyhow::Result<Arc<CameraList>> {
    Ok(Arc::new(read_cameras(path)?))
}

/// The photographs of cameras, about the origin of the asset that was built of them.
pub(crate) fn shots(list: &Arc<CameraList>, origin: DVec3, work: &Work<'_>) -> Arc<[Shot]> {
    let sources = (0..list.views.len()).map(|view| ShotSource::Camera(Arc::clone(list), view));
    read_shots(sources, origin, work)
}

fn read_shots(
    sources: impl Iterator<Item = ShotSource>,
    origin: DVec3,
    work: &Work<'_>,
) -> Arc<[Shot]> {
    let tell = |share| {
        let doing = "reading photographs".to_owned();
        work.teller.tell(News::Progress(doing, Some(share)));
    };
    Shot::all(sources, origin, (&tell, work.stop))
}
