use super::*;
use crate::{Error, about::Orientation, input::testing::*};
use flate2::{Compression, write::GzEncoder};
use glam::{DVec3, Quat, Vec3};
use std::io::Write;

/// A header of 16 bytes.
fn header(version: u32, count: u32, degree: u8, fraction: u8, flags: u8) -> Vec<u8> {
    let numbers = [version, count].map(u32::to_le_bytes);
    [&MAGIC[..], numbers.as_flattened(), &[degree, fraction, flags, 0]].concat()
}

/// The attributes of one Gaussian.
fn attributes(version: u32, degree: u8) -> [Vec<u8>; 6] {
    // 1.5, −0.25 and 0, as halves or with 12 fractional bits.
    let position = if version == 1 {
        vec![0, 0x3e, 0, 0xb4, 0, 0]
    } else {
        vec![0, 0x18, 0, 0, 0xfc, 0xff, 0, 0, 0]
    };
    // x is 0.6, and y and z almost 0; or x is −√½, and w is left out.
    let rotation = if version < 3 { vec![204, 127, 128] } else { vec![0, 0, 0xf0, 0xff] };
    let harmonics = 3 * (terms(u32::from(degree)) - 1);
    [
        position,
        vec![51],
        vec![255, 0, 51],
        vec![160, 176, 144],
        rotation,
        (0..harmonics).map(|at| 100 + at as u8).collect(),
    ]
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(Vec::new(), Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

/// A file of version 1 to 3 with one Gaussian.
fn file(version: u32, degree: u8) -> Vec<u8> {
    let head = header(version, 1, degree, 12, 0);
    gzip(&[head, attributes(version, degree).concat()].concat())
}

/// A file of version 4 with one Gaussian, with these extensions.
#[cfg(feature = "files")]
fn streams(degree: u8, extensions: &[u8]) -> Vec<u8> {
    let (mut table, mut data, mut count) = (Vec::new(), Vec::new(), 0);
    for attribute in attributes(4, degree).iter().filter(|attribute| !attribute.is_empty()) {
        let packed = zstd::bulk::compress(attribute, 3).unwrap();
        let row = [packed.len() as u64, attribute.len() as u64].map(u64::to_le_bytes);
        table.extend_from_slice(row.as_flattened());
        data.extend(packed);
        count += 1;
    }
    let mut head = header(4, 1, degree, 12, if extensions.is_empty() { 0 } else { EXTENDED });
    head[15] = count;
    head.extend((32 + extensions.len() as u32).to_le_bytes());
    head.extend([0; 12]);
    [&head[..], extensions, &table, &data].concat()
}

/// An extension that names a coordinate system, behind another one.
fn extensions(system: u32) -> Vec<u8> {
    let other = [0x1234_0001, 3].map(u32::to_le_bytes);
    let records = [0xadbe_0003, 4, system].map(u32::to_le_bytes);
    [other.as_flattened(), b"abc", records.as_flattened()].concat()
}

fn load(name: &str, bytes: &[u8]) -> Result<Gaussians> {
    let folder = Folder::new();
    read_with(&folder.write(name, bytes), read)
}

fn check(set: &Gaussians, version: u32, degree: u8) {
    let case = format!("version {version}, degree {degree}");
    assert_eq!((set.len(), set.degree, set.validate()), (1, u32::from(degree), Ok(())), "{case}");
    let center = set.origin + set.centers[0].as_dvec3();
    assert_eq!(center, DVec3::new(1.5, -0.25, 0.0), "{case}");
    assert!(set.scales[0].distance(Vec3::new(1.0, 1f32.exp(), (-1f32).exp())) < 1e-6, "{case}");
    assert_eq!(set.opacities[0], 0.2, "{case}");
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turn = if version < 3 {
        Quat::from_xyzw(0.6, -1.0 / 255.0, 1.0 / 255.0, 0.799_98)
    } else {
        Quat::from_xyzw(-half, 0.0, 0.0, half)
    };
    let rotation = set.rotations[0];
    assert!((rotation - turn).length() < 1e-4, "{case}: {rotation}");
    for (actual, wanted) in set.harmonics[0].iter().zip([10.0f32 / 3.0, -10.0 / 3.0, -2.0]) {
        assert!((actual - wanted).abs() < 1e-5, "{case}: {actual}");
    }
    let others = set.harmonics[1..].as_flattened();
    assert_eq!(others.len(), 3 * (terms(u32::from(degree)) - 1), "{case}");
    for (at, actual) in others.iter().enumerate() {
        assert_eq!(*actual, (at as f32 - 28.0) / 128.0, "{case}");
    }
    assert_eq!(set.about.orientation, None);
}

#[test]
fn versions_1_to_3() {
    let folder = Folder::new();
    for version in 1..=3 {
        for degree in 0..=3 {
            let bytes = file(version, degree);
            assert!(is_spz(&bytes) && !is_spz(&bytes[..12]));
            check(&load("a.spz", &bytes).unwrap(), version, degree);
        }
        every_cut(&folder, "a.spz", &file(version, 1), read);
    }
    // The same without gzip.
    let plain = [header(2, 1, 3, 12, 0), attributes(2, 3).concat()].concat();
    assert!(is_spz(&plain));
    check(&load("a.spz", &plain).unwrap(), 2, 3);
    every_cut(&folder, "a.spz", &plain, read);
    // Bytes behind the attributes are ignored.
    let more = [header(3, 1, 2, 12, 0), attributes(3, 2).concat(), vec![7; 9]].concat();
    check(&load("a.spz", &gzip(&more)).unwrap(), 3, 2);
}

#[cfg(feature = "files")]
#[test]
fn version_4() {
    let folder = Folder::new();
    for degree in 0..=3 {
        let bytes = streams(degree, &[]);
        assert!(is_spz(&bytes));
        check(&load("a.spz", &bytes).unwrap(), 4, degree);
    }
    every_cut(&folder, "a.spz", &streams(1, &extensions(4)), read);
    let changes: [(usize, u8, &str); 6] = [
        (15, 4, "counts 4 streams, but 6 are expected"),
        (16, 8, "inside the header"),
        (17, 1, "ends before its table of contents"),
        (10, 1, "more than"),
        (40, 1, "the positions have 1 bytes where 9 are expected"),
        (32, 255, "the positions need 255 bytes"),
    ];
    for (at, value, word) in changes {
        let mut bytes = streams(3, &[]);
        bytes[at] = value;
        let error = load("a.spz", &bytes).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
    // Streams that unpack to another size than the table says.
    let mut bytes = streams(0, &[]);
    let packed = zstd::bulk::compress(&[0; 1 << 16], 3).unwrap();
    bytes.truncate(32 + 5 * 16);
    bytes[32..40].copy_from_slice(&(packed.len() as u64).to_le_bytes());
    bytes.extend(packed);
    let error = load("a.spz", &bytes).unwrap_err().to_string();
    assert!(error.contains("positions: unpacks to too many bytes"), "{error}");
}

#[cfg(not(feature = "files"))]
#[test]
fn version_4_is_refused() {
    let mut bytes = header(4, 1, 0, 12, 0);
    bytes[15] = 5;
    bytes.extend(32u32.to_le_bytes());
    bytes.extend([0; 12]);
    for size in [9u64, 1, 3, 3, 4] {
        bytes.extend([1, size].map(u64::to_le_bytes).as_flattened());
    }
    bytes.extend([0; 5]);
    let error = load("a.spz", &bytes).unwrap_err().to_string();
    assert!(error.contains("feature “files”"), "{error}");
}

#[test]
fn extensions_say_what_is_up() {
    let systems = [
        (4, Some(DVec3::Y)),
        (6, Some(DVec3::NEG_Y)),
        (8, Some(DVec3::Y)),
        (10, Some(DVec3::NEG_Z)),
        (16, Some(DVec3::Z)),
        (0, None),
        (17, None),
    ];
    for (system, up) in systems {
        let head = header(3, 1, 0, 12, EXTENDED);
        let bytes = [head, attributes(3, 0).concat(), extensions(system)].concat();
        let set = load("a.spz", &gzip(&bytes)).unwrap();
        assert_eq!(set.about.orientation, up.map(Orientation::with_up), "{system}");
        #[cfg(feature = "files")]
        {
            let set = load("a.spz", &streams(0, &extensions(system))).unwrap();
            assert_eq!(set.about.orientation, up.map(Orientation::with_up), "{system}");
        }
    }
    // Records that are cut off.
    let records = extensions(4);
    for end in 0..records.len() {
        assert_eq!(super::extensions::system(&records[..end]), None);
    }
}

#[test]
fn other_headers_are_refused() {
    let with = |head: Vec<u8>| [head, attributes(3, 0).concat()].concat();
    let mut other = header(3, 1, 0, 12, 0);
    other[0] = b'M';
    assert!(!is_spz(&gzip(&other)) && !is_spz(&other) && !is_spz(&[]));
    let wrong = [
        (gzip(&other), "not SPZ"),
        (other, "not SPZ"),
        (gzip(&with(header(9, 1, 0, 12, 0))), "has the version 9, but the versions 1 to 4"),
        (gzip(&with(header(0, 1, 0, 12, 0))), "has the version 0"),
        ([header(5, 1, 0, 12, 0), vec![0; 99]].concat(), "has the version 5"),
        (gzip(&with(header(4, 1, 0, 12, 0))), "has the version 4, which is not packed by gzip"),
        (gzip(&with(header(3, 1, 4, 12, 0))), "harmonics of the degree 4"),
        (gzip(&with(header(3, 1, 0, 32, 0))), "32 fractional bits"),
        (gzip(&with(header(3, 0, 0, 12, 0))), "counts no Gaussians"),
        (gzip(&with(header(3, 1 << 24, 3, 12, 0))), "positions: unpacks to 20 bytes where 1509949"),
    ];
    for (bytes, word) in wrong {
        let error = load("a.spz", &bytes).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
    let error = load("a.spz", &gzip(&with(header(3, u32::MAX, 3, 12, 0)))).unwrap_err();
    assert!(matches!(error, Error::Limit { .. }), "{error}");
}

/// Gaussians of a degree, whose coefficients fit in the file.
fn set(degree: u32) -> Gaussians {
    let count = 64;
    let turn = |i: usize| {
        let part = |k: usize| ((i * k) as f32).sin();
        Quat::from_xyzw(part(3), part(5), part(7), part(11) + 0.01).normalize()
    };
    Gaussians {
        origin: DVec3::new(0.0, 50.0, -3.0),
        centers: (0..count).map(|i| Vec3::new(i as f32, -3.0 * i as f32, 0.3)).collect(),
        scales: (0..count).map(|i| Vec3::new(0.01, 0.1 * i as f32 + 0.001, 7.0)).collect(),
        rotations: (0..count).map(turn).collect(),
        opacities: (0..count).map(|i| i as f32 / 63.0).collect(),
        degree,
        harmonics: (0..count * terms(degree)).map(|i| [0.9, -0.9, (i as f32).cos()]).collect(),
        ..Gaussians::default()
    }
}

#[test]
fn a_written_set_is_read_again() {
    let folder = Folder::new();
    for degree in 0..=3 {
        let (set, path) = (set(degree), folder.path("a.spz"));
        write(&set, &path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert!(is_spz(&bytes) && bytes.starts_with(&GZIP));
        let loaded = read_with(&path, read).unwrap();
        assert_eq!((loaded.len(), loaded.degree, loaded.validate()), (64, degree, Ok(())));
        for i in 0..64 {
            let place = |set: &Gaussians| set.origin + set.centers[i].as_dvec3();
            let miss = (place(&loaded) - place(&set)).abs().max_element();
            assert!(miss <= 0.5001 / 4096.0, "{miss}");
            let ratio = (loaded.scales[i] / set.scales[i]).to_array();
            assert!(ratio.iter().all(|r| r.ln().abs() < 1.001 / 32.0), "{ratio:?}");
            assert!((loaded.opacities[i] - set.opacities[i]).abs() < 0.501 / 255.0);
            let dot = loaded.rotations[i].dot(set.rotations[i]).abs();
            assert!(dot > 0.999_99, "{dot}");
            let terms = loaded.harmonics_of(i).iter().zip(set.harmonics_of(i)).enumerate();
            for (term, (a, b)) in terms {
                let half = if term == 0 { 0.501 / 255.0 / decode::COLOR } else { 0.501 / 128.0 };
                // The largest byte is just below 1.
                let most = if term == 0 { f32::MAX } else { 127.0 / 128.0 };
                let near = a.iter().zip(b).all(|(a, b)| (a - b.min(most)).abs() < half);
                assert!(near, "{a:?} {b:?}");
            }
        }
    }
}

#[cfg(feature = "files")]
#[test]
fn both_written_versions_have_the_same_numbers() {
    let folder = Folder::new();
    for degree in 0..=3 {
        let (set, [third, fourth]) = (set(degree), ["3.spz", "4.spz"].map(|n| folder.path(n)));
        write(&set, &third).unwrap();
        write_streams(&set, &fourth).unwrap();
        let bytes = std::fs::read(&fourth).unwrap();
        assert_eq!((&bytes[..8], bytes[15]), (&b"NGSP\x04\0\0\0"[..], 5 + u8::from(degree > 0)));
        let [third, fourth] = [third, fourth].map(|path| read_with(&path, read).unwrap());
        assert_eq!((fourth.len(), fourth.degree), (64, degree));
        assert_eq!((&third.centers, &third.scales), (&fourth.centers, &fourth.scales));
        assert_eq!((&third.rotations, &third.opacities), (&fourth.rotations, &fourth.opacities));
        assert_eq!(third.harmonics, fourth.harmonics);
    }
    let none = write_streams(&Gaussians::default(), folder.path("a.spz"));
    assert!(matches!(none, Err(Error::Argument(_))));
}

#[test]
fn far_positions_have_fewer_fractional_bits() {
    let folder = Folder::new();
    let path = folder.path("a.spz");
    let mut set = set(0);
    for (far, step) in [(3000.0, 1.0 / 2048.0), (-8_388_607.0, 1.0)] {
        set.origin.z = far;
        write(&set, &path).unwrap();
        let loaded = read_with(&path, read).unwrap();
        let [actual, wanted] = [&loaded, &set].map(|set| set.origin + set.centers[7].as_dvec3());
        assert!((actual - wanted).abs().max_element() <= 0.501 * step, "{actual} {wanted}");
    }
    set.origin.z = 9e6;
    let refused = [write(&set, &path), write(&Gaussians::default(), &path)];
    assert!(refused.iter().all(|error| matches!(error, Err(Error::Argument(_)))));
}
