//! The model's normals on the device, by which a moved light falls: those of each texture view, which its depths tell, and those of the
//! atlas, which are stored. In the object's directions, from −1 to 1 as bytes from 1 to 255, and 128 three times where none is known.
//!
//! Source: Nehab, Rusinkiewicz, Davis, Ramamoorthi. Efficiently Combining Positions and Normals for Precise 3D Geometry. SIGGRAPH 2005,
//! for depths as fields that are smooth within their errors.
//! Deviation: depths are known to half a step of their codes. Within it they are brought to where they bend least, by over-relaxation; so
//! there are no terraces, and what is more than a step deep stays.

use glam::{DVec2, DVec3, Vec3};
use silmap_geometry::{Camera, ColourImage};
use silmap_map::asset::TangentFrames;
use silmap_map::{Atlas, CoarseHull, Relief};

use crate::LoadError;
use crate::textures::decode;

/// Neighbours belong to one surface where it is no steeper than this to the view's forward direction, in lengths deep a length aside.
const STEEPEST: f64 = 8.0;
/// Passes that smooth depths, there and back.
const PASSES: usize = 12;
/// How far a depth goes towards the middle of its neighbours, in shares of the way.
const OVER_RELAXED: f32 = 1.7;
/// Pixels around the model that get the normal next to them, as colours run on there.
const MARGIN_PX: usize = 12;

/// Bytes of no normal.
const NONE: [u8; 4] = [128, 128, 128, 255];

/// The normals of what a view sees, per pixel of its depth picture.
pub(crate) fn of_view(relief: &Relief, view: usize, camera: &Camera) -> ColourImage {
    let field = Field::new(relief, view, camera);
    let depths = field.smooth();
    let (width, height) = (field.width, field.height);
    let places = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let sharp: Vec<Vec3> = places()
        .map(|(x, y)| field.normal(&depths, camera, x, y))
        .collect();
    let mut normals: Vec<Vec3> = places().map(|(x, y)| field.mean(&sharp, x, y)).collect();
    spread(&mut normals, width);
    picture((width as u32, height as u32), normals.into_iter())
}

/// The depth codes of a view.
struct Field<'a> {
    codes: &'a [u16],
    width: usize,
    height: usize,
    /// Depth of code 1, and of a step.
    near: f64,
    step: f64,
    /// How far right and down a pixel is from the next, at depth 1.
    pixel: DVec2,
}

impl<'a> Field<'a> {
    fn new(relief: &'a Relief, view: usize, camera: &Camera) -> Self {
        let (width, height) = (relief.width_px as usize, relief.height_px as usize);
        let of_view = &relief.views[view];
        let steps = f64::from((1_u32 << relief.bits) - 2).max(1.0);
        Self {
            codes: &of_view.codes,
            width,
            height,
            near: of_view.near,
            step: (of_view.far - of_view.near) / steps,
            pixel: camera.half_tangent * 2.0 / DVec2::new(width as f64, height as f64),
        }
    }

    /// The neighbour of a seen pixel, where it is of the same surface.
    fn next(&self, x: usize, y: usize, (dx, dy): (isize, isize)) -> Option<usize> {
        let (nx, ny) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
        if nx >= self.width || ny >= self.height {
            return None;
        }
        let (here, there) = (y * self.width + x, ny * self.width + nx);
        let (a, b) = (self.codes[here], self.codes[there]);
        if a == 0 || b == 0 {
            return None;
        }
        let apart = f64::from(a.abs_diff(b)) * self.step;
        let depth = self.near + f64::from(a.min(b) - 1) * self.step;
        let aside = (self.pixel * DVec2::new(dx as f64, dy as f64)).length() * depth;
        (apart <= STEEPEST * aside).then_some(there)
    }

