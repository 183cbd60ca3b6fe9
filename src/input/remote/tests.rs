//! Objects on a server of the loopback: what is asked for, what is kept, and every fault.

#[path = "behaviours.rs"]
mod behaviours;
#[path = "../../../tests/testing/server.rs"]
mod server;

use super::*;
use crate::input::testing::Folder;
use server::{Fault, Server};

/// An object without repeated blocks.
fn object(size: usize) -> Vec<u8> {
    (0..size as u32).map(|at| (at.wrapping_mul(2_654_435_761) >> 13) as u8).collect()
}

fn impatient() -> Patience {
    Patience {
        connect: Duration::from_millis(500),
        read: Duration::from_millis(300),
        answer: Duration::from_secs(5),
        retries: 2,
        first_pause: Duration::from_millis(5),
    }
}

fn cache(folder: &Folder, bytes: u64) -> Cache {
    Cache { folder: folder.path("cache"), bytes }
}

fn open(server: &Server, cache: Cache) -> Result<Remote> {
    opened(Path::new(&server.address("a.splk")), cache)
}

fn opened(path: &Path, cache: Cache) -> Result<Remote> {
    Remote::open_in(path, (cache, impatient()), &Limits::default(), Link::parts)
}

/// The error as a user sees it: the message and the hint.
fn error_text<T>(result: Result<T>) -> String {
    match result.err().expect("an error") {
        error @ Error::Input { .. } => {
            let Error::Input { hint, .. } = &error else { unreachable!() };
            format!("{error}; {}", hint.as_deref().unwrap_or_default())
        }
        other => other.to_string(),
    }
}

const MIB: u64 = 1 << 20;

#[test]
fn ranges_are_joined_and_kept() {
    let (folder, bytes) = (Folder::new(), object(12 << 20));
    let server = Server::of(bytes.clone());
    let remote = open(&server, cache(&folder, 1 << 30)).unwrap();
    assert_eq!((remote.len(), server.asked()), (12 * MIB, vec![0..FIRST]));
    // Within the first bytes, nothing is asked.
    assert_eq!(&remote.read(5..70_000).unwrap()[..], &bytes[5..70_000]);
    assert!(server.asked().is_empty());
    // A gap below 1 MiB is one request; a larger one, two.
    remote.fetch(&[MIB..MIB + 10, MIB + 700_000..MIB + 800_000, 5 * MIB..5 * MIB + 1]).unwrap();
    let mut asked = server.asked();
    asked.sort_by_key(|range| range.start);
    assert_eq!(asked, [MIB..MIB + 13 * BLOCK, 5 * MIB..5 * MIB + BLOCK]);
    for range in [MIB..MIB + 10, MIB + 600_000..MIB + 800_000, 5 * MIB + 3..5 * MIB + 9] {
        let wanted = &bytes[range.start as usize..range.end as usize];
        assert_eq!(&remote.read(range).unwrap()[..], wanted);
    }
    assert!(server.asked().is_empty());
    // The end is a short block.
    assert_eq!(&remote.read(12 * MIB - 3..12 * MIB).unwrap()[..], &bytes[bytes.len() - 3..]);
    // Another process finds all of it on disk.
    server.asked();
    let other = open(&server, cache(&folder, 1 << 30)).unwrap();
    assert_eq!(&other.read(MIB + 5..MIB + 9).unwrap()[..], &bytes[MIB as usize + 5..][..4]);
    assert_eq!(server.asked(), [0..FIRST]);
}

#[test]
fn few_requests_run_at_once() {
    let server = Server::of(object(20 << 20));
    server.slow(Duration::from_millis(20), None);
    let remote = open(&server, cache(&Folder::new(), 0)).unwrap();
    let apart: Vec<_> = (0..12).map(|at| at * 3 * MIB / 2..at * 3 * MIB / 2 + 10).collect();
    remote.fetch(&apart).unwrap();
    assert!((2..=8).contains(&server.most_at_once()), "{}", server.most_at_once());
    assert_eq!(server.asked().len(), 12);
}

#[test]
fn faults_that_pass_are_repeated() {
    let bytes = object(2 << 20);
    let server = Server::of(bytes.clone());
    for tag in [Some("\"a\""), None] {
        for fault in [Fault::Status(500), Fault::Status(503), Fault::Cut(100), Fault::Stall] {
            server.tag(tag);
            server.fail(move |number, _| if number == 1 { fault } else { Fault::None });
            server.asked();
            let remote = open(&server, cache(&Folder::new(), 0)).unwrap();
            let read = remote.read(MIB..MIB + 70_000);
            assert_eq!(&read.unwrap()[..], &bytes[1 << 20..][..70_000], "{fault:?} {tag:?}");
            assert!(server.asked().len() > 2, "{fault:?}");
        }
    }
}

