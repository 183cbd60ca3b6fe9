//! The bricks of a volume that are at hand.

use crate::{
    Result,
    math::Kernel,
    volume::bricks::{Brick, Bricks, Choice},
};
use rayon::prelude::*;
use std::{collections::HashMap, sync::Arc};

/// A brick's level and number.
type Key = (usize, u32);

#[derive(Debug)]
pub struct BrickCache {
    pub bricks: Arc<Bricks>,
    pub kernel: Kernel,
    held: HashMap<Key, (Brick, u64)>,
    update: u64,
    /// Bricks read so far.
    pub reads: u64,
}

impl BrickCache {
    pub fn new(bricks: &Arc<Bricks>, kernel: &Kernel) -> Self {
        Self { bricks: bricks.clone(), kernel: kernel.clone(), held: HashMap::new(), update: 0, reads: 0 }
    }

    pub fn get(&self, level: usize, brick: u32) -> Option<&Brick> {
        self.held.get(&(level, brick)).map(|(brick, _)| brick)
    }

    pub fn bytes(&self) -> u64 {
        (self.held.len() * (self.bricks.brick_bytes() + size_of::<Brick>())) as u64
    }

    /// Reads the bricks of a choice. Of the others those stay that were needed last, as many as the choice holds.
    pub fn update(&mut self, choice: &Choice) -> Result<()> {
        self.update += 1;
        let absent: Vec<Key> = choice.bricks.iter().copied().filter(|key| !self.held.contains_key(key)).collect();
        for key in &choice.bricks {
            if let Some((_, last)) = self.held.get_mut(key) {
                *last = self.update;
            }
        }
        let mut others: Vec<(u64, Key)> = self
            .held
            .iter()
            .filter(|(_, (_, last))| *last < self.update)
            .map(|(key, (_, last))| (*last, *key))
            .collect();
        others.sort_unstable();
        for (_, key) in others.iter().take(others.len().saturating_sub(choice.bricks.len())) {
            self.held.remove(key);
        }
        let read: Vec<Brick> =
            absent.par_iter().map(|&(level, brick)| self.bricks.read(level, brick)).collect::<Result<_>>()?;
        self.reads += read.len() as u64;
        self.held.extend(absent.into_iter().zip(read.into_iter().map(|brick| (brick, self.update))));
        Ok(())
    }
}
