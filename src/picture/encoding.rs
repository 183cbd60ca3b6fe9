//! Picture files: formats, bits and resolution.

use super::{Layers, Picture};
use crate::{Error, Result};
use std::path::Path;

/// The format of a picture file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PictureFormat {
    /// PNG: lossless, with opacity; 8 or 16 bits a channel.
    Png,
    /// JPEG: lossy, without opacity.
    Jpeg,
    /// TIFF: lossless, with opacity; 8 or 16 bits a channel. Needs the feature `pictures`.
    Tiff,
    /// WebP: lossless, with opacity. Needs the feature `pictures`.
    WebP,
    /// OpenEXR: colours in linear light, multiplied by opacity, and depths. Needs the feature
    /// `pictures`.
    OpenExr,
}

/// How a picture becomes a file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Encoding {
    /// The format.
    pub format: PictureFormat,
    /// The colour behind the picture: red, green and blue in 0 … 1. `None` keeps the opacity; a
    /// JPEG, which has none, is then drawn over black.
    pub background: Option<[f32; 3]>,
    /// Bits a channel; `None` for the usual number of the format, the first of
    /// [`PictureFormat::bits`].
    pub bits: Option<u32>,
    /// Pixels an inch, which says how large the picture is printed.
    pub dpi: Option<f64>,
}

impl PictureFormat {
    /// Returns the format for a file's extension.
    ///
    /// # Errors
    /// [`Error::Argument`] for other extensions, and for a format that this build does not write.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        let format = match extension.unwrap_or_default().to_ascii_lowercase().as_str() {
            "png" => Self::Png,
            "jpg" | "jpeg" => Self::Jpeg,
            "tif" | "tiff" => Self::Tiff,
            "webp" => Self::WebP,
            "exr" => Self::OpenExr,
            _ => {
                return Err(Error::Argument(format!(
                    "{}: unknown picture format, use .png, .jpg, .tiff, .webp or .exr",
                    path.display()
                )));
            }
        };
        if cfg!(feature = "pictures") || matches!(format, Self::Png | Self::Jpeg) {
            return Ok(format);
        }
        Err(Error::Argument(format!(
            "{}: this build writes .png and .jpg only; the feature `pictures` adds .{}",
            path.display(),
            format.extension()
        )))
    }

    /// Returns the usual extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
            Self::Tiff => "tiff",
            Self::WebP => "webp",
            Self::OpenExr => "exr",
        }
    }

    /// Returns the numbers of bits that a channel may have; the first is the usual one. Those of
    /// OpenEXR are floating-point numbers, the others whole numbers.
    pub fn bits(self) -> &'static [u32] {
        match self {
            Self::Png | Self::Tiff => &[8, 16],
            Self::Jpeg | Self::WebP => &[8],
            Self::OpenExr => &[16, 32],
        }
    }

    /// Whether files of the format have opacities.
    pub fn keeps_opacity(self) -> bool {
        self != Self::Jpeg
    }
}

impl Encoding {
    /// A file of a format, with opacity if the format has one, and nothing else set.
    pub fn new(format: PictureFormat) -> Self {
        Self { format, background: None, bits: None, dpi: None }
    }

    /// Checks that the format has these bits and this resolution.
    ///
    /// # Errors
    /// [`Error::Argument`] with the name of the field that is wrong.
    pub fn check(&self) -> Result<()> {
        let allowed = self.format.bits();
        if let Some(bits) = self.bits.filter(|bits| !allowed.contains(bits)) {
            let allowed: Vec<String> = allowed.iter().map(ToString::to_string).collect();
            return Err(Error::Argument(format!(
                "bits: a .{} file has {} bits a channel, not {bits}",
                self.format.extension(),
                allowed.join(" or ")
            )));
        }
        match self.dpi.is_none_or(|dpi| DPI.contains(&dpi)) {
            true => Ok(()),
            false => Err(Error::Argument(wrong_dpi())),
        }
    }

