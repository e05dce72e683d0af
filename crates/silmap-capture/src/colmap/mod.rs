//! COLMAP models: `cameras`, `images` and, of newer releases, `rigs` and `frames`, each as text or binary.
//!
//! An image's line holds its whole pose; releases with rigs and frames write it there too. Where it has none, it is that of the frame,
//! after that of the sensor in its rig. Points are not read.
//!
//! Source: COLMAP, documentation, "Output Format"; camera models: `src/colmap/sensor/models.h`.

mod binary;
mod model;
mod text;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec2, DVec3};
use silmap_mesh_io::input;

use crate::declared::{Declared, DeclaredView, MaskPlace};
use crate::error::{CaptureError, CaptureFault};
use crate::find_mask;
use crate::pictures::folder_of;
use crate::pinhole::Pinhole;
use crate::view::CaptureWarning;
use crate::view_names::view_names;

/// Where a model lies in a capture's folder.
const PLACES: [&str; 7] = [
    "",
    "sparse/0",
    "sparse",
    "colmap/sparse/0",
    "colmap/sparse",
    "colmap",
    "model",
];

/// Extensions of the model's files; COLMAP itself takes the binary ones where both are there.
const EXTENSIONS: [&str; 2] = ["bin", "txt"];

/// The folder of photographs, and that of masks, are looked for so many folders above the model's.
const UPWARDS: usize = 4;

/// From one frame to another: x ↦ rotation·x + translation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rigid {
    rotation: DQuat,
    translation: DVec3,
}

impl Rigid {
    const IDENTITY: Self = Self {
        rotation: DQuat::IDENTITY,
        translation: DVec3::ZERO,
    };

    /// Of w, x, y, z and the translation; `None` where these are no pose.
    fn new(numbers: [f64; 7]) -> Option<Self> {
        let [w, x, y, z, tx, ty, tz] = numbers;
        let (rotation, translation) = (DQuat::from_xyzw(x, y, z, w), DVec3::new(tx, ty, tz));
        let length = rotation.length();
        let is_pose = length.is_finite() && length > 0.0 && translation.is_finite();
        let rotation = rotation * (1.0 / length);
        (is_pose && rotation.is_finite()).then_some(Self {
            rotation,
            translation,
        })
    }

    /// First `other`, then this.
    fn after(&self, other: &Self) -> Self {
        Self {
            rotation: self.rotation * other.rotation,
            translation: self.rotation * other.translation + self.translation,
        }
    }
}

/// A line of `cameras`.
#[derive(Clone, Debug, PartialEq)]
struct CameraLine {
    id: u32,
    model: model::CameraModel,
    size: (u64, u64),
    params: Vec<f64>,
}

/// A line of `images`.
#[derive(Clone, Debug, PartialEq)]
struct ImageLine {
    id: u32,
    camera: u32,
    camera_from_world: Option<Rigid>,
    name: String,
}

/// A camera, or another instrument, of a rig.
type Sensor = (i32, u32);

/// Number of the sensors that are cameras.
const CAMERA: i32 = 0;

/// A line of `rigs`: what is known about where its sensors are.
#[derive(Clone, Debug, PartialEq)]
struct RigLine {
    id: u32,
    sensors: Vec<(Sensor, Option<Rigid>)>,
}

/// A line of `frames`: the images that a rig took at once, by their numbers.
#[derive(Clone, Debug, PartialEq)]
struct FrameLine {
    rig: u32,
    rig_from_world: Option<Rigid>,
    images: Vec<u32>,
}

/// The file of a model in or below a capture's folder that names its cameras.
pub(crate) fn find(folder: &Path) -> Option<PathBuf> {
    let models = PLACES.iter().map(|place| folder.join(place));
    let mut files = models.flat_map(|model| {
        EXTENSIONS.map(|extension| model.join("cameras").with_extension(extension))
    });
    files.find(|file| file.is_file() && file.with_file_name(images_name(file)).is_file())
}

