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
    picture::{Encoding, Layers as Known, Picture as Pixels, PictureFormat},
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

/// What is known of the pixels of a picture beside their colours and depths.
#[pyclass(frozen, module = "pysplatkit._pysplatkit")]
pub struct Layers(Arc<Known>);

impl From<Known> for Layers {
    fn from(layers: Known) -> Self {
        Self(Arc::new(layers))
    }
}

#[pymethods]
impl Layers {
    /// Layers of rows of pixels.
    #[new]
    fn new(
        py: Python<'_>,
        normals: Option<Bound<'_, PyAny>>,
        albedo: Option<Bound<'_, PyAny>>,
        identifiers: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let made = (|| {
            Ok(Known {
                normals: normals.as_ref().map(rows::<f32, 3>).transpose()?,
                albedo: albedo.as_ref().map(rows::<f32, 4>).transpose()?,
                identifiers: identifiers.as_ref().map(numbers::<u32>).transpose()?,
            })
        })();
        made.map(Self::from).map_err(|error: Error| raise(py, &error))
    }

    /// Normals, row by row.
    fn normals<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f32>>> {
        self.0.normals.as_ref().map(|all| PyArray1::from_slice(py, all.as_flattened()))
    }

    /// Colours without light that are multiplied by their opacity, row by row.
    fn albedo<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f32>>> {
        self.0.albedo.as_ref().map(|all| PyArray1::from_slice(py, all.as_flattened()))
    }

    /// Numbers of inputs, row by row.
    fn identifiers<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<u32>>> {
        self.0.identifiers.as_ref().map(|all| PyArray1::from_slice(py, all))
    }
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

    /// Writes a picture file with these bits a channel, pixels an inch and layers.
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        background: Option<[f32; 3]>,
        stored: (Option<u32>, Option<f64>),
        layers: Option<PyRef<'_, Layers>>,
    ) -> PyResult<()> {
        let (bits, dpi) = stored;
        let pixels = self.pixels.clone();
        let layers = layers.map(|layers| layers.0.clone()).unwrap_or_default();
        run(py, &Stop::default(), move || {
            let mut encoding = Encoding::new(PictureFormat::of(&path)?);
            (encoding.background, encoding.bits, encoding.dpi) = (background, bits, dpi);
            let is_stored = encoding.format == PictureFormat::OpenExr;
            let none = Known::default();
            let layers = if is_stored { &*layers } else { &none };
            disk::write(&path, &pixels.encode_with(&encoding, layers)?)
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