    /// Refuses layers that the format cannot store.
    ///
    /// # Errors
    /// [`Error::Argument`].
    pub fn check_layers(&self, has_layers: bool) -> Result<()> {
        if !has_layers || self.format == PictureFormat::OpenExr {
            return Ok(());
        }
        Err(Error::Argument(format!(
            "layers: a .{} file has no layers; write an .exr file",
            self.format.extension()
        )))
    }

    /// Returns bits a channel.
    pub(super) fn bits(&self) -> u32 {
        self.bits.unwrap_or(self.format.bits()[0])
    }
}

/// The resolutions that files can store, in pixels an inch.
pub(crate) const DPI: std::ops::RangeInclusive<f64> = 1.0..=10_000.0;

/// Returns the message for another resolution.
pub(crate) fn wrong_dpi() -> String {
    format!("dpi: a resolution is {} to {} pixels an inch", DPI.start(), DPI.end())
}

impl Picture {
    /// Returns the bytes of a picture file.
    ///
    /// # Errors
    /// [`Error::Argument`] if the format cannot store the picture or has no such bits, if this
    /// build lacks the format, or if the picture does not have one colour for each pixel.
    pub fn encode(&self, encoding: &Encoding) -> Result<Vec<u8>> {
        self.encode_with(encoding, &Layers::default())
    }

    /// Returns the bytes of a picture file that has layers beside colours and depths.
    ///
    /// # Errors
    /// Those of [`encode`](Self::encode); [`Error::Argument`] if the format has no layers, or if a
    /// layer does not have one value for each pixel.
    pub fn encode_with(&self, encoding: &Encoding, layers: &Layers) -> Result<Vec<u8>> {
        self.check_colors()?;
        encoding.check()?;
        encoding.check_layers(!layers.is_empty())?;
        layers.check(self)?;
        match encoding.format {
            PictureFormat::Png => self.encode_png(encoding),
            PictureFormat::Jpeg => self.encode_jpeg(encoding),
            #[cfg(feature = "pictures")]
            PictureFormat::Tiff => self.encode_tiff(encoding),
            #[cfg(feature = "pictures")]
            PictureFormat::WebP => self.encode_webp(encoding),
            #[cfg(feature = "pictures")]
            PictureFormat::OpenExr => self.encode_exr(encoding, layers),
            #[cfg(not(feature = "pictures"))]
            other => Err(Error::Argument(format!(
                "this build writes no .{}: it lacks the feature `pictures`",
                other.extension()
            ))),
        }
    }

    fn encode_png(&self, encoding: &Encoding) -> Result<Vec<u8>> {
        let size = [self.width, self.height];
        let rgba = png::ColorType::Rgba;
        if encoding.bits() == 8 {
            let bytes = self.to_rgba8(encoding.background);
            return png(&bytes, size, (rgba, png::BitDepth::Eight), encoding.dpi);
        }
        let numbers = self.to_rgba16(encoding.background);
        let bytes: Vec<u8> = numbers.into_iter().flat_map(u16::to_be_bytes).collect();
        png(&bytes, size, (rgba, png::BitDepth::Sixteen), encoding.dpi)
    }

    fn encode_jpeg(&self, encoding: &Encoding) -> Result<Vec<u8>> {
        use image::codecs::jpeg::{JpegEncoder, PixelDensity};
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new(&mut bytes);
        if let Some(dpi) = encoding.dpi {
            encoder.set_pixel_density(PixelDensity::dpi(dpi.round() as u16));
        }
        let rgb = opaque(&self.to_rgba8(encoding.background.or(Some([0.0; 3]))));
        let kind = image::ExtendedColorType::Rgb8;
        encoder.encode(&rgb, self.width, self.height, kind).map_err(not_stored)?;
        Ok(bytes)
    }

