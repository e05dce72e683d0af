//! Packing of tiles in the atlas.
//!
//! Each face has a right-angled triangle of texels, two to a square, padded so that bilinear filtering never reaches another face.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 4, for tiles of one size.
//! Deviations: tiles may also follow the faces' areas, so that all of the hull has about as many texels an area. Their sides are
//! eight texels times a power of two; placed by falling size along a Z-curve they leave no gaps.

use glam::DVec2;

use super::TileSizes;

/// Texels between a tile's border and its triangles' corners, so that bilinear filtering stays inside.
const PADDING_TEXELS: f64 = 1.0;

/// Smallest side of a square: legs of four texels.
const MIN_SQUARE_TEXELS: u32 = 8;

/// Doublings between the smallest and the largest square.
const MAX_DOUBLINGS: u32 = 4;

/// Share of the side asked for that an atlas of whole largest squares must reach.
const LEAST_FILLED_SHARE: f64 = 0.88;

/// Halvings of the interval in which the density of texels is looked for.
const DENSITY_STEPS: u32 = 60;

/// A square with one or two faces.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Square {
    /// Top-left corner, texels.
    corner: DVec2,
    side: f64,
    face: u32,
    second: Option<u32>,
}

/// Where each face's tile lies.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TileLayout {
    squares: Vec<Square>,
    /// Per face: its square, and whether it has the square's second triangle.
    of_face: Vec<(u32, bool)>,
    /// The picture in cells of `cell` texels a side, row by row: the square that each belongs to.
    cells: Vec<Option<u32>>,
    cell: u32,
    cells_a_side: u32,
}

/// A texel's place on the hull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) face: usize,
    /// Weights of the face's corners, clamped to the face.
    pub(super) weights: [f64; 3],
}

impl TileLayout {
    /// Tiles for faces of these areas in a square of about `size_px` texels a side; more when the tiles would get too small.
    pub(super) fn new(areas: &[f64], size_px: u32, sizes: TileSizes) -> Self {
        match sizes {
            TileSizes::Fixed => Self::fixed(areas.len(), size_px),
            TileSizes::Adaptive => Self::adaptive(areas, size_px),
        }
    }

    fn fixed(face_count: usize, size_px: u32) -> Self {
        let pairs = face_count.div_ceil(2).max(1);
        let mut grid = (pairs as f64).sqrt() as u32;
        while (grid as usize).pow(2) < pairs {
            grid += 1;
        }
        let cell = (size_px / grid).max(MIN_SQUARE_TEXELS);
        let mut layout = Self::empty(face_count, cell, grid);
        for pair in 0..face_count.div_ceil(2) as u32 {
            let faces = (2 * pair, Some(2 * pair + 1));
            layout.put(faces, [pair % grid, pair / grid], 1);
        }
        layout
    }

    fn adaptive(areas: &[f64], size_px: u32) -> Self {
        let most_cells = (size_px / MIN_SQUARE_TEXELS).max(1);
        // The largest squares that leave hardly a margin when the picture is made of whole ones.
        let is_filled = |doublings: &u32| {
            let whole = most_cells >> doublings << doublings;
            f64::from(whole) >= LEAST_FILLED_SHARE * f64::from(most_cells)
        };
        let most_doublings = most_cells.ilog2().min(MAX_DOUBLINGS);
        let doublings = (0..=most_doublings).rev().find(is_filled).unwrap_or(0);
        let block = 1_u32 << doublings;
        let pairs = areas.len().div_ceil(2) as u64;
        // Blocks of the largest square's size, row by row; each is filled along a Z-curve.
        let mut blocks = (most_cells / block).max(1);
        while u64::from(blocks * block).pow(2) < pairs {
            blocks += 1;
        }
        let capacity = u64::from(blocks * block).pow(2);
        let classes = largest_fitting(areas, doublings, capacity);
        let mut layout = Self::empty(areas.len(), MIN_SQUARE_TEXELS, blocks * block);
        let mut next_cell = 0_u64;
        for class in (0..=doublings).rev() {
            let faces: Vec<u32> = (0..areas.len() as u32)
                .filter(|&f| classes[f as usize] == class)
                .collect();
            for pair in faces.chunks(2) {
                let [x, y] = cell_on_curve(next_cell, block, blocks);
                layout.put((pair[0], pair.get(1).copied()), [x, y], 1 << class);
                next_cell += 1 << (2 * class);
            }
        }
        layout
    }