/// Whether a file belongs to such a model, by its name. A `cameras.txt` without `images.txt` may be one of matrices: it is of a model where
/// it can be read so.
pub(crate) fn is_of_model(path: &Path) -> bool {
    const STEMS: [&str; 4] = ["cameras", "images", "rigs", "frames"];
    let is_one = |name: Option<&std::ffi::OsStr>, of: &[&str]| {
        name.is_some_and(|n| of.iter().any(|known| n == *known))
    };
    let is_named = is_one(path.file_stem(), &STEMS) && is_one(path.extension(), &EXTENSIONS);
    let is_alone = path.ends_with("cameras.txt") && !path.with_file_name("images.txt").is_file();
    is_named && (!is_alone || read_part(path, binary::cameras, text::cameras).is_ok())
}

fn images_name(file: &Path) -> String {
    let extension = file.extension().unwrap_or_default();
    format!("images.{}", extension.to_string_lossy())
}

/// Reads the model that a file belongs to. Returns the folder that photographs and masks lie in, too.
pub(crate) fn read(file: &Path) -> Result<(Declared, PathBuf), CaptureError> {
    let is_binary = file.extension().is_some_and(|e| e == "bin");
    let part = |stem: &str| {
        let extension = EXTENSIONS[usize::from(!is_binary)];
        file.with_file_name(format!("{stem}.{extension}"))
    };
    let cameras = read_part(&part("cameras"), binary::cameras, text::cameras)?;
    let images = part("images");
    let mut lines = read_part(&images, binary::images, text::images)?;
    let mut of_id: HashMap<u32, &CameraLine> = HashMap::new();
    for camera in &cameras {
        if of_id.insert(camera.id, camera).is_some() {
            let reason = format!("camera {} is there twice", camera.id);
            return Err(CaptureFault::Damaged { reason }.at(&part("cameras")));
        }
    }
    if lines.is_empty() {
        return Err(CaptureFault::NoViews.at(&images));
    }
    let (rigs, frames) = (part("rigs"), part("frames"));
    if lines.iter().any(|line| line.camera_from_world.is_none())
        && rigs.is_file()
        && frames.is_file()
    {
        let rigs = read_part(&rigs, binary::rigs, text::rigs)?;
        let frames = read_part(&frames, binary::frames, text::frames)?;
        take_poses_of_frames(&mut lines, &rigs, &frames);
    }
    // Numbers of images depend on the order in which they were found; names do not.
    lines.sort_by(|a, b| a.name.cmp(&b.name));
    let root = root_of(file);
    let declared = declared(&lines, &of_id, &root, &part("cameras"));
    Ok((declared.map_err(|fault| fault.at(&images))?, root))
}

/// Reads one file of a model by the reader of its kind.
fn read_part<T>(
    path: &Path,
    binary: fn(&[u8]) -> Result<Vec<T>, CaptureFault>,
    text: fn(&str) -> Result<Vec<T>, CaptureFault>,
) -> Result<Vec<T>, CaptureError> {
    let is_binary = path.extension().is_some_and(|e| e == "bin");
    let read = match is_binary {
        true => input::read(path)
            .map_err(CaptureFault::Unreadable)
            .and_then(|bytes| binary(&bytes)),
        false => input::read_text(path)
            .map_err(CaptureFault::Unreadable)
            .and_then(|words| text(words.trim_start_matches('\u{feff}'))),
    };
    read.map_err(|fault| fault.at(path))
}

/// Gives images without a pose the one of their frame and sensor.
fn take_poses_of_frames(images: &mut [ImageLine], rigs: &[RigLine], frames: &[FrameLine]) {
    let rigs: HashMap<u32, &RigLine> = rigs.iter().map(|rig| (rig.id, rig)).collect();
    let mut of_image: HashMap<u32, &FrameLine> = HashMap::new();
    for frame in frames {
        of_image.extend(frame.images.iter().map(|&image| (image, frame)));
    }
    for image in images.iter_mut().filter(|i| i.camera_from_world.is_none()) {
        let Some(frame) = of_image.get(&image.id) else {
            continue;
        };
        let sensor = (CAMERA, image.camera);
        let sensor_from_rig = rigs.get(&frame.rig).and_then(|rig| {
            let found = rig.sensors.iter().find(|(of, _)| *of == sensor);
            found.and_then(|(_, pose)| *pose)
        });
        if let (Some(sensor), Some(rig)) = (sensor_from_rig, frame.rig_from_world) {
            image.camera_from_world = Some(sensor.after(&rig));
        }
    }
}

