//! Cells that are drawn as a solid.

use super::{Appearance, Coloring, Legend, Name, Showing, SurfaceColor};
use crate::{
    Result,
    cells::{CellOptions, Cells, Solid, Tint},
    color::{ColorScale, Spread},
    math::Clip,
    picture::Edges,
    scene::Item,
    surface::{Paint, Values},
    volume::TransferFunction,
};
use glam::DVec3;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The colour of cells without values.
const NEUTRAL: [f32; 3] = [0.8; 3];

/// A solid as it is shown.
pub(super) struct ShownSolid {
    name: Name,
    pub solid: Arc<Solid>,
    /// How its field is shown in pictures that show no facets.
    appearance: Appearance,
    field: OnceLock<Item>,
    draws_edges: bool,
    /// The edges that the clips of the last picture left.
    edges: Mutex<Option<(Vec<Clip>, Arc<Edges>)>>,
}

impl ShownSolid {
    pub fn new(name: &Name, solid: Solid, showing: &Showing) -> Self {
        Self {
            name: name.clone(),
            solid: solid.into(),
            appearance: showing.appearance.clone(),
            field: OnceLock::new(),
            draws_edges: showing.draws_edges,
            edges: Mutex::new(None),
        }
    }

    /// Returns the field of the cells, which is made once a picture needs it.
    ///
    /// # Errors
    /// Those of [`Appearance::of_cells`] and [`Cells::tetrahedra`].
    pub fn field(&self) -> Result<Item> {
        if let Some(field) = self.field.get() {
            return Ok(field.clone());
        }
        let cells = self.solid.cells();
        let transfer = self.appearance.of_cells(&self.name.text, cells)?;
        let field = field_of(cells, transfer).map_err(|error| self.name.fault(error))?;
        Ok(self.field.get_or_init(|| field).clone())
    }

    /// Returns the edges of the cells as clips leave them, if they are to be drawn.
    pub fn edges(&self, clips: &[Clip]) -> Option<Arc<Edges>> {
        if !self.draws_edges {
            return None;
        }
        let mut kept = self.edges.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((kept_clips, edges)) = &*kept
            && kept_clips == clips
        {
            return Some(edges.clone());
        }
        let origin = self.solid.cells().origin;
        let edges = Arc::new(Edges::of_lines(origin, self.solid.edges(clips)));
        *kept = Some((clips.to_vec(), edges.clone()));
        Some(edges)
    }
}

/// Returns the item that shows the field of cells.
pub(super) fn field_of(cells: &Cells, transfer: TransferFunction) -> Result<Item> {
    // Isosurfaces need a field without steps.
    let tetrahedra = match transfer.isosurfaces.is_empty() {
        true => cells.tetrahedra(&CellOptions::default())?,
        false => cells.clone().with_values_of_points().tetrahedra(&CellOptions::default())?,
    };
    Ok(Item::Cells(tetrahedra.into(), transfer))
}

impl Coloring {
    /// Returns what colours the solid of cells, and the legend if values do. `up` is the direction
    /// of heights.
    ///
    /// # Errors
    /// [`Error::Input`] for values that a file does not have, [`Error::Argument`] for those that a
    /// caller's arrays do not have, and for logarithms of values that have none.
    pub(super) fn tint(
        &self,
        name: &Name,
        cells: &Cells,
        up: DVec3,
    ) -> Result<(Tint, Option<Legend>)> {
        let has_values = !cells.values.is_empty();
        if self.surface == Some(SurfaceColor::Normal) {
            return Ok((Tint::Normal, None));
        }
        let (of, scale) = match self.surface_paint(up, [false, has_values, false]) {
            None => return Ok((Tint::Plain(NEUTRAL), None)),
            Some(Paint::Plain(color)) => return Ok((Tint::Plain(color), None)),
            Some(Paint::Values { of: Values::Own, .. }) if !has_values => {
                let hint = "colours are written as orange or '#ff8800'; the colours height and \
                            normal suit any surface";
                return Err(name.unfit(
                    "attributes",
                    "the cells have no values to colour by",
                    hint,
                ));
            }
            Some(paint) => match self.with_classes(paint, &cells.about.name) {
                Paint::Values { of, scale, .. } => (of, scale),
                Paint::Plain(color) => return Ok((Tint::Plain(color), None)),
            },
        };
        let mut scale = scale;
        if self.range.is_none() {
            scale.range = own_range(of, &scale, cells).ok_or_else(|| {
                let hint = "logarithms need values above 0; the colour height suits any surface";
                name.unfit("values", "there are no values above 0 to colour by", hint)
            })?;
        }
        super::check_log(&scale)?;
        Ok(match of {
            Values::Height(up) => {
                let title = Legend::title("height", &cells.about.length);
                (Tint::Height(scale, up), Some(Legend::of_scale(scale, title)))
            }
            Values::Own => {
                let title = Legend::title(&cells.about.name, &cells.about.unit);
                (Tint::Values(scale), Some(Legend::of_scale(scale, title)))
            }
        })
    }
}

/// Returns the range of all values of cells, also inside, where cuts show them.
fn own_range(of: Values, scale: &ColorScale, cells: &Cells) -> Option<[f64; 2]> {
    match of {
        Values::Height(up) => {
            let heights = cells.bounds().corners().map(|corner| corner.dot(up));
            let low = heights.into_iter().fold(f64::INFINITY, f64::min);
            Some([low, heights.into_iter().fold(f64::NEG_INFINITY, f64::max)])
        }
        Values::Own if scale.is_log => Spread::Full.range(&cells.values, true),
        Values::Own => Some(cells.range()).filter(|[low, high]| low <= high),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, color::ColorMap};

    #[test]
    fn ranges_are_those_of_all_values() {
        let cells = Cells::tube(crate::cells::CellKind::Tetrahedron, 2).unwrap();
        let name = Name { text: "tube".into(), is_file: false };
        let of = |coloring: &Coloring| coloring.tint(&name, &cells, DVec3::Z).unwrap();
        let (tint, legend) = of(&Coloring::default());
        let Tint::Values(scale) = tint else { panic!("{tint:?}") };
        assert_eq!((scale.range, scale.map), (cells.range(), ColorMap::VIRIDIS));
        assert_eq!(legend.unwrap().title, "density");
        let height = Coloring { surface: Some(SurfaceColor::Height), ..Coloring::default() };
        let Tint::Height(scale, up) = of(&height).0 else { panic!("{tint:?}") };
        assert_eq!(up, DVec3::Z);
        assert!((scale.range[1] - 0.8).abs() < 1e-6 && (scale.range[0] + 0.8).abs() < 1e-6);
        let plain = Coloring { surface: Some(SurfaceColor::File), ..Coloring::default() };
        assert_eq!(of(&plain).0, Tint::Plain(NEUTRAL));
        let bare = Cells { values: Vec::new(), ..cells.clone() };
        let bare = |coloring: &Coloring| coloring.tint(&name, &bare, DVec3::Z);
        assert_eq!(bare(&Coloring::default()).unwrap().0, Tint::Plain(NEUTRAL));
        let values = Coloring { surface: Some(SurfaceColor::Values), ..Coloring::default() };
        assert!(matches!(bare(&values), Err(Error::Argument(_))));
    }
}
