//! Triangle meshes and their appearance.

use glam::DVec3;

/// An 8-bit image in memory, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColourImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// sRGB-encoded red, green, blue and linear alpha, four bytes a pixel.
    pub rgba: Vec<u8>,
}

/// What a texture shows outside of its picture, along one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureWrap {
    /// The picture again and again.
    #[default]
    Repeat,
    /// The picture and its mirror image in turn.
    MirroredRepeat,
    /// The texels at its border.
    ClampToEdge,
}

/// Colour of a group of faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Material {
    /// Linear RGB factor.
    pub base_colour: [f32; 3],
    /// Colour texture, sampled at the corners' texture coordinates and multiplied by `base_colour`.
    pub texture: Option<ColourImage>,
    /// What the texture shows outside of its picture, along u and v.
    pub wrap: [TextureWrap; 2],
}

/// What a mesh looks like: everything is optional, and an empty vector means "none in the file".
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Appearance {
    /// Per face and corner: texture coordinates, u right and v *down* from the top-left of the texture.
    pub corner_uvs: Vec<[[f32; 2]; 3]>,
    /// Per face and corner: linear RGB vertex colours.
    pub corner_colours: Vec<[[f32; 3]; 3]>,
    /// Per face: an index into `materials`.
    pub face_materials: Vec<u16>,
    /// The materials.
    pub materials: Vec<Material>,
}

impl Appearance {
    /// Whether the file said anything about colour.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        self.corner_colours.is_empty() && self.materials.is_empty()
    }

    /// Linear RGB albedo at a point of a face given by barycentric weights of its corners: material factor times texture
    /// (bilinear, wrapped as the material says) times vertex colour, or [`crate::lighting::DEFAULT_ALBEDO`] when the mesh is
    /// plain.
    #[must_use]
    pub fn albedo(&self, face: usize, weights: [f32; 3]) -> [f32; 3] {
        if self.is_plain() {
            return crate::lighting::DEFAULT_ALBEDO;
        }
        let mut colour = [1.0_f32; 3];
        if let Some(corners) = self.corner_colours.get(face) {
            for c in 0..3 {
                colour[c] *= (0..3).map(|k| weights[k] * corners[k][c]).sum::<f32>();
            }
        }
        let material = self
            .face_materials
            .get(face)
            .and_then(|&m| self.materials.get(usize::from(m)));
        if let Some(material) = material {
            for (c, factor) in colour.iter_mut().zip(material.base_colour) {
                *c *= factor;
            }
            if let (Some(texture), Some(uvs)) = (&material.texture, self.corner_uvs.get(face)) {
                let uv = [0, 1].map(|a| (0..3).map(|k| weights[k] * uvs[k][a]).sum::<f32>());
                for (c, texel) in colour
                    .iter_mut()
                    .zip(texture.sample_linear(uv, material.wrap))
                {
                    *c *= texel;
                }
            }
        }
        colour
    }
}

impl TextureWrap {
    /// A texture coordinate moved by whole periods into the first one, so that it keeps its digits as a texel's number.
    fn within_one_period(self, coordinate: f32) -> f32 {
        match self {
            Self::Repeat => coordinate - coordinate.floor(),
            Self::MirroredRepeat => coordinate - 2.0 * (0.5 * coordinate).floor(),
            Self::ClampToEdge => coordinate.clamp(0.0, 1.0),
        }
    }

    /// The texel that stands at place `index` of an endless row, of which the picture holds the first `count`.
    ///
    /// # Panics
    /// When `count` is zero.
    #[must_use]
    pub fn texel(self, index: i64, count: usize) -> usize {
        let count = count as i64;
        let found = match self {
            Self::Repeat => index.rem_euclid(count),
            Self::MirroredRepeat => {
                let place = index.rem_euclid(2 * count);
                place.min(2 * count - 1 - place)
            }
            Self::ClampToEdge => index.clamp(0, count - 1),
        };
        found as usize
    }
}

impl ColourImage {
    /// Linear RGB at texture coordinates (u right, v down), bilinear; `wrap` says along u and v what lies outside.
    #[must_use]
    pub fn sample_linear(&self, uv: [f32; 2], wrap: [TextureWrap; 2]) -> [f32; 3] {
        let (w, h) = (self.width as usize, self.height as usize);
        if w == 0 || h == 0 {
            return [1.0; 3];
        }
        let x = wrap[0].within_one_period(uv[0]) * w as f32 - 0.5;
        let y = wrap[1].within_one_period(uv[1]) * h as f32 - 0.5;
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let texels = |wrap: TextureWrap, v: f32, count: usize| {
            let first = v.floor() as i64;
            [first, first + 1].map(|i| wrap.texel(i, count))
        };
        let ([x0, x1], [y0, y1]) = (texels(wrap[0], x, w), texels(wrap[1], y, h));
        let texel = |i: usize, j: usize, c: usize| {
            crate::lighting::linear_from_srgb(f32::from(self.rgba[(j * w + i) * 4 + c]) / 255.0)
        };
        [0, 1, 2].map(|c| {
            let top = texel(x0, y0, c) * (1.0 - fx) + texel(x1, y0, c) * fx;
            let bottom = texel(x0, y1, c) * (1.0 - fx) + texel(x1, y1, c) * fx;
            top * (1.0 - fy) + bottom * fy
        })
    }
}

