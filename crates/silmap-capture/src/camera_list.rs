//! The cameras of a capture alone, without its masks, and the one that is called by a name.

use std::path::{Path, PathBuf};

use glam::DVec2;
use image::RgbaImage;
use silmap_geometry::Mask;

use crate::declared::MaskPlace;
use crate::error::{CaptureError, CaptureFault};
use crate::find_mask::find_mask;
use crate::lens::Lens;
use crate::mask_file::MaskOptions;
use crate::pinhole::Pinhole;
use crate::undistort::{known, straight, straight_mask};
use crate::view::CameraFormat;
use crate::{camera_files, mask_file};

/// Names that a sentence has room for.
const MOST_NAMES: usize = 5;

/// A camera of a camera file.
#[derive(Clone, Debug)]
pub struct CameraView {
    /// Its name in the camera file.
    pub name: String,
    /// As captured, but for the lens; image coordinates from the top-left corner.
    pub camera: Pinhole,
    /// What the photograph's lens does to that image.
    pub lens: Option<Lens>,
    /// The photograph that the file names; it need not be there.
    pub photo: Option<PathBuf>,
    mask: MaskPlace,
    folder: PathBuf,
}

/// The mask of a camera.
#[derive(Clone, Debug)]
pub struct ViewMask {
    /// Where the object is seen.
    pub mask: Mask,
    /// Pixels that the photograph shows; the others are unknown, and not in the mask. `None`: all.
    pub known: Option<Mask>,
}

/// The cameras of a camera file.
#[derive(Clone, Debug)]
pub struct CameraList {
    /// The file.
    pub path: PathBuf,
    /// Its kind.
    pub format: CameraFormat,
    /// In the order of the file, whether they have a mask or not.
    pub views: Vec<CameraView>,
}

/// Reads the cameras of a capture: a camera file, or a folder that holds one. Masks and photographs need not be there.
///
/// # Errors
/// One sentence that names the file and the first view at fault.
pub fn read_cameras(path: &Path) -> Result<CameraList, CaptureError> {
    let file = camera_files::read(path)?;
    if !file.declared.is_metric {
        return Err(CaptureFault::Projective.at(&file.path));
    }
    let folder = file.folder;
    let views = file.declared.views.into_iter().map(|view| {
        Ok(CameraView {
            lens: Lens::of_view(&view.name, view.distortion, &view.camera)?,
            name: view.name,
            camera: view.camera,
            photo: view.photo,
            mask: view.mask,
            folder: folder.clone(),
        })
    });
    let views = views.collect::<Result<_, CaptureFault>>();
    Ok(CameraList {
        views: views.map_err(|fault| fault.at(&file.path))?,
        path: file.path,
        format: file.format,
    })
}

impl CameraView {
    /// The photograph, if the camera file `of` names one: as it was taken, or straight, without what the lens does.
    ///
    /// # Errors
    /// One sentence that names the camera file, the view and the photograph, when it cannot be read or has another shape than the camera's
    /// image.
    pub fn photograph(
        &self,
        of: &Path,
        is_straight: bool,
    ) -> Result<Option<RgbaImage>, CaptureError> {
        let Some(path) = &self.photo else {
            return Ok(None);
        };
        let fault = |reason: String| {
            let (view, photo) = (self.name.clone(), path.clone());
            CaptureFault::Photograph {
                view,
                photo,
                reason,
            }
            .at(of)
        };
        let size = (self.camera.width, self.camera.height);
        let picture = mask_file::read_photo(path, size).map_err(|e| fault(e.to_string()))?;
        let picture = picture.into_rgba8();
        Ok(Some(match &self.lens {
            Some(lens) if is_straight => straight(picture, lens, &self.camera),
            _ => picture,
        }))
    }

