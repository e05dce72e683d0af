//! From cameras up to a projectivity to metric ones, where they turn about one line.
//!
//! Calibration from a turntable alone leaves two numbers open: in a frame whose z axis is the line, P_k = P_0·R_z(θ_k), and every map
//! (x, y, z) ↦ (x, y, b·z)/(1 + c·z) keeps that form. Both follow from what is known of most photographs: pixels are square, their axes
//! at right angles, and the principal point is near the image's middle. Where the cameras are of that form and such numbers are found,
//! the frame is made metric; its unit stays the radius of the circle of cameras. Else nothing is done.
//!
//! Source: A. Fitzgibbon, G. Cross, A. Zisserman. Automatic 3D Model Construction for Turn-Table Sequences. SMILE 1998, section 4 (the
//! two numbers); Hartley, Zisserman, Multiple View Geometry, 2nd ed., section 19.8.
//! Deviations: the two numbers are searched for on a grid and by halved steps, over all views at once.

use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};

use crate::declared::Declared;
use crate::pinhole::{Matrix34, Pinhole};
use crate::view::CaptureWarning;

/// With fewer views any cameras lie on a circle.
const LEAST_VIEWS: usize = 3;

/// How far matrices may be from those of one turning camera, both of unit length, and centres from the circle, in its radii.
const FORM_TOLERANCE: f64 = 0.01;

/// Steps of the grid: of b, each sign, from [`LEAST_B`] by factors; of c on each side of zero.
const B_STEPS: u32 = 60;
const LEAST_B: f64 = 0.05;
const B_FACTOR: f64 = 1.11;
const C_STEPS: i32 = 30;
const C_STEP: f64 = 0.1;

/// Halvings of the step from the best place of the grid.
const HALVINGS: u32 = 40;

/// Views that are looked at while searching.
const MOST_VIEWS: usize = 8;

/// How sure it is that pixels are square and at right angles beside that the principal point is in the middle, in focal lengths.
const SQUARE: f64 = 10.0;

/// What the pixels' aspect and skew (over the focal length) may be off by in the end.
const MOST_ASPECT: f64 = 0.05;
const MOST_SKEW: f64 = 0.02;

/// Makes projective cameras metric where they turn about one line; leaves them as they are where not.
pub(crate) fn make_metric(declared: &mut Declared) {
    if let Some((views, bounds, found)) = metric(declared) {
        for (view, camera) in declared.views.iter_mut().zip(views) {
            view.camera = camera;
        }
        declared.object_bounds = Some(bounds);
        declared.is_metric = true;
        declared.warnings.push(found);
    }
}

type Upgraded = (Vec<Pinhole>, [DVec3; 2], CaptureWarning);

fn metric(declared: &Declared) -> Option<Upgraded> {
    let bounds = declared.object_bounds?;
    let cameras: Vec<&Pinhole> = declared.views.iter().map(|view| &view.camera).collect();
    if cameras.len() < LEAST_VIEWS {
        return None;
    }
    // In the frame of the circle.
    let circle = circle_of(&cameras)?;
    let matrices: Vec<DMatrix34> = cameras
        .iter()
        .map(|c| times(&c.to_matrix(), &circle))
        .collect();
    if !is_one_turning(&cameras, &matrices, &circle) {
        return None;
    }
    let stride = cameras.len().div_ceil(MOST_VIEWS);
    let searched: Vec<(DMatrix34, (u32, u32))> = (matrices.iter().zip(&cameras).step_by(stride))
        .map(|(m, c)| (*m, (c.width, c.height)))
        .collect();
    let to_circle = circle.inverse();
    let corner = |k: usize| {
        let of = |axis: usize| bounds[k >> axis & 1][axis];
        to_circle.transform_point3(DVec3::new(of(0), of(1), of(2)))
    };
    let corners: [DVec3; 8] = std::array::from_fn(corner);
    let (b, c) = search(&searched, &corners)?;
    let upgrade = upgrade(b, c);
    let mut views = Vec::new();
    for (matrix, camera) in matrices.iter().zip(&cameras) {
        let camera = camera_of(&times(matrix, &upgrade), (camera.width, camera.height))?;
        if !(((camera.focal.x / camera.focal.y) - 1.0).abs() < MOST_ASPECT
            && (camera.skew / camera.focal.y).abs() < MOST_SKEW
            && camera.shows(camera.principal))
        {
            return None;
        }
        views.push(camera);
    }
    let corners = corners.map(|p| metric_point(p, (b, c)));
    let low = corners.into_iter().fold(DVec3::INFINITY, DVec3::min);
    let high = corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
    let first = *views.first()?;
    let found = CaptureWarning::MadeMetric {
        focal_px: 0.5 * (first.focal.x + first.focal.y),
        principal_px: first.principal.to_array(),
    };
    Some((views, [low, high], found))
}

