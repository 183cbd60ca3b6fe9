//! Stops every writer at each of its steps.

use super::{
    AtomicFile, TemporaryFolder,
    faults::{self, Fault},
    step::Step,
    write,
};
use crate::{
    Error, Result, bricks,
    formats::{Endian, RawLayout, SampleType, VolumeStream, nrrd, ply},
    hierarchy::{
        self,
        external::{self, ExternalOptions},
        file,
        testing::{surface, tree},
    },
    input::{Limits, testing::Folder},
    picture::Picture,
    surface::{Mesh, SurfelOptions},
    volume::{Lattice, Volume, phantoms::Phantom},
};
use glam::DVec3;
use std::{io::Write, path::Path};

const OLD: &[u8] = b"what was there before";

/// The names in a folder, except for inputs, whose names begin with “in.”.
fn names(folder: &Folder) -> Vec<String> {
    let mut names = folder.names();
    names.retain(|name| !name.starts_with("in."));
    names
}

/// Stops a writer at each of its steps in both ways, alternately with and without an existing file.
/// Returns the number of stops.
fn stop_everywhere(name: &str, writer: impl Fn(&Path) -> Result<()>) -> usize {
    let folder = Folder::new();
    let path = folder.path(name);
    let (done, steps) = faults::with(None, || writer(&path));
    done.unwrap();
    let new = std::fs::read(&path).unwrap();
    // What a power cut may leave: the content must reach the disk before the name does, and the
    // name last.
    let at = |step| steps.iter().position(|&s| s == step).unwrap();
    let last_write = steps.iter().rposition(|&step| step == Step::Write).unwrap();
    assert!(last_write < at(Step::Sync) && at(Step::Sync) < at(Step::Rename), "{name}: {steps:?}");
    assert!(at(Step::Rename) < at(Step::SyncFolder), "{name}: {steps:?}");
    for (at, &step) in steps.iter().enumerate() {
        for fault in [Fault::Full, Fault::Killed] {
            let old = ((at % 2 == 0) == (fault == Fault::Full)).then_some(OLD);
            match old {
                None => std::fs::remove_file(&path).unwrap_or_default(),
                Some(old) => std::fs::write(&path, old).unwrap(),
            }
            let case = format!("{name}: {fault:?}, {step:?}, step {at} of {}", steps.len());
            let (done, _) = faults::with(Some((at, fault)), || writer(&path));
            let content = std::fs::read(&path).ok();
            if fault == Fault::Full {
                match done {
                    // Nothing is lost if the folder could not be synced.
                    Ok(()) => {
                        assert!(
                            step == Step::SyncFolder && content.as_ref() == Some(&new),
                            "{case}"
                        );
                    }
                    Err(error) => {
                        assert_eq!(content.as_deref(), old, "{case}");
                        assert!(error.to_string().contains(name), "{case}: {error}");
                        assert!(
                            matches!(error, Error::Output { .. }) || step == Step::Read,
                            "{case}: {error}"
                        );
                    }
                }
                assert!(names(&folder).iter().all(|n| n == name), "{case}: {:?}", names(&folder));
                continue;
            }
            assert!(content.as_deref() == old || content.as_ref() == Some(&new), "{case}");
            for left in names(&folder).iter().filter(|left| *left != name) {
                assert!(
                    left.starts_with(&format!(".{name}.")) && left.ends_with(".splatkit-part"),
                    "{case}: {left}"
                );
                let bytes = std::fs::read(folder.path(left)).unwrap();
                assert!(bytes == new || !is_read(name, bytes), "{case}");
            }
            writer(&path).unwrap();
            assert!(std::fs::read(&path).unwrap() == new, "{case}");
            assert_eq!(names(&folder), [name], "{case}");
        }
    }
    println!("{name}: stopped {} times", 2 * steps.len());
    2 * steps.len()
}

/// Returns whether the bytes are readable as a hierarchy or a volume in bricks.
fn is_read(name: &str, bytes: Vec<u8>) -> bool {
    let name = Path::new(name);
    match name.extension().and_then(|extension| extension.to_str()) {
        Some("splk") => hierarchy::Hierarchy::from_bytes(bytes, name, &Limits::default()).is_ok(),
        Some("splv") => bricks::Bricks::from_bytes(bytes, name).is_ok(),
        _ => false,
    }
}

fn volume() -> Volume {
    Phantom::named("ball").unwrap().sample([40, 3, 20]).unwrap()
}

#[test]
fn hierarchies_are_whole_or_not_there() {
    let tree = tree(&surface(500, 1));
    let stops =
        stop_everywhere("a.splk", |path| file::write(&tree, path, &file::WriteOptions::default()));
    assert!(stops >= 12, "{stops}");
}

