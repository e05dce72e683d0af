//! What a lens does to an image, and its inverse.
//!
//! A direction (x, y, 1) of the camera's frame is mapped to the sensor in two steps: a projection (perspective, equidistant, ...) gives
//! a point q, and a polynomial moves it, by its radius and a little aside. Focal length and principal point come after that.
//!
//! Such a polynomial is a fit within the image. Far outside it may fold: its radius becomes smaller again, so that a direction far aside
//! would seem to fall into the image. The domain of a lens ends before that, and what lies beyond is unknown.
//!
//! Source: D. Brown. Close-Range Camera Calibration. Photogrammetric Engineering 37(8), 1971 (polynomial); J. Kannala, S. Brandt.
//! A Generic Camera Model and Calibration Method. IEEE PAMI 28(8), 2006 (equidistant); F. Devernay, O. Faugeras. Straight Lines Have to
//! Be Straight. Machine Vision and Applications 13, 2001 (field of view); A. Fitzgibbon. Simultaneous Linear Estimation of Multiple View
//! Geometry and Lens Distortion. CVPR 2001 (division); B. Khomutenko, G. Garcia, P. Martinet. An Enhanced Unified Camera Model. IEEE
//! RA-L 1(1), 2016.
//! Deviations: the inverse is found by bisection of the radial part and Newton's method for the rest, within the domain alone.

use glam::{DMat2, DVec2};

/// The farthest direction that is looked at, as the tangent of its angle to the axis: 87 degrees.
const FARTHEST: f64 = 20.0;

/// Places where the radial part is tried for a fold. They are denser near the axis.
const TRIED: u32 = 2048;

/// Halvings of an interval: all digits of a number.
const HALVINGS: u32 = 60;

/// Steps of Newton's method; it needs three or four where it works.
const NEWTON_STEPS: u32 = 30;

/// How exact an inverse is, in focal lengths: a ten-millionth of a pixel.
const EXACT: f64 = 1e-11;

/// Places along each side of the photograph where its stretch is looked at.
const STRETCHED: u32 = 17;

/// Room for places and directions in between.
const STRETCH_ROOM: f64 = 1.2;

/// How a direction falls on the sensor before the polynomial.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Projection {
    /// The radius is the tangent of the angle.
    #[default]
    Perspective,
    /// The radius is the angle: fisheye lenses.
    Equidistant,
    /// The radius is atan(2·r·tan(ω/2))/ω.
    FieldOfView {
        /// ω, radians.
        omega: f64,
    },
    /// The tangent is r/(1 + k·r²) of the radius r.
    Division {
        /// k.
        k: f64,
    },
    /// (x, y)/(α·√(β·(x² + y²) + 1) + 1 − α).
    Unified {
        /// α, 0 to 1.
        alpha: f64,
        /// β, positive.
        beta: f64,
    },
}

/// A lens, before focal length and principal point. Zeros are a lens without distortion.
///
/// The polynomial moves q = (x, y) with r² = x² + y² to
/// q·(1 + n₀r² + n₁r⁴ + n₂r⁶ + n₃r⁸)/(1 + d₀r² + d₁r⁴ + d₂r⁶) + (2·p₀xy + p₁(r² + 2x²) + s₀r², p₀(r² + 2y²) + 2·p₁xy + s₁r²).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// The first step.
    pub projection: Projection,
    /// n of the radial part: k1, k2, k3 of most programs.
    pub numerator: [f64; 4],
    /// d of the radial part: k4, k5, k6 of OpenCV's rational model.
    pub denominator: [f64; 3],
    /// p, in OpenCV's order.
    pub tangential: [f64; 2],
    /// s: of a thin prism.
    pub prism: [f64; 2],
}

