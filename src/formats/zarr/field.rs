//! A channel of an image at a time, of which parts are read in the types that samples have.

use super::{
    chunks::Check,
    image::{Image, Level, x_first},
};
use crate::{
    Result,
    formats::{SampleType, shared::grid::Element},
    volume::{Samples, Scalar},
};
use std::sync::Arc;

/// A channel at a time.
#[derive(Clone)]
pub struct Field {
    pub image: Arc<Image>,
    pub channel: usize,
    pub time: usize,
}

impl Field {
    /// Returns the levels, the finest first.
    pub fn levels(&self) -> &[Level] {
        &self.image.levels
    }

    /// Returns the type of the samples: the nearest that has all values of the array's type.
    pub fn scalar(&self) -> Scalar {
        match self.image.levels[0].array.layout.element {
            Element::Bool | Element::Real(SampleType::U8) => Scalar::U8,
            Element::Real(SampleType::U16) => Scalar::U16,
            Element::Real(SampleType::I8 | SampleType::I16) => Scalar::I16,
            Element::Real(SampleType::I32) => Scalar::I32,
            _ => Scalar::F32,
        }
    }

    /// Reads the chunks of some boxes of samples that are read soon.
    pub fn fetch(&self, level: usize, parts: &[[[usize; 3]; 2]]) {
        self.image.fetch((level, [self.channel, self.time]), parts);
    }

    /// Returns a box of samples of a level, x fastest.
    ///
    /// # Errors
    /// Those of reading chunks.
    pub fn window(&self, level: usize, part: [[usize; 3]; 2], check: Check) -> Result<Samples> {
        let which = (level, [self.channel, self.time]);
        let (elements, strides) = self.image.elements(which, part, true, check)?;
        let layout = &self.image.levels[level].array.layout;
        let (element, endian) = (layout.element, layout.endian);
        let elements = x_first(&elements, part[1], strides, element.bytes());
        let samples = match self.scalar() {
            Scalar::F32 => {
                Samples::F32(element.doubles(&elements, endian).iter().map(|v| *v as f32).collect())
            }
            _ => element.decode(elements, endian),
        };
        Ok(samples)
    }
}
