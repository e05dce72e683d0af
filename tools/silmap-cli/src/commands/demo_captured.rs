//! `silmap demo --captured`: from photographs to an asset, where the truth is known.
//!
//! The photographs are made of the demo's model, with exposures that differ and masks that are a little off, as a capture's are. Nothing
//! else of the model goes into the asset; it is what the asset is compared with at the end.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;
use silmap_capture::Pinhole;
use silmap_geometry::{Bvh, Camera, ClosedMesh, ColourImage, TriangleMesh};
use silmap_gpu::Gpu;
use silmap_map::{Asset, MapReader, Method, asset};
use silmap_measure::evaluate::{Comparison, compare};
use silmap_mesh_io as mesh_io;
use silmap_preprocess::pipeline::BuildParams;
use silmap_preprocess::texture::TextureParams;
use silmap_study::{Background, FrameParams, Mode, PictureOptions, PictureRenderer};

use crate::args::{CarveArgs, DemoArgs, ModelKind};
use crate::commands::build::build_watched;
use crate::commands::captured::CarvedCapture;
use crate::commands::generate::generate;
use crate::commands::{demo, open_gpu};
use crate::interrupt;
use crate::made_capture::{self, Exposure, MadeView, Photographer};
use crate::names::PictureKind;
use crate::output::{self, OutputFolder};
use crate::pictures::{beside, encode_mask_png, encode_picture, encode_png, stacked};
use crate::progress::Progress;

/// Faces of the model that is photographed.
const MODEL_FACES: usize = 40_000;
/// Views of the map, fewer than by default to end sooner.
const VIEWS: u32 = 480;
/// Views that are kept.
const KEEP: u32 = 160;
/// Side of the pictures that outlines are compared in, pixels.
const COMPARED_PX: u32 = 512;
/// Eyes in between the photographs' that outlines are compared at.
const BETWEEN: usize = 24;
/// Pictures in a strip, and the side of each, pixels.
const STRIP: usize = 6;
const STRIP_PX: u32 = 320;
/// Distance of the eyes in between, bounding radii.
const DISTANCE_RADII: f64 = 4.2;

/// Misclassified pixels over those inside the true outline.
#[derive(Clone, Copy, Debug, Serialize)]
struct Shares {
    mean: f64,
    max: f64,
}

/// What outlines are off by at some viewpoints.
#[derive(Clone, Copy, Debug, Serialize)]
struct Errors {
    viewpoints: usize,
    /// Of the carved hull.
    carved: Shares,
    /// Of the asset.
    asset: Shares,
}

#[derive(Serialize)]
struct CapturedDemoJson {
    /// The capture: `cameras.json`, `images` and `masks`.
    capture: PathBuf,
    asset: PathBuf,
    model: PathBuf,
    /// The model, the asset and their difference from eyes between the photographs'.
    between: PathBuf,
    /// The same from the photographs' own eyes.
    photographed: PathBuf,
    views: usize,
    /// Views whose masks have a bite out or a blob added.
    spoiled: Vec<String>,
    /// Views whose masks disagree with the rest, as `build --check` names them.
    disagree: Vec<String>,
    errors: ErrorsJson,
    /// Mean difference of colours inside both outlines, of 255, over the strip of eyes in between.
    colour_difference: f64,
    bytes: usize,
    seconds: f64,
}

#[derive(Serialize)]
struct ErrorsJson {
    /// What they are shares of.
    over: &'static str,
    at_photographs: Errors,
    between: Errors,
}

