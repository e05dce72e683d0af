//! Contours of several parts as adaptive bits ([`arithmetic`](super::arithmetic)): an edge by the direction and the length of the one before,
//! a depth by its edge, a level by how far its vertex sticks out.
//!
//! Source: the idea of coding an edge in the frame of the one before is that of differential chain codes: Freeman, Application of the
//! Generalized Chain Coding Scheme to Map Data Processing, 1978. The bits are found as in [`relief`](super::relief).

use glam::DVec2;

use super::AssetError;
use super::arithmetic::{Bit, BitReader, BitWriter, Coder};
use super::rounding::{Grid, MAX_STEPS, POINT_GRID};
use crate::{SilhouetteMap, ViewContour};

const PART: &str = "silhouettes";

/// Most contour vertices of a map: more than any has, and few enough to be kept.
const MOST_POINTS: usize = 1 << 24;

pub(super) fn too_many(what: &'static str, value: f64, limit: f64) -> AssetError {
    AssetError::OutOfRange { what, value, limit }
}

/// A contour in steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Rounded {
    part: u16,
    points: Vec<[i64; 2]>,
    /// As many, or none.
    depths: Vec<i64>,
    /// As many, or none where all vertices are of every level.
    levels: Vec<u8>,
}

impl Rounded {
    pub(super) fn of(contour: &ViewContour, depth_grid: &Grid) -> Result<Self, AssetError> {
        let expected = contour.points.len();
        let counts = [
            ("depths of a contour", contour.depths.len()),
            ("levels of a contour", contour.levels.len()),
        ];
        for (what, found) in counts {
            if found != 0 && found != expected {
                return Err(AssetError::Count {
                    what,
                    found,
                    expected,
                });
            }
        }
        let point = |p: &DVec2| Ok([POINT_GRID.steps(p.x)?, POINT_GRID.steps(p.y)?]);
        let points = contour.points.iter().map(point);
        let depths = contour.depths.iter().map(|&d| depth_grid.steps(d));
        Ok(Self {
            part: contour.part,
            points: points.collect::<Result<_, AssetError>>()?,
            depths: depths.collect::<Result<_, _>>()?,
            levels: contour.levels.clone(),
        })
    }

    pub(super) fn contour(self, depth_grid: &Grid) -> Result<ViewContour, AssetError> {
        let point = |&[x, y]: &[i64; 2]| Ok(DVec2::new(POINT_GRID.value(x)?, POINT_GRID.value(y)?));
        let points = self.points.iter().map(point);
        let depths = self.depths.iter().map(|&d| depth_grid.value(d));
        Ok(ViewContour {
            part: self.part,
            points: points.collect::<Result<_, AssetError>>()?,
            depths: depths.collect::<Result<_, _>>()?,
            levels: self.levels,
        })
    }
}

/// Bits of the largest number: a difference of two of at most [`MAX_STEPS`], or of such.
const NUMBER_BITS: usize = 44;

/// How probable the bits of a number are.
#[derive(Clone, Copy, Debug)]
struct NumberModel {
    /// Whether it has more binary digits than this.
    is_longer: [Bit; NUMBER_BITS],
}

impl NumberModel {
    const NEW: Self = Self {
        is_longer: [Bit::NEW; NUMBER_BITS],
    };
}

/// How probable the first bits after the highest one of a number are, by how many there are and by those before.
type HeadModel = [[Bit; 8]; NUMBER_BITS];

/// So many bits after the highest one are learnt, of numbers of either kind.
const HEAD_ALONG: usize = 3;
const HEAD_ACROSS: usize = 2;

const SLOPES: usize = 5;
const LENGTHS: usize = 13;
const TURNS: usize = 3;
const HEIGHTS: usize = 7;
const LEVELS: usize = ViewContour::COARSEST_LEVEL as usize;

/// What has been learnt of how probable bits are.
#[derive(Debug)]
struct Models {
    count: NumberModel,
    step: NumberModel,
    has_depth: Bit,
    /// Of first points and their depths.
    first: [NumberModel; 3],
    first_sign: [Bit; 3],
    first_head: HeadModel,
    /// Of an edge along the greater coordinate of the one before, by its slope and its length.
    along: [[NumberModel; LENGTHS]; SLOPES],
    along_sign: [Bit; SLOPES],
    along_head: HeadModel,
    /// Across, by whether it goes back and by its length along.
    across: [[NumberModel; LENGTHS]; 2],
    across_sign: [Bit; TURNS],
    across_head: HeadModel,
    /// Of depths, by the length of the edge and by the difference before.
    depth: [[NumberModel; 7]; LENGTHS],
    depth_sign: [Bit; TURNS],
    depth_head: HeadModel,
    /// Of levels, by the two vertices before and by height.
    stays: [[[Bit; HEIGHTS]; 4]; LEVELS],
}

