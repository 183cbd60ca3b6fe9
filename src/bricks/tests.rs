//! Bricks in memory, in files and built by hand.

use super::{
    file::{to_bytes, with_changes},
    *,
};
use crate::{
    Error,
    formats::{Endian, RawLayout, SampleType, VolumeStream},
    input::{Limits, testing::Folder},
    volume::{Lattice, Samples, Scalar, Volume},
};
use glam::{DMat3, DVec3};
use std::{path::Path, sync::Arc};

/// Samples that change slowly, with a rough part and a part of one value.
fn samples(scalar: Scalar, dims: [usize; 3]) -> Samples {
    let mut state = 1u64;
    let count = dims.iter().product::<usize>();
    let values = (0..count).map(|index| {
        let [x, y, z] = [index % dims[0], index / dims[0] % dims[1], index / dims[0] / dims[1]]
            .map(|n| n as f64);
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let noise = if index % 5 == 0 { (state >> 40) as f64 / (1u64 << 24) as f64 } else { 0.0 };
        if x + y + z < 40.0 {
            0.2
        } else {
            0.5 + 0.25 * (0.2 * x + 0.1 * y).sin() * (0.15 * z).cos() + 0.2 * noise
        }
    });
    match scalar {
        Scalar::U8 => Samples::U8(values.map(|v| (v * 255.0) as u8).collect()),
        Scalar::U16 => Samples::U16(values.map(|v| (v * 65_535.0) as u16).collect()),
        Scalar::I16 => Samples::I16(values.map(|v| (v * 20_000.0 - 10_000.0) as i16).collect()),
        Scalar::I32 => Samples::I32(values.map(|v| (v * 4e9 - 2e9) as i32).collect()),
        Scalar::F32 => Samples::F32(values.map(|v| (v * 1e6 - 3.0) as f32).collect()),
    }
}

fn volume(scalar: Scalar, dims: [usize; 3]) -> Volume {
    let axes = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.0, 2.0, 0.0), DVec3::Z);
    let lattice = Lattice::cartesian(dims, DVec3::new(-1.5, 0.0, 1e3), axes);
    Volume::new(lattice, samples(scalar, dims)).unwrap()
}

fn options() -> WriteOptions {
    WriteOptions { unit: "mm".into(), source: "a.raw".into() }
}

fn open(bytes: &[u8]) -> crate::Result<Bricks> {
    Bricks::from_bytes(bytes.to_vec(), Path::new("test.splv"))
}

/// The value of a sample of a level, read from its brick.
fn value(bricks: &[Brick], level: &Level, scalar: Scalar, at: [usize; 3]) -> f64 {
    let [nx, ny, _] = level.brick_dims;
    let [i, j, k] = at.map(|n| n / SIDE);
    let [x, y, z] = at.map(|n| n % SIDE);
    scalar.value(
        &bricks[(k * ny + j) * nx + i].samples[((z * SIDE + y) * SIDE + x) * scalar.bytes()..],
    )
}

fn every(bricks: &Bricks, level: usize) -> Vec<Brick> {
    (0..bricks.level(level).bricks() as u32)
        .map(|brick| bricks.read(level, brick).unwrap())
        .collect()
}

const ODD: [[usize; 3]; 5] = [[67, 35, 41], [1, 1, 1], [33, 1, 70], [32, 32, 32], [5, 90, 31]];

#[test]
fn files_hold_what_memory_does() {
    for scalar in Scalar::ALL {
        for dims in ODD {
            let volume = volume(scalar, dims);
            let bytes = to_bytes(&volume, &options()).unwrap();
            let (file, memory) =
                (open(&bytes).unwrap(), Bricks::from_volume(Arc::new(volume.clone())).unwrap());
            let header = file.header();
            assert_eq!(
                (&header.lattice, header.scalar, header.range),
                (&volume.lattice, scalar, volume.range)
            );
            assert_eq!((header.unit.as_str(), header.source.as_str()), ("mm", "a.raw"));
            assert_eq!(file.levels(), memory.levels());
            for level in 0..file.levels().len() {
                assert_eq!(file.ranges(level), memory.ranges(level));
                assert_eq!(file.lattice(level), memory.lattice(level));
                assert_eq!(
                    every(&file, level),
                    every(&memory, level),
                    "{scalar:?} {dims:?} level {level}"
                );
            }
            let bricks = every(&file, 0);
            for index in 0..volume.len() {
                let at = volume.lattice.index(index);
                assert_eq!(
                    value(&bricks, file.level(0), scalar, at),
                    volume.value(index),
                    "{scalar:?} {at:?}"
                );
            }
        }
    }
}