    /// The mask, if the camera file `of` names one, or there is one beside the photograph: as it is, or straight, without what the lens does.
    ///
    /// # Errors
    /// One sentence that names the camera file, the view and the mask.
    pub fn mask(
        &self,
        of: &Path,
        is_straight: bool,
        options: &MaskOptions,
    ) -> Result<Option<ViewMask>, CaptureError> {
        let size = (self.camera.width, self.camera.height);
        let of_view = (self.name.as_str(), self.photo.as_deref(), size);
        let found = find_mask(&self.mask, of_view, &self.folder, options);
        let Some(image) = found.map_err(|fault| fault.at(of))? else {
            return Ok(None);
        };
        let (mask, known) = match self.lens.filter(|_| is_straight) {
            Some(lens) => {
                let is_inside = |p: DVec2| image.mask.get(p.x as i64, p.y as i64);
                let mask = straight_mask(&lens, &self.camera, is_inside);
                (mask, known(&lens, &self.camera))
            }
            None => (image.mask, None),
        };
        Ok(Some(ViewMask { mask, known }))
    }

    /// The last part of a path, with and without what follows its last dot.
    fn short_names(&self) -> [Vec<String>; 2] {
        let paths = [Some(Path::new(&self.name)), self.photo.as_deref()];
        let parts = |part: fn(&Path) -> Option<&std::ffi::OsStr>| {
            let found = paths.iter().flatten().filter_map(|path| part(path));
            found.map(|p| p.to_string_lossy().into_owned()).collect()
        };
        [parts(Path::file_name), parts(Path::file_stem)]
    }
}

impl CameraList {
    /// The view that a word means: one of this name; else one whose photograph's file is called so, with or without extension; else the only
    /// one that begins so.
    ///
    /// # Errors
    /// One sentence with the nearest names where there is none, or with the names of several.
    pub fn named(&self, wanted: &str) -> Result<&CameraView, CaptureError> {
        let short: Vec<[Vec<String>; 2]> = self.views.iter().map(CameraView::short_names).collect();
        let is_one = |names: &[String]| names.iter().any(|n| n == wanted);
        let begins = |names: &[String]| names.iter().any(|n| n.starts_with(wanted));
        let kinds: [&dyn Fn(usize) -> bool; 4] = [
            &|v| self.views[v].name == wanted,
            &|v| is_one(&short[v][0]),
            &|v| is_one(&short[v][1]),
            &|v| self.views[v].name.starts_with(wanted) || begins(&short[v][0]),
        ];
        for is_meant in kinds {
            let meant: Vec<usize> = (0..self.views.len()).filter(|&v| is_meant(v)).collect();
            if let [one] = meant[..] {
                return Ok(&self.views[one]);
            }
            if !meant.is_empty() {
                let first = meant.iter().take(MOST_NAMES);
                return Err(CaptureFault::AmbiguousView {
                    wanted: wanted.to_owned(),
                    names: first.map(|&v| self.views[v].name.clone()).collect(),
                    count: meant.len(),
                }
                .at(&self.path));
            }
        }
        Err(CaptureFault::NoView {
            wanted: wanted.to_owned(),
            nearest: self.nearest(wanted),
            views: self.views.len(),
        }
        .at(&self.path))
    }