    fn empty(face_count: usize, cell: u32, cells_a_side: u32) -> Self {
        Self {
            squares: Vec::new(),
            of_face: vec![(0, false); face_count],
            cells: vec![None; cells_a_side.pow(2) as usize],
            cell,
            cells_a_side,
        }
    }

    /// Puts one or two faces into a square whose corner and side are given in cells; a second face that there is not leaves its
    /// triangle to the first.
    fn put(&mut self, (face, second): (u32, Option<u32>), [x, y]: [u32; 2], side: u32) {
        let index = self.squares.len() as u32;
        let second = second.filter(|&f| (f as usize) < self.of_face.len());
        self.of_face[face as usize] = (index, false);
        if let Some(second) = second {
            self.of_face[second as usize] = (index, true);
        }
        for row in y..y + side {
            let start = (row * self.cells_a_side + x) as usize;
            self.cells[start..start + side as usize].fill(Some(index));
        }
        self.squares.push(Square {
            corner: DVec2::new(x.into(), y.into()) * f64::from(self.cell),
            side: f64::from(side * self.cell),
            face,
            second,
        });
    }

    /// Side of the whole picture, texels.
    pub(super) fn side(&self) -> u32 {
        self.cell * self.cells_a_side
    }

    /// The corners of a face's triangle, texels of the whole picture.
    fn corners(&self, face: usize) -> [DVec2; 3] {
        let (square, is_second) = self.of_face[face];
        let square = &self.squares[square as usize];
        [DVec2::ZERO, DVec2::X, DVec2::Y].map(|p| {
            let place = DVec2::splat(PADDING_TEXELS) + p * square.leg();
            square.corner + square.turned(place, is_second)
        })
    }

    /// Texture coordinates of a face's corners.
    pub(super) fn corner_uvs(&self, face: usize) -> [[f32; 2]; 3] {
        let side = f64::from(self.side());
        self.corners(face).map(|p| (p / side).as_vec2().to_array())
    }

    /// The face that owns a place in texels; `None` in unused squares.
    pub(super) fn place_at(&self, at: DVec2) -> Option<Place> {
        let last = f64::from(self.cells_a_side - 1);
        let cell = (at / f64::from(self.cell))
            .floor()
            .clamp(DVec2::ZERO, DVec2::splat(last));
        let index = cell.y as usize * self.cells_a_side as usize + cell.x as usize;
        let square = &self.squares[self.cells[index]? as usize];
        let within = at - square.corner;
        let is_beyond = within.x + within.y > square.side;
        let (face, is_second) = match square.second {
            Some(second) if is_beyond => (second, true),
            // An odd count leaves the last triangle empty: it repeats its neighbour.
            _ => (square.face, false),
        };
        let p = square.turned(within, is_second) - DVec2::splat(PADDING_TEXELS);
        Some(Place {
            face: face as usize,
            weights: clamped_weights(p / square.leg()),
        })
    }
}

impl Square {
    /// Length of the triangles' legs, texels.
    fn leg(&self) -> f64 {
        leg_of(self.side)
    }

    /// A place in the square, as seen by its first triangle: the second is the first turned by half a turn.
    fn turned(&self, place: DVec2, is_second: bool) -> DVec2 {
        match is_second {
            true => DVec2::splat(self.side) - place,
            false => place,
        }
    }
}

/// Legs of the triangles in a square of that side: both keep the distance that bilinear filtering needs from the diagonal they
/// share.
fn leg_of(side: f64) -> f64 {
    side - 4.0 * PADDING_TEXELS
}

