//! The flags that change what is converted, in the order in which they are given.

use crate::parse;
use clap::{ArgMatches, Args, Command, FromArgMatches};
use glam::DVec3;
use splatkit::edit::{Crs, Edit, Expression, Motion, Region, Reprojection, Thin};

/// Edits of meshes, point clouds, hierarchies and trained Gaussians.
#[derive(Args, Debug)]
#[command(next_help_heading = "Edits")]
struct Flags {
    /// Keep what lies in a box X,Y,Z,X,Y,Z, in sphere:X,Y,Z,RADIUS, or in a polygon seen along an
    /// axis: xy:X,Y,X,Y,X,Y,…, xz:… or yz:…. Edits are made in the order of their flags, and each
    /// can be given several times.
    #[arg(long, value_name = "REGION", allow_hyphen_values = true)]
    crop: Vec<Region>,
    /// Keep what meets a condition, such as 'classification == 2 && intensity > 100'. Values are x,
    /// y, z, height, and those of the file: `splatkit info` lists them. Trained Gaussians have
    /// opacity, scale, scale_x, scale_y, scale_z, red, green and blue.
    #[arg(long = "where", value_name = "CONDITION", allow_hyphen_values = true)]
    condition: Vec<Expression>,
    /// Move everything by this much along x, y and z, in world units.
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_parser = parse::vector,
        allow_hyphen_values = true
    )]
    translate: Vec<DVec3>,
    /// Turn everything about an axis through the world's origin, such as z:90 or 1,1,0:-30, in
    /// degrees, counter-clockwise for an eye that looks against the axis.
    #[arg(long, value_name = "AXIS:DEGREES", allow_hyphen_values = true)]
    rotate: Vec<Motion>,
    /// Scale everything about the world's origin.
    #[arg(long, value_name = "FACTOR", value_parser = parse::positive)]
    scale: Vec<f64>,
    /// Move everything by a matrix: 16 numbers with commas, row by row; the last row is 0,0,0,1.
    #[arg(long, value_name = "NUMBERS", value_parser = matrix, allow_hyphen_values = true)]
    matrix: Vec<Motion>,
    /// Give points and meshes the coordinates of another reference system, EPSG:25832 or a PROJ
    /// string such as '+proj=utm +zone=32 +ellps=GRS80'. Heights stay. Geographic systems have
    /// longitudes and latitudes in degrees.
    #[arg(long, value_name = "CRS")]
    reproject: Vec<Crs>,
    /// The coordinate reference system of the inputs, for --reproject, instead of what they say.
    #[arg(long, value_name = "CRS", requires = "reproject")]
    from_crs: Option<Crs>,
    /// Keep points that are no nearer to each other than a distance in world units, such as 0.05; a
    /// share of them, such as 10%; or this many, such as 100000pts. Trained Gaussians and the
    /// splats of hierarchies are merged: those narrower than the distance, or to this share or
    /// number.
    #[arg(long, value_name = "DISTANCE|SHARE|COUNT")]
    thin: Vec<Thin>,
    /// Remove clusters of fewer than 64 points that lie far from all others.
    #[arg(long)]
    remove_floaters: bool,
    /// Keep the largest clusters, this many.
    #[arg(
        long,
        value_name = "COUNT",
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    keep_cluster: Vec<u32>,
    /// Estimate the normals of points, in place of those that they have.
    #[arg(long)]
    normals: bool,
}

/// The edits in the order of their flags.
#[derive(Debug, Default)]
pub struct EditFlags(pub Vec<Edit>);

impl FromArgMatches for EditFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let flags = Flags::from_arg_matches(matches)?;
        let mut placed: Vec<(usize, Edit)> = Vec::new();
        let mut add = |id: &str, edits: Vec<Edit>| {
            let places = matches.indices_of(id).into_iter().flatten();
            placed.extend(places.zip(edits));
        };
        let moves = |motions: Vec<Motion>| motions.into_iter().map(Edit::Move).collect();
        add("crop", flags.crop.into_iter().map(Edit::Crop).collect());
        add("condition", flags.condition.into_iter().map(Edit::Where).collect());
        add("translate", moves(flags.translate.into_iter().map(Motion::translation).collect()));
        add("rotate", moves(flags.rotate));
        add("scale", moves(flags.scale.into_iter().map(Motion::scale).collect()));
        add("matrix", moves(flags.matrix));
        let systems = flags.reproject.into_iter();
        let named = |to| Edit::Reproject(Reprojection { from: None, to });
        add("reproject", systems.map(named).collect());
        add("thin", flags.thin.into_iter().map(Edit::Thin).collect());
        let counts = flags.keep_cluster.into_iter();
        add("keep_cluster", counts.map(|count| Edit::KeepCluster(count as usize)).collect());
        add(
            "remove_floaters",
            flags.remove_floaters.then_some(Edit::RemoveFloaters).into_iter().collect(),
        );
        add("normals", flags.normals.then_some(Edit::Normals).into_iter().collect());
        placed.sort_by_key(|(place, _)| *place);
        let mut edits: Vec<Edit> = placed.into_iter().map(|(_, edit)| edit).collect();
        // The next one begins where this one ends.
        let first = edits.iter_mut().find_map(|edit| match edit {
            Edit::Reproject(reprojection) => Some(reprojection),
            _ => None,
        });
        if let Some(first) = first {
            first.from = flags.from_crs;
        }
        Ok(Self(edits))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for EditFlags {
    fn augment_args(command: Command) -> Command {
        Flags::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Flags::augment_args_for_update(command)
    }
}

/// A matrix of four rows with four numbers each.
fn matrix(text: &str) -> Result<Motion, String> {
    let form = "16 numbers with commas between them, row by row";
    Motion::matrix(parse::numbers(text, ',', form)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Vec<Edit>, clap::Error> {
        let command = EditFlags::augment_args(Command::new("convert").no_binary_name(true));
        let matches = command.try_get_matches_from(text.split('|'))?;
        Ok(EditFlags::from_arg_matches(&matches)?.0)
    }

    #[test]
    fn edits_have_the_order_of_their_flags() {
        let edits = parsed(
            "--thin|5%|--where|-x > 1|--scale|2|--normals|--crop|-1,0,0,1,1,1|--thin|0.1|\
             --keep-cluster|2|--rotate|z:90|--remove-floaters|--translate=-1,0,0",
        )
        .unwrap();
        let names: Vec<&str> = edits.iter().map(Edit::name).collect();
        assert_eq!(
            names,
            [
                "thin",
                "where",
                "move",
                "normals",
                "crop",
                "thin",
                "keep-cluster",
                "move",
                "remove-floaters",
                "move"
            ]
        );
        assert_eq!(
            (&edits[0], &edits[5]),
            (&Edit::Thin(Thin::Share(0.05)), &Edit::Thin(Thin::Distance(0.1)))
        );
        assert_eq!(edits[2], Edit::Move(Motion::scale(2.0)));
        assert_eq!(parsed("--matrix|2,0,0,1,0,2,0,2,0,0,2,3,0,0,0,1").unwrap().len(), 1);
    }

    #[test]
    fn wrong_edits_are_named() {
        for (text, word) in [
            ("--where|x >", "column 4"),
            ("--crop|1,2", "X,Y,Z,X,Y,Z"),
            ("--thin|0", "100000pts"),
            ("--matrix|1,2,3", "16 numbers"),
            ("--keep-cluster|0", "keep-cluster"),
            ("--reproject|EPSG:64999", "PDAL"),
            ("--from-crs|EPSG:4326", "--reproject"),
        ] {
            let message = parsed(text).unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
        }
    }
}
