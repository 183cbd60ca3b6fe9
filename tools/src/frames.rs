//! Where the frames of a run go.

use crate::{
    failure::Failure,
    output::{self, Target},
};
use splatkit::picture::{Encoding, Layers, Picture, PictureFormat};
use splatkit_media::video::{Encoder, Film, Format};
use std::path::{Path, PathBuf};

/// Where the frames go.
pub enum Frames {
    /// Each frame is a picture.
    Pictures(Vec<Target>),
    /// All frames are one film.
    Film(PathBuf, Format),
    /// The bytes of all frames go to stdout.
    Raw,
}

impl Frames {
    /// Returns the pictures of the frames: one that `-o` names, or numbered ones of a moving
    /// camera. Fails if one of the files exists and may not be replaced.
    pub fn pictures(output: &Path, count: Option<u32>, overwrite: bool) -> Result<Self, Failure> {
        let Some(count) = count else {
            if Format::of(output).is_some() && PictureFormat::of(output).is_err() {
                let message = "an animation needs --turntable, --path or --times";
                return Err(Failure::Usage(format!("{}: {message}", output.display())));
            }
            return Ok(Self::Pictures(vec![Target::new(output, overwrite)?]));
        };
        if PictureFormat::of(output).is_err() {
            return Err(Failure::Usage(format!(
                "{}: unknown format of an animation, use .gif, .webp, .apng, .mp4, .webm or .mov, \
                 or .png, .jpg, .tiff or .exr for numbered pictures",
                output.display()
            )));
        }
        let target = |frame| Target::new(&numbered(output, frame)?, overwrite);
        Ok(Self::Pictures((0..count).map(target).collect::<Result<_, _>>()?))
    }

    /// Returns the files that will be written.
    pub fn files(&self) -> Vec<&Path> {
        match self {
            Self::Pictures(targets) => targets.iter().filter_map(Target::file).collect(),
            Self::Film(path, _) => vec![path],
            Self::Raw => Vec::new(),
        }
    }

    /// Returns the name of a frame, for messages.
    pub fn name(&self, frame: usize) -> String {
        match self {
            Self::Pictures(targets) => targets[frame].name(),
            Self::Film(path, _) => format!("{}, frame {}", path.display(), frame + 1),
            Self::Raw => format!("-, frame {}", frame + 1),
        }
    }

    /// Whether the frames are played at a rate.
    pub fn is_film(&self) -> bool {
        matches!(self, Self::Film(..) | Self::Raw)
    }

    /// Whether a player shows the frames at a rate of the file's own.
    pub fn is_played(&self) -> bool {
        matches!(self, Self::Film(..))
    }

    /// Begins to write.
    pub fn open(&self, film: Film, how: Storing) -> Result<Writer<'_>, Failure> {
        let (background, way) = match self {
            Self::Pictures(targets) => (film.background, Way::Pictures(targets.iter())),
            Self::Film(path, format) => {
                let back = if format.keeps_opacity() { None } else { Some([0.0; 3]) };
                (film.background.or(back), Way::Film(format.open(path, film)?))
            }
            Self::Raw => (film.background, Way::Raw),
        };
        Ok(Writer { background, how, way })
    }

    /// Refuses bits that a picture file of this kind cannot have, and layers if it has none.
    pub fn check(&self, how: Storing, has_layers: bool) -> Result<(), Failure> {
        match self {
            Self::Pictures(targets) => {
                for encoding in targets.iter().take(1).map(|it| how.of(it.format(), None)) {
                    encoding.check()?;
                    encoding.check_layers(has_layers)?;
                }
            }
            Self::Film(..) | Self::Raw if how.bits.is_some() => {
                let message = "--bits is for pictures: films and raw frames have 8 bits a channel";
                return Err(Failure::Usage(message.into()));
            }
            Self::Film(..) | Self::Raw => {}
        }
        Ok(())
    }
}

/// How pictures are stored: bits a channel, and pixels an inch.
#[derive(Debug, Clone, Copy, Default)]
pub struct Storing {
    pub bits: Option<u32>,
    pub dpi: Option<f64>,
}