#[test]
fn faults_that_stay_are_clear() {
    let server = Server::of(object(2 << 20));
    for (fault, words) in [
        (Fault::Status(404), "no such object (404); check the address"),
        (Fault::Status(403), "refuses access"),
        (Fault::Status(401), "refuses access"),
        (Fault::Status(500), "500"),
        (Fault::Whole, "does not support ranges: asked for a part, it sent the whole object"),
        (Fault::Cut(1000), "the server cannot be read"),
        (Fault::Stall, "the server cannot be read"),
    ] {
        let begun = Instant::now();
        server.fail(move |_, _| fault);
        let error = error_text(open(&server, cache(&Folder::new(), 0)));
        assert!(error.contains(words) && error.contains("a.splk: bytes 0 to 262144"), "{error}");
        // The same once the object is open.
        server.asked();
        server.fail(move |number, _| if number == 0 { Fault::None } else { fault });
        let remote = open(&server, cache(&Folder::new(), 0)).unwrap();
        let error = error_text(remote.read(MIB..MIB + 3));
        assert!(error.contains(words), "{error}");
        assert!(begun.elapsed() < Duration::from_secs(20), "{fault:?}");
    }
    let gone = server.address("b.splk");
    drop(server);
    std::thread::sleep(Duration::from_millis(50));
    let error = error_text(opened(Path::new(&gone), Cache::default()));
    assert!(error.contains("the server cannot be read"), "{error}");
}

#[test]
fn changed_objects_are_errors() {
    let (folder, bytes) = (Folder::new(), object(2 << 20));
    let server = Server::of(bytes.clone());
    let remote = open(&server, cache(&folder, 1 << 30)).unwrap();
    remote.read(MIB..MIB + 3).unwrap();
    server.tag(Some("\"second\""));
    // What was fetched before is still that of before.
    assert_eq!(&remote.read(MIB..MIB + 3).unwrap()[..], &bytes[1 << 20..][..3]);
    let error = error_text(remote.read(2 * MIB - 5..2 * MIB));
    assert!(error.contains("changed while it was read"), "{error}");
    // Bytes of the first object are not taken for those of the second.
    let remote = open(&server, cache(&folder, 1 << 30)).unwrap();
    server.asked();
    remote.read(MIB..MIB + 3).unwrap();
    assert_eq!(server.asked().len(), 1);
}

#[test]
fn damaged_and_missing_blocks_are_fetched_again() {
    let (folder, bytes) = (Folder::new(), object(2 << 20));
    let server = Server::of(bytes.clone());
    let read = |remote: &Remote| remote.read(MIB..MIB + 3).unwrap();
    read(&open(&server, cache(&folder, 1 << 30)).unwrap());
    let block = files(&folder.path("cache")).into_iter().find(|path| path.ends_with("16")).unwrap();
    let whole = std::fs::read(&block).unwrap();
    let mut changed = whole.clone();
    changed[7] ^= 1;
    for damaged in [&changed[..], &whole[..whole.len() - 1], b""] {
        std::fs::write(&block, damaged).unwrap();
        server.asked();
        let remote = open(&server, cache(&folder, 1 << 30)).unwrap();
        assert_eq!(&read(&remote)[..], &bytes[1 << 20..][..3]);
        assert_eq!((server.asked().len(), std::fs::read(&block).unwrap() == whole), (2, true));
    }
    // A block in the place of another.
    std::fs::copy(&block, block.with_file_name("17")).unwrap();
    let remote = open(&server, cache(&folder, 1 << 30)).unwrap();
    let next = MIB + BLOCK;
    assert_eq!(&remote.read(next..next + 3).unwrap()[..], &bytes[next as usize..][..3]);
    remote.forget(MIB..MIB + 1);
    assert!(!block.exists() && read(&remote)[..] == bytes[1 << 20..][..3] && block.exists());
}

fn files(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.path().is_dir() {
            all.extend(files(&entry.path()));
        } else {
            all.push(entry.path());
        }
    }
    all
}