    /// Depths in steps, without terraces; zero where nothing is seen.
    fn smooth(&self) -> Vec<f32> {
        const WAYS: [(isize, isize); 2] = [(1, 0), (0, 1)];
        // Which pixels have both neighbours of the same surface, across and along.
        let pairs: Vec<[bool; 2]> = (0..self.codes.len())
            .map(|k| {
                let (x, y) = (k % self.width, k / self.width);
                WAYS.map(|(dx, dy)| {
                    self.next(x, y, (dx, dy)).is_some() && self.next(x, y, (-dx, -dy)).is_some()
                })
            })
            .collect();
        let mut depths: Vec<f32> = self.codes.iter().map(|&c| f32::from(c)).collect();
        let mut relax = |k: usize| {
            let [across, along] = pairs[k];
            let (mut sum, mut count) = (0.0, 0.0);
            if across {
                sum += depths[k - 1] + depths[k + 1];
                count += 2.0;
            }
            if along {
                sum += depths[k - self.width] + depths[k + self.width];
                count += 2.0;
            }
            if count > 0.0 {
                let code = f32::from(self.codes[k]);
                let moved = depths[k] + OVER_RELAXED * (sum / count - depths[k]);
                depths[k] = moved.clamp(code - 0.5, code + 0.5);
            }
        };
        for _ in 0..PASSES {
            (0..pairs.len()).for_each(&mut relax);
            (0..pairs.len()).rev().for_each(&mut relax);
        }
        depths
    }

    /// The unit normal at a pixel, towards the eye; zero where nothing is seen or nothing next to it is of the same surface.
    fn normal(&self, depths: &[f32], camera: &Camera, x: usize, y: usize) -> Vec3 {
        let here = y * self.width + x;
        if self.codes[here] == 0 {
            return Vec3::ZERO;
        }
        let slope = |dx: isize, dy: isize| -> Option<f64> {
            let (before, after) = (self.next(x, y, (-dx, -dy)), self.next(x, y, (dx, dy)));
            let (first, last) = (before.unwrap_or(here), after.unwrap_or(here));
            let apart = usize::from(before.is_some()) + usize::from(after.is_some());
            let rise = f64::from(depths[last] - depths[first]) * self.step;
            (apart > 0).then(|| rise / apart as f64)
        };
        let (Some(across), Some(along)) = (slope(1, 0), slope(0, 1)) else {
            return Vec3::ZERO;
        };
        let size = DVec2::new(self.width as f64, self.height as f64);
        let place = (DVec2::new(x as f64, y as f64) + 0.5) / size * 2.0 - 1.0;
        let aside = place * camera.half_tangent;
        let ray = camera.forward + camera.right * aside.x - camera.up * aside.y;
        let depth = self.near + (f64::from(depths[here]) - 1.0) * self.step;
        let to_right = ray * across + camera.right * (depth * self.pixel.x);
        let down = ray * along - camera.up * (depth * self.pixel.y);
        let normal = down.cross(to_right).normalize_or_zero();
        (normal * -normal.dot(ray).signum()).as_vec3()
    }

    /// The mean of the normals of a surface about a pixel.
    fn mean(&self, normals: &[Vec3], x: usize, y: usize) -> Vec3 {
        const REACH: isize = 2;
        let mut sum = normals[y * self.width + x];
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                if (dx, dy) != (0, 0)
                    && let Some(there) = self.next(x, y, (dx, dy))
                {
                    sum += normals[there] / (1 + dx.abs() + dy.abs()) as f32;
                }
            }
        }
        sum.normalize_or_zero()
    }
}

/// Gives pixels around those with a normal the mean of their neighbours', step by step.
fn spread(normals: &mut [Vec3], width: usize) {
    let beside = |k: usize| {
        let left = (!k.is_multiple_of(width)).then(|| k - 1);
        let right = (!(k + 1).is_multiple_of(width)).then(|| k + 1);
        [left, right, k.checked_sub(width), Some(k + width)]
    };
    for _ in 0..MARGIN_PX {
        let found: Vec<(usize, Vec3)> = (0..normals.len())
            .filter(|&k| normals[k] == Vec3::ZERO)
            .filter_map(|k| {
                let near = beside(k).into_iter().flatten();
                let sum: Vec3 = near.filter_map(|n| normals.get(n)).sum();
                Some((k, sum.try_normalize()?))
            })
            .collect();
        for (k, normal) in found {
            normals[k] = normal;
        }
    }
}

