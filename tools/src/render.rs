//! `splatkit render`.

mod layers;
mod panels;
mod times;

use crate::{
    camera::CameraFlags,
    describe,
    engine::EngineFlags,
    failure::Failure,
    figure::FigureFlags,
    frames::{Frames, Storing, Writer, numbered},
    given::Given,
    job::{Finish, Job, Loaded},
    motion::{Motion, MotionFlags},
    output,
    overlay::OverlayFlags,
    progress::Progress,
    scene::SceneFlags,
    timing::milliseconds,
};
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use splatkit::{
    Error, FrameStats, Renderer,
    about::direction_name,
    disk,
    input::is_remote,
    math::Camera,
    picture::{Picture, PictureFormat},
    reference,
    scene::{Scene, Settings},
    session::{Background, Description, Layer, Origin, Samples},
};
#[cfg(feature = "window")]
use splatkit::{Stop, math::CameraPath, volume::TransferFunction};
use splatkit_media::{
    figure::Figure,
    video::{Film, Format},
};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// Where the picture goes.
#[derive(Args, Debug, Default)]
struct OutputFlags {
    /// Write the picture to this .png, .jpg, .tiff, .webp or .exr file, or to stdout as PNG if it
    /// is `-`. OpenEXR files hold linear light and the depths. With --turntable, --path or
    /// --times, write an animation to this .gif, .webp or .apng file, or with ffmpeg, if it is
    /// installed, to this .mp4, .webm or .mov file. Or write numbered pictures: out.png becomes
    /// out_0000.png, and {frame} or {frame:04} in the name is replaced by the number [default:
    /// beside the first input: bunny.png for bunny.ply, or bunny_2.png if bunny.png exists]
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true)]
    output: Option<PathBuf>,
    /// Write raw frames to stdout (-o -), for another program: rows from the top, and a byte each
    /// for red, green, blue and opacity.
    #[arg(long, requires = "output")]
    raw: bool,
    /// Set the bits a channel: 8 or 16 for .png and .tiff, 16 or 32 for .exr [default: the first]
    #[arg(long, value_name = "NUMBER")]
    bits: Option<u32>,
    /// Also write the depths to this file: a grey PNG of 16 bits, white for the nearest, black for
    /// nothing.
    #[arg(long, value_name = "FILE.png", conflicts_with_all = ["turntable", "path", "times"])]
    depth: Option<PathBuf>,
    /// Also write these layers into the .exr file, with commas between them: normals, albedo,
    /// identifiers.
    #[arg(
        long,
        value_name = "LAYERS",
        value_delimiter = ',',
        value_parser = layers(),
        conflicts_with_all = ["turntable", "path", "times", "views", "split_channels", "raw"]
    )]
    layers: Vec<Layer>,
    /// Replace existing files.
    #[arg(long)]
    overwrite: bool,
    /// Print statistics to stdout, as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Args, Debug)]
pub struct Render {
    #[command(flatten)]
    output: OutputFlags,
    /// Set the background colour: a name, '#rgb', '#rrggbb', or none for transparent pixels: of
    /// .png, .tiff, .webp, .exr, .gif, .apng, .webm and .mov files.
    /// [default: black]
    #[arg(long, value_name = "COLOR")]
    background: Option<Background>,
    /// Draw this many pixels for each pixel of the picture and average them: 1, 4, 9, 16 or 64.
    /// auto draws as many as fit into 512x512 pixels in all, at most 16 for volumes [default: auto]
    #[arg(long, value_name = "N|auto")]
    samples: Option<Samples>,
    #[command(flatten)]
    scene: SceneFlags,
    #[command(flatten)]
    motion: MotionFlags,
    #[command(flatten)]
    overlay: OverlayFlags,
    #[command(flatten)]
    figure: FigureFlags,
    #[command(flatten)]
    camera: CameraFlags,
    #[command(flatten)]
    engine: EngineFlags,
    /// Draw with the reference on the CPU, which is exact, but slow for all but small scenes.
    #[arg(long, help_heading = "Engine", conflicts_with_all = ["gpu", "budget", "engine"])]
    reference: bool,
}

