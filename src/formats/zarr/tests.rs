//! Stores that the tests write: both versions of Zarr, codecs, shards, and what is wrong with
//! damaged ones.

use super::{
    array::Layout,
    blosc,
    chunks::{Array, Objects, Part},
    codecs::{Chain, Codec, crc32c},
    read as read_source,
};
use crate::{
    Error, Result,
    formats::{Kind, ReadOptions, load_volume},
    input::{
        Limits, Source,
        testing::{Folder, warnings_of},
    },
    volume::Volume,
};
use flate2::{Compression, write::GzEncoder, write::ZlibEncoder};
use serde_json::{Value, json};
use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
    sync::{Arc, Condvar, Mutex},
    time::Duration,
};

/// Writes a file of a store, and the folders around it.
fn put(folder: &Folder, name: &str, bytes: impl AsRef<[u8]>) {
    let path = folder.path(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

fn put_json(folder: &Folder, name: &str, value: &Value) {
    put(folder, name, value.to_string());
}

fn all_channels() -> ReadOptions {
    ReadOptions { channels: Some(Vec::new()), ..ReadOptions::default() }
}

fn load(folder: &Folder, name: &str, options: &ReadOptions) -> Result<Volume> {
    load_volume(folder.path(name), &Limits::default(), options)
}

fn values(volume: &Volume) -> Vec<f64> {
    (0..volume.len()).map(|index| volume.value(index)).collect()
}

/// The metadata of an array of Zarr 2.
fn zarray(shape: &[usize], chunks: &[usize], dtype: &str, more: Value) -> Value {
    let mut metadata = json!({
        "zarr_format": 2, "shape": shape, "chunks": chunks, "dtype": dtype, "compressor": null,
        "filters": null, "fill_value": 0, "order": "C",
    });
    for (name, value) in more.as_object().into_iter().flatten() {
        metadata[name] = value.clone();
    }
    metadata
}

/// The metadata of an array of Zarr 3.
fn zarr3(shape: &[usize], chunks: &[usize], kind: &str, codecs: Value) -> Value {
    json!({
        "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": kind,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunks}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": 0, "codecs": codecs,
    })
}

#[test]
fn chunks_join_to_an_array() {
    let folder = Folder::new();
    // 2 × 3 × 4 in chunks of 2 × 2 × 3: the last ones reach beyond.
    let value = |z: usize, y: usize, x: usize| (100 * z + 10 * y + x) as u16;
    let chunk = |y0: usize, x0: usize| -> Vec<u8> {
        let at = (0..2).flat_map(|z| (0..2).flat_map(move |y| (0..3).map(move |x| (z, y, x))));
        at.flat_map(|(z, y, x)| value(z, y0 + y, x0 + x).to_be_bytes()).collect()
    };
    put_json(
        &folder,
        "a.zarr/.zarray",
        &zarray(&[2, 3, 4], &[2, 2, 3], ">u2", json!({"fill_value": 7})),
    );
    for (name, y, x) in [("0.0.0", 0, 0), ("0.0.1", 0, 3), ("0.1.0", 2, 0)] {
        put(&folder, &format!("a.zarr/{name}"), chunk(y, x));
    }
    let volume = load(&folder, "a.zarr", &ReadOptions::default()).unwrap();
    assert_eq!(volume.lattice.dims, [4, 3, 2]);
    let expected = (0..2).flat_map(|z| {
        (0..3).flat_map(move |y| {
            (0..4).map(move |x| {
                // The chunk of the last column and row was never written.
                f64::from(if y == 2 && x == 3 { 7 } else { value(z, y, x) })
            })
        })
    });
    assert_eq!(values(&volume), expected.collect::<Vec<_>>());
}

/// A chunk of 2 × 2 × 2 bytes, packed by each codec.
fn packed(codec: &str) -> Vec<u8> {
    let bytes = [1u8, 2, 3, 4, 5, 6, 7, 8];
    match codec {
        "gzip" => {
            let mut packer = GzEncoder::new(Vec::new(), Compression::default());
            packer.write_all(&bytes).unwrap();
            packer.finish().unwrap()
        }
        "zlib" => zlib(&bytes),
        "zstd" => zstd::bulk::compress(&bytes, 3).unwrap(),
        "lz4" => [&8u32.to_le_bytes()[..], &lz4_flex::block::compress(&bytes)].concat(),
        "crc32c" => [&bytes[..], &crc32c(&bytes).to_le_bytes()].concat(),
        "blosc" => blosc_of(&bytes, 1, 3 << 5, &zlib(&bytes)),
        other => panic!("{other}"),
    }
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::default());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

/// A container of Blosc of one block with one stream.
fn blosc_of(bytes: &[u8], element: u8, flags: u8, stream: &[u8]) -> Vec<u8> {
    let size = (bytes.len() as u32).to_le_bytes();
    let all = (24 + stream.len() as u32).to_le_bytes();
    let (start, length) = (20u32.to_le_bytes(), (stream.len() as u32).to_le_bytes());
    [&[2, 1, flags, element][..], &size, &size, &all, &start, &length, stream].concat()
}

#[test]
fn every_codec_is_unpacked_and_named_if_it_fails() {
    for codec in ["gzip", "zlib", "zstd", "lz4", "crc32c", "blosc"] {
        let folder = Folder::new();
        let codecs = json!([{"name": "bytes"}, {"name": codec, "configuration": {}}]);
        put_json(&folder, "a.zarr/zarr.json", &zarr3(&[2, 2, 2], &[2, 2, 2], "uint8", codecs));
        let whole = packed(codec);
        put(&folder, "a.zarr/c/0/0/0", &whole);
        let volume = load(&folder, "a.zarr", &ReadOptions::default()).unwrap();
        assert_eq!(values(&volume), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], "{codec}");
        for end in 0..whole.len() {
            put(&folder, "a.zarr/c/0/0/0", &whole[..end]);
            let error = load(&folder, "a.zarr", &ReadOptions::default());
            let Err(Error::Input { file, place, .. }) = error else { panic!("{codec}: {end}") };
            assert!(file.ends_with("c/0/0/0") && place == "chunk (0, 0, 0)", "{codec}: {file:?}");
        }
    }
    let folder = Folder::new();
    let codecs = json!([{"name": "bytes"}, {"name": "pcodec", "configuration": {}}]);
    put_json(&folder, "a.zarr/zarr.json", &zarr3(&[2, 2, 2], &[2, 2, 2], "uint8", codecs));
    let error = load(&folder, "a.zarr", &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("names the codec “pcodec”, which is not read"), "{error}");
}

