//! `*_par.txt` of the Middlebury multi-view stereo sets: a count, then a line for each image.
//!
//! Source: S. Seitz, B. Curless, J. Diebel, D. Scharstein, R. Szeliski. A Comparison and Evaluation of Multi-View Stereo Reconstruction
//! Algorithms. CVPR 2006; the `README.txt` of each set: `name k11 … k33 r11 … r33 t1 t2 t3`, and P = K·\[R t\].

use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::declared::{Declared, DeclaredView, MaskPlace};
use crate::error::CaptureFault;
use crate::lens::Distortion;
use crate::pinhole::Pinhole;

/// Numbers of a line: K, R and t.
const NUMBERS: usize = 21;

/// Folders beside the file that photographs are looked for in; the first is the file's own.
const PHOTO_FOLDERS: [&str; 3] = ["", "photos", "images"];

/// The first pixel's centre, as the tools of these sets have it.
const PIXEL_CENTRE: f64 = 0.0;

/// Reads the file's text; photographs are beside it or in a folder there. `size_of` finds the size of a photograph or of its mask.
pub(crate) fn read(
    text: &str,
    folder: &Path,
    size_of: &dyn Fn(&Path) -> Option<(u32, u32)>,
) -> Result<Declared, CaptureFault> {
    let mut lines = (text.lines().enumerate())
        .map(|(k, line)| (k + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty());
    let (number, first) = lines.next().ok_or(CaptureFault::NoViews)?;
    let count: usize = first.parse().map_err(|_| CaptureFault::Line {
        line: number,
        reason: format!("it must be the number of images, and is {first:?}"),
    })?;
    let mut views = Vec::new();
    for (number, line) in lines {
        views.push(view(number, line, folder, size_of)?);
    }
    if views.is_empty() {
        return Err(CaptureFault::NoViews);
    }
    if views.len() != count {
        return Err(CaptureFault::Line {
            line: 1,
            reason: format!("it says {count} images, and {} follow", views.len()),
        });
    }
    Ok(Declared::of(views, PIXEL_CENTRE, Vec::new()))
}

fn view(
    number: usize,
    line: &str,
    folder: &Path,
    size_of: &dyn Fn(&Path) -> Option<(u32, u32)>,
) -> Result<DeclaredView, CaptureFault> {
    let mut words = line.split_whitespace();
    let file = words.next().unwrap_or_default();
    let name = Path::new(file).file_stem().map_or_else(
        || file.to_owned(),
        |stem| stem.to_string_lossy().into_owned(),
    );
    let numbers: Vec<f64> = words
        .map(|word| {
            word.parse().map_err(|_| CaptureFault::Line {
                line: number,
                reason: format!("{word:?} is no number"),
            })
        })
        .collect::<Result<_, _>>()?;
    let Ok(v) = <[f64; NUMBERS]>::try_from(numbers.as_slice()) else {
        let found = numbers.len();
        return Err(CaptureFault::Line {
            line: number,
            reason: format!(
                "a name and {NUMBERS} numbers are needed (K, R and t), and {found} numbers follow the name"
            ),
        });
    };
    let fault = |fault| CaptureFault::Camera {
        view: name.clone(),
        fault,
    };
    let row = |k: usize| [v[k], v[k + 1], v[k + 2]];
    let [k, r] = [0, 9].map(|first| [row(first), row(first + 3), row(first + 6)]);
    let mut photos = PHOTO_FOLDERS.iter().map(|f| folder.join(f).join(file));
    let photo = photos.find(|path| path.is_file());
    let place: PathBuf = photo.clone().unwrap_or_else(|| folder.join(file));
    let size = size_of(&place).ok_or_else(|| CaptureFault::NoSize { view: name.clone() })?;
    let parts = (&k, &r, DVec3::from(row(18)));
    let camera = Pinhole::from_parts(parts, 0.5 - PIXEL_CENTRE, size).map_err(fault)?;
    Ok(DeclaredView {
        camera,
        distortion: Distortion::default(),
        mask: MaskPlace::ByConvention,
        photo: Some(place),
        name,
    })
}
