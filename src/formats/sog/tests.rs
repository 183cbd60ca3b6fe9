use super::*;
use crate::{
    Error,
    input::{Limits, testing::*},
};
use image_webp::{ColorType, WebPEncoder};
use serde_json::{Value, json};
use std::{
    io::{Cursor, Write},
    path::PathBuf,
};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

/// Encodes a plane.
fn webp(width: u32, height: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut out = Vec::new();
    WebPEncoder::new(&mut out)
        .encode(&texels.concat(), width, height, ColorType::Rgba8)
        .expect("encodes");
    out
}

/// Returns texel `j` of entry `e` of the palette, which has five rows of 64 entries.
fn entry(e: usize, j: usize) -> [u8; 4] {
    [e % 64 + j, 100 + j + 20 * (e / 64), 200 - j, 255].map(|byte| byte as u8)
}

/// The planes of a scene of two Gaussians with this degree.
fn planes(degree: u32) -> Vec<(&'static str, Vec<u8>)> {
    let two = |texels: [[u8; 4]; 2]| webp(2, 1, &texels);
    let mut all = vec![
        // 10000 and 0, 55535 and 65535, 7 and 7.
        ("means_l.webp", two([[0x10, 0xef, 7, 255], [0, 0xff, 7, 255]])),
        ("means_u.webp", two([[0x27, 0xd8, 0, 255], [0, 0xff, 0, 255]])),
        ("quats.webp", two([[51, 204, 153, 252], [51, 204, 153, 254]])),
        ("scales.webp", two([[0, 1, 2, 255], [2, 2, 0, 255]])),
        ("sh0.webp", two([[0, 1, 2, 51], [2, 0, 0, 255]])),
    ];
    if degree > 0 {
        let terms = terms(degree) - 1;
        let texels: Vec<_> = (0..320 * terms).map(|at| entry(at / terms, at % terms)).collect();
        all.push(("shN_centroids.webp", webp(64 * terms as u32, 5, &texels)));
        all.push(("shN_labels.webp", two([[70, 0, 0, 255], [1, 1, 0, 255]])));
    }
    all
}

/// The `meta.json` of version 2 for these planes.
fn second(degree: u32) -> Value {
    let mut meta = json!({
        "version": 2,
        "count": 2,
        "means": {
            "mins": [0, -6.5535, 0.5],
            "maxs": [6.5535, 0, 0.5],
            "files": ["means_l.webp", "means_u.webp"]
        },
        "scales": { "codebook": [-1, 0, 0.5], "files": ["scales.webp"] },
        "quats": { "files": ["quats.webp"] },
        "sh0": { "codebook": [-1, 0.25, 2], "files": ["sh0.webp"] }
    });
    if degree > 0 {
        let codebook: Vec<f64> = (0..256).map(|byte| f64::from(byte) / 100.0).collect();
        meta["shN"] = json!({
            "count": 320,
            "bands": degree,
            "codebook": codebook,
            "files": ["shN_centroids.webp", "shN_labels.webp"]
        });
    }
    meta
}

/// The `meta.json` of version 1.
fn first(degree: u32) -> Value {
    let mut meta = second(degree);
    let keys = meta.as_object_mut().expect("an object");
    keys.remove("version");
    keys.remove("count");
    meta["means"]["shape"] = json!([2, 3]);
    meta["scales"] = json!({
        "mins": [-1, -2, 0], "maxs": [0, 0, 2.55], "files": ["scales.webp"]
    });
    meta["sh0"] = json!({
        "mins": [-1, -1, 0, -2], "maxs": [1.55, 0, 2.55, 2], "files": ["sh0.webp"]
    });
    if degree > 0 {
        meta["shN"] = json!({
            "mins": 0, "maxs": 2.55, "files": ["shN_centroids.webp", "shN_labels.webp"]
        });
    }
    meta
}

/// Writes a scene as a folder and returns the path of its `meta.json`.
fn folder_of(folder: &Folder, meta: &Value, degree: u32) -> PathBuf {
    for (name, bytes) in planes(degree) {
        folder.write(name, bytes);
    }
    folder.write("meta.json", meta.to_string())
}

