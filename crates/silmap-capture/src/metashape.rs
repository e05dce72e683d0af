//! `cameras.xml` of Agisoft Metashape (and PhotoScan): sensors, components, and a pose for each camera.
//!
//! Poses go from the camera to its component, or to the chunk where there is none; the component's transform, with its scale, goes on to
//! the world, and that of the chunk where the component has none. Cameras that are not aligned, or turned off, are not used.
//!
//! Source: Agisoft, Metashape Professional User Manual, appendix "Camera models"; the same, Python reference, `Chunk.exportCameras`.
//! Deviations: p3 and p4 (of old releases) are refused where they are not zero; rolling shutter and layers of multi-camera systems are not
//! read.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};
use roxmltree::{Document, Node};

use crate::declared::{Declared, DeclaredView, MaskPlace};
use crate::error::CaptureFault;
use crate::lens::{Distortion, Projection};
use crate::pictures;
use crate::pinhole::{Matrix34, Pinhole};
use crate::view::CaptureWarning;
use crate::view_names::view_names;

/// Coefficients that mean something, and that are not read.
const NOT_READ: [&str; 2] = ["p3", "p4"];

/// What an XML file is.
#[derive(Debug)]
pub(crate) enum Xml {
    Metashape(Declared),
    /// Matrices of OpenCV's `FileStorage`, with their names.
    Matrices(Vec<(String, Matrix34)>),
}

/// A chunk's or component's way to the world: x ↦ scale·rotation·x + translation.
#[derive(Clone, Copy, Debug)]
struct Similarity {
    rotation: DMat3,
    translation: DVec3,
    scale: f64,
}

#[derive(Clone, Copy, Debug)]
struct Sensor {
    size: (u32, u32),
    focal: DVec2,
    skew: f64,
    principal: DVec2,
    distortion: Distortion,
}

fn damaged(reason: impl Into<String>) -> CaptureFault {
    CaptureFault::Damaged {
        reason: reason.into(),
    }
}

/// Whether a file of this text is one that [`read`] understands.
pub(crate) fn is_known(text: &str) -> bool {
    let document = Document::parse(text.trim_start_matches('\u{feff}'));
    document.is_ok_and(|d| {
        ["document", "chunk", "opencv_storage"].contains(&d.root_element().tag_name().name())
    })
}

/// Reads an XML file; photographs lie in or below `folder`.
pub(crate) fn read(text: &str, folder: &Path) -> Result<Xml, CaptureFault> {
    let document = Document::parse(text.trim_start_matches('\u{feff}'))
        .map_err(|error| damaged(error.to_string()))?;
    let root = document.root_element();
    match root.tag_name().name() {
        "opencv_storage" => Ok(Xml::Matrices(file_storage(root)?)),
        "document" | "chunk" => of_metashape(root, folder).map(Xml::Metashape),
        other => Err(damaged(format!(
            "it is XML, but no camera file that is known here: its root is {other:?}, not \"document\" (Metashape) or \"opencv_storage\""
        ))),
    }
}

fn of_metashape(root: Node<'_, '_>, folder: &Path) -> Result<Declared, CaptureFault> {
    let mut chunks = root.descendants().filter(|n| n.has_tag_name("chunk"));
    let chunk = chunks.find(|chunk| descendants(*chunk, "cameras", "camera").next().is_some());
    let chunk = chunk.ok_or(CaptureFault::NoViews)?;
    let cameras: Vec<Node<'_, '_>> = descendants(chunk, "cameras", "camera").collect();
    let labels: Vec<&str> = (cameras.iter())
        .map(|camera| {
            camera
                .attribute("label")
                .or(camera.attribute("id"))
                .unwrap_or("camera")
        })
        .collect();
    // A label may be a whole path of another machine.
    let slashed: Vec<String> = labels.iter().map(|l| l.replace('\\', "/")).collect();
    let names = view_names(slashed.iter().map(String::as_str));
    let (mut views, mut warnings) = (Vec::new(), Vec::new());
    for ((camera, label), name) in cameras.into_iter().zip(&slashed).zip(names) {
        let place = format!("view {name}: ");
        let mut unused = |reason: &str| {
            let (view, reason) = (name.clone(), reason.to_owned());
            warnings.push(CaptureWarning::Unused { view, reason });
        };
        if matches!(camera.attribute("enabled"), Some("false" | "0")) {
            unused("it is turned off in Metashape");
            continue;
        }
        let Some(transform) = child(camera, "transform") else {
            unused("it is not aligned");
            continue;
        };
        let t: [f64; 16] = numbers(transform, &place)?;
        let Some(sensor) = sensor_of(camera, chunk, &name)? else {
            unused("its sensor has no calibration");
            continue;
        };
        let world = world_of(camera, chunk, &place)?;
        let column = |c: usize| DVec3::new(t[c], t[4 + c], t[8 + c]);
        let eye = world.scale * (world.rotation * column(3)) + world.translation;
        let axes = [column(0), column(1), column(2)].map(|axis| world.rotation * axis);
        let fault = |fault| CaptureFault::Camera {
            view: name.clone(),
            fault,
        };
        let lens = (sensor.focal, sensor.principal);
        let camera = Pinhole::from_pose(eye, axes, lens, sensor.size).map_err(fault)?;
        views.push(DeclaredView {
            camera: Pinhole {
                skew: sensor.skew,
                ..camera
            },
            distortion: sensor.distortion,
            mask: MaskPlace::ByConvention,
            photo: Some(photo(folder, label)),
            name,
        });
    }
    Ok(Declared::of(views, 0.5, warnings))
}

