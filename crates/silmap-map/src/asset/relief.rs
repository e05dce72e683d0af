//! How deep the model lies in each texture view, as bytes.
//!
//! Depths are predicted from their neighbours above and to the left, and what the prediction misses is coded by adaptive bits
//! ([`arithmetic`](super::arithmetic)).
//! Source: Wu, Memon. Context-based, adaptive, lossless image coding. IEEE Transactions on Communications, 1997, for contexts by the
//! errors of neighbours; Weinberger, Seroussi, Sapiro. The LOCO-I lossless image compression algorithm. IEEE Transactions on Image
//! Processing, 2000, for the prediction.

use super::arithmetic::{Bit, BitReader, BitWriter, Coder};
use super::packing::{Decoder, Encoder};
use super::{AssetError, DepthPicture, Relief};

const PART: &str = "depths of texture views";

/// Bits that a depth may have.
pub(super) const BITS: std::ops::RangeInclusive<u32> = 2..=14;

/// Most pixels on a side.
pub(super) const MOST_SIDE_PX: u32 = 4096;

/// Classes of how wrong neighbours were predicted: the bits of the sum of their errors, at most this.
const CLASSES: usize = 9;

/// Bits of the largest error.
const ERROR_BITS: usize = 15;

pub(super) fn encode(relief: &Relief, view_count: usize) -> Result<Vec<u8>, AssetError> {
    check_count(relief.views.len(), view_count)?;
    check_numbers(relief.bits, relief.width_px, relief.height_px)?;
    let most = most_code(relief.bits);
    let mut out = Encoder::default();
    out.unsigned(relief.bits.into());
    out.unsigned(relief.width_px.into());
    out.unsigned(relief.height_px.into());
    for view in &relief.views {
        check_range(view)?;
        out.double(view.near);
        out.double(view.far);
    }
    let mut bytes = out.finish();
    let mut writer = BitWriter::new();
    let mut models = Models::new();
    let pixels = relief.width_px as usize * relief.height_px as usize;
    for view in &relief.views {
        if view.codes.len() != pixels {
            return Err(AssetError::Count {
                what: "depths of a texture view",
                found: view.codes.len(),
                expected: pixels,
            });
        }
        let mut rows = Rows::new(relief.width_px as usize, most);
        for row in view.codes.chunks(relief.width_px as usize) {
            if let Some(&code) = row.iter().find(|&&code| code > most) {
                return Err(AssetError::OutOfRange {
                    what: "depth",
                    value: code.into(),
                    limit: most.into(),
                });
            }
            rows.code(&mut writer, &mut models, most, Some(row));
        }
    }
    bytes.extend(writer.finish());
    Ok(bytes)
}

pub(super) fn decode(bytes: &[u8], view_count: usize) -> Result<Relief, AssetError> {
    let mut read = Decoder::new(bytes, PART);
    let bits = read.index("bits of depths", *BITS.end() as usize + 1)?;
    let width_px = read.index("column of depths", MOST_SIDE_PX as usize + 1)?;
    let height_px = read.index("row of depths", MOST_SIDE_PX as usize + 1)?;
    check_numbers(bits, width_px, height_px)?;
    let mut views = Vec::with_capacity(view_count);
    for _ in 0..view_count {
        let view = DepthPicture {
            near: read.double()?,
            far: read.double()?,
            codes: Vec::new(),
        };
        check_range(&view)?;
        views.push(view);
    }
    let mut reader = BitReader::new(read.rest());
    let mut models = Models::new();
    let most = most_code(bits);
    for view in &mut views {
        let mut rows = Rows::new(width_px as usize, most);
        for _ in 0..height_px {
            let row = rows.code(&mut reader, &mut models, most, None);
            view.codes.extend(row.iter().map(|&code| code as u16));
            // Before more is kept than the bytes can say.
            if reader.has_run_out() {
                return Err(AssetError::Truncated { part: PART });
            }
        }
    }
    match reader.left() {
        0 => Ok(Relief {
            bits,
            width_px,
            height_px,
            views,
        }),
        bytes => Err(AssetError::Trailing { part: PART, bytes }),
    }
}

/// The code of the farthest depth.
fn most_code(bits: u32) -> u16 {
    ((1_u32 << bits) - 1) as u16
}