#[test]
fn the_cache_is_bounded() {
    let (folder, most) = (Folder::new(), 16 * BLOCK);
    let server = Server::of(object(4 << 20));
    let bytes = || -> u64 {
        let files = files(&folder.path("cache"));
        files.iter().map(|file| file.metadata().unwrap().len()).sum()
    };
    let remote = open(&server, cache(&folder, most)).unwrap();
    remote.fetch(&[MIB..4 * MIB]).unwrap();
    assert!((most / 2..=most).contains(&bytes()), "{}", bytes());
    // A smaller limit removes more, and 0 keeps nothing new.
    open(&server, cache(&folder, most / 4)).unwrap().read(MIB..MIB + 1).unwrap();
    assert!(bytes() <= most / 4);
    let other = Folder::new();
    open(&server, cache(&other, 0)).unwrap().read(MIB..MIB + 1).unwrap();
    assert!(files(&other.path("cache")).is_empty());
    // Nothing would show that the object has changed.
    server.tag(None);
    open(&server, cache(&other, most)).unwrap().read(MIB..MIB + 1).unwrap();
    assert!(files(&other.path("cache")).is_empty());
}

#[test]
fn a_cache_that_cannot_be_written_costs_only_time() {
    let (folder, bytes) = (Folder::new(), object(2 << 20));
    let server = Server::of(bytes.clone());
    folder.write("cache", "a file in its place");
    // The last one is that of a user without a home.
    let nowhere = Cache { folder: std::path::PathBuf::new(), bytes: 1 << 30 };
    for cache in [cache(&folder, 1 << 30), nowhere] {
        let remote = open(&server, cache).unwrap();
        assert_eq!(&remote.read(MIB..MIB + 3).unwrap()[..], &bytes[1 << 20..][..3]);
        let mut all = Vec::new();
        std::io::Read::read_to_end(&mut remote.whole().unwrap(), &mut all).unwrap();
        assert!(all == bytes);
    }
    assert!(!Path::new("objects").exists());
}

/// The names of all files in a folder, without their folders.
fn names(folder: &Folder) -> Vec<String> {
    let name = |file: &std::path::PathBuf| file.file_name().unwrap().to_string_lossy().into();
    files(&folder.path("")).iter().map(name).collect()
}

/// A user's files beside those of the cache, and behind links in it.
#[test]
fn only_what_the_cache_made_is_removed() {
    let (folder, bytes) = (Folder::new(), object(4 << 20));
    let server = Server::of(bytes);
    let most = 16 * BLOCK;
    open(&server, cache(&folder, most)).unwrap().read(MIB..MIB + 3).unwrap();
    let objects = folder.path("cache/objects");
    let object = std::fs::read_dir(&objects).unwrap().next().unwrap().unwrap().path();
    let digits = "0123456789abcdef".repeat(2);
    let large = vec![7; 2 * most as usize];
    let mut users = vec![
        objects.join("notes.txt"),
        objects.join(&digits),
        objects.join("my data/0"),
        objects.join(digits.to_uppercase()).join("0"),
        objects.join(&digits[1..]).join("0"),
        object.join("007"),
        object.join("1.bak"),
        object.join("whole-mine"),
        object.join("part-begun"),
        object.join("more/0"),
        folder.path("cache/thesis.pdf"),
    ];
    for file in &users {
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, &large).unwrap();
    }
    #[cfg(unix)]
    {
        let target = folder.path("local");
        std::fs::create_dir(&target).unwrap();
        std::fs::write(target.join("0"), &large).unwrap();
        std::os::unix::fs::symlink(&target, objects.join("f".repeat(32))).unwrap();
        std::os::unix::fs::symlink(target.join("0"), object.join("3")).unwrap();
        users.push(target.join("0"));
    }
    let remote = open(&server, cache(&folder, most)).unwrap();
    remote.fetch(&[MIB..4 * MIB]).unwrap();
    for file in &users {
        assert!(std::fs::read(file).is_ok_and(|read| read == large), "{}", file.display());
    }
    // None of these counts as the cache's, so that it still keeps something.
    assert!(object.join("60").exists() && object.join("used").exists());
}

