//! `splatkit bench`.

use crate::{
    camera::CameraFlags,
    describe,
    engine::EngineFlags,
    failure::Failure,
    given::Given,
    job::{Job, Loaded},
    output,
    progress::Progress,
    scene::SceneFlags,
    timing::{self, STEP, Times, milliseconds},
};
use clap::Args;
use splatkit::{Error, FrameStats, Renderer, math::Camera, scene::Settings, session::Samples};
use std::time::Instant;

#[derive(Args, Debug)]
pub struct Bench {
    /// Measure this many frames, after a first one that does not count.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 10,
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    frames: u32,
    /// Print the results as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    scene: SceneFlags,
    #[command(flatten)]
    camera: CameraFlags,
    #[command(flatten)]
    engine: EngineFlags,
}

impl Bench {
    pub fn run(self, given: &Given, progress: &Progress) -> Result<(), Failure> {
        let (mut scene, stated) = self.scene.open(given)?;
        self.scene.apply(&mut scene)?;
        self.camera.apply(&mut scene);
        self.engine.apply(&mut scene);
        scene.picture.samples = Some(Samples::Factor(1));
        let job = Job::new(scene.clone(), self.engine.device(&scene), given, stated)?;
        self.measure(&job, progress).map_err(|failure| job.blamed(failure, &[]))
    }

    fn measure(&self, job: &Job, progress: &Progress) -> Result<(), Failure> {
        let frames = self.frames;
        let loaded = job.load(progress)?;
        let settings = job.settings(&loaded)?;
        progress.stage("Opening the device");
        let device = job.open_device(&loaded.scene)?;
        progress.stage("Preparing the scene");
        let start = Instant::now();
        let mut renderer = Renderer::new(&device, &loaded.scene)?;
        let upload_ms = milliseconds(start);
        let framing = job.framing()?;
        let camera =
            |frame: u32| framing.turned(&loaded.subject, settings.size, STEP * f64::from(frame));

        let mut frame = |number: u32| {
            progress.stage(format!("Frame {number} of {frames}"));
            let start = Instant::now();
            let camera = camera(number);
            let stats = renderer
                .draw(&camera, &settings)
                .map_err(|error| job.undrawn(error, &loaded, (&camera, settings.size), None))?;
            Ok::<_, Failure>((milliseconds(start), stats))
        };
        let (first_ms, stats) = frame(0)?;
        if stats.splats == 0 && stats.gathered == 0 {
            return Err(
                Error::NothingToDraw("the camera sees no splat that has opacity".into()).into()
            );
        }
        let (mut times, mut host) = (Vec::new(), Vec::new());
        for number in 1..=frames {
            let (time, stats) = frame(number)?;
            times.push(time);
            host.push(stats.host_ms);
        }
        progress.stage("Measuring the passes");
        let profile = renderer.profile(&camera(0), &settings)?;
        progress.clear();
        let measured = Measured {
            adapter: device.name(),
            frames,
            upload_ms,
            first_ms,
            times: Times::of(times),
            host_ms: Times::of(host).median,
            stats,
            profile,
        };
        if self.json {
            return output::json(&to_json(job, &loaded, (&settings, &camera(0)), &measured));
        }
        print(job, &loaded, &measured)
    }
}

/// Returns the results as JSON.
fn to_json(
    job: &Job,
    loaded: &Loaded,
    (settings, camera): (&Settings, &Camera),
    measured: &Measured,
) -> serde_json::Value {
    let Measured { times: Times { min, median, max }, stats, .. } = measured;
    let [width, height] = job.size();
    serde_json::json!({
        "scene": job.name(),
        "adapter": measured.adapter,
        "width": width,
        "height": height,
        "frames": measured.frames,
        "frame_ms": { "min": min, "median": median, "max": max },
        "host_ms": measured.host_ms,
        "first_ms": measured.first_ms,
        "load_ms": loaded.load_ms,
        "upload_ms": measured.upload_ms,
        "passes": timing::steps(&measured.profile.steps),
        "depth_passes": stats.passes,
        "splats": stats.splats,
        "hidden": stats.hidden,
        "bricks": describe::bricks(stats),
        "entries": stats.entries,
        "gathered": stats.gathered,
        "culled": measured.culled(loaded),
        "gpu_bytes": stats.gpu_bytes,
        "camera": crate::camera::to_json(camera),
        "settings": describe::settings(&loaded.scene, settings),
    })
}

/// Prints the results as text.
fn print(job: &Job, loaded: &Loaded, measured: &Measured) -> Result<(), Failure> {
    let Measured { adapter, frames, upload_ms, first_ms, stats, profile, .. } = measured;
    let Times { min, median, max } = measured.times;
    let [width, height] = job.size();
    output::line(format_args!("{} at {width}x{height} on {adapter}", job.name()))?;
    output::line(format_args!("load      {:10.1} ms", loaded.load_ms))?;
    output::line(format_args!("upload    {upload_ms:10.1} ms"))?;
    output::line(format_args!("first     {first_ms:10.1} ms"))?;
    output::line(format_args!(
        "frame     {median:10.1} ms  ({min:.1} to {max:.1}, {frames} frames)"
    ))?;
    if measured.host_ms > 0.0 {
        output::line(format_args!("  processor {:8.1} ms", measured.host_ms))?;
    }
    for (name, ms) in &profile.steps {
        output::line(format_args!("  {name:<10}{ms:8.1} ms"))?;
    }
    output::line(format_args!(
        "{} splats drawn, {} hidden, {} culled, {} entries in {} passes, {} MiB held",
        stats.splats - stats.hidden.min(stats.splats),
        stats.hidden,
        measured.culled(loaded),
        stats.entries,
        stats.passes,
        stats.gpu_bytes >> 20
    ))?;
    if stats.gathered > 0 {
        output::line(format_args!("gathered in {} pairs of a tile and a sheet", stats.gathered))?;
    }
    if stats.bricks > 0 {
        let (drawn, read, level, mib) =
            (stats.bricks, stats.read_bricks, stats.lambda, stats.brick_bytes >> 20);
        output::line(format_args!(
            "{drawn} bricks drawn of level {level:.2}, {read} of them read, {mib} MiB of slots"
        ))?;
    }
    Ok(())
}

/// The measured frames of a scene.
struct Measured<'a> {
    adapter: &'a str,
    frames: u32,
    upload_ms: f64,
    first_ms: f64,
    times: Times,
    /// Of the processor, in a frame on the GPU.
    host_ms: f64,
    /// Of the first frame.
    stats: FrameStats,
    /// Of the frame whose passes were measured.
    profile: FrameStats,
}

impl Measured<'_> {
    /// Returns the number of culled splats. Gathered samples are neither drawn as splats nor
    /// culled.
    fn culled(&self, loaded: &Loaded) -> u64 {
        if self.stats.gathered > 0 { 0 } else { loaded.count().saturating_sub(self.stats.splats) }
    }
}