impl Models {
    fn new() -> Box<Self> {
        let head = [[Bit::NEW; 8]; NUMBER_BITS];
        Box::new(Self {
            count: NumberModel::NEW,
            step: NumberModel::NEW,
            has_depth: Bit::NEW,
            first: [NumberModel::NEW; 3],
            first_sign: [Bit::NEW; 3],
            first_head: head,
            along: [[NumberModel::NEW; LENGTHS]; SLOPES],
            along_sign: [Bit::NEW; SLOPES],
            along_head: head,
            across: [[NumberModel::NEW; LENGTHS]; 2],
            across_sign: [Bit::NEW; TURNS],
            across_head: head,
            depth: [[NumberModel::NEW; 7]; LENGTHS],
            depth_sign: [Bit::NEW; TURNS],
            depth_head: head,
            stays: [[[Bit::NEW; HEIGHTS]; 4]; LEVELS],
        })
    }
}

/// Whether a contour ends is not learnt: so no few bits can claim many vertices.
const GOES_ON: f64 = 31.0 / 32.0;

/// Binary digits of a number without its sign.
fn digits(value: i64) -> usize {
    (u64::BITS - value.unsigned_abs().leading_zeros()) as usize
}

/// Codes a number that is not negative; a reader's number does not matter.
fn code_size<C: Coder>(
    coder: &mut C,
    model: &mut NumberModel,
    head: &mut HeadModel,
    learnt: usize,
    size: u64,
) -> u64 {
    let wanted = (u64::BITS - size.leading_zeros()) as usize;
    let mut n = 0;
    while n < NUMBER_BITS && coder.bit(&mut model.is_longer[n], wanted > n) {
        n += 1;
    }
    if n == 0 {
        return 0;
    }
    let mut found = 1_u64;
    for k in (0..n - 1).rev() {
        let bit = size >> k & 1 == 1;
        let bit = if n - 2 - k < learnt {
            coder.bit(&mut head[n - 1][found as usize], bit)
        } else {
            coder.bit(&mut { Bit::NEW }, bit)
        };
        found = found << 1 | u64::from(bit);
    }
    found
}

/// Codes a number with a sign.
fn code_number<C: Coder>(
    coder: &mut C,
    (model, sign): (&mut NumberModel, &mut Bit),
    (head, learnt): (&mut HeadModel, usize),
    value: i64,
) -> i64 {
    let size = code_size(coder, model, head, learnt, value.unsigned_abs()) as i64;
    if size != 0 && coder.bit(sign, value < 0) {
        -size
    } else {
        size
    }
}

/// Contours on their way into bits, or out of them.
pub(super) struct ContourCoder<C> {
    bits: C,
    models: Box<Models>,
    has_levels: bool,
    /// Vertices so far.
    points: usize,
    part: u16,
    last: [i64; 2],
    last_depth: i64,
}

/// The edge before, and which way it turned.
#[derive(Clone, Copy, Debug, Default)]
struct Before {
    edge: [i64; 2],
    turn: i64,
    depth: i64,
}

/// The frame of an edge: its greater coordinate first, both turned to be positive.
#[derive(Clone, Copy, Debug)]
struct EdgeFrame {
    is_swapped: bool,
    is_turned: [bool; 2],
    along: i64,
    across: i64,
}

impl EdgeFrame {
    fn of(edge: [i64; 2]) -> Self {
        let is_swapped = edge[0].unsigned_abs() < edge[1].unsigned_abs();
        let [along, across] = if is_swapped { [edge[1], edge[0]] } else { edge };
        Self {
            is_swapped,
            is_turned: [along < 0, across < 0],
            along: along.abs(),
            across: across.abs(),
        }
    }

    fn enter(&self, [x, y]: [i64; 2]) -> [i64; 2] {
        let [a, b] = if self.is_swapped { [y, x] } else { [x, y] };
        let turned = |value: i64, is_turned: bool| if is_turned { -value } else { value };
        [turned(a, self.is_turned[0]), turned(b, self.is_turned[1])]
    }

    fn leave(&self, [a, b]: [i64; 2]) -> [i64; 2] {
        let turned = |value: i64, is_turned: bool| if is_turned { -value } else { value };
        let [x, y] = [turned(a, self.is_turned[0]), turned(b, self.is_turned[1])];
        if self.is_swapped { [y, x] } else { [x, y] }
    }

