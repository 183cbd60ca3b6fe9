//! The values of selected columns of an element.

use super::{
    CHUNK,
    header::Element,
    rows::{Rows, number, place_in_row},
};
use crate::{Result, input::Source, parallel::prelude::*};
use ply_rs::ply::{PropertyType, ScalarType};

/// Selected scalar columns of an element, by their index in the list of requested columns.
pub(super) enum Table<'a> {
    /// Rows of equal length: values are decoded on request, from their offset in the row.
    Binary {
        data: &'a [u8],
        stride: usize,
        big: bool,
        fields: Vec<Option<(usize, &'a ScalarType)>>,
    },
    /// Text and rows with lists, decoded once: the values of all rows, and the index of each column
    /// in a row.
    Decoded { values: Vec<f64>, used: usize, slots: Vec<Option<usize>> },
}

impl<'a> Table<'a> {
    /// Reads the columns with these indices, at least one; `None` for a column that the element
    /// lacks.
    pub fn read(
        source: &Source,
        element: &'a Element,
        rows: &Rows<'a>,
        columns: &[Option<usize>],
    ) -> Result<Self> {
        if let Rows::Fixed { data, stride, big } = *rows {
            let field = |column: usize| {
                let PropertyType::Scalar(kind) = &element.columns[column].kind else { return None };
                Some((place_in_row(element, column), kind))
            };
            let fields = columns.iter().map(|column| column.and_then(field)).collect();
            return Ok(Self::Binary { data, stride, big, fields });
        }
        let mut slots = vec![None; columns.len()];
        let mut slots_of_column = vec![Vec::new(); element.columns.len()];
        let mut wanted = vec![false; element.columns.len()];
        let mut used = 0;
        for (slot, column) in slots.iter_mut().zip(columns) {
            if let Some(column) = *column {
                *slot = Some(used);
                slots_of_column[column].push(used);
                wanted[column] = true;
                used += 1;
            }
        }
        source.room::<f64>("the values", element.count.saturating_mul(used))?;
        let mut values = vec![0.0; element.count * used];
        values.par_chunks_mut(CHUNK * used).enumerate().try_for_each(|(chunk, values)| {
            source.check_time()?;
            for (row, values) in values.chunks_exact_mut(used).enumerate() {
                rows.visit(source, element, chunk * CHUNK + row, &wanted, |column, value, _| {
                    slots_of_column[column].iter().for_each(|&slot| values[slot] = value);
                })?;
            }
            Ok(())
        })?;
        Ok(Self::Decoded { values, used, slots })
    }

    /// Returns a value of a row; 0 for a missing column.
    pub fn value(&self, row: usize, column: usize) -> f64 {
        match self {
            Self::Binary { data, stride, big, fields } => fields[column]
                .map_or(0.0, |(offset, kind)| number(&data[row * stride + offset..], kind, *big)),
            Self::Decoded { values, used, slots } => {
                slots[column].map_or(0.0, |slot| values[row * used + slot])
            }
        }
    }
}
