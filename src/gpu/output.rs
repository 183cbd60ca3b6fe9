//! Where a host application gets a picture on the GPU.

use crate::{Error, Result};
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
        /// The depths, as [`TextureFormat::R32Float`].
        depth: Option<wgpu::TextureView>,
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

impl From<&wgpu::TextureView> for Output {
    /// The colours alone, in the format of the view's texture.
    fn from(color: &wgpu::TextureView) -> Self {
        Self::Textures { color: color.clone(), format: color.texture().format(), depth: None }
    }
}

impl From<&wgpu::Buffer> for Output {
    /// The colours alone.
    fn from(color: &wgpu::Buffer) -> Self {
        Self::Buffers { color: color.clone(), distance: None }
    }
}

impl Output {
    /// Returns an error if a picture of `size` pixels cannot be written here.
    pub(super) fn check(&self, size: [u32; 2]) -> Result<()> {
        match self {
            Self::Textures { color, depth, .. } => {
                let views = [("colours", Some(color)), ("depths", depth.as_ref())];
                views.into_iter().try_for_each(|(what, view)| {
                    view.map_or(Ok(()), |view| check_texture(what, view.texture(), size))
                })?;
                match depth.as_ref().map(|depth| depth.texture().format()) {
                    None | Some(TextureFormat::R32Float) => Ok(()),
                    Some(other) => wrong(format!("depths need the format R32Float, not {other:?}")),
                }
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