impl Distortion {
    /// Whether it changes nothing.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    fn is_finite(&self) -> bool {
        let of_projection = match self.projection {
            Projection::Perspective | Projection::Equidistant => [0.0; 2],
            Projection::FieldOfView { omega } => [omega, 0.0],
            Projection::Division { k } => [k, 0.0],
            Projection::Unified { alpha, beta } => [alpha, beta],
        };
        let mut all = (self.numerator.iter().chain(&self.denominator))
            .chain(&self.tangential)
            .chain(&self.prism)
            .chain(&of_projection);
        all.all(|v| v.is_finite())
    }

    /// Numerator and denominator of the radial part at a squared radius, and their derivatives by it.
    fn radial(&self, s: f64) -> [f64; 4] {
        let (mut n, mut dn) = (0.0, 0.0);
        for &k in self.numerator.iter().rev() {
            (n, dn) = ((n + k) * s, dn * s + (n + k));
        }
        let (mut d, mut dd) = (0.0, 0.0);
        for &k in self.denominator.iter().rev() {
            (d, dd) = ((d + k) * s, dd * s + (d + k));
        }
        [1.0 + n, 1.0 + d, dn, dd]
    }

    /// The radial part still grows at a radius.
    fn grows_at(&self, r: f64) -> bool {
        let s = r * r;
        let [n, d, dn, dd] = self.radial(s);
        // Of a number that is none, nothing is known.
        d > 0.0 && n * d + 2.0 * s * (dn * d - n * dd) > 0.0
    }

    /// The polynomial.
    fn moved(&self, q: DVec2) -> DVec2 {
        let s = q.length_squared();
        let [n, d, ..] = self.radial(s);
        let ([p, t], [sx, sy]) = (self.tangential, self.prism);
        let xy = 2.0 * q.x * q.y;
        let aside = DVec2::new(
            p * xy + t * (s + 2.0 * q.x * q.x) + sx * s,
            p * (s + 2.0 * q.y * q.y) + t * xy + sy * s,
        );
        q * (n / d) + aside
    }

    /// Its derivative.
    fn slope(&self, q: DVec2) -> DMat2 {
        let s = q.length_squared();
        let [n, d, dn, dd] = self.radial(s);
        let ([p, t], [sx, sy]) = (self.tangential, self.prism);
        let (g, dg) = (n / d, 2.0 * (dn * d - n * dd) / (d * d));
        let (x, y) = (q.x, q.y);
        let by_x = DVec2::new(
            g + dg * x * x + 2.0 * p * y + 6.0 * t * x + 2.0 * sx * x,
            dg * x * y + 2.0 * p * x + 2.0 * t * y + 2.0 * sy * x,
        );
        let by_y = DVec2::new(
            dg * x * y + 2.0 * p * x + 2.0 * t * y + 2.0 * sx * y,
            g + dg * y * y + 6.0 * p * y + 2.0 * t * x + 2.0 * sy * y,
        );
        DMat2::from_cols(by_x, by_y)
    }
}

impl Projection {
    /// The radius on the sensor over the tangent of the angle; `None` where the projection has none.
    fn factor(self, tangent: f64) -> Option<f64> {
        let r = tangent;
        let factor = match self {
            Self::Perspective => 1.0,
            Self::Equidistant if r < 1e-8 => 1.0,
            Self::Equidistant => r.atan() / r,
            Self::FieldOfView { omega } if r < 1e-8 => 2.0 * (0.5 * omega).tan() / omega,
            Self::FieldOfView { omega } => (2.0 * r * (0.5 * omega).tan()).atan() / (omega * r),
            Self::Division { k } => {
                let under = 1.0 - 4.0 * k * r * r;
                if under < 0.0 {
                    return None;
                }
                2.0 / (1.0 + under.sqrt())
            }
            Self::Unified { alpha, beta } => {
                1.0 / (alpha * (beta * r * r + 1.0).sqrt() + 1.0 - alpha)
            }
        };
        (factor.is_finite() && factor > 0.0).then_some(factor)
    }

    /// The tangent of the angle over the radius on the sensor.
    fn back_factor(self, radius: f64) -> Option<f64> {
        let r = radius;
        let quarter = std::f64::consts::FRAC_PI_2;
        let factor = match self {
            Self::Perspective => 1.0,
            Self::Equidistant if r < 1e-8 => 1.0,
            Self::Equidistant if r < quarter => r.tan() / r,
            Self::FieldOfView { omega } if r < 1e-8 => omega / (2.0 * (0.5 * omega).tan()),
            Self::FieldOfView { omega } if r * omega < quarter => {
                (r * omega).tan() / (2.0 * r * (0.5 * omega).tan())
            }
            Self::Division { k } if k * r * r < 1.0 => 1.0 / (1.0 + k * r * r),
            Self::Unified { alpha, beta } => {
                let under = 1.0 - (2.0 * alpha - 1.0) * beta * r * r;
                if under < 0.0 {
                    return None;
                }
                (alpha * under.sqrt() + 1.0 - alpha) / (1.0 - alpha * alpha * beta * r * r)
            }
            Self::Equidistant | Self::FieldOfView { .. } | Self::Division { .. } => return None,
        };
        (factor.is_finite() && factor > 0.0).then_some(factor)
    }
}

