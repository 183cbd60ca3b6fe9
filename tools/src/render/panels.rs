//! Pictures of the channels of a file, beside each other.

use super::{Drawer, Drawn, Ready, Render, Run};
use crate::{
    failure::Failure, frames::Storing, job::Job, motion::Motion, progress::Progress,
    timing::milliseconds,
};
use splatkit::{FrameStats, scene::Scene, session::PanelLabels};
use splatkit_media::video::Film;
use std::time::Instant;

impl Render {
    /// Draws one picture with a panel for each channel, and one for all of them.
    pub(super) fn draw_channels(
        &self,
        job: &Job,
        (begun, progress): (Instant, &Progress),
    ) -> Result<(), Failure> {
        let inputs = job.inputs();
        let output = self.output.output.clone();
        let output = output.unwrap_or_else(|| self.output.beside(&inputs[0], false));
        let motion = Motion::Still;
        let background = job.scene.picture.background();
        let film = Film { size: job.size(), frames: 1, rate: self.motion.rate(), background };
        let frames = self.output.frames(&output, &motion, &film, (&inputs, progress))?;
        let mut loaded = job.load(progress)?;
        let (settings, finish) = self.prepare(job, &mut loaded, (&frames, &motion), progress)?;
        let (columns, labels) = self.figure.row_of_channels();
        let finish = job.finish_with_labels(finish, &loaded, labels)?;
        let channels = loaded.channels();
        if channels.is_empty() {
            let message = "--split-channels: no input is drawn in several channels; `splatkit \
                           info` lists those of a file";
            return Err(Failure::Usage(message.into()));
        }
        let ready = Ready { job, loaded: &loaded, settings, finish, figure: None };
        let start = Instant::now();
        let mut drawer = match self.reference {
            true => Drawer::Reference,
            false => Drawer::engine(job, ready.loaded, progress)?,
        };
        let upload_ms = milliseconds(start);
        let run = Run { ready: &ready, output: &self.output, motion, path: None, film, frames };
        let drawn = run.draw_panels(&channels, (columns, labels), &mut drawer, progress)?;
        self.tell(&run, &drawn, (&drawer, upload_ms), (&output, begun, progress))
    }
}

impl Run<'_> {
    /// Draws and writes one picture with a panel for each of these parts of the scene, and one for
    /// the whole.
    fn draw_panels(
        &self,
        parts: &[(String, Scene)],
        (columns, labels): (Option<u32>, PanelLabels),
        drawer: &mut Drawer,
        progress: &Progress,
    ) -> Result<Drawn, Failure> {
        let Ready { job, loaded, settings, finish, .. } = self.ready;
        let storing = Storing { bits: self.output.bits, dpi: finish.dpi };
        let mut writer = self.frames.open(self.film, storing)?;
        let mut names: Vec<String> = parts.iter().map(|(name, _)| name.clone()).collect();
        names.push("all".into());
        let figure = job.figure_of(&loaded.subject, finish, (names, columns, labels))?;
        let mut settings = settings.clone();
        settings.size = figure.panel_size().map(|side| side.saturating_mul(finish.drawing.factor));
        let mut scenes = parts.iter().map(|(_, scene)| scene);
        let mut stats = FrameStats::default();
        let start = Instant::now();
        let bar = progress.bar("Drawing channels", parts.len() as u64 + 1);
        let mut number = 0;
        let (picture, overlay) = figure.draw(finish.overlay(), |camera| {
            bar.set(number);
            number += 1;
            let drawn = match scenes.next() {
                Some(scene) => drawer.draw_scene(scene, camera, &settings),
                None => drawer.draw(loaded, camera, &settings),
            };
            let picture;
            (picture, stats) =
                drawn.map_err(|error| job.undrawn(error, loaded, (camera, settings.size), None))?;
            Ok::<_, Failure>(finish.reduced(picture, camera, loaded)?)
        })?;
        job.require_content(&picture)?;
        let frame_ms = milliseconds(start) / (parts.len() + 1) as f64;
        writer.add(&picture)?;
        writer.finish()?;
        Ok(Drawn { stats, camera: figure.cameras()[0].clone(), frame_ms, overlay })
    }
}
