//! Runs every input that once broke something through the entry points of the fuzz targets. All
//! inputs are small and of our own making.
//!
//! `tests/regressions/<format>/` holds the inputs; `tools/fuzz` finds them. To add one, minimise it
//! (`cargo fuzz tmin`), give it a name that says what was wrong, and put it there.

#[path = "../regressions/oracle.rs"]
mod oracle;

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// Time limit: far more than any input takes, to catch an input that hangs.
const MOST_TIME: Duration = Duration::from_secs(20);

fn inputs(format: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regressions").join(format);
    let entries = fs::read_dir(folder).into_iter().flatten();
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| entry.expect("a readable folder").path()).collect();
    paths.sort();
    paths
}

#[test]
fn what_broke_once_holds() {
    for (format, check) in oracle::FORMATS {
        for path in inputs(format) {
            let bytes = fs::read(&path).expect("a readable file");
            println!("{}", path.display());
            let start = Instant::now();
            check(&bytes);
            assert!(start.elapsed() < MOST_TIME, "{} took {:?}", path.display(), start.elapsed());
        }
    }
}

/// Empty inputs and inputs of one byte break no format.
#[test]
fn nothing_and_little() {
    for (_, check) in oracle::FORMATS {
        check(&[]);
        (0..=255).for_each(|byte| check(&[byte]));
    }
}

#[test]
fn every_folder_has_its_format() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regressions");
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("a readable folder").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        assert!(
            path.is_file() || oracle::FORMATS.iter().any(|(format, _)| *format == name),
            "the folder {name} has no format of its name"
        );
    }
}