fn archive(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        writer.start_file(*name, stored).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

fn archive_of(meta: &Value, degree: u32) -> Vec<u8> {
    let mut files = planes(degree);
    files.push(("meta.json", meta.to_string().into_bytes()));
    archive(&files)
}

fn message(folder: &Folder, meta: &Value, degree: u32) -> String {
    read_with(&folder_of(folder, meta, degree), read).unwrap_err().to_string()
}

fn near(actual: &[f32], wanted: &[f32]) {
    assert_eq!(actual.len(), wanted.len());
    let is_near = |(a, b): (&f32, &f32)| (a - b).abs() <= 2e-6 * b.abs().max(1.0);
    assert!(actual.iter().zip(wanted).all(is_near), "{actual:?} is not {wanted:?}");
}

/// Checks what both versions share.
fn check_places(set: &Gaussians) {
    let e = std::f32::consts::E - 1.0;
    let z = 0.648_721_3;
    near(&(set.centers[0] + set.origin.as_vec3()).to_array(), &[e, -e, z]);
    near(&(set.centers[1] + set.origin.as_vec3()).to_array(), &[0.0, 0.0, z]);
    near(&set.rotations[0].to_array(), &[-0.424_264_1, 0.424_264_1, 0.141_421_36, 0.787_400_8]);
    near(&set.rotations[1].to_array(), &[0.424_264_1, 0.787_400_8, 0.141_421_36, -0.424_264_1]);
}

/// Checks the harmonics above the constant term.
fn check_harmonics(set: &Gaussians, degree: u32) {
    assert_eq!(set.degree, degree);
    for j in 1..terms(degree) {
        let at = (j - 1) as f32;
        let wanted = [6.0 + at, 120.0 + at, 200.0 - at].map(|byte| byte / 100.0);
        near(&set.harmonics_of(0)[j], &wanted);
        let wanted = [1.0 + at, 180.0 + at, 200.0 - at].map(|byte| byte / 100.0);
        near(&set.harmonics_of(1)[j], &wanted);
    }
}

/// Checks scenes of each degree, from a folder and from an archive.
fn check_scenes(meta: fn(u32) -> Value, check: fn(&Gaussians)) {
    let folder = Folder::new();
    for degree in 0..=3 {
        let meta = meta(degree);
        let zipped = folder.write("a.sog", archive_of(&meta, degree));
        for path in [folder_of(&folder, &meta, degree), zipped] {
            let set = read_with(&path, read).unwrap();
            assert_eq!((set.len(), set.broken.all(), set.validate()), (2, 0, Ok(())));
            check_places(&set);
            check_harmonics(&set, degree);
            check(&set);
        }
    }
}

#[test]
fn the_second_version_has_codebooks() {
    check_scenes(second, |set| {
        near(&set.scales[0].to_array(), &[0.367_879_45, 1.0, 1.648_721_3]);
        near(&set.scales[1].to_array(), &[1.648_721_3, 1.648_721_3, 0.367_879_45]);
        near(&set.opacities, &[0.2, 1.0]);
        near(&set.harmonics_of(0)[0], &[-1.0, 0.25, 2.0]);
        near(&set.harmonics_of(1)[0], &[2.0, -1.0, -1.0]);
    });
}

#[test]
fn the_first_version_has_ranges() {
    check_scenes(first, |set| {
        let logs = [-1.0, -2.0 + 2.0 / 255.0, 0.02f64];
        near(&set.scales[0].to_array(), &logs.map(|log| log.exp() as f32));
        // The sigmoid of −1.2 and of 2.
        near(&set.opacities, &[0.231_475_22, 0.880_797_1]);
        near(&set.harmonics_of(0)[0], &[-1.0, -1.0 + 1.0 / 255.0, 0.02]);
    });
}

#[test]
fn rotations_leave_out_the_largest_component() {
    let (a, b, c, d) = (-0.424_264_1, 0.424_264_1, 0.141_421_36, 0.787_400_8);
    for (tag, wanted) in
        [(252, [a, b, c, d]), (253, [d, b, c, a]), (254, [b, d, c, a]), (255, [b, c, d, a])]
    {
        near(&rotation([51, 204, 153, tag]).to_array(), &wanted);
    }
    assert_eq!(rotation([51, 204, 153, 251]), Quat::IDENTITY);
    // Rounding may leave nothing for the largest.
    assert!(rotation([255; 4]).is_finite());
}

#[test]
fn codebooks_may_begin_with_null_and_end_early() {
    let folder = Folder::new();
    let mut meta = second(0);
    let mut codebook = vec![Value::Null; 256];
    codebook[1] = json!(-2);
    codebook[2] = json!(0);
    codebook[255] = json!(253);
    meta["scales"]["codebook"] = json!(codebook);
    let set = read_with(&folder_of(&folder, &meta, 0), read).unwrap();
    near(&set.scales[0].to_array(), &[-3.0, -2.0, 0.0f32].map(f32::exp));
    meta["scales"]["codebook"] = json!([-1, 0]);
    let error = message(&folder, &meta, 0);
    assert!(error.contains("none of the 2"), "{error}");
}

#[test]
fn other_texts_are_errors() {
    let folder = Folder::new();
    type Change = fn(&mut Value);
    let change: [(Change, &str); 14] = [
        (|m| m["version"] = json!(3), "the version 3"),
        (|m| m["version"] = json!("two"), "invalid type"),
        (|m| m["count"] = Value::Null, "no “count”"),
        (|m| m["count"] = json!(3), "means.files[0]: the plane has 2 × 1 pixels"),
        (|m| m["count"] = json!(1u64 << 30), "fewer than the 1073741824 needed"),
        (|m| m["means"]["files"] = json!(["means_l.webp"]), "“means” names 1 files"),
        (|m| m["means"]["mins"] = json!([0, 1]), "invalid length 2"),
        (|m| m["scales"]["codebook"] = json!([]), "“scales” has no codebook"),
        (|m| m["sh0"]["files"][0] = json!("../sh0.webp"), "sh0.files[0]: refers to"),
        (|m| m["sh0"]["files"][0] = json!("meta.json"), "the file itself"),
        (|m| m["quats"]["files"][0] = json!("other.webp"), "quats.files[0]: refers to"),
        (|m| m["shN"]["bands"] = json!(2), "has 2 bands"),
        (|m| m["shN"]["count"] = json!(70), "Gaussian 0: has the harmonics 70"),
        (|m| m["shN"]["files"][0] = json!("sh0.webp"), "is 2 pixels wide"),
    ];
    for (change, word) in change {
        let mut meta = second(1);
        change(&mut meta);
        let error = message(&folder, &meta, 1);
        assert!(error.contains(word), "{error}");
    }
    let mut meta = first(0);
    meta["sh0"]["mins"] = json!([0, 0, 0]);
    let error = message(&folder, &meta, 0);
    assert!(error.contains("“sh0” has no mins and maxs for channel 3"), "{error}");
    let mut meta = second(1);
    meta["shN"]["bands"] = json!(0);
    assert_eq!(read_with(&folder_of(&folder, &meta, 1), read).unwrap().degree, 0);
}

#[test]
fn counts_and_pictures_have_limits() {
    let folder = Folder::new();
    let mut meta = second(0);
    meta["count"] = json!(1u64 << 40);
    let error = read_with(&folder_of(&folder, &meta, 0), read).unwrap_err();
    assert!(matches!(error, Error::Limit { .. }), "{error}");
    let path = folder_of(&folder, &second(0), 0);
    let limits = Limits { texels: 1, ..Limits::default() };
    let error = read(&Source::open(&path, &limits).unwrap()).unwrap_err();
    assert!(error.to_string().contains("means.files[0]: the number of texels"), "{error}");
    // The picture has 16383 × 16383 texels by its header, far more than are needed.
    let size: u32 = 16382 | (16382 << 14);
    let mut large = b"RIFF\x12\0\0\0WEBPVP8L\x05\0\0\0\x2f".to_vec();
    large.extend(size.to_le_bytes());
    folder.write("means_l.webp", large);
    let limits = Limits { bytes: 1 << 20, ..Limits::default() };
    let error = read(&Source::open(&path, &limits).unwrap()).unwrap_err();
    assert!(
        error.to_string().contains("means.files[0]: the plane has 16383 × 16383 pixels"),
        "{error}"
    );
}

#[test]
fn planes_are_lossless_webp() {
    let folder = Folder::new();
    let path = folder_of(&folder, &second(0), 0);
    let whole = std::fs::read(folder.path("scales.webp")).unwrap();
    let lossy = b"RIFF\x16\0\0\0WEBPVP8 \x0a\0\0\0\0\0\0\x9d\x01\x2a\x02\0\x01\0".to_vec();
    for (bytes, word) in [
        (png(2, 1, &[[0; 4]; 2]), "is not a WebP picture"),
        (Vec::new(), "is not a WebP picture"),
        (lossy, "lossy"),
        (whole[..14].to_vec(), "cannot be decoded"),
        (whole[..24].to_vec(), "cannot be decoded"),
        (webp(1, 1, &[[0, 0, 0, 255]]), "fewer than the 2 needed"),
    ] {
        let plane = folder.write("scales.webp", bytes);
        let Error::Input { file, place, message, .. } = read_with(&path, read).unwrap_err() else {
            panic!("another error for {word}");
        };
        assert_eq!((file, &place[..]), (plane, "scales.files[0]"));
        assert!(message.contains(word), "{message}");
    }
    // A plane without alpha has the alpha 255, the tag of the largest z.
    let mut opaque = Vec::new();
    let quats = WebPEncoder::new(&mut opaque);
    quats.encode(&[51, 204, 153, 51, 204, 153], 2, 1, ColorType::Rgb8).unwrap();
    folder.write("scales.webp", whole);
    folder.write("quats.webp", opaque);
    let set = read_with(&path, read).unwrap();
    near(&set.rotations[0].to_array(), &[0.424_264_1, 0.141_421_36, 0.787_400_8, -0.424_264_1]);
}

#[test]
fn cuts_are_errors() {
    let folder = Folder::new();
    every_cut(&folder, "a.sog", &archive_of(&second(0), 0), read);
    folder_of(&folder, &second(1), 1);
    every_cut(&folder, "meta.json", second(1).to_string().as_bytes(), read);
}

#[test]
fn other_archives_are_errors() {
    let folder = Folder::new();
    let meta = |meta: Value| meta.to_string().into_bytes();
    let mut large = second(0).to_string();
    large.push_str(&" ".repeat(1 << 20));
    for (files, word) in [
        (vec![], "contains no meta.json"),
        (vec![("a.npy", Vec::new())], "contains no meta.json"),
        (
            vec![("lod-meta.json", meta(json!({})))],
            "contains a streamed SOG scene (lod-meta.json), which",
        ),
        (vec![("meta.json", b"{\xff}".to_vec())], "meta.json: byte 1 is not UTF-8"),
        (vec![("meta.json", large.into_bytes())], "may have at most 1048576"),
        (vec![("meta.json", meta(second(0)))], "“means_l.webp”, which is not in the archive"),
    ] {
        let path = folder.write("a.sog", archive(&files));
        let error = read_with(&path, read).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn first_bytes_say_what_a_file_is() {
    for meta in [first(0), first(3), second(0), second(3)] {
        assert!(is_meta(meta.to_string().as_bytes()));
        assert!(is_meta(format!("\n  {meta:#}").as_bytes()));
        assert!(is_sog(&archive_of(&meta, 0)));
        assert!(!is_meta(&archive_of(&meta, 0)));
    }
    assert!(is_sog(&archive(&[("meta.json", Vec::new())])));
    for bytes in [
        &b""[..],
        b"PK\x03\x04",
        b"{}",
        br#"["means", "mins"]"#,
        br#"{"asset": {"version": "2.0"}, "images": [{"uri": "a.webp"}]}"#,
        br#"{"means": 3}"#,
        &archive(&[("ct.npy", Vec::new())])[..],
        &archive(&[])[..],
    ] {
        assert!(!is_sog(bytes) && !is_meta(bytes), "{bytes:?}");
    }
    let whole = archive(&[("meta.json", Vec::new())]);
    assert!((0..39).all(|end| !is_sog(&whole[..end])) && is_sog(&whole[..39]));
}
