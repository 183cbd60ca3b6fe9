//! Remote inputs in a build without the feature `remote`: opening one is an error.

use crate::{Error, Result, input::Limits};
use std::{borrow::Cow, fs::File, ops::Range, path::Path};

#[derive(Clone)]
pub(crate) enum Remote {}

impl Remote {
    pub fn open(path: &Path, _: &Limits) -> Result<Self> {
        let message = "is an address, but this program was built without “remote”";
        let hint = "build it with the feature “remote”, or download the file and give its path";
        Err(Error::input(path, "address", message).hint(hint))
    }

    #[cfg(feature = "zarr")]
    pub fn open_if_there(path: &Path, limits: &Limits) -> Result<Option<Self>> {
        Self::open(path, limits).map(Some)
    }

    pub fn size(path: &Path) -> Result<u64> {
        Ok(Self::open(path, &Limits::default())?.len())
    }

    pub fn ready(&mut self) {
        match *self {}
    }

    pub fn name(&self) -> &Path {
        match *self {}
    }

    pub fn len(&self) -> u64 {
        match *self {}
    }

    pub fn stamp(&self) -> Option<String> {
        match *self {}
    }

    pub fn head(&self) -> Result<Cow<'static, [u8]>> {
        match *self {}
    }

    pub fn read(&self, _: Range<u64>) -> Result<Cow<'static, [u8]>> {
        match *self {}
    }

    pub fn fetch(&self, _: &[Range<u64>]) -> Result<()> {
        match *self {}
    }

    pub fn forget(&self, _: Range<u64>) {
        match *self {}
    }

    pub fn whole(&self) -> Result<File> {
        match *self {}
    }
}
