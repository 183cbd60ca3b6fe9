//! Hierarchies of splats: the half of `pysplatkit.Hierarchy` that holds the file.

use crate::{errors::raise, parts::reading, worker::run};
use numpy::PyArray1;
use pyo3::prelude::*;
use splatkit::{
    Stop,
    hierarchy::Hierarchy as File,
    splat::{Splat, decode_normal},
};
use std::{path::PathBuf, sync::Arc};

/// An open hierarchy.
#[pyclass(frozen, module = "pysplatkit._pysplatkit")]
pub struct Hierarchy(Arc<File>);

/// The arrays of the leaves: positions (64-bit), factors, optical depths, colours and normals.
type Leaves<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<f32>>,
);

#[pymethods]
impl Hierarchy {
    #[new]
    fn new(py: Python<'_>, path: PathBuf, load: &str) -> PyResult<Self> {
        let load = reading(load).map_err(|error| raise(py, &error))?;
        let open = move || File::open(path, &load.limits()).map(Arc::new);
        run(py, &Stop::default(), open).map(Self)
    }

    /// The facts of the header as JSON.
    #[getter]
    fn header(&self) -> String {
        let header = self.0.header();
        let facts = serde_json::json!({
            "splats": header.leaves,
            "nodes": header.nodes,
            "points": header.source_points,
            "pages": self.0.page_count(),
            "closed": header.closed,
            "lossless": header.lossless,
            "degree": header.degree,
            "has_color": header.has_color,
            "has_normals": header.has_normals,
            "up": header.orientation.map(|orientation| orientation.up.to_array()),
            "is_guessed": header.is_guessed,
            "unit": header.unit,
            "source": header.source,
            "origin": header.origin.to_array(),
            "bounds": [header.bounds.min.to_array(), header.bounds.max.to_array()],
        });
        facts.to_string()
    }

    /// The splats of the finest level.
    fn leaves<'py>(&self, py: Python<'py>) -> PyResult<Leaves<'py>> {
        let hierarchy = self.0.clone();
        let set = run(py, &Stop::default(), move || hierarchy.leaves())?;
        let (splats, origin) = (&set.splats, set.origin.to_array());
        let place = |splat: &Splat| [0, 1, 2].map(|i| origin[i] + f64::from(splat.center[i]));
        let positions: Vec<f64> = splats.iter().flat_map(place).collect();
        let factors: Vec<f32> = splats.iter().flat_map(|splat| splat.factor).collect();
        let depths: Vec<f32> = splats.iter().map(|splat| splat.strength).collect();
        let colors: Vec<u8> = splats.iter().flat_map(|splat| splat.color.to_le_bytes()).collect();
        let normal = |splat: &Splat| decode_normal(splat.normal).map_or([f32::NAN; 3], Into::into);
        let normals: Vec<f32> = splats.iter().flat_map(normal).collect();
        Ok((
            PyArray1::from_vec(py, positions),
            PyArray1::from_vec(py, factors),
            PyArray1::from_vec(py, depths),
            PyArray1::from_vec(py, colors),
            PyArray1::from_vec(py, normals),
        ))
    }
}