/// What is wrong with a lens's numbers, as the end of a sentence.
pub(crate) const NOT_FINITE: &str = "a number of its lens is not finite, or out of its range";

/// A photograph's lens: where its image has what a pinhole camera of the same place would show elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// What it does before focal length and principal point.
    pub distortion: Distortion,
    /// Focal lengths along the photograph's columns and rows, pixels.
    pub focal: DVec2,
    /// Skew, pixels.
    pub skew: f64,
    /// Principal point, pixels from the photograph's top-left corner.
    pub principal: DVec2,
    /// Columns of the photograph.
    pub width: u32,
    /// Rows of the photograph.
    pub height: u32,
    /// The domain's radius before the polynomial.
    limit: f64,
    /// How far apart two places of the photograph are at most, over how far they are without the lens.
    stretch: f64,
}

impl Lens {
    /// A lens; `None` when a number of its is not finite or out of its range.
    #[must_use]
    pub fn new(
        distortion: Distortion,
        (focal, skew, principal): (DVec2, f64, DVec2),
        (width, height): (u32, u32),
    ) -> Option<Self> {
        let is_in_range = match distortion.projection {
            Projection::FieldOfView { omega } => omega > 1e-6 && omega < std::f64::consts::PI,
            Projection::Unified { alpha, beta } => (0.0..=1.0).contains(&alpha) && beta > 0.0,
            _ => true,
        };
        if !(distortion.is_finite() && is_in_range) {
            return None;
        }
        let lens = Self {
            distortion,
            focal,
            skew,
            principal,
            width,
            height,
            limit: limit_of(&distortion),
            stretch: 1.0,
        };
        let stretch = lens.steepest();
        Some(Self { stretch, ..lens })
    }

    /// How far apart two places of the photograph are at most, over how far they are in the image of a pinhole camera with the same
    /// focal lengths.
    pub(crate) fn stretch(&self) -> f64 {
        self.stretch
    }

    /// The largest stretch at places all over the photograph, and some more for those between.
    fn steepest(&self) -> f64 {
        let size = DVec2::new(self.width.into(), self.height.into());
        let linear =
            |t: DVec2| DVec2::new(self.focal.x * t.x + self.skew * t.y, self.focal.y * t.y);
        let mut most = 0.0_f64;
        for k in 0..STRETCHED * STRETCHED {
            let (i, j) = (k % STRETCHED, k / STRETCHED);
            let share = DVec2::new(i.into(), j.into()) / f64::from(STRETCHED - 1);
            let Some(tangent) = self.tangent_from_photo(share * size) else {
                continue;
            };
            let here = self.photo_from_tangent(tangent);
            // A pixel aside, in eight directions: the largest is at most 8 % more.
            for turn in 0..8 {
                let along = DVec2::from_angle(f64::from(turn) * std::f64::consts::FRAC_PI_4);
                let beside = tangent + along / self.focal.abs().max_element();
                let there = self.photo_from_tangent(beside);
                if let (Some(a), Some(b)) = (here, there) {
                    most = most.max(a.distance(b) / linear(beside - tangent).length());
                }
            }
        }
        if most > 0.0 { STRETCH_ROOM * most } else { 1.0 }
    }

    /// Where the direction (x, y, 1) falls on the sensor, in focal lengths from the principal point; `None` outside of the domain.
    #[must_use]
    pub fn distort(&self, tangent: DVec2) -> Option<DVec2> {
        let q = tangent * self.distortion.projection.factor(tangent.length())?;
        if !(q.length() < self.limit && self.distortion.slope(q).determinant() > 0.0) {
            return None;
        }
        Some(self.distortion.moved(q)).filter(|d| d.is_finite())
    }

