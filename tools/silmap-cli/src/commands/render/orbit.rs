//! `silmap render --orbit`: pictures of a whole turn, as numbered files or as one animation.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::error::ErrorKind;
use serde::Serialize;
use silmap_geometry::{ColourImage, Stage};
use silmap_report::animation::{
    Animation, AnimationFormat, AnimationParams, FrameRate, MOST_WEBP_SIDE_PX,
};

use super::check_backdrop;
use super::drawer::{Drawer, Inputs};
use crate::args::{RenderArgs, usage_error};
use crate::frame_names::Naming;
use crate::names::PictureKind;
use crate::output::{self, OutputFile, StagedFile, Staging};
use crate::pictures::encode_picture;
use crate::progress::Progress;
use crate::turn::Turn;

const STAGE: Stage = Stage("drawing a turn");

/// Frames per second where nothing says another.
const USUAL_RATE: f64 = 25.0;

#[derive(Serialize)]
struct Turned<'a> {
    /// One for each frame, or the animation.
    files: &'a [PathBuf],
    /// Of all files.
    bytes: u64,
    frames: u32,
    /// Of reading, drawing and writing.
    seconds: f64,
    width: u32,
    height: u32,
    /// Frames per second of an animation.
    #[serde(skip_serializing_if = "Option::is_none")]
    fps: Option<f64>,
    /// The graphics adapter and the interface it is driven through.
    adapter: String,
    /// Where each frame is seen from.
    eyes: Vec<[f64; 3]>,
    /// What is up in all of them.
    up: [f64; 3],
}

/// How frames are kept.
#[derive(Clone, Copy, Debug)]
enum Kept {
    /// A file for each.
    Each(PictureKind),
    /// All in one.
    Animated(AnimationParams),
}

pub(super) fn run(args: &RenderArgs, frames: u32) -> anyhow::Result<()> {
    let started = Instant::now();
    let (paths, kept) = what_is_kept(args, frames)?;
    let files = (paths.iter())
        .map(|path| OutputFile::check(path))
        .collect::<anyhow::Result<Vec<_>>>()?;
    for input in [&args.asset, &args.model].into_iter().flatten() {
        files.iter().for_each(|file| file.refuse_to_replace(input));
    }
    let inputs = Inputs::read(args)?;
    let Some(eye) = args.camera.eye else {
        refuse_camera();
    };
    let turn = Turn::new(&args.camera, eye, &inputs.scene()?, frames)?;
    let mut drawer = Drawer::open(&inputs)?;
    let mut staging = Staging::default();
    let mut staged = match kept {
        Kept::Animated(_) => files.first().map(OutputFile::begin).transpose()?,
        Kept::Each(_) => None,
    };
    let mut sink = Sink::new((&args.out, &files), kept, staged.as_mut())?;
    Progress::new().watch(|watch| {
        watch.start(STAGE, frames.into());
        for camera in &turn.cameras {
            watch.check()?;
            let (picture, _) = drawer.draw(*camera, args.background.into())?;
            sink.take(&picture, &mut staging)?;
            watch.advance(STAGE, 1);
        }
        watch.finish(STAGE);
        anyhow::Ok(())
    })?;
    let mut bytes = sink.finish()?;
    if let Some(file) = staged {
        bytes += staging.keep(file)?;
    }
    staging.publish()?;
    if args.output.json {
        let (width, height) = args.camera.size_px();
        return output::print_json(&Turned {
            files: &paths,
            bytes,
            frames,
            seconds: started.elapsed().as_secs_f64(),
            width,
            height,
            fps: match kept {
                Kept::Each(_) => None,
                Kept::Animated(params) => Some(params.rate.per_second()),
            },
            adapter: drawer.adapter_name(),
            eyes: turn.eyes.iter().map(|eye| eye.to_array()).collect(),
            up: turn.up.to_array(),
        });
    }
    output::say(&format!(
        "{}: {frames} frames, {bytes} bytes, drawn by {}",
        args.out.display(),
        drawer.adapter_name()
    ));
    Ok(())
}

/// Ends the program for a camera that cannot be turned.
fn refuse_camera() -> ! {
    usage_error(
        ErrorKind::ArgumentConflict,
        "the argument '--orbit <N>' cannot be used with '--camera <FILE>', which stands where the photograph was taken: a turn begins at '--eye <X,Y,Z>'",
    );
}