#[test]
fn shuffled_bytes_and_bits_are_put_back() {
    let bytes: Vec<u8> = (0..32).collect();
    let planes: Vec<u8> = [0, 1].iter().flat_map(|at| (0..16).map(move |n| 2 * n + at)).collect();
    let container = blosc_of(&bytes, 2, 1 | 16, &planes);
    assert_eq!(blosc::unpack(&container, 32).unwrap(), bytes);
    // The lowest bit of element 0, and the highest of element 9, of 16 elements of one byte.
    let mut bits = vec![0; 16];
    (bits[0], bits[15]) = (1, 2);
    let mut elements = vec![0; 16];
    (elements[0], elements[9]) = (1, 128);
    let container = blosc_of(&elements, 1, 4 | 16, &bits);
    assert_eq!(blosc::unpack(&container, 16).unwrap(), elements);
    assert!(blosc::unpack(&container, 15).unwrap_err().contains("16 unpacked bytes"));
    // Three literals, then a match of nine bytes at a distance of three.
    let stream = [2, b'a', b'b', b'c', 6 << 5, 2];
    let text = b"abcabcabcab";
    let container = blosc_of(text, 1, 16, &stream);
    assert_eq!(blosc::unpack(&container, 11).unwrap(), text);
    // A match before the beginning.
    let container = blosc_of(text, 1, 16, &[0, b'a', 6 << 5, 9]);
    assert!(blosc::unpack(&container, 11).unwrap_err().contains("before its beginning"));
}

