//! The classic table of splatting on a GPU (2005, image-aligned sheet buffers; the last row in
//! axis-aligned sheets). Its volumes are read if the user has them. Generated volumes of the same
//! size replace missing ones, shown so that about as many splats count.

use super::{
    Effort,
    case::{self, Case, Plan, Seed},
};
use glam::{DMat3, DVec3};
use splatkit::session::Subject;
use splatkit::{
    Error, Result,
    formats::{self, Kind},
    input::Limits,
    math::Kernel,
    scene::{Mode, Settings},
    volume::{
        Arrangement, Lattice, Samples, Shade, TransferFunction, Volume, body_centred,
        phantoms::Phantom,
    },
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

const SIZE: u32 = 512;

/// How the table shows a volume.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Style {
    /// Opaque from a value on.
    Surface,
    /// Translucent from a value on.
    Semi,
}
use Style::{Semi, Surface};

/// A row of the table.
#[derive(Debug, Clone, Copy)]
struct Row {
    name: &'static str,
    /// The first part of its file's name.
    file: &'static str,
    dims: [usize; 3],
    /// Whether its lattice is body-centred cubic.
    centred: bool,
    style: Style,
    seed: Seed,
    /// The phantom that replaces it, and half the width of the cube that is sampled: a wider cube
    /// leaves more air around the phantom.
    phantom: Phantom,
    reach: f64,
}

const fn row(
    name: &'static str,
    file: &'static str,
    dims: [usize; 3],
    style: Style,
    splats: u64,
    fps: f64,
) -> Row {
    let seed = Seed { splats, fps };
    Row { name, file, dims, centred: false, style, seed, phantom: Phantom::Specimen, reach: 1.0 }
}

impl Row {
    const fn by(self, phantom: Phantom, reach: f64) -> Self {
        Self { phantom, reach, ..self }
    }

    const fn centred(self) -> Self {
        Self { centred: true, ..self }
    }
}

/// The row that was drawn in axis-aligned sheets.
const AXIS_ALIGNED: &str = "UNC head, axis-aligned sheets";

const ROWS: [Row; 16] = [
    row("Vortex", "vortex", [128; 3], Semi, 479_000, 5.2).by(Phantom::MarschnerLobb, 1.0),
    row("Jet", "jet", [256; 3], Semi, 648_000, 4.0).by(Phantom::MarschnerLobb, 1.0),
    row("Turbulent", "turbulent", [104, 129, 129], Semi, 95_000, 6.1),
    row("Foot, isosurface", "foot", [128; 3], Surface, 191_000, 7.2).by(Phantom::Head, 1.2),
    row("Foot, semi", "foot", [128; 3], Semi, 184_000, 6.4).by(Phantom::Head, 1.2),
    row("Foot, semi 2", "foot", [128; 3], Semi, 181_000, 7.6).by(Phantom::Head, 1.2),
    row("Lobster", "lobster", [320, 320, 34], Surface, 219_000, 10.2).by(Phantom::Specimen, 1.2),
    row("Aneurism", "aneurism", [128; 3], Surface, 17_000, 9.1).by(Phantom::Specimen, 1.2),
    row("Bonsai", "bonsai", [256; 3], Surface, 1_300_000, 4.9),
    row("Bonsai, BCC", "bonsai", [181, 181, 362], Surface, 955_000, 2.5).centred(),
    row("CT head, semi", "head", [128; 3], Semi, 526_000, 4.9).by(Phantom::Head, 0.85),
    row("CT head, semi, BCC", "head", [91, 91, 182], Semi, 379_000, 3.1)
        .by(Phantom::Head, 0.85)
        .centred(),
    row("Engine, semi", "engine", [256, 256, 128], Semi, 1_200_000, 2.1),
    row("Engine, isosurface", "engine", [256, 256, 128], Surface, 1_300_000, 5.1),
    row("Engine, BCC", "engine", [181, 181, 182], Surface, 963_000, 5.3).centred(),
    row(AXIS_ALIGNED, "unc-head", [208, 256, 225], Semi, 2_955_242, 2.86).by(Phantom::Head, 0.85),
];

/// Returns the cases of all rows. Files are searched for in `data`.
pub fn plans(effort: Effort, data: Option<&Path>) -> Result<Vec<Plan>> {
    let files = data.map(volumes).transpose()?.unwrap_or_default();
    let plan = |row: Row| {
        let file = files.iter().find(|file| stem(file) == row.file).cloned();
        Plan::new(row.name, move || row.case(effort, file.as_deref()))
    };
    Ok(ROWS.into_iter().map(plan).collect())
}

