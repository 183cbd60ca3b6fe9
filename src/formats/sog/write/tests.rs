use super::*;
use crate::{
    formats::sog::{is_meta, is_sog, read},
    input::testing::*,
};
use glam::Vec3;

/// Gaussians of a degree, with a far one and a flat one among them.
fn set(count: usize, degree: u32) -> Gaussians {
    let wave = |i: usize, k: usize| ((i * k) as f32 * 0.37).sin();
    let turn = |i| Quat::from_xyzw(wave(i, 3), wave(i, 5), wave(i, 7), wave(i, 11) + 0.01);
    let scale = |i: usize| Vec3::new(0.01 + 0.01 * wave(i, 2).abs(), 0.1, i as f32 / 7.0);
    let term = |i: usize| [wave(i, 1), wave(i, 13), wave(i, 17)];
    Gaussians {
        origin: DVec3::new(0.0, 5.0, -3.0),
        centers: (0..count).map(|i| Vec3::new(3.0 * wave(i, 19), wave(i, 23), i as f32)).collect(),
        scales: (0..count).map(scale).collect(),
        rotations: (0..count).map(|i| turn(i).normalize()).collect(),
        opacities: (0..count).map(|i| i as f32 / count as f32).collect(),
        degree,
        harmonics: (0..count * terms(degree)).map(term).collect(),
        ..Gaussians::default()
    }
}

/// Returns the Gaussian of a set that is nearest to a place.
fn nearest(set: &Gaussians, to: DVec3) -> usize {
    let away = |i: &usize| place(set, *i).distance(to);
    (0..set.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap()
}

fn check(actual: &Gaussians, wanted: &Gaussians) {
    assert_eq!((actual.len(), actual.degree), (wanted.len(), wanted.degree));
    assert_eq!(actual.validate(), Ok(()));
    for j in 0..wanted.len() {
        let i = nearest(actual, place(wanted, j));
        let to = place(wanted, j);
        let most = 1e-4 * (1.0 + to.abs().max_element());
        assert!(place(actual, i).distance(to) < most, "{to}");
        let logs = [actual.scales[i], wanted.scales[j]].map(|s| s.max(Vec3::splat(1e-6)).ln());
        assert!(logs[0].distance(logs[1]) < 0.05, "{logs:?}");
        assert!(actual.rotations[i].dot(wanted.rotations[j]).abs() > 0.9999);
        assert!((actual.opacities[i] - wanted.opacities[j]).abs() < 0.501 / 255.0);
        for (a, b) in actual.harmonics_of(i).iter().zip(wanted.harmonics_of(j)) {
            let near = a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.01);
            assert!(near, "{a:?} {b:?}");
        }
    }
}

#[test]
fn a_written_set_is_read_again() {
    let folder = Folder::new();
    for degree in 0..=3 {
        let set = set(300, degree);
        let path = folder.path("a.sog");
        write(&set, &path).unwrap();
        assert!(is_sog(&std::fs::read(&path).unwrap()));
        let whole = read_with(&path, read).unwrap();
        check(&whole, &set);
        // The same scene beside its text.
        std::fs::create_dir(folder.path(degree.to_string())).unwrap();
        let path = folder.path(format!("{degree}/meta.json"));
        write(&set, &path).unwrap();
        assert!(is_meta(&std::fs::read(&path).unwrap()));
        let beside = read_with(&path, read).unwrap();
        assert_eq!((&beside.centers, &beside.harmonics), (&whole.centers, &whole.harmonics));
        let files = std::fs::read_dir(folder.path(degree.to_string())).unwrap().count();
        assert_eq!(files, if degree == 0 { 6 } else { 8 });
    }
    // One Gaussian lies at both corners of its box.
    let one = set(1, 1);
    let path = folder.path("one.sog");
    write(&one, &path).unwrap();
    check(&read_with(&path, read).unwrap(), &one);
    let none = write(&Gaussians::default(), &path);
    assert!(matches!(none, Err(Error::Argument(_))));
    let mut wrong = one;
    wrong.scales.pop();
    assert!(matches!(write(&wrong, &path), Err(Error::Argument(_))));
}

#[test]
fn the_same_set_has_the_same_bytes() {
    let folder = Folder::new();
    let files = ["a.sog", "b.sog"].map(|name| {
        write(&set(2000, 1), folder.path(name)).unwrap();
        std::fs::read(folder.path(name)).unwrap()
    });
    assert!(files[0] == files[1]);
}

#[test]
fn planes_replace_nothing_that_their_text_may_not() {
    let (folder, set) = (Folder::new(), set(5, 0));
    let path = folder.path("meta.json");
    let plane = folder.write("quats.webp", "another one");
    disk::may_replace(&path, false);
    let error = write(&set, &path).unwrap_err().to_string();
    assert!(error.contains("quats.webp") && error.contains("exists already"), "{error}");
    assert_eq!(std::fs::read_dir(folder.as_ref()).unwrap().count(), 1);
    assert_eq!(std::fs::read(&plane).unwrap(), b"another one");
    disk::may_replace(&path, true);
    write(&set, &path).unwrap();
    assert_eq!(read_with(&path, read).unwrap().len(), 5);
}

#[test]
fn planes_have_room_for_all_and_an_end() {
    for (count, width, height) in
        [(1, 4, 4), (16, 4, 4), (17, 8, 4), (1 << 20, 1024, 1024), (EDGE * EDGE, EDGE, EDGE)]
    {
        assert_eq!(Size::of(count).unwrap(), Size { width, height }, "{count}");
    }
    let error = Size::of(EDGE * EDGE + 1).unwrap_err().to_string();
    assert!(error.contains("do not fit in SOG"), "{error}");
}

#[test]
fn rotations_are_those_that_are_read() {
    for bytes in [[51, 204, 153, 252], [51, 204, 153, 253], [40, 128, 190, 254], [90, 90, 90, 255]]
    {
        let turn = super::super::rotation(bytes);
        assert_eq!(rotation(turn), bytes);
        assert_eq!(rotation(-turn), bytes);
    }
}

/// A disk that is full after some bytes.
struct Full {
    left: usize,
    /// How often more was written after that.
    knocks: usize,
}

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if bytes.len() > self.left {
            self.knocks += 1;
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.left -= bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Full {
    fn seek(&mut self, _: io::SeekFrom) -> io::Result<u64> {
        Ok(0)
    }
}

#[test]
fn an_archive_that_does_not_fit_is_left_as_it_is() {
    let planes: Vec<Named> = vec![("a.webp", vec![1; 1000]), ("b.webp", vec![2; 1000])];
    for left in [0, 50, 500, 1500] {
        let mut full = Full { left, knocks: 0 };
        let error = archive(&b"{}".to_vec(), &planes, &mut full).unwrap_err();
        // Once: the archive is not ended after that, which would print what went wrong.
        assert_eq!((error.kind(), full.knocks), (io::ErrorKind::StorageFull, 1), "{left}");
    }
}
