//! Timing everything that gives an outline or a picture, row by row, at the same viewpoints and on the same machine.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 7, tables 1 and 2.

use std::time::Instant;

use glam::DVec3;
use silmap_exact::{EdgeMesh, ExtractionMethod};
use silmap_geometry::Watch;
use silmap_geometry::polygon::fill_even_odd;
use silmap_geometry::{Camera, Loop, Mask, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_map::asset::AssetSizes;
use silmap_map::{Asset, Interpolation, MapReader, Method};
use silmap_study::{Antialias, FrameParams, Mode, Paint};

use crate::MeasureError;
use frames::{Region, params};
use rows::Truth;

mod frames;
mod rows;
mod searches;

pub(crate) use frames::{Drawer, Look, params as picture_params};
pub use rows::Row;
pub(crate) use searches::{Search, SearchTimes};

/// What is measured.
#[derive(Debug)]
pub struct Bench<'a> {
    /// The model.
    pub full: &'a TriangleMesh,
    /// The mesh simplified to the hull's faces, drawn beside it.
    pub simplified: Option<&'a TriangleMesh>,
    /// Its asset.
    pub asset: &'a Asset,
    /// Bytes of the asset's file.
    pub sizes: AssetSizes,
    /// One after the other around the model, for each frame as many as it has instances.
    pub cameras: Vec<Camera>,
    /// Instances drawn in a frame.
    pub instances: usize,
    /// Methods of extraction to time.
    pub extractions: Vec<ExtractionMethod>,
    /// Asked now and then whether to stop.
    pub watch: &'a Watch<'a>,
}

/// Frames that take long are drawn for this many seconds alone: the row says how many there were.
const MOST_ROW_SECONDS: f64 = 20.0;

/// Seconds for a frame of the mesh, of the hull alone, of the hull clipped to the outline interpolated by the best method, and of the
/// hull clipped to what each search finds.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameTimes {
    pub(crate) full: f64,
    pub(crate) hull: f64,
    pub(crate) interpolated: f64,
    pub(crate) exact: Vec<f64>,
}

impl FrameTimes {
    /// The lesser of two times of each kind.
    pub(crate) fn least(mut self, other: &Self) -> Self {
        self.full = self.full.min(other.full);
        self.hull = self.hull.min(other.hull);
        self.interpolated = self.interpolated.min(other.interpolated);
        for (mine, theirs) in self.exact.iter_mut().zip(&other.exact) {
            *mine = mine.min(*theirs);
        }
        self
    }
}

