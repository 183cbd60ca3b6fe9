//! One world for all medical files: the same body, written in the frames of several formats, lies
//! at the same places, so that a mask made from one lies on the other.

use crate::{
    made::{element, nifti},
    testing::folder::Folder,
};
use splatkit::{
    about::{Frame, Orientation},
    bricks,
    formats::{ReadOptions, load_mesh, load_volume, nrrd},
    glam::DVec3,
    input::Limits,
    volume::Volume,
};
use std::path::{Path, PathBuf};

/// Samples along each axis of the body: 3 to the right, 4 to the front, 2 to the head.
const DIMS: [usize; 3] = [3, 4, 2];
/// The steps, and the place of the first sample, in the patient's frame (RAS).
const STEP: [f64; 3] = [1.0, 2.0, 5.0];
const FIRST: [f64; 3] = [-40.0, 10.0, 300.0];

/// The value at a sample: no two are equal, so no turn or mirror goes unseen.
fn value(at: [usize; 3]) -> u8 {
    (1 + at[0] + 10 * at[1] + 100 * at[2]) as u8
}

/// The values along the axes of a file, of which some run backwards.
fn bytes(backwards: [bool; 3]) -> Vec<u8> {
    let [nx, ny, nz] = DIMS;
    let along = |axis: usize, at: usize| if backwards[axis] { DIMS[axis] - 1 - at } else { at };
    (0..nx * ny * nz)
        .map(|i| value([along(0, i % nx), along(1, i / nx % ny), along(2, i / (nx * ny))]))
        .collect()
}

fn last(axis: usize) -> f64 {
    FIRST[axis] + STEP[axis] * (DIMS[axis] - 1) as f64
}

fn nifti_file() -> Vec<u8> {
    let mut file = nifti(|header| {
        let mut put = |at: usize, number: &[u8]| {
            header[at..at + number.len()].copy_from_slice(number);
        };
        for (axis, count) in [3, 3, 4, 2i16].into_iter().enumerate() {
            put(40 + 2 * axis, &count.to_le_bytes());
        }
        put(254, &1i16.to_le_bytes());
        for axis in 0..3 {
            let row = 280 + 16 * axis;
            put(row + 4 * axis, &(STEP[axis] as f32).to_le_bytes());
            put(row + 12, &(FIRST[axis] as f32).to_le_bytes());
        }
    });
    file.truncate(352);
    file.extend(bytes([false; 3]));
    file
}

/// A file of NRRD in a space of three sides. Its axes run towards them, backwards against the
/// patient's where the side is the opposite one.
fn nrrd_file(space: &str, backwards: [bool; 3]) -> Vec<u8> {
    // The first sample in the file's own frame.
    let first = [0, 1, 2].map(|axis| if backwards[axis] { -last(axis) } else { FIRST[axis] });
    let [x, y, z] = STEP;
    let [a, b, c] = first;
    let header = format!(
        "NRRD0004\ntype: uint8\ndimension: 3\nspace: {space}\nsizes: 3 4 2\nspace directions: \
         ({x},0,0) (0,{y},0) (0,0,{z})\nspace origin: ({a},{b},{c})\nencoding: raw\n\n"
    );
    [header.into_bytes(), bytes(backwards)].concat()
}

fn meta_image() -> Vec<u8> {
    let header = format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n\
         AnatomicalOrientation = RAI\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = {} {} {}\n\
         ElementSpacing = 1 2 5\nDimSize = 3 4 2\nElementType = MET_UCHAR\n\
         ElementDataFile = LOCAL\n",
        -last(0),
        -last(1),
        FIRST[2]
    );
    [header.into_bytes(), bytes([true, true, false])].concat()
}

