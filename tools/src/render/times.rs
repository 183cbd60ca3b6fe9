//! Pictures of several times: a film, numbered pictures, or all beside each other.

use super::{Drawer, Drawn, Ready, Render, Run, require_one_view};
use crate::{
    failure::Failure,
    frames::Storing,
    job::{Job, Loaded},
    motion::Motion,
    progress::Progress,
    times::Times,
    timing::milliseconds,
};
use splatkit::{FrameStats, Renderer, math::Camera, picture::Picture, session::PanelLabels};
use splatkit_media::video::Film;
use std::time::Instant;

impl Render {
    /// Draws the inputs at several times. What shows the values is made for the first one, and the
    /// camera is fitted to all.
    pub(super) fn draw_times(
        &self,
        times: &Times,
        job: &Job,
        (begun, progress): (Instant, &Progress),
    ) -> Result<(), Failure> {
        require_one_view(job)?;
        let mut job = job.clone();
        job.scene.reading.time = Some(times.first());
        job.scene.inputs.iter_mut().for_each(|input| input.reading.time = None);
        let mut loaded = job.load(progress)?;
        let counts = loaded.inputs.iter().filter_map(|input| input.times);
        let numbers = times.numbers(counts.map(|times| times.count).max().unwrap_or(1))?;
        let row = self.figure.row_of_times();
        let motion = match row {
            Some(_) => Motion::Still,
            None => Motion::Times(numbers.len() as u32),
        };
        let film = Film {
            size: job.size(),
            frames: motion.frames(),
            rate: self.motion.rate(),
            background: job.scene.picture.background(),
        };
        let inputs = job.inputs();
        let is_moving = !matches!(motion, Motion::Still);
        let output = self.output.output.clone();
        let output = output.unwrap_or_else(|| self.output.beside(&inputs[0], is_moving));
        let frames = self.output.frames(&output, &motion, &film, (&inputs, progress))?;
        if let Some(warning) = self.motion.idle(frames.is_played()) {
            progress.warn(warning);
        }
        let (settings, finish) = self.prepare(&job, &mut loaded, (&frames, &motion), progress)?;
        see_all(&job, &mut loaded, &numbers, progress)?;
        let finish = match row {
            Some((_, labels)) => job.finish_with_labels(finish, &loaded, labels)?,
            None => finish,
        };
        let ready = Ready { job: &job, loaded: &loaded, settings, finish, figure: None };
        let start = Instant::now();
        let mut drawer = match self.reference {
            true => Drawer::Reference,
            false => Drawer::engine(&job, ready.loaded, progress)?,
        };
        let upload_ms = milliseconds(start);
        let run = Run { ready: &ready, output: &self.output, motion, path: None, film, frames };
        let drawn = match row {
            Some(row) => run.draw_beside((&numbers, row), &mut drawer, progress)?,
            None => run.draw_film(&numbers, &mut drawer, progress)?,
        };
        self.tell(&run, &drawn, (&drawer, upload_ms), (&output, begun, progress))
    }
}

/// Adds what is seen at later times to what the camera is fitted to. The first time is loaded.
fn see_all(
    job: &Job,
    loaded: &mut Loaded,
    times: &[usize],
    progress: &Progress,
) -> Result<(), Failure> {
    let framing = job.framing()?;
    if framing.is_placed() {
        return Ok(());
    }
    let bar = progress.bar("Framing the times", times.len() as u64);
    for (number, &time) in times.iter().enumerate().skip(1) {
        bar.set(number as u64);
        let (other, mut later) = job.at_time(loaded, time)?;
        let settings = other.settings(&later)?;
        later.find_seen(&framing, &settings)?;
        loaded.subject.seen.append(&mut later.subject.seen);
    }
    Ok(())
}