fn check_count(found: usize, expected: usize) -> Result<(), AssetError> {
    if found == expected {
        return Ok(());
    }
    Err(AssetError::Count {
        what: "depth pictures",
        found,
        expected,
    })
}

fn check_numbers(bits: u32, width_px: u32, height_px: u32) -> Result<(), AssetError> {
    let out_of_range = |what, value: u32, limit: u32| AssetError::OutOfRange {
        what,
        value: value.into(),
        limit: limit.into(),
    };
    if !BITS.contains(&bits) {
        return Err(out_of_range("number of bits of depths", bits, *BITS.end()));
    }
    for side in [width_px, height_px] {
        if !(1..=MOST_SIDE_PX).contains(&side) {
            return Err(out_of_range("side of depth pictures", side, MOST_SIDE_PX));
        }
    }
    Ok(())
}

fn check_range(view: &DepthPicture) -> Result<(), AssetError> {
    let DepthPicture { near, far, .. } = *view;
    if near.is_finite() && far.is_finite() && near <= far {
        return Ok(());
    }
    Err(AssetError::OutOfRange {
        what: "range of depths",
        value: far - near,
        limit: f64::MAX,
    })
}

/// What has been learnt of how probable bits are.
#[derive(Debug)]
struct Models {
    /// Whether something is seen, by whether it is to the left, above, and above to either side.
    is_seen: [Bit; 16],
    /// By class: whether the prediction is right.
    is_right: [Bit; CLASSES],
    /// Whether it is too large.
    is_less: [Bit; CLASSES],
    /// Whether the error has more bits.
    is_longer: [[Bit; ERROR_BITS]; CLASSES],
    /// Bits of an error below its highest, by how many there are.
    low: [[Bit; ERROR_BITS]; ERROR_BITS],
}

impl Models {
    fn new() -> Self {
        let bit = Bit::default();
        Self {
            is_seen: [bit; 16],
            is_right: [bit; CLASSES],
            is_less: [bit; CLASSES],
            is_longer: [[bit; ERROR_BITS]; CLASSES],
            low: [[bit; ERROR_BITS]; ERROR_BITS],
        }
    }
}

/// A row and the one above, with two columns of nothing on either side.
#[derive(Debug)]
struct Rows {
    width: usize,
    codes: [Vec<i32>; 2],
    /// By how much the predictions were off.
    errors: [Vec<i32>; 2],
    last: i32,
}

/// Columns beside a row.
const BESIDE: usize = 2;

impl Rows {
    fn new(width: usize, most: u16) -> Self {
        let row = || vec![0; width + 2 * BESIDE];
        Self {
            width,
            codes: [row(), row()],
            errors: [row(), row()],
            last: (i32::from(most) + 1) / 2,
        }
    }

    /// Codes the next row: a writer's is given, a reader's is returned.
    fn code(
        &mut self,
        coder: &mut impl Coder,
        models: &mut Models,
        most: u16,
        row: Option<&[u16]>,
    ) -> &[i32] {
        self.codes.swap(0, 1);
        self.errors.swap(0, 1);
        for x in BESIDE..self.width + BESIDE {
            let code = row.map_or(0, |row| i32::from(row[x - BESIDE]));
            let [here, above] = &self.codes;
            let [left, top, corner, right] = [here[x - 1], above[x], above[x - 1], above[x + 1]];
            let seen = [left, top, corner, right].map(|c| usize::from(c > 0));
            let context = seen[0] | seen[1] << 1 | seen[2] << 2 | seen[3] << 3;
            if !coder.bit(&mut models.is_seen[context], code > 0) {
                self.codes[0][x] = 0;
                self.errors[0][x] = 0;
                continue;
            }
            let predicted = if left > 0 && top > 0 && corner > 0 {
                (left + top - corner).clamp(left.min(top), left.max(top))
            } else if left > 0 && top > 0 {
                (left + top) / 2
            } else {
                let one = [left, top, right, corner].into_iter().find(|&c| c > 0);
                one.unwrap_or(self.last)
            };
            let [here, above] = &self.errors;
            let around = here[x - 1] + above[x] + above[x - 1] + above[x + 1];
            let class = ((i32::BITS - around.leading_zeros()) as usize).min(CLASSES - 1);
            let error = code_error(coder, models, class, code - predicted);
            let code = (predicted + error).clamp(1, most.into());
            self.codes[0][x] = code;
            self.errors[0][x] = error.abs();
            self.last = code;
        }
        &self.codes[0][BESIDE..][..self.width]
    }
}