#[test]
fn turned_axes_are_turned_back() {
    let chain = Chain { order: vec![2, 0, 1], packing: Vec::new() };
    // An array (2, 1, 3) of the values 10 z + x, stored as (x, z, y).
    let stored = vec![0, 10, 1, 11, 2, 12];
    assert_eq!(chain.decode(stored, &[2, 1, 3], 1).unwrap(), [0, 1, 2, 10, 11, 12]);
    let chain = Chain { order: Vec::new(), packing: vec![Codec::Shuffle(2)] };
    assert_eq!(chain.decode(vec![0, 2, 1, 3], &[2], 2).unwrap(), [0, 1, 2, 3]);
    assert_eq!(crc32c(b"123456789"), 0xe306_9283);
}

#[test]
fn shards_say_where_their_chunks_are() {
    let index = json!([{"name": "bytes"}, {"name": "crc32c"}]);
    for location in ["end", "start"] {
        let folder = Folder::new();
        let codecs = json!([{"name": "sharding_indexed", "configuration": {
            "chunk_shape": [1, 1, 2], "codecs": [{"name": "bytes"}], "index_codecs": index,
            "index_location": location,
        }}]);
        put_json(&folder, "a.zarr/zarr.json", &zarr3(&[1, 2, 2], &[1, 2, 2], "uint8", codecs));
        // The second chunk was never written.
        let start = if location == "end" { 0 } else { 36u64 };
        let list: Vec<u8> =
            [start, 2, u64::MAX, u64::MAX].iter().flat_map(|n| n.to_le_bytes()).collect();
        let index = [&list[..], &crc32c(&list).to_le_bytes()].concat();
        let chunk = &[5u8, 6][..];
        let shard = if location == "end" { [chunk, &index] } else { [&index, chunk] }.concat();
        put(&folder, "a.zarr/c/0/0/0", &shard);
        let read = || load(&folder, "a.zarr", &ReadOptions::default());
        assert_eq!(values(&read().unwrap()), [5.0, 6.0, 0.0, 0.0], "{location}");
        for end in 1..shard.len() {
            put(&folder, "a.zarr/c/0/0/0", &shard[..end]);
            assert!(read().is_err(), "{location}: {end}");
        }
        let mut broken = shard.clone();
        broken[if location == "end" { 3 } else { 1 }] ^= 1;
        put(&folder, "a.zarr/c/0/0/0", &broken);
        let error = read().unwrap_err().to_string();
        assert!(error.contains("the list of chunks: does not have the checksum"), "{error}");
    }
}

