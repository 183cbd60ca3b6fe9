//! The sides of cells, and those that belong to one cell only.

use super::{CellKind, Cells, division::faces_of, kind::faces};
use crate::parallel::prelude::*;
use std::sync::LazyLock;

/// A side of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    /// The least numbers of its points, in ascending order. No other side of a mesh without
    /// overlaps has the same.
    key: [u32; 4],
    side: Side,
}

/// A side of a cell: the cell, and the side's number in [`each`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    pub cell: u32,
    pub number: u32,
}

/// Cells that are matched among themselves first. Neighbours are mostly near each other in a file,
/// so that few sides are left to be matched with those of other cells.
const TOGETHER: usize = 1 << 14;

const VOXEL: &[&[usize]] =
    &[&[0, 4, 6, 2], &[1, 3, 7, 5], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 2, 3, 1], &[4, 5, 7, 6]];

/// The sides of prisms.
static PRISMS: LazyLock<[Vec<Vec<usize>>; 2]> = LazyLock::new(|| {
    [CellKind::PentagonalPrism, CellKind::HexagonalPrism]
        .map(|kind| faces_of(kind).unwrap_or_default())
});

/// Passes the number and the corners of each side of a cell to `visit`. Sides of curved cells have
/// the corners only.
pub(super) fn each(cells: &Cells, cell: usize, visit: &mut impl FnMut(u32, &[u32])) {
    let (kind, nodes) = (cells.kinds[cell], cells.nodes_of(cell));
    let mut corners = [0; 6];
    let mut visit_by = |number: usize, places: &[usize]| {
        for (corner, place) in corners.iter_mut().zip(places) {
            *corner = nodes[*place];
        }
        visit(number as u32, &corners[..places.len()]);
    };
    match (kind, kind.form()) {
        (CellKind::Polyhedron, _) => {
            for (number, face) in (0..).zip(faces(nodes).filter_map(Result::ok)) {
                visit(number, face);
            }
        }
        (CellKind::Voxel, _) => {
            VOXEL.iter().enumerate().for_each(|(number, places)| visit_by(number, places));
        }
        (_, Some(form)) => {
            form.sides().iter().enumerate().for_each(|(number, places)| visit_by(number, places));
        }
        (_, None) => {
            let prism = &PRISMS[usize::from(kind == CellKind::HexagonalPrism)];
            prism.iter().enumerate().for_each(|(number, places)| visit_by(number, places));
        }
    }
}

/// Returns the sides that only one of the shown cells has, in the order of the cells.
pub(super) fn open(cells: &Cells, is_shown: impl Fn(usize) -> bool + Sync) -> Vec<Side> {
    let starts: Vec<usize> = (0..cells.len()).step_by(TOGETHER).collect();
    let of_some = |start: &usize| {
        let mut entries = Vec::new();
        for cell in (*start..(start + TOGETHER).min(cells.len())).filter(|cell| is_shown(*cell)) {
            each(cells, cell, &mut |number, corners| {
                if let Some(key) = key(corners) {
                    entries.push(Entry { key, side: Side { cell: cell as u32, number } });
                }
            });
        }
        entries.sort_unstable();
        single(&entries)
    };
    let parts: Vec<Vec<Entry>> = starts.par_iter().map(of_some).collect();
    let mut left = parts.concat();
    drop(parts);
    left.par_sort_unstable();
    let mut sides: Vec<Side> = single(&left).into_iter().map(|entry| entry.side).collect();
    sides.par_sort_unstable();
    sides
}

/// Returns the entries whose key no other has.
fn single(sorted: &[Entry]) -> Vec<Entry> {
    let equals = sorted.chunk_by(|a, b| a.key == b.key);
    equals.filter(|equals| equals.len() == 1).map(|equals| equals[0]).collect()
}

/// Returns the least numbers of a side's points; `None` for a side without area. Corners of
/// collapsed cells may be one point.
fn key(corners: &[u32]) -> Option<[u32; 4]> {
    let mut key = [u32::MAX; 4];
    let mut last = None;
    for slot in &mut key {
        let above = corners.iter().copied().filter(|corner| last.is_none_or(|last| *corner > last));
        let Some(next) = above.min() else { break };
        (*slot, last) = (next, Some(next));
    }
    (key[2] != u32::MAX).then_some(key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Two cubes beside each other, and a pyramid on the second.
    fn cells() -> Cells {
        let mut cells = Cells { points: vec![Vec3::ZERO; 13], ..Cells::default() };
        cells.push(CellKind::Voxel, 0..8);
        cells.push(CellKind::Hexahedron, [1, 8, 9, 3, 5, 10, 11, 7]);
        cells.push(CellKind::Pyramid, [5, 10, 11, 7, 12]);
        cells
    }

    #[test]
    fn shared_sides_are_left_out() {
        let cells = cells();
        let sides = open(&cells, |_| true);
        let count = |cell: u32| sides.iter().filter(|side| side.cell == cell).count();
        assert_eq!([0, 1, 2].map(count), [5, 4, 4]);
        // Without a cell, its neighbours' sides are open.
        let sides = open(&cells, |cell| cell != 1);
        assert_eq!(sides.len(), 6 + 5);
    }

    #[test]
    fn collapsed_sides_have_the_key_of_what_they_are() {
        assert_eq!(key(&[7, 3, 3, 5]), Some([3, 5, 7, u32::MAX]));
        assert_eq!(key(&[7, 3, 3, 7]), None);
        assert_eq!(key(&[9, 7, 3, 8, 5]), Some([3, 5, 7, 8]));
    }
}
