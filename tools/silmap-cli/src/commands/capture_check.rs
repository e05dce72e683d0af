//! `silmap build --check`: what was understood of a capture, and how well its masks agree with each other.

use std::path::Path;
use std::time::Instant;

use serde::Serialize;
use silmap_capture::{Misread, ShiftKind};

use crate::args::CarveArgs;
use crate::commands::capture_page;
use crate::commands::captured::{CarvedCapture, MaskJson, OverlapJson};
use crate::{machine, output};

/// What `build --check` prints.
#[derive(Serialize)]
struct CheckJson<'a> {
    capture: &'a Path,
    name: &'a str,
    format: &'static str,
    conventions: &'static str,
    pixel_centre: f64,
    /// Views in the file.
    listed: usize,
    /// Views with a mask.
    views: usize,
    photographs: usize,
    distortion: String,
    masks: Vec<MaskJson>,
    overlap: OverlapJson,
    /// Views whose masks or cameras disagree with the rest.
    disagree: Vec<&'a str>,
    outvoted: u32,
    /// Views without a vote: each alone carves away much of what all others keep.
    left_out: Vec<&'a str>,
    /// What may be wrong with all cameras; nothing where the masks agree with them, several where they do not tell which.
    likely: Vec<&'static str>,
    image_shift: Option<ShiftJson>,
    voxel: f64,
    hull: HullJson,
    warnings: &'a [String],
    seconds: f64,
    peak_bytes: Option<u64>,
}

/// What is to be added to the image coordinates that the cameras give so that they fit the masks best, pixels.
#[derive(Serialize)]
struct ShiftJson {
    by: [f64; 2],
    /// Standard deviations.
    deviation: [f64; 2],
    /// Whether each of both can be told.
    is_known: [bool; 2],
    /// `none`, `half-pixel` or `principal-point`.
    looks_like: &'static str,
}

#[derive(Serialize)]
struct HullJson {
    faces: usize,
    volume: f64,
    /// Corners of the box around it, in the frame of the cameras.
    bounds: [[f64; 3]; 2],
}

/// Reads and carves a capture, writes the page that is asked for, and prints what was found.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn check(path: &Path, args: &CarveArgs, is_json: bool) -> anyhow::Result<()> {
    let started = Instant::now();
    let mut found = CarvedCapture::of(path, args, 0)?;
    found.write_mesh()?;
    capture_page::write(&found)?;
    let (capture, carved) = (&found.capture, &found.carved);
    let disagree = found.disagree();
    let with_lens = capture.views.iter().filter(|v| v.lens.is_some()).count();
    let distortion = match with_lens {
        0 => "none".to_owned(),
        all if all == capture.views.len() => "taken out".to_owned(),
        some => format!("taken out of {some} views"),
    };
    let (bounds, origin) = (carved.mesh.bounds(), carved.mesh.origin());
    if is_json {
        return output::print_json(&CheckJson {
            capture: &capture.path,
            name: &capture.name,
            format: capture.format.name(),
            conventions: capture.format.conventions(),
            pixel_centre: capture.pixel_centre,
            listed: capture.listed,
            views: capture.views.len(),
            photographs: found.taken(),
            distortion,
            masks: found.masks(),
            overlap: found.overlap(),
            disagree,
            outvoted: carved.outvoted,
            left_out: found.left_out(),
            likely: found.misread.as_ref().map_or_else(Vec::new, Misread::keys),
            image_shift: found.shift.map(|shift| ShiftJson {
                by: shift.by.to_array(),
                deviation: shift.deviation.to_array(),
                is_known: shift.is_known(),
                looks_like: match shift.kind() {
                    ShiftKind::None => "none",
                    ShiftKind::HalfPixel { .. } => "half-pixel",
                    ShiftKind::Principal => "principal-point",
                },
            }),
            voxel: carved.voxel,
            hull: HullJson {
                faces: carved.mesh.mesh().faces.len(),
                volume: carved.mesh.mesh().volume(),
                bounds: [bounds.min, bounds.max].map(|corner| (corner + origin).to_array()),
            },
            warnings: &found.warnings,
            seconds: started.elapsed().as_secs_f64(),
            peak_bytes: machine::peak_bytes(None),
        });
    }
    let mut lines = vec![
        format!(
            "{}: {}, {}, the first pixel's centre at {}, distortion: {distortion}",
            capture.path.display(),
            capture.format.name(),
            capture.format.conventions(),
            capture.pixel_centre
        ),
        found.counts(),
        found.describe(),
        format!(
            "hull: volume {:.4e}, {} faces, voxels of {:.4e}",
            carved.mesh.mesh().volume(),
            carved.mesh.mesh().faces.len(),
            carved.voxel
        ),
    ];
    lines.extend(found.shift.iter().map(ToString::to_string));
    for mask in found.masks() {
        let mark = if disagree.contains(&mask.name.as_str()) {
            "  disagrees with the rest"
        } else {
            ""
        };
        lines.push(match (mask.overlap, mask.outvoted, mask.missing) {
            (Some(overlap), Some(outvoted), Some(missing)) => format!(
                "  {}: overlap {overlap:.4}, {:.2} % of the hull beside the mask, {:.2} % of the mask carved away{mark}",
                mask.name,
                100.0 * outvoted,
                100.0 * missing
            ),
            _ => format!("  {}: the hull reaches behind its camera", mask.name),
        });
    }
    lines.push(match disagree.len() {
        0 => "no view disagrees with the rest".to_owned(),
        count => format!("{count} disagree with the rest: {}", disagree.join(", ")),
    });
    lines.push(String::new());
    output::print_bytes(lines.join("\n").as_bytes())
}