pub(crate) fn run(args: &DemoArgs) -> anyhow::Result<()> {
    let started = Instant::now();
    let folder = OutputFolder::check_with_parents(&args.out)?;
    let gpu = open_gpu()?;
    let truth = ClosedMesh::try_from(generate(ModelKind::Organic, MODEL_FACES))
        .context("the demo's model")?;
    let truth = truth.into_mesh();
    let spoil = args.spoil.map_or(0.0, |share| share.0);
    let views = Progress::new().watch(|watch| made_capture::make(&truth, spoil, watch))?;
    let capture = args.out.join("capture");
    write_capture(&capture, &views)?;

    // From here on as for photographs that somebody took.
    let textures = TextureParams::default();
    let mut carved = CarvedCapture::of(&capture, &CarveArgs::default(), textures.size_px)?;
    let params = BuildParams {
        textures,
        resolution_px: silmap_capture::fitting_resolution_px(&carved.capture),
        ..demo::params(VIEWS, KEEP)
    };
    let seen = carved.photographed()?;
    let model = carved.model();
    let (asset, _) = build_watched(&model, &seen, &params).context("the demo's capture")?;
    drop(seen);
    let bytes = asset::write(&asset)?;

    let truth_there = moved(&truth, -model.mesh.origin());
    let meshes = (&truth_there, model.mesh.mesh());
    let eyes = Eyes::of(&views, &asset, model.mesh.origin());
    let errors = ErrorsJson {
        over: "pixels inside the true outline",
        at_photographs: errors(&asset, meshes, &eyes.photographs)?,
        between: errors(&asset, meshes, &eyes.between)?,
    };
    let tree = Bvh::new(&truth_there);
    let mut strips = Strips::new(&gpu, &asset, (&truth_there, &tree))?;
    let (between, colour_difference) = strips.draw(&eyes.between)?;
    let (photographed, _) = strips.draw(&eyes.photographs)?;
    let spoiled = views.iter().filter(|v| v.is_spoiled);
    // The full path, to be clicked on; as typed where the system does not know it.
    let shown = fs::canonicalize(&args.out).unwrap_or_else(|_| args.out.clone());
    let result = CapturedDemoJson {
        capture: shown.join("capture"),
        asset: shown.join("organic.glb"),
        model: shown.join("organic.ply"),
        between: shown.join("between.png"),
        photographed: shown.join("photographed.png"),
        views: views.len(),
        spoiled: spoiled.map(|v| v.name.clone()).collect(),
        disagree: carved.disagree().into_iter().map(str::to_owned).collect(),
        errors,
        colour_difference,
        bytes: bytes.len(),
        seconds: started.elapsed().as_secs_f64(),
    };
    folder.write(&[
        (
            "organic.ply",
            &mesh_io::encode(Path::new("organic.ply"), &truth)?,
        ),
        ("organic.glb", &bytes),
        ("between.png", &encode_png(&between)?),
        ("photographed.png", &encode_png(&photographed)?),
        ("errors.json", &serde_json::to_vec_pretty(&result.errors)?),
    ])?;
    tell(args, &result)
}

