//! Numbers as bytes: the small code that all binary parts of the extension are written in.
//!
//! Little-endian throughout. Counts and indices are variable-length integers of seven bits a byte, low bits first;
//! signed numbers are folded first (0, −1, 1, −2, …). A decoder never allocates more than the bytes left can fill.

use super::AssetError;

/// Longest variable-length integer, bytes: ⌈64 / 7⌉.
const MAX_VARINT_BYTES: u32 = 10;

/// Appends numbers to a byte vector.
#[derive(Debug, Default)]
pub(super) struct Encoder {
    bytes: Vec<u8>,
}

impl Encoder {
    pub(super) fn finish(self) -> Vec<u8> {
        self.bytes
    }

    pub(super) fn byte(&mut self, value: u8) {
        self.bytes.push(value);
    }

    pub(super) fn unsigned(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.bytes.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }

    pub(super) fn count(&mut self, value: usize) {
        self.unsigned(value as u64);
    }

    pub(super) fn signed(&mut self, value: i64) {
        self.unsigned(((value << 1) ^ (value >> 63)) as u64);
    }

    pub(super) fn double(&mut self, value: f64) {
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    pub(super) fn single(&mut self, value: f32) {
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    /// The lowest `count` bytes of `value`.
    pub(super) fn low_bytes(&mut self, value: u64, count: usize) {
        self.bytes.extend_from_slice(&value.to_le_bytes()[..count]);
    }
}

/// Takes numbers from a byte slice.
#[derive(Debug)]
pub(super) struct Decoder<'a> {
    rest: &'a [u8],
    part: &'static str,
}

impl<'a> Decoder<'a> {
    /// Reads `bytes`, which errors call `part` (a plural).
    pub(super) fn new(bytes: &'a [u8], part: &'static str) -> Self {
        Self { rest: bytes, part }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], AssetError> {
        let (head, rest) = self
            .rest
            .split_at_checked(count)
            .ok_or(AssetError::Truncated { part: self.part })?;
        self.rest = rest;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], AssetError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(super) fn byte(&mut self) -> Result<u8, AssetError> {
        Ok(self.array::<1>()?[0])
    }

    pub(super) fn unsigned(&mut self) -> Result<u64, AssetError> {
        let mut value = 0_u64;
        for k in 0..MAX_VARINT_BYTES {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << (7 * k);
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(AssetError::Truncated { part: self.part })
    }

    /// A count of things that take at least `bytes_each` bytes: never more than the bytes left can hold.
    pub(super) fn count(&mut self, bytes_each: usize) -> Result<usize, AssetError> {
        let count = self.unsigned()?;
        self.check_room(count, bytes_each)
    }

    /// `count`, if that many things of at least `bytes_each` bytes can follow.
    pub(super) fn check_room(&self, count: u64, bytes_each: usize) -> Result<usize, AssetError> {
        let room = self.rest.len() / bytes_each.max(1);
        if count > room as u64 {
            return Err(AssetError::Truncated { part: self.part });
        }
        Ok(count as usize)
    }

    /// An index below `count`; `what` names the thing it points at.
    pub(super) fn index(&mut self, what: &'static str, count: usize) -> Result<u32, AssetError> {
        let index = self.unsigned()?;
        match u32::try_from(index) {
            Ok(small) if (small as usize) < count => Ok(small),
            _ => Err(AssetError::NoSuch { what, index, count }),
        }
    }

    /// A number of 32 bits; `what` names it.
    pub(super) fn word(&mut self, what: &'static str) -> Result<u32, AssetError> {
        let value = self.unsigned()?;
        u32::try_from(value).map_err(|_| AssetError::OutOfRange {
            what,
            value: value as f64,
            limit: u32::MAX.into(),
        })
    }

    pub(super) fn signed(&mut self) -> Result<i64, AssetError> {
        let folded = self.unsigned()?;
        Ok((folded >> 1) as i64 ^ -((folded & 1) as i64))
    }

    pub(super) fn double(&mut self) -> Result<f64, AssetError> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    pub(super) fn single(&mut self) -> Result<f32, AssetError> {
        Ok(f32::from_le_bytes(self.array()?))
    }

    /// An unsigned number of `count` ≤ 8 bytes.
    pub(super) fn low_bytes(&mut self, count: usize) -> Result<u64, AssetError> {
        let mut array = [0; 8];
        array[..count].copy_from_slice(self.take(count)?);
        Ok(u64::from_le_bytes(array))
    }

    /// What was not read yet, for another reader.
    pub(super) fn rest(self) -> &'a [u8] {
        self.rest
    }

    /// To be called at the end: everything was read.
    pub(super) fn finish(self) -> Result<(), AssetError> {
        match self.rest.len() {
            0 => Ok(()),
            bytes => Err(AssetError::Trailing {
                part: self.part,
                bytes,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn integers_survive(unsigned: u64, signed: i64, small in -70_i64..70) {
            let mut out = Encoder::default();
            out.unsigned(unsigned);
            out.signed(signed);
            out.signed(small);
            let bytes = out.finish();
            let mut read = Decoder::new(&bytes, "numbers");
            prop_assert_eq!(read.unsigned().unwrap(), unsigned);
            prop_assert_eq!(read.signed().unwrap(), signed);
            prop_assert_eq!(read.signed().unwrap(), small);
            prop_assert!(read.finish().is_ok());
        }
    }

    #[test]
    fn small_numbers_take_one_byte() {
        for value in -64..64 {
            let mut out = Encoder::default();
            out.signed(value);
            assert_eq!(out.finish().len(), 1, "{value}");
        }
    }

    #[test]
    fn a_count_never_exceeds_the_bytes_left() {
        let mut out = Encoder::default();
        out.unsigned(u64::MAX);
        out.unsigned(3);
        out.low_bytes(0, 5);
        let bytes = out.finish();
        let mut read = Decoder::new(&bytes, "numbers");
        assert!(read.count(1).is_err());
        assert!(read.count(2).is_err(), "3 × 2 bytes do not fit into 5");
        assert_eq!(
            read.finish(),
            Err(AssetError::Trailing {
                part: "numbers",
                bytes: 5
            })
        );
    }

    #[test]
    fn an_endless_integer_is_refused() {
        assert!(Decoder::new(&[0x80; 20], "numbers").unsigned().is_err());
        assert!(Decoder::new(&[0x80; 3], "numbers").unsigned().is_err());
    }
}