impl Bench<'_> {
    /// Measures all rows; also says whether the device's own clock was read.
    ///
    /// # Errors
    /// When interrupted, the mesh is not manifold, the map is broken or the device fails.
    pub fn run(&self, gpu: &Gpu) -> Result<(Vec<Row>, bool), MeasureError> {
        let truths = Truth::at_some(self.full, &self.cameras)?;
        let mut rows = self.time_contours(&truths)?;
        let edge_mesh = EdgeMesh::new(self.full)?;
        let eyes: Vec<DVec3> = self.cameras.iter().map(|c| c.eye).collect();
        let mut searches = Vec::new();
        for &method in &self.extractions {
            let mut search = Search::new(&edge_mesh, method, self.watch)?;
            let times = search.time(&eyes, self.watch)?;
            rows.push(Row::of_search(&search, self.full.faces.len(), times));
            searches.push(search);
        }
        let mut drawer = self.drawer(gpu)?;
        self.time_frames(&mut drawer, &truths, searches, &mut rows)?;
        Ok((rows, drawer.has_timestamps()))
    }

    /// The rows of interpolation alone.
    ///
    /// # Errors
    /// When interrupted, or the map is broken.
    pub(crate) fn contour_rows(&self) -> Result<Vec<Row>, MeasureError> {
        self.time_contours(&Truth::at_some(self.full, &self.cameras)?)
    }

    fn time_contours(&self, truths: &[Truth]) -> Result<Vec<Row>, MeasureError> {
        let mut rows = Vec::new();
        let map = &self.asset.map;
        let mut reader = MapReader::new(map)?;
        for method in Method::all_for(map) {
            let mut times = Vec::new();
            // The first round fills buffers that a frame finds warm.
            for is_timed in [false, true] {
                for camera in &self.cameras {
                    self.watch.check()?;
                    let since = Instant::now();
                    reader.interpolate(map, camera, Interpolation::from(method))?;
                    if is_timed {
                        times.push(since.elapsed().as_secs_f64());
                    }
                }
            }
            let mut errors = Vec::new();
            for truth in truths {
                let outline = silmap_map::outline(map, &truth.camera, method, &mut reader)?;
                let mut mask = Mask::new(truth.camera.width_px, truth.camera.height_px);
                fill_even_odd::<&Loop>(outline.simple_loops(), &mut mask);
                errors.push(truth.errors_of(&mask));
            }
            let row = Row::new(format!("contour-{}", method.name()), None, self.sizes.map);
            rows.push(row.with_times(times.clone(), times).with_errors(&errors));
        }
        Ok(rows)
    }

    /// Seconds for frames alone, processor and device one after the other.
    ///
    /// # Errors
    /// When interrupted, or the device fails.
    pub(crate) fn frame_times(
        &self,
        drawer: &mut Drawer<'_>,
        searches: &mut [Search<'_>],
    ) -> Result<FrameTimes, MeasureError> {
        let best = Method::best_for(&self.asset.map);
        let mut seconds = |mode, region: &mut Region<'_, '_>| {
            let row = Row::new(String::new(), None, 0);
            let how = Look::new(mode, best, Antialias::None);
            let row = self.time_row(drawer, &[], (row, how), region)?;
            Ok::<_, MeasureError>(row.frame_seconds())
        };
        Ok(FrameTimes {
            full: seconds(Mode::Original, &mut Region::Own)?,
            hull: seconds(Mode::Textured, &mut Region::Own)?,
            interpolated: seconds(Mode::Clipped, &mut Region::Own)?,
            exact: (searches.iter_mut())
                .map(|search| {
                    search.extractor.forget();
                    seconds(Mode::Exact, &mut Region::Exact(&mut search.extractor))
                })
                .collect::<Result<_, MeasureError>>()?,
        })
    }

    /// What draws frames of the model and the asset.
    ///
    /// # Errors
    /// When the device fails.
    pub(crate) fn drawer<'g>(&self, gpu: &'g Gpu) -> Result<Drawer<'g>, MeasureError> {
        let size = (self.cameras.first()).map_or((1, 1), |c| (c.width_px, c.height_px));
        Drawer::new(gpu, size, self.asset, self.full)
    }

    fn time_frames(
        &self,
        drawer: &mut Drawer<'_>,
        truths: &[Truth],
        searches: Vec<Search<'_>>,
        rows: &mut Vec<Row>,
    ) -> Result<(), MeasureError> {
        let best = Method::best_for(&self.asset.map);
        let faces = self.full.faces.len();
        let hull_faces = self.asset.hull.faces.len();
        // As the renderer keeps them: positions and normals, and three indices a face.
        let bytes_of = |m: &TriangleMesh| (36 * m.positions.len() + 12 * m.faces.len()) as u64;
        let full_bytes = bytes_of(self.full);
        if let Some(simple) = self.simplified {
            drawer.renderer.load_model(drawer.gpu, simple)?;
            let name = "simplified".to_owned();
            let row = Row::new(name, Some(simple.faces.len()), bytes_of(simple));
            let how = Look::new(Mode::Original, best, Antialias::None);
            rows.push(self.time_row(drawer, truths, (row, how), &mut Region::Own)?);
            drawer.renderer.load_model(drawer.gpu, self.full)?;
        }
        let painted = self.sizes.hull + self.sizes.textures;
        let mut plan = vec![
            (
                Row::new("full".to_owned(), Some(faces), full_bytes),
                Look::new(Mode::Original, best, Antialias::None),
            ),
            (
                Row::new("hull".to_owned(), Some(hull_faces), painted),
                Look::new(Mode::Textured, best, Antialias::None),
            ),
        ];
        for method in Method::all_for(&self.asset.map) {
            for (antialias, name) in [
                (Antialias::None, "none"),
                (Antialias::Soft, "soft"),
                (Antialias::Msaa, "msaa"),
            ] {
                let name = format!("clipped-{}-{name}", method.name());
                plan.push((
                    Row::new(name, Some(hull_faces), self.sizes.total),
                    Look::new(Mode::Clipped, method, antialias),
                ));
            }
        }
        if self.asset.textures.relief.is_some() {
            let name = format!("relief-{}-soft", best.name());
            let look = Look {
                paint: Paint::Relief,
                ..Look::new(Mode::Clipped, best, Antialias::Soft)
            };
            plan.push((Row::new(name, Some(hull_faces), self.sizes.total), look));
        }
        for (row, how) in plan {
            rows.push(self.time_row(drawer, truths, (row, how), &mut Region::Own)?);
        }
        for mut search in searches {
            let bytes = painted + search.extractor.data_bytes() as u64;
            let row = Row::new(format!("exact-{}", search.method), Some(hull_faces), bytes);
            let how = Look::new(Mode::Exact, best, Antialias::None);
            search.extractor.forget();
            let mut region = Region::Exact(&mut search.extractor);
            rows.push(self.time_row(drawer, truths, (row, how), &mut region)?);
        }
        Ok(())
    }

    fn time_row(
        &self,
        drawer: &mut Drawer<'_>,
        truths: &[Truth],
        (row, look): (Row, Look),
        region: &mut Region<'_, '_>,
    ) -> Result<Row, MeasureError> {
        let (mut device, mut processor) = (Vec::new(), Vec::new());
        let frames = self.cameras.chunks(self.instances.max(1));
        let started = Instant::now();
        // The first frame makes pipelines and grows buffers.
        for (k, cameras) in frames.clone().take(1).chain(frames).enumerate() {
            self.watch.check()?;
            let frame: Vec<FrameParams> = (cameras.iter())
                .map(|&camera| params(camera, look))
                .collect();
            let (on_device, on_processor) = drawer.frame(&frame, region, self.full)?;
            if k > 0 {
                device.push(on_device);
                processor.push(on_processor);
                if started.elapsed().as_secs_f64() > MOST_ROW_SECONDS {
                    break;
                }
            }
        }
        let mut errors = Vec::new();
        for truth in truths {
            self.watch.check()?;
            let frame = params(truth.camera, look);
            let mask = drawer.mask(&frame, region, self.full)?;
            errors.push(truth.errors_of(&mask));
        }
        Ok(row.with_times(device, processor).with_errors(&errors))
    }
}
