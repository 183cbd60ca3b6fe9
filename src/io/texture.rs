//! Pictures that a mesh refers to, decoded under the limits.

use super::Source;
use crate::{Error, Result, surface::Texture};
use std::{
    io::Cursor,
    path::{Component, Path, PathBuf},
    sync::Arc,
};

/// Decodes a PNG or JPEG picture. `place` names what refers to it.
pub(super) fn decode(source: &Source, place: &str, bytes: &[u8]) -> Result<Arc<Texture>> {
    let broken = |e: image::ImageError| source.error(place, format!("the picture cannot be decoded: {e}"));
    let reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| broken(e.into()))?;
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = image::ImageDecoder::dimensions(&decoder);
    let texels = u64::from(width) * u64::from(height);
    if texels > source.limits.texels {
        return Err(Error::Limit {
            file: source.path.to_owned(),
            what: format!("{place}: the number of texels"),
            found: texels,
            limit: source.limits.texels,
        });
    }
    let mut limits = image::Limits::default();
    // Room for 16 bits a channel and the decoder's own copy.
    limits.max_alloc = Some((texels * 16).saturating_add(1 << 20));
    image::ImageDecoder::set_limits(&mut decoder, limits).map_err(broken)?;
    let picture = image::DynamicImage::from_decoder(decoder).map_err(broken)?.into_rgba8();
    let texels: Vec<[u8; 4]> = picture.pixels().map(|pixel| pixel.0).collect();
    if texels.is_empty() {
        return Err(source.error(place, "the picture has no texels"));
    }
    Ok(Arc::new(Texture { width, height, texels }))
}

/// Reads the picture that a file refers to. `None`, with a warning, where there is no such file.
pub(super) fn read_reference(source: &Source, place: &str, reference: &str) -> Result<Option<Arc<Texture>>> {
    let Some(path) = find(source, place, reference)? else { return Ok(None) };
    let file = Source::open(&path, source.limits)?;
    file.unless_changed(decode(&file, place, file.bytes())).map(Some)
}

/// The path of a file that may be missing: `None`, with a warning, where a proper reference leads to no file.
pub(super) fn find(source: &Source, place: &str, reference: &str) -> Result<Option<PathBuf>> {
    let reference = reference.replace('\\', "/");
    let inside = Path::new(&reference).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    match source.neighbour(place, &reference) {
        Ok(path) => Ok(Some(path)),
        Err(_)
            if inside
                && !reference.contains("://")
                && source.path.parent().is_some_and(|folder| !folder.join(&reference).exists()) =>
        {
            tracing::warn!("{}: {place}: “{reference}” does not exist; drawn without it", source.path.display());
            Ok(None)
        }
        Err(error) => Err(error),
    }
}