/// How often each face's square is doubled, at the largest density of texels whose squares are within `capacity` cells.
fn largest_fitting(areas: &[f64], doublings: u32, capacity: u64) -> Vec<u32> {
    let classes_at = |density: f64| -> Vec<u32> {
        let class = |area: &f64| {
            let side = (2.0 * area).sqrt() * density + 4.0 * PADDING_TEXELS;
            // To the nearest by ratio; casts of floats saturate.
            let doubled = (side / f64::from(MIN_SQUARE_TEXELS)).log2().round();
            (doubled.max(0.0) as u32).min(doublings)
        };
        areas.iter().map(class).collect()
    };
    let fits = |classes: &[u32]| {
        let count = |class: u32| classes.iter().filter(|&&c| c == class).count() as u64;
        let cells = |class: u32| count(class).div_ceil(2) << (2 * class);
        (0..=doublings).map(cells).sum::<u64>() <= capacity
    };
    let largest = areas.iter().copied().fold(0.0, f64::max);
    // At this density the largest face alone would have the largest square doubled again.
    let side = f64::from(MIN_SQUARE_TEXELS << (doublings + 1));
    let mut low = 0.0;
    let mut high = side / (2.0 * largest.max(f64::MIN_POSITIVE)).sqrt();
    // And at this one the smallest face that has an area.
    let positive = areas.iter().copied().filter(|&a| a > 0.0);
    let smallest = positive.fold(f64::INFINITY, f64::min);
    if smallest.is_finite() {
        high = high.max(side / (2.0 * smallest).sqrt());
    }
    if fits(&classes_at(high)) {
        return classes_at(high);
    }
    for _ in 0..DENSITY_STEPS {
        // By ratio once there is one: densities span powers of ten.
        let middle = if low > 0.0 {
            (low * high).sqrt()
        } else {
            high / 16.0
        };
        match fits(&classes_at(middle)) {
            true => low = middle,
            false => high = middle,
        }
    }
    classes_at(low)
}

/// Column and row of the n-th cell: blocks row by row, in each of them a Z-curve.
fn cell_on_curve(n: u64, block: u32, blocks_a_side: u32) -> [u32; 2] {
    let in_block = u64::from(block).pow(2);
    let (which, within) = (n / in_block, n % in_block);
    let blocks = u64::from(blocks_a_side);
    let corner = [which % blocks, which / blocks].map(|b| b as u32 * block);
    let every_second_bit =
        |n: u64| (0..u32::BITS).fold(0_u32, |sum, bit| sum | ((n >> (2 * bit) & 1) as u32) << bit);
    [
        corner[0] + every_second_bit(within),
        corner[1] + every_second_bit(within >> 1),
    ]
}