/// The files that will be there, and what is in them. Ends the program when options do not go together.
fn what_is_kept(args: &RenderArgs, frames: u32) -> anyhow::Result<(Vec<PathBuf>, Kept)> {
    if args.camera.captured.camera.is_some() {
        refuse_camera();
    }
    let refuse = |sentence: &str| -> ! { usage_error(ErrorKind::ArgumentConflict, sentence) };
    let shown = args.out.display();
    let naming = match Naming::of(&args.out) {
        Ok(naming) => naming,
        Err(error) => usage_error(ErrorKind::ValueValidation, &error.to_string()),
    };
    let kind = match &naming {
        Naming::Numbered(names) => PictureKind::of(&names.path(0)),
        Naming::Single(path) => PictureKind::of(path),
    }?;
    let size_px = args.camera.size_px();
    if kind == PictureKind::Webp && size_px.0.max(size_px.1) > MOST_WEBP_SIDE_PX {
        refuse(&format!(
            "{shown}: a WebP picture has at most {MOST_WEBP_SIDE_PX} pixels a side: choose a smaller --size, or .png"
        ));
    }
    check_backdrop(args, kind)?;
    let path = match naming {
        Naming::Numbered(names) => {
            if args.turn.fps.is_some() || args.turn.quality.is_some() {
                refuse(&format!(
                    "{shown}: '--fps <RATE>' and '--quality <Q>' are of use with an animation only, whose name has no number of a frame"
                ));
            }
            let paths = (0..frames).map(|frame| names.path(frame)).collect();
            return Ok((paths, Kept::Each(kind)));
        }
        Naming::Single(path) => path,
    };
    let format = match (kind, args.turn.quality) {
        (PictureKind::Webp, quality) => AnimationFormat::Webp(quality),
        (PictureKind::Png, None) => AnimationFormat::Apng,
        (PictureKind::Png, Some(_)) => refuse(&format!(
            "{shown}: '--quality <Q>' is of use with an animated .webp only, as PNG loses nothing"
        )),
        (PictureKind::Jpeg, _) => refuse(&format!(
            "{shown}: a JPEG file holds one picture: give it a name with a frame's number, such as turn-%04d.jpg, or one that ends in .webp or .png"
        )),
    };
    let usual = || FrameRate::new(USUAL_RATE).context("the usual rate is one of those there are");
    let params = AnimationParams {
        format,
        size_px,
        frames,
        rate: args.turn.fps.map_or_else(usual, Ok)?,
    };
    Ok((vec![path], Kept::Animated(params)))
}

/// Takes frames in their order.
enum Sink<'a> {
    Each {
        files: std::slice::Iter<'a, OutputFile>,
        kind: PictureKind,
        bytes: u64,
    },
    Animated {
        animation: Box<Animation<&'a mut StagedFile>>,
        out: &'a Path,
    },
}

impl<'a> Sink<'a> {
    /// An animation goes to `staged`.
    fn new(
        (out, files): (&'a Path, &'a [OutputFile]),
        kept: Kept,
        staged: Option<&'a mut StagedFile>,
    ) -> anyhow::Result<Self> {
        Ok(match kept {
            Kept::Each(kind) => Self::Each {
                files: files.iter(),
                kind,
                bytes: 0,
            },
            Kept::Animated(params) => {
                let file = staged.context("an animation has a file")?;
                let animation = Animation::new(file, &params);
                let animation = animation.with_context(|| out.display().to_string())?;
                Self::Animated {
                    animation: Box::new(animation),
                    out,
                }
            }
        })
    }

    fn take(&mut self, picture: &ColourImage, staging: &mut Staging) -> anyhow::Result<()> {
        match self {
            Self::Each { files, kind, bytes } => {
                let file = files.next().context("a frame has no file")?;
                let encoded = encode_picture(picture, *kind)?;
                *bytes += encoded.len() as u64;
                staging.add(file, &encoded)
            }
            Self::Animated { animation, out } => {
                let pushed = animation.push(picture);
                pushed.with_context(|| out.display().to_string())
            }
        }
    }

    /// Ends an animation; returns the bytes of files of single frames.
    fn finish(self) -> anyhow::Result<u64> {
        match self {
            Self::Each { bytes, .. } => Ok(bytes),
            Self::Animated { animation, out } => {
                let finished = animation.finish();
                finished.with_context(|| out.display().to_string())?;
                Ok(0)
            }
        }
    }
}