/// The folder that holds `images` or `masks`: the model's own, or one above.
fn root_of(file: &Path) -> PathBuf {
    let model = folder_of(file);
    // A path such as `sparse/0` has no name above it.
    let whole = std::fs::canonicalize(&model).unwrap_or_else(|_| model.clone());
    for name in ["images", "masks"] {
        let mut above = whole.ancestors().take(UPWARDS);
        if let Some(steps) = above.position(|folder| folder.join(name).is_dir()) {
            let mut root = model;
            for _ in 0..steps {
                root = match root.parent() {
                    Some(parent) if root.file_name().is_some() => parent.to_owned(),
                    _ => root.join(".."),
                };
            }
            return match root.as_os_str().is_empty() {
                true => PathBuf::from("."),
                false => root,
            };
        }
    }
    model
}

fn declared(
    images: &[ImageLine],
    cameras: &HashMap<u32, &CameraLine>,
    root: &Path,
    cameras_path: &Path,
) -> Result<Declared, CaptureFault> {
    let names = view_names(images.iter().map(|image| image.name.as_str()));
    let (mut views, mut warnings) = (Vec::new(), Vec::new());
    for (image, name) in images.iter().zip(names) {
        let Some(pose) = image.camera_from_world else {
            let reason = "it has no pose".to_owned();
            warnings.push(CaptureWarning::Unused { view: name, reason });
            continue;
        };
        let Some(camera) = cameras.get(&image.camera) else {
            let file = cameras_path.file_name().unwrap_or_default();
            return Err(CaptureFault::Damaged {
                reason: format!(
                    "view {name}: its camera {} is not in {}",
                    image.camera,
                    file.to_string_lossy()
                ),
            });
        };
        let (intrinsics, distortion) =
            camera
                .model
                .meaning(&camera.params)
                .ok_or_else(|| CaptureFault::LensModel {
                    view: name.clone(),
                    what: camera.model.name().to_owned(),
                })?;
        let [fx, fy, cx, cy] = intrinsics;
        let side = |pixels: u64| u32::try_from(pixels).unwrap_or(u32::MAX);
        let rows = DMat3::from_quat(pose.rotation).transpose();
        let axes = [rows.x_axis, rows.y_axis, rows.z_axis];
        let eye = -(pose.rotation.conjugate() * pose.translation);
        let lens = (DVec2::new(fx, fy), DVec2::new(cx, cy));
        let size = (side(camera.size.0), side(camera.size.1));
        let camera =
            Pinhole::from_pose(eye, axes, lens, size).map_err(|fault| CaptureFault::Camera {
                view: name.clone(),
                fault,
            })?;
        let photo = [
            root.join("images").join(&image.name),
            root.join(&image.name),
        ];
        let [in_images, beside] = photo;
        let is_beside = !in_images.is_file() && beside.is_file();
        views.push(DeclaredView {
            camera,
            distortion,
            mask: MaskPlace::OneOf(masks_of(&image.name, root)),
            photo: Some(if is_beside { beside } else { in_images }),
            name,
        });
    }
    Ok(Declared::of(views, 0.5, warnings))
}

/// `masks/NAME.jpg.png`, as COLMAP itself has them, and `masks/NAME.png`, with the photograph's folders or without.
fn masks_of(image: &str, root: &Path) -> Vec<PathBuf> {
    let (masks, image) = (root.join("masks"), Path::new(image));
    let file = Path::new(image.file_name().unwrap_or_default());
    let places = [image, file].into_iter();
    places.flat_map(|i| find_mask::named(&masks, i)).collect()
}