/// Parses a layer of a picture.
fn layers() -> impl TypedValueParser<Value = Layer> {
    PossibleValuesParser::new(Layer::ALL.map(Layer::name)).map(|name| {
        Layer::ALL.into_iter().find(|layer| layer.name() == name).expect("a name of the list")
    })
}

/// The renderer of the pictures.
pub enum Drawer {
    Engine(Box<Renderer>),
    Reference,
}

impl Drawer {
    /// Opens the device and prepares the scene on it.
    pub fn engine(job: &Job, loaded: &Loaded, progress: &Progress) -> Result<Self, Failure> {
        progress.stage("Opening the device");
        let device = job.open_device(&loaded.scene)?;
        progress.stage("Preparing the scene");
        Ok(Self::Engine(Box::new(Renderer::new(&device, &loaded.scene)?)))
    }

    pub fn adapter(&self) -> &str {
        match self {
            Self::Engine(renderer) => renderer.device().name(),
            Self::Reference => "reference",
        }
    }

    /// Draws another scene, or a part of the loaded one, by itself.
    fn draw_scene(
        &self,
        scene: &Scene,
        camera: &Camera,
        settings: &Settings,
    ) -> splatkit::Result<(Picture, FrameStats)> {
        match self {
            Self::Engine(renderer) => {
                Renderer::new(&renderer.device().clone(), scene)?.render(camera, settings)
            }
            Self::Reference => {
                Ok((reference::render(scene, camera, settings)?, FrameStats::default()))
            }
        }
    }

    /// Sets the transfer function of an item's field.
    #[cfg(feature = "window")]
    fn set_transfer(&mut self, item: usize, transfer: &TransferFunction) -> splatkit::Result<()> {
        match self {
            Self::Engine(renderer) => renderer.set_transfer(item, transfer),
            Self::Reference => Ok(()),
        }
    }

    /// Draws a picture. The statistics of the reference are all 0.
    pub fn draw(
        &mut self,
        loaded: &Loaded,
        camera: &Camera,
        settings: &Settings,
    ) -> splatkit::Result<(Picture, FrameStats)> {
        match self {
            Self::Engine(renderer) => renderer.render(camera, settings),
            Self::Reference => {
                Ok((reference::render(&loaded.scene, camera, settings)?, FrameStats::default()))
            }
        }
    }
}

/// A scene that is ready to be drawn, and how its pictures are finished.
struct Ready<'a> {
    job: &'a Job,
    loaded: &'a Loaded,
    /// The settings of a picture before it is averaged down.
    settings: Settings,
    finish: Finish,
    /// The views of a picture of several.
    figure: Option<Figure>,
}

/// A film or a figure of a scene that a window shows.
#[cfg(feature = "window")]
pub struct Export<'a> {
    pub loaded: &'a Loaded,
    /// The transfer functions that were edited, with the numbers of their items.
    pub transfers: &'a [(usize, TransferFunction)],
    /// The path of the camera and the frames per second of a film; `None` for the picture of
    /// several views that the job describes.
    pub path: Option<(CameraPath, f64)>,
    /// A film, or a picture's name for numbered pictures.
    pub output: &'a Path,
    pub stop: Stop,
}

/// What is drawn, and where it goes.
struct Run<'a> {
    ready: &'a Ready<'a>,
    output: &'a OutputFlags,
    motion: Motion,
    /// The file of the camera's path.
    path: Option<&'a Path>,
    film: Film,
    frames: Frames,
}

/// The last frame, and the median time of all.
struct Drawn {
    stats: FrameStats,
    camera: Camera,
    frame_ms: f64,
    /// The texts over the last frame.
    overlay: serde_json::Value,
}

impl Render {
    pub fn run(self, given: &Given, progress: &Progress) -> Result<(), Failure> {
        let job = self.job(given)?;
        let written: Vec<&Path> = [&self.output.output, &self.output.depth]
            .into_iter()
            .filter_map(Option::as_deref)
            .collect();
        self.draw(&job, progress).map_err(|failure| job.blamed(failure, &written))
    }

