use super::*;
use crate::{
    gaussians::{Gaussians, harmonics::CONSTANT},
    input::testing::*,
};

/// Where the data of a file with one section begin.
const DATA: usize = 4096 + 1024;

/// Three Gaussians of a section: two in a full bucket, and one in a partial one.
struct File {
    level: u16,
    degree: u16,
    /// The least and the greatest harmonic.
    range: [f32; 2],
}

impl File {
    fn float(&self, value: f32) -> Vec<u8> {
        match self.level {
            0 => value.to_le_bytes().to_vec(),
            _ => f16::from_f32(value).to_le_bytes().to_vec(),
        }
    }

    /// Returns the bytes of a Gaussian. The terms of its harmonics are 0, 1/64, 2/64 and so on.
    fn record(&self, index: usize) -> Vec<u8> {
        let mut record = Vec::new();
        for part in 0..3 {
            let step = 32767 + 100 * index as u16 + part;
            match self.level {
                0 => record.extend((index as f32 + f32::from(part) / 8.0).to_le_bytes()),
                _ => record.extend(step.to_le_bytes()),
            }
        }
        for value in [0.5, 1.0, 2.0, 0.75, 0.0, -0.25, 0.5] {
            record.extend(self.float(value));
        }
        record.extend([255, 0, 51, 204]);
        for term in 0..[0u8, 9, 24][usize::from(self.degree)] {
            match self.level {
                2 => record.push(term),
                _ => record.extend(self.float(f32::from(term) / 64.0)),
            }
        }
        record
    }

    fn section(&self) -> Vec<u8> {
        let mut head = vec![0; 1024];
        let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, &3u32.to_le_bytes());
        put(4, &3u32.to_le_bytes());
        put(40, &self.degree.to_le_bytes());
        if self.level > 0 {
            put(8, &2u32.to_le_bytes());
            put(12, &2u32.to_le_bytes());
            put(16, &5f32.to_le_bytes());
            put(20, &12u16.to_le_bytes());
            put(24, &32767u32.to_le_bytes());
            put(32, &1u32.to_le_bytes());
            put(36, &1u32.to_le_bytes());
        }
        head
    }

    fn data(&self) -> Vec<u8> {
        let mut data = Vec::new();
        if self.level > 0 {
            data.extend(1u32.to_le_bytes());
            data.extend([1f32, 2.0, 3.0, -4.0, -5.0, -6.0].map(f32::to_le_bytes).as_flattened());
        }
        data.extend((0..3).flat_map(|index| self.record(index)));
        data
    }

    /// Returns a file of this section, as often as is asked for.
    fn bytes(&self, sections: u32) -> Vec<u8> {
        let mut head = vec![0; 4096];
        head[1] = 1;
        for at in [4, 8] {
            head[at..at + 4].copy_from_slice(&sections.to_le_bytes());
        }
        for at in [12, 16] {
            head[at..at + 4].copy_from_slice(&(3 * sections).to_le_bytes());
        }
        head[20..22].copy_from_slice(&self.level.to_le_bytes());
        head[36..44].copy_from_slice(self.range.map(f32::to_le_bytes).as_flattened());
        let times = |part: Vec<u8>| part.repeat(sections as usize);
        [head, times(self.section()), times(self.data())].concat()
    }

    /// Returns a harmonic by its number in the record.
    fn harmonic(&self, at: usize) -> f32 {
        let [low, high] = if self.range == [0.0; 2] { [-1.5, 1.5] } else { self.range };
        if self.level == 2 { low + at as f32 / 255.0 * (high - low) } else { at as f32 / 64.0 }
    }
}

fn load(bytes: Vec<u8>) -> Result<Gaussians> {
    let folder = Folder::new();
    read_with(&folder.write("a.ksplat", bytes), read)
}

fn place(set: &Gaussians, index: usize) -> DVec3 {
    set.origin + set.centers[index].as_dvec3()
}

#[test]
fn numbers_are_those_of_the_records() {
    for level in 0..3 {
        for degree in 0..3 {
            let file = File { level, degree, range: [-2.0, 3.0] };
            let case = format!("level {level}, degree {degree}");
            let set = load(file.bytes(1)).unwrap();
            assert_eq!((set.len(), set.degree, set.validate()), (3, degree.into(), Ok(())));
            let step = 2.5 / 32767.0;
            let buckets = [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [-4.0, -5.0, -6.0]];
            for (index, bucket) in buckets.into_iter().enumerate() {
                let wanted = DVec3::from_array([0, 1, 2].map(|axis| match level {
                    0 => index as f64 + axis as f64 / 8.0,
                    _ => bucket[axis] + step * (100 * index + axis) as f64,
                }));
                assert!(place(&set, index).distance(wanted) < 1e-6, "{case}: {wanted}");
                assert_eq!(set.scales[index], Vec3::new(0.5, 1.0, 2.0), "{case}");
                assert_eq!(set.opacities[index], 0.8, "{case}");
                let turn = Quat::from_xyzw(0.0, -0.25, 0.5, 0.75).normalize();
                assert!(set.rotations[index].dot(turn) > 0.999_999, "{case}");
            }
            let colors = set.harmonics_of(2);
            for (actual, wanted) in colors[0].iter().zip([1.0, 0.0, 0.2]) {
                assert!((0.5 + CONSTANT * actual - wanted).abs() < 1e-6, "{case}: {actual}");
            }
            // Each band has red, green and blue after each other.
            let bands: [&[[usize; 3]]; 2] =
                [&[[0, 3, 6], [1, 4, 7], [2, 5, 8]], &[[9, 14, 19], [10, 15, 20], [11, 16, 21]]];
            let numbers = bands[0].iter().chain(bands[1]).take(colors.len() - 1);
            for (term, at) in colors[1..].iter().zip(numbers) {
                let wanted = at.map(|at| file.harmonic(at));
                let near = term.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-5);
                assert!(near, "{case}: {term:?} {wanted:?}");
            }
        }
    }
}

