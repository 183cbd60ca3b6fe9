//! A process that is about to end does away with what is on its way: alone in its file, for it does so for all its threads.

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
        // As long as it is held nothing comes up.
        assert_eq!((names(), std::fs::read(&path).unwrap()), (1, b"old".to_vec()));
        drop(abandoned);
        assert_eq!(others.join().unwrap(), (true, true));
    });
    assert_eq!((names(), std::fs::read(&path).unwrap()), (1, b"newer".to_vec()));
}
