//! Surfels compared with the triangles that they approximate.

use super::{Stage, files};
use crate::report::{Cell, Table};
use glam::DVec3;
use splatkit::{
    Error,
    compare::compare_pictures,
    hierarchy::{BuildOptions, Detail, Tree},
    math::Camera,
    picture::Picture,
    reference,
    scene::{Scene, Settings},
    session::{Data, Framing, Subject},
    surface::{Mesh, SurfelOptions},
};
use splatkit_tools::{failure::Failure, output, parse, progress::Progress};
use std::path::{Path, PathBuf};

/// Pixels along each side of the pictures.
const PIXELS: u32 = 1024;
/// Rays along each side of a pixel of the true picture.
const RAYS: u32 = 4;
/// Pixels within this distance of a silhouette count as lying at it. Holes are counted beyond it.
const BESIDE: usize = 2;
/// A step in depth between neighbouring pixels that counts as a silhouette, in pixels.
const STEP: f64 = 8.0;

/// The error for a file of another kind.
pub const OTHER: &str = "is not a mesh";

/// A mesh file, and the axis that is up in its picture.
#[derive(Debug, Clone)]
pub struct Source {
    pub path: PathBuf,
    pub up: DVec3,
}

impl Source {
    /// `FILE` or `FILE:AXIS`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let named =
            text.rsplit_once(':').and_then(|(path, axis)| Some((path, parse::axis(axis).ok()?)));
        let (path, up) = named.unwrap_or((text, DVec3::Y));
        Ok(Self { path: path.into(), up })
    }

    /// Returns the name of its rows.
    pub fn name(&self) -> String {
        self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// The view of a mesh, and its true picture.
pub struct Truth {
    camera: Camera,
    settings: Settings,
    picture: Picture,
}

impl Truth {
    pub fn of(mesh: &Mesh, up: DVec3) -> splatkit::Result<Self> {
        let settings = Settings::new([PIXELS; 2]);
        let bounds =
            mesh.bounds().ok_or_else(|| Error::NothingToDraw("there are no points".into()))?;
        let subject = Subject::new(bounds, up);
        let camera = Framing::default().camera(&subject, settings.size)?;
        let crease = SurfelOptions::default().crease_angle_degrees;
        let picture = reference::trace(mesh, crease, &camera, &settings, RAYS)?;
        Ok(Self { camera, settings, picture })
    }

    /// Draws a scene that represents the mesh, and compares it with the truth. `scene` contains all
    /// splats, or a hierarchy of which `detail` is drawn. Also returns how many splats were drawn.
    pub fn measure(
        &self,
        stage: &mut Stage,
        scene: &Scene,
        detail: Detail,
    ) -> splatkit::Result<(Picture, Deviation, u64)> {
        let mut prepared = stage.prepare(scene)?;
        let settings = Settings { detail, ..self.settings.clone() };
        let (picture, stats) = stage.renderer.render(&mut prepared, &self.camera, &settings)?;
        let deviation = Deviation::between(
            &picture,
            &self.picture,
            self.camera.view(self.settings.size)?.scale,
        )?;
        Ok((picture, deviation, stats.splats))
    }
}

/// How far a picture of splats is from its truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    psnr: Option<f64>,
    /// Shares of the squared error: at the silhouette, at steps in depth within it, and elsewhere.
    shares: [f64; 3],
    /// For each pixel that is half covered or more, but not so in truth: the distance to the
    /// nearest pixel that truly is, in pixels, ascending.
    over: Vec<f64>,
    /// Number of pixels that are half covered or more only in truth.
    under: usize,
    /// Number of pixels that are half covered or more in truth.
    covered: usize,
    /// Number of pixels inside that let through more than a tenth of the light, and more than half.
    holes: [usize; 2],
}