/// Puts a capture into a folder of its own. The camera file comes last, so that a capture without it is none.
fn write_capture(path: &Path, views: &[MadeView]) -> anyhow::Result<()> {
    let encoded = (views.par_iter())
        .map(|view| {
            let photograph = encode_picture(&view.photograph, PictureKind::Jpeg)?;
            Ok((photograph, encode_mask_png(&view.mask)?))
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let named = |ending: &str| -> Vec<String> {
        views
            .iter()
            .map(|v| format!("{}.{ending}", v.name))
            .collect()
    };
    let (images, masks) = (named("jpg"), named("png"));
    let of_images = images
        .iter()
        .zip(&encoded)
        .map(|(n, e)| (n.as_str(), &e.0[..]));
    let of_masks = masks
        .iter()
        .zip(&encoded)
        .map(|(n, e)| (n.as_str(), &e.1[..]));
    let write = |part: &str, files: &[(&str, &[u8])]| {
        OutputFolder::check_with_parents(&path.join(part))?.write(files)
    };
    write("images", &of_images.collect::<Vec<_>>())?;
    write("masks", &of_masks.collect::<Vec<_>>())?;
    let cameras = made_capture::camera_file("organic", views);
    OutputFolder::check(path)?.write(&[("cameras.json", cameras.as_bytes())])
}

fn moved(mesh: &TriangleMesh, by: DVec3) -> TriangleMesh {
    let mut mesh = mesh.clone();
    for position in &mut mesh.positions {
        *position += by;
    }
    mesh
}

/// Where the asset is compared with the truth, in the asset's coordinates.
struct Eyes {
    photographs: Vec<DVec3>,
    between: Vec<DVec3>,
}

impl Eyes {
    fn of(views: &[MadeView], asset: &Asset, origin: DVec3) -> Self {
        let (center, radius) = (asset.map.center, asset.map.radius);
        let away = |direction: DVec3| center + DISTANCE_RADII * radius * direction;
        Self {
            photographs: views.iter().map(|v| v.camera.eye - origin).collect(),
            between: made_capture::between(BETWEEN)
                .into_iter()
                .map(away)
                .collect(),
        }
    }
}

/// How far the outlines of the carved hull and of the asset are off.
fn errors(
    asset: &Asset,
    (truth, carved): (&TriangleMesh, &TriangleMesh),
    eyes: &[DVec3],
) -> anyhow::Result<Errors> {
    let method = Method::best_for(&asset.map);
    let mut reader = MapReader::new(&asset.map)?;
    let mut found = Vec::new();
    for &eye in eyes {
        interrupt::check()?;
        let of = |mesh| Comparison::new(eye, &asset.map, mesh, COMPARED_PX);
        let (true_view, carved_view) = (of(truth)?, of(carved)?);
        let drawn = true_view.predict(&asset.map, method.into(), &mut reader)?;
        let share = |mask| compare(mask, &true_view.truth).0;
        found.push([share(&carved_view.truth), share(&drawn)]);
    }
    let shares = |k: usize| Shares {
        mean: found.iter().map(|f| f[k]).sum::<f64>() / found.len().max(1) as f64,
        max: found.iter().map(|f| f[k]).fold(0.0, f64::max),
    };
    Ok(Errors {
        viewpoints: eyes.len(),
        carved: shares(0),
        asset: shares(1),
    })
}

/// Draws the model as it is photographed, the asset below it, and where their outlines differ.
struct Strips<'a> {
    gpu: &'a Gpu,
    asset: &'a Asset,
    truth: &'a TriangleMesh,
    photographer: Photographer<'a>,
    renderer: PictureRenderer,
}

impl<'a> Strips<'a> {
    /// `tree` is over the faces of `truth`.
    fn new(
        gpu: &'a Gpu,
        asset: &'a Asset,
        (truth, tree): (&'a TriangleMesh, &'a Bvh),
    ) -> anyhow::Result<Self> {
        let mut renderer = PictureRenderer::new(gpu, PictureOptions::default());
        renderer.load_asset(gpu, asset)?;
        renderer.load_model(gpu, truth)?;
        Ok(Self {
            gpu,
            asset,
            truth,
            photographer: Photographer::new(truth, tree),
            renderer,
        })
    }

    /// A strip of some of these eyes, and the mean difference of colours where both show the object, of 255.
    fn draw(&mut self, eyes: &[DVec3]) -> anyhow::Result<(ColourImage, f64)> {
        let (mut rows, mut off) = ([const { Vec::new() }; 3], (0.0, 0_u64));
        for k in 0..STRIP {
            let map = &self.asset.map;
            let eye = eyes[k * eyes.len() / STRIP];
            let size = (STRIP_PX, STRIP_PX);
            let camera = Camera::fit_sphere(eye, map.center, map.radius, None, size)?;
            let pinhole = pinhole_of(&camera)?;
            let photograph = self.photographer.photograph(&pinhole, &Exposure::plain());
            let drawn = self.render(&camera, Mode::Clipped, Background::Transparent)?;
            let truth = Comparison::new(eye, map, self.truth, STRIP_PX)?.truth;
            for (p, (a, b)) in (photograph.rgba.chunks(4).zip(drawn.rgba.chunks(4))).enumerate() {
                let (x, y) = (p as u32 % STRIP_PX, p as u32 / STRIP_PX);
                if b[3] < 255 || !truth.get(x.into(), y.into()) {
                    continue;
                }
                off.0 += (0..3)
                    .map(|c| f64::from(a[c].abs_diff(b[c])) / 3.0)
                    .sum::<f64>();
                off.1 += 1;
            }
            let white = Background::Colour([255; 3]);
            rows[0].push(photograph);
            rows[1].push(self.render(&camera, Mode::Clipped, white)?);
            rows[2].push(self.render(&camera, Mode::Difference, white)?);
        }
        let sheets = rows.map(|row| beside(&row.iter().collect::<Vec<_>>()));
        Ok((stacked(&sheets), off.0 / off.1.max(1) as f64))
    }

    fn render(
        &mut self,
        camera: &Camera,
        mode: Mode,
        background: Background,
    ) -> anyhow::Result<ColourImage> {
        interrupt::check()?;
        let params = FrameParams {
            background,
            ..demo::frame(self.asset, *camera, mode)
        };
        Ok(self.renderer.render(self.gpu, &params)?)
    }
}

/// The same camera with its intrinsics in pixels.
fn pinhole_of(camera: &Camera) -> anyhow::Result<Pinhole> {
    let half = 0.5 * camera.size();
    let axes = [camera.right, -camera.up, camera.forward];
    let lens: (DVec2, DVec2) = (half / camera.half_tangent, half);
    let size = (camera.width_px, camera.height_px);
    Ok(Pinhole::from_pose(camera.eye, axes, lens, size)?)
}

fn tell(args: &DemoArgs, result: &CapturedDemoJson) -> anyhow::Result<()> {
    if args.output.json {
        return output::print_json(result);
    }
    let named = |names: &[String]| match names.is_empty() {
        true => "none".to_owned(),
        false => names.join(", "),
    };
    let row = |name: &str, e: &Errors| {
        format!(
            "{name:<30} {:>11.2} % {:>6.2} % {:>9.2} % {:>6.2} %\n",
            100.0 * e.carved.mean,
            100.0 * e.carved.max,
            100.0 * e.asset.mean,
            100.0 * e.asset.max
        )
    };
    let text = format!(
        "{} photographs; masks spoiled: {}; masks that disagree with the rest: {}\n\
         misclassified pixels           carved hull   worst      asset   worst\n{}{}\
         colours in between are off by {:.1} of 255\n\
         done in {:.0} s; look at\n  {}\n  {}\n  {} (opens in any glTF viewer)\n  {} (silmap build --check takes it)\n",
        result.views,
        named(&result.spoiled),
        named(&result.disagree),
        row("from the photographs' eyes", &result.errors.at_photographs),
        row("from eyes in between", &result.errors.between),
        result.colour_difference,
        result.seconds,
        result.between.display(),
        result.photographed.display(),
        result.asset.display(),
        result.capture.display(),
    );
    output::print_bytes(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use silmap_geometry::Mask;

    use super::*;

    #[test]
    fn what_is_written_is_read_as_it_was_made() {
        let folder = tempfile::tempdir().unwrap();
        let view = |k: usize| {
            let turn = 0.7 * k as f64;
            let forward = DVec3::new(turn.sin(), 0.1, turn.cos()).normalize_or_zero();
            let right = forward.cross(DVec3::Y).normalize_or_zero();
            let axes = [right, forward.cross(right), forward];
            let lens = (DVec2::new(90.0, 88.0), DVec2::new(30.0, 21.0));
            let camera = Pinhole::from_pose(-4.0 * forward, axes, lens, (64, 48)).unwrap();
            let mut mask = Mask::new(64, 48);
            for y in 10..20 + k as u32 {
                mask.set_span(y, 20, 40);
            }
            MadeView {
                name: format!("view_{k}"),
                camera,
                photograph: ColourImage {
                    width: 64,
                    height: 48,
                    rgba: vec![100; 64 * 48 * 4],
                },
                mask,
                is_spoiled: false,
            }
        };
        let views: Vec<MadeView> = (0..4).map(view).collect();
        let path = folder.path().join("some/capture");
        write_capture(&path, &views).unwrap();
        let capture = silmap_capture::read(&path).unwrap();
        assert_eq!((capture.views.len(), capture.warnings.len()), (4, 0));
        for (read, made) in capture.views.iter().zip(&views) {
            assert_eq!((&read.name, &read.mask), (&made.name, &made.mask));
            assert!(read.photo.is_some());
            let point = DVec3::new(0.3, -0.2, 0.1);
            let (a, b) = (read.camera.project(point), made.camera.project(point));
            assert!(a.unwrap().0.distance(b.unwrap().0) < 1e-6);
        }
    }
}
