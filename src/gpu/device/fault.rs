//! Turns faults that a device can have at any time into errors: it is lost, it does not answer, or
//! its memory runs out. A picture drawn during a fault is never returned.

use crate::{Error, Result, gpu::device::Gpu};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Mutex, OnceLock, PoisonError},
    time::Duration,
};

/// Maximum time between the end of the device's work and the callback that reports it.
const CALL_BACK: Duration = Duration::from_secs(10);

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
        let own = self.clone();
        device.set_device_lost_callback(move |_, reason| own.lose(reason));
        let own = self.clone();
        // Without a handler, wgpu ends the program if memory runs out.
        device
            .on_uncaptured_error(Arc::new(move |error: wgpu::Error| own.note(&error.to_string())));
    }

    fn note(&self, complaint: &str) {
        self.stray
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get_or_insert_with(|| complaint.to_owned());
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
            drop(catch_unwind(AssertUnwindSafe(|| self.device.poll(wgpu::PollType::Poll))));
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
        let complaints = scopes.into_iter().rev().map(|scope| pollster::block_on(scope.pop()));
        let complaint = complaints.reduce(Option::or).flatten().map(|complaint| {
            let (name, reason) = (&self.info.name, complaint.to_string());
            Error::Driver(match complaint {
                wgpu::Error::OutOfMemory { .. } => {
                    format!("the memory of {name} ran out: {reason}")
                }
                _ => format!("{name}: {reason}"),
            })
        });
        (done, complaint)
    }

    /// Waits until the device has done all submitted work.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] if the device is lost. [`Error::Driver`] if it does not answer in time
    /// ([`Self::with_patience`]), which loses it, or if it has reported an error since the last
    /// check.
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
    fn sound(&self) -> Result<()> {
        if let Some(reason) = self.condition.lost.get() {
            return Err(Error::DeviceLost(format!("{} was lost: {reason}", self.info.name)));
        }
        match self.condition.stray.lock().unwrap_or_else(PoisonError::into_inner).take() {
            None => Ok(()),
            Some(stray) => Err(Error::Driver(stray)),
        }
    }

    /// Reads a part of a buffer back, after all earlier work.
    pub(crate) fn read(&self, buffer: &wgpu::Buffer, offset: u64, bytes: u64) -> Result<Vec<u8>> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, offset, &staging, 0, bytes);
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        // The receiver outlives the callback: it is waited for below.
        staging.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
        self.wait()?;
        // Another thread that waits for the same device may be about to call back. A lost device
        // may never call back.
        match receiver.recv_timeout(self.patience.min(CALL_BACK)) {
            Ok(Ok(())) => {}
            _ => {
                return Err(Error::DeviceLost(format!(
                    "{} did not return the requested data",
                    self.info.name
                )));
            }
        }
        let view = staging.get_mapped_range(..).map_err(|e| Error::Driver(e.to_string()))?;
        Ok(view.to_vec())
    }
}
