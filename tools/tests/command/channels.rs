//! Files of several channels, and pictures.

use crate::common::*;
use std::fs;

/// Returns an uncompressed TIFF file of pages of 16 × 8 bytes, of which the first has this text.
fn tiff(text: &str, pages: &[[u8; 128]]) -> Vec<u8> {
    let mut file = b"II\x2a\0".to_vec();
    // Where the next directory is: behind the text and the pixels of all pages.
    let directories = 8 + text.len() + 1 + 128 * pages.len();
    let place = |page: usize| (directories + page * (2 + 7 * 12 + 4)) as u32;
    file.extend(place(0).to_le_bytes());
    file.extend(text.as_bytes());
    file.push(0);
    let pixels = file.len();
    file.extend(pages.as_flattened());
    for page in 0..pages.len() {
        file.extend(7u16.to_le_bytes());
        let length = if page == 0 { text.len() as u32 + 1 } else { 0 };
        for (tag, kind, count, value) in [
            (256u16, 3u16, 1, 16),
            (257, 3, 1, 8),
            (258, 3, 1, 8),
            (262, 3, 1, 1),
            (if length > 0 { 270 } else { 266 }, 2, length.max(1), if length > 0 { 8 } else { 1 }),
            (273, 4, 1, (pixels + 128 * page) as u32),
            (279, 4, 1, 128),
        ] {
            file.extend(tag.to_le_bytes());
            file.extend(kind.to_le_bytes());
            file.extend(u32::to_le_bytes(count));
            file.extend(value.to_le_bytes());
        }
        let next = if page + 1 < pages.len() { place(page + 1) } else { 0 };
        file.extend(next.to_le_bytes());
    }
    file
}

/// A file of OME of two channels: a block on the left in one, and one on the right in the other.
fn channels() -> Vec<u8> {
    let text = "<?xml version='1.0'?><OME xmlns='o'><Image><Pixels DimensionOrder='XYCZT' \
                SizeC='2' SizeZ='8' SizeT='1'><Channel Name='DAPI' Color='65535'/><Channel \
                Name='GFP' Color='16711935'/></Pixels></Image></OME>";
    let page = |page: usize| -> [u8; 128] {
        let (z, channel) = (page / 2, page % 2);
        std::array::from_fn(|at| {
            let (x, y) = (at % 16, at / 16);
            let is_inside = [x % 8, y, z].iter().all(|place| (2..6).contains(place));
            if x / 8 == channel && is_inside { 220 } else { 8 + (at % 3) as u8 }
        })
    };
    tiff(text, &std::array::from_fn::<_, 16, _>(page))
}

/// Returns the pixels of a picture: red, green and blue.
fn pixels(folder: &Folder, name: &str) -> (usize, Vec<[u8; 3]>) {
    let file = fs::File::open(folder.path(name)).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let channels = info.color_type.samples();
    let pixel = |pixel: &[u8]| [pixel[0], pixel[1], pixel[2]];
    (info.width as usize, bytes[..info.buffer_size()].chunks_exact(channels).map(pixel).collect())
}

/// Returns the sums of red, green and blue over the halves of a picture.
fn halves(folder: &Folder, name: &str) -> [[u64; 3]; 2] {
    let (width, pixels) = pixels(folder, name);
    let mut sums = [[0; 3]; 2];
    for (at, pixel) in pixels.iter().enumerate() {
        let half = usize::from(at % width >= width / 2);
        (0..3).for_each(|part| sums[half][part] += u64::from(pixel[part]));
    }
    sums
}

#[test]
fn channels_are_drawn_in_their_colours() {
    let folder = Folder::new();
    folder.put("a.ome.tif", channels());
    let draw = |flags: &str| {
        folder.json(&format!(
            "render a.ome.tif -o a.png --json --overwrite --engine cpu --size 64x48 --view front \
             --background black {flags}"
        ));
        halves(&folder, "a.png")
    };
    for flags in ["", "--mip", "--iso 50%"] {
        let [[_, left_green, left_blue], [_, right_green, right_blue]] = draw(flags);
        assert!(left_blue > 2 * left_green && right_green > 2 * right_blue, "{flags}");
    }
    // The camera is fitted to the only one that is left.
    for [red, green, blue] in draw("--channels gfp:red") {
        assert!(red > 4 * green && red > 4 * blue, "{red} {green} {blue}");
    }
    assert_eq!(
        folder.json("info a.ome.tif --json")["channels"],
        serde_json::json!(["DAPI", "GFP"])
    );
    let unknown = folder.run("render a.ome.tif -o b.png --channels YFP");
    unknown.fails(3, &["no channel “YFP”", "the channels are 0 (DAPI), 1 (GFP)"]);
    let both = folder.run("render a.ome.tif -o b.png --channels 0 --scalar channel:1");
    both.fails(2, &["not both"]);
    assert!(fs::metadata(folder.path("b.png")).is_err());
}

#[test]
fn pictures_are_drawn_as_they_are() {
    let folder = Folder::new();
    let color =
        |x: usize, y: usize| [if x < 12 { 200 } else { 10 }, if y < 12 { 150 } else { 10 }, 30];
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 24, 24);
    encoder.set_color(png::ColorType::Rgb);
    let picture: Vec<u8> = (0..24 * 24).flat_map(|at| color(at % 24, at / 24)).collect();
    encoder.write_header().unwrap().write_image_data(&picture).unwrap();
    folder.put("p.png", &bytes);
    folder.json("render p.png -o a.png --json --engine cpu --size 120x120 --samples 1");
    let (width, drawn) = pixels(&folder, "a.png");
    for [x, y] in [[30, 30], [90, 30], [30, 90], [90, 90]] {
        let [there, here] = [color(x / 5, y / 5), drawn[y * width + x]];
        let differs = there.iter().zip(here).any(|(a, b)| a.abs_diff(b) > 2);
        assert!(!differs, "{x}, {y}: {there:?} {here:?}");
    }
    // The picture of a picture does not replace it.
    folder.run("p.png").ok();
    assert!(fs::metadata(folder.path("p_2.png")).is_ok());
    assert_eq!(fs::read(folder.path("p.png")).unwrap(), bytes);
}

#[test]
fn each_channel_has_a_panel() {
    let folder = Folder::new();
    folder.put("a.ome.tif", channels());
    folder.put("b.nrrd", nrrd("uint8", &ball()));
    let flags = "--engine cpu --panel-labels none --size 192x64 --samples 1";
    folder.run(&format!("render a.ome.tif -o a.png --split-channels {flags}")).ok();
    let (width, pixels) = pixels(&folder, "a.png");
    let sums: Vec<[u64; 3]> = (0..3)
        .map(|panel| {
            let inside = |at: usize| (panel * 64..(panel + 1) * 64).contains(&(at % width));
            let of = pixels.iter().enumerate().filter(|(at, _)| inside(*at));
            of.fold([0; 3], |sum, (_, pixel)| {
                [0, 1, 2].map(|part| sum[part] + u64::from(pixel[part]))
            })
        })
        .collect();
    let [blue, green, both] = sums[..] else { panic!("three panels") };
    assert!(blue[2] > 3 * blue[1] && green[1] > 3 * green[2], "{sums:?}");
    assert!(both[2] * 2 > blue[2] && both[1] * 2 > green[1], "{sums:?}");
    folder
        .run("render b.nrrd -o b.png --split-channels")
        .fails(2, &["--split-channels", "several"]);
}