    #[cfg(feature = "pictures")]
    fn encode_tiff(&self, encoding: &Encoding) -> Result<Vec<u8>> {
        use tiff::encoder::colortype::{RGB8, RGB16, RGBA8, RGBA16};
        let (size, background) = ([self.width, self.height], encoding.background);
        match (encoding.bits() == 8, background.is_some()) {
            (true, true) => tiff::<RGB8>(&opaque(&self.to_rgba8(background)), size, encoding),
            (true, false) => tiff::<RGBA8>(&self.to_rgba8(None), size, encoding),
            (false, true) => tiff::<RGB16>(&opaque(&self.to_rgba16(background)), size, encoding),
            (false, false) => tiff::<RGBA16>(&self.to_rgba16(None), size, encoding),
        }
    }

    #[cfg(feature = "pictures")]
    fn encode_webp(&self, encoding: &Encoding) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let rgba = self.to_rgba8(encoding.background);
        let kind = image_webp::ColorType::Rgba8;
        let mut encoder = image_webp::WebPEncoder::new(&mut bytes);
        if let Some(dpi) = encoding.dpi {
            encoder.set_exif_metadata(exif(dpi));
        }
        encoder.encode(&rgba, self.width, self.height, kind).map_err(not_stored)?;
        Ok(bytes)
    }
}

/// Returns the colours of pixels without their opacities.
fn opaque<T: Copy>(rgba: &[T]) -> Vec<T> {
    rgba.chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect()
}

/// Returns the bytes of a PNG file.
pub(super) fn png(
    data: &[u8],
    [width, height]: [u32; 2],
    (color, bits): (png::ColorType, png::BitDepth),
    dpi: Option<f64>,
) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(bits);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    if let Some(dpi) = dpi {
        // Pixels a metre.
        let density = (dpi / 0.0254).round() as u32;
        let unit = png::Unit::Meter;
        encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: density, yppu: density, unit }));
    }
    let mut writer = encoder.write_header().map_err(not_stored)?;
    writer.write_image_data(data).map_err(not_stored)?;
    writer.finish().map_err(not_stored)?;
    Ok(bytes)
}

/// Returns the metadata (Exif) that state a resolution in pixels an inch: a TIFF without a picture,
/// of one directory.
#[cfg(feature = "pictures")]
fn exif(dpi: f64) -> Vec<u8> {
    const X_RESOLUTION: u16 = 282;
    const Y_RESOLUTION: u16 = 283;
    const RESOLUTION_UNIT: u16 = 296;
    const SHORT: u16 = 3;
    const RATIONAL: u16 = 5;
    const INCH: u32 = 2;
    // The head takes 8 bytes, the directory 2 for its length, 12 an entry and 4 for its end.
    const END: u32 = 8 + 2 + 3 * 12 + 4;
    let mut bytes = b"II*\0\x08\0\0\0\x03\0".to_vec();
    let entries = [
        (X_RESOLUTION, RATIONAL, END),
        (Y_RESOLUTION, RATIONAL, END),
        (RESOLUTION_UNIT, SHORT, INCH),
    ];
    for (tag, kind, value) in entries {
        bytes.extend([tag, kind].into_iter().flat_map(u16::to_le_bytes));
        bytes.extend([1, value].into_iter().flat_map(u32::to_le_bytes));
    }
    bytes.extend(0u32.to_le_bytes());
    bytes.extend([(dpi * 1000.0).round() as u32, 1000].into_iter().flat_map(u32::to_le_bytes));
    bytes
}

/// Returns the bytes of a TIFF file.
#[cfg(feature = "pictures")]
fn tiff<C: tiff::encoder::colortype::ColorType>(
    data: &[C::Inner],
    [width, height]: [u32; 2],
    encoding: &Encoding,
) -> Result<Vec<u8>>
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    use tiff::{
        encoder::{Compression, Predictor, Rational, TiffEncoder, compression::DeflateLevel},
        tags::{ResolutionUnit, Tag},
    };
    /// Opacities that colours are not multiplied by.
    const UNASSOCIATED: u16 = 2;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let encoder = TiffEncoder::new(&mut bytes).map_err(not_stored)?;
    let mut encoder = encoder
        .with_compression(Compression::Deflate(DeflateLevel::Balanced))
        .with_predictor(Predictor::Horizontal);
    let mut picture = encoder.new_image::<C>(width, height).map_err(not_stored)?;
    if let Some(dpi) = encoding.dpi {
        let density = Rational { n: (dpi * 1000.0).round() as u32, d: 1000 };
        picture.resolution(ResolutionUnit::Inch, density);
    }
    if C::BITS_PER_SAMPLE.len() == 4 {
        let extra = &[UNASSOCIATED][..];
        picture.encoder().write_tag(Tag::ExtraSamples, extra).map_err(not_stored)?;
    }
    picture.write_data(data).map_err(not_stored)?;
    Ok(bytes.into_inner())
}