impl Run<'_> {
    /// Draws and writes a frame for each time.
    fn draw_film(
        &self,
        times: &[usize],
        drawer: &mut Drawer,
        progress: &Progress,
    ) -> Result<Drawn, Failure> {
        let Ready { job, loaded, finish, .. } = self.ready;
        let storing = Storing { bits: self.output.bits, dpi: finish.dpi };
        let mut writer = self.frames.open(self.film, storing)?;
        let camera = job.framing()?.camera(&loaded.subject, job.free(finish))?;
        let bar = progress.bar("Drawing times", times.len() as u64);
        let mut milliseconds_of = Vec::new();
        let (mut stats, mut overlay) = (FrameStats::default(), serde_json::Value::Null);
        let mut is_empty = true;
        for (frame, &time) in times.iter().enumerate() {
            bar.set(frame as u64);
            let start = Instant::now();
            let mut picture;
            (picture, stats) = self.draw_time((frame, time), drawer, (&camera, job.size()))?;
            milliseconds_of.push(milliseconds(start));
            // Some times may show nothing, but not all.
            let content = job.require_content(&picture);
            is_empty &= content.is_err();
            if is_empty && frame + 1 == times.len() {
                content?;
            }
            overlay = self.overlaid(&mut picture, &camera, time)?;
            if !writer.add(&picture)? {
                break;
            }
        }
        writer.finish()?;
        milliseconds_of.sort_by(f64::total_cmp);
        let frame_ms = milliseconds_of[milliseconds_of.len() / 2];
        Ok(Drawn { stats, camera, frame_ms, overlay })
    }

    /// Draws and writes one picture with a panel for each time.
    fn draw_beside(
        &self,
        (times, row): (&[usize], (u32, PanelLabels)),
        drawer: &mut Drawer,
        progress: &Progress,
    ) -> Result<Drawn, Failure> {
        let Ready { job, loaded, finish, .. } = self.ready;
        let storing = Storing { bits: self.output.bits, dpi: finish.dpi };
        let mut writer = self.frames.open(self.film, storing)?;
        let names = times.iter().map(|time| format!("time {time}")).collect();
        let figure = job.figure_of(&loaded.subject, finish, (names, Some(row.0), row.1))?;
        let size = figure.panel_size();
        let mut numbers = times.iter().copied().enumerate();
        let mut stats = FrameStats::default();
        let start = Instant::now();
        let bar = progress.bar("Drawing times", times.len() as u64);
        let (picture, overlay) = figure.draw(finish.overlay(), |camera| {
            let at = numbers.next().unwrap_or_default();
            bar.set(at.0 as u64);
            let picture;
            (picture, stats) = self.draw_time(at, drawer, (camera, size))?;
            Ok::<_, Failure>(picture)
        })?;
        job.require_content(&picture)?;
        let frame_ms = milliseconds(start) / times.len() as f64;
        writer.add(&picture)?;
        writer.finish()?;
        Ok(Drawn { stats, camera: figure.cameras()[0].clone(), frame_ms, overlay })
    }

    /// Draws the inputs at a time, for a picture of this size without texts. The first frame is of
    /// the scene that is loaded.
    fn draw_time(
        &self,
        (frame, time): (usize, usize),
        drawer: &mut Drawer,
        (camera, size): (&Camera, [u32; 2]),
    ) -> Result<(Picture, FrameStats), Failure> {
        let Ready { job, loaded: first, settings, finish, .. } = self.ready;
        let size = size.map(|side| side.saturating_mul(finish.drawing.factor));
        let other = (frame > 0).then(|| job.at_time(first, time)).transpose()?;
        let (job, loaded) = other.as_ref().map_or((*job, *first), |(job, loaded)| (job, loaded));
        let mut settings = match frame {
            0 => settings.clone(),
            _ => job.settings(loaded)?,
        };
        settings.size = size;
        if let (true, Drawer::Engine(renderer)) = (frame > 0, &mut *drawer) {
            let device = renderer.device().clone();
            **renderer = Renderer::new(&device, &loaded.scene)?;
        }
        let drawn = drawer.draw(loaded, camera, &settings);
        let (picture, stats) =
            drawn.map_err(|error| job.undrawn(error, loaded, (camera, size), None))?;
        Ok((finish.reduced(picture, camera, loaded)?, stats))
    }

    /// Draws the texts over the picture of a time. The caption may name the time.
    fn overlaid(
        &self,
        picture: &mut Picture,
        camera: &Camera,
        time: usize,
    ) -> Result<serde_json::Value, Failure> {
        const PLACEHOLDER: &str = "{time}";
        let Ready { job, loaded, finish, .. } = self.ready;
        let caption = job.scene.overlay.caption.as_ref();
        let Some(caption) = caption.filter(|caption| caption.contains(PLACEHOLDER)) else {
            return Ok(finish.overlaid(picture, camera));
        };
        let mut named = (*job).clone();
        named.scene.overlay.caption = Some(caption.replace(PLACEHOLDER, &time.to_string()));
        Ok(named.finish(loaded)?.overlaid(picture, camera))
    }
}
