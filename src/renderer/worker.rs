//! The CPU engine in a thread of its own, so that a host application need not wait for it.

use crate::{
    FrameStats, Result, Stop, cpu::CpuRenderer, math::View, picture::Picture, scene::Settings,
};
use std::{
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    task::{Poll, Waker},
    thread,
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
    /// Ends the frame before it is finished. It listens to the request in the host's settings.
    stop: Stop,
}

/// Where a thread leaves its frame.
#[derive(Debug, Default)]
struct Slot {
    /// The frame, or what a panic of its thread says.
    drawn: Option<thread::Result<Drawn>>,
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
        self.start(settings, move |engine, settings| engine.render(&view, settings));
    }

    /// Begins what `draw` does with the engine and the settings of a frame.
    fn start(
        &mut self,
        settings: &Settings,
        draw: impl FnOnce(&mut CpuRenderer, &Settings) -> Drawn + Send + 'static,
    ) {
        drop(self.engine());
        let (stop, slot) = (settings.controls.stop.child(), Arc::<Mutex<Slot>>::default());
        let job = Job { slot: slot.clone(), stop: stop.clone() };
        let (engine, mut settings) = (self.engine.clone(), settings.clone());
        settings.controls.stop = stop;
        spawn(move || {
            // The engine after a panic is as it would be if the caller had drawn.
            let drawn = catch_unwind(AssertUnwindSafe(|| draw(&mut lock(&engine), &settings)));
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
    ///
    /// # Panics
    /// If the engine panicked in its thread: as it would have in the caller's.
    pub fn poll(&mut self, waker: Option<&Waker>) -> Poll<Drawn> {
        let Some(job) = &self.job else { return Poll::Pending };
        let mut slot = lock(&job.slot);
        match slot.drawn.take() {
            Some(Ok(drawn)) => Poll::Ready(drawn),
            Some(Err(panic)) => {
                drop(slot);
                self.job = None;
                resume_unwind(panic)
            }
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
    thread::spawn(work);
    #[cfg(target_arch = "wasm32")]
    work();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Error,
        math::Camera,
        scene::Scene,
        surface::{Mesh, SurfelOptions},
    };
    use std::time::{Duration, Instant};

    fn parts() -> (Worker, View, Settings) {
        let ball = Mesh::sphere(2).surfels(&SurfelOptions::default()).unwrap();
        let scene = Scene::new().with_splats(ball);
        let view = Camera::fit(&scene, [16; 2]).unwrap().view([16; 2]).unwrap();
        let worker = Worker::new(CpuRenderer::new(&scene).unwrap());
        (worker, view, Settings::new([16; 2]))
    }

    /// Waits until a thread has left its frame, without polling.
    fn wait(worker: &Worker) {
        let (slot, since) = (worker.job.as_ref().unwrap().slot.clone(), Instant::now());
        while lock(&slot).drawn.is_none() {
            assert!(since.elapsed() < Duration::from_secs(60), "the frame waits for ever");
            thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_frame_ends_when_its_host_asks_though_nobody_polls() {
        let (mut worker, view, settings) = parts();
        let (gate, opened) = std::sync::mpsc::channel::<()>();
        worker.start(&settings, move |engine, settings| {
            opened.recv().ok();
            engine.render(&view, settings)
        });
        settings.controls.stop.request();
        gate.send(()).unwrap();
        wait(&worker);
        assert!(matches!(worker.poll(None), Poll::Ready(Err(Error::Stopped))));
    }

    #[test]
    fn a_frame_that_is_abandoned_leaves_the_hosts_request_alone() {
        let (mut worker, view, settings) = parts();
        worker.begin(view.clone(), &settings);
        worker.begin(view, &settings);
        wait(&worker);
        assert!(matches!(worker.poll(None), Poll::Ready(Ok(_))));
        assert!(!settings.controls.stop.is_requested());
    }

    #[test]
    fn a_panic_in_the_thread_is_one_of_the_caller() {
        let (mut worker, view, settings) = parts();
        worker.start(&settings, |_, _| panic!("broken"));
        wait(&worker);
        let panic = catch_unwind(AssertUnwindSafe(|| worker.poll(None))).unwrap_err();
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"broken"));
        assert!(worker.poll(None).is_pending());
        // The engine goes on.
        worker.begin(view, &settings);
        wait(&worker);
        assert!(matches!(worker.poll(None), Poll::Ready(Ok(_))));
    }
}