/// Weights of the corners (0,0), (1,0), (0,1) at the nearest point of their triangle.
fn clamped_weights(p: DVec2) -> [f64; 3] {
    let p = p.max(DVec2::ZERO);
    let p = if p.x + p.y > 1.0 {
        let x = (0.5 * (1.0 + p.x - p.y)).clamp(0.0, 1.0);
        DVec2::new(x, 1.0 - x)
    } else {
        p
    };
    [1.0 - p.x - p.y, p.x, p.y]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Areas over several powers of ten, some of them zero.
    fn uneven(face_count: usize) -> Vec<f64> {
        (0..face_count)
            .map(|f| match f % 17 {
                16 => 0.0,
                k => 10.0_f64.powf(-0.2 * k as f64) * (1.0 + (f as f64 * 0.618).fract()),
            })
            .collect()
    }

    fn layouts() -> impl Iterator<Item = (usize, TileLayout)> {
        let counts = [
            (1, 16),
            (2, 8),
            (7, 40),
            (51, 64),
            (500, 512),
            (333, 200),
            (4000, 128),
        ];
        counts.into_iter().flat_map(|(face_count, size)| {
            [TileSizes::Fixed, TileSizes::Adaptive].map(|sizes| {
                (
                    face_count,
                    TileLayout::new(&uneven(face_count), size, sizes),
                )
            })
        })
    }

    #[test]
    fn no_two_faces_share_a_texel_and_bilinear_samples_stay_in_their_face() {
        for (face_count, layout) in layouts() {
            let side = f64::from(layout.side());
            for face in 0..face_count {
                let corners = layout.corners(face);
                for (i, j) in (0..=8).flat_map(|i| (0..=8 - i).map(move |j| (i, j))) {
                    let weights = [i, j, 8 - i - j].map(|w| f64::from(w) / 8.0);
                    let place: DVec2 = (0..3).map(|k| corners[k] * weights[k]).sum();
                    // The four texels that a bilinear sample reads.
                    for k in 0..4 {
                        let step = DVec2::new((k % 2).into(), (k / 2).into());
                        let centre = (place - 0.5).floor() + step + 0.5;
                        if centre.cmpge(DVec2::ZERO).all() && centre.cmplt(DVec2::splat(side)).all()
                        {
                            let owner = layout.place_at(centre).map(|p| p.face);
                            // A texel on the diagonal with no weight may be the other's.
                            let is_read = (centre - place).abs().max_element() < 1.0 - 1e-9;
                            assert!(!is_read || owner == Some(face), "{face} of {face_count}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn weights_at_the_corners_and_beyond() {
        for (face_count, layout) in layouts() {
            for face in 0..face_count {
                for (k, corner) in layout.corners(face).into_iter().enumerate() {
                    let found = layout.place_at(corner).unwrap();
                    assert_eq!(found.face, face);
                    assert!((found.weights[k] - 1.0).abs() < 1e-9, "{found:?}");
                }
            }
        }
        for p in [(-3.0, 0.2), (0.5, 2.0), (7.0, 0.0), (0.6, 0.6)] {
            let weights = clamped_weights(DVec2::from(p));
            assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)));
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn five_hundred_faces_have_about_five_hundred_texels_each() {
        let layout = TileLayout::new(&[1.0; 500], 512, TileSizes::Fixed);
        assert_eq!((layout.side(), layout.cell), (512, 32));
        // Equal faces get equal tiles when they are adaptive, too, in a picture of the same size.
        let adaptive = TileLayout::new(&[1.0; 500], 512, TileSizes::Adaptive);
        assert_eq!(adaptive.side(), 512);
        assert!(adaptive.squares.iter().all(|s| s.side == 32.0));
    }

    #[test]
    fn adaptive_tiles_follow_the_areas_and_fill_the_picture() {
        let areas: Vec<f64> = (0..500)
            .map(|f| if f % 5 == 0 { 16.0 } else { 1.0 })
            .collect();
        let layout = TileLayout::new(&areas, 512, TileSizes::Adaptive);
        let leg = |face: usize| layout.corners(face)[0].distance(layout.corners(face)[1]);
        assert_eq!(layout.side(), 512);
        assert!(leg(0) > 3.0 * leg(1), "{} and {}", leg(0), leg(1));
        // Uneven areas of all sizes leave hardly a cell unused.
        let layout = TileLayout::new(&uneven(500), 512, TileSizes::Adaptive);
        let unused = layout.cells.iter().filter(|c| c.is_none()).count();
        assert!(
            unused * 20 < layout.cells.len(),
            "{unused} cells are unused"
        );
        let density = |sizes| {
            let layout = TileLayout::new(&uneven(500), 512, sizes);
            let texels = |f: usize| {
                let [a, b, c] = layout.corners(f);
                0.5 * (b - a).perp_dot(c - a) / uneven(500)[f]
            };
            let all = (0..500).filter(|f| f % 17 != 16).map(texels);
            let (low, high) = all.fold((f64::INFINITY, 0.0_f64), |(l, h), d| (l.min(d), h.max(d)));
            high / low
        };
        let (fixed, adaptive) = (density(TileSizes::Fixed), density(TileSizes::Adaptive));
        assert!(adaptive < 0.25 * fixed, "{adaptive} against {fixed}");
    }
}
