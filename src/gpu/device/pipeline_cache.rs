//! The compute pipelines of a device. Compiling one takes up to seconds, so each is compiled once,
//! and all renderers of the device share it.

use std::{
    collections::HashMap,
    sync::{Mutex, MutexGuard, PoisonError},
};

/// A compute pipeline and the layouts of its bind groups.
#[derive(Debug, Clone)]
pub(crate) struct Compiled {
    pub pipeline: wgpu::ComputePipeline,
    pub layouts: Vec<wgpu::BindGroupLayout>,
}

/// The pipelines of a device, by the hash of what they are compiled from.
#[derive(Debug, Default)]
pub(crate) struct PipelineCache(Mutex<HashMap<blake3::Hash, Compiled>>);

impl PipelineCache {
    /// Returns the pipeline of a hash, which `compile` makes if the device does not have it.
    pub fn get(&self, hash: blake3::Hash, compile: impl FnOnce() -> Compiled) -> Compiled {
        let known = self.lock().get(&hash).cloned();
        known.unwrap_or_else(|| {
            // Other threads don't wait meanwhile. At worst, two of them compile the same.
            let compiled = compile();
            self.lock().entry(hash).or_insert(compiled).clone()
        })
    }

    /// Drops all pipelines, because the device has reported an error: one that was being made may
    /// be invalid.
    pub fn forget(&self) {
        self.lock().clear();
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<blake3::Hash, Compiled>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
