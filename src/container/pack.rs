//! Packs and unpacks bytes by zstd, which is C code and comes with the feature `files`. In
//! browsers, Rust code unpacks them.

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

    #[cfg(not(target_family = "wasm"))]
    pub fn decompress(_: &[u8], _: usize) -> Result<Vec<u8>> {
        none()
    }

    /// Unpacks at most so many bytes.
    #[cfg(target_family = "wasm")]
    pub fn decompress(packed: &[u8], most: usize) -> Result<Vec<u8>> {
        use std::io::Read;
        let broken = |error: &dyn std::fmt::Display| Error::other(error.to_string());
        let decoder = ruzstd::decoding::StreamingDecoder::new(packed);
        let decoder = decoder.map_err(|error| broken(&error))?;
        let mut bytes = Vec::new();
        decoder.take(most as u64 + 1).read_to_end(&mut bytes)?;
        if bytes.len() > most {
            return Err(broken(&format_args!("there are more than {most} bytes")));
        }
        Ok(bytes)
    }

    fn none<T>() -> Result<T> {
        let message = "zstd comes with the feature “files” of the crate splatkit, and this \
                       program was built without";
        Err(Error::new(ErrorKind::Unsupported, message))
    }
}
