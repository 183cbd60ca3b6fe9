//! Files mapped to memory, which other programs may shorten or overwrite meanwhile.
//!
//! A mapping is read like memory, at any offset and by any thread. The readers of large files rely
//! on that. The price: if the file is shortened or its disk fails, reading the mapping raises a
//! signal (SIGBUS) that ends the process. The handler in `fault` answers this signal instead: it
//! replaces the rest of the mapping with zeros and marks it. When a caller has finished reading, it
//! asks [`Mapping::change`] and discards results that were made from zeros, or from a mix of old
//! and new bytes.
//!
//! So the bytes behind `&[u8]` may change, which Rust's rules do not foresee. The code relies on
//! this: readers treat every byte as untrusted whenever they use it. Changed bytes therefore lead
//! to other results or to an error, and those results are discarded.

//!
//! Without the feature `files`, the whole file is read into memory instead.

#[cfg(all(feature = "files", any(target_os = "linux", target_os = "macos")))]
mod fault;
#[cfg(not(all(feature = "files", any(target_os = "linux", target_os = "macos"))))]
mod fault {
    //! Windows does not allow mapped files to be shortened. On other systems the signal keeps its
    //! default effect. Bytes that were read into memory do not change.

    pub struct Guard;

    impl Guard {
        pub fn new(_: &[u8]) -> Self {
            Self
        }

        pub fn is_hit(&self) -> bool {
            false
        }
    }
}
mod stamp;

#[cfg(feature = "files")]
use memmap2::Mmap;
use stamp::Stamp;
use std::{fs::File, io, ops::Deref};

#[cfg(not(feature = "files"))]
type Mmap = Vec<u8>;

/// The bytes of a file.
pub(crate) struct Mapping {
    /// `None` for an empty file. The guard comes first, so that it is dropped before the mapping it
    /// guards.
    bytes: Option<(fault::Guard, Mmap)>,
    file: File,
    /// The file's stamp when it was opened.
    opened: Stamp,
}

impl Mapping {
    pub fn new(file: File) -> io::Result<Self> {
        let opened = Stamp::of(&file)?;
        let bytes = match opened.length {
            0 => None,
            _ => Some(map(&file)?),
        };
        Ok(Self { bytes, file, opened })
    }

    /// Describes in words how the file has changed since it was opened; `None` if it has not.
    pub fn change(&self) -> Option<String> {
        if self.bytes.as_ref().is_some_and(|(guard, _)| guard.is_hit()) {
            return Some("a part of it is gone, or its disk failed".into());
        }
        // If the file can no longer be queried, what was read from it may still be right.
        self.opened.change(&Stamp::of(&self.file).ok()?)
    }

    /// Returns the pages read so far to the system. Readers of files larger than memory call this
    /// regularly. Pages that are needed again are read again.
    pub fn release(&self) {
        #[cfg(all(feature = "files", unix))]
        #[expect(unsafe_code, reason = "advice that would drop changes written to a mapping")]
        if let Some((_, map)) = &self.bytes {
            // SAFETY: the mapping is read only, backed by a file or by the zeros that `fault` put
            // there. Pages that are dropped read the same again. If the system ignores the advice,
            // nothing is lost.
            unsafe { map.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) }.ok();
        }
    }
}

#[cfg(not(feature = "files"))]
fn map(mut file: &File) -> io::Result<(fault::Guard, Mmap)> {
    let mut bytes = Vec::new();
    io::Read::read_to_end(&mut file, &mut bytes)?;
    Ok((fault::Guard::new(&bytes), bytes))
}

#[cfg(feature = "files")]
#[expect(unsafe_code, reason = "mapping a file, which others may change")]
fn map(file: &File) -> io::Result<(fault::Guard, Mmap)> {
    // SAFETY: the mapping is read only. The module's documentation explains what happens if another
    // program changes the file.
    let map = unsafe { Mmap::map(file) }?;
    Ok((fault::Guard::new(&map), map))
}

impl Deref for Mapping {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.bytes.as_ref().map_or(&[], |(_, map)| map)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::Folder;
    use std::{io::Write, path::Path};

    fn mapping(path: &Path) -> Mapping {
        Mapping::new(File::open(path).unwrap()).unwrap()
    }

    #[cfg(any(target_os = "linux", target_os = "macos"))]
    fn shorten(path: &Path, length: u64) {
        File::options().write(true).open(path).unwrap().set_len(length).unwrap();
    }

    #[test]
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    fn what_is_gone_reads_as_zeros_and_is_told() {
        let folder = Folder::new();
        let path = folder.write("a", [7; 100_000]);
        let [hit, other, away] =
            [mapping(&path), mapping(&folder.write("b", [7; 100_000])), mapping(&path)];
        assert!(hit.change().is_none() && hit[99_999] == 7);
        shorten(&path, 5000);
        assert_eq!((hit[99_999], hit[4999], hit[5001], hit[70_000]), (0, 7, 0, 0));
        hit.release();
        assert_eq!((hit[99_999], hit[4999]), (0, 7));
        assert!(hit.change().unwrap().contains("a part of it is gone"));
        // The other mappings have not been read yet; only the length shows the change.
        assert_eq!((other.change(), other[99_999]), (None, 7));
        assert!(away.change().unwrap().contains("5000 bytes"));
        // Each mapping handles its own faults, also with many threads at once, and slots are
        // reused.
        drop(hit);
        for _ in 0..100 {
            let path = folder.write("c", [7; 100_000]);
            let mapping = mapping(&path);
            shorten(&path, 0);
            std::thread::scope(|scope| {
                for part in 0..4 {
                    let mapping = &mapping;
                    scope.spawn(move || {
                        assert!(mapping[part * 25_000..][..25_000].iter().all(|&byte| byte == 0));
                    });
                }
            });
            assert!(mapping.change().unwrap().contains("a part of it is gone"));
        }
        assert_eq!((other.change(), other[50_000]), (None, 7));
    }

    #[test]
    fn files_that_grow_or_are_written_to_are_told() {
        let folder = Folder::new();
        let path = folder.write("a", [7; 5000]);
        let [grown, empty] = [mapping(&path), mapping(&folder.write("b", []))];
        assert!(grown.change().is_none() && empty.change().is_none() && empty.is_empty());
        File::options().append(true).open(&path).unwrap().write_all(&[7]).unwrap();
        assert!(grown.change().unwrap().contains("5001 bytes"));
        let written = mapping(&path);
        std::thread::sleep(std::time::Duration::from_millis(20));
        File::options().write(true).open(&path).unwrap().write_all(&[8]).unwrap();
        assert!(written.change().unwrap().contains("written to"));
        // A new file of the same name is a different file.
        let replaced = mapping(&path);
        folder.write("a", [9; 10]);
        assert!(replaced.change().is_none() && replaced.len() == 5001);
    }
}