#[test]
fn a_directory_of_several_pages_is_read_in_parts() {
    let folder = Folder::new();
    let bytes = to_bytes(&volume(Scalar::U8, [600 * SIDE, 2, 3]), &options()).unwrap();
    let file = open(&bytes).unwrap();
    assert!(file.levels().iter().map(|level| level.bricks()).sum::<usize>() > 2 * 512);
    assert_eq!(file.directory().read_pages(), 0);
    let coarsest = file.levels().len() - 1;
    assert!(file.read(coarsest, 0).is_ok());
    assert_eq!(file.directory().read_pages(), 1);
    let path = folder.write("a.splv", &bytes);
    assert_eq!(check(&path, &Limits::default(), None).findings, []);
    // A damaged directory page: its bricks count as shown, and reading them says why.
    let root = 196 + "mm".len() + "a.raw".len();
    let place = u64::from_le_bytes(bytes[root + 20..root + 28].try_into().unwrap()) as usize;
    let mut broken = bytes;
    broken[place + 3] ^= 1;
    let file = open(&broken).unwrap();
    assert!(file.read(coarsest, 0).is_ok());
    assert_eq!(file.ranges(0)[0], [0, 255]);
    let error = file.read(0, 0).unwrap_err().to_string();
    let name = format!("directory page 1 of level 0 (byte {place})");
    assert!(error.contains(&name), "{error}");
    let path = folder.write("a.splv", &broken);
    let findings = check(path, &Limits::default(), None).findings;
    assert!(findings.iter().any(|f| f.code == "directory" && f.place == name), "{findings:?}");
}