#[test]
fn hierarchies_made_in_regions_are_whole_or_not_there() {
    let inputs = Folder::new();
    let input = inputs.path("in.ply");
    // Triangles as coarse as these would be subdivided into very many.
    ply::write(&Mesh { triangles: Vec::new(), normals: Vec::new(), ..Mesh::sphere(3) }, &input)
        .unwrap();
    let options = ExternalOptions {
        memory: 1,
        preset: hierarchy::Preset::Fastest,
        block_splats: 1 << 7,
        surfels: SurfelOptions::default(),
        paint: None,
        scalar: None,
        parts: None,
    };
    let stops = stop_everywhere("b.splk", |path| {
        let write = file::WriteOptions::default();
        let files = [input.clone()];
        external::convert(&files, &Limits::default(), path, &options, &write, None).map(|_| ())
    });
    assert!(stops >= 12, "{stops}");
}

#[test]
fn volumes_in_bricks_are_whole_or_not_there() {
    let volume = volume();
    let options = bricks::WriteOptions::default();
    let stops = stop_everywhere("a.splv", |path| bricks::write(&volume, path, &options, None));
    assert!(stops >= 12, "{stops}");
    let inputs = Folder::new();
    let input = inputs.write("in.raw", volume.samples.bytes());
    let sample_type = SampleType::from_name(volume.samples.type_name()).unwrap();
    let (dims, spacing) = (volume.lattice.dims, DVec3::ONE);
    let layout = RawLayout { dims, sample_type, spacing, endian: Endian::Little, header: 0 };
    let stream = VolumeStream::open(&input, &Limits::default(), Some(&layout)).unwrap().unwrap();
    let stops = stop_everywhere("b.splv", |path| {
        bricks::convert(&stream, volume.range, path, &options, None)
    });
    assert!(stops >= 12, "{stops}");
}

#[test]
fn other_files_are_whole_or_not_there() {
    let (mesh, volume) = (Mesh::sphere(2), volume());
    let mut set = mesh.surfels(&SurfelOptions::default()).unwrap();
    set.splats.truncate(300);
    let color = (0..64 * 64).map(|i| [(i * 37 % 101) as f32 / 101.0, 0.3, 0.1, 1.0]).collect();
    let picture = Picture { width: 64, height: 64, color, depth: Vec::new() };
    let lattice = Lattice::with_spacing([30, 3, 9], DVec3::ONE);
    let stops = [
        stop_everywhere("a.ply", |path| ply::write(&mesh, path)),
        stop_everywhere("gaussians.ply", |path| {
            ply::write_gaussians(&crate::gaussians::Gaussians::from_splats(&set)?, path)
        }),
        stop_everywhere("a.nrrd", |path| nrrd::write(&volume, path)),
        stop_everywhere("bytes.nrrd", |path| {
            nrrd::write_bytes(&lattice, path, |k| vec![k as u8; 90])
        }),
        stop_everywhere("a.png", |path| picture.save(path, None)),
        stop_everywhere("a.jpg", |path| picture.save(path, None)),
        stop_everywhere("report.json", |path| write(path, br#"{"adapter": "none"}"#)),
        stop_everywhere("report.md", |path| write(path, &b"| a |\n".repeat(1000))),
    ];
    assert!(
        stops.iter().all(|&stops| stops >= 12) && stops.iter().sum::<usize>() > 300,
        "{stops:?}"
    );
}

#[test]
fn several_write_one_file_and_the_last_one_stays() {
    let folder = Folder::new();
    let path = folder.path("a.txt");
    let mut files: Vec<AtomicFile> = (0..3).map(|_| AtomicFile::create(&path).unwrap()).collect();
    for (number, file) in files.iter_mut().enumerate() {
        write!(file, "{number}").unwrap();
    }
    // A file in progress is not taken for a leftover.
    assert_eq!(names(&folder).len(), 3);
    drop(files.remove(0));
    for (file, content) in files.into_iter().zip(["1", "2"]) {
        file.commit().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), content);
    }
    assert_eq!(names(&folder), ["a.txt"]);
}

#[test]
fn what_is_there_is_left_as_it_is() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("a.png")).unwrap();
    for (name, message) in
        [("a.png", "that is not a regular file"), ("none/a.png", "a.png: cannot be written")]
    {
        let error = write(&folder.path(name), b"new").unwrap_err();
        assert!(
            matches!(error, Error::Output { .. }) && error.to_string().contains(message),
            "{error}"
        );
    }
    assert_eq!(names(&folder), ["a.png"]);
    // A folder and a link that have the names of leftovers.
    let path = folder.path("b.txt");
    std::fs::create_dir(folder.path(".b.txt.0.splatkit-part")).unwrap();
    let other = folder.write("other", OLD);
    #[cfg(unix)]
    std::os::unix::fs::symlink(&other, folder.path(".b.txt.1.splatkit-part")).unwrap();
    write(&path, b"new").unwrap();
    assert_eq!(std::fs::read(other).unwrap(), OLD);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The permissions do not change.
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
        write(&path, b"newer").unwrap();
        assert_eq!(path.metadata().unwrap().permissions().mode() & 0o777, 0o600);
    }
    // A name too long for a suffix.
    let long = folder.path(format!("{}.txt", "ö".repeat(120)));
    write(&long, b"new").unwrap();
    assert_eq!(std::fs::read(&long).unwrap(), b"new");
}