impl Deviation {
    /// Compares a picture with its truth. `scale` is how many pixels a unit of world length covers
    /// at distance 1 in a perspective view.
    fn between(picture: &Picture, truth: &Picture, scale: f64) -> splatkit::Result<Self> {
        let comparison = compare_pictures(picture, truth)?;
        let size = [truth.width, truth.height].map(|side| side as usize);
        let covered = |at: usize| truth.color[at][3] >= 0.5;
        let mut deviation = Self {
            psnr: comparison.psnr,
            shares: [0.0; 3],
            over: Vec::new(),
            under: 0,
            covered: (0..truth.color.len()).filter(|&at| covered(at)).count(),
            holes: [0; 2],
        };
        for at in 0..truth.color.len() {
            let (pixel, wanted) = (picture.color[at], truth.color[at]);
            let around = || around(at, size, BESIDE);
            let at_outline = around().any(|i| truth.color[i][3] > 0.0)
                && around().any(|i| truth.color[i][3] < 1.0);
            let error: f64 = pixel.iter().zip(wanted).map(|(a, b)| f64::from(a - b).powi(2)).sum();
            let place = if at_outline {
                0
            } else if wanted[3] > 0.0 && around().any(|i| is_step(&truth.depth, i, size[0], scale))
            {
                1
            } else {
                2
            };
            deviation.shares[place] += error;
            match (pixel[3] >= 0.5, covered(at)) {
                (true, false) => deviation.over.push(nearest(at, size, covered)),
                (false, true) => deviation.under += 1,
                _ => {}
            }
            if wanted[3] > 0.0 && !at_outline {
                deviation.holes[0] += usize::from(pixel[3] < 0.9);
                deviation.holes[1] += usize::from(pixel[3] < 0.5);
            }
        }
        let sum: f64 = deviation.shares.iter().sum();
        deviation.shares = deviation.shares.map(|share| share / sum.max(f64::MIN_POSITIVE));
        deviation.over.sort_by(f64::total_cmp);
        Ok(deviation)
    }

    /// Returns the cells in the order of the columns in [`tables`].
    fn cells(&self, splats: u64) -> Vec<Cell> {
        let count = |value: usize| Cell::Number(value as f64, 0);
        let percent = |value: f64| Cell::Number(100.0 * value, 2);
        let mean = self.over.iter().sum::<f64>() / self.over.len().max(1) as f64;
        let high = self.over.get(self.over.len() * 95 / 100).copied().unwrap_or(0.0);
        let covered = self.covered.max(1) as f64;
        vec![
            Cell::Number(splats as f64, 0),
            self.psnr.map_or(Cell::None, |psnr| Cell::Number(psnr, 2)),
            percent(self.shares[0]),
            percent(self.shares[1]),
            percent(self.shares[2]),
            percent(self.over.len() as f64 / covered),
            Cell::Number(mean, 2),
            Cell::Number(high, 2),
            percent(self.under as f64 / covered),
            count(self.holes[0]),
            count(self.holes[1]),
        ]
    }
}

/// Returns the pixels at most `reach` rows and columns away.
fn around(at: usize, [width, height]: [usize; 2], reach: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (at % width, at / width);
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
    rows.flat_map(move |row| {
        (x.saturating_sub(reach)..(x + reach + 1).min(width)).map(move |x| x + row * width)
    })
}

/// Whether depth jumps between a pixel and the next ones to the right and below.
fn is_step(depth: &[f32], at: usize, width: usize, scale: f64) -> bool {
    let here = depth[at];
    [1, width]
        .iter()
        .filter_map(|step| depth.get(at + step))
        .any(|&next| f64::from((next - here).abs()) * scale > STEP * f64::from(here.min(next)))
}

/// Returns the distance to the nearest covered pixel, at most 64 pixels.
fn nearest(at: usize, size: [usize; 2], covered: impl Fn(usize) -> bool) -> f64 {
    let place = |at: usize| [(at % size[0]) as f64, (at / size[0]) as f64];
    let [x, y] = place(at);
    for reach in [2, 8, 64] {
        let distances = around(at, size, reach)
            .filter(|&i| covered(i))
            .map(|i| (place(i)[0] - x).hypot(place(i)[1] - y));
        let least = distances.fold(f64::INFINITY, f64::min);
        if least <= reach as f64 {
            return least;
        }
    }
    64.0
}

/// Returns the files of each source's truth and splats in a folder. Fails if one of them exists
/// already, or if two sources have the same files.
pub fn pictures(
    sources: &[Source],
    folder: &Path,
    overwrite: bool,
) -> Result<Vec<[PathBuf; 2]>, Failure> {
    let files_of = |source: &Source| {
        ["truth", "splats"].map(|what| folder.join(format!("{}_{what}.png", source.name())))
    };
    let files: Vec<_> = sources.iter().map(files_of).collect();
    for (at, paths) in files.iter().enumerate() {
        if let Some(first) = files[..at].iter().position(|other| other == paths) {
            let [first, second] = [first, at].map(|at| sources[at].path.display());
            let picture = paths[0].display();
            return Err(Failure::Usage(format!(
                "{picture} would be the picture of {first} and of {second}: rename one, or \
                 measure them one by one"
            )));
        }
        paths.iter().try_for_each(|file| output::check(file, overwrite))?;
        output::try_writing(&paths[0], &[])?;
    }
    Ok(files)
}

