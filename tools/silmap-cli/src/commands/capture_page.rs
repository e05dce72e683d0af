//! The page about a capture: `build --page`.

use glam::DVec2;
use silmap_capture::{Capture, Carved, ImageShift, Pinhole, disagreeing, silhouette};
use silmap_report::{CapturePage, CapturePageView, capture_page};

/// What is known about a capture.
#[derive(Debug)]
pub(crate) struct About<'a> {
    pub(crate) capture: &'a Capture,
    pub(crate) carved: &'a Carved,
    pub(crate) warnings: &'a [String],
    /// Views that have no vote.
    pub(crate) left_out: &'a [String],
    pub(crate) shift: Option<&'a ImageShift>,
    /// The agreement of hull and masks, in a few words.
    pub(crate) agreement: String,
}

/// The page, in the frame of the cameras but for the origin of the carved hull.
pub(crate) fn page(found: &About<'_>) -> String {
    let (capture, carved) = (found.capture, found.carved);
    let hull = carved.mesh.mesh();
    let disagree = disagreeing(&carved.residuals);
    let views = capture.views.iter().zip(&carved.residuals).enumerate();
    let views = views.map(|(number, (view, residual))| {
        let camera = view.camera.moved(-carved.mesh.origin());
        let remark = if found.left_out.contains(&view.name) {
            Some("left out")
        } else if disagree.contains(&number) {
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
        warnings: found.warnings,
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

fn understood(found: &About<'_>) -> Vec<(String, String)> {
    let capture = found.capture;
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
    let photographs = capture.views.iter().filter(|v| v.photo.is_some()).count();
    vec![
        row("camera file", capture.path.display().to_string()),
        row("format", capture.format.name().to_owned()),
        row("conventions", capture.format.conventions().to_owned()),
        row(
            "first pixel's centre",
            format!("at {}", capture.pixel_centre),
        ),
        row(
            "views",
            format!(
                "{}, {} with a mask, {photographs} with a photograph",
                capture.listed,
                capture.views.len()
            ),
        ),
        row("images", format!("{}{more} pixels", shown.join(", "))),
    ]
}

fn found_out(found: &About<'_>) -> Vec<(String, String)> {
    let carved = found.carved;
    let disagree: Vec<&str> = (disagreeing(&carved.residuals).into_iter())
        .map(|view| found.capture.views[view].name.as_str())
        .collect();
    let or_none = |names: String| {
        if names.is_empty() {
            "none".to_owned()
        } else {
            names
        }
    };
    let outvoted = carved.residuals.iter().flatten().map(|r| r.outvoted);
    let (count, sum) = outvoted.fold((0.0_f64, 0.0), |(n, s), o| (n + 1.0, s + o));
    let mut rows = vec![
        row("masks and hull", found.agreement.clone()),
        row("views that disagree", or_none(disagree.join(", "))),
        row("views left out", or_none(found.left_out.join(", "))),
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
    if let Some(shift) = found.shift {
        rows.push(row("image coordinates", shift.to_string()));
    }
    rows
}