/// The atlas's normals, in the object's directions: `None` where it has none.
pub(crate) fn of_atlas(hull: &CoarseHull, atlas: &Atlas) -> Result<Option<ColourImage>, LoadError> {
    let Some(image) = &atlas.normals else {
        return Ok(None);
    };
    let told = decode(image, usize::MAX)?;
    let (width, height) = (told.width as usize, told.height as usize);
    let frames = TangentFrames::new(hull, &atlas.corner_uvs);
    let mut normals = vec![Vec3::ZERO; width * height];
    // How far within the face that it belongs to a texel is, in shares of its height.
    let mut within = vec![MARGIN_SHARE; width * height];
    for (f, face) in hull.faces.iter().enumerate() {
        let size = DVec2::new(width as f64, height as f64);
        let corners = atlas.corner_uvs[f].map(|uv| DVec2::from(uv.map(f64::from)) * size);
        let upward = face.map(|v| Vec3::from(frames.normals[v as usize]));
        let along = frames.tangents[f].map(|[x, y, z, _]| Vec3::new(x, y, z));
        let handed = frames.tangents[f].map(|[.., w]| w);
        for (x, y) in texels_about(corners, (width, height)) {
            let place = DVec2::new(x as f64, y as f64) + 0.5;
            let Some(weights) = weights(corners, place) else {
                break;
            };
            let (texel, least) = (y * width + x, weights.into_iter().fold(1.0, f64::min));
            if least <= within[texel] {
                continue;
            }
            within[texel] = least;
            let blend = |vectors: [Vec3; 3]| -> Vec3 {
                (vectors.iter().zip(weights))
                    .map(|(&v, w)| v * w as f32)
                    .sum::<Vec3>()
                    .normalize_or_zero()
            };
            let [r, g, b] = [0, 1, 2].map(|c| f32::from(told.rgba[4 * texel + c]) / 127.5 - 1.0);
            let aslant = std::array::from_fn(|k| upward[k].cross(along[k]) * handed[k]);
            let normal = blend(along) * r + blend(aslant) * g + blend(upward) * b;
            normals[texel] = normal.normalize_or_zero();
        }
    }
    Ok(Some(picture(
        (told.width, told.height),
        normals.into_iter(),
    )))
}

/// Texels beside a face are filtered with its own.
const MARGIN_SHARE: f64 = -0.3;

/// The texels of a face, and about two around it.
fn texels_about(
    corners: [DVec2; 3],
    (width, height): (usize, usize),
) -> impl Iterator<Item = (usize, usize)> {
    let low = corners[0].min(corners[1]).min(corners[2]) - 2.0;
    let high = corners[0].max(corners[1]).max(corners[2]) + 2.0;
    let range = |low: f64, high: f64, size: usize| {
        (low.max(0.0) as usize).min(size)..(high.max(0.0).ceil() as usize).min(size)
    };
    let columns = range(low.x, high.x, width);
    range(low.y, high.y, height).flat_map(move |y| columns.clone().map(move |x| (x, y)))
}

/// Weights of a triangle's corners at a place in its plane; `None` where it has no area.
fn weights([a, b, c]: [DVec2; 3], place: DVec2) -> Option<[f64; 3]> {
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 || !area.is_finite() {
        return None;
    }
    let of_b = (place - a).perp_dot(c - a) / area;
    let of_c = (b - a).perp_dot(place - a) / area;
    Some([1.0 - of_b - of_c, of_b, of_c])
}

/// One pixel without a normal.
pub(crate) fn none() -> ColourImage {
    picture((1, 1), std::iter::once(Vec3::ZERO))
}

fn picture((width, height): (u32, u32), normals: impl Iterator<Item = Vec3>) -> ColourImage {
    let bytes = |n: Vec3| {
        let [x, y, z] = n.to_array().map(|v| (128.0 + 127.0 * v).round() as u8);
        if n == Vec3::ZERO {
            NONE
        } else {
            [x, y, z, 255]
        }
    };
    ColourImage {
        width,
        height,
        rgba: normals.flat_map(bytes).collect(),
    }
}