/// Measures the sources. `keep` contains the files of each source's pictures if they are kept.
pub fn tables(
    stage: &mut Stage,
    sources: &[Source],
    open: impl Fn(&Path) -> Result<Data, Failure>,
    keep: &[[PathBuf; 2]],
    progress: &Progress,
) -> Result<[Table; 2], Failure> {
    let mut sizes = files::table();
    let mut table = Table::new(
        "Surfels against triangles.",
        format!(
            "Pictures of {PIXELS}² pixels by the default camera, compared with {} rays per pixel: \
             PSNR in dB; percent of the squared error within {BESIDE} pixels of the outline, at \
             steps in depth, and elsewhere; pixels covered (half or more) outside the true outline \
             in percent of those inside, and their distance from it; pixels inside left open; \
             pixels more than {BESIDE} from the outline with an opacity below 0.9 and 0.5.",
            RAYS * RAYS
        ),
        &[
            "mesh",
            "splats",
            "PSNR",
            "at outline",
            "at steps",
            "elsewhere",
            "outside",
            "mean px",
            "95 % px",
            "left open",
            "< 0.9",
            "< 0.5",
        ],
    );
    for (at, source) in sources.iter().enumerate() {
        progress.stage(format!("Reading {}", source.path.display()));
        let Data::Mesh(mesh) = open(&source.path)? else {
            return Err(Error::input(&source.path, "file", OTHER).into());
        };
        progress.stage(format!("Tracing {}", source.path.display()));
        let truth = Truth::of(&mesh, source.up)?;
        progress.stage(format!("Drawing {}", source.path.display()));
        let splats = mesh.surfels(&SurfelOptions::default())?;
        let options = BuildOptions {
            closed: mesh.is_solid(),
            source_points: Some(mesh.positions.len() as u64),
            ..BuildOptions::default()
        };
        let tree = Tree::build(&splats, &options, None)?;
        let (picture, deviation, drawn) =
            truth.measure(stage, &Scene::new().with_splats(splats), Detail::default())?;
        table.row(source.name(), deviation.cells(drawn));
        let (hierarchy, cells) = files::row(&tree)?;
        sizes.row(source.name(), cells);
        let scene = Scene::new().with_hierarchy(hierarchy);
        for (name, pixels) in
            [("file, leaves", 0.0), ("file, 1 pixel", 1.0), ("file, 2 pixels", 2.0)]
        {
            let (_, deviation, drawn) = truth.measure(stage, &scene, Detail::Pixels(pixels))?;
            table.row(format!("{}, {name}", source.name()), deviation.cells(drawn));
        }
        if let Some([of_truth, of_splats]) = keep.get(at) {
            truth.picture.save(of_truth, Some([0.0; 3]))?;
            picture.save(of_splats, Some([0.0; 3]))?;
        }
    }
    Ok([table, sizes])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of one opaque row of pixels from `from` to `to`, between transparent ones.
    fn bar(from: u32, to: u32, opacity: impl Fn(u32) -> f32) -> Picture {
        let [width, height] = [40, 7];
        let at = |i: u32| if (from..to).contains(&(i % width)) { opacity(i % width) } else { 0.0 };
        let color = (0..width * height).map(|i| [0.0, 0.0, 0.0, at(i)]).collect();
        Picture { width, height, color, depth: vec![1.0; (width * height) as usize] }
    }

    #[test]
    fn outlines_and_holes_are_counted() {
        let truth = bar(10, 30, |_| 1.0);
        let none = Deviation::between(&truth, &truth, 100.0).unwrap();
        assert_eq!((none.psnr, none.over.len(), none.under, none.holes), (None, 0, 0, [0, 0]));
        let picture =
            bar(8, 29, |x| [1.0, 0.8, 0.4][usize::from(x == 20) + 2 * usize::from(x == 21)]);
        let deviation = Deviation::between(&picture, &truth, 100.0).unwrap();
        assert_eq!((deviation.over.len(), deviation.under, deviation.covered), (14, 14, 140));
        assert_eq!((deviation.over[0], deviation.over[13]), (1.0, 2.0));
        assert_eq!(deviation.holes, [14, 7]);
        // At the outline, two columns and one column of error 1; 0.04 and 0.36 elsewhere.
        assert!(
            (deviation.shares[0] - 3.0 / 3.4).abs() < 1e-6 && deviation.shares[1] == 0.0,
            "{:?}",
            deviation.shares
        );
    }

    #[test]
    fn sources_name_their_axis() {
        assert_eq!(Source::parse("a/b.ply").unwrap().up, DVec3::Y);
        let source = Source::parse("c:b.ply:+Z").unwrap();
        assert_eq!((source.path, source.up), ("c:b.ply".into(), DVec3::Z));
    }
}