/// Writes an image of two times, three channels and two levels: (t, c, z, y, x) is (2, 3, 2, 16,
/// 32), and the second level is half as wide and high. `version` is 2 or 3, of Zarr.
fn image(folder: &Folder, group: &str, version: u8) {
    let transform = |x: f64| {
        json!([
            {"type": "scale", "scale": [1.0, 1.0, 2.0, 0.5 * x, 0.5 * x]},
            {"type": "translation", "translation": [0.0, 0.0, 3.0, 0.0, 0.25 * (x - 1.0)]},
        ])
    };
    let axis = |name: &str, kind: &str| json!({"name": name, "type": kind, "unit": "micrometer"});
    let channel = |name: &str, color: &str, active: bool| {
        let window = json!({"start": 1.0, "end": 90.0, "min": 0.0, "max": 255.0});
        json!({"label": name, "color": color, "active": active, "window": window})
    };
    let attributes = json!({
        "multiscales": [{
            "axes": [axis("t", "time"), axis("c", "channel"), axis("z", "space"),
                axis("y", "space"), axis("x", "space")],
            "datasets": [
                {"path": "0", "coordinateTransformations": transform(1.0)},
                {"path": "1", "coordinateTransformations": transform(2.0)},
            ],
        }],
        "omero": {"channels": [channel("DAPI", "0000FF", true), channel("GFP", "00FF00", true),
            channel("Bright", "FF0000", false)]},
    });
    for (level, [y, x]) in [[16, 32], [8, 16]].into_iter().enumerate() {
        let (shape, chunks) = ([2, 3, 2, y, x], [1, 1, 2, y, x]);
        let path = format!("{group}/{level}");
        for (t, c) in (0..2).flat_map(|t| (0..3).map(move |c| (t, c))) {
            let bytes: Vec<u8> =
                (0..2 * y * x).map(|at| (100 * level + 40 * t + 20 * c + at) as u8).collect();
            let start = if version == 2 { "" } else { "c/" };
            put(folder, &format!("{path}/{start}{t}/{c}/0/0/0"), bytes);
        }
        if version == 2 {
            let more = json!({"dimension_separator": "/"});
            put_json(folder, &format!("{path}/.zarray"), &zarray(&shape, &chunks, "|u1", more));
        } else {
            let metadata = zarr3(&shape, &chunks, "uint8", json!([{"name": "bytes"}]));
            put_json(folder, &format!("{path}/zarr.json"), &metadata);
        }
    }
    put_group(folder, group, version, &attributes);
}

fn put_group(folder: &Folder, group: &str, version: u8, attributes: &Value) {
    if version == 2 {
        put_json(folder, &format!("{group}/.zgroup"), &json!({"zarr_format": 2}));
        put_json(folder, &format!("{group}/.zattrs"), attributes);
    } else {
        let attributes = json!({"ome": attributes});
        let metadata = json!({"zarr_format": 3, "node_type": "group", "attributes": attributes});
        put_json(folder, &format!("{group}/zarr.json"), &metadata);
    }
}

#[test]
fn images_have_levels_channels_and_times() {
    for version in [2, 3] {
        let folder = Folder::new();
        image(&folder, "a.zarr", version);
        let (volume, words) = warnings_of(|| load(&folder, "a.zarr", &all_channels()).unwrap());
        assert_eq!(words.len(), 2, "{words:?}");
        assert!(words[0].ends_with("shows the first of 2 times; --time 1 shows the second"));
        assert!(words[1].contains("leaves out what its metadata turns off (Bright)"), "{words:?}");
        assert_eq!((volume.lattice.dims, volume.more_channels.len()), ([32, 16, 2], 1));
        assert_eq!(volume.lattice.spacing().to_array(), [0.5, 0.5, 2.0]);
        assert_eq!(volume.lattice.origin.to_array(), [0.0, 0.0, 3.0]);
        let about = &volume.about;
        assert_eq!((about.name.as_str(), about.length.as_str()), ("DAPI", "µm"));
        assert_eq!((about.window, about.channel), (Some([1.0, 90.0]), 0));
        assert_eq!(about.channels[1].color, Some([0.0, 1.0, 0.0]));
        assert_eq!(volume.more_channels[0].about.name, "GFP");
        assert_eq!(values(&volume)[..3], [0.0, 1.0, 2.0]);
        assert_eq!(values(&volume.more_channels[0])[0], 20.0);
        // Another level, time and channel.
        let options = ReadOptions {
            dataset: Some("1".into()),
            time: Some(1),
            ..ReadOptions::scalar(Some("bright"))
        };
        let volume = load(&folder, "a.zarr", &options).unwrap();
        assert_eq!((volume.lattice.dims, values(&volume)[0]), ([16, 8, 2], 180.0));
        assert_eq!(volume.lattice.spacing().to_array(), [1.0, 1.0, 2.0]);
        assert_eq!(volume.lattice.origin.x, 0.25);
        // A limit that only the second level fits.
        let limits = Limits { bytes: 3000, ..Limits::default() };
        let coarse = || load_volume(folder.path("a.zarr"), &limits, &ReadOptions::default());
        let (coarse, words) = warnings_of(coarse);
        assert_eq!(coarse.unwrap().lattice.dims, [16, 8, 2]);
        assert!(words[0].contains("shows level 1 of 2 (16 × 8 × 2 samples)"), "{words:?}");
    }
}

