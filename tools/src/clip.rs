//! The flags that clip a scene with planes and boxes.

use clap::Args;
use splatkit::session::{ClipEntry, Description};

/// Which part of space is drawn. Up to eight flags work together.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Clipping")]
pub struct ClipFlags {
    /// Keep only what is inside this shape: plane:NX,NY,NZ,OFFSET (NX·x + NY·y + NZ·z at most
    /// OFFSET), box:X0,Y0,Z0:X1,Y1,Z1, or 'x<AT' or 'x>AT' (also y, z). Coordinates are in world
    /// units, or, except for planes, shares of the scene's box such as 50%.
    #[arg(long, value_name = "SHAPE", value_parser = shape)]
    clip: Vec<ClipEntry>,
    /// Remove what is inside this shape. The shapes are those of --clip.
    #[arg(long, value_name = "SHAPE", value_parser = shape)]
    cut_out: Vec<ClipEntry>,
}

impl ClipFlags {
    /// Changes the clips of a scene, if a flag is given.
    pub fn apply(&self, scene: &mut Description) {
        let removed = self.cut_out.iter().map(|clip| ClipEntry { inside: false, ..*clip });
        let all: Vec<ClipEntry> = self.clip.iter().copied().chain(removed).collect();
        if !all.is_empty() {
            scene.picture.clips = all;
        }
    }
}

/// Parses a shape.
fn shape(text: &str) -> Result<ClipEntry, String> {
    ClipEntry::parse(text, true)
}
