//! What is written over a finished picture, as the flags say it.

use clap::Args;
use splatkit::session::Description;

/// What is written over the picture.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Texts")]
pub struct OverlayFlags {
    /// Draw the colours of the values, with their name, their unit and round numbers.
    #[arg(long)]
    scalar_bar: bool,
    /// Draw how the axes X, Y and Z lie; of patients, left and right (L, R), front and back (A, P),
    /// head and feet (S, I).
    #[arg(long)]
    axes: bool,
    /// Draw a round length in the file's unit. In perspective it holds at the distance of the focal
    /// point; with --orthographic, everywhere.
    #[arg(long)]
    scale_bar: bool,
    /// Write this text above the picture's content; \n begins a new line. At most 1000 characters.
    #[arg(long, value_name = "TEXT", value_parser = caption)]
    caption: Option<String>,
}

const MOST_CAPTION: usize = Description::MOST_CAPTION;

/// Takes a caption, unless it is too long.
fn caption(text: &str) -> Result<String, String> {
    match text.chars().count() {
        ..=MOST_CAPTION => Ok(text.to_owned()),
        count => Err(format!("a caption has at most {MOST_CAPTION} characters, not {count}")),
    }
}

impl OverlayFlags {
    /// Changes what is written over the picture of a scene: by the flags that are given.
    pub fn apply(&self, scene: &mut Description) {
        let overlay = &mut scene.overlay;
        overlay.scalar_bar |= self.scalar_bar;
        overlay.axes |= self.axes;
        overlay.scale_bar |= self.scale_bar;
        overlay.caption = self.caption.clone().or(overlay.caption.take());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn captions_have_a_length() {
        assert_eq!(caption(&"é".repeat(MOST_CAPTION)).map(|text| text.len()), Ok(2000));
        let error = caption(&"A".repeat(500_000)).unwrap_err();
        assert_eq!(error, "a caption has at most 1000 characters, not 500000");
        let flag = OverlayFlags::augment_args(clap::Command::new("test"));
        let flag = flag.get_arguments().find(|flag| flag.get_long() == Some("caption"));
        let help = flag.unwrap().get_help().unwrap().to_string();
        assert!(help.contains(&format!("At most {MOST_CAPTION} characters")), "{help}");
    }
}