#[test]
fn an_only_channel_has_the_colour_of_its_metadata() {
    for (color, has) in [("FF8000", true), ("FFFFFF", false)] {
        let folder = Folder::new();
        let attributes = json!({
            "multiscales": [{"datasets": [{"path": "0"}]}],
            "omero": {"channels": [{"label": "EB3", "color": color}]},
        });
        put_group(&folder, "a.zarr", 2, &attributes);
        put_json(&folder, "a.zarr/0/.zarray", &zarray(&[2, 2, 2], &[2, 2, 2], "|u1", json!({})));
        put(&folder, "a.zarr/0/0.0.0", [0, 1, 2, 3, 4, 5, 6, 7]);
        let about = load(&folder, "a.zarr", &all_channels()).unwrap().about;
        assert_eq!(
            (about.channels.len(), about.name.as_str()),
            if has { (1, "EB3") } else { (0, "") }
        );
    }
}

#[test]
fn plates_series_and_labels_lead_to_images() {
    for version in [2, 3] {
        let folder = Folder::new();
        image(&folder, "a.zarr/A/1/0", version);
        put_group(&folder, "a.zarr/A/1", version, &json!({"well": {"images": [{"path": "0"}]}}));
        let wells = json!({"plate": {"wells": [{"path": "A/1"}, {"path": "B/2"}]}});
        put_group(&folder, "a.zarr", version, &wells);
        let (volume, words) = warnings_of(|| load(&folder, "a.zarr", &ReadOptions::default()));
        assert_eq!(volume.unwrap().about.name, "DAPI");
        let note = "shows “A/1”, the first of 2 wells of a plate; --dataset B/2 shows the second";
        assert!(words[0].ends_with(note), "{words:?}");
        image(&folder, "b.zarr/0", version);
        image(&folder, "b.zarr/1", version);
        put_group(&folder, "b.zarr", version, &json!({"bioformats2raw.layout": 3}));
        let (volume, words) = warnings_of(|| load(&folder, "b.zarr", &ReadOptions::default()));
        assert_eq!(volume.unwrap().about.name, "DAPI");
        assert!(words[0].contains("the first of 2 series"), "{words:?}");
        // Labels, with the second level of the image that they belong to.
        put_group(&folder, "b.zarr/0/labels", version, &json!({"labels": ["cells"]}));
        let colors = json!([{"label-value": 2, "rgba": [255, 0, 0, 255]}]);
        let labels = json!({
            "multiscales": [{"axes": [{"name": "y"}, {"name": "x"}], "datasets": [{"path": "0"}]}],
            "image-label": {"colors": colors, "properties": [{"label-value": 2, "name": "wall"}]},
        });
        put_group(&folder, "b.zarr/0/labels/cells", version, &labels);
        let metadata = zarray(&[2, 2], &[2, 2], "<i4", json!({}));
        put_json(&folder, "b.zarr/0/labels/cells/0/.zarray", &metadata);
        let bytes: Vec<u8> = [0i32, 2, 2, 5].iter().flat_map(|n| n.to_le_bytes()).collect();
        put(&folder, "b.zarr/0/labels/cells/0/0.0", bytes);
        let named =
            ReadOptions { dataset: Some("0/labels/cells".into()), ..ReadOptions::default() };
        let volume = load(&folder, "b.zarr", &named).unwrap();
        let labels = volume.about.labels.unwrap();
        assert_eq!((labels.present.clone(), labels.name(2)), (vec![0, 2, 5], "wall".to_owned()));
        assert_eq!(labels.get(2).unwrap().color, Some([1.0, 0.0, 0.0]));
    }
}

