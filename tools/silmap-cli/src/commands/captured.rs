//! Captures in the place of a mesh: read, carved, coloured.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde::Serialize;
use silmap_capture::{
    Capture, CaptureWarning, CarveParams, Carved, Coloured, GainRange, ImageShift, MaskOptions,
    Matrix34, Misread, Painted, ShiftKind, ViewPhotograph, carve, coloured, disagreeing,
    image_shift, median, misread, read_with, silhouettes_with_room,
};
use silmap_map::{CapturedView, SilhouetteMap};
use silmap_mesh_io::{Loaded, check_output, encode_painted};
use silmap_preprocess::pipeline::Photographed;

use crate::args::CarveArgs;
use crate::output::OutputFile;
use crate::progress::Progress;
use crate::{interrupt, names, output};

/// A capture and the hull that was carved from it.
#[derive(Debug)]
pub(crate) struct CarvedCapture {
    pub(crate) capture: Capture,
    pub(crate) carved: Carved,
    pub(crate) painted: Option<Painted>,
    /// Of the views that have one, evened out.
    pub(crate) photographs: Vec<ViewPhotograph>,
    gains: Option<GainRange>,
    /// Of each view with a photograph.
    gain_of: BTreeMap<usize, [f32; 3]>,
    /// What was odd, as sentences.
    pub(crate) warnings: Vec<String>,
    /// Where the page about it is to be written.
    pub(crate) page: Option<OutputFile>,
    /// Where the carved hull is to be written.
    mesh_file: Option<(PathBuf, OutputFile)>,
    /// Another reading of the cameras that agrees better with the masks.
    pub(crate) misread: Option<Misread>,
    /// How far all image coordinates are off.
    pub(crate) shift: Option<ImageShift>,
}

/// A mask beside the carved hull.
#[derive(Debug, Serialize)]
pub(crate) struct MaskJson {
    pub(crate) name: String,
    /// Its camera without the lens: 3×4, to pixels from the image's top-left corner.
    camera: Matrix34,
    /// Columns and rows of that image.
    size: [u32; 2],
    /// Intersection over union; null where the hull reaches behind the camera.
    pub(crate) overlap: Option<f64>,
    /// Pixels of the hull beside the mask, over those of the mask.
    pub(crate) outvoted: Option<f64>,
    /// Pixels of the mask beside the hull, over those of the mask.
    pub(crate) missing: Option<f64>,
    /// Factors on linear red, green and blue that even out its photograph's exposure; null where it has none.
    gain: Option<[f32; 3]>,
}

/// What `build` prints about a capture, besides what it prints about a mesh.
#[derive(Debug, Serialize)]
pub(crate) struct CaptureJson {
    /// Views of the map whose silhouettes are photographs' own, in part at least.
    views_seen: usize,
    /// Views of the map whose silhouettes are those of the carved hull.
    views_closed: usize,
    /// Share of the directions around the object from which outlines rest on photographs.
    covered: Option<f64>,
    masks: Vec<MaskJson>,
    overlap: OverlapJson,
    /// Views that may see a point beside their mask, and it is kept.
    outvoted: u32,
    /// Side of a voxel, length units of the cameras.
    voxel: f64,
    /// Photographs that coloured the hull.
    photographs: usize,
    /// Share of the carved surface's vertices that some photograph shows.
    painted: f64,
    /// Factors on the photographs' channels that even out exposure and white balance; null without photographs.
    gains: Option<GainsJson>,
}

#[derive(Debug, Serialize)]
struct GainsJson {
    smallest: f64,
    largest: f64,
}

#[derive(Debug, Serialize)]
pub(crate) struct OverlapJson {
    smallest: Option<f64>,
    median: Option<f64>,
}

/// Reads a capture and prints what was odd.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn read(path: &Path, masks: MaskOptions) -> anyhow::Result<Capture> {
    let owned = path.to_owned();
    let capture = interrupt::unless_stopped(move || read_with(&owned, &masks))??;
    for warning in &capture.warnings {
        output::warn(&format!("{}: {warning}", capture.path.display()));
    }
    Ok(capture)
}

