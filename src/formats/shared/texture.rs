//! Pictures that a mesh refers to, decoded within the limits.

use crate::{
    Result,
    error::LimitKind,
    input::{
        Source,
        isolate::{FEW_PIXELS, isolated, isolated_in_time},
        neighbour::is_inside,
    },
    surface::Texture,
    warning,
};
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};
use std::{io::Cursor, path::PathBuf, sync::Arc};

/// Maximum number of texels per byte: deflate packs at most 1032 bytes into one, and a byte may
/// contain 8 grey texels.
const MOST_TEXELS: u64 = 8 * 1032;
/// Bytes per texel during decoding: 16 bits per channel from the decoder, 8 bits per channel in the
/// picture and in the texture.
const TEXEL: u64 = 8 + 4 + 4;

/// Decodes a PNG or JPEG picture, or with the feature `gltf` a WebP picture. `place` names what
/// refers to it.
pub(crate) fn decode(source: &Source, place: &str, bytes: &[u8]) -> Result<Arc<Texture>> {
    picture(source, place, bytes, |picture| {
        let picture = picture.into_rgba8();
        let (width, height) = picture.dimensions();
        let texels = picture.pixels().map(|pixel| pixel.0).collect();
        Arc::new(Texture { width, height, texels })
    })
}

/// As [`decode`], but returns what `make` makes of the pixels.
pub(crate) fn picture<T: Send + 'static>(
    source: &Source,
    place: &str,
    bytes: &[u8],
    make: impl FnOnce(DynamicImage) -> T + Send + 'static,
) -> Result<T> {
    let wrong = |message: String| source.error(place, message);
    let ((width, height), is_webp) = isolated(source, place, || {
        let (decoder, is_webp) = open(bytes).map_err(wrong)?;
        Ok((ImageDecoder::dimensions(&decoder), is_webp))
    })?;
    let texels = u64::from(width) * u64::from(height);
    source.limits.check(
        LimitKind::Texels,
        source.path,
        format!("{place}: the number of texels"),
        texels,
    )?;
    if !is_webp && texels > (bytes.len() as u64).saturating_mul(MOST_TEXELS) {
        let message = format!(
            "the picture claims {width} × {height} texels, more than {} bytes can hold",
            bytes.len()
        );
        return Err(source.error(place, message));
    }
    source.spend("the size of a picture in bytes", texels * TEXEL)?;
    let copy = bytes.to_vec();
    isolated_in_time(source, place, texels > FEW_PIXELS, move || {
        let (mut decoder, _) = open(&copy)?;
        let mut limits = image::Limits::default();
        // Enough for 16 bits per channel and the decoder's own copy.
        limits.max_alloc = Some((texels * 16).saturating_add(1 << 20));
        decoder.set_limits(limits).map_err(broken)?;
        let picture = DynamicImage::from_decoder(decoder).map_err(broken)?;
        if texels == 0 {
            return Err("the picture has no texels".into());
        }
        Ok(make(picture))
    })
}

/// Returns the decoder of a picture, and whether it is WebP, which packs a picture of one colour
/// into a few bytes, whatever its size.
fn open(bytes: &[u8]) -> Result<(impl ImageDecoder + '_, bool), String> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let reader = reader.map_err(|error| broken(error.into()))?;
    let is_webp = reader.format() == Some(ImageFormat::WebP);
    Ok((reader.into_decoder().map_err(broken)?, is_webp))
}

#[expect(clippy::needless_pass_by_value, reason = "for map_err")]
fn broken(error: ImageError) -> String {
    format!("the picture cannot be decoded: {error}")
}

/// Reads the picture that a file refers to. Returns `None`, with a warning, if the file does not
/// exist.
pub(crate) fn read_reference(
    source: &Source,
    place: &str,
    reference: &str,
) -> Result<Option<Arc<Texture>>> {
    let Some(path) = find(source, place, reference)? else { return Ok(None) };
    let file = source.open_beside(&path)?;
    file.unless_changed(decode(&file, place, file.bytes())).map(Some)
}

/// Returns the path of a file that may be missing: `None`, with a warning, if a valid reference
/// names a file that does not exist.
pub(crate) fn find(source: &Source, place: &str, reference: &str) -> Result<Option<PathBuf>> {
    let reference = reference.replace('\\', "/");
    match source.neighbour(place, &reference) {
        Ok(path) => Ok(Some(path)),
        Err(_)
            if is_inside(&reference)
                && (source.is_alone()
                    || source
                        .path
                        .parent()
                        .is_some_and(|folder| !folder.join(&reference).exists())) =>
        {
            warning::give!(
                "{}: {place}: “{reference}” does not exist; drawn without it",
                source.path.display()
            );
            Ok(None)
        }
        Err(error) => Err(error),
    }
}
