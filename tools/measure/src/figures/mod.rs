//! `splatkit-measure figures`: measures what the documentation says about quality.

mod bleeding;
mod changes;
mod dense;
mod detail;
mod files;
mod gaussians;
mod marschner_lobb;
mod popping;
mod ripple;
mod surfaces;

use crate::report::{Block, Report, Table};
use clap::Args;
use splatkit::{
    Error,
    formats::Kind,
    gpu::{AdapterChoice, Gpu, PreparedScene, Renderer},
    math::Camera,
    picture::Picture,
    scene::{Scene, Settings},
    session::Data,
};
use splatkit_tools::{failure::Failure, load::LoadFlags, output, parse, progress::Progress};
use std::path::{Path, PathBuf};

#[derive(Args, Debug)]
pub struct Figures {
    /// Compare these volumes too, drawn in sheets, with dense integration; by default only
    /// generated ones.
    #[arg(value_name = "VOLUME")]
    files: Vec<PathBuf>,
    /// Measure these meshes only, drawn as surfels and traced as triangles. Add the axis that is up
    /// if it is not +Y.
    #[arg(
        long,
        value_name = "MESH[:AXIS]",
        num_args = 1..,
        value_parser = surfaces::Source::parse,
        conflicts_with_all = ["files", "only"]
    )]
    surfaces: Vec<surfaces::Source>,
    /// Write the pictures of surfaces or Gaussians to this folder.
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    /// Replace existing pictures.
    #[arg(long, requires = "pictures")]
    overwrite: bool,
    /// Measure cuts of these hierarchies, meshes and point clouds only, from near and far. Add the
    /// axis that is up if it is not +Y.
    #[arg(
        long,
        value_name = "FILE[:AXIS]",
        num_args = 1..,
        value_parser = surfaces::Source::parse,
        conflicts_with_all = ["files", "only"]
    )]
    detail: Vec<surfaces::Source>,
    /// Measure trained Gaussians only: a made scene, and those of these files. With --pictures,
    /// write the pictures of a view of 120°.
    #[arg(
        long,
        value_name = "FILE",
        num_args = 0..,
        conflicts_with_all = ["files", "only", "surfaces", "detail"]
    )]
    gaussians: Option<Vec<PathBuf>>,
    /// Measure these parts only.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "PART,…")]
    only: Vec<Part>,
    /// Set the size of the pictures that are integrated densely.
    #[arg(long, value_name = "WxH", value_parser = parse::size, default_value = "96x72")]
    size: [u32; 2],
    /// Replace the marked block of this file by the tables. If not all are measured, replace only
    /// those of the same titles.
    #[arg(long, value_name = "FILE.md")]
    write: Option<PathBuf>,
    /// Print the tables as JSON.
    #[arg(long)]
    json: bool,
    /// Choose the adapter, as for render.
    #[arg(long, value_name = "N|NAME|software", help_heading = "Engine")]
    gpu: Option<String>,
    #[command(flatten)]
    load: LoadFlags,
}

/// The parts of the figures.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum Part {
    /// How even the sum of a kernel's copies is.
    Ripple,
    /// The error of the field that the engine draws.
    MarschnerLobb,
    /// The light that shows through an opaque slab.
    Bleeding,
    /// How much a picture jumps while the camera turns.
    Popping,
    /// Sheets against dense integration.
    Dense,
    /// How long a change of one of ten items takes.
    Changes,
}

/// The engine, which draws one scene after another.
struct Stage {
    gpu: Gpu,
    renderer: Renderer,
}

impl Stage {
    fn prepare(&self, scene: &Scene) -> splatkit::Result<PreparedScene> {
        self.renderer.prepare(scene)
    }

    fn draw(
        &mut self,
        scene: &mut PreparedScene,
        camera: &Camera,
        settings: &Settings,
    ) -> splatkit::Result<Picture> {
        Ok(self.renderer.render(scene, camera, settings)?.0)
    }
}