/// Rows, as vectors.
type DMatrix34 = [DVec4; 3];

fn times(matrix: &(impl Rows + ?Sized), by: &DMat4) -> DMatrix34 {
    let turned = by.transpose();
    matrix.rows().map(|row| turned * row)
}

trait Rows {
    fn rows(&self) -> DMatrix34;
}

impl Rows for Matrix34 {
    fn rows(&self) -> DMatrix34 {
        self.map(DVec4::from_array)
    }
}

impl Rows for DMatrix34 {
    fn rows(&self) -> DMatrix34 {
        *self
    }
}

/// The frame, within that of the cameras, whose z axis is that of the circle through all centres, and whose unit is its radius.
fn circle_of(cameras: &[&Pinhole]) -> Option<DMat4> {
    let count = cameras.len() as f64;
    let mean = cameras.iter().map(|c| c.eye).sum::<DVec3>() / count;
    // Normals of the triangles that the first centre makes with two others, all to one side.
    let mut normal = DVec3::ZERO;
    for (k, a) in cameras.iter().enumerate() {
        for b in &cameras[k + 1..] {
            let across = (a.eye - cameras[0].eye).cross(b.eye - cameras[0].eye);
            normal += if across.dot(normal) < 0.0 {
                -across
            } else {
                across
            };
        }
    }
    let z = normal.try_normalize()?;
    let x = (cameras[0].eye - mean)
        .reject_from_normalized(z)
        .try_normalize()?;
    let y = z.cross(x);
    // |p|² = 2·p·m + const in the plane, by least squares.
    let (mut left, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for camera in cameras {
        let p = camera.eye - mean;
        let row = DVec3::new(p.dot(x), p.dot(y), 1.0);
        left += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
        right += row * (row.x * row.x + row.y * row.y);
    }
    let solved = left.inverse() * right;
    let (u, v) = (0.5 * solved.x, 0.5 * solved.y);
    let radius = (solved.z + u * u + v * v).sqrt();
    let middle = mean + u * x + v * y;
    let frame = DMat4::from_cols(
        (x * radius).extend(0.0),
        (y * radius).extend(0.0),
        (z * radius).extend(0.0),
        middle.extend(1.0),
    );
    let is_frame = frame.is_finite() && radius > 0.0;
    is_frame.then_some(frame)
}

/// Whether all cameras are the first one, turned about z.
fn is_one_turning(cameras: &[&Pinhole], matrices: &[DMatrix34], circle: &DMat4) -> bool {
    let to_circle = circle.inverse();
    let unit = |m: DMatrix34| {
        let length = m.iter().map(|row| row.length_squared()).sum::<f64>().sqrt();
        m.map(|row| row / length)
    };
    let angle = |camera: &Pinhole| {
        let eye = to_circle.transform_point3(camera.eye);
        let is_near =
            (eye.truncate().length() - 1.0).abs() < FORM_TOLERANCE && eye.z.abs() < FORM_TOLERANCE;
        is_near.then(|| eye.y.atan2(eye.x))
    };
    let Some(first) = angle(cameras[0]) else {
        return false;
    };
    cameras.iter().zip(matrices).all(|(camera, matrix)| {
        angle(camera).is_some_and(|angle| {
            // P_k = P_0·R_z(−θ), where the eye has turned by θ.
            let turned = unit(times(&matrices[0], &DMat4::from_rotation_z(first - angle)));
            let matrix = unit(*matrix);
            let apart = |sign: f64| {
                let rows = matrix.iter().zip(&turned);
                rows.map(|(a, b)| (*a - sign * *b).abs().max_element())
                    .fold(0.0, f64::max)
            };
            apart(1.0).min(apart(-1.0)) < FORM_TOLERANCE
        })
    })
}

/// From the metric frame to that of the circle.
fn upgrade(b: f64, c: f64) -> DMat4 {
    DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::new(0.0, 0.0, b, c), DVec4::W)
}