/// A triangle mesh, with no promise about its topology.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions, object space.
    pub positions: Vec<DVec3>,
    /// Three vertex indices a face, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
    /// What it looks like.
    pub appearance: Appearance,
}

impl TriangleMesh {
    /// The three corners of a face.
    #[must_use]
    pub fn corners(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|v| self.positions[v as usize])
    }

    /// Twice the area of a face times its outward unit normal.
    #[must_use]
    pub fn face_cross(&self, face: usize) -> DVec3 {
        let [a, b, c] = self.corners(face);
        (b - a).cross(c - a)
    }

    /// Signed volume (divergence theorem), about the mesh's own middle so that far-away models keep their digits.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let origin = self.bounds().center;
        let six: f64 = (0..self.faces.len())
            .map(|f| {
                let [a, b, c] = self.corners(f).map(|p| p - origin);
                a.dot(b.cross(c))
            })
            .sum();
        six / 6.0
    }

    /// Box and sphere around the vertices that faces use (around all vertices when there is no face).
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        if self.faces.is_empty() {
            return Bounds::of_points(self.positions.iter().copied());
        }
        Bounds::of_points(
            self.faces
                .iter()
                .flatten()
                .map(|&v| self.positions[v as usize]),
        )
    }

    /// Unit vertex normals, weighted by the angle at each corner; zero for vertices without a proper face.
    #[must_use]
    pub fn vertex_normals(&self) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; self.positions.len()];
        for (f, face) in self.faces.iter().enumerate() {
            let corners = self.corners(f);
            let normal = self.face_cross(f).normalize_or_zero();
            for k in 0..3 {
                let to_next = corners[(k + 1) % 3] - corners[k];
                let to_previous = corners[(k + 2) % 3] - corners[k];
                let angle = to_next.angle_between(to_previous);
                if angle.is_finite() {
                    normals[face[k] as usize] += normal * angle;
                }
            }
        }
        for n in &mut normals {
            *n = n.normalize_or_zero();
        }
        normals
    }
}

/// A box, and a sphere about the box's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
    /// The middle of the box: the model's `center`.
    pub center: DVec3,
    /// Largest distance of a point from `center`.
    pub radius: f64,
}

impl Bounds {
    /// Bounds of some points; everything is zero when there are none.
    #[must_use]
    pub fn of_points(points: impl Iterator<Item = DVec3> + Clone) -> Self {
        let (min, max) = points
            .clone()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
                (low.min(p), high.max(p))
            });
        if min.x > max.x {
            return Self {
                min: DVec3::ZERO,
                max: DVec3::ZERO,
                center: DVec3::ZERO,
                radius: 0.0,
            };
        }
        let center = min + (max - min) * 0.5;
        let radius = points
            .map(|p| p.distance_squared(center))
            .fold(0.0, f64::max)
            .sqrt();
        Self {
            min,
            max,
            center,
            radius,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_are_repeated_mirrored_or_clamped_along_each_axis() {
        use TextureWrap::{ClampToEdge, MirroredRepeat, Repeat};
        // Red, green and blue from left to right.
        let image = ColourImage {
            width: 3,
            height: 1,
            rgba: vec![255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255],
        };
        let shown = |wrap: TextureWrap| {
            let middle = |i: i32| (i as f32 + 0.5) / 3.0;
            let name = |i: i32| {
                let colour = image.sample_linear([middle(i), 7.3], [wrap, Repeat]);
                ['r', 'g', 'b'][(0..3).find(|&c| colour[c] > 0.99).unwrap()]
            };
            (-4..7).map(name).collect::<String>()
        };
        assert_eq!(shown(Repeat), "brgbrgbrgbr");
        assert_eq!(shown(MirroredRepeat), "bbgrrgbbgrr");
        assert_eq!(shown(ClampToEdge), "rrrrrgbbbbb");
        // At the border a neighbour is mixed in, or not.
        let at_zero = |wrap| image.sample_linear([0.0, 0.5], [wrap, Repeat]);
        assert_eq!(at_zero(Repeat), [0.5, 0.0, 0.5]);
        assert_eq!(at_zero(MirroredRepeat), [1.0, 0.0, 0.0]);
        assert_eq!(at_zero(ClampToEdge), [1.0, 0.0, 0.0]);
        let turned = ColourImage {
            width: 1,
            height: 3,
            ..image.clone()
        };
        assert_eq!(
            turned.sample_linear([0.5, 1.2], [Repeat, ClampToEdge]),
            [0.0, 0.0, 1.0]
        );
        for strange in [f32::NAN, f32::INFINITY, -f32::MAX, 1e30] {
            for wrap in [Repeat, MirroredRepeat, ClampToEdge] {
                let _ = image.sample_linear([strange; 2], [wrap; 2]);
            }
        }
    }
}
