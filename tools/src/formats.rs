//! `splatkit formats`.

use crate::{failure::Failure, output};
use clap::Args;
use splatkit::formats::{FORMATS, Format};

#[derive(Args, Debug)]
pub struct Formats {
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
}

impl Formats {
    pub fn run(self) -> Result<(), Failure> {
        if self.json {
            return output::json(&serde_json::Value::from_iter(FORMATS.iter().map(value)));
        }
        FORMATS.iter().try_for_each(|format| output::line(text(format)))
    }
}

fn value(format: &Format) -> serde_json::Value {
    let holds = format.holds.iter().map(|holding| {
        let when = Some(holding.when).filter(|when| !when.is_empty());
        serde_json::json!({ "content": holding.content.name(), "when": when })
    });
    serde_json::json!({
        "name": format.name,
        "extensions": format.extensions,
        "holds": serde_json::Value::from_iter(holds),
        "read_in_pieces": format.in_pieces().is_some(),
        "written": format.written.is_some(),
    })
}

fn text(format: &Format) -> String {
    let extensions: Vec<String> =
        format.extensions.iter().map(|extension| format!(" .{extension}")).collect();
    let extensions =
        if extensions.is_empty() { " any extension".into() } else { extensions.concat() };
    let holds: Vec<String> = format.holds.iter().map(ToString::to_string).collect();
    let pieces = match format.in_pieces() {
        None => "read as a whole".into(),
        Some("") => "read in pieces".into(),
        Some(of) => format!("{of} are read in pieces"),
    };
    let written =
        format.written.map_or("not written".into(), |extension| format!("written as .{extension}"));
    format!("{} {extensions}\n   {}\n   {pieces}, {written}", format.name, holds.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_when_a_file_holds_what() {
        let named =
            |name: &str| text(FORMATS.iter().find(|format| format.name == name).expect(name));
        assert_eq!(
            named("PLY"),
            "PLY  .ply\n   mesh (with faces), point cloud (without faces), scattered samples \
             (without faces, if a scalar is named), trained Gaussians (as trainers write them, \
             also compressed)\n   binary files are read in pieces, written as .ply"
        );
        assert_eq!(
            named("glTF"),
            "glTF  .gltf .glb\n   mesh (with faces), point cloud (without faces), trained \
             Gaussians (with KHR_gaussian_splatting)\n   read as a whole, written as .glb"
        );
        assert!(named("raw").starts_with("raw  any extension\n   volume (if its layout is given)"));
    }
}