/// A folder of two slices of DICOM.
fn dicom_folder(folder: &Folder) -> PathBuf {
    let all = bytes([true, true, false]);
    let text = |group: u16, number: u16, kind: &str, text: String| {
        let even = if text.len().is_multiple_of(2) { text } else { text + " " };
        element(group, number, kind, even.as_bytes())
    };
    let short = |number: u16, value: u16| element(0x28, number, "US", &value.to_le_bytes());
    std::fs::create_dir(folder.path("ct")).expect("a folder");
    for (number, pixels) in all.chunks(12).enumerate() {
        let z = FIRST[2] + STEP[2] * number as f64;
        let file = [
            vec![0; 128],
            b"DICM".to_vec(),
            text(2, 0x10, "UI", "1.2.840.10008.1.2.1\0".into()),
            text(8, 0x60, "CS", "CT".into()),
            text(0x20, 0xe, "UI", "1.2.3\0".into()),
            text(0x20, 0x13, "IS", format!("{}", number + 1)),
            text(0x20, 0x32, "DS", format!("{}\\{}\\{z}", -last(0), -last(1))),
            text(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0".into()),
            short(2, 1),
            text(0x28, 4, "CS", "MONOCHROME2".into()),
            short(0x10, 4),
            short(0x11, 3),
            text(0x28, 0x30, "DS", "2\\1".into()),
            short(0x100, 8),
            short(0x101, 8),
            short(0x102, 7),
            short(0x103, 0),
            element(0x7fe0, 0x10, "OB", pixels),
        ];
        folder.write(&format!("ct/{number}.dcm"), file.concat());
    }
    folder.path("ct")
}

fn load(path: &Path) -> Volume {
    load_volume(path, &Limits::default(), &ReadOptions::default()).expect("a volume")
}

/// The values with the places where they lie, in an order of their own.
fn body(volume: &Volume) -> Vec<(u8, DVec3)> {
    let mut all: Vec<(u8, DVec3)> = (0..volume.len())
        .map(|i| (volume.value(i) as u8, volume.lattice.sample_position(i)))
        .collect();
    all.sort_by_key(|(value, _)| *value);
    all
}

#[test]
fn a_body_lies_at_the_same_place_in_all_formats() {
    let folder = Folder::new();
    let files = [
        folder.write("a.nii", nifti_file()),
        folder.write("ras.nrrd", nrrd_file("right-anterior-superior", [false; 3])),
        folder.write("lps.nrrd", nrrd_file("left-posterior-superior", [true, true, false])),
        folder.write("las.nrrd", nrrd_file("LAS", [true, false, false])),
        folder.write("a.mha", meta_image()),
        dicom_folder(&folder),
    ];
    let expected: Vec<(u8, DVec3)> = {
        let place = |at: [usize; 3]| {
            DVec3::from_array([0, 1, 2].map(|axis| FIRST[axis] + STEP[axis] * at[axis] as f64))
        };
        let mut all = Vec::new();
        for z in 0..DIMS[2] {
            for y in 0..DIMS[1] {
                all.extend((0..DIMS[0]).map(|x| (value([x, y, z]), place([x, y, z]))));
            }
        }
        all.sort_by_key(|(value, _)| *value);
        all
    };
    for path in files {
        let volume = load(&path);
        let name = path.display();
        assert_eq!(volume.about.frame, Frame::Patient, "{name}");
        assert_eq!(volume.about.orientation, Some(Orientation::RAS), "{name}");
        for ((sample, place), (value, expected)) in body(&volume).into_iter().zip(&expected) {
            assert_eq!(sample, *value, "{name}");
            assert!(
                place.distance(*expected) < 1e-4,
                "{name}: {sample} at {place}, not {expected}"
            );
        }
        // What is written stays in the frame.
        let copy = folder.path("copy.nrrd");
        nrrd::write(&volume, &copy).expect("a file");
        let copy = load(&copy);
        assert_eq!((copy.about.frame, body(&copy)), (Frame::Patient, body(&volume)), "{name}");
        let copy = folder.path("copy.splv");
        bricks::write(&volume, &copy, &bricks::WriteOptions::default(), None).expect("bricks");
        let copy = bricks::Bricks::open(&copy, &Limits::default()).expect("bricks");
        assert_eq!(copy.header().frame, Frame::Patient, "{name}");
        assert_eq!(copy.header().lattice, volume.lattice, "{name}");
    }
}

/// Surfaces of 3D Slicer say their space in a comment.
#[test]
fn surfaces_lie_where_their_comment_says() {
    let folder = Folder::new();
    let obj = |space: &str| {
        format!("# 3D Slicer output. SPACE={space}\nv 1 2 3\nv 4 2 3\nv 1 5 3\nf 1 2 3\n")
    };
    let read = |name: &str, text: String| {
        let path = folder.write(name, text);
        load_mesh(path, &Limits::default(), &ReadOptions::default()).expect("a mesh")
    };
    let (lps, ras) = (read("lps.obj", obj("LPS")), read("ras.obj", obj("RAS")));
    let place =
        |mesh: &splatkit::surface::Mesh, at: usize| mesh.origin + mesh.positions[at].as_dvec3();
    assert_eq!(place(&lps, 1), DVec3::new(-4.0, -2.0, 3.0));
    assert_eq!(place(&ras, 1), DVec3::new(4.0, 2.0, 3.0));
    assert_eq!([lps.about.frame, ras.about.frame], [Frame::Patient; 2]);
    let plain = read("plain.obj", "v 1 2 3\nv 4 2 3\nv 1 5 3\nf 1 2 3\n".into());
    assert_eq!((plain.about.frame, place(&plain, 1)), (Frame::Own, DVec3::new(4.0, 2.0, 3.0)));
}
