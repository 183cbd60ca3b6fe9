//! Turns faults that a device can have at any time into errors: it is lost, it does not answer, or
//! its memory runs out. A picture drawn during a fault is never returned.

use crate::{Error, Result, gpu::device::Gpu};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    pin::Pin,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
    task::{Context, Poll, Waker},
};

/// The answer of an error scope. Browsers give it later, all others at once.
#[cfg(not(target_arch = "wasm32"))]
type Answer = Pin<Box<dyn Future<Output = Option<wgpu::Error>> + Send>>;
#[cfg(target_arch = "wasm32")]
type Answer = Pin<Box<dyn Future<Output = Option<wgpu::Error>>>>;

/// The answers that are still to come.
#[derive(Clone, Default)]
pub(crate) struct Answers(Arc<Mutex<Vec<Answer>>>);

impl std::fmt::Debug for Answers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Answers").field(&lock(&self.0).len()).finish()
    }
}

impl Answers {
    /// Returns the error of an answer, if it is there. An answer that is not is kept.
    fn take(&self, mut answer: Answer) -> Option<wgpu::Error> {
        match answer.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(error) => error,
            Poll::Pending => {
                lock(&self.0).push(answer);
                None
            }
        }
    }

    /// Returns the first error among the answers that have come.
    fn late(&self) -> Option<wgpu::Error> {
        let kept = std::mem::take(&mut *lock(&self.0));
        kept.into_iter().fold(None, |first, answer| first.or(self.take(answer)))
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The faults that a device has reported.
#[derive(Debug, Default)]
pub(crate) struct Condition {
    /// Why the device was lost, if it was.
    lost: OnceLock<String>,
    /// The first error since the last check that was reported outside of watched work.
    stray: Mutex<Option<String>>,
}

impl Condition {
    /// Registers the callbacks of a device that the engine has opened.
    pub fn listen(self: &Arc<Self>, device: &wgpu::Device) {
        let condition = self.clone();
        device.set_device_lost_callback(move |_, reason| condition.lose(reason));
        let condition = self.clone();
        // Without a handler, wgpu ends the program if memory runs out.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            condition.note(&error.to_string());
        }));
    }

    fn note(&self, complaint: &str) {
        lock(&self.stray).get_or_insert_with(|| complaint.to_owned());
    }

    fn lose(&self, reason: impl Into<String>) {
        // The first reason counts: others follow from it.
        let _ = self.lost.set(reason.into());
    }
}

impl Gpu {
    /// Does some work and returns its result, or the error that the device reported meanwhile.
    pub(crate) fn watch<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<Result<T>> {
        self.sound()?;
        let (done, complaint) = self.hear(work);
        if complaint.is_some() {
            // What is made on a lost device is invalid. Polling shows whether the device is lost.
            self.poll()?;
        }
        if complaint.is_some() || done.is_ok() {
            self.sound()?;
        }
        complaint.map_or(Ok(done), Err)
    }

    /// Like [`Self::watch`], for work that returns no errors. The next check returns what the
    /// device reported.
    pub(crate) fn watch_later<T>(&self, work: impl FnOnce() -> T) -> T {
        let (done, complaint) = self.hear(work);
        if let Some(complaint) = complaint {
            self.condition.note(&complaint.to_string());
        }
        done
    }

    fn hear<T>(&self, work: impl FnOnce() -> T) -> (T, Option<Error>) {
        let filters = [
            wgpu::ErrorFilter::Validation,
            wgpu::ErrorFilter::Internal,
            wgpu::ErrorFilter::OutOfMemory,
        ];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        let done = work();
        // The scope opened last is closed first. If memory ran out, the other errors follow from
        // that.
        let answers =
            scopes.into_iter().rev().map(|scope| self.answers.take(Box::pin(scope.pop())));
        let complaint = answers.reduce(Option::or).flatten();
        (done, complaint.map(|complaint| self.driver_error(complaint)))
    }

    fn driver_error(&self, complaint: wgpu::Error) -> Error {
        self.pipeline_cache.forget();
        let (name, reason) = (&self.info.name, complaint.to_string());
        Error::Driver(match complaint {
            wgpu::Error::OutOfMemory { .. } => format!("the memory of {name} ran out: {reason}"),
            _ => format!("{name}: {reason}"),
        })
    }

    /// Looks once, without waiting, whether submitted work is done.
    pub(crate) fn poll(&self) -> Result<()> {
        // wgpu panics if a device was lost.
        if catch_unwind(AssertUnwindSafe(|| self.device.poll(wgpu::PollType::Poll))).is_err() {
            self.condition.lose("it disappeared");
        }
        self.sound()
    }

    /// Waits until the device has done all submitted work.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] if the device is lost. [`Error::Driver`] if it does not answer in time
    /// ([`Self::with_patience`]), which loses it, or if it has reported an error since the last
    /// check.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn wait(&self) -> Result<()> {
        if self.condition.lost.get().is_some() {
            return self.sound();
        }
        let poll = wgpu::PollType::Wait { submission_index: None, timeout: Some(self.patience) };
        // wgpu panics if a device is lost during a wait.
        match catch_unwind(AssertUnwindSafe(|| self.device.poll(poll))) {
            Ok(Ok(_)) => {}
            Ok(Err(wgpu::PollError::Timeout)) => {
                let seconds = self.patience.as_secs_f64();
                self.condition.lose(format!("it did not answer within {seconds} s"));
                // Dropping a device waits for it. This one may never finish, so its memory is
                // leaked.
                std::mem::forget(self.clone());
                // A reopened device would take as long again, so this is not reported as a loss
                // that reopening repairs.
                return Err(Error::Driver(format!(
                    "{} did not answer within {seconds} s",
                    self.info.name
                )));
            }
            Ok(Err(error)) => self.condition.lose(error.to_string()),
            Err(_) => self.condition.lose("it disappeared during a wait"),
        }
        self.sound()
    }

    /// Returns an error if the device is lost, or has reported an error since the last check.
    pub(crate) fn sound(&self) -> Result<()> {
        if let Some(reason) = self.condition.lost.get() {
            return Err(Error::DeviceLost(format!("{} was lost: {reason}", self.info.name)));
        }
        let stray = lock(&self.condition.stray).take();
        // What is made of an invalid pipeline is a stray error. The answer says why it is invalid.
        if let Some(complaint) = self.answers.late() {
            return Err(self.driver_error(complaint));
        }
        stray.map_or(Ok(()), |stray| Err(Error::Driver(stray)))
    }
}