    /// Whether left and right have changed sides.
    fn is_mirrored(&self) -> bool {
        self.is_swapped ^ self.is_turned[0] ^ self.is_turned[1]
    }

    fn slope(&self) -> usize {
        if self.along == 0 {
            SLOPES - 1
        } else {
            (4 * self.across / self.along).min(3) as usize
        }
    }

    /// How far across an edge goes on straight ahead.
    fn straight(&self, along: i64) -> i64 {
        if self.along == 0 {
            return 0;
        }
        let (run, rise) = (i128::from(self.along), i128::from(self.across));
        (2 * i128::from(along) * rise + run).div_euclid(2 * run) as i64
    }
}

impl<C: Coder + Budget> ContourCoder<C> {
    pub(super) fn new(bits: C, has_levels: bool) -> Self {
        Self {
            bits,
            models: Models::new(),
            has_levels,
            points: 0,
            part: 0,
            last: [0; 2],
            last_depth: 0,
        }
    }

    pub(super) fn begin_view(&mut self) {
        (self.part, self.last, self.last_depth) = (0, [0; 2], 0);
    }

    pub(super) fn count(&mut self, count: i64) -> i64 {
        let models = &mut *self.models;
        let (head, size) = (&mut models.first_head, count.unsigned_abs());
        code_size(&mut self.bits, &mut models.count, head, 0, size) as i64
    }

    /// Codes the next contour of a view: a writer's is given, a reader's is returned.
    pub(super) fn contour(
        &mut self,
        given: Option<&Rounded>,
        view: usize,
    ) -> Result<Rounded, AssetError> {
        let models = &mut *self.models;
        let mut found = Rounded::default();
        let step = match given {
            Some(contour) => {
                let step = contour.part.checked_sub(self.part);
                step.ok_or(AssetError::PartOrder { view })?
            }
            None => 0,
        };
        let (head, step) = (&mut models.first_head, step.into());
        let step = code_size(&mut self.bits, &mut models.step, head, 0, step);
        let part = u64::from(self.part) + step;
        if part >= u64::from(SilhouetteMap::MOST_PARTS) {
            return Err(AssetError::PartOrder { view });
        }
        self.part = part as u16;
        found.part = self.part;
        let has_depth = given.is_some_and(|contour| !contour.depths.is_empty());
        let has_depth = self.bits.bit(&mut models.has_depth, has_depth);

        let mut before = Before::default();
        for k in 0.. {
            let is_last = given.is_none_or(|contour| k == contour.points.len());
            if self.bits.bit(&mut Bit::fixed(GOES_ON), is_last) {
                break;
            }
            self.points += 1;
            if self.points > MOST_POINTS {
                let (found, most) = (self.points as f64, MOST_POINTS as f64);
                return Err(too_many("number of contour vertices", found, most));
            }
            if self.bits.is_spent() {
                return Err(AssetError::Truncated { part: PART });
            }
            let point = given.map_or([0; 2], |contour| contour.points[k]);
            let depth = given.map_or(0, |c| c.depths.get(k).copied().unwrap_or(0));
            self.vertex((point, depth), (k == 0, has_depth), &mut before)?;
            found.points.push(self.last);
            if has_depth {
                found.depths.push(self.last_depth);
            }
        }
        if self.has_levels {
            found.levels = self.levels(given, &found.points);
        }
        if self.bits.is_spent() {
            return Err(AssetError::Truncated { part: PART });
        }
        Ok(found)
    }

