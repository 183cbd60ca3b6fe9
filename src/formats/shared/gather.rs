//! Builds scattered samples from the rows of a file.

use super::holes::{all_missing, is_hole};
use crate::{
    Result,
    formats::ReadOptions,
    input::{Source, positions},
    parallel::prelude::*,
    scattered::Points,
};
use glam::DVec3;

/// The columns of the rows besides their positions. All but the values may be empty.
#[derive(Debug, Default)]
pub(crate) struct Columns {
    pub values: Vec<f64>,
    pub radii: Vec<f32>,
    pub covariances: Vec<[f32; 6]>,
}

impl Columns {
    /// Bytes per row with all columns.
    pub const ROW: u64 = 8 + 4 + 24;

    /// Leaves out the rows without a value. Returns the rows that are kept.
    fn without_holes(
        &mut self,
        source: &Source,
        missing: Option<f64>,
    ) -> Result<Option<Vec<usize>>> {
        let count = self.values.len();
        source.room::<usize>("the list of rows", count)?;
        let kept: Vec<usize> =
            (0..count).filter(|&row| !is_hole(self.values[row], missing)).collect();
        if kept.is_empty() {
            return Err(source.error("samples", all_missing(count, missing)));
        }
        fn keep<T: Copy>(list: &mut Vec<T>, kept: &[usize]) {
            if !list.is_empty() {
                kept.iter().enumerate().for_each(|(to, &from)| list[to] = list[from]);
                list.truncate(kept.len());
            }
        }
        keep(&mut self.values, &kept);
        keep(&mut self.radii, &kept);
        keep(&mut self.covariances, &kept);
        Ok(Some(kept))
    }
}

/// Builds `count` samples. `place` names a row in an error. Rows without a value are left out, and
/// counted in [`About::holes`](crate::about::About::holes).
pub(crate) fn gather(
    source: &Source,
    count: usize,
    position: impl Fn(usize) -> DVec3 + Sync,
    place: impl Fn(usize) -> String,
    mut columns: Columns,
    options: &ReadOptions,
) -> Result<Points> {
    if count == 0 {
        return Err(source.error("file", "contains no samples"));
    }
    let missing = options.missing;
    let has_holes = columns.values.par_iter().any(|&value| is_hole(value, missing));
    let kept = if has_holes { columns.without_holes(source, missing)? } else { None };
    let row = |index: usize| kept.as_ref().map_or(index, |kept| kept[index]);
    let left = kept.as_ref().map_or(count, Vec::len);
    let (origin, positions) =
        positions::settle(source, left, |index| position(row(index)), |index| place(row(index)))?;
    source.room::<f32>("the values", columns.values.len())?;
    let values = columns.values.into_par_iter().map(|value| value as f32).collect();
    let mut points = Points {
        origin,
        positions,
        values,
        radii: columns.radii,
        covariances: columns.covariances,
        ..Points::default()
    };
    points.about.holes = (count - left) as u64;
    points.check().map_err(|message| source.error("samples", message))?;
    Ok(points)
}