/// Two processes take the same leftover for stale. The slower one locks it after the faster one has
/// created its own file under that name.
#[cfg(unix)]
#[test]
fn a_new_part_is_not_taken_for_the_leftover_before_it() {
    let folder = Folder::new();
    let path = folder.path("a.txt");
    let part = folder.write(".a.txt.0.splatkit-part", OLD);
    let mut is_first = true;
    let (name, wanted) = (part.clone(), path.clone());
    faults::against(
        move |moment, at| {
            if moment == "locked" && at == name && std::mem::take(&mut is_first) {
                std::fs::remove_file(at).unwrap();
                let file = std::fs::File::options().write(true).create_new(true).open(at).unwrap();
                file.lock().unwrap();
                (&file).write_all(b"of another process").unwrap();
                // The lock is held as long as this process lives.
                std::mem::forget(file);
            }
            assert!(at.starts_with(wanted.parent().unwrap()));
        },
        || write(&path, b"new").unwrap(),
    );
    assert_eq!(std::fs::read(&part).unwrap(), b"of another process");
    assert_eq!(std::fs::read(&path).unwrap(), b"new");
}

/// Another process took the temporary file for stale before it was locked, and replaced it with its
/// own. It is not written to by name.
#[cfg(unix)]
#[test]
fn a_part_that_was_replaced_is_not_used() {
    let folder = Folder::new();
    let path = folder.path("a.txt");
    let part = folder.path(".a.txt.0.splatkit-part");
    let name = part.clone();
    faults::against(
        move |moment, at| {
            if moment == "created" && at == name {
                std::fs::remove_file(at).unwrap();
                std::fs::write(at, b"of another process").unwrap();
            }
        },
        || write(&path, b"new").unwrap(),
    );
    assert_eq!(std::fs::read(&part).unwrap(), b"of another process");
    assert_eq!(std::fs::read(&path).unwrap(), b"new");
}

/// Only what was written is renamed: if another program replaced the temporary file meanwhile, that
/// is an error.
#[cfg(unix)]
#[test]
fn a_part_that_is_replaced_while_it_is_written_is_an_error() {
    let folder = Folder::new();
    let path = folder.write("a.txt", OLD);
    let part = folder.path(".a.txt.0.splatkit-part");
    let mut file = AtomicFile::create(&path).unwrap();
    file.write_all(b"new").unwrap();
    std::fs::remove_file(&part).unwrap();
    std::fs::write(&part, b"half").unwrap();
    let error = file.commit().unwrap_err().to_string();
    assert!(
        error.contains("a.txt.0.splatkit-part was removed or replaced by another program"),
        "{error}"
    );
    assert_eq!(std::fs::read(&path).unwrap(), OLD);
}

#[cfg(unix)]
#[test]
fn nobody_reads_a_part_who_may_not_read_the_file() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    let folder = Folder::new();
    let path = folder.write("a.txt", OLD);
    let part = folder.path(".a.txt.0.splatkit-part");
    for mode in [0o600, 0o640, 0o400, 0o664] {
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
        // The permissions at creation.
        let at = part.clone();
        let first = std::rc::Rc::new(std::cell::Cell::new(0));
        let seen = first.clone();
        let file = faults::against(
            move |moment, path| {
                if moment == "created" {
                    assert_eq!(path, at);
                    seen.set(path.metadata().unwrap().mode() & 0o777);
                }
            },
            || AtomicFile::create(&path).unwrap(),
        );
        assert_eq!(first.get() & !(mode | 0o600), 0, "{mode:o}: {:o}", first.get());
        assert_eq!(part.metadata().unwrap().mode() & 0o777, mode, "{mode:o}");
        file.commit().unwrap();
        assert_eq!(path.metadata().unwrap().mode() & 0o777, mode, "{mode:o}");
    }
}

