//! Options of `render` for a turn around the model.

use clap::Args;
use silmap_report::animation::FrameRate;

use crate::values::parse_rate;

/// Frames of a turn at most: one for each tenth of a degree.
const MOST_FRAMES: i64 = 3600;

/// A turn around the model.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct OrbitArgs {
    /// Draw N pictures of a whole turn: the eye goes from --eye around --up, through the target, by a part of N each time. They go to
    /// files, where the name has a %d or %04d for the frame's number from 0 on, or into one animated .webp or .png, which repeats for
    /// ever
    #[arg(long, value_name = "N", help_heading = "Turntables", value_parser = clap::value_parser!(u32).range(1..=MOST_FRAMES))]
    pub(crate) orbit: Option<u32>,
    /// Frames per second of an animation, 0.1 to 60 [default: 25]
    #[arg(long, value_name = "RATE", help_heading = "Turntables", requires = "orbit", value_parser = parse_rate)]
    pub(crate) fps: Option<FrameRate>,
    /// Quality of an animated .webp from 0 to 100: 75 takes a seventh of the bytes [default: nothing is lost]
    #[arg(long, value_name = "Q", help_heading = "Turntables", requires = "orbit", value_parser = clap::value_parser!(u8).range(..=100))]
    pub(crate) quality: Option<u8>,
}
