//! Writing a film or a figure in the background.

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

/// What is written.
#[derive(Clone)]
pub enum What {
    /// A film along a path of the camera, with this many frames per second.
    Film(CameraPath, f64),
    /// The picture of several views that was opened.
    Figure,
}

impl What {
    pub fn name(&self) -> &'static str {
        match self {
            Self::Film(..) => "film",
            Self::Figure => "figure",
        }
    }
}

/// A film or a figure that is to be written.
pub struct Order {
    pub job: Job,
    pub stage: Arc<Stage>,
    /// The transfer functions that were edited, with the numbers of their items.
    pub transfers: Vec<(usize, TransferFunction)>,
    pub what: What,
    pub output: PathBuf,
}

/// A file that is being written. Dropping it ends that; the file then does not appear.
pub struct Exporting {
    pub what: What,
    progress: Arc<Progress>,
    stop: Stop,
    result: Receiver<Result<(), String>>,
    pub since: Instant,
}

impl Exporting {
    /// Starts to write. `tell` is called at the end.
    pub fn start(order: Order, tell: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let (progress, stop) = (Arc::new(Progress::kept()), Stop::default());
        let what = order.what.clone();
        let (send, result) = channel();
        let (thread_progress, thread_stop) = (Arc::clone(&progress), stop.clone());
        std::thread::Builder::new().name(what.name().into()).spawn(move || {
            let export = Export {
                loaded: &order.stage.loaded,
                transfers: &order.transfers,
                path: match order.what {
                    What::Film(path, rate) => Some((path, rate)),
                    What::Figure => None,
                },
                output: &order.output,
                stop: thread_stop,
            };
            let done = render::export(&order.job, export, &thread_progress)
                .map_err(|failure| text_of(&failure));
            // Nobody waits any more if it was cancelled.
            send.send(done).ok();
            tell();
        })?;
        Ok(Self { what, progress, stop, result, since: Instant::now() })
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
            Err(TryRecvError::Disconnected) => {
                Err(format!("the {} could not be written", self.what.name()))
            }
        };
        Some((result, self.progress.take_notes()))
    }
}

impl Drop for Exporting {
    fn drop(&mut self) {
        self.stop.request();
    }
}