#[cfg(unix)]
#[test]
fn links_in_the_place_of_an_objects_folder_are_not_followed() {
    let (folder, bytes) = (Folder::new(), object(2 << 20));
    let server = Server::of(bytes.clone());
    open(&server, cache(&folder, 1 << 30)).unwrap().read(MIB..MIB + 3).unwrap();
    let objects = folder.path("cache/objects");
    let object = std::fs::read_dir(&objects).unwrap().next().unwrap().unwrap().path();
    let outside = folder.path("outside");
    for link in [&object, &objects] {
        std::fs::rename(link, &outside).unwrap();
        std::os::unix::fs::symlink(&outside, link).unwrap();
        let before = files(&outside);
        let remote = open(&server, cache(&folder, 4 * BLOCK)).unwrap();
        assert_eq!(&remote.read(MIB..MIB + 3).unwrap()[..], &bytes[1 << 20..][..3]);
        remote.forget(MIB..MIB + 3);
        let last = 2 * MIB - 3..2 * MIB;
        assert_eq!(&remote.read(last).unwrap()[..], &bytes[bytes.len() - 3..]);
        assert!(remote.whole().is_ok());
        assert_eq!(files(&outside), before, "{}", link.display());
        std::fs::remove_file(link).unwrap();
        std::fs::rename(&outside, link).unwrap();
    }
    let mode = |path: &Path| std::os::unix::fs::MetadataExt::mode(&path.metadata().unwrap());
    assert_eq!(mode(&objects) & 0o77, 0, "others could read what was fetched");
}

#[test]
fn whole_objects_are_files() {
    let (folder, bytes) = (Folder::new(), object((5 << 20) + 7));
    let server = Server::of(bytes.clone());
    let read = |remote: &Remote| {
        let mut all = Vec::new();
        std::io::Read::read_to_end(&mut remote.whole().unwrap(), &mut all).unwrap();
        all
    };
    assert!(read(&open(&server, cache(&folder, 1 << 30)).unwrap()) == bytes);
    assert_eq!(server.asked().len(), 3);
    assert!(read(&open(&server, cache(&folder, 1 << 30)).unwrap()) == bytes);
    assert_eq!(server.asked().len(), 1);
    let kept = files(&folder.path("cache"));
    let whole = kept.iter().find(|file| file.to_string_lossy().contains("whole-")).unwrap();
    std::fs::write(whole, "damaged").unwrap();
    assert!(read(&open(&server, cache(&folder, 1 << 30)).unwrap()) == bytes);
    // Too large for the cache: a temporary file, and the cache stays as it is.
    let other = Folder::new();
    assert!(read(&open(&server, cache(&other, 1 << 20)).unwrap()) == bytes);
    assert!(!names(&other).iter().any(|name| name.starts_with("whole-")));
    // A file of the same bytes, but of another object.
    let moved = Cache { folder: folder.path("moved"), bytes: 1 << 30 };
    server.tag(Some("\"second\""));
    assert!(read(&open(&server, moved.clone()).unwrap()) == bytes);
    let (from, to) = (files(&folder.path("moved")), files(&folder.path("cache")));
    let named = |all: &[std::path::PathBuf]| {
        all.iter().find(|file| file.to_string_lossy().contains("whole-")).unwrap().clone()
    };
    std::fs::copy(named(&to), named(&from)).unwrap();
    let foreign = named(&from).with_file_name(named(&to).file_name().unwrap());
    std::fs::rename(named(&from), &foreign).unwrap();
    server.asked();
    assert!(read(&open(&server, moved).unwrap()) == bytes);
    assert!(server.asked().len() == 3 && !foreign.exists());
    // It fills the cache, which then has no room to spare.
    let all = cache(&Folder::new(), bytes.len() as u64);
    assert!(read(&open(&server, all).unwrap()) == bytes);
    // Without a tag it is a temporary file.
    server.tag(None);
    assert!(read(&open(&server, cache(&folder, 1 << 30)).unwrap()) == bytes);
}

#[test]
fn secrets_are_not_told() {
    let server = Server::of(object(1000));
    let name = crate::input::address(server.address("c.splk?signature=hidden"));
    assert!(opened(&name, Cache::default()).is_ok());
    for fault in [Fault::Status(404), Fault::Status(500), Fault::Whole, Fault::Cut(3)] {
        server.fail(move |_, _| fault);
        let error = error_text(opened(&name, Cache::default()));
        assert!(!error.contains("hidden") && error.contains("c.splk: "), "{error}");
    }
    for address in ["http://me:hidden@127.0.0.1/d", "http://127.0.0.1/e?hidden", "s3://"] {
        let error = error_text(Remote::open(Path::new(address), &Limits::default()).map(|_| ()));
        assert!(address == "s3://" || !error.contains("hidden"), "{error}");
        let error = error_text(
            Remote::open(&crate::input::address(address), &Limits::default()).map(|_| ()),
        );
        assert!(!error.contains("hidden"), "{error}");
    }
}