impl CarvedCapture {
    /// Reads and carves a capture, and colours the hull for textures of this side; prints its warnings.
    ///
    /// # Errors
    /// One sentence with the file's name.
    pub(crate) fn of(path: &Path, args: &CarveArgs, texture_px: u32) -> anyhow::Result<Self> {
        args.page.as_deref().map_or(Ok(()), names::check_page)?;
        let page = args.page.as_deref().map(OutputFile::check).transpose()?;
        let mesh_file = (args.carved.as_deref())
            .map(|path| {
                check_output(path)?;
                Ok::<_, anyhow::Error>((path.to_owned(), OutputFile::check(path)?))
            })
            .transpose()?;
        let capture = read(path, args.masks())?;
        let outputs = page.iter().chain(mesh_file.iter().map(|(_, file)| file));
        for output in outputs {
            let photos = capture.views.iter().filter_map(|v| v.photo.as_ref());
            for input in photos.chain([&capture.path]) {
                output.refuse_to_replace(input);
            }
        }
        let params = CarveParams {
            voxels: args.voxels.unwrap_or(CarveParams::default().voxels),
            outvoted: args.outvoted,
        };
        let mut carved = Progress::new()
            .watch(|watch| carve(&capture, &params, watch))
            .with_context(|| capture.path.display().to_string())?;
        let mut odd = capture.warnings.clone();
        odd.append(&mut carved.warnings);
        let mut found = Self {
            capture,
            carved,
            painted: None,
            photographs: Vec::new(),
            gains: None,
            gain_of: BTreeMap::new(),
            warnings: Vec::new(),
            page,
            mesh_file,
            misread: None,
            shift: None,
        };
        found.look_closer(args, &mut odd)?;
        if !(args.check || args.no_photographs) {
            found.paint(texture_px, &mut odd)?;
        }
        found.warnings = odd.iter().map(ToString::to_string).collect();
        for warning in &found.warnings[found.capture.warnings.len()..] {
            output::warn(&format!("{}: {warning}", found.capture.path.display()));
        }
        Ok(found)
    }

