//! The types that samples are stored in.

/// The type of a volume's samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Scalar {
    /// 8 bits, unsigned.
    U8,
    /// 16 bits, unsigned.
    U16,
    /// 16 bits, signed.
    I16,
    /// 32 bits, signed.
    I32,
    /// 32 bits, floating point.
    F32,
}

impl Scalar {
    /// Every type.
    pub const ALL: [Self; 5] = [Self::U8, Self::U16, Self::I16, Self::I32, Self::F32];

    /// Returns the name, as the command spells it.
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::I32 => "i32",
            Self::F32 => "f32",
        }
    }

    /// Bytes per sample.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::I32 | Self::F32 => 4,
        }
    }

    /// Returns the value of the first sample in `bytes`, which are in native byte order. The value
    /// is exact.
    ///
    /// # Panics
    /// If there are fewer bytes than a sample takes.
    pub fn value(self, bytes: &[u8]) -> f64 {
        fn first<T: bytemuck::AnyBitPattern + Into<f64>>(bytes: &[u8]) -> f64 {
            bytemuck::pod_read_unaligned::<T>(&bytes[..size_of::<T>()]).into()
        }
        match self {
            Self::U8 => first::<u8>(bytes),
            Self::U16 => first::<u16>(bytes),
            Self::I16 => first::<i16>(bytes),
            Self::I32 => first::<i32>(bytes),
            Self::F32 => first::<f32>(bytes),
        }
    }
}
