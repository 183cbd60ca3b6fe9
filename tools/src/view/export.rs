//! Writing a film in the background.

use super::{loader::text_of, painter::Stage};
use crate::{
    job::Job,
    progress::Progress,
    render::{self, Export},
};
use splatkit::{Stop, math::CameraPath, volume::TransferFunction};
use std::{
    path::PathBuf,
    sync::{
        Arc,
        mpsc::{Receiver, TryRecvError, channel},
    },
    time::Instant,
};

/// A film that is to be written.
pub struct Film {
    pub job: Job,
    pub stage: Arc<Stage>,
    /// The transfer functions of the fields, with the numbers of their items.
    pub transfers: Vec<(usize, TransferFunction)>,
    pub path: CameraPath,
    /// Frames per second.
    pub rate: f64,
    pub output: PathBuf,
}

/// A film that is being written. Dropping it ends that; the file then does not appear.
pub struct Exporting {
    progress: Arc<Progress>,
    stop: Stop,
    result: Receiver<Result<(), String>>,
    pub since: Instant,
}

impl Exporting {
    /// Starts to write. `tell` is called at the end.
    pub fn start(film: Film, tell: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let (progress, stop) = (Arc::new(Progress::kept()), Stop::default());
        let (send, result) = channel();
        let (thread_progress, thread_stop) = (Arc::clone(&progress), stop.clone());
        std::thread::Builder::new().name("film".into()).spawn(move || {
            let export = Export {
                loaded: &film.stage.loaded,
                transfers: &film.transfers,
                path: film.path,
                rate: film.rate,
                output: &film.output,
                stop: thread_stop,
            };
            let done = render::export(&film.job, export, &thread_progress)
                .map_err(|failure| text_of(&failure));
            // Nobody waits any more if the film was cancelled.
            send.send(done).ok();
            tell();
        })?;
        Ok(Self { progress, stop, result, since: Instant::now() })
    }

    /// Returns what is being done.
    pub fn step(&self) -> String {
        self.progress.current().0
    }

    /// Takes the result with the notes, once there is one.
    pub fn take(&self) -> Option<(Result<(), String>, Vec<String>)> {
        let result = match self.result.try_recv() {
            Ok(result) => result,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err("the film could not be written".into()),
        };
        Some((result, self.progress.take_notes()))
    }
}

impl Drop for Exporting {
    fn drop(&mut self) {
        self.stop.request();
    }
}
