//! Where a host application gets a picture on the GPU.

use crate::{Error, Result, math::View};
use wgpu::{TextureFormat, TextureUsages};

/// What a picture is written to without leaving the GPU. It is written when the picture is
/// finished, from the upper left corner on; the rest stays as it is.
///
/// Colours are multiplied by opacity and as displayed, as in
/// [`Picture::color`](crate::picture::Picture::color). Depths are those of
/// [`Picture::depth`](crate::picture::Picture::depth): view-space z in world units, infinite where
/// less than half of the light is absorbed.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Output {
    /// Textures to draw into, with [`TextureUsages::RENDER_ATTACHMENT`].
    Textures {
        /// The colours, in any format that can be drawn into.
        color: wgpu::TextureView,
        /// The format of the view of the colours. If it ends in `Srgb`, the texture holds what it
        /// must for the colours to be displayed as they are.
        format: TextureFormat,
        /// The depths.
        depth: Option<Depth>,
        /// Whether the colours are composited over those of the texture, and, with
        /// [`Depth::Buffer`], only where the picture is not behind what the buffer contains.
        /// Otherwise they replace them.
        over: bool,
    },
    /// Buffers to copy into, with [`wgpu::BufferUsages::COPY_DST`], row by row from the top. Until
    /// the picture is finished, they contain parts of it.
    Buffers {
        /// Four 32-bit floats a pixel.
        color: wgpu::Buffer,
        /// One 32-bit float a pixel: the distance along its ray, from the eye or, without
        /// perspective, from the plane of the camera. Pixels of opacity below one half have no
        /// meaningful distance.
        distance: Option<wgpu::Buffer>,
    },
}

/// Where the depths of a picture go.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Depth {
    /// A texture of the format [`TextureFormat::R32Float`], which gets the view-space z in world
    /// units, infinite where less than half of the light is absorbed.
    Linear(wgpu::TextureView),
    /// The depth buffer of a host's own passes, in a format without stencil, such as
    /// [`TextureFormat::Depth32Float`]. A pixel gets the depth that the host's projection gives to
    /// its view-space z: 0 at `near`, 1 at `far`. The depth of `far` stands where less than half of
    /// the light is absorbed.
    ///
    /// If `near` is greater than `far`, depths are reversed: `near` is the far plane. The far plane
    /// may be at infinity, except in a view without perspective.
    Buffer {
        /// The depth buffer.
        view: wgpu::TextureView,
        /// The view-space z of depth 0, in world units.
        near: f64,
        /// The view-space z of depth 1.
        far: f64,
    },
}

impl Depth {
    pub(super) fn texture(&self) -> &wgpu::TextureView {
        match self {
            Self::Linear(view) | Self::Buffer { view, .. } => view,
        }
    }

    /// Returns a and b of a depth buffer's values: a + b / z in perspective, otherwise a + b·z.
    pub(super) fn factors(near: f64, far: f64, perspective: bool) -> [f64; 2] {
        match (near.is_infinite(), far.is_infinite()) {
            _ if !perspective => [-near / (far - near), 1.0 / (far - near)],
            (false, false) => [far / (far - near), -far * near / (far - near)],
            (false, true) => [1.0, -near],
            (true, _) => [0.0, far],
        }
    }

    fn check(&self, perspective: bool) -> Result<()> {
        let format = self.texture().texture().format();
        match self {
            Self::Linear(_) if format != TextureFormat::R32Float => {
                wrong(format!("linear depths need the format R32Float, not {format:?}"))
            }
            Self::Linear(_) => Ok(()),
            Self::Buffer { .. } if !format.has_depth_aspect() || format.has_stencil_aspect() => {
                wrong(format!("a depth buffer needs a format such as Depth32Float, not {format:?}"))
            }
            &Self::Buffer { near, far, .. } => {
                let fits = |z: f64| !perspective || z > 0.0;
                let [a, b] = Self::factors(near, far, perspective);
                if fits(near) && fits(far) && near != far && a.is_finite() && b.is_finite() {
                    return Ok(());
                }
                wrong(format!(
                    "a depth buffer needs two different planes in front of the eye, at most one at \
                     infinity; near is {near}, far {far}"
                ))
            }
        }
    }
}

impl From<&wgpu::TextureView> for Output {
    /// The colours alone, in the format of the view's texture.
    fn from(color: &wgpu::TextureView) -> Self {
        let format = color.texture().format();
        Self::Textures { color: color.clone(), format, depth: None, over: false }
    }
}

impl From<&wgpu::Buffer> for Output {
    /// The colours alone.
    fn from(color: &wgpu::Buffer) -> Self {
        Self::Buffers { color: color.clone(), distance: None }
    }
}

impl Output {
    /// Returns an error if the picture of a view cannot be written here.
    pub(crate) fn check(&self, View { size, perspective, .. }: &View) -> Result<()> {
        match self {
            Self::Textures { color, depth, .. } => {
                check_texture("colours", color.texture(), *size)?;
                depth.as_ref().map_or(Ok(()), |depth| {
                    check_texture("depths", depth.texture().texture(), *size)?;
                    depth.check(*perspective)
                })
            }
            Self::Buffers { color, distance } => {
                let pixels = u64::from(size[0]) * u64::from(size[1]);
                check_buffer("colours", color, 16 * pixels)?;
                distance
                    .as_ref()
                    .map_or(Ok(()), |buffer| check_buffer("distances", buffer, 4 * pixels))
            }
        }
    }
}

fn wrong<T>(message: String) -> Result<T> {
    Err(Error::Argument(message))
}

fn check_texture(what: &str, texture: &wgpu::Texture, [width, height]: [u32; 2]) -> Result<()> {
    let [columns, rows] = [texture.width(), texture.height()];
    if !texture.usage().contains(TextureUsages::RENDER_ATTACHMENT) {
        return wrong(format!("the texture of the {what} lacks the usage RENDER_ATTACHMENT"));
    }
    if columns >= width && rows >= height {
        return Ok(());
    }
    wrong(format!("the texture of the {what} is {columns}x{rows}, the picture {width}x{height}"))
}

fn check_buffer(what: &str, buffer: &wgpu::Buffer, bytes: u64) -> Result<()> {
    if !buffer.usage().contains(wgpu::BufferUsages::COPY_DST) {
        return wrong(format!("the buffer of the {what} lacks the usage COPY_DST"));
    }
    if buffer.size() >= bytes {
        return Ok(());
    }
    wrong(format!("the buffer of the {what} has {} bytes; {bytes} are needed", buffer.size()))
}