    /// Returns what the flags and a scene file among the inputs say.
    pub fn job(&self, given: &Given) -> Result<Job, Failure> {
        let (mut scene, stated) = self.scene.open(given)?;
        self.apply(&mut scene)?;
        let device = self.engine.device(&scene);
        Job::new(scene, device, given, stated)
    }

    /// Changes a scene by the flags that are given.
    fn apply(&self, scene: &mut Description) -> Result<(), Failure> {
        self.scene.apply(scene)?;
        self.camera.apply(scene);
        self.engine.apply(scene);
        self.overlay.apply(scene);
        self.figure.apply(scene, self.engine.has_size());
        if self.motion.times().is_some() || self.figure.splits_channels() {
            // They are for the times or the channels, not for views.
            (scene.picture.columns, scene.picture.panel_labels) = (None, None);
        }
        scene.picture.background = self.background.or(scene.picture.background);
        scene.picture.samples = self.samples.or(scene.picture.samples);
        Ok(())
    }

    /// Returns the file that the flags name for the result.
    pub fn output(&self) -> Option<&Path> {
        self.output.output.as_deref()
    }

    /// Whether existing files are replaced.
    pub fn overwrites(&self) -> bool {
        self.output.overwrite
    }

    /// Whether the result is printed as JSON.
    pub fn prints_json(&self) -> bool {
        self.output.json
    }

    /// Returns the inputs that the command line names.
    #[cfg(feature = "serve")]
    pub fn inputs(&self) -> &[PathBuf] {
        &self.scene.inputs
    }

    /// Returns the scene file among the inputs.
    #[cfg(feature = "window")]
    pub fn scene_file(&self) -> Option<&Path> {
        self.scene
            .inputs
            .iter()
            .map(PathBuf::as_path)
            .find(|path| crate::scene_file::is_scene(path))
    }

    /// Whether scene files may name files outside their folders, and addresses.
    #[cfg(feature = "window")]
    pub fn trusts_scenes(&self) -> bool {
        self.scene.trust_scene
    }

    fn draw(&self, job: &Job, progress: &Progress) -> Result<(), Failure> {
        let begun = Instant::now();
        if let Some(times) = self.motion.times() {
            return self.draw_times(times, job, (begun, progress));
        }
        if self.figure.splits_channels() {
            return self.draw_channels(job, (begun, progress));
        }
        let inputs = job.inputs();
        let output = self.output.output.clone();
        let is_moving = self.motion.is_moving();
        let output = output.unwrap_or_else(|| self.output.beside(&inputs[0], is_moving));
        let motion = self.motion.open(&job.scene.reading.limits())?;
        let film = Film {
            size: job.size(),
            frames: motion.frames(),
            rate: self.motion.rate(),
            background: job.scene.picture.background(),
        };
        if is_moving {
            require_one_view(job)?;
        }
        let frames = self.output.frames(&output, &motion, &film, (&inputs, progress))?;
        if let Some(warning) = self.motion.idle(frames.is_played()) {
            progress.warn(warning);
        }
        let mut loaded = job.load(progress)?;
        let (settings, finish) = self.prepare(job, &mut loaded, (&frames, &motion), progress)?;
        let figure = job.figure(&loaded.subject, &finish)?;
        let ready = Ready { job, loaded: &loaded, settings, finish, figure };
        let start = Instant::now();
        let mut drawer = match self.reference {
            true => Drawer::Reference,
            false => Drawer::engine(job, ready.loaded, progress)?,
        };
        let upload_ms = milliseconds(start);
        let path = self.motion.file();
        let run = Run { ready: &ready, output: &self.output, motion, path, film, frames };
        let drawn = run.draw_frames(&mut drawer, progress)?;
        self.tell(&run, &drawn, (&drawer, upload_ms), (&output, begun, progress))
    }

