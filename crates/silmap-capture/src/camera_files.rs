//! Which file of a capture has its cameras, and which reader it is for.

use std::fs;
use std::path::{Path, PathBuf};

use silmap_mesh_io::input;

use crate::declared::Declared;
use crate::error::{CaptureError, CaptureFault};
use crate::find_mask::size_by_pictures;
use crate::json::{self, Fields};
use crate::metashape::{self, Xml};
use crate::turntable::make_metric;
use crate::view::{CameraFormat, CaptureWarning};
use crate::{cameras_json, colmap, matrices, middlebury, pictures, transforms_json};

/// Names that are looked for in a folder, the first that is there wins; after them the others, in the order of [`camera_file`].
const FILES: [&str; 2] = ["cameras.json", "transforms.json"];

/// The name of NeRF's own sets, which have a file for each use.
const OF_TRAINING: &str = "transforms_train.json";

/// What the names of Middlebury's camera files end in.
const MIDDLEBURY: &str = "_par.txt";

const KNOWN: &str = "cameras.json, transforms.json, a COLMAP model (cameras.bin or cameras.txt, also in sparse/0), \
                     transforms_train.json, *_par.txt, cameras.xml of Metashape, txt/*.txt of PMVS, or 3×4 matrices in *.P, *.txt or \
                     OpenCV's *.xml";

/// What a capture's camera file says.
#[derive(Debug)]
pub(crate) struct CameraFile {
    pub(crate) format: CameraFormat,
    pub(crate) path: PathBuf,
    /// The folder that photographs and masks lie in.
    pub(crate) folder: PathBuf,
    pub(crate) declared: Declared,
}

/// Whether a path is to be read as a capture rather than as a mesh: a folder, or a file whose name is that of a camera file: `*.json`,
/// `*.xml`, `*.txt`, `*.P`, or a part of a COLMAP model.
#[must_use]
pub fn is_capture(path: &Path) -> bool {
    let is_json = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("json"));
    is_json
        || is_xml(path)
        || matrices::is_of_matrices(path)
        || colmap::is_of_model(path)
        || path.is_dir()
}

fn is_middlebury(path: &Path) -> bool {
    let name = path.file_name().map(|n| n.to_string_lossy());
    name.is_some_and(|n| n.ends_with(MIDDLEBURY))
}

fn is_xml(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("xml"))
}

/// Reads the cameras of a capture: of a camera file, or of the first that its folder holds.
pub(crate) fn read(path: &Path) -> Result<CameraFile, CaptureError> {
    let file = camera_file(path).map_err(|fault| fault.at(path))?;
    let (format, mut declared, folder) = understood(&file)?;
    if declared.views.is_empty() {
        let first = declared.warnings.iter().find_map(|warning| match warning {
            CaptureWarning::Unused { view, reason } => Some(format!("view {view}: {reason}")),
            _ => None,
        });
        let fault = first.map_or(CaptureFault::NoViews, |first| CaptureFault::NoUsableView {
            first,
        });
        return Err(fault.at(&file));
    }
    if !declared.is_metric {
        make_metric(&mut declared);
    }
    Ok(CameraFile {
        format,
        path: file,
        folder,
        declared,
    })
}

/// What a camera file says, by the reader of its kind, and the folder of photographs and masks.
fn understood(file: &Path) -> Result<(CameraFormat, Declared, PathBuf), CaptureError> {
    if colmap::is_of_model(file) {
        let (declared, folder) = colmap::read(file)?;
        return Ok((CameraFormat::Colmap, declared, folder));
    }
    if !is_middlebury(file) && matrices::is_of_matrices(file) {
        return matrices::read(file);
    }
    let folder = pictures::folder_of(file);
    let text = input::read_text(file).map_err(|e| CaptureFault::Unreadable(e).at(file))?;
    let read = if is_middlebury(file) {
        let size_of = |photo: &Path| size_by_pictures(photo, &folder);
        middlebury::read(&text, &folder, &size_of).map(|d| (CameraFormat::Middlebury, d))
    } else if is_xml(file) {
        match metashape::read(&text, &folder) {
            Ok(Xml::Metashape(declared)) => Ok((CameraFormat::Metashape, declared)),
            Ok(Xml::Matrices(list)) => {
                let declared = matrices::of_list(list, file, &folder)?;
                Ok((CameraFormat::Matrices, declared))
            }
            Err(fault) => Err(fault),
        }
    } else {
        of_json(&text, &folder)
    };
    let (format, declared) = read.map_err(|fault| fault.at(file))?;
    Ok((format, declared, folder))
}

fn camera_file(path: &Path) -> Result<PathBuf, CaptureFault> {
    let about = fs::metadata(path).map_err(CaptureFault::Unreadable)?;
    if !about.is_dir() {
        return Ok(path.to_owned());
    }
    let mut files = FILES.iter().map(|name| path.join(name));
    if let Some(found) = files.find(|file| file.is_file()) {
        return Ok(found);
    }
    if let Some(found) = colmap::find(path) {
        return Ok(found);
    }
    let of_training = path.join(OF_TRAINING);
    if of_training.is_file() {
        return Ok(of_training);
    }
    // Whether it can be looked into at all.
    fs::read_dir(path).map_err(CaptureFault::Unreadable)?;
    let middlebury = pictures::files(path, is_middlebury);
    if let Some(first) = middlebury.into_iter().next() {
        return Ok(first);
    }
    let mut others = pictures::files(path, is_xml);
    others.sort_by_key(|file| !file.ends_with("cameras.xml"));
    let is_known = |file: &PathBuf| {
        let text = || input::read_text(file);
        file.ends_with("cameras.xml") || text().is_ok_and(|text| metashape::is_known(&text))
    };
    let of_xml = others.into_iter().find(is_known);
    let first = of_xml.or_else(|| matrices::find(path));
    first.ok_or(CaptureFault::NoCameraFile { known: KNOWN })
}

fn of_json(text: &str, folder: &Path) -> Result<(CameraFormat, Declared), CaptureFault> {
    let value = json::parse(text)?;
    let Some(map) = value.as_object() else {
        return Err(CaptureFault::OtherJson);
    };
    let object = Fields {
        place: String::new(),
        map,
    };
    if map.contains_key("views") {
        return Ok((
            CameraFormat::CamerasJson,
            cameras_json::read(&object, folder)?,
        ));
    }
    if map.contains_key("frames") {
        let read = transforms_json::read(&object, folder)?;
        return Ok((CameraFormat::TransformsJson, read));
    }
    Err(CaptureFault::OtherJson)
}
