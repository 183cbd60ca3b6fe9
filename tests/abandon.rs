//! `abandon` removes unfinished files before the process ends. The test has a file of its own
//! because `abandon` acts on all threads of the process.

use splatkit::disk::{AtomicFile, abandon, write};
use std::{io::Write, time::Duration};

#[test]
fn what_is_abandoned_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    std::fs::write(&path, "old").unwrap();
    let names = || std::fs::read_dir(folder.path()).unwrap().count();
    let mut file = AtomicFile::create(&path).unwrap();
    file.write_all(b"new").unwrap();
    assert_eq!(names(), 2);
    let abandoned = abandon();
    assert_eq!(names(), 1);
    std::thread::scope(|scope| {
        let others = scope.spawn(|| (file.commit().is_err(), write(&path, b"newer").is_ok()));
        std::thread::sleep(Duration::from_millis(50));
        // No new file appears while `abandoned` is held.
        assert_eq!((names(), std::fs::read(&path).unwrap()), (1, b"old".to_vec()));
        drop(abandoned);
        assert_eq!(others.join().unwrap(), (true, true));
    });
    assert_eq!((names(), std::fs::read(&path).unwrap()), (1, b"newer".to_vec()));
}
