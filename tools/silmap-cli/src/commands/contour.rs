//! `silmap contour`: the interpolated outline as numbers, as a drawing, or as a mask.

use std::fmt::Write;
use std::io::IsTerminal;
use std::time::Instant;

use anyhow::{Context, bail};
use serde::Serialize;
use silmap_geometry::polygon::fill_non_zero;
use silmap_geometry::{Loop, Mask};
use silmap_map::{Detail, Interpolation, MapReader, outline};

use crate::args::{ContourArgs, ContourFormat, MethodArg};
use crate::camera::{CameraJson, PictureCamera};
use crate::captured_camera;
use crate::files::read_asset;
use crate::output::{self, OutputFile};
use crate::pictures::encode_mask_png;
use crate::scene::Scene;

/// Calls that are timed; an odd number has a middle one.
const TIMED_CALLS: usize = 9;

#[derive(Serialize)]
struct ContourJson<'a> {
    method: &'a str,
    camera: CameraJson,
    triangle: [u32; 3],
    barycentric: [f64; 3],
    /// How much of the outline rests on photographs, from 0 to 1; null where the map is of a mesh.
    covered: Option<f64>,
    /// Level of detail of the contours that were interpolated.
    level: u8,
    loops: Vec<Vec<[f64; 2]>>,
    /// Of the interpolation alone with warm buffers, the median of some calls.
    seconds: f64,
}

pub(crate) fn run(args: &ContourArgs) -> anyhow::Result<()> {
    captured_camera::refuse_up(&args.camera);
    let is_json_printed =
        args.output.json || (args.out.is_none() && args.format == ContourFormat::Json);
    if !is_json_printed
        && args.out.is_none()
        && args.format == ContourFormat::Png
        && std::io::stdout().is_terminal()
    {
        bail!("a picture is not for the terminal: add -o IMG.png");
    }
    let file = args.out.as_deref().map(OutputFile::check).transpose()?;
    if let Some(file) = &file {
        file.refuse_to_replace(&args.asset);
    }
    let (asset, _) = read_asset(&args.asset)?;
    let map = &asset.map;
    let scene = Scene::of(&asset);
    let seen = PictureCamera::from_args(&args.camera, &scene)?;
    if let (Some(file), Some(captured)) = (&file, &seen.captured) {
        captured.refuse_to_be_replaced_by(file);
    }
    let camera = seen.camera;
    let named = || args.asset.display().to_string();
    let mut scratch = MapReader::new(map).with_context(named)?;
    // The first call fills the buffers that later ones, a frame each, find warm.
    let method = MethodArg::resolve(args.interpolation.method, map);
    let how = Interpolation {
        detail: args.detail.map_or(Detail::OnScreen, Detail::Level),
        ..Interpolation::from(method)
    };
    let outline = outline(map, &camera, how, &mut scratch).with_context(named)?;
    let mut times = Vec::with_capacity(TIMED_CALLS);
    for _ in 0..TIMED_CALLS {
        let since = Instant::now();
        scratch.interpolate(map, &camera, how).with_context(named)?;
        times.push(since.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let seconds = times[TIMED_CALLS / 2];

    let loops = seen.loops(outline.simple_loops());
    let as_json = || ContourJson {
        method: method.name(),
        camera: seen.json(&scene),
        triangle: map.triangles[outline.triangle as usize],
        barycentric: outline.barycentric,
        covered: map.covered(outline.triangle, outline.barycentric),
        level: outline.level,
        loops: loops_json(&loops),
        seconds,
    };
    if let Some(file) = &file {
        file.write(&encode(args.format, seen.size(), &loops, as_json)?)?;
        if !is_json_printed {
            let (loops, millis) = (loops.len(), 1e3 * seconds);
            output::say(&format!("{}: {loops} loops in {millis:.3} ms", named()));
        }
    }
    match (is_json_printed, file) {
        (true, _) => output::print_json(&as_json()),
        (false, Some(_)) => Ok(()),
        (false, None) => output::print_bytes(&encode(args.format, seen.size(), &loops, as_json)?),
    }
}

fn encode<'a>(
    format: ContourFormat,
    size: (u32, u32),
    loops: &[Loop],
    as_json: impl FnOnce() -> ContourJson<'a>,
) -> anyhow::Result<Vec<u8>> {
    match format {
        ContourFormat::Json => Ok(serde_json::to_vec(&as_json())?),
        ContourFormat::Svg => Ok(svg(size, loops).into_bytes()),
        ContourFormat::Png => png(size, loops),
    }
}

fn loops_json(loops: &[Loop]) -> Vec<Vec<[f64; 2]>> {
    loops
        .iter()
        .map(|points| points.iter().map(|p| p.to_array()).collect())
        .collect()
}

/// One path with all loops: holes run against outer loops, so any fill rule shows them.
fn svg((width, height): (u32, u32), loops: &[Loop]) -> String {
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\">\n<path fill=\"#333\" d=\""
    );
    for points in loops {
        for (k, point) in points.iter().enumerate() {
            let verb = if k == 0 { 'M' } else { 'L' };
            // Writing into a string cannot fail. A thousandth of a pixel is finer than anything captured.
            let _ = write!(text, "{verb}{:.3} {:.3}", point.x, point.y);
        }
        text.push('Z');
    }
    text.push_str("\"/>\n</svg>\n");
    text
}

/// The filled outline, white on black.
fn png((width, height): (u32, u32), loops: &[Loop]) -> anyhow::Result<Vec<u8>> {
    let mut mask = Mask::new(width, height);
    fill_non_zero(loops, &mut mask);
    encode_mask_png(&mask)
}