/// Returns the files of a folder that are recognised as volumes, sorted by name.
fn volumes(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |e| Error::file(folder, "read", e);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_file()
            && matches!(
                Kind::of(&path, &Limits::default(), &formats::ReadOptions::default()),
                Ok(Some(Kind::Volume))
            )
        {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Returns a file's name up to its first dot, in lower case.
fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    name.split('.').next().unwrap_or_default().to_owned()
}

impl Row {
    fn case(self, effort: Effort, file: Option<&Path>) -> Result<Case> {
        let wanted = effort.samples(self.seed.splats);
        let (volume, drawn) = match file {
            Some(file) => {
                let volume = formats::load_volume(
                    file,
                    &Limits::default(),
                    &formats::ReadOptions::default(),
                )?;
                let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
                (if self.centred { body_centred(&volume)? } else { volume }, name)
            }
            None => {
                let volume = self.generated(effort)?;
                (volume, format!("generated: {}", name_of(self.phantom)))
            }
        };
        let dims = volume.lattice.dims.map(|n| n.to_string()).join("×");
        let bounds = volume.bounds();
        let mut settings = Settings::new([effort.pixels(SIZE); 2]);
        if self.name == AXIS_ALIGNED {
            settings.mode = Mode::AxisSheets;
        }
        let transfer = self.style.transfer(&volume, wanted);
        let (scene, effective) = case::volume(Arc::new(volume), transfer);
        let subject = Subject::new(bounds, DVec3::Z);
        let mut case = Case::new(format!("{drawn}, {dims}"), scene, subject, settings, effective);
        case.seed = Some(self.seed);
        Ok(case)
    }

    /// Samples the phantom in bytes, as the table's volumes were, on a lattice with equal steps.
    fn generated(self, effort: Effort) -> splatkit::Result<Volume> {
        let dims = self.dims.map(|side| effort.side(side));
        // Body-centred lattices count layers of both kinds along z: two per step.
        let layers = if self.centred { 2.0 } else { 1.0 };
        let cells = DVec3::new(dims[0] as f64, dims[1] as f64, dims[2] as f64 / layers);
        let step = 2.0 * self.reach / cells.max_element();
        let volume = self.phantom.sample_on(Lattice {
            dims,
            origin: -0.5 * step * (cells - 1.0),
            axes: DMat3::from_diagonal(DVec3::splat(step)),
            arrangement: if self.centred {
                Arrangement::BodyCentred
            } else {
                Arrangement::Cartesian
            },
        })?;
        let [low, high] = volume.range;
        let scale = if high > low { 255.0 / (high - low) } else { 0.0 };
        let bytes =
            (0..volume.len()).map(|i| ((volume.value(i) - low) * scale).round() as u8).collect();
        Volume::new(volume.lattice, Samples::U8(bytes))
    }
}

fn name_of(phantom: Phantom) -> &'static str {
    Phantom::NAMES
        .into_iter()
        .find(|name| Phantom::named(name) == Some(phantom))
        .unwrap_or("phantom")
}

impl Style {
    /// Returns a transfer function that shows the values above a threshold. The threshold brings
    /// the number of splats closest to `wanted`.
    fn transfer(self, volume: &Volume, wanted: u64) -> TransferFunction {
        let mut counts = [0u64; 256];
        volume
            .drawn_ranges(&Kernel::default())
            .iter()
            .for_each(|[_, high]| counts[usize::from(*high)] += 1);
        let mut visible = 0;
        // From the largest value down: if the values up to a step are transparent, the samples that
        // reach a higher step are visible.
        let start = (0..255usize).rev().map(|step| {
            visible += counts[step + 1];
            (visible.abs_diff(wanted), step)
        });
        let start = start.min().map_or(0, |(_, step)| step);
        let [low, high] = volume.range;
        let value = |steps: f64| low + (high - low) * steps / 255.0;
        let from = value(start as f64);
        let (end, opacity, samples) = match self {
            Self::Surface => (value(start as f64 + 16.0), 0.95, 1.0),
            Self::Semi => (value(255.0), 0.4, 4.0),
        };
        TransferFunction {
            color: vec![(from, [0.7, 0.3, 0.2]), (value(255.0), [1.0, 0.9, 0.7])],
            opacity: vec![(from, 0.0), (end, opacity)],
            unit: samples * volume.lattice.kernel_spacing(),
            shade: Some(Shade::default()),
            ..TransferFunction::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The replacements are compared with the table's rates, so their numbers of splats must be
    /// close.
    #[test]
    fn generated_volumes_have_about_as_many_splats() {
        let small = |row: &Row| row.dims.iter().product::<usize>() < 4 << 20;
        for row in ROWS.into_iter().filter(small) {
            let case = row.case(Effort::Usual, None).unwrap();
            let ratio = case.effective as f64 / row.seed.splats as f64;
            assert!((0.9..1.1).contains(&ratio), "{}: {ratio}", row.name);
        }
    }

    #[test]
    fn files_are_known_by_their_first_name() {
        assert_eq!(
            (stem(Path::new("a/Bonsai.vti")), stem(Path::new("head.raw.gz"))),
            ("bonsai".into(), "head".into())
        );
    }
}
