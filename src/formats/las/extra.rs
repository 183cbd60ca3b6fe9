//! Numbers in the extra bytes of a point.

use super::super::form::NumberType;

/// A number in the extra bytes of a point (table 24).
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    pub name: String,
    /// Its offset in a point, and its type: 0 to 9 for u8, i8, u16, i16, u32, i32, u64, i64, f32,
    /// f64.
    pub at: usize,
    pub kind: u8,
    pub scale: f64,
    pub offset: f64,
    /// The bytes that stand for no value.
    pub missing: Option<[u8; 8]>,
}

impl Extra {
    /// Bytes of each type.
    pub const SIZES: [usize; 10] = [1, 1, 2, 2, 4, 4, 8, 8, 4, 8];

    /// Returns the type that holds its values.
    pub fn number_type(&self) -> NumberType {
        use NumberType::*;
        const KINDS: [NumberType; 10] = [U8, I8, U16, I16, U32, I32, U64, I64, F32, F64];
        match self.scale == 1.0 && self.offset == 0.0 && self.missing.is_none() {
            true => KINDS[usize::from(self.kind)],
            false => F64,
        }
    }

    /// Returns the value in the bytes of a point; NaN if it has none.
    pub fn value(&self, record: &[u8]) -> f64 {
        let size = Self::SIZES[usize::from(self.kind)];
        let Some(bytes) = record.get(self.at..self.at + size) else { return f64::NAN };
        if self.missing.is_some_and(|missing| self.number(&missing[..]) == self.number(bytes)) {
            return f64::NAN;
        }
        self.number(bytes) * self.scale + self.offset
    }

    /// Returns the number in bytes. A value that stands for none has the widest type of its kind.
    fn number(&self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        let unused = 64 - 8 * bytes.len() as u32;
        match self.kind {
            8 if bytes.len() == 4 => f64::from(f32::from_bits(u64::from_le_bytes(wide) as u32)),
            8 | 9 => f64::from_le_bytes(wide),
            kind if kind % 2 == 1 => (i64::from_le_bytes(wide) << unused >> unused) as f64,
            _ => u64::from_le_bytes(wide) as f64,
        }
    }
}