    /// The direction (x, y, 1) that falls on a point of the sensor; `None` where none of the domain does.
    #[must_use]
    pub fn undistort(&self, sensor: DVec2) -> Option<DVec2> {
        let radius = sensor.length();
        if !radius.is_finite() {
            return None;
        }
        let start = sensor.normalize_or_zero() * self.radius_of(radius);
        let mut q = start;
        let mut off = self.distortion.moved(q) - sensor;
        for _ in 0..NEWTON_STEPS {
            if off.length() <= EXACT * 1e-3 {
                break;
            }
            let slope = self.distortion.slope(q);
            if slope.determinant().abs() < f64::MIN_POSITIVE {
                return None;
            }
            let step = slope.inverse() * off;
            // A step that leads away is halved.
            let mut share = 1.0;
            let better = loop {
                let tried = q - share * step;
                let rest = self.distortion.moved(tried) - sensor;
                if rest.length() < off.length() {
                    break Some((tried, rest));
                }
                share *= 0.5;
                if share < 1e-4 {
                    break None;
                }
            };
            match better {
                Some(found) => (q, off) = found,
                None => break,
            }
        }
        let is_found = off.length() <= EXACT * radius.max(1.0)
            && q.length() < self.limit
            && self.distortion.slope(q).determinant() > 0.0;
        if !is_found {
            return None;
        }
        let factor = self.distortion.projection.back_factor(q.length())?;
        Some(q * factor).filter(|t| t.length() <= FARTHEST)
    }

    /// The pixel of the photograph that a direction (x, y, 1) falls on, from its top-left corner; it may lie beside the image.
    #[must_use]
    pub fn photo_from_tangent(&self, tangent: DVec2) -> Option<DVec2> {
        let d = self.distort(tangent)?;
        let offset = DVec2::new(self.focal.x * d.x + self.skew * d.y, self.focal.y * d.y);
        Some(self.principal + offset)
    }

    /// The direction (x, y, 1) of a pixel of the photograph.
    #[must_use]
    pub fn tangent_from_photo(&self, photo: DVec2) -> Option<DVec2> {
        let offset = photo - self.principal;
        let y = offset.y / self.focal.y;
        let x = (offset.x - self.skew * y) / self.focal.x;
        self.undistort(DVec2::new(x, y))
    }

    /// Whether a place lies in the photograph.
    #[must_use]
    pub fn shows(&self, photo: DVec2) -> bool {
        let size = DVec2::new(self.width.into(), self.height.into());
        photo.cmpge(DVec2::ZERO).all() && photo.cmple(size).all()
    }

    /// The radius that the radial part moves to this one, or the farthest of the domain.
    fn radius_of(&self, moved: f64) -> f64 {
        let of = |r: f64| {
            let [n, d, ..] = self.distortion.radial(r * r);
            r * n / d
        };
        let (mut low, mut high) = (0.0, self.limit);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if of(middle) < moved {
                low = middle
            } else {
                high = middle
            }
        }
        0.5 * (low + high)
    }
}