    /// Tells what was drawn and written.
    fn tell(
        &self,
        run: &Run<'_>,
        drawn: &Drawn,
        (drawer, upload_ms): (&Drawer, f64),
        (output, begun, progress): (&Path, Instant, &Progress),
    ) -> Result<(), Failure> {
        progress.clear();
        let stats = &drawn.stats;
        tracing::info!(
            splats = stats.splats,
            hidden = stats.hidden,
            entries = stats.entries,
            passes = stats.passes,
            gathered = stats.gathered,
            "drawn"
        );
        if self.output.json {
            let mut facts = run.facts(drawn)?;
            facts["output"] = output.to_string_lossy().into();
            facts["adapter"] = drawer.adapter().into();
            facts["upload_ms"] = upload_ms.into();
            output::json(&facts)?;
        }
        run.report(begun, progress);
        Ok(())
    }

    /// Finds what the camera of a loaded scene needs. Returns the settings and how pictures are
    /// finished.
    fn prepare(
        &self,
        job: &Job,
        loaded: &mut Loaded,
        (frames, motion): (&Frames, &Motion),
        progress: &Progress,
    ) -> Result<(Settings, Finish), Failure> {
        loaded.files.extend(self.motion.file().map(Path::to_owned));
        let mut files = frames.files().into_iter().chain(self.output.depth.as_deref());
        files.try_for_each(|file| output::check_unneeded(file, &loaded.files))?;
        let settings = job.settings(loaded)?;
        if let Some(warning) = job.idle(&loaded.scene) {
            progress.warn(warning);
        }
        if motion.is_fitted() {
            progress.stage("Framing the scene");
            let framing = job.framing()?;
            loaded.find_seen(&framing, &settings)?;
            let (orientation, origin) = framing.orientation(&loaded.subject);
            if origin == Origin::Guess {
                progress.note(format_args!(
                    "up: {}, front: {}, guessed from the shape; --up sets another up, and the \
                     front that is usual for it",
                    direction_name(orientation.up),
                    direction_name(orientation.front)
                ));
            }
        }
        let finish = job.finish(loaded)?;
        Ok((settings, finish))
    }
}

/// Draws and writes a film or a figure of a scene that is loaded already. Existing files are
/// replaced.
#[cfg(feature = "window")]
pub fn export(job: &Job, export: Export<'_>, progress: &Progress) -> Result<(), Failure> {
    let Export { loaded, transfers, path, output, stop } = export;
    let begun = Instant::now();
    let flags = OutputFlags { overwrite: true, ..OutputFlags::default() };
    let rate = path.as_ref().map_or(crate::motion::RATE, |(_, rate)| *rate);
    let motion =
        path.map_or(Ok(Motion::Still), |(path, rate)| Motion::along(path, rate, output))?;
    let background = job.scene.picture.background();
    let film = Film { size: job.size(), frames: motion.frames(), rate, background };
    let frames = flags.frames(output, &motion, &film, (&job.inputs(), progress))?;
    let files = frames.files();
    files.into_iter().try_for_each(|file| output::check_unneeded(file, &loaded.files))?;
    let mut settings = job.settings(loaded)?;
    settings.controls.stop = stop;
    let finish = match transfers {
        [] => job.finish(loaded)?,
        edited => job.finish_with(loaded, edited)?,
    };
    let mut subject = loaded.subject.clone();
    if motion.is_fitted() {
        // The clips may be others than those that the scene was loaded with.
        subject.seen = loaded.scene.seen(&settings.clips)?;
    }
    let figure = job.figure(&subject, &finish)?;
    let ready = Ready { job, loaded, settings, finish, figure };
    let mut drawer = Drawer::engine(job, loaded, progress)?;
    for (item, transfer) in transfers {
        drawer.set_transfer(*item, transfer)?;
    }
    let run = Run { ready: &ready, output: &flags, motion, path: None, film, frames };
    run.draw_frames(&mut drawer, progress)?;
    run.report(begun, progress);
    Ok(())
}