impl Figures {
    pub fn run(self, progress: &Progress) -> Result<(), Failure> {
        let block = self.write.as_deref().map(|path| Block::open(path, "figures")).transpose()?;
        self.check_inputs()?;
        if self.pictures.is_some() && self.surfaces.is_empty() && self.gaussians.is_none() {
            return Err(Failure::Usage("--pictures is for --surfaces and --gaussians".into()));
        }
        let pictures = match &self.pictures {
            Some(folder) => surfaces::pictures(&self.surfaces, folder, self.overwrite)?,
            None => Vec::new(),
        };
        let choice = self
            .gpu
            .as_deref()
            .map_or(AdapterChoice::Automatic, |text| text.parse().unwrap_or_default());
        let gpu = Gpu::headless(&choice)?;
        let mut stage = Stage { gpu: gpu.clone(), renderer: Renderer::new(&gpu) };
        let mut report = Report { adapter: gpu.info.name.clone(), tables: Vec::new() };
        self.measure(&mut stage, &pictures, &mut report, progress)?;
        progress.clear();
        let text = report.markdown();
        // Printed first: if the file cannot be written after all, nothing has to be measured again.
        if self.json {
            output::line(report.json())?;
        } else {
            output::line(text.trim_end())?;
        }
        let is_all = self.only.is_empty() && self.are_generated();
        let page = |old: &str| if is_all { text } else { report.among(old) };
        block.map_or(Ok(()), |block| block.replace(page))
    }

    /// Adds the tables of what is measured to a report. `pictures` are the paths of those of
    /// surfaces.
    fn measure(
        &self,
        stage: &mut Stage,
        pictures: &[[PathBuf; 2]],
        report: &mut Report,
        progress: &Progress,
    ) -> Result<(), Failure> {
        if self.measures(Part::Ripple) {
            report.tables.push(ripple::table()?);
        }
        if self.measures(Part::MarschnerLobb) {
            report.tables.push(marschner_lobb::table(stage, progress)?);
        }
        if self.measures(Part::Bleeding) {
            report.tables.push(bleeding::table(stage, progress)?);
        }
        if self.measures(Part::Popping) {
            report.tables.push(popping::table(stage, progress)?);
        }
        if self.measures(Part::Dense) {
            report.tables.push(self.dense(stage, progress)?);
        }
        // Times are of a machine, and stand in no page.
        if self.only.contains(&Part::Changes) {
            report.tables.push(changes::table(&stage.gpu, progress)?);
        }
        if !self.surfaces.is_empty() {
            let open = |path: &Path| self.load.open(path);
            report.tables.extend(surfaces::tables(
                stage,
                &self.surfaces,
                open,
                pictures,
                progress,
            )?);
        }
        if !self.detail.is_empty() {
            let open = |path: &Path| self.load.open(path);
            report.tables.extend(detail::tables(stage, &self.detail, open, progress)?);
        }
        if let Some(files) = &self.gaussians {
            let mut cases = vec![gaussians::Case::made()];
            for file in files {
                cases.push(self.case_of_gaussians(file)?);
            }
            let folder = self.pictures.as_deref();
            report.tables.extend(gaussians::tables(stage, &cases, folder, progress)?);
        }
        Ok(())
    }

    fn measures(&self, part: Part) -> bool {
        self.are_generated() && (self.only.is_empty() || self.only.contains(&part))
    }

    /// Returns whether the parts with generated data are measured.
    fn are_generated(&self) -> bool {
        self.surfaces.is_empty() && self.detail.is_empty() && self.gaussians.is_none()
    }

    fn case_of_gaussians(&self, file: &Path) -> Result<gaussians::Case, Failure> {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match self.load.open(file)? {
            Data::Gaussians(set) => Ok(gaussians::Case { name, set }),
            _ => Err(Error::input(file, "file", gaussians::OTHER).into()),
        }
    }

    /// Refuses files that cannot be measured, before any file is.
    fn check_inputs(&self) -> Result<(), Failure> {
        if !self.files.is_empty() && !self.measures(Part::Dense) {
            return Err(Failure::Usage(
                "volumes are for the part dense, which --only leaves out".into(),
            ));
        }
        let check = |path: &Path, kinds: &[Kind], message: &str| match kinds
            .contains(&self.load.kind(path)?)
        {
            true => Ok(()),
            false => Err(Failure::from(Error::input(path, "file", message))),
        };
        self.files.iter().try_for_each(|file| check(file, &[Kind::Volume], dense::OTHER))?;
        self.surfaces
            .iter()
            .try_for_each(|source| check(&source.path, &[Kind::Mesh], surfaces::OTHER))?;
        let kinds = [Kind::Mesh, Kind::Hierarchy];
        self.detail.iter().try_for_each(|source| check(&source.path, &kinds, detail::OTHER))
    }

    fn dense(&self, stage: &mut Stage, progress: &Progress) -> Result<Table, Failure> {
        let mut cases = dense::generated()?;
        for file in &self.files {
            progress.stage(format!("Reading {}", file.display()));
            match self.load.open(file)? {
                Data::Volume(volume) => {
                    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                    cases.push(dense::Case::automatic(name, volume));
                }
                _ => return Err(Error::input(file, "file", dense::OTHER).into()),
            }
        }
        dense::table(stage, &cases, self.size, progress)
    }
}