    /// Writes the carved hull where that is asked for.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn write_mesh(&mut self) -> anyhow::Result<()> {
        let Some((path, file)) = &self.mesh_file else {
            return Ok(());
        };
        let mesh = &self.carved.mesh;
        let files = encode_painted(path, mesh.mesh(), mesh.origin())?;
        // Nothing is beside it: its colours are those of vertices.
        file.write(&files.bytes)?;
        for warning in files.warnings() {
            output::warn(&format!("{}: {warning}", path.display()));
            self.warnings.push(warning);
        }
        Ok(())
    }

    /// What is found out about all cameras together, with `--check` or for a page.
    fn look_closer(
        &mut self,
        args: &CarveArgs,
        odd: &mut Vec<CaptureWarning>,
    ) -> anyhow::Result<()> {
        let is_poor = |w: &CaptureWarning| matches!(w, CaptureWarning::PoorOverlap { .. });
        self.misread = odd.iter().find_map(|warning| match warning {
            CaptureWarning::Misread(misread) => Some(misread.clone()),
            _ => None,
        });
        if !args.check && args.page.is_none() {
            return Ok(());
        }
        // Where the overlap is poor, carving has looked already.
        if !odd.iter().any(is_poor) {
            self.misread = Progress::new().watch(|watch| misread(&self.capture, watch))?;
            odd.extend(self.misread.clone().map(CaptureWarning::Misread));
        }
        // Coordinates of cameras that are wrong altogether say nothing.
        if self.misread.is_none() {
            self.shift = image_shift(&self.capture);
            let shift = self.shift.filter(|s| s.kind() != ShiftKind::None);
            odd.extend(shift.map(CaptureWarning::Shifted));
        }
        Ok(())
    }

    fn paint(&mut self, texture_px: u32, odd: &mut Vec<CaptureWarning>) -> anyhow::Result<()> {
        let mesh = self.carved.mesh.clone();
        let found =
            Progress::new().watch(|watch| coloured(&self.capture, mesh, texture_px, odd, watch))?;
        let Coloured {
            mesh,
            painted,
            photographs,
            gains,
        } = found;
        self.gain_of = (photographs.iter())
            .map(|p| (p.view, p.photograph.gain))
            .collect();
        self.gains = gains;
        self.carved.mesh = mesh;
        self.painted = Some(painted);
        self.photographs = photographs;
        Ok(())
    }

    /// The carved hull as a model.
    pub(crate) fn model(&self) -> Loaded {
        Loaded {
            mesh: self.carved.mesh.clone(),
            name: self.capture.name.clone(),
            warnings: Vec::new(),
        }
    }

    pub(crate) fn masks(&self) -> Vec<MaskJson> {
        let pairs = self.capture.views.iter().zip(&self.carved.residuals);
        pairs
            .enumerate()
            .map(|(v, (view, residual))| MaskJson {
                gain: self.gain_of.get(&v).copied(),
                name: view.name.clone(),
                camera: view.camera.to_matrix(),
                size: [view.camera.width, view.camera.height],
                overlap: residual.map(|r| r.overlap),
                outvoted: residual.map(|r| r.outvoted),
                missing: residual.map(|r| r.missing),
            })
            .collect()
    }

    fn names(&self, views: &[usize]) -> Vec<&str> {
        let name = |&view: &usize| self.capture.views[view].name.as_str();
        views.iter().map(name).collect()
    }

    /// Views whose masks or cameras disagree with the rest.
    pub(crate) fn disagree(&self) -> Vec<&str> {
        self.names(&disagreeing(&self.carved.residuals))
    }

    /// Views that have no vote.
    pub(crate) fn left_out(&self) -> Vec<&str> {
        self.names(&self.carved.left_out)
    }

    /// Views, those with a mask, and those with a photograph, in a few words.
    pub(crate) fn counts(&self) -> String {
        format!(
            "{} views, {} with a mask, {} with a photograph",
            self.capture.listed,
            self.capture.views.len(),
            self.taken()
        )
    }

    /// How many views with a mask have a photograph.
    pub(crate) fn taken(&self) -> usize {
        let views = self.capture.views.iter();
        views.filter(|v| v.photo.is_some()).count()
    }

    pub(crate) fn overlap(&self) -> OverlapJson {
        let overlaps = || self.carved.residuals.iter().flatten().map(|r| r.overlap);
        OverlapJson {
            smallest: overlaps().min_by(f64::total_cmp),
            median: median(overlaps()),
        }
    }

    /// The photographs' own silhouettes, and the photographs, of which none is left here.
    ///
    /// # Errors
    /// When interrupted.
    pub(crate) fn photographed(&mut self) -> anyhow::Result<Photographed> {
        let (silhouettes, wider) = Progress::new()
            .watch(|watch| silhouettes_with_room(&self.capture, &self.carved, watch))?;
        let photographs = std::mem::take(&mut self.photographs).into_iter();
        Ok(Photographed {
            silhouettes,
            photographs: photographs.map(|view| view.photograph).collect(),
            wider: Some(wider),
        })
    }

    /// What is printed with an asset that has this map.
    pub(crate) fn json(&self, map: &SilhouetteMap) -> CaptureJson {
        let is_seen = |v: &&CapturedView| v.photographed.is_some_and(|share| share > 0.0);
        let views_seen = map.views.iter().filter(is_seen).count();
        CaptureJson {
            views_seen,
            views_closed: map.views.len() - views_seen,
            covered: map.covered_on_average(),
            masks: self.masks(),
            overlap: self.overlap(),
            outvoted: self.carved.outvoted,
            voxel: self.carved.voxel,
            photographs: self.painted.map_or(0, |p| p.photographs),
            painted: self.painted.map_or(0.0, |p| p.seen),
            gains: self.gains.map(|range| GainsJson {
                smallest: range.smallest,
                largest: range.largest,
            }),
        }
    }

    /// The agreement of hull and masks, in a few words.
    pub(crate) fn describe(&self) -> String {
        let overlap = self.overlap();
        let shown =
            |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
        format!(
            "{} masks overlap the carved hull by {} at least and {} in the median, {} outvoted",
            self.capture.views.len(),
            shown(overlap.smallest),
            shown(overlap.median),
            match self.carved.outvoted {
                0 => "none".to_owned(),
                k => format!("up to {k}"),
            }
        )
    }
}