#[test]
fn levels_are_means() {
    for scalar in Scalar::ALL {
        for dims in ODD {
            let bricks = Bricks::from_volume(Arc::new(volume(scalar, dims))).unwrap();
            for level in 1..bricks.levels().len() {
                let (fine, coarse) = (every(&bricks, level - 1), every(&bricks, level));
                let (below, size) = (bricks.level(level - 1), bricks.level(level));
                for index in 0..size.dims.iter().product() {
                    let at = bricks.lattice(level).index(index);
                    let corner = |corner: usize| {
                        let at = [0, 1, 2].map(|axis| {
                            (2 * at[axis] + (corner >> axis & 1)).min(below.dims[axis] - 1)
                        });
                        value(&fine, below, scalar, at)
                    };
                    let mean = (0..8).map(corner).sum::<f64>() / 8.0;
                    let expected =
                        if scalar == Scalar::F32 { f64::from(mean as f32) } else { mean.round() };
                    assert_eq!(
                        value(&coarse, size, scalar, at),
                        expected,
                        "{scalar:?} {dims:?} level {level} {at:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn ranges_are_those_of_brute_force() {
    for (scalar, dims) in
        [(Scalar::U8, [67, 35, 41]), (Scalar::F32, [33, 1, 70]), (Scalar::I16, [5, 90, 31])]
    {
        let bricks = Bricks::from_volume(Arc::new(volume(scalar, dims))).unwrap();
        let [lowest, highest] = bricks.header().range;
        let scale = 255.0 / (highest - lowest);
        for (number, level) in bricks.levels().iter().enumerate() {
            let all = every(&bricks, number);
            for (brick, content) in all.iter().enumerate() {
                let place = level.place(brick as u32);
                let mut whole = EMPTY;
                for (index, &block) in content.blocks.iter().enumerate() {
                    let block_at =
                        [index % BLOCKS, index / BLOCKS % BLOCKS, index / BLOCKS / BLOCKS];
                    let start: [usize; 3] =
                        std::array::from_fn(|axis| place[axis] * SIDE + block_at[axis] * BLOCK);
                    if (0..3).any(|axis| start[axis] >= level.dims[axis]) {
                        assert_eq!(block, EMPTY);
                        continue;
                    }
                    let around = |axis: usize| {
                        start[axis].saturating_sub(REACH)
                            ..(start[axis] + BLOCK + REACH).min(level.dims[axis])
                    };
                    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                    for (k, j) in around(2).flat_map(|k| around(1).map(move |j| (k, j))) {
                        for i in around(0) {
                            let value = value(&all, level, scalar, [i, j, k]);
                            (low, high) = (low.min(value), high.max(value));
                        }
                    }
                    let steps = [
                        ((low - lowest) * scale).floor(),
                        ((high - lowest) * scale).ceil().min(255.0),
                    ];
                    assert_eq!(
                        block.map(f64::from),
                        steps,
                        "level {number}, brick {brick}, block {index}"
                    );
                    whole = [whole[0].min(block[0]), whole[1].max(block[1])];
                }
                assert_eq!((bricks.ranges(number)[brick], content.range()), (whole, whole));
            }
        }
    }
}

#[test]
fn what_one_value_says_takes_no_room() {
    let constant = Volume::new(
        Lattice::with_spacing([64; 3], DVec3::ONE),
        Samples::U16(vec![7; 64 * 64 * 64]),
    )
    .unwrap();
    let bytes = to_bytes(&constant, &WriteOptions::default()).unwrap();
    // Header, the entries of eight bricks and one, their checksum, and the hash.
    assert_eq!(bytes.len(), 196 + 9 * 24 + 4 + 32);
    let file = open(&bytes).unwrap();
    assert_eq!(file.ranges(0)[0], [0, 0]);
    assert_eq!(
        file.read(0, 0).unwrap().samples,
        bytemuck::cast_slice::<u16, u8>(&[7; 32 * 32 * 32])
    );
    // Noise is stored unpacked.
    let noise = samples(Scalar::F32, [32; 3]);
    let mut state = 1u32;
    let noise = (0..noise.len()).map(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.rotate_left(13) as u8
    });
    let noise =
        Volume::new(Lattice::with_spacing([32; 3], DVec3::ONE), Samples::U8(noise.collect()))
            .unwrap();
    let bytes = to_bytes(&noise, &WriteOptions::default()).unwrap();
    assert!(bytes.len() <= 196 + 28 + 32 + 32 * 32 * 32 + 1024);
    assert_eq!(open(&bytes).unwrap().read(0, 0).unwrap().samples, noise.samples.bytes());
}

#[test]
fn streams_become_the_same_file() {
    let folder = Folder::new();
    for (scalar, dims) in
        [(Scalar::U8, [67, 35, 141]), (Scalar::I16, [40, 40, 97]), (Scalar::F32, [33, 1, 70])]
    {
        let mut volume = volume(scalar, dims);
        volume.lattice = Lattice::with_spacing(dims, DVec3::new(1.0, 2.0, 3.0));
        let raw = folder.write("a.raw", volume.samples.bytes());
        let layout = RawLayout {
            dims,
            sample_type: SampleType::from_name(scalar.name()).unwrap(),
            spacing: DVec3::new(1.0, 2.0, 3.0),
            endian: if cfg!(target_endian = "big") { Endian::Big } else { Endian::Little },
            header: 0,
        };
        let limits = Limits::default();
        let stream = VolumeStream::open(&raw, &limits, Some(&layout)).unwrap().unwrap();
        let path = folder.path("a.splv");
        convert(&stream, stream.range(None).unwrap(), &path, &options(), None).unwrap();
        let streamed = std::fs::read(&path).unwrap();
        assert_eq!(streamed, to_bytes(&volume, &options()).unwrap());
        write(&volume, &path, &options(), None).unwrap();
        assert_eq!(streamed, std::fs::read(&path).unwrap());
        // An invalid range leaves the file as it was.
        for range in [[f64::NAN; 2], [1.0, 0.0], [0.0, f64::INFINITY]] {
            let result = convert(&stream, range, &path, &options(), None);
            assert!(
                matches!(
                    &result,
                    Err(Error::Argument(message)) if message.contains("range of values")
                ),
                "{result:?}"
            );
        }
        let report = check(&path, &limits, None);
        assert!(report.is_sound(), "{report:?}");
        // Only the input and the file are left.
        assert_eq!(folder.names().len(), 2);
    }
}

#[test]
fn little_is_held_of_each_level() {
    let dims = [40, 40, 400];
    let samples = samples(Scalar::U8, dims);
    let mut pyramid = pyramid::Pyramid::new(Scalar::U8, dims);
    let mut most = 0;
    for piece in samples.bytes().chunks(8 * 40 * 40) {
        pyramid.push(piece, |_, _, _| Ok(())).unwrap();
        most = most.max(pyramid.held());
    }
    assert!(most as u64 <= memory_of(dims, Scalar::U8) - (64 << 20), "{most}");
    assert!(most > 32 * 40 * 40 && memory_of([2048, 2048, 1024], Scalar::U8) < 1 << 30);
    assert_eq!(memory_of([usize::MAX; 3], Scalar::F32), u64::MAX / 3 + (64 << 20));
}

#[test]
fn other_lattices_and_other_bricks_are_refused() {
    let lattice = Lattice::body_centred([4; 3], DVec3::ZERO, DMat3::IDENTITY);
    let volume = Volume::new(lattice, Samples::U8(vec![0; 64])).unwrap();
    for error in [
        Bricks::from_volume(Arc::new(volume.clone())).unwrap_err(),
        write(&volume, Path::new("none.splv"), &options(), None).unwrap_err(),
    ] {
        assert!(matches!(error, Error::Argument(message) if message.contains("body-centred")));
    }
    let bricks = Bricks::from_volume(Arc::new(self::volume(Scalar::U8, [40; 3]))).unwrap();
    assert!(bricks.read(0, 8).is_err() && bricks.read(9, 0).is_err() && bricks.read(1, 0).is_ok());
}

/// The message of the first damage that is found on opening, or when every brick is read.
fn refusal(bytes: &[u8]) -> Option<String> {
    let bricks = match open(bytes) {
        Ok(bricks) => bricks,
        Err(error) => return Some(text_of(error)),
    };
    let all = bricks.levels().iter().enumerate();
    let all = all
        .flat_map(|(number, level)| (0..level.bricks() as u32).map(move |brick| (number, brick)));
    all.filter_map(|(level, brick)| bricks.read(level, brick).err()).map(text_of).next()
}

fn text_of(error: Error) -> String {
    match error {
        Error::Input { file, place, message, hint } => {
            assert_eq!(file, Path::new("test.splv"));
            assert!(!place.is_empty() && hint.is_some(), "{place}: {message}");
            format!("{place}: {message}")
        }
        other => panic!("{other}"),
    }
}

#[test]
fn damage_is_found() {
    let folder = Folder::new();
    let limits = Limits::default();
    let whole = to_bytes(&volume(Scalar::U8, [70, 40, 33]), &options()).unwrap();
    assert_eq!(refusal(&whole), None);
    for end in (0..300).chain((300..whole.len()).step_by(101)).chain([whole.len() - 1]) {
        assert!(refusal(&whole[..end]).is_some(), "cut at {end}");
    }
    assert!(refusal(&[&whole[..], &[0]].concat()).unwrap().contains("follow the end"));
    let hash = whole.len() - 32;
    for at in (0..700).chain((700..whole.len()).step_by(97)).chain([whole.len() - 1]) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x10;
        assert_eq!(refusal(&damaged).is_some(), at < hash, "byte {at}");
        if at % 23 == 0 || at >= hash {
            let path = folder.write("a.splv", &damaged);
            assert!(!check(&path, &limits, None).is_sound(), "byte {at}");
        }
    }
    let message = |at: usize, to: u8| {
        let mut damaged = whole.clone();
        damaged[at] = to;
        refusal(&damaged).unwrap()
    };
    assert!(message(0, 0).contains("not a volume in bricks"));
    assert!(message(8, 9).contains("version 9"));
    assert!(message(24, 1).contains("checksum"));
}

/// A file whose header is changed, with a checksum that matches.
fn forged(whole: &[u8], at: usize, to: &[u8]) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    bytes[at..at + to.len()].copy_from_slice(to);
    let end = 192 + "mm".len() + "a.raw".len();
    let crc = crc32fast::hash(&bytes[..end]);
    bytes[end..end + 4].copy_from_slice(&crc.to_le_bytes());
    bytes
}

#[test]
fn lies_with_good_checksums_are_found() {
    let whole = to_bytes(&volume(Scalar::U8, [70, 40, 33]), &options()).unwrap();
    let huge = [1u64 << 40, 1 << 19, 1].map(u64::to_le_bytes).concat();
    let nan = f64::NAN.to_le_bytes();
    for (at, to, word) in [
        (12, &[9u8, 0, 0, 0][..], "type of samples"),
        (24, &[0; 8][..], "holds none"),
        (24, &[255; 24][..], "memory"),
        (24, &huge[..], "32 bits"),
        (32, &(1u64 << 33).to_le_bytes()[..], "number of levels"),
        (48, &nan[..], "finite"),
        (72, &[0; 72][..], "spacing"),
        (144, &nan[..], "range"),
        (160, &[7][..], "number of levels"),
        (164, &[16][..], "size of its bricks"),
        (192, &[255, 255][..], "UTF-8"),
    ] {
        let message = refusal(&forged(&whole, at, to)).unwrap();
        assert!(message.contains(word), "byte {at}: {message}");
    }
    // Many bricks, and no bytes for their entries, although the number of levels is right.
    let dims = [1u64 << 20, 1 << 20, 1].map(u64::to_le_bytes).concat();
    let many = forged(&forged(&whole, 24, &dims), 160, &[16]);
    assert!(refusal(&many).unwrap().contains("too short"));
}

#[test]
fn wrong_contents_are_found() {
    let folder = Folder::new();
    let right = volume(Scalar::I16, [70, 40, 33]);
    let codes = |bytes: Vec<u8>| {
        let report = check(folder.write("a.splv", bytes), &Limits::default(), None);
        report
            .findings
            .iter()
            .map(|finding| (finding.code, finding.place.clone()))
            .collect::<Vec<_>>()
    };
    // The header's range is wider than that of the samples.
    let wide = Volume { range: [right.range[0] - 1.0, right.range[1]], ..right.clone() };
    assert_eq!(codes(to_bytes(&wide, &options()).unwrap()), [("range", "header".into())]);
    let bricks = Bricks::from_volume(Arc::new(right)).unwrap();
    let changed = |at: (usize, u32), change: &dyn Fn(&mut Brick)| {
        codes(with_changes(&bricks, |level, brick, content| {
            if (level, brick) == at {
                change(content);
            }
        }))
    };
    assert_eq!(changed((0, 0), &|_| ()), []);
    let place = || "level 1, brick 1".to_owned();
    assert_eq!(changed((1, 1), &|brick| brick.samples[20] ^= 1), [("samples", place())]);
    assert_eq!(changed((1, 1), &|brick| brick.blocks[0][1] -= 1), [("blocks", place())]);
    // A changed sample of the finest level, which the coarser levels and the blocks around it
    // contradict.
    let lie = changed((0, 1), &|brick| brick.samples[40 * 2 * 32..40 * 2 * 32 + 64].fill(99));
    assert!(
        lie.iter().any(|(code, _)| *code == "samples")
            && lie.iter().any(|(code, _)| *code == "blocks"),
        "{lie:?}"
    );
}
