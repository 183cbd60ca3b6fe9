//! Files that the crate's own encoder writes, and directories written by hand.

use super::*;
use crate::{formats::Kind, input::testing::*};
use std::io::Cursor;
use tiff::{
    encoder::{Compression, TiffEncoder, colortype},
    tags::Tag,
};

/// Encodes pages of 3 × 2 bytes, each with its own values, and a description in the first.
fn bytes_of(pages: u8, description: &str, compression: Compression) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap().with_compression(compression);
    for page in 0..pages {
        let mut image = encoder.new_image::<colortype::Gray8>(3, 2).unwrap();
        if page == 0 && !description.is_empty() {
            image.encoder().write_tag(Tag::ImageDescription, description).unwrap();
        }
        let data: Vec<u8> = (0..6).map(|at| 10 * page + at).collect();
        image.write_data(&data).unwrap();
    }
    file.into_inner()
}

fn load(bytes: &[u8], options: &ReadOptions) -> Result<Volume> {
    let folder = Folder::new();
    read_with(&folder.write("a.tif", bytes), |source| read(source, options))
}

fn values(volume: &Volume) -> Vec<f64> {
    (0..volume.len()).map(|index| volume.value(index)).collect()
}

/// Encodes two pages of 1 × 1 pixels.
macro_rules! pages {
    ($color:ty, $first:expr, $second:expr) => {{
        let mut file = Cursor::new(Vec::new());
        let mut encoder: TiffEncoder<_> = TiffEncoder::new(&mut file).unwrap();
        encoder.write_image::<$color>(1, 1, &$first).unwrap();
        encoder.write_image::<$color>(1, 1, &$second).unwrap();
        file.into_inner()
    }};
}

#[test]
fn pages_are_slices_in_every_compression() {
    let expected = [0., 1., 2., 3., 4., 5., 10., 11., 12., 13., 14., 15.];
    for compression in [
        Compression::Uncompressed,
        Compression::Lzw,
        Compression::Packbits,
        Compression::Deflate(Default::default()),
    ] {
        let bytes = bytes_of(2, "", compression);
        let volume = load(&bytes, &ReadOptions::default()).unwrap();
        assert_eq!(volume.lattice.dims, [3, 2, 2]);
        assert_eq!(values(&volume), expected);
    }
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new_big(&mut file).unwrap();
    for page in 0..2 {
        let data = [page, 7];
        encoder.write_image::<colortype::Gray16>(2, 1, &data).unwrap();
    }
    let volume = load(&file.into_inner(), &ReadOptions::default()).unwrap();
    assert_eq!(values(&volume), [0.0, 7.0, 1.0, 7.0]);
}

#[test]
fn every_type_of_samples_is_read() {
    let default = ReadOptions::default();
    for (bytes, expected) in [
        (pages!(colortype::Gray8, [1], [255]), [1.0, 255.0]),
        (pages!(colortype::GrayI8, [1], [-1]), [1.0, -1.0]),
        (pages!(colortype::Gray16, [1], [65535]), [1.0, 65535.0]),
        (pages!(colortype::GrayI16, [1], [-1]), [1.0, -1.0]),
        (pages!(colortype::Gray32, [1], [70_000]), [1.0, 70_000.0]),
        (pages!(colortype::GrayI32, [1], [-70_000]), [1.0, -70_000.0]),
        (pages!(colortype::Gray64, [1], [1 << 40]), [1.0, (1u64 << 40) as f64]),
        (pages!(colortype::Gray32Float, [0.5], [-2.0]), [0.5, -2.0]),
        (pages!(colortype::Gray64Float, [0.5], [-2.0]), [0.5, -2.0]),
        (pages!(colortype::RGB8, [255, 0, 0], [9, 9, 9]), [76.0, 9.0]),
        (pages!(colortype::RGB16, [1000, 0, 0], [9, 9, 9]), [299.0, 9.0]),
        (pages!(colortype::RGBA8, [0, 255, 0, 7], [9, 9, 9, 9]), [150.0, 9.0]),
    ] {
        assert_eq!(values(&load(&bytes, &default).unwrap()), expected);
    }
    let red = ReadOptions::scalar(Some("red"));
    let colors = pages!(colortype::RGB8, [255, 0, 0], [9, 9, 9]);
    assert_eq!(values(&load(&colors, &red).unwrap()), [255.0, 9.0]);
    assert!(load(&colors, &red).unwrap().colors.is_none());
    let whole = load(&colors, &ReadOptions::default()).unwrap().colors.unwrap();
    assert_eq!(whole.to_vec(), [[255, 0, 0, 255], [9, 9, 9, 255]]);
}

