//! Finished pictures.

use crate::{
    arrays::{numbers, rows},
    camera::to_json,
    draw::Drawn,
    errors::raise,
    worker::{run, run_here},
};
use numpy::PyArray1;
use pyo3::{prelude::*, types::PyBytes};
use splatkit::{
    Error, Stop, disk,
    picture::{Encoding, Picture as Pixels, PictureFormat},
};
use std::{path::PathBuf, sync::Arc};

/// A finished picture: the half of `pysplatkit.Picture` that holds its pixels.
#[pyclass(frozen, module = "pysplatkit._pysplatkit")]
pub struct Picture {
    pixels: Arc<Pixels>,
    /// The statistics as JSON.
    statistics: String,
    camera: String,
}

impl From<Drawn> for Picture {
    fn from(drawn: Drawn) -> Self {
        let Drawn { picture, stats, camera } = drawn;
        let statistics = serde_json::json!({
            "splats": stats.splats,
            "hidden": stats.hidden,
            "entries": stats.entries,
            "passes": stats.passes,
            "gathered": stats.gathered,
            "bytes": stats.gpu_bytes,
            "cut_pixels": stats.cut_pixels,
            "missing_pages": stats.missing_pages,
            "level": stats.lambda,
            "bricks": stats.bricks,
            "read_bricks": stats.read_bricks,
        });
        let (pixels, statistics) = (Arc::new(picture), statistics.to_string());
        Self { pixels, statistics, camera: to_json(&camera) }
    }
}

impl Picture {
    /// Returns the picture.
    pub fn pixels(&self) -> &Pixels {
        &self.pixels
    }

    /// Returns the picture, shared.
    pub fn shared(&self) -> Arc<Pixels> {
        self.pixels.clone()
    }
}

#[pymethods]
impl Picture {
    /// A picture of rows of pixels that were composited elsewhere, each `factor` × `factor` of
    /// which become one.
    #[new]
    fn new(
        py: Python<'_>,
        color: &Bound<'_, PyAny>,
        depth: &Bound<'_, PyAny>,
        size: [u32; 2],
        factor: u32,
        about: [String; 2],
    ) -> PyResult<Self> {
        let arrays = rows::<f32, 4>(color).and_then(|color| Ok((color, numbers::<f32>(depth)?)));
        let (color, depth) = arrays.map_err(|error| raise(py, &error))?;
        let ([width, height], [statistics, camera]) = (size, about);
        let reduce = move || Pixels { width, height, color, depth }.reduced(factor);
        let pixels = Arc::new(run(py, &Stop::default(), reduce)?);
        Ok(Self { pixels, statistics, camera })
    }

    /// The width and the height in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.pixels.width, self.pixels.height)
    }

    /// The camera as JSON.
    #[getter]
    pub fn camera(&self) -> &str {
        &self.camera
    }

    /// The statistics as JSON.
    #[getter]
    fn statistics(&self) -> &str {
        &self.statistics
    }

    /// Bytes over a background, row by row.
    fn rgba<'py>(&self, py: Python<'py>, background: Option<[f32; 3]>) -> Bound<'py, PyArray1<u8>> {
        let pixels = self.pixels.clone();
        PyArray1::from_vec(py, py.detach(move || pixels.to_rgba8(background)))
    }

    /// Colours that are multiplied by their opacity, row by row.
    fn color<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, self.pixels.color.as_flattened())
    }

    /// Depths, row by row.
    fn depth<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.pixels.depth)
    }

    /// The bytes of a PNG file.
    fn png<'py>(
        &self,
        py: Python<'py>,
        background: Option<[f32; 3]>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let pixels = &self.pixels;
        let mut encoding = Encoding::new(PictureFormat::Png);
        encoding.background = background;
        let encoded = run_here(py, || pixels.encode(&encoding))?;
        Ok(PyBytes::new(py, &encoded))
    }

    /// Writes a picture file with these bits a channel and pixels an inch.
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        background: Option<[f32; 3]>,
        bits: Option<u32>,
        dpi: Option<f64>,
    ) -> PyResult<()> {
        let pixels = self.pixels.clone();
        run(py, &Stop::default(), move || {
            let mut encoding = Encoding::new(PictureFormat::of(&path)?);
            (encoding.background, encoding.bits, encoding.dpi) = (background, bits, dpi);
            pixels.save_as(path, &encoding)
        })
    }

    /// Writes the depths as a grey PNG of 16 bits.
    fn save_depth(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let format = PictureFormat::of(&path).map_err(|error| raise(py, &error))?;
        if format != PictureFormat::Png {
            let error = Error::Argument(format!("{}: depths are written as .png", path.display()));
            return Err(raise(py, &error));
        }
        let pixels = self.pixels.clone();
        run(py, &Stop::default(), move || disk::write(&path, &pixels.encode_depth()?))
    }
}
