//! `splatkit demo`: pictures without a download. The inputs are made, written, and read again like
//! any other file.

use crate::{
    camera::CameraFlags, engine::EngineFlags, failure::Failure, given::Given, job::Job, output,
    progress::Progress, render::Drawer, scene::SceneFlags, timing::milliseconds,
};
use clap::{Args, Parser};
use splatkit::{
    Error, disk, formats, gaussians,
    hierarchy::{BuildOptions, build_file, file::WriteOptions},
    picture::{Encoding, PictureFormat},
    session::Samples,
    surface::{Mesh, SurfelOptions},
    volume::phantoms::Phantom,
};
use std::{ffi::OsString, path::PathBuf, time::Instant};

#[derive(Args, Debug)]
pub struct Demo {
    /// The folder for inputs and pictures; it is created if it does not exist.
    #[arg(default_value = "out")]
    folder: PathBuf,
    /// Replace existing files.
    #[arg(long)]
    overwrite: bool,
    /// Choose the adapter, as for render.
    #[arg(long, value_name = "N|NAME|software")]
    gpu: Option<String>,
}

const MESH: &str = "knot.ply";
const TREE: &str = "knot.splk";
const VOLUME: &str = "specimen.nrrd";
const TRANSFER: &str = "specimen.json";
const TRAINED: &str = "made.spz";
/// Gaussians of the trained scene.
const GAUSSIANS: usize = 60_000;
/// The knot reaches 3.4 from its centre; the specimen's radius is 0.9.
const KNOT_SCALE: f32 = 0.42;
/// #10141c.
const BACKGROUND: Option<[f32; 3]> = Some([16.0 / 255.0, 20.0 / 255.0, 28.0 / 255.0]);

/// How the specimen's parts are shown: the rind and the flesh faint, the lattice golden, the stone
/// pale.
const SHOWN: &str = r#"{
  "color": [[0.08, 0.55, 0.20, 0.10], [0.24, 0.75, 0.30, 0.16], [0.41, 0.80, 0.36, 0.16],
            [0.62, 0.90, 0.50, 0.18], [0.75, 0.96, 0.72, 0.36], [0.88, 0.80, 0.86, 0.92],
            [1.0, 0.90, 0.95, 1.0]],
  "opacity": [[0.08, 0], [0.15, 0.004], [0.24, 0.010], [0.36, 0.03], [0.45, 0.03], [0.65, 0.35],
              [0.8, 0.6], [1.0, 0.8]],
  "unit": 0.02,
  "shade": {"ambient": 0.3, "diffuse": 0.7, "specular": 0.3, "power": 24}
}
"#;

/// A picture: its name, its inputs, and the further arguments of the command that draws it.
struct Shot {
    name: &'static str,
    inputs: &'static [&'static str],
    arguments: &'static str,
}

const SHOTS: [Shot; 5] = [
    Shot {
        name: "mesh.png",
        inputs: &[MESH],
        arguments: "--size 800x600 --azimuth 0 --elevation 20",
    },
    // Coarse enough to see what a hierarchy is made of.
    Shot {
        name: "hierarchy.png",
        inputs: &[TREE],
        arguments: "--size 800x600 --azimuth 0 --elevation 20 --cut 12",
    },
    Shot {
        name: "volume.png",
        inputs: &[VOLUME],
        arguments: "--size 800x600 --up +Z --azimuth 40 --elevation 30",
    },
    Shot {
        name: "mixed.png",
        inputs: &[MESH, VOLUME],
        arguments: "--size 800x600 --azimuth 0 --elevation 20",
    },
    Shot {
        name: "gaussians.png",
        inputs: &[TRAINED, MESH, VOLUME],
        arguments: "--size 800x600 --azimuth -25 --elevation 14 --zoom 1.5",
    },
];

/// The flags of `render` that decide what a picture shows.
#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    scene: SceneFlags,
    #[command(flatten)]
    camera: CameraFlags,
    #[command(flatten)]
    engine: EngineFlags,
}

impl Demo {
    pub fn run(self, progress: &Progress) -> Result<(), Failure> {
        self.make_inputs(progress)?;
        for (number, shot) in SHOTS.iter().enumerate() {
            self.draw(shot, number == 0, progress)?;
        }
        Ok(())
    }

