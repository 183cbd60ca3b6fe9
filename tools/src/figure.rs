//! The page of a picture, as the flags say it: its size on paper, and several views in one picture.

use crate::parse;
use clap::{
    Args, ValueEnum,
    builder::{PossibleValuesParser, TypedValueParser},
};
use splatkit::session::{Description, PanelLabels, PaperLength, Side};

/// The page of a picture.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Figures")]
pub struct FigureFlags {
    /// Set the width on paper, such as 85mm, 8.5cm, 3.3in or 240pt, instead of --size. Needs --dpi.
    #[arg(long, value_name = "LENGTH", conflicts_with = "size")]
    width: Option<PaperLength>,
    /// Set the height on paper, as --width. Without one of them, the other gives it.
    #[arg(long, value_name = "LENGTH", conflicts_with = "size")]
    height: Option<PaperLength>,
    /// Set the pixels an inch. The file stores them, letters are 8 points high, and edges half a
    /// point wide.
    #[arg(long, value_name = "NUMBER", value_parser = parse::positive)]
    dpi: Option<f64>,
    /// Show several sides beside each other in one scale: front, back, left, right, top, bottom or
    /// iso, with commas between them. Without a size, each is 640x640 pixels large.
    #[arg(
        long,
        value_name = "SIDES",
        value_delimiter = ',',
        value_parser = sides(),
        conflicts_with_all = ["view", "camera", "view_of", "camera_position", "turntable", "path"]
    )]
    views: Vec<Side>,
    /// Show each channel in a panel of its own, and all of them in the last one.
    #[arg(
        long,
        conflicts_with_all = ["views", "turntable", "path", "times", "depth"]
    )]
    split_channels: bool,
    /// Set the number of views or channels in a row [default: all of up to four, else about a
    /// square], or of --times in one picture
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..))]
    columns: Option<u32>,
    /// Choose what the corner of each view says [default: names]
    #[arg(long, value_enum)]
    panel_labels: Option<Labels>,
}

/// [`PanelLabels`] as a flag.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Labels {
    /// Write the side, such as front.
    Names,
    /// Write a, b, c, ….
    Letters,
    /// Write nothing.
    None,
}

impl FigureFlags {
    /// Whether each channel has a panel.
    pub fn splits_channels(&self) -> bool {
        self.split_channels
    }

    /// Returns the number of panels in a row, if it is given, and what the corner of each says.
    pub fn row_of_channels(&self) -> (Option<u32>, PanelLabels) {
        (self.columns, self.panel_labels.map(PanelLabels::from).unwrap_or_default())
    }

    /// Returns the number of times in a row, and what the corner of each says. `None` if times
    /// become frames.
    pub fn row_of_times(&self) -> Option<(u32, PanelLabels)> {
        let labels = self.panel_labels.map(PanelLabels::from).unwrap_or_default();
        self.columns.map(|columns| (columns, labels))
    }

    /// Changes the page of a scene's picture: by the flags that are given.
    pub fn apply(&self, scene: &mut Description, has_size: bool) {
        let picture = &mut scene.picture;
        if self.width.is_some() || self.height.is_some() {
            (picture.size, picture.width, picture.height) = (None, self.width, self.height);
        } else if has_size {
            (picture.width, picture.height) = (None, None);
        }
        picture.dpi = self.dpi.or(picture.dpi);
        if !self.views.is_empty() {
            picture.views.clone_from(&self.views);
            scene.camera = None;
            scene.framing.camera_position = None;
        }
        picture.columns = self.columns.or(picture.columns);
        picture.panel_labels = self.panel_labels.map(PanelLabels::from).or(picture.panel_labels);
    }
}

impl From<Labels> for PanelLabels {
    fn from(labels: Labels) -> Self {
        match labels {
            Labels::Names => Self::Names,
            Labels::Letters => Self::Letters,
            Labels::None => Self::None,
        }
    }
}

/// Parses a side to look from.
pub fn sides() -> impl TypedValueParser<Value = Side> {
    PossibleValuesParser::new(Side::ALL.map(Side::name)).map(|name| {
        Side::ALL.into_iter().find(|side| side.name() == name).expect("a name of the list")
    })
}
