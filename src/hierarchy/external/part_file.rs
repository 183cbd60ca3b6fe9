//! The files of finished parts: a header, the pages of all blocks, a description of the blocks, and
//! a seal. The seal is the hash of all but the pages, which have a checksum each.

use super::made::{Made, PartWriter};
use crate::{
    Error, Result,
    container::{Cursor, Put},
    disk::AtomicFile,
};
use std::{
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

/// The first bytes of a part, with the version of its layout.
const MAGIC: [u8; 8] = *b"SPLKPRT1";
/// The first bytes, the number of the part, and the hash of its plan.
const HEADER: usize = 8 + 4 + 32;
/// Where the description of the blocks begins, and the hash.
const SEAL: usize = 8 + 32;

/// Which part of which plan a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label {
    pub plan: [u8; 32],
    pub index: u32,
}

/// A finished part.
#[derive(Debug, Clone, PartialEq)]
pub struct PartFile {
    pub path: PathBuf,
    /// The length of the file.
    pub bytes: u64,
    pub made: Made,
}

impl Label {
    fn header(&self) -> Vec<u8> {
        let mut header = MAGIC.to_vec();
        header.u32(self.index);
        header.put(&self.plan);
        header
    }
}

/// Begins a part at a path. Nothing is there until [`finish`] has written all of it.
pub fn begin(path: &Path, label: Label, is_lossless: bool) -> Result<PartWriter<AtomicFile>> {
    let mut part = PartWriter::new(AtomicFile::create(path)?, is_lossless, path);
    part.put(&label.header())?;
    Ok(part)
}

/// Writes the rest of a part, and gives the file its name. Returns its length.
pub fn finish(mut part: PartWriter<AtomicFile>, label: Label) -> Result<u64> {
    let about = part.made.to_bytes();
    let start = part.put(&about)?;
    part.put(&start.to_le_bytes())?;
    part.put(&seal(&label.header(), &about, start))?;
    let (file, bytes, _) = part.end()?;
    file.commit()?;
    Ok(bytes)
}

fn seal(header: &[u8], about: &[u8], start: u64) -> [u8; 32] {
    let mut hash = blake3::Hasher::new();
    hash.update(header).update(about).update(&start.to_le_bytes());
    *hash.finalize().as_bytes()
}

impl PartFile {
    /// Opens a finished part, without reading its pages. The inner error says what is wrong with
    /// the file.
    ///
    /// # Errors
    /// [`Error::File`] if the file is there but cannot be read.
    pub fn open(path: &Path, label: Label) -> Result<Result<Self, String>> {
        let mut file = match File::open(path) {
            Ok(file) => file,
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Err("is missing".into())),
            Err(e) => return Err(Error::file(path, "open", e)),
        };
        match Self::read(&mut file, path, label) {
            Ok(part) => Ok(part.map_err(Into::into)),
            Err(e) => Err(Error::file(path, "read", e)),
        }
    }

    fn read(file: &mut File, path: &Path, label: Label) -> io::Result<Result<Self, &'static str>> {
        const CUT: Result<PartFile, &str> = Err("is cut or damaged");
        let bytes = file.seek(SeekFrom::End(0))?;
        if bytes < (HEADER + SEAL) as u64 {
            return Ok(CUT);
        }
        let mut header = [0; HEADER];
        file.seek(SeekFrom::Start(0))?;
        file.read_exact(&mut header)?;
        if header[..] != label.header() {
            let is_part = header.starts_with(&MAGIC);
            return Ok(if is_part { Err("belongs to another plan or part") } else { CUT });
        }
        let mut end = [0; SEAL];
        file.seek(SeekFrom::Start(bytes - SEAL as u64))?;
        file.read_exact(&mut end)?;
        let start = Cursor::new(&end).u64().unwrap_or(u64::MAX);
        let Some(length) = (bytes - SEAL as u64).checked_sub(start) else { return Ok(CUT) };
        file.seek(SeekFrom::Start(start))?;
        // It takes memory as it is there, whatever the length of the file says.
        let mut about = Vec::new();
        Read::by_ref(file).take(length).read_to_end(&mut about)?;
        if about.len() as u64 != length || seal(&header, &about, start) != end[8..] {
            return Ok(CUT);
        }
        // The seal only says that nobody has changed it by accident.
        let Some(made) =
            Made::from_bytes(&about).filter(|made| made.is_sound(HEADER as u64..start))
        else {
            return Ok(CUT);
        };
        Ok(Ok(Self { path: path.to_owned(), bytes, made }))
    }

    /// Returns whether every page is as it was written.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read.
    pub fn is_intact(&self) -> Result<bool> {
        let all = || -> io::Result<bool> {
            let mut file = BufReader::with_capacity(1 << 20, File::open(&self.path)?);
            let (mut at, mut page) = (0, Vec::new());
            for place in self.made.blocks.iter().flat_map(|block| &block.places) {
                file.seek_relative(place.offset as i64 - at)?;
                page.resize(place.bytes as usize, 0);
                file.read_exact(&mut page)?;
                at = (place.offset + u64::from(place.bytes)) as i64;
                if crc32fast::hash(&page) != place.crc {
                    return Ok(false);
                }
            }
            Ok(true)
        };
        all().map_err(|e| Error::file(&self.path, "read", e))
    }
}

#[cfg(test)]
impl Label {
    /// Returns the label of a part.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        let index = u32::from_le_bytes(bytes[8..12].try_into().unwrap());
        Self { plan: bytes[12..HEADER].try_into().unwrap(), index }
    }

    /// Seals a part whose description was changed.
    pub fn seal_again(self, bytes: &mut [u8]) {
        let (about, at) = (about(bytes), bytes.len() - SEAL + 8);
        let start = about.start as u64;
        let seal = seal(&self.header(), &bytes[about], start);
        bytes[at..].copy_from_slice(&seal);
    }
}

/// Returns where the description of the blocks is in a part.
#[cfg(test)]
pub fn about(bytes: &[u8]) -> std::ops::Range<usize> {
    let end = bytes.len() - SEAL;
    u64::from_le_bytes(bytes[end..end + 8].try_into().unwrap()) as usize..end
}