impl Storing {
    /// Returns how a picture over a background becomes a file of a format.
    pub fn of(self, format: PictureFormat, background: Option<[f32; 3]>) -> Encoding {
        let mut encoding = Encoding::new(format);
        (encoding.background, encoding.bits, encoding.dpi) = (background, self.bits, self.dpi);
        encoding
    }
}

/// Writes frames one after the other.
pub struct Writer<'a> {
    background: Option<[f32; 3]>,
    how: Storing,
    way: Way<'a>,
}

enum Way<'a> {
    Pictures(std::slice::Iter<'a, Target>),
    Film(Box<dyn Encoder>),
    Raw,
}

impl Writer<'_> {
    /// Writes the next frame. Returns whether more frames are wanted.
    pub fn add(&mut self, picture: &Picture) -> Result<bool, Failure> {
        self.add_with(picture, &Layers::default())
    }

    /// Writes the next frame with layers. Returns whether more frames are wanted.
    pub fn add_with(&mut self, picture: &Picture, layers: &Layers) -> Result<bool, Failure> {
        match &mut self.way {
            Way::Pictures(targets) => {
                let Some(target) = targets.next() else { return Ok(false) };
                let encoding = self.how.of(target.format(), self.background);
                target.write(&picture.encode_with(&encoding, layers)?)?;
                Ok(true)
            }
            Way::Film(encoder) => Ok(encoder.add(&picture.to_rgba8(self.background))?),
            Way::Raw => output::offer(&picture.to_rgba8(self.background)),
        }
    }

    /// Completes a film. Pictures are complete already.
    pub fn finish(self) -> Result<(), Failure> {
        match self.way {
            Way::Pictures(_) | Way::Raw => Ok(()),
            Way::Film(encoder) => Ok(encoder.finish()?),
        }
    }
}

/// Returns the name of a numbered picture.
pub fn numbered(path: &Path, frame: u32) -> Result<PathBuf, Failure> {
    // A name that is not valid Unicode has no placeholder, but can be numbered.
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let Some(start) = name.find("{frame") else {
        let mut name = path.file_stem().unwrap_or_default().to_owned();
        name.push(format!("_{frame:04}."));
        name.push(path.extension().unwrap_or_default());
        return Ok(path.with_file_name(name));
    };
    let (before, rest) = name.split_at(start);
    let parts = rest.strip_prefix("{frame").and_then(|rest| rest.split_once('}'));
    let width = parts.and_then(|(format, _)| match format.strip_prefix(':') {
        None => format.is_empty().then_some(0),
        Some(digits) => digits.parse().ok().filter(|width| *width <= 20),
    });
    match (parts, width) {
        (Some((_, after)), Some(width)) => {
            Ok(path.with_file_name(format!("{before}{frame:0width$}{after}")))
        }
        _ => Err(Failure::Usage(format!(
            "{}: the placeholder must be {{frame}} or {{frame:04}}",
            path.display()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered() {
        let name =
            |text: &str| numbered(Path::new(text), 7).map(|path| path.display().to_string()).ok();
        assert_eq!(name("a/out.png").as_deref(), Some("a/out_0007.png"));
        assert_eq!(name("a/{frame}.png").as_deref(), Some("a/7.png"));
        assert_eq!(name("a/x{frame:03}y.jpg").as_deref(), Some("a/x007y.jpg"));
        assert!(
            name("{frame:x}.png").is_none()
                && name("{frames}.png").is_none()
                && name("{frame.png").is_none()
        );
        assert!(name("{frame:99999}.png").is_none());
    }

    #[cfg(unix)]
    #[test]
    fn names_that_are_no_text_are_numbered() {
        use std::{ffi::OsStr, os::unix::ffi::OsStrExt};
        let path = |bytes: &'static [u8]| Path::new(OsStr::from_bytes(bytes));
        assert_eq!(numbered(path(b"a/\xff.png"), 7).unwrap(), path(b"a/\xff_0007.png"));
    }
}