/// The photograph of a label: as it stands, or its file's name in the capture's folders.
fn photo(folder: &Path, label: &str) -> PathBuf {
    let file = label.rsplit('/').next().unwrap_or(label);
    let found = pictures::find(folder, label).or_else(|| pictures::find(folder, file));
    found.unwrap_or_else(|| folder.join(file))
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|n| n.has_tag_name(name))
}

/// Elements of a name in a list of the chunk; cameras may lie in groups there.
fn descendants<'a, 'i: 'a>(
    chunk: Node<'a, 'i>,
    list: &'static str,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'i>> {
    let lists = chunk.children().filter(move |n| n.has_tag_name(list));
    lists.flat_map(move |l| l.descendants().filter(move |n| n.has_tag_name(name)))
}

/// The element of a list that an attribute of the camera refers to.
fn referred<'a, 'i: 'a>(
    camera: Node<'a, 'i>,
    attribute: &str,
    (chunk, list, name): (Node<'a, 'i>, &'static str, &'static str),
) -> Option<Node<'a, 'i>> {
    let id = camera.attribute(attribute)?;
    descendants(chunk, list, name).find(|n| n.attribute("id") == Some(id))
}

/// The numbers of an element's text, as many as the result has.
fn numbers<const N: usize>(node: Node<'_, '_>, place: &str) -> Result<[f64; N], CaptureFault> {
    let text = node.text().unwrap_or_default();
    let found: Option<Vec<f64>> = (text.split_whitespace())
        .map(|word| word.parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    let found = found.and_then(|list| <[f64; N]>::try_from(list).ok());
    found.ok_or_else(|| {
        let name = node.tag_name().name();
        let count = if N == 1 {
            "one number".to_owned()
        } else {
            format!("{N} numbers")
        };
        damaged(format!("{place}<{name}> must hold {count}"))
    })
}

fn number_of(node: Node<'_, '_>, name: &str, place: &str) -> Result<Option<f64>, CaptureFault> {
    let found = child(node, name).map(|n| numbers::<1>(n, place));
    Ok(found.transpose()?.map(|[value]| value))
}

/// The calibration of a camera's sensor, the adjusted one where there are more; `None` where there is none.
fn sensor_of(
    camera: Node<'_, '_>,
    chunk: Node<'_, '_>,
    name: &str,
) -> Result<Option<Sensor>, CaptureFault> {
    let place = format!("view {name}: ");
    let Some(sensor) = referred(camera, "sensor_id", (chunk, "sensors", "sensor")) else {
        return Ok(None);
    };
    let calibrations = || sensor.children().filter(|n| n.has_tag_name("calibration"));
    let adjusted = calibrations().find(|n| n.attribute("class") == Some("adjusted"));
    let Some(calibration) = adjusted.or_else(|| calibrations().next_back()) else {
        return Ok(None);
    };
    let kind = calibration.attribute("type").or(sensor.attribute("type"));
    let projection = match kind.unwrap_or("frame") {
        "frame" => Projection::Perspective,
        "fisheye" | "equidistant_fisheye" => Projection::Equidistant,
        other => {
            return Err(CaptureFault::LensModel {
                view: name.to_owned(),
                what: format!("{other:?}"),
            });
        }
    };
    let resolution = child(calibration, "resolution").or_else(|| child(sensor, "resolution"));
    let side = |name: &str| resolution.and_then(|r| r.attribute(name)?.trim().parse::<u32>().ok());
    let (Some(width), Some(height)) = (side("width"), side("height")) else {
        return Err(damaged(format!("{place}its sensor has no resolution")));
    };
    let number = |field: &str| number_of(calibration, field, &place);
    for field in NOT_READ {
        if number(field)?.is_some_and(|v| v != 0.0) {
            return Err(CaptureFault::LensModel {
                view: name.to_owned(),
                what: format!("of Metashape with {field}"),
            });
        }
    }
    let or_none = |field: &str| Ok::<f64, CaptureFault>(number(field)?.unwrap_or(0.0));
    let one = number("f")?;
    let (fx, fy) = match (one, number("fx")?, number("fy")?) {
        (Some(f), ..) => (f + or_none("b1")?, f),
        (None, Some(fx), Some(fy)) => (fx, fy),
        _ => {
            return Err(damaged(format!(
                "{place}its sensor has no focal length <f>"
            )));
        }
    };
    let middle = 0.5 * DVec2::new(width.into(), height.into());
    // Before version 1.3, with fx and fy, the principal point counted from the corner.
    let base = if one.is_some() { middle } else { DVec2::ZERO };
    Ok(Some(Sensor {
        size: (width, height),
        focal: DVec2::new(fx, fy),
        skew: or_none(if one.is_some() { "b2" } else { "skew" })?,
        principal: base + DVec2::new(or_none("cx")?, or_none("cy")?),
        distortion: Distortion {
            projection,
            numerator: [
                or_none("k1")?,
                or_none("k2")?,
                or_none("k3")?,
                or_none("k4")?,
            ],
            // The other way round than OpenCV's.
            tangential: [or_none("p2")?, or_none("p1")?],
            ..Distortion::default()
        },
    }))
}

/// Where a camera's component, or else the chunk, lies in the world.
fn world_of(
    camera: Node<'_, '_>,
    chunk: Node<'_, '_>,
    place: &str,
) -> Result<Similarity, CaptureFault> {
    let component = referred(camera, "component_id", (chunk, "components", "component"));
    let of_component = component.and_then(|c| child(c, "transform"));
    let Some(transform) = of_component.or_else(|| child(chunk, "transform")) else {
        return Ok(Similarity {
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
            scale: 1.0,
        });
    };
    let rotation = child(transform, "rotation").map(|n| numbers::<9>(n, place));
    let translation = child(transform, "translation").map(|n| numbers::<3>(n, place));
    let scale = number_of(transform, "scale", place)?.unwrap_or(1.0);
    if scale <= 0.0 {
        return Err(damaged(format!(
            "{place}the scale of its transform is {scale}, and must be positive"
        )));
    }
    Ok(Similarity {
        rotation: (rotation.transpose()?)
            .map_or(DMat3::IDENTITY, |r| DMat3::from_cols_array(&r).transpose()),
        translation: translation.transpose()?.map_or(DVec3::ZERO, DVec3::from),
        scale,
    })
}

/// The 3×4 matrices of OpenCV's `FileStorage`: elements with rows, columns and data, named as the matrices are.
fn file_storage(root: Node<'_, '_>) -> Result<Vec<(String, Matrix34)>, CaptureFault> {
    let mut found = Vec::new();
    for node in root.children().filter(Node::is_element) {
        let text = |name: &str| child(node, name).and_then(|n| n.text()).map(str::trim);
        if (text("rows"), text("cols")) != (Some("3"), Some("4")) {
            continue;
        }
        let name = node.tag_name().name();
        let data = child(node, "data");
        let data = data.ok_or_else(|| damaged(format!("the matrix {name} has no data")))?;
        let v: [f64; 12] = numbers(data, &format!("the matrix {name}: "))?;
        let matrix = std::array::from_fn(|r| std::array::from_fn(|c| v[4 * r + c]));
        // `viff000_matrix` is of `viff000.png`.
        let short = name
            .strip_suffix("_matrix")
            .or(name.strip_suffix("_P"))
            .unwrap_or(name);
        found.push((short.to_owned(), matrix));
    }
    Ok(found)
}
