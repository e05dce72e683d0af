//! One-bit images as rows of 64-bit words, so that comparing two of them is exclusive-or and a bit count.

/// A one-bit image: bit k of word w of row j is pixel (64·w + k, j). Bits right of the last column are always zero.
#[derive(Clone, PartialEq, Eq)]
pub struct Mask {
    width: u32,
    height: u32,
    words_per_row: usize,
    words: Vec<u64>,
}

impl std::fmt::Debug for Mask {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Mask({} × {}, {} set)",
            self.width,
            self.height,
            self.count()
        )
    }
}

impl Mask {
    /// An empty mask.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        let words_per_row = (width as usize).div_ceil(64);
        Self {
            width,
            height,
            words_per_row,
            words: vec![0; words_per_row * height as usize],
        }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// 64-bit words in each row.
    #[must_use]
    pub fn words_per_row(&self) -> usize {
        self.words_per_row
    }

    /// The words of a row.
    #[must_use]
    pub fn row(&self, y: u32) -> &[u64] {
        let start = y as usize * self.words_per_row;
        &self.words[start..start + self.words_per_row]
    }

    /// The words of a row, to write. Bits right of the last column must stay zero.
    pub fn row_mut(&mut self, y: u32) -> &mut [u64] {
        let start = y as usize * self.words_per_row;
        &mut self.words[start..start + self.words_per_row]
    }

    /// All words, row after row.
    #[must_use]
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// All words, to write. Bits right of the last column must stay zero.
    pub fn words_mut(&mut self) -> &mut [u64] {
        &mut self.words
    }

    /// The set pixels, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let of_word = |y: u32, k: usize, mut word: u64| {
            std::iter::from_fn(move || {
                let bit = (word != 0).then(|| word.trailing_zeros())?;
                word &= word - 1;
                Some((64 * k as u32 + bit, y))
            })
        };
        (0..self.height).flat_map(move |y| {
            let words = self.row(y).iter().enumerate();
            words.flat_map(move |(k, &word)| of_word(y, k, word))
        })
    }

    /// Empties the mask, keeping its storage.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Whether a pixel is set; pixels outside the image are not.
    #[must_use]
    pub fn get(&self, x: i64, y: i64) -> bool {
        if x < 0 || y < 0 || x >= i64::from(self.width) || y >= i64::from(self.height) {
            return false;
        }
        self.row(y as u32)[x as usize / 64] >> (x as usize % 64) & 1 == 1
    }

    /// Sets one pixel, which must lie in the image.
    pub fn set(&mut self, x: u32, y: u32, value: bool) {
        debug_assert!(
            x < self.width && y < self.height,
            "pixel ({x}, {y}) is outside the mask"
        );
        let word = &mut self.row_mut(y)[x as usize / 64];
        let bit = 1_u64 << (x % 64);
        if value { *word |= bit } else { *word &= !bit }
    }

    /// Sets pixels `from..to` of a row, clipped to the image.
    pub fn set_span(&mut self, y: u32, from: i64, to: i64) {
        let (from, to) = (from.max(0), to.min(i64::from(self.width)));
        if from >= to || y >= self.height {
            return;
        }
        let (from, last) = (from as usize, to as usize - 1);
        let row = self.row_mut(y);
        let (first_word, last_word) = (from / 64, last / 64);
        let head = !0_u64 << (from % 64);
        let tail = !0_u64 >> (63 - last % 64);
        if first_word == last_word {
            row[first_word] |= head & tail;
        } else {
            row[first_word] |= head;
            row[first_word + 1..last_word].fill(!0);
            row[last_word] |= tail;
        }
    }

    /// Number of set pixels.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.words.iter().map(|w| u64::from(w.count_ones())).sum()
    }

    /// Number of pixels in which two masks of one size differ.
    #[must_use]
    pub fn count_different(&self, other: &Self) -> u64 {
        self.zip(other)
            .map(|(a, b)| u64::from((a ^ b).count_ones()))
            .sum()
    }

    /// Number of pixels set here and not in `other`.
    #[must_use]
    pub fn count_missing_in(&self, other: &Self) -> u64 {
        self.zip(other)
            .map(|(a, b)| u64::from((a & !b).count_ones()))
            .sum()
    }

    /// Keeps only what is set in both.
    ///
    /// # Panics
    /// When the sizes differ.
    pub fn intersect(&mut self, other: &Self) {
        assert_eq!(
            (self.width, self.height),
            (other.width, other.height),
            "masks of different sizes"
        );
        for (a, b) in self.words.iter_mut().zip(&other.words) {
            *a &= b;
        }
    }

    fn zip<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = (u64, u64)> + 'a {
        assert_eq!(
            (self.width, self.height),
            (other.width, other.height),
            "masks of different sizes"
        );
        self.words.iter().copied().zip(other.words.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_equal_single_pixels() {
        for (from, to) in [
            (0, 1),
            (3, 64),
            (63, 65),
            (0, 200),
            (-5, 130),
            (64, 128),
            (70, 70),
            (190, 500),
        ] {
            let mut by_span = Mask::new(200, 3);
            by_span.set_span(1, from, to);
            let mut by_pixel = Mask::new(200, 3);
            for x in from.max(0)..to.min(200) {
                by_pixel.set(x as u32, 1, true);
            }
            assert_eq!(by_span, by_pixel, "{from}..{to}");
        }
    }

    #[test]
    fn pixels_are_those_that_are_set() {
        let mut mask = Mask::new(130, 3);
        let wanted = [(0, 0), (63, 0), (64, 0), (129, 0), (5, 2), (128, 2)];
        for (x, y) in wanted {
            mask.set(x, y, true);
        }
        assert_eq!(mask.pixels().collect::<Vec<_>>(), wanted);
        assert_eq!(Mask::new(70, 2).pixels().count(), 0);
    }

    #[test]
    fn counting() {
        let mut a = Mask::new(100, 2);
        let mut b = Mask::new(100, 2);
        a.set_span(0, 10, 80);
        b.set_span(0, 20, 90);
        assert_eq!(
            (a.count(), a.count_different(&b), a.count_missing_in(&b)),
            (70, 20, 10)
        );
        a.intersect(&b);
        assert_eq!(a.count(), 60);
    }
}