impl Run<'_> {
    /// Returns what `--json` prints about the frames.
    fn facts(&self, drawn: &Drawn) -> Result<serde_json::Value, Failure> {
        let Run { ready: Ready { job, loaded, settings, figure, .. }, film, frames, .. } = self;
        let Drawn { stats, camera, frame_ms, overlay } = drawn;
        let (orientation, origin) = job.framing()?.orientation(&loaded.subject);
        let panels = figure.as_ref().map(|figure| figure.to_json(crate::camera::to_json));
        Ok(serde_json::json!({
            "width": film.size[0],
            "height": film.size[1],
            "frames": film.frames,
            "fps": frames.is_film().then_some(film.rate),
            "splats": stats.splats,
            "hidden": stats.hidden,
            "bricks": describe::bricks(stats),
            "entries": stats.entries,
            "gathered": stats.gathered,
            "passes": stats.passes,
            "gpu_bytes": stats.gpu_bytes,
            "frame_ms": frame_ms,
            "load_ms": loaded.load_ms,
            "camera": crate::camera::to_json(camera),
            "panels": panels,
            "overlay": overlay,
            "up": direction_name(orientation.up),
            "up_from": origin.name(),
            "settings": describe::settings(&loaded.scene, settings),
        }))
    }

    /// Prints what was written: path, size and time.
    fn report(&self, begun: Instant, progress: &Progress) {
        let files = self.frames.files();
        let [Some(first), Some(last)] = [files.first(), files.last()] else { return };
        let [width, height] = self.film.size;
        let seconds = begun.elapsed().as_secs_f64();
        let bytes = files.iter().filter_map(|file| file.metadata().ok()).map(|file| file.len());
        let size = format!("{width} × {height} pixels, {}", size_of_file(bytes.sum()));
        let (first, last) = (first.display(), last.display());
        let count = self.film.frames;
        if self.frames.is_film() {
            progress.note(format_args!("{first}: {count} frames of {size}, {seconds:.1} s"));
        } else if count == 1 {
            progress.note(format_args!("{first}: {size}, {seconds:.1} s"));
        } else {
            progress.note(format_args!(
                "{first} to {last}: {count} frames of {size} in all, {seconds:.1} s"
            ));
        }
    }

    /// Draws and writes the frames, or the picture of several views.
    fn draw_frames(&self, drawer: &mut Drawer, progress: &Progress) -> Result<Drawn, Failure> {
        let Run {
            ready: Ready { job, loaded, settings, finish, .. }, motion, film, frames, ..
        } = self;
        let storing = Storing { bits: self.output.bits, dpi: finish.dpi };
        let mut writer = frames.open(*film, storing)?;
        if let Some(figure) = &self.ready.figure {
            let drawn = self.draw_figure(figure, drawer, (&mut writer, progress))?;
            writer.finish()?;
            return Ok(drawn);
        }
        let mut texts = serde_json::Value::Null;
        let mut times = Vec::new();
        let free = job.free(finish);
        let cameras = motion.cameras(&job.framing()?, &loaded.subject, free)?;
        let mut last = (FrameStats::default(), cameras[0].clone());
        let (mut is_shown, mut missing) = (false, 0);
        let count = cameras.len();
        let bar = (count > 1).then(|| progress.bar("Drawing frames", count as u64));
        let tell = |what: &str, frame: usize| match &bar {
            Some(bar) => bar.set(frame as u64),
            None => progress.stage(format!("{what} {}", frames.name(frame))),
        };
        for (frame, camera) in cameras.into_iter().enumerate() {
            if settings.controls.stop.is_requested() {
                return Err(Error::Stopped.into());
            }
            tell("Drawing", frame);
            let start = Instant::now();
            let path = self.path.map(|file| (file, motion.place(frame)));
            let (picture, stats) = self.draw_view(drawer, &camera, (settings, path))?;
            times.push(milliseconds(start));
            match job.require_content(&picture) {
                Ok(()) => is_shown = true,
                // A camera on a path may look past the scene for a while.
                Err(_) if !motion.is_fitted() && (is_shown || frame + 1 < count) => {}
                Err(failure) => return Err(failure),
            }
            let mut picture = finish.reduced(picture, &camera, loaded)?;
            let layers = self.draw_layers(&camera, drawer)?;
            tell("Writing", frame);
            texts = finish.overlaid(&mut picture, &camera);
            let is_wanted = writer.add_with(&picture, &layers)?;
            self.write_depth(&picture)?;
            missing = missing.max(stats.missing_pages);
            last = (stats, camera);
            if !is_wanted {
                break;
            }
        }
        writer.finish()?;
        warn_of_pages(missing, progress);
        times.sort_by(f64::total_cmp);
        let (stats, camera) = last;
        Ok(Drawn { stats, camera, frame_ms: times[times.len() / 2], overlay: texts })
    }

    /// Draws what a camera sees, before it is averaged down. `path` is the file of the camera's
    /// path and the place in it, for errors.
    fn draw_view(
        &self,
        drawer: &mut Drawer,
        camera: &Camera,
        (settings, path): (&Settings, Option<(&Path, String)>),
    ) -> Result<(Picture, FrameStats), Failure> {
        let Ready { job, loaded, .. } = self.ready;
        let drawn = drawer.draw(loaded, camera, settings);
        drawn.map_err(|error| job.undrawn(error, loaded, (camera, settings.size), path))
    }

    /// Draws and writes a picture of several views. The statistics are sums over them.
    fn draw_figure(
        &self,
        figure: &Figure,
        drawer: &mut Drawer,
        (writer, progress): (&mut Writer<'_>, &Progress),
    ) -> Result<Drawn, Failure> {
        let Ready { job, loaded, settings, finish, .. } = self.ready;
        let mut settings = settings.clone();
        settings.size = figure.panel_size().map(|side| side.saturating_mul(finish.drawing.factor));
        let name = self.frames.name(0);
        progress.stage(format!("Drawing {name}"));
        let start = Instant::now();
        let mut sum = FrameStats::default();
        let (picture, overlay) = figure.draw(finish.overlay(), |camera| {
            let (picture, stats) = self.draw_view(drawer, camera, (&settings, None))?;
            let before = std::mem::replace(&mut sum, stats);
            sum.splats += before.splats;
            sum.hidden += before.hidden;
            sum.entries += before.entries;
            sum.gathered += before.gathered;
            sum.passes += before.passes;
            sum.missing_pages = sum.missing_pages.max(before.missing_pages);
            Ok::<_, Failure>(finish.reduced(picture, camera, loaded)?)
        })?;
        job.require_content(&picture)?;
        let frame_ms = milliseconds(start);
        progress.stage(format!("Writing {name}"));
        writer.add(&picture)?;
        self.write_depth(&picture)?;
        warn_of_pages(sum.missing_pages, progress);
        Ok(Drawn { stats: sum, camera: figure.cameras()[0].clone(), frame_ms, overlay })
    }

    /// Writes the depths of a picture, if they are asked for.
    fn write_depth(&self, picture: &Picture) -> Result<(), Failure> {
        match &self.output.depth {
            Some(depth) => Ok(disk::write(depth, &picture.encode_depth()?)?),
            None => Ok(()),
        }
    }
}

