//! Surfaces beside cells: polygons over their points.

/// Polygons over the points of cells, such as shells and walls. They are drawn with the boundary of
/// the cells, but hold no field inside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Faces {
    /// The points of all polygons, each in order around it.
    pub corners: Vec<u32>,
    /// Where the corners of each polygon end.
    pub ends: Vec<usize>,
    /// One value for each polygon if the values of the cells are one a cell; empty otherwise.
    pub values: Vec<f32>,
}

impl Faces {
    /// Number of polygons.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Returns whether there are no polygons.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Adds a polygon.
    pub fn push(&mut self, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    /// Returns the corners of each polygon.
    pub(crate) fn polygons(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(start, end)| &self.corners[*start..*end])
    }

    /// Checks the polygons of cells with this number of points.
    pub(super) fn check(&self, points: usize, is_valued: bool) -> Result<(), String> {
        let is_ascending = self.ends.windows(2).all(|pair| pair[0] <= pair[1]);
        if !(is_ascending && self.ends.last().copied().unwrap_or(0) == self.corners.len()) {
            return Err("the ends of the faces must ascend to the number of their corners".into());
        }
        if let Some(corner) = self.corners.iter().find(|corner| **corner as usize >= points) {
            return Err(format!("a face refers to point {corner} of {points}"));
        }
        let wanted = if is_valued { self.len() } else { 0 };
        if self.values.len() != wanted {
            let count = self.values.len();
            return Err(format!("the faces have {count} values, but {wanted} are expected"));
        }
        match self.values.iter().find(|value| value.is_infinite()) {
            Some(value) => Err(format!("the value of a face is {value}")),
            None => Ok(()),
        }
    }
}
