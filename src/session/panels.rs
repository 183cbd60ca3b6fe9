//! Parts of a picture that show a scene from several sides.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// A rectangle of a picture, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Panel {
    /// The left and the top.
    pub at: [u32; 2],
    /// The width and the height.
    pub size: [u32; 2],
}

/// What is written into the corner of each panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum PanelLabels {
    /// The name of the side, such as `front`.
    #[default]
    Names,
    /// a, b, c, ….
    Letters,
    /// Nothing.
    None,
}

impl PanelLabels {
    /// Returns the text of a panel: `name`, the letter of its number, or nothing.
    pub fn text(self, number: usize, name: &str) -> String {
        match self {
            Self::Names => name.to_owned(),
            Self::Letters => {
                // a … z, then aa, ab, …
                let last = char::from(b'a' + (number % 26) as u8);
                let before = (number / 26).checked_sub(1).map(|rest| self.text(rest, name));
                before.unwrap_or_default() + &last.to_string()
            }
            Self::None => String::new(),
        }
    }
}

impl Panel {
    /// The whole of a picture.
    pub fn whole(size: [u32; 2]) -> Self {
        Self { at: [0, 0], size }
    }

    /// Returns the number of panels in a row that nobody sets: up to four, else about as many as
    /// there are rows.
    pub fn usual_columns(count: u32) -> u32 {
        if count <= 4 { count } else { f64::from(count).sqrt().ceil() as u32 }
    }

    /// Returns `count` panels of one size in rows of `columns`, from the left and the top, with
    /// what is left over around them.
    ///
    /// # Errors
    /// [`Error::Argument`] if the panels would have no pixels.
    pub fn grid(self, count: u32, columns: u32) -> Result<Vec<Self>> {
        let columns = columns.clamp(1, count.max(1));
        let cells = [columns, count.div_ceil(columns).max(1)];
        let size = [0, 1].map(|axis| self.size[axis] / cells[axis]);
        if size.contains(&0) {
            let ([width, height], [across, down]) = (self.size, cells);
            return Err(Error::Argument(format!(
                "columns: {width}x{height} pixels cannot hold {across}x{down} panels; take a \
                 larger size"
            )));
        }
        let place = |number: u32| {
            let cell = [number % columns, number / columns];
            let start =
                |axis: usize| self.at[axis] + (self.size[axis] - cells[axis] * size[axis]) / 2;
            Self { at: [0, 1].map(|axis| start(axis) + cell[axis] * size[axis]), size }
        };
        Ok((0..count).map(place).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_fill_a_picture_and_do_not_overlap() {
        let whole = Panel { at: [5, 7], size: [100, 61] };
        for (count, columns) in [(1, 1), (3, 3), (5, 2), (4, 9), (7, 3)] {
            let panels = whole.grid(count, columns).unwrap();
            assert_eq!(panels.len(), count as usize);
            for (number, panel) in panels.iter().enumerate() {
                assert_eq!(panel.size, panels[0].size);
                for axis in 0..2 {
                    assert!(panel.at[axis] >= whole.at[axis]);
                    let end = panel.at[axis] + panel.size[axis];
                    assert!(end <= whole.at[axis] + whole.size[axis]);
                }
                let apart = |other: &Panel| {
                    (0..2).any(|axis| panel.at[axis].abs_diff(other.at[axis]) >= panel.size[axis])
                };
                assert!(panels[..number].iter().all(apart), "{panels:?}");
            }
        }
        assert_eq!(whole.grid(2, 2).unwrap()[1], Panel { at: [55, 7], size: [50, 61] });
        assert!(Panel::whole([3, 9]).grid(4, 4).is_err());
    }

    #[test]
    fn letters_go_on_after_z() {
        let letters = [0, 25, 26, 27, 52].map(|number| PanelLabels::Letters.text(number, "front"));
        assert_eq!(letters, ["a", "z", "aa", "ab", "ba"]);
        assert_eq!(PanelLabels::Names.text(3, "front"), "front");
        assert_eq!(PanelLabels::None.text(3, "front"), "");
    }
}
