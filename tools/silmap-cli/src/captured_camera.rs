//! The camera of a capture that `--camera` and `--view` name.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::error::ErrorKind;
use silmap_capture::{CameraView, Drawing, DrawingFault, read_cameras};
use silmap_geometry::Camera;

use crate::args::{CameraArgs, CapturedCameraArgs, usage_error};
use crate::interrupt;
use crate::output::OutputFile;
use crate::scene::Scene;

/// A view of a capture, and the picture that is drawn for it, in coordinates about a model's origin.
#[derive(Debug)]
pub(crate) struct Captured {
    /// The camera file.
    pub(crate) file: PathBuf,
    pub(crate) view: CameraView,
    pub(crate) drawing: Drawing,
}

impl Captured {
    /// Ends the program, as for options that are wrong together, when the camera file or the photograph would be written over.
    pub(crate) fn refuse_to_be_replaced_by(&self, written: &OutputFile) {
        for input in self.view.photo.iter().chain([&self.file]) {
            written.refuse_to_replace(input);
        }
    }
}

/// The view that is named, and the camera file; `None` where none is.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn named(args: &CapturedCameraArgs) -> anyhow::Result<Option<(PathBuf, CameraView)>> {
    let (path, name) = match (&args.camera, &args.view) {
        (Some(path), Some(name)) => (path, name),
        (None, Some(_)) => without_camera("--view <NAME>"),
        (_, None) => return Ok(None),
    };
    let owned = path.to_owned();
    // The errors name the file.
    let list = interrupt::unless_stopped(move || read_cameras(&owned))??;
    let view = list.named(name)?.clone();
    Ok(Some((list.path, view)))
}

/// The picture of a view, which sees the whole of what is looked at.
///
/// # Errors
/// One sentence with the names of file and view.
pub(crate) fn of_view(
    (file, view): (&Path, &CameraView),
    made: Result<Drawing, DrawingFault>,
    scene: &Scene,
) -> anyhow::Result<Captured> {
    Ok(Captured {
        drawing: drawing((file, &view.name), made, scene)?,
        view: view.clone(),
        file: file.to_owned(),
    })
}

/// A picture of the view of this name in coordinates about the model's origin.
///
/// # Errors
/// One sentence with the names of file and view, also where its eye is so near that it does not see the whole.
pub(crate) fn drawing(
    (file, name): (&Path, &str),
    made: Result<Drawing, DrawingFault>,
    scene: &Scene,
) -> anyhow::Result<Drawing> {
    let place = || format!("{}: view {name}", file.display());
    let drawing = made.with_context(place)?.moved(-scene.origin_in_model);
    let (center, radius) = scene.sphere;
    // Refuses an eye in the sphere, from which no outline can be seen whole.
    Camera::fit_sphere(drawing.camera.eye, center, radius, None, drawing.size())
        .with_context(place)?;
    Ok(drawing)
}

/// The camera of a capture, where one is named, in the size that is asked for or its own.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn of_args(args: &CameraArgs, scene: &Scene) -> anyhow::Result<Option<Captured>> {
    let Some((file, view)) = named(&args.captured)? else {
        if args.distorted {
            without_camera("--distorted");
        }
        return Ok(None);
    };
    let own = (view.camera.width, view.camera.height);
    let size = args.size.map_or(own, |size| (size.width, size.height));
    let lens = view.lens.as_ref().filter(|_| args.distorted);
    let made = Drawing::of_size(&view.camera, lens, size);
    of_view((&file, &view), made, scene).map(Some)
}

/// Ends the program for an option that is one of a camera of a capture's, where there is none.
pub(crate) fn without_camera(option: &str) -> ! {
    // A requirement of clap's does not count beside options that conflict with what is required.
    usage_error(
        ErrorKind::MissingRequiredArgument,
        &format!("'{option}' is of use with '--camera <FILE>' only"),
    );
}

/// Ends the program where `--up` is given beside `--camera` and has no meaning.
pub(crate) fn refuse_up(args: &CameraArgs) {
    if args.captured.camera.is_some() && args.up.is_some() {
        usage_error(
            ErrorKind::ArgumentConflict,
            "the argument '--up <X,Y,Z>' cannot be used with '--camera <FILE>', which says what is up in the picture",
        );
    }
}