/// Returns the error for a picture that its format cannot store.
pub(super) fn not_stored(error: impl std::fmt::Display) -> Error {
    Error::Argument(format!("the picture cannot be stored: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of an opaque pixel, a half transparent one, one that shows nothing, and a dark one.
    fn row() -> Picture {
        let color =
            vec![[0.8, 0.4, 0.2, 1.0], [0.25, 0.5, 0.1, 0.5], [0.0; 4], [0.02, 0.01, 0.0, 1.0]];
        Picture { width: 4, height: 1, color, depth: vec![2.0, 3.5, f32::INFINITY, 1e6] }
    }

    fn encoding(format: PictureFormat, background: Option<[f32; 3]>) -> Encoding {
        Encoding { background, dpi: Some(300.0), ..Encoding::new(format) }
    }

    #[test]
    fn formats_are_known_by_extension() {
        let of = |name: &str| PictureFormat::of(Path::new(name)).ok();
        assert_eq!(of("a.PNG"), Some(PictureFormat::Png));
        assert_eq!(of("a.jpeg"), Some(PictureFormat::Jpeg));
        for name in ["a.tif", "a.tiff", "a.webp", "a.exr"] {
            assert_eq!(of(name).is_some(), cfg!(feature = "pictures"), "{name}");
        }
        assert_eq!((of("a.gif"), of("a"), of("png")), (None, None, None));
        for name in ["a.png", "a.jpg"] {
            let format = of(name).unwrap();
            assert_eq!(format.extension(), &name[2..]);
        }
    }

    #[test]
    fn bits_and_resolutions_that_a_format_lacks_are_refused() {
        let check = |format, bits, dpi| {
            Encoding { bits, dpi, ..Encoding::new(format) }.check().map_err(|e| e.to_string())
        };
        assert_eq!(check(PictureFormat::Png, Some(16), Some(0.5e4)), Ok(()));
        let error = check(PictureFormat::Jpeg, Some(16), None).unwrap_err();
        assert!(error.contains("bits: a .jpg file has 8 bits a channel, not 16"), "{error}");
        let error = check(PictureFormat::OpenExr, Some(8), None).unwrap_err();
        assert!(error.contains("16 or 32"), "{error}");
        for dpi in [0.0, -3.0, f64::NAN, f64::INFINITY, 1e5] {
            let error = check(PictureFormat::Png, None, Some(dpi)).unwrap_err();
            assert!(error.contains("dpi: a resolution is 1 to 10000 pixels an inch"), "{error}");
        }
    }

    #[test]
    fn layers_are_stored_in_openexr_alone() {
        let layers = Layers { identifiers: Some(vec![1; 4]), ..Layers::default() };
        let error = row().encode_with(&Encoding::new(PictureFormat::Png), &layers).unwrap_err();
        assert!(error.to_string().contains("layers: a .png file has no layers"), "{error}");
        assert!(row().encode_with(&Encoding::new(PictureFormat::Png), &Layers::default()).is_ok());
    }

    #[test]
    fn png_files_have_bits_opacity_and_a_resolution() {
        for bits in [8, 16] {
            let encoding = Encoding { bits: Some(bits), ..encoding(PictureFormat::Png, None) };
            let bytes = row().encode(&encoding).unwrap();
            let reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
            let density = reader.info().pixel_dims.unwrap();
            assert_eq!((density.xppu, density.yppu), (11811, 11811));
            assert_eq!(reader.info().bit_depth as u32, bits);
            let read = image::load_from_memory(&bytes).unwrap().to_rgba16();
            let half = if bits == 8 { 128 } else { 32768 / 257 };
            assert_eq!(read.get_pixel(1, 0).0.map(|v| v / 257), [half, 255, 51, half]);
            assert_eq!(read.get_pixel(2, 0).0, [0; 4]);
        }
        let sixteen = Encoding { bits: Some(16), ..Encoding::new(PictureFormat::Png) };
        let read = image::load_from_memory(&row().encode(&sixteen).unwrap()).unwrap();
        assert_eq!(read.to_rgba16().into_raw(), row().to_rgba16(None));
        assert_eq!(row().to_rgba16(None)[..4], [52428, 26214, 13107, 65535]);
    }

    #[test]
    fn jpeg_files_have_a_resolution() {
        let bytes = row().encode(&encoding(PictureFormat::Jpeg, None)).unwrap();
        // The head of JFIF: units of an inch, and pixels along both axes.
        assert_eq!(bytes[6..11], *b"JFIF\0");
        assert_eq!(bytes[13..18], [1, 1, 44, 1, 44]);
    }

    #[cfg(feature = "pictures")]
    #[test]
    fn tiff_files_have_bits_opacity_and_a_resolution() {
        use tiff::{
            decoder::{Decoder, DecodingResult},
            tags::Tag,
        };
        for background in [None, Some([1.0, 0.0, 0.5])] {
            for bits in [8, 16] {
                let encoding =
                    Encoding { bits: Some(bits), ..encoding(PictureFormat::Tiff, background) };
                let bytes = row().encode(&encoding).unwrap();
                let mut decoder = Decoder::new(std::io::Cursor::new(bytes)).unwrap();
                let density = decoder.get_tag(Tag::XResolution).unwrap();
                assert!(format!("{density:?}").contains("300000"), "{density:?}");
                assert_eq!(decoder.get_tag_u32(Tag::ResolutionUnit).unwrap(), 2);
                // 2 is for opacities that colours are not multiplied by.
                let extra = decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples).unwrap();
                assert_eq!(extra, background.is_none().then(|| vec![2]));
                let picture = row();
                match decoder.read_image().unwrap() {
                    DecodingResult::U8(read) if background.is_none() => {
                        assert_eq!(read, picture.to_rgba8(None));
                    }
                    DecodingResult::U8(read) => {
                        assert_eq!(read, opaque(&picture.to_rgba8(background)));
                    }
                    DecodingResult::U16(read) if background.is_none() => {
                        assert_eq!((bits, read), (16, picture.to_rgba16(None)));
                    }
                    DecodingResult::U16(read) => {
                        assert_eq!((bits, read), (16, opaque(&picture.to_rgba16(background))));
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
    }

    #[cfg(feature = "pictures")]
    #[test]
    fn webp_files_are_lossless() {
        for background in [None, Some([1.0, 0.0, 0.5])] {
            let bytes = row().encode(&encoding(PictureFormat::WebP, background)).unwrap();
            let mut decoder = image_webp::WebPDecoder::new(std::io::Cursor::new(bytes)).unwrap();
            let mut read = vec![0; decoder.output_buffer_size().unwrap()];
            decoder.read_image(&mut read).unwrap();
            let wanted = row().to_rgba8(background);
            let exif = decoder.exif_metadata().unwrap().expect("a resolution");
            assert_eq!(exif.len(), 58);
            assert_eq!(exif[50..], [[0xe0, 0x93, 4, 0], [0xe8, 3, 0, 0]].concat()[..]);
            let is_opaque = !decoder.has_alpha();
            assert_eq!(read, if is_opaque { opaque(&wanted) } else { wanted });
            assert!(!is_opaque || background.is_some());
        }
        let wide = Picture::blank([16_385, 1]).encode(&Encoding::new(PictureFormat::WebP));
        assert!(matches!(wide, Err(Error::Argument(_))), "{wide:?}");
    }
}
