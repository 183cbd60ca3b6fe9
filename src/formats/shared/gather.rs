//! Builds scattered samples from the rows of a file.

use super::{
    holes::{all_missing, is_hole},
    unplaced,
};
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

    /// Leaves out all rows but these.
    fn keep(&mut self, kept: &[usize]) {
        fn keep<T: Copy>(list: &mut Vec<T>, kept: &[usize]) {
            if !list.is_empty() {
                kept.iter().enumerate().for_each(|(to, &from)| list[to] = list[from]);
                list.truncate(kept.len());
            }
        }
        keep(&mut self.values, kept);
        keep(&mut self.radii, kept);
        keep(&mut self.covariances, kept);
    }
}

/// Builds `count` samples. `place` names a row in an error. Rows without a value are left out, and
/// counted in [`About::holes`](crate::about::About::holes). Rows that are not at finite coordinates
/// are left out too.
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
    let is_unplaced = |row: usize| !position(row).is_finite();
    let is_hole = |row: usize| columns.values.get(row).is_some_and(|&v| is_hole(v, missing));
    let unplaced = (0..count).into_par_iter().filter(|&row| is_unplaced(row)).count();
    let holes = (0..count).into_par_iter().filter(|&row| is_hole(row) && !is_unplaced(row)).count();
    let mut kept = None;
    if unplaced + holes > 0 {
        source.room::<usize>("the list of rows", count)?;
        let rows = (0..count).filter(|&row| !is_hole(row) && !is_unplaced(row));
        let rows: Vec<usize> = rows.collect();
        if rows.is_empty() && holes > 0 {
            return Err(source.error("samples", all_missing(holes, missing)));
        }
        columns.keep(&rows);
        kept = Some(rows);
    }
    if unplaced > 0 {
        unplaced::warn(source, unplaced, count);
    }
    let row = |index: usize| kept.as_ref().map_or(index, |kept: &Vec<usize>| kept[index]);
    let left = kept.as_ref().map_or(count, Vec::len);
    if left == 0 {
        return Err(source.error("samples", "none is at finite coordinates"));
    }
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
    points.about.holes = holes as u64;
    points.check().map_err(|message| source.error("samples", message))?;
    Ok(points)
}