    /// The names most like a word, those that hold it first, in the order of the file where they are equally like.
    fn nearest(&self, wanted: &str) -> Vec<String> {
        let wanted = wanted.to_lowercase();
        let mut names: Vec<&str> = self.views.iter().map(|v| v.name.as_str()).collect();
        names.sort_by_cached_key(|name| {
            let name = name.to_lowercase();
            let holds = !wanted.is_empty() && name.contains(&wanted);
            (!holds, strsim::osa_distance(&wanted, &name))
        });
        names.truncate(MOST_NAMES);
        names.into_iter().map(str::to_owned).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn list(views: &[(&str, Option<&str>)]) -> CameraList {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let lens = (DVec2::splat(9.0), DVec2::splat(4.0));
        let view = |&(name, photo): &(&str, Option<&str>)| CameraView {
            name: name.to_owned(),
            camera: Pinhole::from_pose(DVec3::ZERO, axes, lens, (8, 8)).unwrap(),
            photo: photo.map(PathBuf::from),
            lens: None,
            mask: MaskPlace::None,
            folder: PathBuf::new(),
        };
        CameraList {
            path: "cameras.json".into(),
            format: CameraFormat::CamerasJson,
            views: views.iter().map(view).collect(),
        }
    }

    #[test]
    fn a_view_is_found_by_name_file_or_beginning() {
        let list = list(&[
            ("1", Some("photos/img_0001.jpg")),
            ("10", Some("photos/img_0010.jpg")),
            ("front/left.png", None),
            ("a name with spaces", Some("photos/1.jpg")),
        ]);
        for (wanted, found) in [
            ("1", "1"),
            ("10", "10"),
            ("img_0010.jpg", "10"),
            ("img_0010", "10"),
            ("left.png", "front/left.png"),
            ("left", "front/left.png"),
            ("front", "front/left.png"),
            ("1.jpg", "a name with spaces"),
            ("a na", "a name with spaces"),
        ] {
            assert_eq!(list.named(wanted).unwrap().name, found, "{wanted}");
        }
    }

    /// A lens that draws the image together shows nothing at its border.
    #[test]
    fn what_a_photograph_does_not_show_of_the_straight_image_is_unknown() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("mask.png");
        let white =
            image::GrayImage::from_fn(8, 8, |x, _| image::Luma([if x == 0 { 0 } else { 255 }]));
        white.save(&file).unwrap();
        let mut view = list(&[("a", None)]).views.remove(0);
        let distortion = crate::lens::Distortion {
            numerator: [2.0, 0.0, 0.0, 0.0],
            ..Default::default()
        };
        view.mask = MaskPlace::Named(file);
        view.lens = Lens::of_view("a", distortion, &view.camera).unwrap();
        let mask = |is_straight| {
            let of = Path::new("cameras.json");
            view.mask(of, is_straight, &MaskOptions::default())
                .unwrap()
                .unwrap()
        };
        assert_eq!(mask(false).known, None);
        let straight = mask(true);
        let known = straight.known.unwrap();
        assert!(!known.get(0, 0) && known.get(4, 4) && !known.get(7, 7));
        assert!(straight.mask.get(4, 4) && straight.mask.count_missing_in(&known) == 0);
    }

    #[test]
    fn what_is_unknown_or_may_be_several_is_one_sentence() {
        let names: Vec<String> = (0..36).map(|k| format!("viff.{k:03}")).collect();
        let views: Vec<(&str, Option<&str>)> = names.iter().map(|n| (n.as_str(), None)).collect();
        let many = list(&views);
        let message = |list: &CameraList, wanted: &str| list.named(wanted).unwrap_err().to_string();
        assert_eq!(
            message(&many, "viff.0o7"),
            "cameras.json: it has no view viff.0o7; of its 36, the names most like it are viff.007, viff.017, viff.027, viff.000, viff.001"
        );
        assert_eq!(
            message(&many, "35"),
            "cameras.json: it has no view 35; of its 36, the names most like it are viff.035, viff.005, viff.015, viff.025, viff.030"
        );
        assert_eq!(
            message(&many, "viff.03"),
            "cameras.json: 6 views may be meant by viff.03: viff.030, viff.031, viff.032, viff.033, viff.034, …"
        );
        assert_eq!(
            message(&many, ""),
            "cameras.json: 36 views may be meant by : viff.000, viff.001, viff.002, viff.003, viff.004, …"
        );
        let twice = list(&[("a", None), ("a", None), ("b", None)]);
        assert_eq!(
            message(&twice, "a"),
            "cameras.json: 2 views may be meant by a: a, a"
        );
        assert_eq!(
            message(&twice, "c"),
            "cameras.json: it has no view c; it has a, a, b"
        );
    }
}