/// Refuses an animation of several views.
fn require_one_view(job: &Job) -> Result<(), Failure> {
    if job.scene.picture.views.is_empty() {
        return Ok(());
    }
    let message = "an animation shows one view: leave out --turntable, --path or --times, or the \
                   several views (--views)";
    Err(Failure::Usage(message.into()))
}

/// Warns of pages that did not fit in memory.
fn warn_of_pages(missing: u64, progress: &Progress) {
    if missing > 0 {
        progress.warn(format_args!(
            "{missing} of the pages that the picture needs do not fit in memory, so it is coarser \
             there; --memory raises the limit"
        ));
    }
}

impl OutputFlags {
    /// Returns the default name of the picture: that of the first input, with a number if there is
    /// such a file already.
    fn beside(&self, first: &Path, is_moving: bool) -> PathBuf {
        let stem = first.file_stem().unwrap_or("picture".as_ref());
        let named = |number: u32| {
            let mut name = stem.to_owned();
            if number > 1 {
                name.push(format!("_{number}"));
            }
            name.push(".png");
            // Nothing is written beside an address.
            if is_remote(first) { name.into() } else { first.with_file_name(name) }
        };
        let is_free = |path: &PathBuf| {
            let path = if is_moving { numbered(path, 0) } else { Ok(path.clone()) };
            self.overwrite || path.is_ok_and(|path| path.symlink_metadata().is_err())
        };
        (1..).map(named).find(is_free).unwrap_or_else(|| named(1))
    }