/// A directory of one page of 9 × 1 pixels, in either byte order, and its pixels.
fn by_hand(big: bool, tags: &[(u16, u16, u32)], data: &[u8]) -> Vec<u8> {
    let short = |v: u16| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let long = |v: u32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let mut file = if big { b"MM\0\x2a".to_vec() } else { b"II\x2a\0".to_vec() };
    file.extend(long(8 + data.len() as u32));
    file.extend(data);
    file.extend(short(tags.len() as u16));
    for &(tag, kind, value) in tags {
        file.extend([short(tag), short(kind)].concat());
        file.extend(long(1));
        match kind {
            3 => file.extend([short(value as u16), [0; 2]].concat()),
            _ => file.extend(long(value)),
        }
    }
    file.extend(long(0));
    file
}

#[test]
fn one_directory_may_describe_all_slices() {
    // ImageJ's way to write more than 4 GB. The description stands behind the pixels.
    let text = b"ImageJ=1.53t\nimages=3\nslices=3\n\0";
    let data = [&[0, 1, 0, 2, 1, 0, 1, 1, 2, 0, 2, 1][..], text].concat();
    let size = data.len() as u32;
    let tags = |images: u32| {
        vec![
            (256, 3, 2),
            (257, 3, 1),
            (258, 3, 16),
            (259, 3, 1),
            (262, 3, 1),
            (270, 2, images),
            (273, 4, 8),
            (278, 3, 1),
            (279, 4, 4),
        ]
    };
    let mut file = by_hand(true, &tags(20), &data);
    // The description is a list of bytes: its count and its place.
    let entry = 8 + data.len() + 2 + 5 * 12;
    file[entry + 4..entry + 8].copy_from_slice(&(text.len() as u32).to_be_bytes());
    file[entry + 8..entry + 12].copy_from_slice(&20u32.to_be_bytes());
    let volume = load(&file, &ReadOptions::default()).unwrap();
    assert_eq!(volume.lattice.dims, [2, 1, 3]);
    assert_eq!(values(&volume), [1.0, 2.0, 256.0, 257.0, 512.0, 513.0]);
    // More images than there are bytes.
    let at = file.windows(8).position(|word| word == b"images=3").unwrap();
    let slices = file.windows(8).position(|word| word == b"slices=3").unwrap();
    file[at + 7] = b'9';
    file[slices + 7] = b'9';
    let cut = load(&file[..], &ReadOptions::default());
    assert!(cut.is_ok() || cut.unwrap_err().to_string().contains("is cut off"), "{size}");
}

#[test]
fn bits_are_unpacked() {
    let tags = [
        (256, 3, 9),
        (257, 3, 1),
        (258, 3, 1),
        (259, 3, 1),
        (262, 3, 1),
        (273, 4, 8),
        (277, 3, 1),
        (278, 3, 1),
        (279, 4, 2),
    ];
    for big in [false, true] {
        let folder = Folder::new();
        let path = folder.write("a.tif", by_hand(big, &tags, &[0b1010_0001, 0b1000_0000]));
        let bits = read_with(&path, |source| pages::one(source).map(|read| read.data)).unwrap();
        assert_eq!(bits, [1, 0, 1, 0, 0, 0, 0, 1, 1]);
    }
}

#[test]
fn descriptions_order_the_pages() {
    let text = "ImageJ=1.53t\nimages=4\nchannels=2\nslices=2\nspacing=3\nunit=um\n";
    let bytes = bytes_of(4, text, Compression::Uncompressed);
    let volume = load(&bytes, &ReadOptions::default()).unwrap();
    assert_eq!(volume.lattice.dims, [3, 2, 2]);
    assert_eq!((values(&volume)[0], values(&volume)[6]), (0.0, 20.0));
    assert_eq!(volume.lattice.spacing(), DVec3::new(1.0, 1.0, 3.0));
    assert_eq!(volume.about.length, "µm");
    let second = load(&bytes, &ReadOptions::scalar(Some("channel:1"))).unwrap();
    assert_eq!((values(&second)[0], values(&second)[6]), (10.0, 30.0));
    let third = load(&bytes, &ReadOptions::scalar(Some("channel:2"))).unwrap_err();
    assert!(third.to_string().contains("the channels are 0, 1"), "{third}");
}