    /// Codes a vertex: `self.last` and `self.last_depth` are its place afterwards.
    fn vertex(
        &mut self,
        (point, depth): ([i64; 2], i64),
        (is_first, has_depth): (bool, bool),
        before: &mut Before,
    ) -> Result<(), AssetError> {
        let (models, bits) = (&mut *self.models, &mut self.bits);
        let wanted = [0, 1].map(|k| point[k].wrapping_sub(self.last[k]));
        let edge = if is_first {
            [0, 1].map(|k| {
                let model = (&mut models.first[k], &mut models.first_sign[k]);
                code_number(bits, model, (&mut models.first_head, HEAD_ALONG), wanted[k])
            })
        } else {
            let frame = EdgeFrame::of(before.edge);
            let [along, across] = frame.enter(wanted);
            let (slope, length) = (frame.slope(), digits(frame.along).min(LENGTHS - 1));
            let model = (
                &mut models.along[slope][length],
                &mut models.along_sign[slope],
            );
            let along = code_number(bits, model, (&mut models.along_head, HEAD_ALONG), along);
            let straight = frame.straight(along);
            let turn = if frame.is_mirrored() {
                -before.turn
            } else {
                before.turn
            };
            let model = (
                &mut models.across[usize::from(along < 0)][digits(along).min(LENGTHS - 1)],
                &mut models.across_sign[(turn + 1) as usize],
            );
            let off = across.wrapping_sub(straight);
            let off = code_number(bits, model, (&mut models.across_head, HEAD_ACROSS), off);
            let edge = frame.leave([along, straight.wrapping_add(off)]);
            let [[a, b], [c, d]] = [before.edge, edge].map(|e| e.map(i128::from));
            before.turn = (a * d - b * c).signum() as i64;
            edge
        };
        for (last, step) in self.last.iter_mut().zip(edge) {
            *last = in_range(last.wrapping_add(step))?;
        }
        if has_depth {
            let wanted = depth.wrapping_sub(self.last_depth);
            let step = if is_first {
                let model = (&mut models.first[2], &mut models.first_sign[2]);
                code_number(bits, model, (&mut models.first_head, HEAD_ALONG), wanted)
            } else {
                let length = digits(edge[0]).max(digits(edge[1])).min(LENGTHS - 1);
                let model = (
                    &mut models.depth[length][digits(before.depth).min(6)],
                    &mut models.depth_sign[(before.depth.signum() + 1) as usize],
                );
                code_number(bits, model, (&mut models.depth_head, HEAD_ACROSS), wanted)
            };
            self.last_depth = in_range(self.last_depth.wrapping_add(step))?;
            before.depth = if is_first { 0 } else { step };
        }
        before.edge = if is_first { [0; 2] } else { edge };
        Ok(())
    }

    /// Codes the levels of a contour's vertices.
    fn levels(&mut self, given: Option<&Rounded>, points: &[[i64; 2]]) -> Vec<u8> {
        let mut levels = vec![0_u8; points.len()];
        let wanted = |k: usize| match given {
            Some(contour) => (contour.levels.get(k)).map_or(ViewContour::COARSEST_LEVEL, |&l| l),
            None => 0,
        };
        let place = |k: usize| DVec2::new(points[k][0] as f64, points[k][1] as f64);
        let mut there: Vec<usize> = (0..points.len()).collect();
        for level in 1..=ViewContour::COARSEST_LEVEL {
            let mut stayed = 0;
            let n = there.len();
            for j in 0..n {
                let k = there[j];
                let (left, right) = (place(there[(j + n - 1) % n]), place(there[(j + 1) % n]));
                let height = height_class([left, place(k), right], level);
                let bit = &mut self.models.stays[usize::from(level) - 1][stayed][height];
                let stays = self.bits.bit(bit, wanted(k) >= level);
                levels[k] += u8::from(stays);
                stayed = (stayed << 1 | usize::from(stays)) & 3;
            }
            there.retain(|&k| levels[k] >= level);
        }
        levels
    }
}

/// How far a vertex sticks out between its neighbours, next to the tolerance of a level: the number of k from 1 to 6 for which the height
/// of their triangle is at least 2^(level + k − 1) steps.
fn height_class([a, p, b]: [DVec2; 3], level: u8) -> usize {
    let area = (p - a).x * (b - a).y - (p - a).y * (b - a).x;
    let base = (b - a).x * (b - a).x + (b - a).y * (b - a).y;
    let is_above =
        |k: &u32| area * area >= base * f64::from(1_u32 << (2 * (u32::from(level) + k - 1)));
    (1..HEIGHTS as u32).filter(is_above).count()
}

/// Reading holds to the same limits as writing.
fn in_range(steps: i64) -> Result<i64, AssetError> {
    if steps.unsigned_abs() as f64 <= MAX_STEPS {
        return Ok(steps);
    }
    Err(AssetError::Truncated { part: PART })
}

impl ContourCoder<BitWriter> {
    /// The bytes of all that was coded.
    pub(super) fn finish(self) -> Vec<u8> {
        self.bits.finish()
    }
}

impl ContourCoder<BitReader<'_>> {
    /// Bytes that were not read.
    pub(super) fn left(&self) -> usize {
        self.bits.left()
    }
}

/// Whether there is nothing more to code from.
pub(super) trait Budget {
    fn is_spent(&self) -> bool;
}

impl Budget for BitWriter {
    fn is_spent(&self) -> bool {
        false
    }
}

impl Budget for BitReader<'_> {
    fn is_spent(&self) -> bool {
        self.has_run_out()
    }
}