#[test]
fn what_is_wrong_with_a_store_is_said() {
    let of = |files: &[(&str, Value)], options: &ReadOptions| {
        let folder = Folder::new();
        fs::create_dir(folder.path("a.zarr")).unwrap();
        files.iter().for_each(|(name, value)| put_json(&folder, &format!("a.zarr/{name}"), value));
        load(&folder, "a.zarr", options).unwrap_err().to_string()
    };
    let plain = ReadOptions::default();
    let named = |name: &str| ReadOptions { dataset: Some(name.into()), ..ReadOptions::default() };
    let level = |path: &str| json!({"multiscales": [{"datasets": [{"path": path}]}]});
    let array =
        |shape: &[usize], dtype: &str| zarray(shape, &vec![1; shape.len()], dtype, json!({}));
    let huge = |chunk: usize| zarray(&[1 << 20; 3], &[chunk; 3], "|u1", json!({}));
    for (files, options, words) in [
        (vec![], &plain, "has no zarr.json, .zarray, .zgroup or .zattrs"),
        (vec![(".zattrs", level("../b"))], &plain, "“../b”, which is no path inside the store"),
        (vec![(".zattrs", level("/etc"))], &plain, "“/etc”, which is no path inside the store"),
        (vec![(".zattrs", level("0"))], &plain, "“0”: is the array of a level, but there is no"),
        (vec![(".zattrs", json!({"multiscales": []}))], &plain, "has no image in the list"),
        (vec![(".zattrs", json!({"multiscales": [{"datasets": []}]}))], &plain, "has no level in"),
        (vec![(".zarray", array(&[2, 2, 2], "<M8[s]"))], &plain, "has the type “<M8[s]”"),
        (vec![(".zarray", array(&[2], "|u1"))], &plain, "has the shape (2), but a volume has"),
        (vec![(".zarray", array(&[0, 2, 2], "|u1"))], &plain, "has the shape (0, 2, 2)"),
        (vec![(".zarray", json!({"zarr_format": 9}))], &plain, "has no “zarr_format” of 2 or 3"),
        (vec![(".zarray", huge(64))], &plain, "over the limit"),
        (vec![(".zarray", huge(1 << 20))], &plain, "has chunks of 1152921504606846976 bytes"),
        (vec![(".zgroup", json!({"zarr_format": 2}))], &plain, "neither images of OME-Zarr nor"),
        (vec![(".zgroup", json!({}))], &named("b"), "has no array or group “b”"),
        (vec![(".zgroup", json!({}))], &named("../b"), "a path inside the store is expected"),
    ] {
        let error = of(&files, options);
        assert!(error.contains("a.zarr") && error.contains(words), "{words}: {error}");
    }
    let folder = Folder::new();
    put(&folder, "a.zarr/.zarray", "{\"zarr_format\": 2,\n nonsense}");
    let error = load(&folder, "a.zarr", &plain).unwrap_err().to_string();
    assert!(error.contains(".zarray: line 2: is no valid JSON"), "{error}");
}

