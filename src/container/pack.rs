//! Packs and unpacks bytes by zstd, which is C code and comes with the feature `files`.

#[cfg(not(feature = "files"))]
pub use absent::{Compressor, compress, decompress};
#[cfg(feature = "files")]
pub use zstd::bulk::{Compressor, compress, decompress};

/// The calls of zstd that this library makes, in builds without it: each is an error.
#[cfg(not(feature = "files"))]
mod absent {
    use std::io::{Error, ErrorKind, Result};

    pub struct Compressor;

    impl Compressor {
        pub fn new(_: i32) -> Result<Self> {
            none()
        }

        pub fn compress(&mut self, _: &[u8]) -> Result<Vec<u8>> {
            none()
        }
    }

    pub fn compress(_: &[u8], _: i32) -> Result<Vec<u8>> {
        none()
    }

    pub fn decompress(_: &[u8], _: usize) -> Result<Vec<u8>> {
        none()
    }

    fn none<T>() -> Result<T> {
        let message = "zstd comes with the feature “files” of the crate splatkit, and this \
                       program was built without";
        Err(Error::new(ErrorKind::Unsupported, message))
    }
}