    fn make_inputs(&self, progress: &Progress) -> Result<(), Failure> {
        std::fs::create_dir_all(&self.folder).map_err(|e| Failure::output(&self.folder, e))?;
        let inputs = [MESH, TREE, VOLUME, TRANSFER, TRAINED];
        for name in inputs.into_iter().chain(SHOTS.iter().map(|shot| shot.name)) {
            output::check(&self.folder.join(name), self.overwrite)?;
        }
        progress.stage("Making a mesh and a volume");
        let mut mesh = Mesh::knot(1200, 72);
        // Scaled so that the knot winds through the specimen.
        mesh.positions.iter_mut().for_each(|p| *p *= KNOT_SCALE);
        let specimen = Phantom::Specimen.sample([128; 3])?;
        formats::ply::write(&mesh, self.folder.join(MESH))?;
        progress.stage("Building a hierarchy");
        let build = BuildOptions {
            closed: mesh.is_solid(),
            source_points: Some(mesh.positions.len() as u64),
            ..BuildOptions::default()
        };
        let orientation = mesh.guess_orientation();
        let write = WriteOptions {
            orientation,
            is_guessed: orientation.is_some(),
            source: MESH.into(),
            ..WriteOptions::default()
        };
        let splats = mesh.surfels(&SurfelOptions::default())?;
        build_file(&splats, self.folder.join(TREE), &build, &write, None)?;
        formats::nrrd::write(&specimen, self.folder.join(VOLUME))?;
        progress.stage("Making a trained scene");
        formats::spz::write(&gaussians::phantom(GAUSSIANS), self.folder.join(TRAINED))?;
        Ok(disk::write(&self.folder.join(TRANSFER), SHOWN.as_bytes())?)
    }

    /// Draws a picture twice, the second time with everything warm.
    fn draw(&self, shot: &Shot, first: bool, progress: &Progress) -> Result<(), Failure> {
        let mut arguments: Vec<OsString> = vec!["render".into()];
        arguments.extend(shot.inputs.iter().map(|name| self.folder.join(name).into()));
        if shot.inputs.contains(&VOLUME) {
            arguments.extend(["--transfer".into(), self.folder.join(TRANSFER).into()]);
        }
        arguments.extend(shot.arguments.split_whitespace().map(OsString::from));
        if let Some(gpu) = &self.gpu {
            arguments.extend(["--gpu".into(), gpu.into()]);
        }
        let flags = Flags::try_parse_from(&arguments).map_err(|e| Failure::Usage(e.to_string()))?;
        let given = Given::default();
        let (mut scene, _) = flags.scene.open(&given)?;
        flags.scene.apply(&mut scene)?;
        flags.camera.apply(&mut scene);
        flags.engine.apply(&mut scene);
        scene.picture.samples = Some(Samples::Factor(1));
        let job = Job::new(scene.clone(), flags.engine.device(&scene), &given, None)?;
        let mut loaded = job.load(progress)?;
        let mut drawer = Drawer::engine(&job, &loaded, progress)?;
        let settings = job.settings(&loaded)?;
        let framing = job.framing()?;
        loaded.find_seen(&framing, &settings)?;
        let camera = framing.camera(&loaded.subject, settings.size)?;
        progress.stage(format!("Drawing {}", shot.name));
        let mut draw = || {
            let start = Instant::now();
            let (picture, stats) = drawer.draw(&loaded, &camera, &settings)?;
            Ok::<_, Error>((milliseconds(start), picture, stats))
        };
        let (first_ms, ..) = draw()?;
        let (later_ms, picture, stats) = draw()?;
        job.require_content(&picture)?;
        let path = self.folder.join(shot.name);
        let mut encoding = Encoding::new(PictureFormat::Png);
        encoding.background = BACKGROUND;
        disk::write(&path, &picture.encode(&encoding)?)?;
        progress.clear();
        if first {
            output::line(format_args!("Drawn on {}", drawer.adapter()))?;
        }
        output::line(format_args!(
            "{}: {} splats, load {:.0} ms, first frame {first_ms:.0} ms, later frames \
             {later_ms:.0} ms",
            path.display(),
            stats.splats,
            loaded.load_ms
        ))?;
        let arguments: Vec<_> =
            arguments.iter().map(|argument| argument.to_string_lossy()).collect();
        output::line(format_args!(
            "  splatkit {} -o {} --background '#10141c'",
            arguments.join(" "),
            shot.name
        ))
    }
}