/// The radius before the polynomial at which the domain ends: where the radial part stops growing, or at the farthest direction.
fn limit_of(distortion: &Distortion) -> f64 {
    let farthest = match distortion.projection {
        Projection::Division { k } if k > 0.0 => (1.0 / k).sqrt().min(FARTHEST),
        projection => projection
            .factor(FARTHEST)
            .map_or(FARTHEST, |f| f * FARTHEST),
    };
    let at = |k: u32| farthest * (f64::from(k) / f64::from(TRIED)).powi(2);
    let Some(first) = (1..=TRIED).find(|&k| !distortion.grows_at(at(k))) else {
        return farthest;
    };
    let (mut low, mut high) = (at(first - 1), at(first));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if distortion.grows_at(middle) {
            low = middle
        } else {
            high = middle
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(distortion: Distortion) -> Lens {
        let intrinsics = (DVec2::new(100.0, 90.0), 0.0, DVec2::new(51.0, 42.0));
        Lens::new(distortion, intrinsics, (100, 80)).unwrap()
    }

    fn brown(numerator: [f64; 4], tangential: [f64; 2]) -> Distortion {
        Distortion {
            numerator,
            tangential,
            ..Distortion::default()
        }
    }

    /// Lenses as they are: barrel, cushion, moustache, fisheye.
    fn lenses() -> Vec<Distortion> {
        let fisheye = Projection::Equidistant;
        vec![
            brown([-0.2, 0.03, 0.0, 0.0], [0.01, -0.02]),
            brown([0.15, 0.0, 0.0, 0.0], [0.0; 2]),
            brown([-0.35, 0.2, -0.04, 0.0], [0.001, 0.002]),
            brown([-0.1, 0.05, -0.02, 0.004], [-0.003, 0.001]),
            Distortion {
                denominator: [0.25, 0.03, 0.002],
                ..brown([0.3, 0.02, 0.004, 0.0], [0.01, -0.02])
            },
            Distortion {
                projection: fisheye,
                ..brown([0.05, -0.01, 0.003, -0.0004], [0.0; 2])
            },
            Distortion {
                projection: fisheye,
                prism: [0.005, -0.006],
                ..brown([0.05, -0.01, 0.003, -0.0004], [0.01, -0.02])
            },
            Distortion {
                projection: Projection::FieldOfView { omega: 0.9 },
                ..Distortion::default()
            },
            Distortion {
                projection: Projection::Division { k: -0.2 },
                ..Distortion::default()
            },
            Distortion {
                projection: Projection::Division { k: 0.1 },
                ..Distortion::default()
            },
            Distortion {
                projection: Projection::Unified {
                    alpha: 0.6,
                    beta: 1.1,
                },
                ..Distortion::default()
            },
        ]
    }

    #[test]
    fn undistorting_is_the_inverse_within_the_domain() {
        for distortion in lenses() {
            let lens = lens(distortion);
            let mut found = 0;
            for k in 0..400 {
                let (turn, r) = (0.7 * f64::from(k), 0.005 * f64::from(k));
                let tangent = r * DVec2::new(turn.cos(), turn.sin());
                let Some(sensor) = lens.distort(tangent) else {
                    continue;
                };
                found += 1;
                let back = lens.undistort(sensor).unwrap();
                assert!(
                    back.distance(tangent) < 1e-8,
                    "{distortion:?}: {tangent} is {back}"
                );
            }
            assert!(found > 150, "{distortion:?}: {found}");
        }
    }

    #[test]
    fn the_derivative_is_that_of_the_polynomial() {
        for distortion in lenses() {
            for q in [DVec2::new(0.3, -0.2), DVec2::new(-0.6, 0.5)] {
                let step = 1e-6;
                let by = |d: DVec2| {
                    (distortion.moved(q + d * step) - distortion.moved(q - d * step)) / (2.0 * step)
                };
                let slope = distortion.slope(q);
                assert!(slope.x_axis.distance(by(DVec2::X)) < 1e-7, "{distortion:?}");
                assert!(slope.y_axis.distance(by(DVec2::Y)) < 1e-7, "{distortion:?}");
            }
        }
    }

    /// r − 0.2·r³ grows up to r = √(5/3) and then comes back to the middle of the image.
    #[test]
    fn what_lies_beyond_a_fold_is_unknown() {
        let lens = lens(brown([-0.2, 0.0, 0.0, 0.0], [0.0; 2]));
        let fold = (5.0_f64 / 3.0).sqrt();
        assert!(lens.distort(DVec2::new(fold - 1e-6, 0.0)).is_some());
        assert_eq!(lens.distort(DVec2::new(fold + 1e-6, 0.0)), None);
        assert_eq!(lens.distort(DVec2::new(0.0, 2.2)), None);
        // The image ends at the fold's radius.
        let most = fold * (1.0 - 0.2 * fold * fold);
        assert!(lens.undistort(DVec2::new(most - 1e-6, 0.0)).is_some());
        assert_eq!(lens.undistort(DVec2::new(most + 1e-6, 0.0)), None);
    }

    #[test]
    fn numbers_that_are_none_or_huge_end_in_nothing_known() {
        let intrinsics = (DVec2::splat(100.0), 0.0, DVec2::splat(50.0));
        let make = |distortion| Lens::new(distortion, intrinsics, (100, 100));
        assert!(make(brown([f64::NAN, 0.0, 0.0, 0.0], [0.0; 2])).is_none());
        let without = Projection::FieldOfView { omega: 0.0 };
        assert!(
            make(Distortion {
                projection: without,
                ..Distortion::default()
            })
            .is_none()
        );
        for huge in [1e300, -1e300, f64::MAX] {
            for distortion in [
                brown([huge, 0.0, huge, 0.0], [0.0; 2]),
                brown([0.0; 4], [huge, -huge]),
                Distortion {
                    denominator: [huge, -huge, huge],
                    ..Distortion::default()
                },
            ] {
                let lens = make(distortion).unwrap();
                for at in [DVec2::ZERO, DVec2::ONE, DVec2::new(1e300, -2.0)] {
                    assert!(lens.distort(at).is_none_or(|d| d.is_finite()));
                    assert!(lens.undistort(at).is_none_or(|d| d.is_finite()));
                }
            }
        }
    }
}
