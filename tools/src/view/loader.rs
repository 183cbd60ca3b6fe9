//! Loading a scene in the background.

use super::painter::Stage;
use crate::{failure::Failure, job::Job, progress::Progress};
use splatkit::interaction::Histogram;
use std::{
    sync::{
        Arc,
        mpsc::{Receiver, TryRecvError, channel},
    },
    time::Instant,
};

/// A scene that is being loaded. Dropping it forgets the scene: the thread ends after the step that
/// it is at.
pub struct Loading {
    progress: Arc<Progress>,
    result: Receiver<Result<Stage, String>>,
    pub since: Instant,
}

impl Loading {
    /// Starts to load. A stage that is given has the scene already: only the device is opened.
    /// `tell` is called at the end.
    pub fn start(
        job: Job,
        kept: Option<Arc<Stage>>,
        tell: impl Fn() + Send + 'static,
    ) -> std::io::Result<Self> {
        let progress = Arc::new(Progress::kept());
        let (send, result) = channel();
        let thread_progress = Arc::clone(&progress);
        std::thread::Builder::new().name("loader".into()).spawn(move || {
            let loaded = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                let stage = match &kept {
                    Some(stage) => reopened(&job, stage, &thread_progress),
                    None => load(&job, &thread_progress),
                };
                stage.map_err(|failure| text_of(&failure))
            }));
            let loaded = loaded.unwrap_or_else(|_| Err("the file could not be read".into()));
            // Nobody waits any more if loading was cancelled.
            send.send(loaded).ok();
            tell();
        })?;
        Ok(Self { progress, result, since: Instant::now() })
    }

    /// Returns the name of the current step, and the share of it that is done, if it is known.
    pub fn step(&self) -> (String, Option<f32>) {
        self.progress.current()
    }

    /// Takes the result, once there is one.
    pub fn take(&self) -> Option<Result<Stage, String>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("the file could not be read".into())),
        }
    }

    /// Takes the notes and warnings of loading.
    pub fn take_notes(&self) -> Vec<String> {
        self.progress.take_notes()
    }
}

fn load(job: &Job, progress: &Progress) -> Result<Stage, Failure> {
    let mut loaded = job.load(progress)?;
    progress.stage("Framing the scene");
    let settings = job.settings(&loaded)?;
    loaded.find_seen(&job.framing()?, &settings)?;
    progress.stage("Opening the device");
    let device = job.open_device(&loaded.scene)?;
    progress.stage("Counting values");
    let items = &loaded.scene.items;
    let of_item = |item: usize| Some((item, Histogram::of_item(&items[item])?));
    let histograms = loaded.scene.fields().into_iter().filter_map(of_item).collect();
    let sheet = loaded.scene.finest_sheet();
    Ok(Stage { loaded: Arc::new(loaded), device, histograms, sheet })
}

/// Opens another device for a scene that is in memory.
fn reopened(job: &Job, stage: &Stage, progress: &Progress) -> Result<Stage, Failure> {
    progress.stage("Opening the device");
    let device = job.open_device(&stage.loaded.scene)?;
    let (loaded, histograms) = (Arc::clone(&stage.loaded), Arc::clone(&stage.histograms));
    Ok(Stage { loaded, device, histograms, sheet: stage.sheet })
}

/// Returns a failure as a message, with its hint.
pub fn text_of(failure: &Failure) -> String {
    let message = failure.to_string();
    failure.hint().map_or(message.clone(), |hint| format!("{message}\n{hint}"))
}
