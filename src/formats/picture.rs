//! Pictures (PNG, JPEG) as a slice of a volume: greys are values, and colours are colours.

use super::{
    Endian, ReadOptions, SampleType,
    shared::{
        grid::{Component, Element, Grid},
        texture,
    },
};
use crate::{
    Result,
    about::Orientation,
    input::Source,
    volume::{Lattice, Volume},
};
use glam::DVec3;
use image::DynamicImage;
use std::borrow::Cow;

/// Reads a picture as a volume of one slice. The step between pixels is 1; rows run along x, and
/// columns down along y. Greys have 8 or 16 bits. Of colours, [`ReadOptions::scalar`] chooses a
/// channel (`red`, `:0`) or the brightness (`luminance`) as values.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is no such picture, or that is damaged;
/// [`Error::Limit`](crate::Error::Limit) for sizes over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let picture = texture::picture(source, "picture", source.bytes(), |picture| picture)?;
    let dims = [picture.width() as usize, picture.height() as usize, 1];
    let (bytes, sample_type, components): (Cow<[u8]>, _, _) = match &picture {
        DynamicImage::ImageLuma8(grey) => (grey.as_raw().into(), SampleType::U8, 1),
        DynamicImage::ImageLuma16(grey) => {
            (bytemuck::cast_slice(grey.as_raw()).into(), SampleType::U16, 1)
        }
        colors => (colors.to_rgba8().into_raw().into(), SampleType::U8, 4),
    };
    let endian = if cfg!(target_endian = "big") { Endian::Big } else { Endian::Little };
    let grid = Grid::interleaved(Element::Real(sample_type), endian, dims, components);
    let component = Component::chosen(source, options, components, components > 1)?;
    let lattice = Lattice::with_spacing(dims, DVec3::ONE);
    lattice.check().map_err(|message| source.error("picture", message))?;
    let mut volume = grid.volume(source, lattice, bytes, component, options)?;
    volume.about.orientation = Some(Orientation::Y_DOWN);
    Ok(volume)
}

/// Returns whether the first bytes are of a PNG or JPEG file.
pub(super) fn is_picture(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x89PNG\r\n\x1a\n") || bytes.starts_with(b"\xff\xd8\xff")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;
    use image::{GrayImage, ImageFormat, Luma, Rgb, RgbImage};
    use std::{io::Cursor, path::Path};

    fn png(picture: impl Into<DynamicImage>) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.into().write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    fn volume(bytes: &[u8], options: &ReadOptions) -> Result<Volume> {
        let limits = Limits::default();
        read(&Source::from_bytes(Path::new("a.png"), bytes, &limits)?, options)
    }

    #[test]
    fn greys_are_values_and_colours_are_colours() {
        let grey = png(GrayImage::from_fn(3, 2, |x, y| Luma([(10 * y + x) as u8])));
        let read = volume(&grey, &ReadOptions::default()).unwrap();
        assert_eq!((read.lattice.dims, read.range, read.value(4)), ([3, 2, 1], [0.0, 12.0], 11.0));
        let deep = image::ImageBuffer::from_fn(2, 2, |x, _| Luma([300 * x as u16]));
        let deep = volume(&png(DynamicImage::ImageLuma16(deep)), &ReadOptions::default()).unwrap();
        assert_eq!(deep.range, [0.0, 300.0]);
        let colored = png(RgbImage::from_fn(2, 2, |x, _| Rgb([200, 40 * x as u8, 9])));
        let read = volume(&colored, &ReadOptions::default()).unwrap();
        assert_eq!(read.colors.unwrap()[1], [200, 40, 9, 255]);
        let green = volume(&colored, &ReadOptions::scalar(Some("green"))).unwrap();
        assert_eq!((green.range, green.colors.is_none()), ([0.0, 40.0], true));
    }

    #[test]
    fn damaged_pictures_are_refused() {
        let grey = png(GrayImage::new(30, 20));
        let error = volume(&grey[..40], &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("cannot be decoded"), "{error}");
    }
}