#[test]
fn archives_are_stores_too() {
    let folder = Folder::new();
    image(&folder, "a.zarr", 3);
    for (prefix, method) in
        [("", zip::CompressionMethod::Stored), ("inside/a.zarr/", zip::CompressionMethod::Deflated)]
    {
        let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        let options = zip::write::SimpleFileOptions::default().compression_method(method);
        let mut open = vec![folder.path("a.zarr")];
        while let Some(path) = open.pop() {
            if path.is_dir() {
                open.extend(fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
                continue;
            }
            let name = path.strip_prefix(folder.path("a.zarr")).unwrap().to_str().unwrap();
            archive.start_file(format!("{prefix}{name}"), options).unwrap();
            archive.write_all(&fs::read(&path).unwrap()).unwrap();
        }
        let bytes = archive.finish().unwrap().into_inner();
        put(&folder, "b.zarr.zip", &bytes);
        let volume = load(&folder, "b.zarr.zip", &all_channels()).unwrap();
        let expected = load(&folder, "a.zarr", &all_channels()).unwrap();
        assert_eq!(values(&volume), values(&expected));
        assert_eq!(volume.about, expected.about);
        // The same bytes in memory, and cut off.
        let limits = Limits::default();
        let of = |bytes: &[u8]| {
            let source = Source::from_bytes(Path::new("b.ozx"), bytes, &limits)?;
            read_source(&source, &all_channels())
        };
        assert_eq!(values(&of(&bytes).unwrap()), values(&volume));
        for end in (0..bytes.len()).step_by(97) {
            assert!(of(&bytes[..end]).is_err(), "{end}");
        }
    }
}

#[cfg(unix)]
#[test]
fn links_stay_in_the_store() {
    let folder = Folder::new();
    put_json(&folder, "a.zarr/.zarray", &zarray(&[1, 1, 2], &[1, 1, 2], "|u1", json!({})));
    put(&folder, "secret", [1, 2]);
    std::os::unix::fs::symlink(folder.path("secret"), folder.path("a.zarr/0.0.0")).unwrap();
    let error = load(&folder, "a.zarr", &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("a link that leaves"), "{error}");
}

#[test]
fn words_of_python_for_numbers_are_read() {
    let folder = Folder::new();
    let metadata = zarray(&[1, 1, 2], &[1, 1, 2], "<f4", json!({"fill_value": "NaN"}));
    put(&folder, "a.zarr/.zarray", metadata.to_string());
    put(&folder, "a.zarr/.zattrs", "{\"NaN \\\"\": [NaN, -Infinity, \"Infinity\"]}");
    put(&folder, "a.zarr/0.0.0", [1f32.to_le_bytes(), 2f32.to_le_bytes()].concat());
    assert_eq!(values(&load(&folder, "a.zarr", &ReadOptions::default()).unwrap()), [1.0, 2.0]);
}

/// A server whose objects are their own names, and which answers once eight are asked for.
#[derive(Default)]
struct Slow {
    asked: Mutex<usize>,
    changed: Condvar,
}

impl Objects for Slow {
    fn get(&self, key: &str, _: Part) -> Result<Option<Vec<u8>>> {
        let mut asked = self.asked.lock().unwrap();
        *asked += 1;
        self.changed.notify_all();
        let wait = Duration::from_secs(20);
        let waited = self.changed.wait_timeout_while(asked, wait, |asked| *asked < 8).unwrap().1;
        assert!(!waited.timed_out(), "objects are read one after the other");
        Ok((key != "n/3").then(|| key.as_bytes()[2..].to_vec()))
    }

    fn place(&self, key: &str) -> PathBuf {
        key.into()
    }

    fn at_once(&self) -> usize {
        8
    }
}

#[test]
fn chunks_of_a_server_are_read_at_the_same_time() {
    let layout = Layout::of(&zarray(&[8], &[1], "|u1", json!({"fill_value": 46}))).unwrap();
    let array = Array::new(Arc::new(Slow::default()), "n", layout);
    let bytes = array.window([&[0], &[8]], &|place| array.chunk(place), &|| Ok(())).unwrap();
    assert_eq!(bytes, *b"012.4567");
}

#[test]
fn large_images_in_levels_are_read_as_bricks() {
    let folder = Folder::new();
    image(&folder, "a.zarr", 3);
    let path = folder.path("a.zarr");
    let kind = |limits: &Limits| Kind::of(&path, limits, &ReadOptions::default()).unwrap();
    assert_eq!(kind(&Limits::default()), Some(Kind::Volume));
    assert_eq!(kind(&Limits { bytes: 3000, ..Limits::default() }), Some(Kind::Bricks));
}