/// Codes by how much a prediction is off.
fn code_error(coder: &mut impl Coder, models: &mut Models, class: usize, error: i32) -> i32 {
    if coder.bit(&mut models.is_right[class], error == 0) {
        return 0;
    }
    let is_less = coder.bit(&mut models.is_less[class], error < 0);
    let size = error.unsigned_abs().max(1);
    let mut length = 0;
    while length < ERROR_BITS - 1
        && coder.bit(
            &mut models.is_longer[class][length],
            size.ilog2() as usize > length,
        )
    {
        length += 1;
    }
    let mut found = 1;
    for k in (0..length).rev() {
        let bit = coder.bit(&mut models.low[length][k], size >> k & 1 == 1);
        found = found << 1 | i32::from(bit);
    }
    if is_less { -found } else { found }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    prop_compose! {
        /// Ramps with steps, noise and holes.
        fn any_relief(views: usize)(
            bits in BITS, width_px in 1..40_u32, height_px in 1..40_u32,
            slopes in prop::array::uniform2(-9..9_i32), noise in 0..4000_i32, seed: u32, near in -5.0..5.0_f64,
        ) -> Relief {
            let most = i32::from(most_code(bits));
            let mut state = seed;
            let mut code = |x: i32, y: i32| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let random = (state >> 16) as i32;
                if random % 11 == 0 || (x / 7 + y / 5) % 3 == 0 {
                    return 0;
                }
                let ramp = most / 2 + slopes[0] * x + slopes[1] * y + x / 9 * most / 4;
                (ramp + random % (noise + 1)).clamp(1, most) as u16
            };
            let mut codes = || (0..height_px as i32).flat_map(|y| (0..width_px as i32).map(move |x| (x, y))).map(|(x, y)| code(x, y)).collect();
            let views = (0..views).map(|k| DepthPicture { near, far: near + k as f64, codes: codes() }).collect();
            Relief { bits, width_px, height_px, views }
        }
    }

    proptest! {
        #[test]
        fn depths_survive(relief in (0..4_usize).prop_flat_map(any_relief)) {
            let bytes = encode(&relief, relief.views.len()).unwrap();
            let back = decode(&bytes, relief.views.len()).unwrap();
            prop_assert!(back == relief);
            prop_assert_eq!(encode(&back, relief.views.len()).unwrap(), bytes);
        }

        /// Whatever the bytes are, nothing panics, and nothing is kept that they cannot say.
        #[test]
        fn damage_is_met(relief in any_relief(2), at: prop::sample::Index, flip in 1..=255_u8, cut: bool) {
            let mut bytes = encode(&relief, 2).unwrap();
            let at = at.index(bytes.len());
            if cut {
                bytes.truncate(at);
                prop_assert!(decode(&bytes, 2).is_err());
            } else {
                bytes[at] ^= flip;
                if let Ok(read) = decode(&bytes, 2) {
                    let most = most_code(read.bits);
                    prop_assert!(read.views.iter().flat_map(|v| &v.codes).all(|&c| c <= most));
                }
            }
        }
    }

    #[test]
    fn few_bytes_claim_little() {
        let mut out = Encoder::default();
        for number in [10, u64::from(MOST_SIDE_PX), u64::from(MOST_SIDE_PX)] {
            out.unsigned(number);
        }
        out.double(1.0);
        out.double(2.0);
        let bytes = out.finish();
        assert!(matches!(
            decode(&bytes, 1),
            Err(AssetError::Truncated { .. })
        ));
    }

    #[test]
    fn a_slope_takes_less_than_a_bit_a_pixel() {
        let codes = (0..64 * 64)
            .map(|k| (100 + k % 64 * 3 + k / 64 * 2) as u16)
            .collect();
        let views = vec![DepthPicture {
            near: 1.0,
            far: 2.0,
            codes,
        }];
        let relief = Relief {
            bits: 10,
            width_px: 64,
            height_px: 64,
            views,
        };
        let bytes = encode(&relief, 1).unwrap().len();
        assert!(bytes < 64 * 64 / 8, "{bytes}");
    }
}
