//! Trained Gaussians and splats, written as Gaussians or as a hierarchy of Gaussians.

use super::{
    Converted, Expected, Target, Watch, Work, milliseconds,
    splats::{Frame, Gathered, in_file},
    wrong,
};
use crate::{
    Error, Result,
    about::Orientation,
    edit,
    formats::{self, Kind},
    gaussians::{Gaussians, harmonics},
    hierarchy::{self, BuildOptions, Hierarchy, file::WriteOptions},
    session::Data,
};
use std::{path::Path, slice};
use web_time::Instant;

/// Number of Gaussians that a trial builds.
const SAMPLE: usize = 1 << 17;

/// The Gaussians of all inputs.
struct AllGaussians {
    set: Gaussians,
    /// The points of the inputs.
    points: u64,
    read_ms: f64,
}

impl Target {
    /// Writes Gaussians.
    fn write(self, set: Gaussians, path: &Path, spz_version: u32) -> Result<()> {
        match self {
            #[cfg(feature = "ply")]
            Self::Ply => formats::ply::write_gaussians(&set, path),
            #[cfg(feature = "ply")]
            Self::CompressedPly => formats::ply::write_compressed_gaussians(&set, path),
            #[cfg(feature = "gltf")]
            Self::Glb => formats::gltf::write_gaussians(&set, path),
            Self::Splat => formats::splat::write(&set, path),
            Self::Spz if spz_version == 3 => formats::spz::write(&set, path),
            #[cfg(feature = "files")]
            Self::Spz if spz_version == 4 => formats::spz::write_streams(&set, path),
            Self::Spz => Err(wrong(format!("this build writes no version {spz_version} of SPZ"))),
            #[cfg(feature = "sog")]
            Self::Sog => formats::sog::write(&set, path),
            #[cfg(feature = "sog")]
            Self::StreamedSog => formats::sog::write_streamed(&edit::levels(set)?, path),
            _ => Err(wrong(format!("{}: this build writes no such file", path.display()))),
        }
    }

    /// Returns the most bytes of a file of Gaussians with colours of a degree.
    fn bytes(self, count: usize, degree: u32) -> u64 {
        /// Most bytes of a `meta.json` and of tables in planes.
        const SOG: u64 = 1 << 15;
        let more = 3 * (harmonics::terms(degree) as u64 - 1);
        let of_one = match self {
            Self::CompressedPly => 17 + more,
            Self::Splat => 32,
            Self::Spz => 20 + more,
            Self::Sog => 20 + more,
            // All levels together have a third more Gaussians than the finest.
            Self::StreamedSog => 27 + more * 4 / 3,
            Self::Glb => 4 * (18 + more),
            Self::Ply | Self::Hierarchy | Self::Points | Self::Nrrd | Self::Bricks => {
                4 * (17 + more)
            }
        };
        let whole = match self {
            Self::Sog => SOG,
            Self::StreamedSog => SOG * (4 + count as u64 / SOG),
            _ => 0,
        };
        whole + count as u64 * of_one
    }
}