/// A unit direction to a light of the world in the object; `None` where it is none.
pub(crate) fn to_light(direction: DVec3) -> Option<DVec3> {
    // Lengths whose squares are no numbers are directions too.
    let largest = direction.abs().max_element();
    (direction.is_finite() && largest > 0.0)
        .then(|| (direction / largest).try_normalize())
        .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use silmap_map::DepthPicture;

    const SIDE_PX: u32 = 160;

    /// The unit sphere before an eye, by depths of so many bits.
    fn sphere(bits: u32) -> (Relief, Camera) {
        let eye = DVec3::new(1.0, -2.0, 2.0);
        let camera = Camera::fit_sphere(eye, DVec3::ZERO, 1.0, None, (SIDE_PX, SIDE_PX)).unwrap();
        let (near, far) = (2.0, 3.0);
        let codes = (0..SIDE_PX * SIDE_PX).map(|k| {
            let hit = hit(&camera, k);
            let share = hit.map(|p| (camera.depth(p) - near) / (far - near));
            share.map_or(0, |s| {
                1 + (s * f64::from((1_u32 << bits) - 2)).round() as u16
            })
        });
        let views = vec![DepthPicture {
            near,
            far,
            codes: codes.collect(),
        }];
        let relief = Relief {
            bits,
            width_px: SIDE_PX,
            height_px: SIDE_PX,
            views,
        };
        (relief, camera)
    }

    /// Where a pixel sees the sphere.
    fn hit(camera: &Camera, pixel: u32) -> Option<DVec3> {
        let place = DVec2::new(f64::from(pixel % SIDE_PX), f64::from(pixel / SIDE_PX)) + 0.5;
        let way = (camera.object_from_image(place, 1.0) - camera.eye).normalize_or_zero();
        let middle = -camera.eye.dot(way);
        let half = 1.0 - camera.eye.length_squared() + middle * middle;
        (half > 0.0).then(|| camera.eye + way * (middle - half.sqrt()))
    }

    /// The mean angle between a sphere's normals and those found, degrees.
    fn error(found: &ColourImage, camera: &Camera) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (k, texel) in (0..).zip(found.rgba.chunks(4)) {
            let Some(wanted) = hit(camera, k) else {
                continue;
            };
            let normal = DVec3::from([0, 1, 2].map(|c| f64::from(texel[c]) - 128.0));
            sum += normal.angle_between(wanted).to_degrees();
            count += 1.0;
        }
        sum / count
    }

    #[test]
    fn normals_of_a_sphere_are_its_own() {
        for (bits, most) in [(7, 5.0), (9, 2.5), (12, 1.5)] {
            let (relief, camera) = sphere(bits);
            let found = of_view(&relief, 0, &camera);
            let off = error(&found, &camera);
            assert!(off < most, "{off}° by {bits} bits");
        }
        // A control: those of another view.
        let (relief, camera) = sphere(9);
        let mut turned = camera;
        std::mem::swap(&mut turned.right, &mut turned.up);
        assert!(error(&of_view(&relief, 0, &turned), &camera) > 20.0);
    }

    #[test]
    fn a_jump_is_no_slope() {
        let (mut relief, camera) = sphere(12);
        // Two flat sheets, one behind the other.
        for (k, code) in relief.views[0].codes.iter_mut().enumerate() {
            *code = if k % (SIDE_PX as usize) < 80 {
                100
            } else {
                3000
            };
        }
        let found = of_view(&relief, 0, &camera);
        let forward = camera.forward;
        for texel in found.rgba.chunks(4) {
            let normal = DVec3::from([0, 1, 2].map(|c| f64::from(texel[c]) - 128.0));
            assert!(
                normal.angle_between(-forward).to_degrees() < 1.0,
                "{texel:?}"
            );
        }
    }

    #[test]
    fn what_is_no_direction_is_none() {
        for direction in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
            assert_eq!(to_light(direction), None);
        }
        for length in [1e-300, 1.0, 1e300] {
            assert_eq!(to_light(DVec3::Y * length), Some(DVec3::Y));
        }
    }
}
