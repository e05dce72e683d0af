//! The page about a capture: `build --page`.

use glam::DVec2;
use silmap_capture::{Pinhole, silhouette};
use silmap_report::{CapturePage, CapturePageView, capture_page};

use crate::commands::captured::CarvedCapture;

/// Writes the page that is asked for.
///
/// # Errors
/// When it cannot be written.
pub(crate) fn write(found: &CarvedCapture) -> anyhow::Result<()> {
    match &found.page {
        Some(file) => file.write(page(found).as_bytes()),
        None => Ok(()),
    }
}

/// The page, in the frame of the cameras but for the origin of the carved hull.
fn page(found: &CarvedCapture) -> String {
    let (capture, carved) = (&found.capture, &found.carved);
    let hull = carved.mesh.mesh();
    let (left_out, disagree) = (found.left_out(), found.disagree());
    let views = capture.views.iter().zip(&carved.residuals);
    let views = views.map(|(view, residual)| {
        let camera = view.camera.moved(-carved.mesh.origin());
        let remark = if left_out.contains(&view.name.as_str()) {
            Some("left out")
        } else if disagree.contains(&view.name.as_str()) {
            Some("disagrees with the rest")
        } else {
            None
        };
        CapturePageView {
            name: &view.name,
            eye: camera.eye,
            corners: corners(&camera),
            mask: &view.mask,
            hull: silhouette(hull, &camera),
            overlap: residual.map(|r| r.overlap),
            outvoted: residual.map(|r| r.outvoted),
            missing: residual.map(|r| r.missing),
            remark,
        }
    });
    capture_page(&CapturePage {
        title: format!("Capture of {}", capture.name),
        understood: understood(found),
        found: found_out(found),
        warnings: &found.warnings,
        hull,
        views: views.collect(),
    })
}

fn corners(camera: &Pinhole) -> [glam::DVec3; 4] {
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)].map(|(x, y)| camera.direction(DVec2::new(x, y)))
}

fn row(what: &str, how: String) -> (String, String) {
    (what.to_owned(), how)
}

fn understood(found: &CarvedCapture) -> Vec<(String, String)> {
    let capture = &found.capture;
    let mut sizes: Vec<[u32; 2]> = (capture.views.iter())
        .map(|v| [v.camera.width, v.camera.height])
        .collect();
    sizes.sort_unstable();
    sizes.dedup();
    const SHOWN: usize = 3;
    let shown: Vec<String> = (sizes.iter().take(SHOWN))
        .map(|[w, h]| format!("{w} × {h}"))
        .collect();
    let more = if sizes.len() > SHOWN {
        ", and others"
    } else {
        ""
    };
    vec![
        row("camera file", capture.path.display().to_string()),
        row("format", capture.format.name().to_owned()),
        row("conventions", capture.format.conventions().to_owned()),
        row(
            "first pixel's centre",
            format!("at {}", capture.pixel_centre),
        ),
        row("views", found.counts()),
        row("images", format!("{}{more} pixels", shown.join(", "))),
    ]
}

fn found_out(found: &CarvedCapture) -> Vec<(String, String)> {
    let carved = &found.carved;
    let or_none = |names: Vec<&str>| match names.is_empty() {
        true => "none".to_owned(),
        false => names.join(", "),
    };
    let outvoted = carved.residuals.iter().flatten().map(|r| r.outvoted);
    let (count, sum) = outvoted.fold((0.0_f64, 0.0), |(n, s), o| (n + 1.0, s + o));
    let mut rows = vec![
        row("masks and hull", found.describe()),
        row("views that disagree", or_none(found.disagree())),
        row("views left out", or_none(found.left_out())),
        row(
            "outvoted",
            format!(
                "a point is kept when at most {} views see it beside their mask; on average {:.2} % of a mask's area of the hull lies beside it",
                carved.outvoted,
                100.0 * sum / count.max(1.0)
            ),
        ),
        row(
            "hull",
            format!(
                "volume {:.4e}, {} faces, voxels of {:.4e}",
                carved.mesh.mesh().volume(),
                carved.mesh.mesh().faces.len(),
                carved.voxel
            ),
        ),
    ];
    if let Some(shift) = &found.shift {
        rows.push(row("image coordinates", shift.to_string()));
    }
    rows
}
