//! Volumes in bricks whose file comes in parts: the bricks that are there.

use super::{Brick, Bricks};
use crate::{
    Error, Result,
    input::{Bytes, Limits, Parts},
    parallel::prelude::*,
    volume::Volume,
};
use std::path::Path;

impl Bricks {
    /// Opens a file that comes in parts, which errors call `name`.
    ///
    /// # Errors
    /// Those of [`open`](Self::open); [`Error::Absent`] until the header and the root of the
    /// directory have come: the first 128 KiB.
    pub fn from_parts(parts: &Parts, name: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        Self::new(name.as_ref(), Bytes::Parts(parts.clone()), limits)
    }

    /// Returns whether its file comes in parts.
    pub(crate) fn is_in_parts(&self) -> bool {
        self.parts().is_some()
    }

    /// Returns whether its file comes in parts, and some were missed since the picture began.
    pub(crate) fn lacks(&self) -> bool {
        self.parts().is_some_and(Parts::lacks)
    }

    fn parts(&self) -> Option<&Parts> {
        self.bytes().and_then(Bytes::parts)
    }

    /// Returns whether all these bricks, by level and number, are there.
    pub(super) fn are_there(&self, bricks: &[(usize, u32)]) -> bool {
        let Some(parts) = self.parts() else { return true };
        let is_there = |&(level, brick): &(usize, u32)| {
            self.place(level, brick).is_ok_and(|range| parts.has(&range))
        };
        bricks.iter().all(is_there)
    }

    /// Asks for these bricks, of a file in parts.
    pub(super) fn ask(&self, bricks: &[(usize, u32)]) {
        // What lists the others may not have come.
        let Some(bytes) = self.bytes() else { return };
        self.fetch(bricks.iter().copied()).ok();
        let places = bricks.iter().filter_map(|&(level, brick)| self.place(level, brick).ok());
        bytes.fetch(places).ok();
    }

    /// As [`read_all`](Self::read_all), but `None` for bricks that have not come yet.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), except [`Error::Absent`].
    pub(crate) fn read_there(&self, bricks: &[(usize, u32)]) -> Result<Vec<Option<Brick>>> {
        if !self.is_in_parts() {
            return Ok(self.read_all(bricks)?.into_iter().map(Some).collect());
        }
        let read = |&(level, brick): &(usize, u32)| match self.read(level, brick) {
            Err(Error::Absent { .. }) => Ok(None),
            read => read.map(Some),
        };
        let read: Vec<_> = bricks.par_iter().map(read).collect();
        read.into_iter().collect()
    }

    /// Returns the samples of a level as [`volume`](Self::volume) does. Of a file in parts, it is
    /// the finest level up to this one that is there as a whole.
    ///
    /// # Errors
    /// Those of [`volume`](Self::volume); [`Error::Absent`] if not even the coarsest level is
    /// there.
    pub(crate) fn volume_there(&self, level: usize) -> Result<Volume> {
        if !self.is_in_parts() {
            return self.volume(level);
        }
        let mut finest = self.volume(self.levels().len() - 1)?;
        for level in (level..self.levels().len() - 1).rev() {
            match self.volume(level) {
                Ok(volume) => finest = volume,
                Err(Error::Absent { .. }) => {
                    let all = 0..self.level(level).bricks() as u32;
                    self.ask(&all.map(|brick| (level, brick)).collect::<Vec<_>>());
                }
                Err(error) => return Err(error),
            }
        }
        Ok(finest)
    }
}