#[test]
fn folders_are_read_in_the_order_of_their_numbers() {
    let folder = Folder::new();
    let limits = crate::input::Limits::default();
    for number in [10, 9, 1] {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        encoder.write_image::<colortype::Gray8>(1, 1, &[number]).unwrap();
        folder.write(&format!("s{number}.tif"), file.into_inner());
    }
    folder.write("notes.txt", "not a page");
    let load = || {
        let source = Source::open_any(folder.as_ref(), &limits)?;
        let default = ReadOptions::default();
        assert_eq!(Kind::of_source(&source, &default)?, Some(Kind::Volume));
        crate::formats::read_volume(&source, &default)
    };
    let volume = load().unwrap();
    assert_eq!((volume.lattice.dims, values(&volume)), ([1, 1, 3], vec![1.0, 9.0, 10.0]));
    folder.write("s2.tif", bytes_of(1, "", Compression::Uncompressed));
    let error = load().unwrap_err().to_string();
    assert!(error.contains("s2.tif: page: has 3 × 2 pixels of u8, but the first"), "{error}");
    folder.write("s2.tif", bytes_of(2, "", Compression::Uncompressed));
    assert!(load().unwrap_err().to_string().contains("has several pages"));
}

#[test]
fn cuts_and_lies_are_errors() {
    let folder = Folder::new();
    let whole = bytes_of(2, "", Compression::Lzw);
    for end in 0..whole.len() {
        let path = folder.write("a.tif", &whole[..end]);
        assert!(
            read_with(&path, |source| read(source, &ReadOptions::default())).is_err(),
            "cut at {end} of {}",
            whole.len()
        );
    }
    let default = ReadOptions::default();
    let single = load(&bytes_of(1, "", Compression::Uncompressed), &default).unwrap();
    assert_eq!(single.lattice.dims, [3, 2, 1]);
    assert_eq!(single.about.orientation, Some(Orientation::Y_DOWN));
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap();
    encoder.write_image::<colortype::Gray8>(1, 1, &[1]).unwrap();
    encoder.write_image::<colortype::Gray8>(1, 2, &[1, 2]).unwrap();
    let uneven = load(&file.into_inner(), &default).unwrap_err().to_string();
    assert!(
        uneven.contains("page 1: has 1 × 2 pixels of u8, but the first page has 1 × 1"),
        "{uneven}"
    );
    let lie = [
        (256, 4, u32::MAX),
        (257, 4, u32::MAX),
        (258, 3, 8),
        (259, 3, 1),
        (262, 3, 1),
        (273, 4, 8),
        (278, 4, u32::MAX),
        (279, 4, 2),
    ];
    assert!(load(&by_hand(false, &lie, &[1, 2]), &default).is_err());
    let limits = crate::input::Limits::default();
    let tiff = bytes_of(2, "", Compression::Uncompressed);
    let source = Source::from_bytes(std::path::Path::new("a"), &tiff, &limits).unwrap();
    assert_eq!(Kind::of_source(&source, &default).unwrap(), Some(Kind::Volume));
}

#[test]
fn channels_are_read_in_the_colours_of_the_file() {
    let text = "<?xml version='1.0'?><OME xmlns='http'><Image><Pixels DimensionOrder='XYCZT' \
                SizeC='2' SizeZ='2' SizeT='1'><Channel Name='DAPI &amp; co' Color='65535'/>\
                <Channel EmissionWavelength='520'/></Pixels></Image></OME>";
    let bytes = bytes_of(4, text, Compression::Lzw);
    let all = ReadOptions { channels: Some(Vec::new()), ..ReadOptions::default() };
    let volume = load(&bytes, &all).unwrap();
    assert_eq!((volume.about.name.as_str(), volume.about.channel), ("DAPI & co", 0));
    assert_eq!(volume.about.channels[0].color, Some([0.0, 0.0, 1.0]));
    let green = volume.about.channels[1].color.unwrap();
    assert!(green[1] > 0.9 && green[0] < 0.3, "{green:?}");
    let [second] = &volume.more_channels[..] else { panic!("two channels") };
    assert_eq!((second.about.name.as_str(), second.about.channel), ("channel 1", 1));
    let named = |name: &str| ReadOptions { channels: Some(vec![name.into()]), ..all.clone() };
    let alone = load(&bytes, &named("1")).unwrap();
    assert_eq!(values(&alone), values(second));
    assert_ne!(values(&alone), values(&volume));
    assert!(load(&bytes, &named("GFP")).unwrap_err().to_string().contains("DAPI & co"));
}
