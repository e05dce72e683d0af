//! Adaptive binary arithmetic coding: bits in as little room as their probabilities allow, which both sides learn as they go.
//!
//! Source: Martin. Range encoding: an algorithm for removing redundancy from a digitised message. Video and Data Recording
//! Conference, 1979. The probability of a bit is the mean of a quick and a slow running average.

/// Probabilities are in steps of 2⁻¹⁶; what the coder uses of them has 12 bits.
const ONE: u32 = 1 << 16;

/// What is coded never counts as more certain than this: 700 bits take a byte at least, so that few bytes cannot claim much.
const LEAST: u32 = 32;
const SHARES: u32 = 1 << 12;

/// The range is kept above this.
const LEAST_RANGE: u32 = 1 << 24;

/// How probable it is that a bit is zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bit {
    quick: u16,
    slow: u16,
}

impl Default for Bit {
    fn default() -> Self {
        Self::NEW
    }
}

impl Bit {
    /// Nothing is known yet: zero is as probable as one.
    pub(super) const NEW: Self = Self {
        quick: (ONE / 2) as u16,
        slow: (ONE / 2) as u16,
    };

    /// A zero is as probable as this.
    pub(super) fn fixed(zero: f64) -> Self {
        let share = (f64::from(ONE) * zero) as u16;
        Self {
            quick: share,
            slow: share,
        }
    }

    /// Shifts of the two averages.
    const SHIFTS: [u32; 2] = [4, 7];

    /// How probable zero is, of [`SHARES`].
    fn share(self) -> u32 {
        let mean = (u32::from(self.quick) + u32::from(self.slow)) >> 5;
        mean.clamp(LEAST, SHARES - LEAST)
    }

    fn learn(&mut self, bit: bool) {
        for (average, shift) in [&mut self.quick, &mut self.slow]
            .into_iter()
            .zip(Self::SHIFTS)
        {
            if bit {
                *average -= *average >> shift;
            } else {
                *average += ((ONE - 1) as u16 - *average) >> shift;
            }
        }
    }
}

/// Something that goes through bits in order: a writer is told them, a reader tells them.
pub(super) trait Coder {
    /// Codes a bit; a reader takes no notice of the argument and returns what was written.
    fn bit(&mut self, model: &mut Bit, bit: bool) -> bool;
}

/// Writes bits.
#[derive(Debug)]
pub(super) struct BitWriter {
    low: u64,
    range: u32,
    /// Bytes that a carry may yet change: one, and then so many of 255.
    held: Option<u8>,
    full: usize,
    bytes: Vec<u8>,
}

impl BitWriter {
    pub(super) fn new() -> Self {
        Self {
            low: 0,
            range: u32::MAX,
            held: None,
            full: 0,
            bytes: Vec::new(),
        }
    }

    fn shift(&mut self) {
        let carry = (self.low >> 32) as u8;
        let byte = (self.low >> 24) as u8;
        if carry == 1 || byte != u8::MAX {
            if let Some(held) = self.held {
                self.bytes.push(held.wrapping_add(carry));
            }
            let between = u8::MAX.wrapping_add(carry);
            self.bytes.extend(std::iter::repeat_n(between, self.full));
            self.full = 0;
            self.held = Some(byte);
        } else if self.held.is_some() {
            self.full += 1;
        } else {
            // Nothing can carry into the first byte.
            self.held = Some(byte);
        }
        self.low = (self.low & 0x00ff_ffff) << 8;
    }

    pub(super) fn finish(mut self) -> Vec<u8> {
        for _ in 0..5 {
            self.shift();
        }
        self.bytes
    }
}

impl Coder for BitWriter {
    fn bit(&mut self, model: &mut Bit, bit: bool) -> bool {
        let bound = (self.range >> 12) * model.share();
        if bit {
            self.low += u64::from(bound);
            self.range -= bound;
        } else {
            self.range = bound;
        }
        while self.range < LEAST_RANGE {
            self.range <<= 8;
            self.shift();
        }
        model.learn(bit);
        bit
    }
}

/// Reads bits.
#[derive(Debug)]
pub(super) struct BitReader<'a> {
    bytes: &'a [u8],
    /// Bytes taken; more than there are once the data has run out.
    taken: usize,
    code: u32,
    range: u32,
}

impl<'a> BitReader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let mut reader = Self {
            bytes,
            taken: 0,
            code: 0,
            range: u32::MAX,
        };
        for _ in 0..4 {
            reader.take();
        }
        reader
    }

    fn take(&mut self) {
        let byte = self.bytes.get(self.taken).copied().unwrap_or(0);
        self.code = self.code << 8 | u32::from(byte);
        self.taken += 1;
    }

    /// Whether more was read than there is.
    pub(super) fn has_run_out(&self) -> bool {
        self.taken > self.bytes.len()
    }

    /// Bytes that were not read.
    pub(super) fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.taken)
    }
}

impl Coder for BitReader<'_> {
    fn bit(&mut self, model: &mut Bit, _: bool) -> bool {
        let bound = (self.range >> 12) * model.share();
        let bit = self.code >= bound;
        if bit {
            self.code -= bound;
            self.range -= bound;
        } else {
            self.range = bound;
        }
        while self.range < LEAST_RANGE {
            self.range <<= 8;
            self.take();
        }
        model.learn(bit);
        bit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn write(bits: &[(bool, u8)]) -> Vec<u8> {
        let mut models = [Bit::default(); 4];
        let mut writer = BitWriter::new();
        for &(bit, model) in bits {
            writer.bit(&mut models[usize::from(model)], bit);
        }
        writer.finish()
    }

    proptest! {
        #[test]
        fn bits_survive_and_all_bytes_are_used(bits in prop::collection::vec((any::<bool>(), 0..4_u8), 0..3000)) {
            let bytes = write(&bits);
            let mut models = [Bit::default(); 4];
            let mut reader = BitReader::new(&bytes);
            for &(bit, model) in &bits {
                prop_assert_eq!(reader.bit(&mut models[usize::from(model)], false), bit);
            }
            prop_assert!(!reader.has_run_out());
            prop_assert_eq!(reader.left(), 0);
        }
    }

    #[test]
    fn what_is_always_the_same_takes_little_and_never_nothing() {
        let bytes = write(&[(true, 0); 70_000]).len();
        assert!((95..150).contains(&bytes), "{bytes}");
        // Bits without a pattern take their own room.
        let mut state = 1_u32;
        let noise: Vec<(bool, u8)> = (0..8000)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 31 == 1, 0)
            })
            .collect();
        let bytes = write(&noise).len();
        assert!((1000..1060).contains(&bytes), "{bytes}");
    }

    #[test]
    fn the_end_is_noticed() {
        let bytes = write(&[(true, 0), (false, 1), (true, 2)]);
        let mut reader = BitReader::new(&bytes);
        let mut model = Bit::default();
        for _ in 0..100 {
            reader.bit(&mut model, false);
        }
        assert!(reader.has_run_out());
    }
}