#[cfg(unix)]
#[test]
fn links_stay_and_what_they_lead_to_is_written() {
    use std::os::unix::fs::symlink;
    let (folder, other) = (Folder::new(), Folder::new());
    let target = other.write("target.txt", OLD);
    let [one, two, nowhere, round] =
        ["one.txt", "two.txt", "nowhere.txt", "round.txt"].map(|name| folder.path(name));
    symlink(&target, &one).unwrap();
    symlink("one.txt", &two).unwrap();
    symlink(other.path("none.txt"), &nowhere).unwrap();
    symlink("round.txt", &round).unwrap();
    for (link, content) in [(&one, "first"), (&two, "second")] {
        let file = AtomicFile::create(link).unwrap();
        // The temporary file must be where it can be renamed: beside the target, which may be on
        // another disk than the link.
        assert_eq!(names(&folder).len(), 4);
        assert_eq!(names(&other), [".target.txt.0.splatkit-part", "target.txt"]);
        drop(file);
        write(link, content.as_bytes()).unwrap();
        assert!(link.is_symlink());
        assert_eq!(std::fs::read_to_string(&target).unwrap(), content);
    }
    for link in [&nowhere, &round] {
        let error = write(link, b"new").unwrap_err().to_string();
        assert!(error.contains(&*link.to_string_lossy()), "{error}");
        assert!(
            link == &round || error.contains("a symbolic link to a file that does not exist"),
            "{error}"
        );
        assert!(link.is_symlink());
    }
    assert_eq!(names(&other), ["target.txt"]);
}

/// Several threads write one file at once. Each write succeeds, and a reader always finds a whole
/// file.
#[test]
fn writers_at_once_leave_a_whole_file() {
    let folder = Folder::new();
    let path = folder.path("a.bin");
    std::thread::scope(|scope| {
        for writer in 0..8u8 {
            let path = &path;
            scope.spawn(move || (0..50).for_each(|_| write(path, &vec![writer; 5000]).unwrap()));
        }
        for _ in 0..200 {
            if let Ok(bytes) = std::fs::read(&path) {
                assert!(bytes.len() == 5000 && bytes.iter().all(|&byte| byte == bytes[0]));
            }
        }
    });
    assert_eq!(names(&folder), ["a.bin"]);
}

#[test]
fn what_appears_meanwhile_is_kept() {
    let folder = Folder::new();
    let path = folder.path("a.txt");
    // Of ten writers of a new name, one wins, and nine say so.
    super::may_replace(&path, false);
    let files: Vec<_> = (0..10).map(|_| AtomicFile::create(&path).unwrap()).collect();
    let barrier = std::sync::Barrier::new(files.len());
    let done: Vec<(usize, Result<()>)> = std::thread::scope(|threads| {
        let write = |(number, mut file): (usize, AtomicFile)| {
            let barrier = &barrier;
            threads.spawn(move || {
                file.write_all(number.to_string().as_bytes()).unwrap();
                barrier.wait();
                (number, file.commit())
            })
        };
        let threads: Vec<_> = files.into_iter().enumerate().map(write).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    let won: Vec<usize> =
        done.iter().filter(|(_, done)| done.is_ok()).map(|(number, _)| *number).collect();
    assert_eq!(won.len(), 1, "{done:?}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), won[0].to_string());
    for (_, error) in done.into_iter().filter(|(_, done)| done.is_err()) {
        let message = error.unwrap_err().to_string();
        assert!(message.contains("a.txt") && message.contains("appeared"), "{message}");
    }
    assert_eq!(names(&folder), ["a.txt"]);
}

#[test]
fn nothing_that_appears_is_replaced() {
    let folder = Folder::new();
    folder.write("target.txt", OLD);
    for kind in ["folder", "file", "link"] {
        let path = folder.path(kind);
        super::may_replace(&path, false);
        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(b"new").unwrap();
        match kind {
            "folder" => std::fs::create_dir(&path).unwrap(),
            #[cfg(unix)]
            "link" => std::os::unix::fs::symlink(folder.path("target.txt"), &path).unwrap(),
            _ => std::fs::write(&path, OLD).unwrap(),
        }
        let before = path.symlink_metadata().unwrap().file_type();
        file.commit().unwrap_err();
        assert_eq!(path.symlink_metadata().unwrap().file_type(), before, "{kind}");
        // Begun again, it ends before the work.
        assert!(AtomicFile::create(&path).is_err(), "{kind}");
    }
    for kept in ["target.txt", "file"] {
        assert_eq!(std::fs::read(folder.path(kept)).unwrap(), OLD);
    }
    // What is allowed again replaces.
    super::may_replace(folder.path("file"), true);
    write(&folder.path("file"), b"new").unwrap();
    assert_eq!(std::fs::read(folder.path("file")).unwrap(), b"new");
}

#[test]
fn a_temporary_folder_goes_with_its_owner() {
    let [first, second] = [TemporaryFolder::new().unwrap(), TemporaryFolder::new().unwrap()];
    assert_ne!(first.path(), second.path());
    let file = first.path().join("a.ply");
    std::fs::write(&file, OLD).unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = first.path().metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "{mode:o}");
    }
    let path = first.path().to_owned();
    drop(first);
    assert!(!path.exists() && second.path().is_dir());
}