    /// Returns where the frames go. Fails if one of the files exists and may not be replaced, or
    /// if the first file cannot be written.
    fn frames(
        &self,
        output: &Path,
        motion: &Motion,
        film: &Film,
        (inputs, progress): (&[PathBuf], &Progress),
    ) -> Result<Frames, Failure> {
        let frames = self.unchecked_frames(output, motion, film)?;
        frames.check(Storing { bits: self.bits, dpi: None }, !self.layers.is_empty())?;
        if let Frames::Film(path, format) = &frames {
            format.check(path, film)?;
            if let Some(warning) = format.loss(film) {
                progress.warn(warning);
            }
        }
        if let Some(depth) = &self.depth {
            self.check_depth(depth, &frames)?;
        }
        // All numbered pictures go to the same folder, so the first one is enough.
        let files = frames.files();
        for file in files.first().copied().into_iter().chain(self.depth.as_deref()) {
            output::try_writing(file, inputs)?;
        }
        Ok(frames)
    }

    /// Returns where `-o` says that the frames go.
    fn unchecked_frames(
        &self,
        output: &Path,
        motion: &Motion,
        film: &Film,
    ) -> Result<Frames, Failure> {
        let is_moving = !matches!(motion, Motion::Still);
        let is_stdout = output.as_os_str() == "-";
        let refuse = |message: &str| Err(Failure::Usage(message.into()));
        if is_stdout && self.json {
            return refuse("--json and a picture cannot both go to stdout");
        }
        if self.raw && !is_stdout {
            return refuse("--raw writes to stdout: give -o -");
        }
        if self.raw {
            return Ok(Frames::Raw);
        }
        if is_stdout && is_moving {
            return refuse("the frames of an animation can go to stdout only with --raw");
        }
        match Format::of(output).filter(|_| is_moving) {
            Some(format) => {
                output::check(output, self.overwrite)?;
                Ok(Frames::Film(output.to_owned(), format))
            }
            None => {
                let count = is_moving.then_some(film.frames);
                Frames::pictures(output, count, self.overwrite)
            }
        }
    }

    /// Refuses a file of depths that cannot be written, or that is also the picture's.
    fn check_depth(&self, depth: &Path, frames: &Frames) -> Result<(), Failure> {
        let refuse = |message: &str| Err(Failure::Usage(format!("{}: {message}", depth.display())));
        if PictureFormat::of(depth)? != PictureFormat::Png {
            return refuse("depths are written as .png");
        }
        output::check(depth, self.overwrite)?;
        if frames.files().into_iter().any(|file| is_same(file, depth)) {
            return refuse("the picture and its depths would be one file");
        }
        Ok(())
    }
}

/// Whether two paths name the same file. The files may not exist yet, so folders and names are
/// compared.
fn is_same(a: &Path, b: &Path) -> bool {
    let folder = |path: &Path| {
        let folder =
            path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        folder.canonicalize().unwrap_or_else(|_| folder.to_owned())
    };
    a.file_name() == b.file_name() && folder(a) == folder(b)
}

/// Returns a number of bytes as people read it.
fn size_of_file(bytes: u64) -> String {
    match bytes as f64 {
        bytes if bytes < 1e3 => format!("{bytes} bytes"),
        bytes if bytes < 1e6 => format!("{:.0} kB", bytes / 1e3),
        bytes => format!("{:.1} MB", bytes / 1e6),
    }
}
