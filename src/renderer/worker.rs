//! The CPU engine in a thread of its own, so that a host application need not wait for it.

use crate::{
    FrameStats, Result, Stop, cpu::CpuRenderer, math::View, picture::Picture, scene::Settings,
};
use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    task::{Poll, Waker},
};

/// What the CPU engine has made of a frame.
type Drawn = Result<(Picture, FrameStats)>;

/// The CPU engine, which draws in the calling thread or in one of its own.
#[derive(Debug)]
pub struct Worker {
    engine: Arc<Mutex<CpuRenderer>>,
    job: Option<Job>,
}

/// A frame that a thread draws.
#[derive(Debug)]
struct Job {
    slot: Arc<Mutex<Slot>>,
    /// Ends the frame before it is finished.
    stop: Stop,
    /// The request to stop that is in the frame's settings.
    host_stop: Stop,
}

/// Where a thread leaves its frame.
#[derive(Debug, Default)]
struct Slot {
    drawn: Option<Drawn>,
    /// The task that waits for the frame.
    waker: Option<Waker>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Worker {
    pub fn new(engine: CpuRenderer) -> Self {
        Self { engine: Arc::new(Mutex::new(engine)), job: None }
    }

    /// Returns the engine. A frame that a thread draws is abandoned.
    pub fn engine(&mut self) -> MutexGuard<'_, CpuRenderer> {
        if let Some(job) = self.job.take() {
            job.stop.request();
        }
        lock(&self.engine)
    }

    /// Begins a frame in a thread. A frame that was begun before is abandoned.
    pub fn begin(&mut self, view: View, settings: &Settings) {
        drop(self.engine());
        let (stop, slot) = (Stop::default(), Arc::<Mutex<Slot>>::default());
        let job = Job {
            slot: slot.clone(),
            stop: stop.clone(),
            host_stop: settings.controls.stop.clone(),
        };
        let (engine, mut settings) = (self.engine.clone(), settings.clone());
        settings.controls.stop = stop;
        spawn(move || {
            let drawn = lock(&engine).render(&view, &settings);
            let mut slot = lock(&slot);
            slot.drawn = Some(drawn);
            if let Some(waker) = slot.waker.take() {
                waker.wake();
            }
        });
        self.job = Some(job);
    }

    /// Looks, without waiting, whether the frame that was begun last is finished. `waker` is called
    /// when it is.
    pub fn poll(&mut self, waker: Option<&Waker>) -> Poll<Drawn> {
        let Some(job) = &self.job else { return Poll::Pending };
        if job.host_stop.is_requested() {
            job.stop.request();
        }
        let mut slot = lock(&job.slot);
        match slot.drawn.take() {
            Some(drawn) => Poll::Ready(drawn),
            None => {
                slot.waker = waker.cloned();
                Poll::Pending
            }
        }
    }
}

/// Does the work in a thread; without threads, at once.
fn spawn(work: impl FnOnce() + Send + 'static) {
    #[cfg(not(target_arch = "wasm32"))]
    std::thread::spawn(work);
    #[cfg(target_arch = "wasm32")]
    work();
}