impl<W: Watch> Work<'_, W> {
    /// Writes the Gaussians of all inputs.
    pub fn gaussians(&self, target: Target) -> Result<Converted, W::Error> {
        let AllGaussians { set, points, read_ms } = self.gaussians_for(target)?;
        self.watch.stage(&format!("Writing {}", self.output.display()));
        let start = Instant::now();
        let version = self.conversion.spz_version;
        let (splats, degree) = (set.len(), set.degree);
        target.write(set, self.output, version).map_err(|error| self.at_fault(error))?;
        Ok(Converted::Gaussians { points, splats, degree, read_ms, write_ms: milliseconds(start) })
    }

    /// Finds the size of a file of Gaussians.
    pub fn expect_gaussians(&self, target: Target) -> Result<Expected, W::Error> {
        let AllGaussians { set, points, read_ms } = self.gaussians_for(target)?;
        let bytes = target.bytes(set.len(), set.degree);
        Ok(Expected::Gaussians { points, splats: set.len(), bytes, is_most: true, read_ms })
    }

    /// Reads the Gaussians of all inputs for a file of Gaussians.
    fn gaussians_for(&self, target: Target) -> Result<AllGaussians, W::Error> {
        let is_trained = self.are_gaussians()?;
        let mut all = if is_trained { self.gather_gaussians()? } else { self.splats_for()? };
        if is_trained && target != Target::Glb {
            // Viewers expect the frame of trainers in these files.
            all.set.stand(Orientation::Y_DOWN);
        }
        Ok(all)
    }

    /// Returns the splats of all inputs as Gaussians; trained ones among them stay.
    fn splats_for(&self) -> Result<AllGaussians, W::Error> {
        // Points of several files are edited together.
        let edited = self.edited_points()?;
        let Some(Gathered { set, points, frame, read_ms, .. }) = edited else {
            return self.gather_gaussians();
        };
        let mut set = Gaussians::from_splats(&set).map_err(|error| self.at_fault(error))?;
        set.about.orientation = frame.orientation;
        Ok(AllGaussians { set, points, read_ms })
    }

    /// Returns whether all inputs hold trained Gaussians, also in hierarchies.
    pub fn are_gaussians(&self) -> Result<bool, W::Error> {
        let reading = self.conversion.reading(crate::memory::most());
        for path in self.files {
            let is_one = match reading.kind(path)? {
                Kind::Gaussians => true,
                Kind::Hierarchy => {
                    Hierarchy::open(path, reading.limits())?.header().degree.is_some()
                }
                _ => false,
            };
            if !is_one {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Builds a hierarchy of the Gaussians of all inputs.
    pub fn gaussian_hierarchy(&self) -> Result<Converted, W::Error> {
        let AllGaussians { set, points, read_ms } = self.gather_gaussians()?;
        let start = Instant::now();
        let (splats, degree) = (set.len(), set.degree);
        let watch =
            |done: u64, _: u64| self.watch.progress("Building the hierarchy", done, splats as u64);
        watch(0, 0);
        let (build, write) = self.tree_options(&set, points);
        let built = hierarchy::build_gaussians(&set, self.output, &build, &write, Some(&watch));
        built.map_err(|error| self.at_fault(error))?;
        Ok(Converted::Gaussians { points, splats, degree, read_ms, write_ms: milliseconds(start) })
    }

    /// Extrapolates the size of a hierarchy of Gaussians from a part of them.
    pub fn expect_gaussian_hierarchy(&self) -> Result<Expected, W::Error> {
        let AllGaussians { set, points, read_ms } = self.gather_gaussians()?;
        let (build, write) = self.tree_options(&set, points);
        let part = set.part(0..set.len().min(SAMPLE));
        let tree = hierarchy::Tree::of_gaussians(&part, &build, None);
        let tree = tree.map_err(|error| self.at_fault(error))?;
        let share = set.len() as f64 / part.len() as f64;
        let bytes = (hierarchy::file::to_bytes(&tree, &write)?.len() as f64 * share) as u64;
        Ok(Expected::Gaussians { points, splats: set.len(), bytes, is_most: false, read_ms })
    }

    fn tree_options(&self, set: &Gaussians, points: u64) -> (BuildOptions, WriteOptions) {
        let frame = Frame {
            orientation: set.about.orientation,
            is_guessed: false,
            unit: set.about.length.clone(),
        };
        (
            self.conversion.build_options(false, points),
            self.conversion.write_options(self.files, &frame),
        )
    }

    /// Reads all inputs as Gaussians, with colours of the degree that is kept.
    fn gather_gaussians(&self) -> Result<AllGaussians, W::Error> {
        let mut gathered: Option<AllGaussians> = None;
        // Trained scenes are edited together, and others before they become Gaussians.
        let together = self.are_gaussians()?;
        for path in self.files {
            let one = self.gaussians_of(path, together)?;
            match &mut gathered {
                None => gathered = Some(one),
                Some(all) => {
                    all.set.join(one.set).map_err(|error| in_file(path, error))?;
                    all.points += one.points;
                    all.read_ms += one.read_ms;
                }
            }
        }
        let mut all = gathered.ok_or_else(|| wrong("there is nothing to convert"))?;
        if together {
            self.edit_gaussians(&mut all.set, &self.files[0])?;
        }
        if let Some(degree) = self.conversion.degree {
            all.set.set_degree(degree.min(all.set.degree));
        }
        Ok(all)
    }

    fn edit_gaussians(&self, set: &mut Gaussians, path: &Path) -> Result<(), W::Error> {
        let stand = Frame { orientation: set.about.orientation, ..Frame::default() };
        self.edit(set, path, stand.up(self.conversion.up))
    }

    /// Returns the Gaussians of an input, or its splats as Gaussians, with the edits. `together`:
    /// trained ones are edited later, with those of other inputs.
    fn gaussians_of(&self, path: &Path, together: bool) -> Result<AllGaussians, W::Error> {
        let start = Instant::now();
        let reading = self.conversion.reading(crate::memory::most());
        let kind = reading.kind(path)?;
        let trained = match kind {
            Kind::Gaussians => Some(self.trained(path)?),
            Kind::Hierarchy => Hierarchy::open(path, reading.limits())?.gaussians()?,
            _ => None,
        };
        let Some(mut set) = trained else {
            let Gathered { set, points, frame, .. } = self.splats_of(path, 0)?;
            let mut set = Gaussians::from_splats(&set).map_err(|error| in_file(path, error))?;
            set.about.orientation = frame.orientation;
            return Ok(AllGaussians { set, points, read_ms: milliseconds(start) });
        };
        if kind == Kind::Hierarchy {
            self.watch.has_read(slice::from_ref(&path.to_owned()))?;
        }
        let scale = self.conversion.radius_scale;
        set.scales.iter_mut().for_each(|radii| *radii *= scale);
        if !together {
            self.edit_gaussians(&mut set, path)?;
        }
        let points = set.len() as u64;
        Ok(AllGaussians { set, points, read_ms: milliseconds(start) })
    }

    /// Reads a file of trained Gaussians.
    fn trained(&self, path: &Path) -> Result<Gaussians, W::Error> {
        self.watch.stage(&format!("Reading {}", path.display()));
        self.watch.has_colored(false, false)?;
        let most = self.conversion.memory.or_else(crate::memory::most);
        let Data::Gaussians(mut set) = self.data(path, most)? else {
            return Err(Error::input(path, "file", "holds no Gaussians").into());
        };
        // Files of trainers do not say what is up: it is −y.
        set.about.orientation = set.about.orientation.or(Some(Orientation::Y_DOWN));
        Ok(set)
    }
}