/// A point of the circle's frame in the metric one.
fn metric_point(p: DVec3, (b, c): (f64, f64)) -> DVec3 {
    let z = p.z / (b - c * p.z);
    let share = 1.0 + c * z;
    DVec3::new(p.x * share, p.y * share, z)
}

/// The camera of a matrix of either sign whose picture is not mirrored.
fn camera_of(matrix: &DMatrix34, size: (u32, u32)) -> Option<Pinhole> {
    let block = DMat3::from_cols(
        matrix[0].truncate(),
        matrix[1].truncate(),
        matrix[2].truncate(),
    );
    let sign = block.determinant().signum();
    let rows = matrix.map(|row| (row * sign).to_array());
    Pinhole::from_matrix(&rows, 0.0, size).ok()
}

/// b and c by which pixels are squares and the object is in front of all cameras.
fn search(views: &[(DMatrix34, (u32, u32))], corners: &[DVec3; 8]) -> Option<(f64, f64)> {
    let cost = |b: f64, c: f64| -> f64 {
        let points = corners.map(|p| metric_point(p, (b, c)));
        // The whole object on one side of the plane that goes to infinity.
        let is_whole = points.iter().all(|p| p.is_finite() && 1.0 + c * p.z > 0.0);
        let upgrade = upgrade(b, c);
        let of = |(matrix, size): &(DMatrix34, (u32, u32))| -> f64 {
            let Some(camera) = camera_of(&times(matrix, &upgrade), *size) else {
                return f64::INFINITY;
            };
            if points
                .iter()
                .any(|&p| camera.camera_from_object(p).z <= 0.0)
            {
                return f64::INFINITY;
            }
            let middle = 0.5 * DVec2::new(size.0.into(), size.1.into());
            let square = (camera.focal.x / camera.focal.y - 1.0).powi(2)
                + (camera.skew / camera.focal.x).powi(2);
            SQUARE * square + ((camera.principal - middle) / camera.focal).length_squared()
        };
        match is_whole {
            true => views.iter().map(of).sum(),
            false => f64::INFINITY,
        }
    };
    let mut best = (f64::INFINITY, 0.0, 0.0);
    for k in 0..2 * B_STEPS {
        let sign = if k < B_STEPS { 1.0 } else { -1.0 };
        let b = sign * LEAST_B * B_FACTOR.powi((k % B_STEPS) as i32);
        for step in -C_STEPS..=C_STEPS {
            let c = f64::from(step) * C_STEP;
            let found = cost(b, c);
            if found < best.0 {
                best = (found, b, c);
            }
        }
    }
    if !best.0.is_finite() {
        return None;
    }
    let mut step = DVec2::new(0.1 * best.1.abs(), C_STEP);
    for _ in 0..HALVINGS {
        // The valley is oblique to both: walk on as long as it goes down.
        while let Some(better) = [-1.0, 0.0, 1.0]
            .iter()
            .flat_map(|x| [-1.0, 0.0, 1.0].map(|y| (best.1 + x * step.x, best.2 + y * step.y)))
            .map(|(b, c)| (cost(b, c), b, c))
            .filter(|tried| tried.0 < best.0)
            .min_by(|a, b| a.0.total_cmp(&b.0))
        {
            best = better;
        }
        step *= 0.5;
    }
    Some((best.1, best.2))
}