#[test]
fn a_range_of_zeros_is_the_usual_one() {
    let file = File { level: 2, degree: 1, range: [0.0; 2] };
    let set = load(file.bytes(1)).unwrap();
    assert_eq!(set.harmonics_of(0)[1][0], -1.5);
}

#[test]
fn sections_follow_each_other() {
    let file = File { level: 1, degree: 2, range: [0.0; 2] };
    let mut bytes = file.bytes(2);
    let set = load(bytes.clone()).unwrap();
    assert_eq!((set.len(), place(&set, 1), place(&set, 2)), (6, place(&set, 4), place(&set, 5)));
    assert!(place(&set, 4).distance(place(&set, 5)) > 5.0);
    // The first section has no harmonics, and its records are shorter.
    let plain = File { degree: 0, ..file };
    bytes.truncate(4096);
    bytes.extend([plain.section(), file.section(), plain.data(), file.data()].concat());
    let set = load(bytes.clone()).unwrap();
    assert_eq!((set.len(), set.degree), (6, 2));
    assert_eq!(set.harmonics_of(0)[1..], [[0.0; 3]; 8]);
    assert!(set.harmonics_of(3)[4..] != [[0.0; 3]; 5]);
    // A section with room for more Gaussians than it has, and then none at all.
    bytes[4096] = 1;
    bytes[16] = 4;
    let fewer = load(bytes.clone()).unwrap();
    assert_eq!((fewer.len(), place(&fewer, 1)), (4, place(&set, 3)));
    bytes[4096] = 0;
    bytes[16] = 3;
    let fewer = load(bytes).unwrap();
    assert_eq!((fewer.len(), place(&fewer, 0)), (3, place(&set, 3)));
}

#[test]
fn cuts_are_errors() {
    let folder = Folder::new();
    for level in 0..3 {
        let bytes = File { level, degree: 1, range: [0.0; 2] }.bytes(1);
        for end in [0, 1, 100, 4095, 4096, 5000, DATA, DATA + 1, DATA + 40, bytes.len() - 1] {
            let path = folder.write("a.ksplat", &bytes[..end]);
            let error = read_with(&path, read).unwrap_err();
            let crate::Error::Input { file, hint: Some(hint), .. } = &error else {
                panic!("cut at {end}: {error}");
            };
            assert!(*file == path && hint.contains("cut off"), "cut at {end}: {error}");
        }
    }
}

#[test]
fn contradictions_are_errors() {
    let file = File { level: 2, degree: 1, range: [0.0; 2] };
    let cases: [(usize, &[u8], &str); 14] = [
        (0, &[1], "header: has the version 1.1"),
        (1, &[0], "header: has the version 0.0"),
        (4, &[0], "header: counts 3 Gaussians, but its sections have 0"),
        (4, &[9], "header: counts 9 sections, whose headers end at byte 13312"),
        (16, &[0], "header: counts no Gaussians"),
        (16, &[4], "header: counts 4 Gaussians, but its sections have 3"),
        (20, &[3], "header: has the compression level 3"),
        (4096, &[4], "section 0 (byte 4096): counts 4 Gaussians in room for 3"),
        (4100, &[0, 1], "lies in the bytes 5120 to"),
        (4096 + 16, &[0; 4], "has blocks of the size 0"),
        (4096 + 20, &[8], "has 8 bytes for a bucket"),
        (4096 + 32, &[9], "has 9 full and 1 partial buckets, but counts 2"),
        (4096 + 40, &[3], "has harmonics of the degree 3, but .ksplat has at most 2"),
        (DATA, &[0], "has 3 Gaussians, but its buckets have 2"),
    ];
    for (at, change, word) in cases {
        let mut bytes = file.bytes(1);
        bytes[at..at + change.len()].copy_from_slice(change);
        let error = load(bytes).unwrap_err().to_string();
        assert!(error.contains(word), "{error}, not {word}");
    }
    let mut many = file.bytes(1);
    many[16..20].fill(255);
    let error = load(many).unwrap_err();
    assert!(matches!(error, crate::Error::Limit { .. }), "{error}");
}
