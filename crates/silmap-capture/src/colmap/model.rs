//! COLMAP's camera models: their numbers, names and parameters.

use crate::lens::{Distortion, Projection};

/// A camera model, by COLMAP's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CameraModel(usize);

/// Name and count of parameters of each model, at the place of its number.
const MODELS: [(&str, usize); 18] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
    ("SIMPLE_DIVISION", 4),
    ("DIVISION", 5),
    ("SIMPLE_FISHEYE", 3),
    ("FISHEYE", 4),
    ("EUCM", 6),
    ("EQUIRECTANGULAR", 2),
];

impl CameraModel {
    /// By its number in binary files.
    pub(super) fn of_number(number: i32) -> Option<Self> {
        let number = usize::try_from(number).ok()?;
        (number < MODELS.len()).then_some(Self(number))
    }

    /// By its name in files of text.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        MODELS.iter().position(|(n, _)| *n == name).map(Self)
    }

    pub(super) fn name(self) -> &'static str {
        MODELS[self.0].0
    }

    pub(super) fn param_count(self) -> usize {
        MODELS[self.0].1
    }

    /// Focal lengths and principal point, and the lens; `None` of a model that is not taken out.
    pub(super) fn meaning(self, params: &[f64]) -> Option<([f64; 4], Distortion)> {
        let one = |distortion| {
            move |p: &[f64]| match *p {
                [f, cx, cy, ..] => Some(([f, f, cx, cy], distortion)),
                _ => None,
            }
        };
        let two = |distortion| {
            move |p: &[f64]| match *p {
                [fx, fy, cx, cy, ..] => Some(([fx, fy, cx, cy], distortion)),
                _ => None,
            }
        };
        let plain = Distortion::default();
        let fisheye = Distortion {
            projection: Projection::Equidistant,
            ..plain
        };
        let radial = |of: Distortion, numerator| Distortion { numerator, ..of };
        let other = |projection| Distortion {
            projection,
            ..plain
        };
        match (self.name(), params) {
            ("SIMPLE_PINHOLE", p) => one(plain)(p),
            ("PINHOLE", p) => two(plain)(p),
            ("SIMPLE_RADIAL", p @ &[_, _, _, k]) => one(radial(plain, [k, 0.0, 0.0, 0.0]))(p),
            ("RADIAL", p @ &[_, _, _, k1, k2]) => one(radial(plain, [k1, k2, 0.0, 0.0]))(p),
            ("OPENCV", p @ &[_, _, _, _, k1, k2, p1, p2]) => two(Distortion {
                tangential: [p1, p2],
                ..radial(plain, [k1, k2, 0.0, 0.0])
            })(p),
            ("OPENCV_FISHEYE", p @ &[_, _, _, _, k1, k2, k3, k4]) => {
                two(radial(fisheye, [k1, k2, k3, k4]))(p)
            }
            ("FULL_OPENCV", p @ &[_, _, _, _, k1, k2, p1, p2, k3, k4, k5, k6]) => two(Distortion {
                tangential: [p1, p2],
                denominator: [k4, k5, k6],
                ..radial(plain, [k1, k2, k3, 0.0])
            })(p),
            ("FOV", p @ &[_, _, _, _, omega]) => two(other(Projection::FieldOfView { omega }))(p),
            ("SIMPLE_RADIAL_FISHEYE", p @ &[_, _, _, k]) => {
                one(radial(fisheye, [k, 0.0, 0.0, 0.0]))(p)
            }
            ("RADIAL_FISHEYE", p @ &[_, _, _, k1, k2]) => {
                one(radial(fisheye, [k1, k2, 0.0, 0.0]))(p)
            }
            ("THIN_PRISM_FISHEYE", p @ &[_, _, _, _, k1, k2, p1, p2, k3, k4, sx, sy]) => {
                two(Distortion {
                    tangential: [p1, p2],
                    prism: [sx, sy],
                    ..radial(fisheye, [k1, k2, k3, k4])
                })(p)
            }
            ("SIMPLE_DIVISION", p @ &[_, _, _, k]) => one(other(Projection::Division { k }))(p),
            ("DIVISION", p @ &[_, _, _, _, k]) => two(other(Projection::Division { k }))(p),
            ("SIMPLE_FISHEYE", p) => one(fisheye)(p),
            ("FISHEYE", p) => two(fisheye)(p),
            ("EUCM", p @ &[_, _, _, _, alpha, beta]) => {
                two(other(Projection::Unified { alpha, beta }))(p)
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::lens::Lens;

    /// Where pycolmap 4.2.1 (`Camera.img_from_cam`) has the directions (0.3, −0.4, 1) and (−0.7, 0.2, 1).
    /// A model's name, parameters, and where it has both.
    type Expected = (&'static str, &'static [f64], [[f64; 2]; 2]);

    #[test]
    fn lenses_map_directions_as_colmap_does() {
        let of_both: [Expected; 14] = [
            (
                "SIMPLE_RADIAL",
                &[100.0, 51.0, 42.0, -0.2],
                [[79.5, 4.0], [-11.58, 59.88]],
            ),
            (
                "RADIAL",
                &[100.0, 51.0, 42.0, -0.2, 0.03],
                [[79.55625, 3.925], [-12.16989, 60.04854]],
            ),
            (
                "OPENCV",
                &[100.0, 90.0, 51.0, 42.0, -0.2, 0.03, 0.01, -0.02],
                [[78.45625, 8.6775], [-15.46989, 59.296686]],
            ),
            (
                "OPENCV_FISHEYE",
                &[100.0, 90.0, 51.0, 42.0, 0.05, -0.01, 0.003, -0.0004],
                [
                    [79.10581600615166, 8.273020792618006],
                    [-10.620485167083402, 57.84526761439288],
                ],
            ),
            (
                "FULL_OPENCV",
                &[
                    100.0, 90.0, 51.0, 42.0, 0.3, 0.02, 0.01, -0.02, 0.004, 0.25, 0.03, 0.002,
                ],
                [
                    [80.23557441061624, 6.542310707260505],
                    [-23.771412860713312, 61.43136330704057],
                ],
            ),
            (
                "FOV",
                &[100.0, 90.0, 51.0, 42.0, 0.9],
                [[81.0, 6.0], [-14.486538356991176, 58.83939557751202]],
            ),
            (
                "SIMPLE_RADIAL_FISHEYE",
                &[100.0, 51.0, 42.0, 0.05],
                [
                    [79.11786627513726, 4.509511633150311],
                    [-10.704689075335025, 59.62991116438144],
                ],
            ),
            (
                "RADIAL_FISHEYE",
                &[100.0, 51.0, 42.0, 0.05, -0.01],
                [
                    [79.10501070408974, 4.526652394547021],
                    [-10.60980873574011, 59.60280249592575],
                ],
            ),
            (
                "THIN_PRISM_FISHEYE",
                &[
                    100.0, 90.0, 51.0, 42.0, 0.05, -0.01, 0.01, -0.02, 0.003, -0.0004, 0.005,
                    -0.006,
                ],
                [
                    [78.26743649535622, 8.969520693894218],
                    [-12.888099930916873, 58.41818590134757],
                ],
            ),
            (
                "SIMPLE_DIVISION",
                &[100.0, 51.0, 42.0, -0.2],
                [
                    [79.63353450309967, 3.821953995867105],
                    [-12.83032917446824, 60.23723690699093],
                ],
            ),
            (
                "DIVISION",
                &[100.0, 90.0, 51.0, 42.0, -0.2],
                [
                    [79.63353450309967, 7.639758596280394],
                    [-12.83032917446824, 58.41351321629183],
                ],
            ),
            (
                "SIMPLE_FISHEYE",
                &[100.0, 51.0, 42.0],
                [
                    [78.81885654004836, 4.908191279935508],
                    [-9.50668089185087, 59.287623111957394],
                ],
            ),
            (
                "FISHEYE",
                &[100.0, 90.0, 51.0, 42.0],
                [
                    [78.81885654004836, 8.617372151941957],
                    [-9.50668089185087, 57.55886080076166],
                ],
            ),
            (
                "EUCM",
                &[100.0, 90.0, 51.0, 42.0, 0.6, 1.1],
                [
                    [78.84234656570297, 8.589184121156435],
                    [-9.611100122409944, 57.58571146004827],
                ],
            ),
        ];
        for (name, params, expected) in of_both {
            let model = CameraModel::of_name(name).unwrap();
            assert_eq!(model.param_count(), params.len(), "{name}");
            let ([fx, fy, cx, cy], distortion) = model.meaning(params).unwrap();
            let intrinsics = (DVec2::new(fx, fy), 0.0, DVec2::new(cx, cy));
            let lens = Lens::new(distortion, intrinsics, (100, 80)).unwrap();
            for ([x, y], [u, v]) in [[0.3, -0.4], [-0.7, 0.2]].into_iter().zip(expected) {
                let found = lens.photo_from_tangent(DVec2::new(x, y)).unwrap();
                assert!(found.distance(DVec2::new(u, v)) < 1e-9, "{name}: {found}");
            }
        }
    }
}
